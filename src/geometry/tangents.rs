//! How texture coordinates change along a surface: what a step of so many units below it is in u and v.
//!
//! The paper adds a vector's components along the tangent and the bitangent to texture coordinates [Francois2006, fig. 6],
//! which is right where both have the length of a unit of u and v. The gradients here have: (du, dv) = (g_u · d, g_v · d)
//! for a displacement d. They are the dual basis of dP/du and dP/dv, sheared maps included; directions, lengths and which
//! faces go together at a vertex are those of MikkTSpace, which nearly all tools that paint textures use.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Vec3};

use super::mesh::Mesh;

/// For each vertex the gradients of u and v, 1 over the mesh's unit, tangential to the surface. Zero for a mesh without
/// texture coordinates and where they do not change. Where a map is mirrored along a seam, a vertex has the gradients of
/// the side on which more of its area lies.
pub fn gradients(mesh: &Mesh) -> Vec<[Vec3; 2]> {
    let nothing = vec![[Vec3::ZERO; 2]; mesh.positions.len()];
    let size = mesh.bounds().diagonal();
    if mesh.uvs.is_empty() || size.is_nan() || size <= 0.0 {
        return nothing;
    }
    let center = mesh.bounds().center();
    let mut work = Work {
        mesh,
        // Lengths of usual size, whatever the mesh's.
        positions: mesh.positions.iter().map(|p| ((p.as_dvec3() - center) / size).as_vec3()).collect(),
        areas: mesh.face_areas().into_iter().map(|area| area / (size * size)).collect(),
        sums: vec![[Sum::default(); 2]; mesh.positions.len()],
    };
    generate_tangents(&mut work).expect("its type of errors has no value");
    let mean = |[one, other]: &[Sum; 2]| {
        let side = if one.area >= other.area { one } else { other };
        [side.u, side.v].map(|sum| if side.area > 0.0 { (sum / side.area / size).as_vec3() } else { Vec3::ZERO })
    };
    work.sums.iter().map(mean).collect()
}

/// Gradients around a vertex, times the areas of the faces that they belong to.
#[derive(Clone, Copy, Default)]
struct Sum {
    u: DVec3,
    v: DVec3,
    area: f64,
}

struct Work<'a> {
    mesh: &'a Mesh,
    positions: Vec<Vec3>,
    areas: Vec<f64>,
    /// By vertex: faces whose map is mirrored, and the others.
    sums: Vec<[Sum; 2]>,
}

impl Work<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }
}

impl Geometry for Work<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }
    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }
    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.positions[self.vertex(face, corner)].to_array()
    }
    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].to_array()
    }
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.mesh.uvs[self.vertex(face, corner)].to_array()
    }
    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let (Some(space), area) = (space, self.areas[face]) else { return };
        let along = |direction: [f32; 3], length: f32| f64::from(length) * Vec3::from_array(direction).as_dvec3();
        let (u, v) = (
            along(space.tangent(), space.tangent_magnitude()),
            along(space.bi_tangent(), space.bi_tangent_magnitude()),
        );
        let across = u.cross(v);
        let squared = across.length_squared();
        let (gradient_u, gradient_v) = (v.cross(across) / squared, across.cross(u) / squared);
        // Coordinates that do not change along the face, or a face without area, have none.
        if area > 0.0 && gradient_u.is_finite() && gradient_v.is_finite() {
            let v = self.vertex(face, corner);
            let sum = &mut self.sums[v][usize::from(space.is_orientation_preserving())];
            sum.u += area * gradient_u;
            sum.v += area * gradient_v;
            sum.area += area;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use glam::{DAffine3, Vec2};

    /// A square of 8 x 8 cells in the plane z = 0, with any map.
    fn sheet(map: impl Fn(Vec3) -> Vec2) -> Mesh {
        let n = 8;
        let positions: Vec<Vec3> = (0..(n + 1) * (n + 1))
            .map(|i| Vec3::new((i % (n + 1)) as f32, (i / (n + 1)) as f32, 0.0) / n as f32 - 0.5)
            .map(|p| Vec3::new(p.x, p.y, 0.0))
            .collect();
        let at = |x, y| y * (n as u32 + 1) + x;
        let cell = |i| {
            let (x, y) = (i % n as u32, i / n as u32);
            [[at(x, y), at(x + 1, y), at(x + 1, y + 1)], [at(x, y), at(x + 1, y + 1), at(x, y + 1)]]
        };
        Mesh {
            normals: vec![Vec3::Z; positions.len()],
            uvs: positions.iter().map(|p| map(*p)).collect(),
            triangles: (0..(n * n) as u32).flat_map(cell).collect(),
            positions,
        }
    }

    #[test]
    fn a_step_along_the_surface_is_a_step_in_its_map() {
        for (a, b) in [
            (Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 5.0, 0.0)),
            // Sheared, turned, mirrored.
            (Vec3::new(2.0, 1.0, 0.0), Vec3::new(-0.3, 0.7, 0.0)),
            (Vec3::new(-3.0, 0.2, 0.0), Vec3::new(0.1, 1.0, 0.0)),
        ] {
            let mesh = sheet(|p| Vec2::new(a.dot(p), b.dot(p)));
            for [u, v] in gradients(&mesh) {
                assert!(u.distance(a) < 1e-5 && v.distance(b) < 1e-5, "{u} {v}");
            }
        }
        // Lengths count, whatever the mesh's size.
        let mesh = sheet(|p| Vec2::new(p.x, p.y));
        for scale in [1e-20, 1e6] {
            let scaled = mesh.transformed(&DAffine3::from_scale(DVec3::splat(scale)));
            for [u, v] in gradients(&scaled) {
                let unit = |g: Vec3| g.as_dvec3() * scale;
                assert!(unit(u).distance(DVec3::X) < 1e-5 && unit(v).distance(DVec3::Y) < 1e-5);
            }
        }
    }

    #[test]
    fn a_mirrored_map_keeps_its_slope_at_the_seam() {
        let mesh = sheet(|p| Vec2::new(p.x.abs(), p.y));
        for (p, [u, v]) in mesh.positions.iter().zip(gradients(&mesh)) {
            assert!((u.x.abs() - 1.0).abs() < 1e-5 && (p.x == 0.0 || u.x * p.x > 0.0), "{p} {u}");
            assert!(v.distance(Vec3::Y) < 1e-5);
        }
    }

    #[test]
    fn gradients_lie_in_the_surface_and_are_always_numbers() {
        let sphere = shapes::sphere(2.0, 3);
        for ([u, v], n) in gradients(&sphere).into_iter().zip(&sphere.normals) {
            assert!(u.is_finite() && v.is_finite());
            assert!(u.dot(*n).abs() <= 1e-3 * u.length() && v.dot(*n).abs() <= 1e-3 * v.length());
        }
        let mut bad = sheet(|_| Vec2::new(0.3, 0.7));
        assert!(gradients(&bad).iter().all(|g| *g == [Vec3::ZERO; 2]));
        bad.uvs = bad.positions.iter().map(|p| Vec2::new(p.x, p.y)).collect();
        bad.positions.iter_mut().for_each(|p| p.x = 0.0);
        assert!(gradients(&bad).iter().flatten().all(|g| g.is_finite()));
        bad.uvs.clear();
        assert!(gradients(&bad).iter().all(|g| *g == [Vec3::ZERO; 2]));
        assert!(gradients(&Mesh::default()).is_empty());
    }
}
