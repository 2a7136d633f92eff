//! The surface cut into patches, each of which sends its light as one splat.
//!
//! The mesh is decimated, and every vertex belongs to the coarse triangle that lies nearest to it, and to the side it
//! faces. A triangle of the mesh belongs to the patch of its first vertex, but for those that are longer than patches
//! should be: they are halved until they are not [Maisch2020, section 8.1], and each piece is a patch of its own.
//!
//! All of it is baked for the shape at rest, as vertex numbers and barycentric coordinates, and holds however it deforms.

use crate::geometry::mesh::{Mesh, weld};
use crate::geometry::nearest::Nearest;
use crate::gpu::{Buffer, Gpu};
use crate::problem::Problem;
use crate::store::{Bake, Run, Slot, Step};
use glam::{DVec3, Vec2, Vec3};
use meshopt::SimplifyOptions;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// A piece of one triangle: a point for where it is, and its share of the triangle's area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Leaf {
    triangle: u32,
    /// Weights of the second and third corner.
    at: Vec2,
    share: f32,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Patches {
    /// Patch after patch.
    leaves: Vec<Leaf>,
    /// Where each patch's leaves begin; one more for where the last ones end.
    starts: Vec<u32>,
}

/// About `wanted` patches of a mesh.
#[derive(Serialize)]
pub(super) struct Cut {
    pub mesh: Slot<Mesh>,
    pub wanted: u32,
}

impl Step for Cut {
    type Output = Patches;
    fn name(&self) -> &'static str {
        "long_range.patches"
    }
    fn about(&self) -> String {
        format!("the surface cut into some {} patches", self.wanted)
    }
    fn run(&self, run: &Run) -> Result<Patches, Problem> {
        run.tick(0.0)?;
        Ok(cut(&run.get(self.mesh), self.wanted))
    }
}

impl Bake for Cut {
    const CODE: &'static [&'static str] = &["src/geometry/", "src/techniques/long_range/patches.rs"];
}

fn cut(mesh: &Mesh, wanted: u32) -> Patches {
    let area = mesh.area();
    if mesh.triangles.is_empty() || area == 0.0 {
        return Patches { leaves: Vec::new(), starts: vec![0] };
    }
    let (of_vertex, group_count) = groups(mesh, wanted);
    // Twice as long as the side of a square patch; and what is a sixteenth of it has no light to speak of, however long it
    // is, so that a needle is no million of pieces.
    let patch = area / wanted as f64;
    let (longest, least) = (2.0 * patch.sqrt(), patch / 16.0);
    let mut whole: Vec<Vec<Leaf>> = vec![Vec::new(); group_count as usize];
    let mut pieces: Vec<Leaf> = Vec::new();
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let mut leaves = Vec::new();
        halve(mesh.corners(t), [Vec2::ZERO, Vec2::X, Vec2::Y], 1.0, (longest, least), &mut |at, share| {
            leaves.push(Leaf { triangle: t as u32, at, share })
        });
        match leaves.len() {
            1 => whole[of_vertex[triangle[0] as usize] as usize].append(&mut leaves),
            _ => pieces.append(&mut leaves),
        }
    }
    let pieces = pieces.into_iter().map(|leaf| vec![leaf]);
    let mut patches = Patches { leaves: Vec::new(), starts: vec![0] };
    for leaves in whole.into_iter().chain(pieces).filter(|leaves| !leaves.is_empty()) {
        patches.leaves.extend(leaves);
        patches.starts.push(patches.leaves.len() as u32);
    }
    patches
}

/// Steps of the grid on which a mesh is decimated, along its longest side.
const GRID: f64 = 65536.0;

/// Each vertex's coarse triangle and the side that it faces, numbered as they come, and how many there are.
fn groups(mesh: &Mesh, wanted: u32) -> (Vec<u32>, u32) {
    let weld = weld(&mesh.positions);
    let indices: Vec<u32> = mesh.triangles.iter().flatten().map(|&v| weld[v as usize]).collect();
    // On a grid, so that ties are settled alike whatever the size and the place of the mesh.
    let low = mesh.positions.iter().copied().fold(Vec3::MAX, Vec3::min).as_dvec3();
    let high = mesh.positions.iter().copied().fold(Vec3::MIN, Vec3::max).as_dvec3();
    let steps = GRID / (high - low).max_element();
    let on_grid: Vec<Vec3> = mesh.positions.iter().map(|p| ((p.as_dvec3() - low) * steps).round().as_vec3()).collect();
    let positions: Vec<[f32; 3]> = on_grid.iter().map(|p| p.to_array()).collect();
    // Of what has fewer triangles than are wanted all stay.
    let target = indices.len().min(3 * wanted as usize);
    let decimated = |options| meshopt::simplify_decoder(&indices, &positions, target, 1.0, options, None);
    let mut coarse = decimated(SimplifyOptions::Regularize);
    if coarse.len() > 2 * target {
        // Many small parts, of which some may go. Of a single one hardly anything would be left.
        let pruned = decimated(SimplifyOptions::Regularize | SimplifyOptions::Prune);
        if 2 * pruned.len() > target {
            coarse = pruned;
        }
    }
    let triangles: Vec<[u32; 3]> = coarse.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    let coarse = Mesh { positions: on_grid.clone(), triangles, ..Mesh::default() };
    let nearest = Nearest::new(&coarse);
    // Vertices at one place may belong to several sides of an edge, and those to several of a thin sheet: a disk has one.
    let side = |normal: Vec3| {
        let rounded = (1024.0 * normal).round();
        let axis = rounded.abs().max_position();
        (axis, rounded[axis] < 0.0)
    };
    let mut numbers = HashMap::new();
    let of_vertex = on_grid
        .iter()
        .zip(&mesh.normals)
        .map(|(p, normal)| {
            // A mesh of which nothing is left is one group.
            let triangle = nearest.find(p.as_dvec3(), f64::INFINITY).map_or(0, |closest| closest.triangle);
            let next = numbers.len() as u32;
            *numbers.entry((triangle, side(*normal))).or_insert(next)
        })
        .collect();
    (of_vertex, numbers.len() as u32)
}

/// Tells middle and share of the pieces of a triangle, none of whose sides is longer than the longest, but for pieces of
/// less than the least area.
fn halve(
    corners: [DVec3; 3],
    at: [Vec2; 3],
    share: f32,
    (longest, least): (f64, f64),
    each: &mut impl FnMut(Vec2, f32),
) {
    let side = |i: usize| corners[i].distance(corners[(i + 1) % 3]);
    let i = (0..3).fold(0, |best, i| if side(i) > side(best) { i } else { best });
    let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    if side(i) <= longest || share < 1e-4 || area < least {
        return each((at[0] + at[1] + at[2]) / 3.0, share);
    }
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    let (middle, middle_at) = (0.5 * (corners[i] + corners[j]), 0.5 * (at[i] + at[j]));
    halve([corners[i], middle, corners[k]], [at[i], middle_at, at[k]], 0.5 * share, (longest, least), each);
    halve([middle, corners[j], corners[k]], [middle_at, at[j], at[k]], 0.5 * share, (longest, least), each);
}

/// Where the leaves are on the mesh as it is now, with its normals.
#[derive(Serialize)]
pub(super) struct LeafPoints {
    pub mesh: Slot<Mesh>,
    pub patches: Slot<Patches>,
}

impl Step for LeafPoints {
    type Output = Mesh;
    const NEEDS_HOST: bool = false;
    fn name(&self) -> &'static str {
        "geometry.leaves"
    }
    fn about(&self) -> String {
        "a point on each piece of the patches".into()
    }
    fn run(&self, run: &Run) -> Result<Mesh, Problem> {
        let (mesh, patches) = (run.get(self.mesh), run.get(self.patches));
        let mix = |values: &[Vec3], leaf: &Leaf| {
            let [a, b, c] = mesh.triangles[leaf.triangle as usize].map(|v| values[v as usize]);
            a + leaf.at.x * (b - a) + leaf.at.y * (c - a)
        };
        Ok(Mesh {
            positions: patches.leaves.iter().map(|leaf| mix(&mesh.positions, leaf)).collect(),
            normals: patches.leaves.iter().map(|leaf| mix(&mesh.normals, leaf).normalize_or(Vec3::Y)).collect(),
            ..Mesh::default()
        })
    }
}

/// Where each patch's leaves begin and end, on the device.
#[derive(Serialize)]
pub(super) struct UploadSpans {
    pub patches: Slot<Patches>,
}

impl Step for UploadSpans {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "patches to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let patches = run.get(self.patches);
        let spans: Vec<[u32; 2]> = patches.starts.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&spans)))
    }
}

/// The leaves' areas on the mesh as it is now, on the device. Object space.
#[derive(Serialize)]
pub(super) struct UploadAreas {
    pub mesh: Slot<Mesh>,
    pub patches: Slot<Patches>,
}

impl Step for UploadAreas {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "areas to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let (mesh, patches) = (run.get(self.mesh), run.get(self.patches));
        let faces = mesh.face_areas();
        let area = |leaf: &Leaf| faces[leaf.triangle as usize] as f32 * leaf.share;
        let areas: Vec<f32> = patches.leaves.iter().map(area).collect();
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&areas)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;

    #[test]
    fn patches_cover_the_surface_once_whatever_its_triangles() {
        for mesh in [
            shapes::sphere(2.0, 5),
            shapes::cuboid(DVec3::new(1.0, 5.0, 0.1)),
            shapes::torus_knot(2, 3, 2.0, 0.4, (200, 3)),
            shapes::slab(DVec3::new(4.0, 4.0, 0.2), (30, 30)),
        ] {
            let patches = cut(&mesh, 500);
            let count = patches.starts.len() - 1;
            assert!((150..3000).contains(&count), "{count} patches");
            // Each triangle's pieces add up to it, so that areas do, deformed or not.
            let mut shares = vec![0.0; mesh.triangles.len()];
            patches.leaves.iter().for_each(|leaf| shares[leaf.triangle as usize] += leaf.share);
            assert!(shares.iter().all(|share| (share - 1.0f32).abs() < 1e-5));
            // No patch is much wider than it should be.
            let side = (mesh.area() / 500.0).sqrt();
            for (patch, pair) in patches.starts.windows(2).enumerate() {
                let leaves = &patches.leaves[pair[0] as usize..pair[1] as usize];
                let area: f64 =
                    leaves.iter().map(|leaf| mesh.face_areas()[leaf.triangle as usize] * leaf.share as f64).sum();
                assert!(area < 30.0 * side * side, "patch {patch} has {:.1} times its area", area / side / side);
                if patch > 40 {
                    break;
                }
            }
            assert_eq!(cut(&mesh, 500), patches);
        }
        let knot = shapes::torus_knot(2, 3, 1.5, 0.55, (240, 40));
        for wanted in [100, 300, 500, 2000] {
            let count = cut(&knot, wanted).starts.len() - 1;
            println!("{count} patches for {wanted}");
            assert!(count > wanted as usize / 2, "{count} patches for {wanted}");
        }
        let mut needle = shapes::sphere(1.0, 3);
        needle.positions.iter_mut().for_each(|p| *p *= Vec3::new(1e-6, 1.0, 1e-6));
        assert!((500..20_000).contains(&cut(&needle, 500).leaves.len()), "{}", cut(&needle, 500).leaves.len());
        assert_eq!(cut(&Mesh::default(), 100), Patches { leaves: Vec::new(), starts: vec![0] });
    }
}
