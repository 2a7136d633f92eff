//! Opaque: light leaves where it entered. The floor that every other technique is compared with.
//!
//! The surface scatters as a Lambertian one that has the albedo of the medium beneath it: of the light that gets in, the
//! share that a half space of the medium gives back, after any number of scatterings and internal reflections
//! [Chandrasekhar1960]. Light gets in and out by Fresnel transmittance. That is the limit of a medium whose mean free
//! path is far below a pixel, and right there.
//!
//! Costs: one pass over the visible surface; no bake.
//!
//! Fails where the mean free path is seen: no light bleeds across a shadow's edge, thin parts let none through, and detail
//! stays as sharp as paint. `scenes/first-light.ron` shows it in the ears.
//!
//! Things whose medium is `Opaque(albedo: …)` are always rendered this way.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "Opaque()")?;
//! diaphane::techniques::read(&text)?;
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

use super::local::{self, Normals};
use super::{Scattered, Technique};
use crate::frame::Surface;
use crate::problem::Problem;
use crate::store::Plan;
use serde::Deserialize;

/// It has no settings.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Opaque {}

impl Technique for Opaque {
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
        local::scatter(plan, surface, |plan, member| Ok(Normals::Same(surface.normals(plan, member))))
    }
}
