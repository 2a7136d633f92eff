//! A material's means over disks on the device: the kernel of every technique that gathers irradiance by area.

use crate::frame::Surface;
use crate::gpu::{Bind, Buffer, Gpu};
use crate::optics::Rgb;
use crate::optics::fresnel::diffuse_transmittance;
use crate::optics::medium::Medium;
use crate::optics::phase::Phase;
use crate::optics::profile::disk::{COLUMNS, CROWDING, DiskMeans, STEP};
use crate::optics::profile::{Model, Profile};
use crate::problem::Problem;
use crate::scene::Material;
use crate::store::{Bake, Plan, Run, Slot, Step};
use crate::uniform;
use serde::Serialize;
use std::f64::consts::PI;

/// The table of a medium, whatever its scale: lengths are in units of its shortest reduced mean free path.
#[derive(Serialize)]
struct Table {
    model: Model,
    medium: Medium,
    phase: Phase,
    ior: f64,
}

impl Step for Table {
    type Output = DiskMeans;
    fn name(&self) -> &'static str {
        "profile.disk_means"
    }
    fn about(&self) -> String {
        format!("what {:?} brings from disks of any size", self.model)
    }
    fn run(&self, run: &Run) -> Result<DiskMeans, Problem> {
        run.tick(0.0)?;
        Ok(DiskMeans::new(&Profile::of_medium(self.model, &self.medium, self.phase, self.ior)))
    }
}

impl Bake for Table {
    const CODE: &'static [&'static str] = &["src/optics/"];
}

/// A table on the device, behind a line that says what it is.
#[derive(Serialize)]
struct UploadTable {
    table: Slot<DiskMeans>,
}

impl Step for UploadTable {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "means over disks to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let table = run.get(self.table);
        let reach = table.reach.into_iter().fold(0.0, f64::max);
        let mut lines = vec![[table.first as f32, table.rows() as f32, reach as f32, 0.0]];
        lines.extend_from_slice(&table.logs);
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&lines)))
    }
}

uniform! {
    struct Kernel {
        scale: f32,
        density: f32,
        columns: u32,
        crowding: f32,
        spread: f32,
    }
}

/// What `techniques/kernel.wgsl` binds for a material; none when nothing in it scatters.
pub(super) fn binds(plan: &mut Plan, surface: &Surface, material: &Material) -> Option<Vec<(&'static str, Bind)>> {
    let medium = material.medium.medium()?;
    let per_mm = medium.sigma_t_prime().max_element();
    if medium.sigma_s.max_element() == 0.0 {
        return None;
    }
    // Digits that a scale leaves alone, so that a medium twice as dense has the same table.
    let rounded =
        |coefficients: Rgb| coefficients.map(|value| format!("{:.12e}", value / per_mm).parse().unwrap_or(value));
    let medium = Medium { sigma_a: rounded(medium.sigma_a), sigma_s: rounded(medium.sigma_s), g: medium.g };
    let ior = material.surface.ior;
    let table = plan.bake(Table { model: material.profile, medium, phase: material.phase, ior });
    let kernel = Kernel {
        scale: (per_mm * surface.mm_per_unit()) as f32,
        density: (1.0 / STEP) as f32,
        columns: COLUMNS as u32,
        crowding: CROWDING as f32,
        spread: (1.0 / (PI * diffuse_transmittance(ior))) as f32,
    };
    let table = plan.add(UploadTable { table });
    Some(vec![("kernel", Bind::uniform(&kernel)), ("disk_means", Bind::Buffer(table))])
}
