//! Which point of a mesh lies closest to a point of space: a binary hierarchy of boxes over the triangles, the nearer box
//! first, and none that is farther away than what was found already.
//!
//! The tree keeps the mesh's own f32 corners, times a power of two that keeps their areas in range, so its boxes are exact;
//! distances to boxes and triangles are f64. Nothing is lost but f64's own rounding.

use std::time::Duration;

use glam::{DVec2, DVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use crate::geometry::mesh::Mesh;

pub struct Nearest {
    tree: Bvh2,
    /// In the order of the tree's leaves and in its coordinates.
    corners: Vec<[Vec3; 3]>,
    /// The triangle that each of `corners` comes from.
    source: Vec<u32>,
    /// Tree coordinates are the mesh's over this power of two.
    scale: f64,
}

/// A point of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// From the point that was asked about, in the mesh's unit.
    pub distance: f64,
    pub triangle: u32,
    /// The weights of the triangle's second and third corner; the first one has what is left of 1.
    pub barycentrics: DVec2,
}

/// The best place so far among `corners`, and its squared distance in tree coordinates.
struct Best {
    squared: f64,
    found: Option<(usize, DVec2)>,
}

impl Nearest {
    pub fn new(mesh: &Mesh) -> Nearest {
        let extent = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max) as f64;
        let scale = if extent > 0.0 { extent.log2().ceil().exp2() } else { 1.0 };
        let corners: Vec<[Vec3; 3]> =
            (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| (p / scale).as_vec3())).collect();
        let boxes: Vec<Aabb> = corners.iter().map(|t| Aabb::from_points(&t.map(Vec3A::from))).collect();
        let tree = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let source = tree.primitive_indices.clone();
        Nearest { corners: source.iter().map(|&i| corners[i as usize]).collect(), source, tree, scale }
    }

    /// The mesh's point that is closest to `p`, of several one of them. None where nothing lies nearer than `within`: the
    /// sooner it may give up, the less is searched.
    pub fn find(&self, p: DVec3, within: f64) -> Option<Closest> {
        let mut best = Best { squared: (within / self.scale).powi(2), found: None };
        if !self.tree.nodes.is_empty() {
            self.visit(0, p / self.scale, &mut best);
        }
        let (place, barycentrics) = best.found?;
        Some(Closest { distance: best.squared.sqrt() * self.scale, triangle: self.source[place], barycentrics })
    }

    fn visit(&self, node: usize, p: DVec3, best: &mut Best) {
        let node = &self.tree.nodes[node];
        let first = node.first_index as usize;
        if node.is_leaf() {
            for i in first..first + node.prim_count as usize {
                let (squared, barycentrics) = closest(self.corners[i].map(|corner| corner.as_dvec3()), p);
                if squared < best.squared {
                    *best = Best { squared, found: Some((i, barycentrics)) };
                }
            }
            return;
        }
        let [a, b] = [first, first + 1].map(|child| (self.box_distance_squared(child, p), child));
        for (squared, child) in if a.0 <= b.0 { [a, b] } else { [b, a] } {
            if squared < best.squared {
                self.visit(child, p, best);
            }
        }
    }

    fn box_distance_squared(&self, node: usize, p: DVec3) -> f64 {
        let b = self.tree.nodes[node].aabb();
        let out = (b.min.as_dvec3() - p).max(p - b.max.as_dvec3()).max(DVec3::ZERO);
        out.length_squared()
    }
}

/// Of the triangle's point that is closest to `p`: squared distance, and the weights of the second and third corner.
fn closest([a, b, c]: [DVec3; 3], p: DVec3) -> (f64, DVec2) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let measured = |at: DVec2| ((ap - at.x * ab - at.y * ac).length_squared(), at);
    // Straight above or below: the weights are areas. They are no numbers for a triangle without area, which has edges.
    let normal = ab.cross(ac);
    let share = |u: DVec3, v: DVec3| u.cross(v).dot(normal) / normal.length_squared();
    let at = DVec2::new(share(ap, ac), share(ab, ap));
    if at.x >= 0.0 && at.y >= 0.0 && at.x + at.y <= 1.0 {
        return (ap.dot(normal).powi(2) / normal.length_squared(), at);
    }
    let along = |from: DVec3, edge: DVec3| match edge.length_squared() {
        0.0 => 0.0,
        squared => ((p - from).dot(edge) / squared).clamp(0.0, 1.0),
    };
    let (on_ab, on_ac, on_bc) = (along(a, ab), along(a, ac), along(b, c - b));
    [DVec2::new(on_ab, 0.0), DVec2::new(0.0, on_ac), DVec2::new(1.0 - on_bc, on_bc)]
        .map(measured)
        .into_iter()
        .min_by(|x, y| x.0.total_cmp(&y.0))
        .expect("a triangle has edges")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use crate::geometry::visibility::directions;
    use glam::DAffine3;

    /// Every triangle.
    fn brute_force(mesh: &Mesh, p: DVec3) -> f64 {
        (0..mesh.triangles.len()).map(|t| closest(mesh.corners(t), p).0.sqrt()).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn a_triangles_closest_point_is_closer_than_all_others() {
        let triangles = [
            [DVec3::ZERO, DVec3::X, DVec3::new(0.3, 0.8, 0.1)],
            // A needle, a line, a point.
            [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 1e-9, 0.0)],
            [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X],
            [DVec3::Y; 3],
        ];
        let n = 60;
        for [a, b, c] in triangles {
            for p in directions(200).into_iter().flat_map(|d| [0.3 * d, 2.0 * d]) {
                let (squared, at) = closest([a, b, c], p);
                let found = a + at.x * (b - a) + at.y * (c - a);
                assert!((found.distance(p) - squared.sqrt()).abs() < 1e-12);
                assert!(at.x >= 0.0 && at.y >= 0.0 && at.x + at.y <= 1.0 + 1e-15, "{at}");
                let mut sampled = f64::INFINITY;
                for (i, j) in (0..=n).flat_map(|i| (0..=n - i).map(move |j| (i, j))) {
                    let (v, w) = (i as f64 / n as f64, j as f64 / n as f64);
                    sampled = sampled.min((a + v * (b - a) + w * (c - a)).distance(p));
                }
                assert!(squared.sqrt() <= sampled + 1e-12 && sampled - squared.sqrt() < 2.0 / n as f64);
            }
        }
    }

    #[test]
    fn agrees_with_every_triangle_at_any_scale_and_place() {
        let knot = || shapes::torus_knot(2, 3, 1.0, 0.2, (60, 10));
        let moved = shapes::sphere(0.01, 3).transformed(&DAffine3::from_translation(DVec3::splat(50.0)));
        for (mesh, center, size) in [
            (knot(), DVec3::ZERO, 2.0),
            (moved, DVec3::splat(50.0), 0.01),
            (shapes::cuboid(DVec3::ONE), DVec3::ZERO, 1.0),
        ] {
            for scale in [1.0, 1e-25, 1e25] {
                let mesh = mesh.transformed(&DAffine3::from_scale(DVec3::splat(scale)));
                let nearest = Nearest::new(&mesh);
                for (i, d) in directions(256).into_iter().enumerate() {
                    let p = scale * (center + size * [0.1, 0.45, 1.0, 30.0][i % 4] * d);
                    let found = nearest.find(p, f64::INFINITY).unwrap();
                    let expected = brute_force(&mesh, p);
                    assert_eq!(nearest.find(p, 1.001 * expected), Some(found));
                    assert_eq!(nearest.find(p, 0.999 * expected), None);
                    assert!((found.distance - expected).abs() <= 1e-14 * expected, "{found:?} {expected}");
                    let [a, b, c] = mesh.corners(found.triangle as usize);
                    let at = found.barycentrics;
                    let q = a + at.x * (b - a) + at.y * (c - a);
                    assert!((q.distance(p) / found.distance - 1.0).abs() < 1e-9, "{found:?}");
                }
            }
        }
    }

    #[test]
    fn the_depth_below_a_plane_has_all_its_digits() {
        let slab = Nearest::new(&shapes::slab(DVec3::new(40.0, 20.0, 40.0), (3, 3)));
        for depth in [0.0, 1e-12, 0.1, 1.0 / 3.0, 7.0] {
            let found = slab.find(DVec3::new(0.7, 10.0 - depth, -0.3), f64::INFINITY).unwrap();
            assert!((found.distance - depth).abs() < 4e-15, "{found:?}");
        }
        assert_eq!(Nearest::new(&Mesh::default()).find(DVec3::ZERO, f64::INFINITY), None);
    }
}
