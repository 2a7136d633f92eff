//! Reference: the truth, by following light on the CPU; what every other technique is measured against.
//!
//! Random walks through the media, refracted and reflected at their boundaries, each free path and each direction drawn as
//! physics has it: unbiased, in f64. `light: Direct` counts what real-time techniques make: light source, object, eye.
//! `light: Full` also counts what leaves one place and enters another. Where a material has `layers`, media vary with the
//! depth below the surface: the distance to its closest point. `integrator: Layered` counts what scatters once between coming
//! in and going out, the truth of what `Layered` approximates. `integrator: Bssrdf` takes the material's `profile` for what
//! the medium does, and is what that model makes when nothing else is approximated.
//!
//! Costs: seconds to hours. Samples double until the relative standard error of the picture is at most `max_error`, or
//! `max_spp` is reached; each doubling is kept, so that the same picture goes on where it was. It asks for no adapter. A
//! window shows every doubling as soon as it is there.
//!
//! Fails nowhere but in patience: noise falls with the square root of the time. What it leaves out: light of directional
//! and point lights that is reflected inside a smooth boundary before it scatters for the first time.
//!
//! It traces the whole scene, so it is the view's choice alone. What stands in its brackets goes before `reference:` in the
//! scene. `diaphane reference` says more of what it does, and writes variances.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "Reference(light: Direct, max_error: 0.05)")?;
//! diaphane::techniques::reference::Reference::of(&text)?.expect("it is one");
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

use crate::problem::Problem;
use crate::reference::volume::Light;
use crate::reference::{Integrator, Settings};
use crate::scene::{Scene, TechniqueText};
use serde::Deserialize;

#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Reference {
    pub integrator: Integrator,
    pub light: Light,
    pub max_error: Option<f64>,
    pub max_spp: Option<u32>,
    pub max_depth: Option<u32>,
    pub seed: Option<u64>,
}

impl Reference {
    pub const NAME: &'static str = "Reference";

    /// The settings, if this is the technique that the text names.
    pub fn of(text: &TechniqueText) -> Result<Option<Reference>, Problem> {
        if text.name != Reference::NAME {
            return Ok(None);
        }
        let reference: Reference = text.settings()?;
        if let Some(error) = reference.max_error
            && !(error.is_finite() && error > 0.0)
        {
            return Err(text.problem("max_error", format!("{error} can never be reached")).hint("a number above 0"));
        }
        if let Some((name, _)) = [("max_spp", reference.max_spp), ("max_depth", reference.max_depth)]
            .into_iter()
            .find(|(_, count)| *count == Some(0))
        {
            return Err(text.problem(name, "0 paths, or paths of no length, bring no light").hint("at least 1"));
        }
        Ok(Some(reference))
    }

    /// What an object that names it is told.
    pub(super) fn only_in_the_view(text: &TechniqueText) -> Problem {
        text.problem("", "Reference traces the whole scene: an object cannot be overridden to it")
            .hint("name it in the view: view: (technique: Reference())")
    }

    /// How to trace a scene as `look` has it: settings here, else the scene's own.
    pub fn settings(&self, scene: &Scene, view: &crate::frame::View) -> Settings {
        Settings {
            integrator: self.integrator,
            light: self.light,
            camera: view.camera,
            size: view.size,
            time_s: view.time_s,
            max_depth: self.max_depth.unwrap_or(scene.reference.max_depth),
            seed: self.seed.unwrap_or(scene.reference.seed),
            bands: (0, 1),
        }
    }

    pub fn max_error(&self, scene: &Scene) -> f64 {
        self.max_error.unwrap_or(scene.reference.max_error)
    }

    pub fn max_spp(&self, scene: &Scene) -> u64 {
        self.max_spp.unwrap_or(scene.reference.max_spp).max(1) as u64
    }
}
