//! FilteredNormals: the normals are smoothed over the surface, and light is gathered with them [Patro2007].
//!
//! Diffuse light is linear in the normal, so a low-pass filter of the normals stands in for one of the light. Each vertex's
//! normal becomes the sum over its neighbours x_j within `radius` of n_j exp(-sigma_tr |x_i - x_j|), plus `alpha` of its own
//! [Patro2007, eq. 3], divided by the sum of the weights. A kernel's settings stand in the material, as `filter:`
//!
//! - `weights: Area` gives every neighbour the area that it stands for, so that a re-triangulated mesh gives the same field;
//!   `Uniform` is the literal equation, which does not.
//! - `length: Keep` leaves the result shorter where normals disagree, and so dims, as diffusion does; `Unit` does not.
//! - `filter: FromMedium()`, the default, is this kernel with the mean of the medium's sigma_tr over the channels, alpha 0
//!   and a radius of 7/sigma_tr, beyond which less than a hundredth of the weight lies. A medium without absorption has no
//!   such length: half of the object's size serves.
//!
//! Costs: a bake per shape and kernel, which looks at every pair of neighbours; after it a frame costs exactly what
//! `Opaque` costs, with the same steps: that is the method's point.
//!
//! Fails where light crosses the inside: thin parts stay dark against the light, and a shadow's edge stays sharp, since
//! only the normals are filtered and not the light. One normal serves all channels, so no colour bleeds at the terminator.
//! `scenes/first-light.ron` shows it in the ears. Shadows are looked up a scattering length above the surface, or an object
//! would shade its own terminator where its smoothed normals still face the light.
//!
//! Not there yet: the kernels `Gaussian`, `Exponential`, `Diffusion`, `Box`, `Normalized` and `Curve`, which need the
//! spectrum of the mesh.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "FilteredNormals()")?;
//! diaphane::techniques::read(&text)?;
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

use super::{Scattered, Technique, local};
use crate::frame::Surface;
use crate::geometry::mesh::Mesh;
use crate::geometry::neighbours::{self, Kernel};
use crate::problem::Problem;
use crate::scene::{Filter, Length, Material, Neighbours, Substance, Weights};
use crate::store::{Bake, Plan, Run, Slot, Step};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// It has no settings of its own: the kernel is the material's.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilteredNormals {}

/// Where a kernel that follows from the medium ends, in units of 1/sigma_tr: on a plane, (1 + 7) e^-7 = 0.7 % of the weight
/// lies beyond.
const REACH: f64 = 7.0;

/// The kernel that a material asks for on an object half of whose size is `half`; lengths in mm.
fn kernel(material: &Material, half: f64) -> Option<(Kernel, neighbours::Length)> {
    let weights = |w: Weights| match w {
        Weights::Area => neighbours::Weights::Area,
        Weights::Uniform => neighbours::Weights::Uniform,
    };
    let length = |l: Length| match l {
        Length::Keep => neighbours::Length::Keep,
        Length::Unit => neighbours::Length::Unit,
    };
    match &material.filter {
        Filter::Neighbours(kernel) => {
            let Neighbours { sigma_tr, radius, alpha, weights: w, length: l } = *kernel;
            // One normal serves all channels.
            let sigma_tr = DVec3::from(sigma_tr.0).element_sum() / 3.0;
            Some((Kernel { sigma_tr, radius, alpha, weights: weights(w) }, length(l)))
        }
        Filter::FromMedium(kernel) => {
            let Substance::Translucent(medium) = &material.medium else { return None };
            let sigma_tr = medium.sigma_tr().element_sum() / 3.0;
            // Without absorption there is no such length. Over the whole of a closed object normals would cancel.
            let radius = if sigma_tr > 0.0 { REACH / sigma_tr } else { half };
            Some((Kernel { sigma_tr, radius, alpha: 0.0, weights: neighbours::Weights::Area }, length(kernel.length)))
        }
        _ => None,
    }
}

impl Technique for FilteredNormals {
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
        local::scatter(plan, surface, |plan, member| {
            if let Some(problem) = self.refuses(member.material) {
                return Err(problem);
            }
            let mm_per_unit = surface.mm_per_unit();
            let half = 0.5 * surface.extent(member) * mm_per_unit;
            let Some((kernel, length)) = kernel(member.material, half) else {
                return Ok(surface.normals(plan, member));
            };
            let normals = plan.bake(NeighbourNormals { mesh: member.mesh, mm_per_unit, kernel, length });
            Ok(surface.upload(plan, normals))
        })
    }

    fn entry_mm(&self, material: &Material) -> f64 {
        kernel(material, f64::MAX).map_or(0.0, |(kernel, _)| (1.0 / kernel.sigma_tr).min(kernel.radius))
    }

    fn refuses(&self, material: &Material) -> Option<Problem> {
        let name = match &material.filter {
            Filter::Neighbours(_) | Filter::FromMedium(_) => return None,
            Filter::Gaussian(_) => "Gaussian",
            Filter::Exponential(_) => "Exponential",
            Filter::Diffusion(_) => "Diffusion",
            Filter::Box(_) => "Box",
            Filter::Normalized(_) => "Normalized",
            Filter::Curve(_) => "Curve",
        };
        Some(
            material
                .problem("filter", format!("FilteredNormals has no kernel {name} in this version"))
                .hint("write Neighbours(…) or FromMedium(), or render with --technique 'Opaque()'"),
        )
    }
}

/// Normals after Patro's neighbour kernel.
#[derive(Serialize)]
struct NeighbourNormals {
    mesh: Slot<Mesh>,
    mm_per_unit: f64,
    kernel: Kernel,
    length: neighbours::Length,
}

impl Step for NeighbourNormals {
    type Output = Vec<Vec3>;
    fn name(&self) -> &'static str {
        "filtered_normals.neighbours"
    }
    fn about(&self) -> String {
        match self.kernel.sigma_tr > 0.0 {
            true => format!(
                "normals averaged over neighbours, weights falling by e in {:.3} mm",
                1.0 / self.kernel.sigma_tr
            ),
            false => "normals averaged over all neighbours alike".into(),
        }
    }
    fn run(&self, run: &Run) -> Result<Vec<Vec3>, Problem> {
        let mesh = run.get(self.mesh);
        let tick = |share| run.tick(share);
        let normals = neighbours::filter_normals(&mesh, self.mm_per_unit, &self.kernel, self.length, &tick)?;
        Ok(normals.iter().map(|normal| normal.as_vec3()).collect())
    }
}

impl Bake for NeighbourNormals {
    const CODE: &'static [&'static str] = &["src/geometry/", "src/techniques/filtered_normals/"];
}
