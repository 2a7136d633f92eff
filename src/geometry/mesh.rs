//! Triangle meshes and what can be measured on them.
//!
//! A [`Mesh`] lives in its object's own space, in scene units; counter-clockwise triangles look outwards. Measures are
//! f64, so that products of f32 lengths neither overflow nor vanish: no function here holds an absolute epsilon, and a
//! mesh of any size is as good as one of size 1.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// `positions` and `normals` are of one length, so are `uvs` unless they are empty (there are none). Vertices that
/// differ in nothing but normal or uv repeat their position bit by bit ([`weld`]).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    /// Unit length, outwards.
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub triangles: Vec<[u32; 3]>,
}

/// An axis-aligned box. That of no points has `min` at +infinity and `max` at -infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Bounds {
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Bounds {
        let nothing = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };
        points.into_iter().fold(nothing, |b, p| Bounds { min: b.min.min(p), max: b.max.max(p) })
    }

    pub fn center(&self) -> DVec3 {
        0.5 * (self.min.as_dvec3() + self.max.as_dvec3())
    }

    pub fn size(&self) -> DVec3 {
        self.max.as_dvec3() - self.min.as_dvec3()
    }

    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }
}

impl Mesh {
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.positions.iter().copied())
    }

    /// The corners of triangle `t`.
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|v| self.positions[v as usize].as_dvec3())
    }

    /// Twice the triangle's area along its outward normal.
    fn area_vector(&self, t: usize) -> DVec3 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(c - a)
    }

    /// The unit normal of each triangle; zero where its corners lie on one line.
    pub fn face_normals(&self) -> Vec<DVec3> {
        (0..self.triangles.len()).map(|t| self.area_vector(t).normalize_or_zero()).collect()
    }

    pub fn face_areas(&self) -> Vec<f64> {
        (0..self.triangles.len()).map(|t| 0.5 * self.area_vector(t).length()).collect()
    }

    /// A third of the areas of the triangles around each vertex. They add up to the total area.
    pub fn vertex_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.positions.len()];
        for (triangle, area) in self.triangles.iter().zip(self.face_areas()) {
            for &v in triangle {
                areas[v as usize] += area / 3.0;
            }
        }
        areas
    }

    pub fn area(&self) -> f64 {
        self.face_areas().iter().sum()
    }

    /// The enclosed volume, positive when the triangles look outwards; it means something for closed meshes only.
    pub fn signed_volume(&self) -> f64 {
        // Measured from the middle of the bounds: far from the origin the terms would cancel.
        let o = self.bounds().center();
        let sixfold = |t| {
            let [a, b, c] = self.corners(t).map(|p| p - o);
            a.dot(b.cross(c))
        };
        (0..self.triangles.len()).map(sixfold).sum::<f64>() / 6.0
    }

    /// How the triangles hang together, equal positions taken as one vertex.
    pub fn topology(&self) -> Topology {
        Topology::of(self)
    }

    /// Whether the mesh is the boundary of a solid: every edge belongs to exactly two triangles, which run along it in
    /// opposite directions.
    pub fn is_closed(&self) -> bool {
        let topology = self.topology();
        topology.faces > 0 && topology.open_edges == 0 && topology.irregular_edges == 0
    }

    /// The mean length of the edges, each counted once; 0 without triangles.
    pub fn mean_edge_length(&self) -> f64 {
        let edges = edges(self);
        let length = |&(a, b): &(u32, u32)| {
            self.positions[a as usize].as_dvec3().distance(self.positions[b as usize].as_dvec3())
        };
        edges.iter().map(length).sum::<f64>() / (edges.len() as f64).max(1.0)
    }

    /// The mesh moved by `world_from_object`. Normals stay perpendicular and outward; a mirroring turns the triangles
    /// round, so that they still look outwards.
    pub fn transformed(&self, world_from_object: &DAffine3) -> Mesh {
        let linear = world_from_object.matrix3;
        let mirrors = linear.determinant() < 0.0;
        let normal_from_normal = cofactor(&linear) * if mirrors { -1.0 } else { 1.0 };
        Mesh {
            positions: self
                .positions
                .iter()
                .map(|p| world_from_object.transform_point3(p.as_dvec3()).as_vec3())
                .collect(),
            normals: self
                .normals
                .iter()
                .map(|n| (normal_from_normal * n.as_dvec3()).normalize_or_zero().as_vec3())
                .collect(),
            uvs: self.uvs.clone(),
            triangles: self.triangles.iter().map(|&[a, b, c]| if mirrors { [a, c, b] } else { [a, b, c] }).collect(),
        }
    }
}

/// det(M) M^-T, which exists for every M and turns area vectors as M turns points.
pub fn cofactor(m: &DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

/// For each vertex the first one at the same position. -0 and 0 are the same.
pub fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(positions.len());
    let at = |(i, p): (usize, &Vec3)| {
        let key = (*p + Vec3::ZERO).to_array().map(f32::to_bits);
        *first.entry(key).or_insert(i as u32)
    };
    positions.iter().enumerate().map(at).collect()
}

/// What [`Mesh::topology`] counts. Triangles with two corners at one place are no faces and have no edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topology {
    /// Those that belong to a face, equal positions counted once.
    pub vertices: usize,
    pub edges: usize,
    pub faces: usize,
    /// Parts that share no vertex.
    pub components: usize,
    /// Edges of one face.
    pub open_edges: usize,
    /// Edges of more than two faces, or of two that run the same way.
    pub irregular_edges: usize,
}

impl Topology {
    fn of(mesh: &Mesh) -> Topology {
        let welded = welded_triangles(mesh);
        let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        for &[a, b, c] in &welded {
            for (from, to) in [(a, b), (b, c)] {
                let (from, to) = (root(&mut parent, from), root(&mut parent, to));
                parent[from.max(to) as usize] = from.min(to);
            }
        }
        let mut used: Vec<u32> = welded.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();

        let mut topology = Topology {
            vertices: used.len(),
            edges: 0,
            faces: welded.len(),
            components: used.iter().filter(|&&v| parent[v as usize] == v).count(),
            open_edges: 0,
            irregular_edges: 0,
        };
        for edge in directed_edges(&welded).chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            topology.edges += 1;
            match edge {
                [_] => topology.open_edges += 1,
                [one, other] if one.2 != other.2 => (),
                _ => topology.irregular_edges += 1,
            }
        }
        topology
    }

    /// Vertices - edges + faces: 2 (1 - genus) for each closed component.
    pub fn euler(&self) -> i64 {
        self.vertices as i64 - self.edges as i64 + self.faces as i64
    }
}

fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

fn welded_triangles(mesh: &Mesh) -> Vec<[u32; 3]> {
    let weld = weld(&mesh.positions);
    let welded = mesh.triangles.iter().map(|t| t.map(|v| weld[v as usize]));
    welded.filter(|&[a, b, c]| a != b && b != c && c != a).collect()
}

/// (smaller end, larger end, whether the face runs from the smaller to the larger), sorted.
fn directed_edges(triangles: &[[u32; 3]]) -> Vec<(u32, u32, bool)> {
    let edge = |(a, b): (u32, u32)| (a.min(b), a.max(b), a < b);
    let mut edges: Vec<_> = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)].map(edge)).collect();
    edges.sort_unstable();
    edges
}

/// Every edge once, as (smaller, larger) welded vertex, sorted.
pub fn edges(mesh: &Mesh) -> Vec<(u32, u32)> {
    let mut edges: Vec<_> = directed_edges(&welded_triangles(mesh)).into_iter().map(|(a, b, _)| (a, b)).collect();
    edges.dedup();
    edges
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, vec3};

    fn tetrahedron() -> Mesh {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let normals = positions.iter().map(|p| (*p - Vec3::splat(0.25)).normalize()).collect();
        Mesh { positions, normals, uvs: vec![], triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
    }

    #[test]
    fn measures_of_a_tetrahedron() {
        let mesh = tetrahedron();
        assert!((mesh.signed_volume() - 1.0 / 6.0).abs() < 1e-15);
        assert!((mesh.area() - (1.5 + 0.75f64.sqrt())).abs() < 1e-15);
        assert!((mesh.vertex_areas().iter().sum::<f64>() - mesh.area()).abs() < 1e-15);
        assert!((mesh.mean_edge_length() - (3.0 + 3.0 * 2f64.sqrt()) / 6.0).abs() < 1e-15);
        assert!((mesh.bounds().diagonal() - 3f64.sqrt()).abs() < 1e-15);
        assert_eq!(mesh.topology().euler(), 2);
        assert!(mesh.is_closed());
    }

    #[test]
    fn split_vertices_still_close_and_a_hole_or_a_turned_face_does_not() {
        let closed = tetrahedron();
        let mut split = closed.clone();
        split.positions.push(vec3(-0.0, 0.0, 0.0));
        split.normals.push(Vec3::Y);
        split.triangles[1][0] = 4;
        assert!(split.is_closed());
        assert_eq!(split.topology(), closed.topology());

        let mut hole = closed.clone();
        hole.triangles.pop();
        assert_eq!(hole.topology().open_edges, 3);
        assert!(!hole.is_closed());
        let mut turned = closed.clone();
        turned.triangles[0].swap(0, 1);
        assert_eq!(turned.topology().irregular_edges, 3);
        assert!(!turned.is_closed());
        assert!(!Mesh::default().is_closed());

        let mut two = closed.clone();
        let far = closed.transformed(&DAffine3::from_translation(DVec3::splat(3.0)));
        two.triangles.extend(far.triangles.iter().map(|t| t.map(|v| v + 4)));
        two.positions.extend(far.positions);
        assert_eq!((two.topology().components, two.topology().euler()), (2, 4));
    }

    #[test]
    fn measures_hold_at_every_scale() {
        let mesh = tetrahedron();
        for scale in [1e-30, 1e-12, 1e12, 1e30] {
            let big = mesh.transformed(&DAffine3::from_scale(DVec3::splat(scale)));
            assert!((big.area() / (scale * scale) / mesh.area() - 1.0).abs() < 1e-6);
            assert!((big.signed_volume() / scale.powi(3) * 6.0 - 1.0).abs() < 1e-6);
            assert!((big.mean_edge_length() / scale / mesh.mean_edge_length() - 1.0).abs() < 1e-6);
            assert!(big.normals.iter().zip(&mesh.normals).all(|(a, b)| a.distance(*b) < 1e-6));
            assert!(big.face_normals().iter().all(|n| (n.length() - 1.0).abs() < 1e-12));
        }
    }

    #[test]
    fn transforms_keep_normals_perpendicular_and_volumes_positive() {
        let mut mesh = tetrahedron();
        mesh = mesh.with_normals(crate::geometry::normals::Normals::Flat);
        for scale in [DVec3::new(2.0, 0.5, 3.0), DVec3::new(-1.0, 2.0, 0.3), DVec3::splat(-1.0)] {
            let turn = DQuat::from_rotation_x(0.7) * DQuat::from_rotation_y(-1.1);
            let moved =
                mesh.transformed(&DAffine3::from_scale_rotation_translation(scale, turn, DVec3::new(5.0, -3.0, 1.0)));
            assert!((moved.signed_volume() * 6.0 / scale.element_product().abs() - 1.0).abs() < 1e-5);
            for (triangle, normal) in moved.triangles.iter().zip(moved.face_normals()) {
                assert!(triangle.iter().all(|&v| moved.normals[v as usize].as_dvec3().dot(normal) > 1.0 - 1e-5));
            }
        }
    }
}
