//! The surroundings as spherical harmonics in an object's space, as far as other things let them through to it.

use super::light::{DIRECTIONS, SkyCells};
use crate::frame::lamp::axes_of;
use crate::frame::{Frame, Item, Member, Surface};
use crate::geometry::bvh::Bvh;
use crate::geometry::mesh::Mesh;
use crate::geometry::visibility::directions;
use crate::gpu::{Buffer, Gpu};
use crate::optics::sh::sh_basis;
use crate::problem::{Problem, counted};
use crate::store::{Bake, Plan, Run, Slot, Step};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::PI;

impl Surface<'_> {
    /// Radiance from the surroundings as real spherical harmonics of `bands` bands, in a member's space: a `vec4f` each.
    /// None when there are no surroundings.
    pub fn sky_harmonics(&self, plan: &mut Plan, member: &Member, bands: usize) -> Option<Slot<Buffer>> {
        self.frame.sky_harmonics(plan, self.item(member), bands)
    }
}

impl Frame<'_> {
    fn sky_harmonics(&self, plan: &mut Plan, item: &Item, bands: usize) -> Option<Slot<Buffer>> {
        let surroundings = self.surroundings(plan)?;
        let cells = surroundings.image.map(|image| plan.bake(SkyCells { image, rotation: surroundings.rotation }));
        let here = DAffine3::from_translation(-item.world_from_object.translation);
        let is_other = |other: &&Item| self.is_rigid(other) && !std::ptr::eq(*other, item);
        let others: Vec<_> =
            self.items.iter().filter(is_other).map(|other| (other.mesh, here * other.world_from_object)).collect();
        let reach = (surroundings.shadow && self.is_rigid(item) && !others.is_empty())
            .then(|| plan.bake(SkyReach { mesh: item.mesh, turned: here * item.world_from_object, others }));
        let object_from_world = axes_of(&item.world_from_object).to_cols_array();
        Some(plan.add(SkyHarmonics { radiance: surroundings.radiance, cells, reach, object_from_world, bands }))
    }
}

/// From which directions light reaches an object past others: the share of its surface, of 1, that sees out there when the
/// object itself is not in the way.
#[derive(Serialize)]
struct SkyReach {
    mesh: Slot<Mesh>,
    turned: DAffine3,
    others: Vec<(Slot<Mesh>, DAffine3)>,
}

/// Vertices that stand for the surface.
const VERTICES: usize = 128;

impl Step for SkyReach {
    type Output = Vec<f32>;
    fn name(&self) -> &'static str {
        "sky.reach"
    }
    fn about(&self) -> String {
        format!("which light of the sky gets past {}", counted(self.others.len(), "other thing"))
    }
    fn run(&self, run: &Run) -> Result<Vec<f32>, Problem> {
        let meshes: Vec<_> = self.others.iter().map(|(mesh, at)| (run.get(*mesh), *at)).collect();
        let bvh = Bvh::new(&meshes.iter().map(|(mesh, at)| (mesh.as_ref(), *at)).collect::<Vec<_>>());
        let mesh = run.get(self.mesh);
        let step = mesh.positions.len().div_ceil(VERTICES).max(1);
        let points: Vec<DVec3> =
            mesh.positions.iter().step_by(step).map(|p| self.turned.transform_point3(p.as_dvec3())).collect();
        run.tick(0.0)?;
        let seen = |direction: &DVec3| {
            let free = points.iter().filter(|p| !bvh.any_hit(**p, *direction, bvh.offset(), f64::INFINITY)).count();
            free as f32 / points.len().max(1) as f32
        };
        Ok(directions(DIRECTIONS).par_iter().map(seen).collect())
    }
}

impl Bake for SkyReach {
    const CODE: &'static [&'static str] = &["src/geometry/", "src/frame/sky/"];
}

#[derive(Serialize)]
struct SkyHarmonics {
    radiance: DVec3,
    cells: Option<Slot<Vec<Vec3>>>,
    reach: Option<Slot<Vec<f32>>>,
    /// A rotation, column by column.
    object_from_world: [f64; 9],
    bands: usize,
}

impl Step for SkyHarmonics {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "sky.harmonics"
    }
    fn about(&self) -> String {
        format!("the sky as {} spherical harmonics, to the device", self.bands * self.bands)
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let cells = self.cells.map(|slot| run.get(slot));
        let reach = self.reach.map(|slot| run.get(slot));
        let object_from_world = glam::DMat3::from_cols_array(&self.object_from_world);
        let mut sums = vec![DVec3::ZERO; self.bands * self.bands];
        for (k, direction) in directions(DIRECTIONS).into_iter().enumerate() {
            let cell = cells.as_ref().map_or(DVec3::ONE, |cells| cells[k].as_dvec3());
            let reaches = reach.as_ref().map_or(1.0, |reach| f64::from(reach[k]));
            let light = 4.0 * PI / DIRECTIONS as f64 * reaches * cell * self.radiance;
            let basis = sh_basis(object_from_world * direction, self.bands);
            sums.iter_mut().zip(basis).for_each(|(sum, y)| *sum += y * light);
        }
        let rows: Vec<[f32; 4]> = sums.iter().map(|sum| sum.as_vec3().extend(0.0).to_array()).collect();
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&rows)))
    }
}
