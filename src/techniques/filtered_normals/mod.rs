//! FilteredNormals: the normals are smoothed over the surface, and light is gathered with them [Patro2007].
//!
//! Diffuse light is linear in the normal, so a low-pass filter of the normals stands in for one of the light. The kernel
//! stands in the material, as `filter:`, per colour channel where its width is given per channel:
//!
//! - `Gaussian(width:)`, `Exponential(width:)`, `Diffusion(time_mm2:)`, `Box(wavelength:)` and `Curve(points:)` weigh
//!   frequencies on the surface, in mm: nearly the same on any mesh of the same shape, and the same however its vertices are
//!   numbered.
//! - `Normalized(std:)` is the paper's own Gaussian, whose axis the mesh's edges decide.
//! - `FromMedium()`, the default, is (1 + (omega/sigma_tr)²)^(-3/2) with the medium's sigma_tr, per channel. A sigma_tr below
//!   6 / size counts as that: normals average to nothing over a closed object, which light never does.
//! - `Neighbours(…)` sums over the vertices within `radius` with weights exp(-sigma_tr r), plus `alpha` of the own normal
//!   [Patro2007, eq. 3]. `weights: Area` gives every neighbour the area that it stands for, so that a re-triangulated mesh
//!   gives the same field; `Uniform` is the literal equation, which does not: `scenes/neighbours-and-spectrum.ron`.
//! - `length: Keep` leaves the result shorter where normals disagree, and so dims, as diffusion does; `Unit` does not.
//!
//! How frequencies are told apart is the setting `engine`:
//!
//! - `Krylov` makes a small basis for this one field of normals. Smooth kernels come out to a thousandth or better, over the
//!   whole spectrum, on slivers too. The bake solves some fifty sparse systems with three or four factors, 0.7 s for 35,000
//!   vertices; it is made for a step of widths, a factor of 4, so that an edit within it finds it there.
//! - `Harmonics` finds the eigenpairs of the mesh up to the paper's omega_m (a wavelength of ten edges) or to where the
//!   kernel has ended; what lies above is weighted as a whole [Patro2007, eq. 11]. The bake is a hundred times longer.
//! - `Auto` takes eigenpairs for a Box, a Normalized, and a curve as steep as a box, and Krylov for all else.
//!
//! The setting `laplacian: MeanArea` divides by one mean area, as [Patro2007, eq. 4] is printed, for comparison: on an even
//! mesh that is the same, and on an uneven one waves count as longer where triangles are small. The default, `VertexArea`,
//! divides by the area around each vertex, and `signal: Irradiance` knows no other.
//!
//! The setting `signal: Irradiance` filters light instead: what falls on the vertices, shadows and all, spreads over the edges
//! of shadows, which filtered normals leave as they are, and none of it is lost. It needs eigenpairs to where the kernel has
//! ended, and in every frame two passes over all modes of all vertices: `scenes/shadow-edge.ron`.
//!
//! Costs: the bake; after it a frame costs exactly what `Opaque` costs, with the same steps, and one pass over the
//! vertices when the kernel is edited: that is the method's point. On the device lie two bytes per vertex and mode (at most
//! 81 modes by Krylov; 64 MiB in all, and where that is less than there should be, modes end earlier; filtered light has one
//! more for each separate part of a mesh, and is refused where those alone take as much) and 32 per vertex. A kernel that
//! differs between channels has three normals: each light and the surroundings are then gathered three times.
//! Of a medium of strong colour they point apart, and so each colour of a bump has its own terminator: red light, which
//! spreads farthest, reaches around it, as it does through skin. Where it spreads as far as a thing is thick, its normals are
//! also the shortest, and lit sides turn green or blue, which light that is not lost would not do: give such a thing one width
//! for all channels, `Exponential(width: 1.5)`.
//!
//! Fails where light crosses the inside: thin parts stay dark against the light, as `scenes/first-light.ron` shows in the
//! ears; and a shadow's edge stays sharp where normals are filtered and not the light. Shadows are looked up a
//! scattering length above the surface, or an object would shade its own terminator where its smoothed normals still face
//! the light.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "FilteredNormals(engine: Krylov)")?;
//! diaphane::techniques::read(&text)?;
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

mod kernel;
mod light;
mod steps;

use super::local::{self, Normals};
use super::{Scattered, Technique};
use crate::frame::{Member, Surface};
use crate::geometry::laplacian::Areas;
use crate::geometry::neighbours::Length;
use crate::geometry::spectrum::kernel::Kernel;
use crate::geometry::spectrum::{Band, Basis};
use crate::gpu::{Bind, Buffer, Compute};
use crate::problem::Problem;
use crate::scene::Material;
use crate::store::{Plan, Slot};
use kernel::Kernels;
use serde::Deserialize;
use steps::{ENDS_STRIDE, HarmonicNormals, KernelWeights, KrylovNormals, NeighbourNormals, UploadEnds, UploadModes};

/// The kernel is the material's; how it is applied stands here.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilteredNormals {
    engine: Engine,
    signal: Signal,
    laplacian: Areas,
}

/// What is filtered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
enum Signal {
    #[default]
    Normals,
    /// At the vertices, with shadows.
    Irradiance,
}

/// How frequencies on the mesh are told apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
enum Engine {
    #[default]
    Auto,
    Harmonics,
    Krylov,
}

impl Technique for FilteredNormals {
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
        match self.signal {
            Signal::Normals => local::scatter(plan, surface, |plan, member| self.normals(plan, surface, member)),
            Signal::Irradiance => {
                local::scatter_known(plan, surface, |plan, member| self.irradiance(plan, surface, member))
            }
        }
    }

    fn entry_mm(&self, material: &Material) -> f64 {
        if self.signal == Signal::Irradiance {
            return 0.0;
        }
        Kernels::of(material, f64::INFINITY).map_or(0.0, |kernels| kernels.reach())
    }

    fn refuses(&self, material: &Material) -> Option<Problem> {
        let kernels = Kernels::of(material, 1.0)?;
        if self.signal == Signal::Irradiance {
            let needs_pairs = ("a basis that is made for normals does not hold light", "leave out engine: Krylov");
            let loses_light = ("over one mean area light would not be conserved", "leave out laplacian: MeanArea");
            let refusal = light::refusal(&kernels)
                .or((self.engine == Engine::Krylov).then_some(needs_pairs))
                .or((self.laplacian == Areas::MeanArea).then_some(loses_light));
            return refusal.map(|(what, hint)| material.problem("filter", what).hint(hint));
        }
        let Kernels::Spectral(kernels) = kernels else { return None };
        let is_steep = kernels.iter().any(|kernel| !kernel.is_smooth());
        (self.engine == Engine::Krylov && is_steep).then(|| {
            material
                .problem("filter", "this kernel falls too steeply for FilteredNormals(engine: Krylov)")
                .hint("engine: Auto takes eigenpairs for it; or write Gaussian(width: …)")
        })
    }
}

impl FilteredNormals {
    fn normals(&self, plan: &mut Plan, surface: &Surface, member: &Member) -> Result<Normals, Problem> {
        if let Some(problem) = self.refuses(member.material) {
            return Err(problem);
        }
        let mm_per_unit = surface.mm_per_unit();
        let extent = surface.extent(member);
        let length = kernel::length(member.material);
        match Kernels::of(member.material, 0.5 * extent * mm_per_unit) {
            None => Ok(Normals::Same(surface.normals(plan, member))),
            Some(Kernels::Neighbours(kernels)) => each(&kernels, |kernel| {
                let step = NeighbourNormals { mesh: member.mesh, mm_per_unit, kernel: *kernel, length };
                let normals = plan.bake(step);
                Ok(surface.upload(plan, normals))
            }),
            Some(Kernels::Spectral(kernels)) if kernels.iter().all(Kernel::is_identity) => {
                plan.skip(format!("filtering the normals of `{}`", member.name), "its kernel lets everything pass");
                Ok(Normals::Same(surface.normals(plan, member)))
            }
            Some(Kernels::Spectral(kernels)) => {
                let basis = self.basis(plan, member, &kernels, extent, mm_per_unit);
                each(&kernels, |kernel| filtered(plan, surface, member, basis, kernel, length))
            }
        }
    }

    fn irradiance(&self, plan: &mut Plan, surface: &Surface, member: &Member) -> Result<Slot<Buffer>, Problem> {
        if let Some(problem) = self.refuses(member.material) {
            return Err(problem);
        }
        let (mm_per_unit, extent) = (surface.mm_per_unit(), surface.extent(member));
        match Kernels::of(member.material, 0.5 * extent * mm_per_unit) {
            Some(Kernels::Spectral(kernels)) if kernels.iter().all(Kernel::is_identity) => {
                plan.skip(format!("filtering the light of `{}`", member.name), "its kernel lets everything pass");
                surface.irradiance(plan, member, member.mesh)
            }
            Some(Kernels::Spectral(kernels)) => {
                let highest = highest(&kernels, extent, mm_per_unit);
                light::filtered(plan, surface, member, &kernels, highest)
            }
            _ => surface.irradiance(plan, member, member.mesh),
        }
    }

    /// The bake. All that its key has of the kernels is a coarse step of their widths.
    fn basis(
        &self,
        plan: &mut Plan,
        member: &Member,
        kernels: &[Kernel; 3],
        extent: f64,
        mm_per_unit: f64,
    ) -> Slot<Basis> {
        let (mesh, laplacian) = (member.mesh, self.laplacian);
        let per_unit = |per_mm: f64| per_mm * mm_per_unit;
        let why = match self.engine {
            Engine::Krylov => None,
            Engine::Harmonics => Some("the technique asks for them"),
            Engine::Auto => kernels.iter().find_map(|kernel| match kernel {
                Kernel::Normalized { .. } => Some("Normalized is a share of their axis"),
                kernel => (!kernel.is_smooth()).then_some("the kernel is too steep for less"),
            }),
        };
        if let Some(why) = why {
            let highest = highest(kernels, extent, mm_per_unit);
            return plan.bake(HarmonicNormals { mesh, laplacian, highest, why });
        }
        let band = match kernels {
            [Kernel::Normalized { .. }, ..] => {
                let (low, high) = steps_of(kernels.each_ref().map(|kernel| kernel.knee_per_edge()));
                Band::PerEdge(low, high)
            }
            _ => {
                let knees = kernels.each_ref().map(|kernel| kernel.knee().map_or(f64::MAX, per_unit));
                let (low, high) = steps_of(knees.map(|knee| knee * extent));
                Band::PerUnit(low / extent, high / extent)
            }
        };
        plan.bake(KrylovNormals { mesh, laplacian, band })
    }
}

/// A frequency above all that kernels let pass, rad per unit; in steps of the root of 2, which is twice the pairs.
fn highest(kernels: &[Kernel; 3], extent: f64, mm_per_unit: f64) -> f64 {
    let ends = kernels.each_ref().map(|kernel| kernel.end().map_or(f64::MAX, |end| end * mm_per_unit * extent));
    let end = ends.into_iter().fold(0.0, f64::max);
    let step = (2.0 * end.log2()).ceil().clamp(0.0, 48.0);
    2f64.powf(0.5 * step) / extent
}

/// The powers of 4 around some numbers, between those that mean anything on a mesh.
fn steps_of(numbers: [f64; 3]) -> (f64, f64) {
    let step = |number: f64| (number.ln() / 4f64.ln()).floor().clamp(-2.0, 12.0) as i32;
    let steps = numbers.map(step);
    let [low, high] = [steps.iter().min(), steps.iter().max()].map(|step| *step.expect("there are three"));
    (4f64.powi(low), 4f64.powi(high + 1))
}

/// One for all channels when their kernels are equal.
fn each<K: PartialEq>(
    kernels: &[K; 3],
    mut filtered: impl FnMut(&K) -> Result<Slot<Buffer>, Problem>,
) -> Result<Normals, Problem> {
    let [r, g, b] = kernels;
    Ok(match r == g && g == b {
        true => Normals::Same(filtered(r)?),
        false => Normals::Each([filtered(r)?, filtered(g)?, filtered(b)?]),
    })
}

/// The normals through one kernel.
fn filtered(
    plan: &mut Plan,
    surface: &Surface,
    member: &Member,
    basis: Slot<Basis>,
    kernel: &Kernel,
    length: Length,
) -> Result<Slot<Buffer>, Problem> {
    let ends = plan.add(UploadEnds { basis });
    let modes = plan.add(UploadModes { basis });
    let weights = plan.add(KernelWeights { basis, kernel: kernel.clone(), mm_per_unit: surface.mm_per_unit() });
    let mut flags = Vec::new();
    let mut binds =
        vec![("ends", Bind::Buffer(ends)), ("modes", Bind::Buffer(modes)), ("weights", Bind::Buffer(weights))];
    if length == Length::Unit {
        flags.push("UNIT");
        binds.push(("unfiltered", Bind::Buffer(surface.normals(plan, member))));
    }
    Ok(plan.add(Compute {
        name: "filtered_normals.reconstruct",
        about: format!("the filtered normals of `{}`", member.name),
        shader: surface.shader("techniques/filtered_normals/reconstruct.wgsl", &flags)?,
        output: ("normals", 12),
        over: ends,
        over_stride: ENDS_STRIDE,
        binds,
    }))
}
