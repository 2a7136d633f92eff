//! The surroundings as sixteen lamps, for techniques that follow light from a direction into a thing.
//!
//! The 256 directions in which the sky is looked for are parted in two, again and again, where the most light is spread
//! the widest: a small bright window gets a lamp of its own, an even sky sixteen even ones. So the lamps are drawn by
//! importance, and the same in every frame. How much of each reaches a vertex follows from the bits of where it sees out.

use super::super::{Frame, Item, upload};
use super::light::DIRECTIONS;
use crate::geometry::visibility::directions;
use crate::gpu::{Bind, Buffer, Compute, Gpu};
use crate::problem::Problem;
use crate::store::{Bake, Plan, Run, Slot, Step};
use crate::uniform;
use glam::{DAffine3, DMat3, DMat4, DVec3, Mat4, Vec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// How far a lamp's light lies beside its middle, as a share of the sine of its cap's angle. Of a lamp that the horizon
/// cuts, what is above counts as if it were where its own middle is. With 0.65 the light of an even sky that a half space
/// scatters once is 1 ± 3 % too bright over all normals; without, 7 ± 6 % are missing.
const SPREAD: f64 = 0.65;

/// A multiple of four: shares travel in vectors.
pub const SKY_LAMPS: usize = 16;

uniform! {
    struct Quad {
        world_from_object: Mat4,
        first: u32,
    }
}

uniform! {
    struct SkyLamp {
        direction: Vec3,
        spread: f32,
        light: Vec3,
    }
}

impl Frame<'_> {
    /// The lamps that stand for the surroundings, 16 of `SkyLamp`: where they are in the world, how far they spread, and
    /// their irradiance on a plane that faces them. None when there are no surroundings.
    pub(in crate::frame) fn sky_lamps(&self, plan: &mut Plan) -> Option<Slot<Buffer>> {
        let surroundings = self.surroundings(plan)?;
        let parted = self.sky_parted(plan)?;
        Some(plan.add(UploadLamps { parted, radiance: surroundings.radiance }))
    }

    fn sky_parted(&self, plan: &mut Plan) -> Option<Slot<Parted>> {
        let surroundings = self.surroundings(plan)?;
        let cells = self.sky_cells(plan, &surroundings);
        Some(plan.bake(Part { cells }))
    }

    /// Which share of each lamp reaches each vertex, as four streams of `vec4f`. Empty when there are no surroundings.
    pub(in crate::frame) fn sky_shares(&self, plan: &mut Plan, item: &Item) -> Result<Vec<Slot<Buffer>>, Problem> {
        let Some(surroundings) = self.surroundings(plan) else { return Ok(Vec::new()) };
        let Some(parted) = self.sky_parted(plan) else { return Ok(Vec::new()) };
        let lamp_of = plan.add(UploadLampOf { parted });
        let light = self.sky_light(plan, &surroundings);
        let mut binds = vec![("directions", Bind::Buffer(light)), ("lamp_of", Bind::Buffer(lamp_of))];
        let mut flags = Vec::new();
        if let Some(visible) = self.sky_visibility(plan, item, &surroundings) {
            flags.push("OCCLUDED");
            binds.push(("visible", Bind::Buffer(visible)));
        }
        let over = upload::stream(plan, item.mesh, upload::Stream::Normals);
        binds.push(("normals", Bind::Buffer(over)));
        let rotation = DAffine3 { translation: DVec3::ZERO, ..item.world_from_object };
        let world_from_object = DMat4::from(rotation).as_mat4();
        let share = |quad: usize| -> Result<Slot<Buffer>, Problem> {
            let first = 4 * quad as u32;
            Ok(plan.add(Compute {
                name: "frame.sky_share",
                about: format!("how much of four of the sky's lamps reaches each vertex of `{}`", item.name),
                shader: self.shaders.load("frame/sky_share.wgsl", &flags)?,
                output: ("share", 16),
                over,
                over_stride: 12,
                binds: [vec![("quad", Bind::uniform(&Quad { world_from_object, first }))], binds.clone()].concat(),
            }))
        };
        (0..SKY_LAMPS / 4).map(share).collect()
    }
}

/// The directions parted into lamps.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::frame) struct Parted {
    /// Where each lamp is, and the mean radiance around it.
    lamps: Vec<(Vec3, Vec3)>,
    /// How many directions each stands for.
    sizes: Vec<u32>,
    /// The lamp of each direction.
    lamp_of: Vec<u32>,
}

/// `cells` is the mean radiance around each direction; without them the sky is even.
#[derive(Serialize)]
struct Part {
    cells: Option<Slot<Vec<Vec3>>>,
}

impl Step for Part {
    type Output = Parted;
    fn name(&self) -> &'static str {
        "sky.lamps"
    }
    fn about(&self) -> String {
        format!("the sky as {SKY_LAMPS} lamps, more of them where it is bright")
    }
    fn run(&self, run: &Run) -> Result<Parted, Problem> {
        run.tick(0.0)?;
        let radiance = match self.cells {
            Some(cells) => run.get(cells).iter().map(|cell| cell.as_dvec3()).collect(),
            None => vec![DVec3::ONE; DIRECTIONS],
        };
        Ok(parted(&radiance))
    }
}

impl Bake for Part {
    const CODE: &'static [&'static str] = &["src/geometry/visibility.rs", "src/frame/sky/lamps.rs"];
}

fn parted(radiance: &[DVec3]) -> Parted {
    let directions = directions(radiance.len());
    let weight = |k: usize| radiance[k].element_sum();
    let light = |group: &[usize]| group.iter().map(|&k| weight(k)).sum::<f64>();
    // Where a group's light is: its mean direction, and how far it is spread about that along each axis, times its light.
    let spread = |group: &[usize]| {
        let total = light(group);
        let mean = group.iter().map(|&k| weight(k) * directions[k]).sum::<DVec3>() / total;
        let about = |k: usize| directions[k] - mean;
        let matrix = group.iter().fold(DMat3::ZERO, |sum, &k| {
            let d = about(k);
            sum + weight(k) * DMat3::from_cols(d.x * d, d.y * d, d.z * d)
        });
        (mean, matrix)
    };
    let mut groups = vec![(0..radiance.len()).collect::<Vec<usize>>()];
    while groups.len() < SKY_LAMPS {
        // A group without light, or of one direction, has nothing to part.
        let need = |group: &[usize]| match group.len() > 1 && light(group) > 0.0 {
            true => {
                let (_, matrix) = spread(group);
                matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
            }
            false => -1.0,
        };
        let (widest, most) = groups
            .iter()
            .map(|group| need(group))
            .enumerate()
            .fold((0, -1.0), |best, (i, need)| if need > best.1 { (i, need) } else { best });
        if most <= 0.0 {
            break;
        }
        let mut group = groups.swap_remove(widest);
        let (mean, matrix) = spread(&group);
        // The axis along which it is spread the most, by the power method from one that is none of the sky's own.
        let axis = (0..32).fold(DVec3::new(0.48, 0.6, 0.64), |axis, _| (matrix * axis).normalize_or(axis));
        group.sort_by(|&a, &b| {
            axis.dot(directions[a] - mean).total_cmp(&axis.dot(directions[b] - mean)).then(a.cmp(&b))
        });
        let half = 0.5 * light(&group);
        let mut passed = 0.0;
        let cut = group.iter().position(|&k| {
            passed += weight(k);
            passed > half
        });
        let rest = group.split_off(cut.unwrap_or(0).clamp(1, group.len() - 1));
        groups.extend([group, rest]);
    }
    // A dark sky has fewer lamps with anything in them.
    groups.resize(SKY_LAMPS, Vec::new());
    let mut lamp_of = vec![0; radiance.len()];
    let lamps = groups.iter().enumerate().map(|(lamp, group)| {
        group.iter().for_each(|&k| lamp_of[k] = lamp as u32);
        let mean = group.iter().map(|&k| weight(k) * directions[k]).sum::<DVec3>();
        let level = group.iter().map(|&k| radiance[k]).sum::<DVec3>() / group.len().max(1) as f64;
        (mean.normalize_or(DVec3::Y).as_vec3(), level.as_vec3())
    });
    let lamps = lamps.collect();
    Parted { lamps, sizes: groups.iter().map(|group| group.len() as u32).collect(), lamp_of }
}

/// The lamps, on the device.
#[derive(Serialize)]
struct UploadLamps {
    parted: Slot<Parted>,
    radiance: DVec3,
}

impl Step for UploadLamps {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "the sky's lamps to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let parted = run.get(self.parted);
        let solid_angle = 4.0 * PI / DIRECTIONS as f64;
        let row = |(&(direction, level), &size): (&(Vec3, Vec3), &u32)| {
            let light = f64::from(size) * solid_angle * level.as_dvec3() * self.radiance;
            // A cap of that solid angle.
            let cos = 1.0 - 0.5 * f64::from(size) * solid_angle / PI;
            let spread = SPREAD * (1.0 - cos * cos).max(0.0).sqrt();
            SkyLamp { direction, spread: spread as f32, light: light.as_vec3() }
        };
        let table: Vec<SkyLamp> = parted.lamps.iter().zip(&parted.sizes).map(row).collect();
        let mut bytes = encase::StorageBuffer::new(Vec::new());
        bytes.write(&table).expect("a vector can grow");
        Ok(Buffer::new(run.host::<Gpu>(), &bytes.into_inner()))
    }
}

/// The lamp of each direction, on the device.
#[derive(Serialize)]
struct UploadLampOf {
    parted: Slot<Parted>,
}

impl Step for UploadLampOf {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "which lamp stands for which direction, to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&run.get(self.parted).lamp_of)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_have_all_of_the_light_and_stand_where_it_is() {
        let all = directions(DIRECTIONS);
        let sun = |k: usize| DVec3::splat(if all[k].dot(DVec3::X) > 0.97 { 200.0 } else { 0.1 });
        for radiance in [vec![DVec3::ONE; DIRECTIONS], (0..DIRECTIONS).map(sun).collect::<Vec<_>>()] {
            let parted = parted(&radiance);
            assert_eq!(parted.lamps.len(), SKY_LAMPS);
            let light =
                parted.lamps.iter().zip(&parted.sizes).map(|(l, n)| l.1.as_dvec3() * f64::from(*n)).sum::<DVec3>();
            assert!((light / radiance.iter().sum::<DVec3>() - 1.0).abs().max_element() < 1e-6);
            assert!(parted.sizes.iter().all(|n| *n > 0) && parted.sizes.iter().sum::<u32>() == DIRECTIONS as u32);
            // Each direction lies on its lamp's side of the sky.
            let near =
                (0..DIRECTIONS).filter(|&k| parted.lamps[parted.lamp_of[k] as usize].0.as_dvec3().dot(all[k]) > 0.5);
            assert!(near.count() > DIRECTIONS * 9 / 10);
        }
        let even = parted(&[DVec3::ONE; DIRECTIONS]);
        assert!(even.sizes.iter().all(|n| (10..=24).contains(n)), "{:?}", even.sizes);
        // A sky without light is no trouble.
        let dark = parted(&[DVec3::ZERO; DIRECTIONS]);
        assert!(dark.lamps.iter().all(|(direction, light)| direction.is_normalized() && *light == Vec3::ZERO));
    }
}
