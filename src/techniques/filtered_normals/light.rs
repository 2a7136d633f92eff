//! The filter on light instead of normals: irradiance at the samples of a mesh, with all shadows in it, is taken apart into
//! the mesh's eigenpairs and put together again with a weight for each, in every frame.
//!
//! Light spreads over the edge of a shadow as it does over the terminator, and none is lost: the sum of A E stays what it
//! was times F(0), to the precision of halves. Eigenpairs serve any field, which a space made for the normals does not:
//! what light has of other modes would pass it unfiltered.

use super::kernel::Kernels;
use super::steps::{CODE, halves, stride};
use crate::frame::{Member, Surface};
use crate::geometry::laplacian::NOWHERE;
use crate::geometry::mesh::Mesh;
use crate::geometry::spectrum::kernel::Kernel;
use crate::geometry::spectrum::{Harmonics, all_harmonics};
use crate::gpu::{Bind, Buffer, Compute, Gpu};
use crate::problem::Problem;
use crate::store::{Bake, Plan, Run, Slot, Step};
use glam::Vec3;
use serde::Serialize;

/// Filtered irradiance at each vertex of a member, `vec4f`.
pub(super) fn filtered(
    plan: &mut Plan,
    surface: &Surface,
    member: &Member,
    kernels: &[Kernel; 3],
    highest: f64,
) -> Result<Slot<Buffer>, Problem> {
    let harmonics = plan.bake(Modes { mesh: member.mesh, highest });
    let points = plan.add(Points { mesh: member.mesh, harmonics });
    let irradiance = surface.irradiance(plan, member, points)?;
    let modes = plan.add(Upload { harmonics, what: What::Modes });
    let areas = plan.add(Upload { harmonics, what: What::Areas });
    let vertices = plan.add(Upload { harmonics, what: What::Vertices });
    let table = plan.add(Table { harmonics, kernels: kernels.clone(), mm_per_unit: surface.mm_per_unit() });
    let pass = |plan: &mut Plan, name, about: &str, file: &str, output, over, over_stride, binds: &[_]| {
        Ok::<_, Problem>(plan.add(Compute {
            name,
            about: format!("{about} of `{}`", member.name),
            shader: surface.shader(file, &[])?,
            output,
            over,
            over_stride,
            binds: binds.iter().map(|(name, slot)| (*name, Bind::Buffer(*slot))).collect(),
        }))
    };
    let partials = pass(
        plan,
        "filtered_normals.project",
        "what the light has of each mode, in parts,",
        "techniques/filtered_normals/project.wgsl",
        ("partials", 32),
        modes,
        4 * 64,
        &[("modes", modes), ("areas", areas), ("irradiance", irradiance)],
    )?;
    let coefficients = pass(
        plan,
        "filtered_normals.weigh",
        "what the light has of each mode, through the kernel,",
        "techniques/filtered_normals/weigh.wgsl",
        ("coefficients", 16),
        table,
        16,
        &[("table", table), ("areas", areas), ("partials", partials)],
    )?;
    pass(
        plan,
        "filtered_normals.spread",
        "the filtered light at each vertex",
        "techniques/filtered_normals/spread.wgsl",
        ("filtered", 16),
        vertices,
        4,
        &[("vertices", vertices), ("modes", modes), ("coefficients", coefficients), ("irradiance", irradiance)],
    )
}

/// What stands against filtering light with these kernels.
pub(super) fn refusal(kernels: &Kernels) -> Option<(&'static str, &'static str)> {
    matches!(kernels, Kernels::Neighbours(_)).then_some((
        "FilteredNormals(signal: Irradiance) filters by frequency, not over neighbours",
        "write Gaussian(width: …) or FromMedium(), or signal: Normals",
    ))
}

/// The eigenpairs of a mesh.
#[derive(Serialize)]
struct Modes {
    mesh: Slot<Mesh>,
    /// Frequencies beyond are not needed, rad per unit.
    highest: f64,
}

impl Step for Modes {
    type Output = Harmonics;
    fn name(&self) -> &'static str {
        "filtered_normals.modes"
    }
    fn about(&self) -> String {
        "the mesh's eigenpairs, for light".into()
    }
    fn run(&self, run: &Run) -> Result<Harmonics, Problem> {
        all_harmonics(&run.get(self.mesh), self.highest, &|share| run.tick(share))
    }
}

impl Bake for Modes {
    const CODE: &'static [&'static str] = CODE;
}

/// Where light is gathered: the samples, with the mean of their vertices' normals.
#[derive(Serialize)]
struct Points {
    mesh: Slot<Mesh>,
    harmonics: Slot<Harmonics>,
}

impl Step for Points {
    type Output = Mesh;
    const NEEDS_HOST: bool = false;
    fn name(&self) -> &'static str {
        "filtered_normals.points"
    }
    fn about(&self) -> String {
        "the places at which light is gathered".into()
    }
    fn run(&self, run: &Run) -> Result<Mesh, Problem> {
        let (mesh, harmonics) = (run.get(self.mesh), run.get(self.harmonics));
        let mut points = Mesh {
            positions: vec![Vec3::ZERO; harmonics.samples()],
            normals: vec![Vec3::ZERO; harmonics.samples()],
            ..Mesh::default()
        };
        let mut first = vec![Vec3::Y; harmonics.samples()];
        for (v, &s) in harmonics.sample.iter().enumerate().filter(|(_, s)| **s != NOWHERE) {
            points.positions[s as usize] = mesh.positions[v];
            points.normals[s as usize] += mesh.normals[v];
            first[s as usize] = mesh.normals[v];
        }
        for (normal, first) in points.normals.iter_mut().zip(first) {
            *normal = normal.normalize_or(first);
        }
        Ok(points)
    }
}

#[derive(Serialize)]
struct Upload {
    harmonics: Slot<Harmonics>,
    what: What,
}

#[derive(Clone, Copy, Serialize)]
enum What {
    Modes,
    /// Up to the stride of the modes.
    Areas,
    /// The sample of each.
    Vertices,
}

impl Step for Upload {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        match self.what {
            What::Modes => "eigenpairs to the device, as halves",
            What::Areas => "areas to the device",
            What::Vertices => "the sample of each vertex to the device",
        }
        .into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let harmonics = run.get(self.harmonics);
        let gpu: &Gpu = run.host();
        Ok(match self.what {
            What::Modes => Buffer::new(gpu, bytemuck::cast_slice(&halves(&harmonics.columns, harmonics.samples()))),
            What::Areas => {
                let mut areas = harmonics.areas.clone();
                areas.resize(stride(areas.len()), 0.0);
                Buffer::new(gpu, bytemuck::cast_slice(&areas))
            }
            What::Vertices => Buffer::new(gpu, bytemuck::cast_slice(&harmonics.sample)),
        })
    }
}

/// The weight of what all modes miss, per channel; then by how much that of each mode is more, and the mode's square.
#[derive(Serialize)]
struct Table {
    harmonics: Slot<Harmonics>,
    kernels: [Kernel; 3],
    mm_per_unit: f64,
}

impl Step for Table {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "filtered_normals.kernel"
    }
    fn about(&self) -> String {
        format!("{:?} for each mode", self.kernels[0])
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let harmonics = run.get(self.harmonics);
        let weights = self.kernels.each_ref().map(|kernel| harmonics.weights(kernel, self.mm_per_unit));
        let high = weights.each_ref().map(|(_, high)| *high);
        let mut table = vec![[high[0] as f32, high[1] as f32, high[2] as f32, 0.0]];
        table.extend((0..harmonics.omega.len()).map(|k| {
            let [r, g, b] = [0, 1, 2].map(|c| (weights[c].0[k] - high[c]) as f32);
            [r, g, b, harmonics.squares[k] as f32]
        }));
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&table)))
    }
}
