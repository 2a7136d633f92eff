//! Which triangle a ray hits: a binary hierarchy of boxes over the triangles of several objects in world space.
//!
//! The tree works in f32 inside a cube of side about 1, whatever the scene's size and place; boxes are padded against
//! its rounding. Triangles are tested in f64 by signed volumes that two triangles at an edge compute alike, so no ray
//! slips through between them.

use std::time::Duration;

use glam::{DAffine3, DVec2, DVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{INVALID_ID, Ray, RayHit};

use crate::geometry::mesh::Mesh;

/// More than the tree's rounding (1e-7) and less than any ray offset.
const PADDING: f32 = 1e-6;

/// Of a signed volume in tree coordinates, f64. Within it a ray through a vertex belongs to every triangle there: their
/// signs need not agree on one.
const ROUNDING: f64 = 1e-14;

pub struct Bvh {
    tree: Bvh2,
    /// In the order of the tree's leaves and in its coordinates.
    corners: Vec<[Vec3; 3]>,
    /// The object and the triangle that each of `corners` comes from.
    source: Vec<(u32, u32)>,
    /// Tree coordinates are (world - center) / scale; a power of two, so that scaling is exact.
    center: DVec3,
    scale: f64,
    /// Scene units.
    diagonal: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, scene units.
    pub t: f64,
    pub object: u32,
    pub triangle: u32,
    /// The weights of the triangle's second and third corner; the first one has what is left of 1.
    pub barycentrics: DVec2,
}

/// A ray in tree coordinates whose origin lies at the scene, and how far it was moved there.
struct Local {
    origin: DVec3,
    direction: DVec3,
    t_min: f64,
    t_max: f64,
    moved: f64,
}

impl Bvh {
    /// Each mesh with its `world_from_object`.
    pub fn new(objects: &[(&Mesh, DAffine3)]) -> Bvh {
        let world = objects.iter().enumerate().flat_map(|(object, (mesh, world_from_object))| {
            (0..mesh.triangles.len()).map(move |t| {
                ((object as u32, t as u32), mesh.corners(t).map(|p| world_from_object.transform_point3(p)))
            })
        });
        let (source, world): (Vec<(u32, u32)>, Vec<[DVec3; 3]>) = world.unzip();
        let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (min, max) = world.iter().flatten().fold(nothing, |(min, max), p| (min.min(*p), max.max(*p)));
        let (center, size) = if world.is_empty() { (DVec3::ZERO, DVec3::ONE) } else { (0.5 * (min + max), max - min) };
        let extent = size.max_element();
        let scale = if extent > 0.0 { extent.log2().ceil().exp2() } else { 1.0 };
        let local = |p: DVec3| ((p - center) / scale).as_vec3();
        let corners: Vec<[Vec3; 3]> = world.iter().map(|t| t.map(local)).collect();
        let boxes: Vec<Aabb> = corners
            .iter()
            .map(|t| {
                let b = Aabb::from_points(&t.map(Vec3A::from));
                Aabb::new(b.min - PADDING, b.max + PADDING)
            })
            .collect();
        let tree = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let order = || tree.primitive_indices.iter().map(|&i| i as usize);
        Bvh {
            corners: order().map(|i| corners[i]).collect(),
            source: order().map(|i| source[i]).collect(),
            tree,
            center,
            scale,
            diagonal: size.length(),
        }
    }

    /// How far from a surface a ray must start not to meet it again, scene units: above all rounding, and small enough
    /// that contact shadows move by less than a pixel.
    pub fn offset(&self) -> f64 {
        3e-5 * self.diagonal
    }

    /// Whether anything lies between `t_min` and `t_max` (scene units) along the unit vector `direction`.
    pub fn any_hit(&self, origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> bool {
        let local = self.local(origin, direction, t_min, t_max);
        let ray = local.ray();
        !self.tree.ray_traverse_miss(ray, |_, i| match local.intersect(&self.corners[i]) {
            // Below tmax, which may be infinite, is all that the tree asks of a hit.
            Some(_) => 0.0,
            None => f32::INFINITY,
        })
    }

    /// The nearest triangle between `t_min` and `t_max` (scene units) along the unit vector `direction`, from either side.
    pub fn closest_hit(&self, origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> Option<Hit> {
        self.closest(self.local(origin, direction, t_min, t_max), |_| false)
    }

    /// The nearest triangle up to `t_max` (scene units), but for the object's triangle on which the ray starts: a plane is
    /// met only once, so a ray needs no offset to leave it.
    pub fn closest_hit_but(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
        start: Option<(u32, u32)>,
    ) -> Option<Hit> {
        self.closest(self.local(origin, direction, 0.0, t_max), |source| start == Some(source))
    }

    /// Every hit of one object by the whole line through `p` (scene units) along the unit vector `direction`, in the line's
    /// order; `t` is below 0 behind `p`.
    pub fn hits_along(&self, object: u32, p: DVec3, direction: DVec3) -> Vec<Hit> {
        let p = (p - self.center) / self.scale;
        // From end to end of the scene's sphere.
        let moved = -p.dot(direction) - 1.0;
        let local = Local { origin: p + moved * direction, direction, t_min: 0.0, t_max: 2.0, moved };
        let mut hits = Vec::new();
        self.tree.ray_traverse(local.ray(), &mut RayHit::none(), |_, i| {
            let (of, triangle) = self.source[i];
            if of == object
                && let Some((t, barycentrics)) = local.intersect(&self.corners[i])
            {
                hits.push(Hit { t: (t + moved) * self.scale, object, triangle, barycentrics });
            }
            // The line goes on.
            f32::INFINITY
        });
        hits.sort_by(|a, b| a.t.total_cmp(&b.t));
        hits
    }

    /// Every triangle as rays see it, scene units.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.corners.iter().map(|corners| corners.map(|p| self.scale * p.as_dvec3() + self.center))
    }

    fn closest(&self, mut local: Local, is_left_out: impl Fn((u32, u32)) -> bool) -> Option<Hit> {
        let mut best = None;
        let mut found = RayHit::none();
        self.tree.ray_traverse(local.ray(), &mut found, |_, i| match local.intersect(&self.corners[i]) {
            Some((t, barycentrics)) if !is_left_out(self.source[i]) => {
                local.t_max = t;
                let (object, triangle) = self.source[i];
                best = Some(Hit { t: (t + local.moved) * self.scale, object, triangle, barycentrics });
                t as f32
            }
            _ => f32::INFINITY,
        });
        debug_assert!(best.is_some() || found.primitive_id == INVALID_ID);
        best
    }

    fn local(&self, origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> Local {
        let origin = (origin - self.center) / self.scale;
        // From far away f32 could not tell the boxes apart: start where the ray comes within the scene's sphere (the
        // cube's half diagonal is below 1).
        let moved = (-origin.dot(direction) - 1.0).max(0.0);
        let (t_min, t_max) = ((t_min / self.scale - moved).max(0.0), t_max / self.scale - moved);
        Local { origin: origin + moved * direction, direction, t_min, t_max, moved }
    }
}

impl Local {
    fn ray(&self) -> Ray {
        // The tree compares with < and its boxes are padded: so is the end of the ray.
        let t_max = self.t_max as f32 + PADDING;
        Ray::new(self.origin.as_vec3a(), self.direction.as_vec3a(), 0.0, t_max)
    }

    /// Where the ray meets the triangle: the signed volumes that the ray spans with the three edges must agree in sign.
    fn intersect(&self, corners: &[Vec3; 3]) -> Option<(f64, DVec2)> {
        let [a, b, c] = corners.map(|p| p.as_dvec3() - self.origin);
        let d = self.direction;
        let (u, v, w) = (d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a)));
        if u.min(v).min(w) < -ROUNDING && u.max(v).max(w) > ROUNDING {
            return None;
        }
        let total = u + v + w;
        if total == 0.0 {
            return None;
        }
        let (u, v, w) = (u / total, v / total, w / total);
        let t = d.dot(u * a + v * b + w * c);
        (t >= self.t_min && t <= self.t_max).then_some((t, DVec2::new(v, w)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use crate::geometry::visibility::directions;
    use glam::DQuat;

    fn objects() -> [(Mesh, DAffine3); 3] {
        let turn = DQuat::from_rotation_x(0.3) * DQuat::from_rotation_z(1.0);
        [
            (shapes::torus_knot(2, 3, 1.0, 0.2, (60, 10)), DAffine3::IDENTITY),
            (shapes::sphere(0.4, 3), DAffine3::from_translation(DVec3::new(0.3, 1.0, -0.2))),
            (shapes::cuboid(DVec3::ONE), DAffine3::from_scale_rotation_translation(DVec3::splat(-0.7), turn, DVec3::X)),
        ]
    }

    fn scene(world: DAffine3) -> (Vec<[DVec3; 3]>, Bvh) {
        let objects = objects();
        let placed: Vec<(&Mesh, DAffine3)> = objects.iter().map(|(mesh, place)| (mesh, world * *place)).collect();
        let corners = placed
            .iter()
            .flat_map(|(m, w)| (0..m.triangles.len()).map(|t| m.corners(t).map(|p| w.transform_point3(p))));
        (corners.collect(), Bvh::new(&placed))
    }

    /// Möller & Trumbore in f64, every triangle.
    fn brute_force(triangles: &[[DVec3; 3]], o: DVec3, d: DVec3) -> Option<f64> {
        let hit = |[a, b, c]: &[DVec3; 3]| {
            let (e, f) = (b - a, c - a);
            let p = d.cross(f);
            let u = p.dot(o - a) / e.dot(p);
            let q = (o - a).cross(e);
            let (v, t) = (d.dot(q) / e.dot(p), f.dot(q) / e.dot(p));
            (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
        };
        triangles.iter().filter_map(hit).min_by(f64::total_cmp)
    }

    #[test]
    fn agrees_with_every_triangle_at_any_scale_and_distance() {
        for (scale, far) in [(1.0, 1.0), (1e-25, 1.0), (1e25, 1.0), (1.0, 1e4)] {
            let (triangles, bvh) = scene(DAffine3::from_scale(DVec3::splat(scale)));
            let mut hits = 0;
            for (i, d) in directions(2048).into_iter().enumerate() {
                let target = 0.9 * directions(2048)[(i * 37) % 2048];
                let (o, d) = ((target - 3.0 * far * d) * scale, d);
                let expected = brute_force(&triangles, o, d);
                let hit = bvh.closest_hit(o, d, 0.0, f64::INFINITY);
                assert_eq!(bvh.any_hit(o, d, 0.0, f64::INFINITY), hit.is_some());
                match (hit, expected) {
                    (Some(hit), Some(t)) => {
                        hits += 1;
                        assert!((hit.t - t).abs() < 1e-5 * scale, "{hit:?} {t}");
                        let (mesh, place) = &objects()[hit.object as usize];
                        let [a, b, c] = mesh.corners(hit.triangle as usize).map(|p| place.transform_point3(p) * scale);
                        let [v, w] = hit.barycentrics.to_array();
                        let point = (1.0 - v - w) * a + v * b + w * c;
                        assert!(point.distance(o + hit.t * d) < 1e-5 * scale);
                        // The ends of the ray are where it is told.
                        assert!(!bvh.any_hit(o, d, 0.0, 0.999 * t) && bvh.any_hit(o, d, 0.0, 1.001 * t));
                        assert!(bvh.closest_hit(o, d, 1.001 * t, f64::INFINITY).is_none_or(|h| h.t > t));
                    }
                    (None, None) => (),
                    // f32 corners move silhouettes by their rounding.
                    _ => assert!(far > 1.0 || i % 2048 > 2040, "{hit:?} {expected:?}"),
                }
            }
            assert!(hits > 200 && hits < 2000, "{hits}");
        }
    }

    #[test]
    fn a_line_meets_what_rays_along_it_meet() {
        for scale in [1.0, 1e-25, 1e25] {
            let (_, bvh) = scene(DAffine3::from_scale(DVec3::splat(scale)));
            let mut most = 0;
            for (i, d) in directions(512).into_iter().enumerate() {
                let p = 0.9 * scale * directions(512)[(i * 37) % 512];
                let mut expected = vec![Vec::new(); 3];
                let (mut origin, mut start) = (p - 4.0 * scale * d, None);
                while let Some(hit) = bvh.closest_hit_but(origin, d, f64::INFINITY, start) {
                    origin += hit.t * d;
                    start = Some((hit.object, hit.triangle));
                    expected[hit.object as usize].push((hit.triangle, (origin - p).dot(d)));
                }
                for (object, expected) in expected.iter().enumerate() {
                    let hits = bvh.hits_along(object as u32, p, d);
                    assert_eq!(hits.len(), expected.len());
                    most = most.max(hits.len());
                    for (hit, (triangle, t)) in hits.iter().zip(expected) {
                        assert!(hit.triangle == *triangle && (hit.t - t).abs() < 1e-9 * scale, "{hit:?} {t}");
                    }
                }
            }
            assert!(most >= 6, "{most}");
        }
    }

    #[test]
    fn no_ray_leaves_a_closed_mesh() {
        for mesh in [shapes::sphere(1.0, 4), shapes::cuboid(DVec3::ONE), shapes::slab(DVec3::ONE, (8, 8))] {
            let bvh = Bvh::new(&[(&mesh, DAffine3::IDENTITY)]);
            // Through vertices and the middles of edges too.
            let aims = mesh.positions.iter().map(|p| p.as_dvec3()).chain(directions(4096));
            let middles = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).map(|[a, b, _]| 0.5 * (a + b));
            for aim in aims.chain(middles) {
                assert!(bvh.any_hit(DVec3::ZERO, aim.normalize(), 0.0, f64::INFINITY), "{aim}");
            }
        }
    }

    #[test]
    fn nothing_is_never_hit() {
        let empty = Bvh::new(&[]);
        assert!(!empty.any_hit(DVec3::ZERO, DVec3::X, 0.0, f64::INFINITY));
        assert_eq!(empty.closest_hit(DVec3::ZERO, DVec3::X, 0.0, 1.0), None);
        let one = Mesh { positions: vec![Vec3::X; 3], triangles: vec![[0, 1, 2]], ..Mesh::default() };
        assert!(!Bvh::new(&[(&one, DAffine3::IDENTITY)]).any_hit(DVec3::ZERO, DVec3::X, 0.0, f64::INFINITY));
    }
}
