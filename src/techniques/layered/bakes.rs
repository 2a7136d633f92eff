//! What is known of a shape before anything is drawn: its planes, and the slopes of its map.

use crate::geometry::mesh::Mesh;
use crate::geometry::{plane_fit, tangents};
use crate::gpu::{Buffer, Gpu};
use crate::problem::Problem;
use crate::store::{Bake, Run, Slot, Step};
use glam::{Vec3, Vec4};
use serde::Serialize;

/// The plane through the neighbourhood of each vertex: normal and signed distance. Re-runs when the shape or the radius
/// changes: not for depths, nor for anything below the first layer.
#[derive(Serialize)]
pub struct Planes {
    pub mesh: Slot<Mesh>,
    /// Scene units.
    pub radius: f64,
}

impl Step for Planes {
    type Output = Vec<Vec4>;
    fn name(&self) -> &'static str {
        "layered.planes"
    }
    fn about(&self) -> String {
        format!("a plane through what lies within {:.3} units of each vertex", self.radius)
    }
    fn run(&self, run: &Run) -> Result<Vec<Vec4>, Problem> {
        plane_fit::fit(&run.get(self.mesh), self.radius, &|share| run.tick(share))
    }
}

impl Bake for Planes {
    const CODE: &'static [&'static str] = &["src/geometry/", "src/techniques/layered/bakes.rs"];
}

/// How u and v change along the surface, at each vertex. Re-runs when the shape does.
#[derive(Serialize)]
pub struct Slopes {
    pub mesh: Slot<Mesh>,
}

impl Step for Slopes {
    type Output = Vec<[Vec3; 2]>;
    fn name(&self) -> &'static str {
        "layered.slopes"
    }
    fn about(&self) -> String {
        "how texture coordinates change along the surface".into()
    }
    fn run(&self, run: &Run) -> Result<Vec<[Vec3; 2]>, Problem> {
        run.tick(0.0)?;
        Ok(tangents::gradients(&run.get(self.mesh)))
    }
}

impl Bake for Slopes {
    const CODE: &'static [&'static str] = &["src/geometry/", "src/techniques/layered/bakes.rs"];
}

/// Texture coordinates and their slopes on the device, in two streams of four numbers: uv and the beginning of u's slope,
/// then its end and v's. A device need not have more than eight streams.
#[derive(Serialize)]
pub struct MapStream {
    pub mesh: Slot<Mesh>,
    pub slopes: Slot<Vec<[Vec3; 2]>>,
    pub part: usize,
}

impl Step for MapStream {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "texture coordinates and their slopes to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let (mesh, slopes) = (run.get(self.mesh), run.get(self.slopes));
        let row = |(i, [u, v]): (usize, &[Vec3; 2])| {
            let uv = mesh.uvs.get(i).copied().unwrap_or_default();
            match self.part {
                0 => [uv.x, uv.y, u.x, u.y],
                _ => [u.z, v.x, v.y, v.z],
            }
        };
        let rows: Vec<[f32; 4]> = slopes.iter().enumerate().map(row).collect();
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&rows)))
    }
}
