//! Where each vertex sees the sky, and what light comes from there.

use super::super::tables;
use super::{sample, sky_direction};
use crate::geometry::bvh::Bvh;
use crate::geometry::mesh::Mesh;
use crate::geometry::visibility::{directions, visibility};
use crate::gpu::{Buffer, Gpu};
use crate::image::Texture;
use crate::problem::{Problem, counted};
use crate::store::{Bake, Run, Slot, Step};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::PI;

/// Directions in which the sky is looked for.
pub(super) const DIRECTIONS: usize = 256;

/// Where one vertex after another sees out: 8 words of 32 directions each. Places are the world's axes and unit around the
/// mesh's own origin.
#[derive(Serialize)]
pub(super) struct SkyVisibility {
    pub mesh: Slot<Mesh>,
    pub turned: DAffine3,
    pub occluders: Vec<(Slot<Mesh>, DAffine3)>,
}

impl Step for SkyVisibility {
    type Output = Vec<u32>;
    fn name(&self) -> &'static str {
        "sky.visibility"
    }
    fn about(&self) -> String {
        let things = counted(self.occluders.len(), "thing");
        format!("where each vertex sees past {things}, by {DIRECTIONS} rays")
    }
    fn run(&self, run: &Run) -> Result<Vec<u32>, Problem> {
        let meshes: Vec<_> = self.occluders.iter().map(|(mesh, at)| (run.get(*mesh), *at)).collect();
        let bvh = Bvh::new(&meshes.iter().map(|(mesh, at)| (mesh.as_ref(), *at)).collect::<Vec<_>>());
        let mesh = run.get(self.mesh).transformed(&self.turned);
        visibility(&mesh.positions, &mesh.normals, &bvh, DIRECTIONS, &|share| run.tick(share))
    }
}

impl Bake for SkyVisibility {
    const CODE: &'static [&'static str] = &["src/geometry/", "src/frame/sky/"];
}

/// Texels around the horizon at which each of the directions has hundreds.
const FINE: u32 = 512;

/// The mean radiance of an image around each of the directions.
#[derive(Serialize)]
pub(super) struct SkyCells {
    pub image: Slot<Texture>,
    pub rotation: f64,
}

impl Step for SkyCells {
    type Output = Vec<Vec3>;
    fn name(&self) -> &'static str {
        "sky.cells"
    }
    fn about(&self) -> String {
        format!("the sky's mean radiance around {DIRECTIONS} directions")
    }
    fn run(&self, run: &Run) -> Result<Vec<Vec3>, Problem> {
        let image = run.get(self.image);
        let centres: Vec<Vec3> = directions(DIRECTIONS).iter().map(|d| d.as_vec3()).collect();
        // A coarse image has few texels around each direction: they are cut up, or a small sun in one of them would shine
        // too much or too little by the number of its neighbours.
        let parts = FINE.div_ceil(image.width);
        let (width, height) = (image.width * parts, image.height * parts);
        let rows: Vec<Vec<(DVec3, f64)>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let mut sums = vec![(DVec3::ZERO, 0.0); DIRECTIONS];
                let theta = PI * (y as f64 + 0.5) / height as f64;
                for x in 0..width {
                    let direction = sky_direction(x, theta, width, self.rotation).as_vec3();
                    let nearest = (0..DIRECTIONS)
                        .max_by(|a, b| centres[*a].dot(direction).total_cmp(&centres[*b].dot(direction)))
                        .expect("there are directions");
                    let [r, g, b, _] = image.texels[(y / parts * image.width + x / parts) as usize];
                    sums[nearest].0 += theta.sin() * Vec3::new(r, g, b).as_dvec3();
                    sums[nearest].1 += theta.sin();
                }
                sums
            })
            .collect();
        run.tick(0.9)?;
        Ok((0..DIRECTIONS)
            .map(|k| {
                let sum: DVec3 = rows.iter().map(|row| row[k].0).sum();
                let weight: f64 = rows.iter().map(|row| row[k].1).sum();
                match weight > 0.0 {
                    true => (sum / weight).as_vec3(),
                    // The image is so low that its rows miss the direction: the nearest texel serves.
                    false => sample(&image, centres[k].as_dvec3(), self.rotation).as_vec3(),
                }
            })
            .collect())
    }
}

impl Bake for SkyCells {
    const CODE: &'static [&'static str] = &["src/geometry/visibility.rs", "src/frame/sky/"];
}

/// The directions with their light, on the device.
#[derive(Serialize)]
pub(super) struct SkyLight {
    pub radiance: DVec3,
    pub cells: Option<Slot<Vec<Vec3>>>,
}

impl Step for SkyLight {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "sky.light"
    }
    fn about(&self) -> String {
        format!("light from {DIRECTIONS} directions, to the device")
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let cells = self.cells.map(|slot| run.get(slot));
        let solid_angle = 4.0 * PI / DIRECTIONS as f64;
        let table: Vec<tables::Direction> = directions(DIRECTIONS)
            .into_iter()
            .enumerate()
            .map(|(k, direction)| {
                let cell = cells.as_ref().map_or(DVec3::ONE, |cells| cells[k].as_dvec3());
                tables::Direction {
                    direction: direction.as_vec3(),
                    light: (solid_angle * cell * self.radiance).as_vec3(),
                }
            })
            .collect();
        let mut bytes = encase::StorageBuffer::new(Vec::new());
        bytes.write(&table).expect("a vector can grow");
        Ok(Buffer::new(run.host::<Gpu>(), &bytes.into_inner()))
    }
}
