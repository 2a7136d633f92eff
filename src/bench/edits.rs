//! What an edit costs: the time from a picture that is there to the one that a changed word asks for, with all that has to
//! be baked, computed and drawn again, and nothing else.

use super::timing::aside;
use crate::gpu::Images;
use crate::optics::medium::Medium;
use crate::render::Look;
use crate::scene::{Filter, LightKind, Material, Object, Scene, Substance, Varying};
use crate::store::{Plan, Slot};
use std::sync::Arc;

/// Another picture of a contender: what an artist gets who changes one thing.
pub struct Edit {
    pub kind: &'static str,
    pub frame: (Plan, Slot<Images>),
}

/// Changes a scene, and how it is looked at.
type Change = fn(&mut Scene, &mut Look);

/// Every kind of edit that is measured: `edit:NAME`.
pub const KINDS: [(&str, Change); 5] = [
    ("camera", |_, look| look.view.camera = aside(&look.view.camera)),
    ("light", |scene, _| scene.lights.iter_mut().for_each(|light| dim(&mut light.kind))),
    ("surface", |scene, _| each_material(scene, |material| roughen(&mut material.surface.roughness))),
    ("medium", |scene, _| {
        each_material(scene, |material| {
            if let Substance::Translucent(medium) = &mut material.medium {
                *medium = denser(medium);
            }
            material.layers.iter_mut().for_each(|layer| layer.medium = denser(&layer.medium));
        });
    }),
    ("filter", |scene, _| each_material(scene, |material| widen(&mut material.filter))),
];

fn each_material(scene: &mut Scene, change: impl Fn(&mut Material)) {
    let translucent = |object: &&mut Object| object.material.medium.medium().is_some();
    scene.objects.iter_mut().filter(translucent).for_each(|object| change(Arc::make_mut(&mut object.material)));
}

/// A tenth less light.
fn dim(light: &mut LightKind) {
    match light {
        LightKind::Directional { irradiance: light, .. }
        | LightKind::Point { intensity: light, .. }
        | LightKind::Rect { radiance: light, .. } => *light *= 0.9,
        LightKind::Environment { scale, .. } => *scale *= 0.9,
    }
}

fn roughen(roughness: &mut Varying<f64>) {
    *roughness = Varying::Constant(match roughness {
        Varying::Constant(value) => 0.05 + 0.9 * *value,
        Varying::Texture(_) => 0.5,
    });
}

fn denser(medium: &Medium) -> Medium {
    Medium::coefficients(1.1 * medium.sigma_a, 1.1 * medium.sigma_s, medium.g)
}

/// A kernel that reaches a tenth farther. What comes from the medium changes with that.
fn widen(filter: &mut Filter) {
    let triple = match filter {
        Filter::Neighbours(kernel) => return kernel.radius *= 1.1,
        Filter::Curve(kernel) => return kernel.points.iter_mut().for_each(|(omega, _)| *omega /= 1.1),
        Filter::FromMedium(_) => return,
        Filter::Gaussian(kernel) => &mut kernel.width,
        Filter::Exponential(kernel) => &mut kernel.width,
        Filter::Diffusion(kernel) => &mut kernel.time_mm2,
        Filter::Box(kernel) => &mut kernel.wavelength,
        Filter::Normalized(kernel) => &mut kernel.std,
    };
    triple.0.iter_mut().for_each(|width| *width *= 1.1);
}
