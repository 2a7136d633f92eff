//! Light of a lamp without extent at points inside a medium, through its smooth refracting boundary.
//!
//! No path from a point inside hits such a lamp: of all directions only those count from which the boundary refracts to
//! exactly the lamp. They are found by the triangles that the lamp shines on: each refracts its light into a beam, and a
//! point is lit through those triangles in whose beams it lies [Walter2009]. Beams are cut into short pieces, whose boxes
//! are searched as a tree; inside a piece Newton's method finds the place on the triangle. Radiance per squared index is
//! the same on both sides, so the light that arrives is the transmittance and the attenuation times the lamp's own, over
//! how fast the direction (or, for a point light, the place at the light's distance) changes outside when it turns inside.
//!
//! What this leaves out: light that is reflected inside the boundary before it scatters for the first time.

use super::boundary::Facing;
use super::light::Kind;
use super::world::{Matter, Place, Thing, World};
use crate::optics::Rgb;
use glam::{DVec2, DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;

/// The beams of one lamp into one thing.
pub struct Refracted {
    pub lamp: usize,
    pub thing: usize,
    kind: Kind,
    ior: f64,
    triangles: Vec<Triangle>,
    tree: Bvh2,
    /// The triangle of each piece, and how far below the boundary it begins.
    pieces: Vec<(u32, f64)>,
    /// Tree coordinates are (world - center) / scale.
    center: DVec3,
    scale: f64,
}

/// World space.
struct Triangle {
    place: Place,
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    flat: DVec3,
    /// How much the beam's direction changes over the triangle at most.
    across: f64,
    /// The shortest of its heights.
    height: f64,
}

/// Attenuation beyond which light is below f64's own rounding against what comes the short way.
const FAINTEST: f64 = 36.0;

/// Light within so many mean free paths is always found.
const SURE: f64 = 2.0;

/// At most so many pieces a triangle.
const PIECES: usize = 64;

impl Refracted {
    /// None where no light is refracted by a smooth boundary: an index of 1, a rough one ([`super::lobe`]), a lamp with extent.
    pub fn new(world: &World, lamp: usize, kind: &Kind, thing: usize) -> Option<Refracted> {
        let Matter::Translucent { surface, .. } = &world.things[thing].matter else { return None };
        if surface.ior == 1.0 || matches!(kind, Kind::Rect { .. }) || !surface.is_smooth() {
            return None;
        }
        let body = &world.things[thing];
        let mut triangles: Vec<Triangle> = (0..body.mesh.triangles.len())
            .filter_map(|t| Triangle::new(body, thing, t))
            .filter(|triangle| kind.towards(triangle.corners[0]).dot(triangle.flat) < 0.0)
            .collect();
        let (min, max) = triangles
            .iter()
            .flat_map(|t| t.corners)
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
        if triangles.is_empty() {
            return None;
        }
        // Every point inside lies within the thing's own box, so no beam need be longer than its diagonal.
        let bounds = body.mesh.bounds();
        let diagonal = bounds.diagonal();
        let sigma = world.fill(thing).thinnest();
        let reach = if sigma > 0.0 { diagonal.min(FAINTEST / sigma) } else { diagonal };
        let (center, scale) = (0.5 * (min + max), (max - min).max_element().max(f64::MIN_POSITIVE));
        let boxed: Vec<Vec<(Aabb, f64)>> =
            triangles.par_iter_mut().map(|t| t.pieces(kind, surface.ior, reach, center, scale)).collect();
        let pieces = boxed.iter().enumerate();
        let pieces = pieces.flat_map(|(i, boxes)| boxes.iter().map(move |(_, near)| (i as u32, *near))).collect();
        let boxes: Vec<Aabb> = boxed.into_iter().flatten().map(|(b, _)| b).collect();
        let tree = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Default::default());
        Some(Refracted { lamp, thing, kind: kind.clone(), ior: surface.ior, triangles, tree, pieces, center, scale })
    }

    /// Calls `found` for directions from `p`, inside the thing, in which the boundary shows the lamp: the direction
    /// towards it, and irradiance on a particle there, per squared index. What is far below the boundary finds it the more
    /// rarely the fainter it is, and then as much brighter: `luck`, exponentially distributed with mean 1, says whether,
    /// `sigma` being the least extinction. `through` is the share of light that a direction and a length leave.
    pub fn each(
        &self,
        world: &World,
        p: DVec3,
        shadow: bool,
        (sigma, luck): (f64, f64),
        mut through: impl FnMut(DVec3, f64) -> Rgb,
        mut found: impl FnMut(DVec3, Rgb),
    ) {
        let reach = if sigma > 0.0 { (SURE + luck) / sigma } else { f64::INFINITY };
        let local = ((p - self.center) / self.scale).as_vec3a();
        // The pieces of one triangle overlap: each triangle counts once.
        let mut seen: [u32; 256] = [u32::MAX; 256];
        let mut count = 0;
        let mut far: Vec<u32> = Vec::new();
        self.tree.point_traverse(local, |tree, node| {
            let node = &tree.nodes[node as usize];
            for i in node.first_index..node.first_index + node.prim_count {
                let (triangle, near) = self.pieces[tree.primitive_indices[i as usize] as usize];
                if near > reach || !self.triangles[triangle as usize].may_light(&self.kind, self.ior, p) {
                    continue;
                }
                if seen[..count].contains(&triangle) || far.contains(&triangle) {
                    continue;
                }
                match count < seen.len() {
                    true => {
                        seen[count] = triangle;
                        count += 1;
                    }
                    false => far.push(triangle),
                }
            }
            true
        });
        for &i in seen[..count].iter().chain(&far) {
            let triangle = &self.triangles[i as usize];
            let Some(at) = triangle.solve(&self.kind, self.ior, p) else { continue };
            let length = triangle.point(at).distance(p);
            if length > reach {
                continue;
            }
            if let Some((direction, light)) = self.light(world, triangle, at, p, shadow, &mut through) {
                found(direction, light * (sigma * length - SURE).max(0.0).exp());
            }
        }
    }

    fn light(
        &self,
        world: &World,
        triangle: &Triangle,
        at: DVec2,
        p: DVec3,
        shadow: bool,
        through: &mut impl FnMut(DVec3, f64) -> Rgb,
    ) -> Option<(DVec3, Rgb)> {
        let q = triangle.point(at);
        let (to, length) = ((q - p).normalize(), (q - p).length());
        let facing = triangle.facing(at, -1.0, 1.0 / self.ior);
        let split = facing.split(to);
        // What lies between: inside nothing, outside nothing that casts a shadow.
        if !world.is_free(p, to, length * (1.0 - 1e-12), Some(triangle.place)) {
            return None;
        }
        let out = split.refracted?;
        let distance = match self.kind {
            Kind::Point { position, .. } => (position - q).length(),
            _ => f64::INFINITY,
        };
        if shadow && !world.is_free(q, out, distance * (1.0 - 1e-9), Some(triangle.place)) {
            return None;
        }
        let power = match self.kind {
            Kind::Directional { irradiance, .. } => irradiance,
            Kind::Point { intensity, .. } => intensity,
            Kind::Rect { .. } => unreachable!("a lamp with extent is found by paths"),
        };
        let spread = self.spread(triangle, p, to, length)?;
        let through = (1.0 - split.reflectance) * through(to, length);
        Some((to, through * power / spread))
    }

    /// How much the direction outside changes (directional light), or the place at the light's distance (point light),
    /// when the direction from `p` turns: the product of both per solid angle inside.
    fn spread(&self, triangle: &Triangle, p: DVec3, to: DVec3, length: f64) -> Option<f64> {
        let (x, y) = to.any_orthonormal_pair();
        // So small that the triangle's edges hardly matter, so large that f64 keeps ten digits.
        let h = 1e-5 * (triangle.size() / length).min(1.0);
        let place = |turned: DVec3| -> Option<DVec3> {
            let d = turned.normalize();
            let t = (triangle.corners[0] - p).dot(triangle.flat) / d.dot(triangle.flat);
            let q = p + t * d;
            let out = triangle.facing(triangle.barycentrics(q), -1.0, 1.0 / self.ior).split(d).refracted?;
            Some(match self.kind {
                Kind::Point { position, .. } => q + (position - q).dot(out) * out - position,
                _ => out,
            })
        };
        let along = |axis: DVec3| Some((place(to + h * axis)? - place(to - h * axis)?) / (2.0 * h));
        Some(along(x)?.cross(along(y)?).length())
    }
}

impl Kind {
    /// The way the lamp's light travels at a point, unit length.
    fn towards(&self, p: DVec3) -> DVec3 {
        match self {
            Kind::Directional { direction, .. } => *direction,
            Kind::Point { position, .. } => (p - position).normalize(),
            Kind::Rect { .. } => unreachable!("a lamp with extent is found by paths"),
        }
    }
}

impl Triangle {
    /// None for one without area.
    fn new(body: &Thing, thing: usize, t: usize) -> Option<Triangle> {
        let corners = body.mesh.corners(t).map(|p| body.world_from_object.transform_point3(p));
        let [a, b, c] = corners;
        if (b - a).cross(c - a).length_squared() == 0.0 {
            return None;
        }
        let at = [DVec2::ZERO, DVec2::X, DVec2::Y].map(|at| body.normals(t, at));
        Some(Triangle {
            place: (thing as u32, t as u32),
            corners,
            normals: body.mesh.triangles[t]
                .map(|v| (body.turn * body.mesh.normals[v as usize].as_dvec3()).normalize_or(at[0].0)),
            flat: at[0].0,
            across: 0.0,
            height: (b - a).cross(c - a).length() / a.distance(b).max(b.distance(c)).max(c.distance(a)),
        })
    }

    fn size(&self) -> f64 {
        let [a, b, c] = self.corners;
        a.distance(b).min(b.distance(c)).min(c.distance(a))
    }

    fn point(&self, at: DVec2) -> DVec3 {
        let [a, b, c] = self.corners;
        (1.0 - at.x - at.y) * a + at.x * b + at.y * c
    }

    /// Of a point of the triangle's plane.
    fn barycentrics(&self, p: DVec3) -> DVec2 {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let area = normal.length_squared();
        let share = |u: DVec3, v: DVec3| u.cross(v).dot(normal) / area;
        DVec2::new(share(p - a, c - a), share(b - a, p - a))
    }

    /// The boundary there, seen from outside (`side` 1) or inside (-1).
    fn facing(&self, at: DVec2, side: f64, eta: f64) -> Facing {
        let [i, j, k] = self.normals;
        let mut normal = ((1.0 - at.x - at.y) * i + at.x * j + at.y * k).normalize_or(self.flat);
        if normal.dot(self.flat) < 0.0 {
            normal = -normal;
        }
        Facing { flat: side * self.flat, normal: side * normal, eta, roughness: 0.0 }
    }

    /// The beam's direction below a place.
    fn beam(&self, kind: &Kind, ior: f64, at: DVec2) -> Option<DVec3> {
        self.facing(at, 1.0, ior).split(kind.towards(self.point(at))).refracted
    }

    /// Boxes around the beam, piece by piece, in tree coordinates, and how far below the boundary each begins.
    fn pieces(&mut self, kind: &Kind, ior: f64, reach: f64, center: DVec3, scale: f64) -> Vec<(Aabb, f64)> {
        let corners = [DVec2::ZERO, DVec2::X, DVec2::Y];
        let Some(beams) = corners.iter().map(|at| self.beam(kind, ior, *at)).collect::<Option<Vec<DVec3>>>() else {
            return Vec::new();
        };
        let apart = |i: usize, j: usize| beams[i].distance(beams[j]);
        // Directions in between lie on an arc, not on the chord: this far off at most, with room to spare.
        self.across = apart(0, 1).max(apart(1, 2)).max(apart(2, 0));
        let bulge = self.across * self.across;
        let size = self.corners[0].distance(self.corners[1]).max(self.corners[0].distance(self.corners[2]));
        let count = ((reach / (2.0 * size)).ceil() as usize).clamp(1, PIECES);
        let along = |i: usize, s: f64| self.corners[i] + s * beams[i];
        (0..count)
            .map(|k| {
                let (near, far) = (reach * k as f64 / count as f64, reach * (k + 1) as f64 / count as f64);
                let points: Vec<Vec3A> = (0..3)
                    .flat_map(|i| [along(i, near), along(i, far)])
                    .map(|p| ((p - center) / scale).as_vec3a())
                    .collect();
                let b = Aabb::from_points(&points);
                // And f32's rounding.
                let room = (bulge * far / scale) as f32 + 1e-5;
                (Aabb::new(b.min - room, b.max + room), near)
            })
            .collect()
    }

    /// Whether `p` may lie in the beam at all. Were the beam the same everywhere, this would say it; by how much it is not
    /// says how far off that can be.
    fn may_light(&self, kind: &Kind, ior: f64, p: DVec3) -> bool {
        let Some(beam) = self.beam(kind, ior, DVec2::splat(1.0 / 3.0)) else { return true };
        let down = -beam.dot(self.flat);
        let s = (self.corners[0] - p).dot(self.flat) / down;
        let at = self.barycentrics(p - s * beam);
        let room = 1.5 * self.across * s / (down * self.height) + 1e-3;
        s > 0.0 && at.min_element() >= -room && at.element_sum() <= 1.0 + room
    }

    /// The place on the triangle whose beam goes through `p`.
    fn solve(&self, kind: &Kind, ior: f64, p: DVec3) -> Option<DVec2> {
        // In the triangle's own coordinates, where its plane is z = 0: where the beam would come from.
        let miss = |at: DVec2| -> Option<DVec2> {
            let beam = self.beam(kind, ior, at)?;
            let s = (p - self.corners[0]).dot(self.flat) / beam.dot(self.flat);
            (s > 0.0).then(|| self.barycentrics(p - s * beam) - at)
        };
        let mut at = DVec2::splat(1.0 / 3.0);
        const STEP: f64 = 1e-6;
        for _ in 0..20 {
            let error = miss(at)?;
            if error.abs().max_element() < 1e-10 {
                let on = at.x >= 0.0 && at.y >= 0.0 && at.x + at.y <= 1.0;
                return on.then_some(at);
            }
            let x = (miss(at + STEP * DVec2::X)? - error) / STEP;
            let y = (miss(at + STEP * DVec2::Y)? - error) / STEP;
            let det = x.x * y.y - x.y * y.x;
            let step = -DVec2::new(error.x * y.y - error.y * y.x, x.x * error.y - x.y * error.x) / det;
            if !step.is_finite() {
                return None;
            }
            // A place far off the triangle has normals that nobody made: stay near.
            at = (at + step).clamp(DVec2::splat(-1.0), DVec2::splat(2.0));
        }
        None
    }
}
