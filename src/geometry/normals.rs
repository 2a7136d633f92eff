//! Shading normals: the file's own, smooth, smooth up to a crease, or flat.
//!
//! A smooth normal is the sum of the normals of the faces around a position, each weighted by the angle it spans
//! there, so that it does not depend on how a flat region is triangulated [Thurmer1998]. Vertices at equal
//! positions share it: a uv seam does not show.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::geometry::mesh::{Mesh, weld};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Normals {
    /// Those that the mesh has, else smooth ones.
    Auto,
    /// Faces that meet at an edge at more than `crease_deg` do not share a normal there: their vertices are split.
    Smooth { crease_deg: f64 },
    /// Every triangle has its own three vertices and the normal of its plane.
    Flat,
}

/// A triangle narrower than this share of its longest edge has no direction that f32 positions could tell.
const SLIVER: f64 = f32::EPSILON as f64;

/// Where no face gives a direction (a vertex of slivers only, or of none), some unit vector must stand.
const NOWHERE: DVec3 = DVec3::Y;

/// A face at one of its corners.
#[derive(Clone, Copy)]
struct Corner {
    face: u32,
    /// 0 to 2.
    index: u8,
    /// The angle that the face spans here, radians.
    angle: f64,
}

impl Mesh {
    pub fn with_normals(self, normals: Normals) -> Mesh {
        match normals {
            Normals::Auto if self.normals.is_empty() => self.smooth(),
            Normals::Auto => self,
            Normals::Smooth { crease_deg } if crease_deg >= 180.0 => self.smooth(),
            Normals::Smooth { crease_deg } => self.creased(crease_deg.to_radians()),
            Normals::Flat => self.flat(),
        }
    }

    /// One normal per vertex, the same for all vertices at one position, unit length.
    pub fn smooth_normals(&self) -> Vec<Vec3> {
        let weld = weld(&self.positions);
        let faces = directions(self);
        let corners = corners_by_position(self, &weld);
        let at = |corners: &Vec<Corner>| sum(corners, &faces).unwrap_or(NOWHERE).as_vec3();
        let normals: Vec<Vec3> = corners.iter().map(at).collect();
        weld.iter().map(|&v| normals[v as usize]).collect()
    }

    fn smooth(mut self) -> Mesh {
        self.normals = self.smooth_normals();
        self
    }

    fn flat(self) -> Mesh {
        let faces = directions(&self);
        let mut split = Split::new(&self);
        for (f, face) in faces.iter().enumerate() {
            let normal = face.unwrap_or(NOWHERE).as_vec3();
            for corner in 0..3 {
                split.push(f, corner, normal);
            }
        }
        split.mesh
    }

    /// At each position, faces that are joined by edges below the crease angle share one normal.
    fn creased(self, crease: f64) -> Mesh {
        let weld = weld(&self.positions);
        let faces = directions(&self);
        let mut normals = vec![[Vec3::ZERO; 3]; self.triangles.len()];
        for corners in corners_by_position(&self, &weld) {
            let all = sum(&corners, &faces).unwrap_or(NOWHERE);
            for group in groups(&self, &weld, &faces, &corners, crease.cos()) {
                // A sliver belongs to no side of a crease: it takes the mean of all.
                let normal = sum(&group, &faces).unwrap_or(all).as_vec3();
                for corner in group {
                    normals[corner.face as usize][corner.index as usize] = normal;
                }
            }
        }
        let mut split = Split::new(&self);
        for (f, normals) in normals.iter().enumerate() {
            for (corner, normal) in normals.iter().enumerate() {
                split.share(f, corner, weld[self.triangles[f][corner] as usize], *normal);
            }
        }
        split.mesh
    }
}

/// The unit normal of each face, none for slivers.
fn directions(mesh: &Mesh) -> Vec<Option<DVec3>> {
    let direction = |t| {
        let [a, b, c] = mesh.corners(t);
        let cross = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        (cross.length() > SLIVER * longest).then(|| cross.normalize())
    };
    (0..mesh.triangles.len()).map(direction).collect()
}

/// For each welded vertex its corners in the order of the faces.
fn corners_by_position(mesh: &Mesh, weld: &[u32]) -> Vec<Vec<Corner>> {
    let mut corners = vec![Vec::new(); mesh.positions.len()];
    for (f, triangle) in mesh.triangles.iter().enumerate() {
        let p = mesh.corners(f);
        for (index, &v) in triangle.iter().enumerate() {
            let (left, right) = (p[(index + 1) % 3] - p[index], p[(index + 2) % 3] - p[index]);
            let angle = left.cross(right).length().atan2(left.dot(right));
            corners[weld[v as usize] as usize].push(Corner { face: f as u32, index: index as u8, angle });
        }
    }
    corners
}

/// None if there is no direction: only slivers, or faces back to back that cancel to the last bits.
fn sum(corners: &[Corner], faces: &[Option<DVec3>]) -> Option<DVec3> {
    let weighted = || corners.iter().filter_map(|c| faces[c.face as usize].map(|n| (n, c.angle)));
    let sum: DVec3 = weighted().map(|(n, angle)| n * angle).sum();
    let total: f64 = weighted().map(|(_, angle)| angle).sum();
    if sum.length() > 1e-12 * total { Some(sum.normalize()) } else { weighted().next().map(|(n, _)| n) }
}

/// The corners of one position, parted by creases.
fn groups(mesh: &Mesh, weld: &[u32], faces: &[Option<DVec3>], corners: &[Corner], cos_crease: f64) -> Vec<Vec<Corner>> {
    // Each corner hangs on two edges, named by their far ends; corners on one edge stand side by side after sorting.
    let mut on_edge: Vec<(u32, usize)> = Vec::with_capacity(2 * corners.len());
    for (i, corner) in corners.iter().enumerate() {
        let triangle = mesh.triangles[corner.face as usize];
        for step in [1, 2] {
            on_edge.push((weld[triangle[(corner.index as usize + step) % 3] as usize], i));
        }
    }
    on_edge.sort_unstable();
    let mut group: Vec<usize> = (0..corners.len()).collect();
    let root = |group: &[usize], mut i: usize| {
        while group[i] != i {
            i = group[i];
        }
        i
    };
    for pair in on_edge.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let normals = pair.iter().map(|&(_, i)| faces[corners[i].face as usize]);
        if let [Some(m), Some(n)] = normals.collect::<Vec<_>>()[..]
            && m.dot(n) >= cos_crease
        {
            let (a, b) = (root(&group, pair[0].1), root(&group, pair[1].1));
            group[a.max(b)] = a.min(b);
        }
    }
    let mut parted: Vec<Vec<Corner>> = vec![Vec::new(); corners.len()];
    for (i, corner) in corners.iter().enumerate() {
        parted[root(&group, i)].push(*corner);
    }
    parted.retain(|group| !group.is_empty());
    parted
}

/// A mesh under construction whose vertices are taken from another, with other normals.
struct Split<'a> {
    from: &'a Mesh,
    mesh: Mesh,
    shared: HashMap<[u32; 6], u32>,
}

impl Split<'_> {
    fn new(from: &Mesh) -> Split<'_> {
        let mesh = Mesh { triangles: vec![[0; 3]; from.triangles.len()], ..Mesh::default() };
        Split { from, mesh, shared: HashMap::new() }
    }

    fn push(&mut self, face: usize, corner: usize, normal: Vec3) {
        let v = self.from.triangles[face][corner] as usize;
        self.mesh.triangles[face][corner] = self.mesh.positions.len() as u32;
        self.mesh.positions.push(self.from.positions[v]);
        self.mesh.normals.push(normal);
        self.mesh.uvs.extend(self.from.uvs.get(v));
    }

    /// As `push`, but corners that agree in position, uv and normal are one vertex.
    fn share(&mut self, face: usize, corner: usize, welded: u32, normal: Vec3) {
        let uv = self.from.uvs.get(self.from.triangles[face][corner] as usize).copied().unwrap_or_default();
        let [x, y, z] = normal.to_array().map(f32::to_bits);
        let key = [welded, uv.x.to_bits(), uv.y.to_bits(), x, y, z];
        match self.shared.get(&key) {
            Some(&v) => self.mesh.triangles[face][corner] = v,
            None => {
                self.shared.insert(key, self.mesh.positions.len() as u32);
                self.push(face, corner, normal);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use glam::{DAffine3, vec3};

    #[test]
    fn smooth_normals_of_a_sphere_are_radial_at_every_scale() {
        for scale in [1e-30, 1.0, 1e30] {
            let sphere = shapes::sphere(1.0, 3).transformed(&DAffine3::from_scale(DVec3::splat(scale)));
            let smooth = Mesh { normals: vec![], ..sphere.clone() }.with_normals(Normals::Auto);
            let worst = smooth.normals.iter().zip(&sphere.normals).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
            assert!(worst < 0.01, "{worst}");
        }
    }

    #[test]
    fn angle_weights_do_not_see_the_triangulation() {
        // The corner of a cube: three faces, however many triangles share the corner.
        let cube = shapes::cuboid(DVec3::ONE);
        let smooth = cube.smooth_normals();
        for (p, n) in cube.positions.iter().zip(&smooth) {
            assert!(n.distance(p.normalize()) < 1e-6, "{p} {n}");
        }
    }

    #[test]
    fn creases_part_the_cube_and_not_the_sphere() {
        let cube = Mesh { normals: vec![], ..shapes::cuboid(DVec3::ONE) };
        let sharp = cube.clone().with_normals(Normals::Smooth { crease_deg: 60.0 });
        assert_eq!(
            sharp.normals,
            shapes::cuboid(DVec3::ONE).with_normals(Normals::Smooth { crease_deg: 89.0 }).normals
        );
        for (triangle, face) in sharp.triangles.iter().zip(sharp.face_normals()) {
            assert!(triangle.iter().all(|&v| sharp.normals[v as usize].as_dvec3().distance(face) < 1e-6));
        }
        assert_eq!(sharp.positions.len(), 24);
        let soft = cube.clone().with_normals(Normals::Smooth { crease_deg: 91.0 });
        assert!(soft.normals.iter().zip(&soft.positions).all(|(n, p)| n.distance(p.normalize()) < 1e-6));

        let sphere = shapes::sphere(1.0, 2);
        let creased = sphere.clone().with_normals(Normals::Smooth { crease_deg: 40.0 });
        assert_eq!(creased.positions.len(), sphere.positions.len());
        assert_eq!(creased.smooth_normals(), creased.normals);
        assert!(creased.is_closed() && sharp.is_closed());
    }

    #[test]
    fn flat_splits_everything_and_keeps_the_shape() {
        let torus = shapes::torus(2.0, 0.5, (16, 8));
        let flat = torus.clone().with_normals(Normals::Flat);
        assert_eq!(flat.positions.len(), 3 * flat.triangles.len());
        assert_eq!(flat.uvs.len(), flat.positions.len());
        assert!(flat.is_closed());
        assert_eq!(flat.topology(), torus.topology());
        assert_eq!(torus.clone().with_normals(Normals::Auto), torus);
    }

    #[test]
    fn slivers_and_doubled_faces_give_unit_normals() {
        let positions = vec![Vec3::ZERO, Vec3::X, vec3(0.5, 1e-12, 0.0), Vec3::Y, vec3(7.0, 7.0, 7.0)];
        let triangles = vec![[0, 1, 2], [0, 1, 1], [0, 1, 3], [0, 3, 1]];
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        for normals in [Normals::Auto, Normals::Smooth { crease_deg: 30.0 }, Normals::Flat] {
            let mesh = mesh.clone().with_normals(normals);
            assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-6), "{:?}", mesh.normals);
        }
    }
}
