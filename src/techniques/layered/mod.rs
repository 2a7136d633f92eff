//! Layered: light scatters once in layers whose depths are painted, seen through the skin [Francois2006].
//!
//! A material's `layers` end at depths below the surface, the same everywhere or as an image says, four in the channels of
//! an image or as many as one likes. The eye's ray is followed into them, and light to each point of it through a plane that
//! stands for the surface there: the tangent plane near the surface, and deeper down one that was fitted to the vertices
//! around, within -ln(epsilon)/sigma_t of the first layer. How thick the layers are on light's way in is the mean of what
//! the maps say above the point and where light enters.
//!
//! - `march: Analytic`, the default: steps are placed by how much light is lost, end where layers end, and each is
//!   integrated in closed form. `Uniform` is the paper's: equal steps, one value each, the layer of their beginning.
//! - `samples: 12`: steps per ray. Uniform needs 50 to 100.
//! - `refract: true`: rays are bent where they enter and leave. `false` leaves them straight, as the paper does.
//! - `epsilon: 0.01`: how much light still counts where the plane is fitted.
//! - `multiple: false`: what scatters more often than once is left out, as in the paper. `true` adds it, by diffusion.
//!
//! A layer that ends above the one outside it is not there: each ends at the deepest depth of all from the outside to it.
//! That is decided in each texel, before maps are filtered, so that filtering invents no layer. `diaphane check` says where
//! it happens. Where there are no layers, the medium fills the thing.
//!
//! Lamps of all kinds shine in, with shadows looked up where the eye's ray enters; the surroundings are sixteen lamps,
//! chosen by importance, each as far as it is seen from the vertices.
//!
//! Costs: a bake per shape and first layer (planes) and per shape (slopes of its map); per frame one pass, as long as
//! steps times lamps times layers.
//!
//! `multiple: true` has diffusion go up and down in the layers as they are where light enters, as if they were as deep
//! everywhere: from the deepest one upwards each adds, in closed form, what it sends back and what it lets through. So a
//! texel has an effective medium, and for a half space the result is corrected to be exact. Light that scattered once is in
//! it, and its share is taken out again. Such light leaves where it entered, in each direction as it would be returned from
//! there, so that what is white and evenly lit is evenly bright; of maps it knows the mean over a mean free path.
//!
//! Fails without `multiple` where light scatters more often than once, which is most of it in skin or marble: such things
//! come out too dark. `scenes/bench/whisper.ron` shows it. With it, where light goes farther to the side than shadows and
//! curves are wide. Planes know no other side: what is thin is not lit from behind. Rays through a rough boundary are
//! bent as by a smooth one.
//!
//! Other than in the paper, planes have a unit normal and a signed distance; a neighbour counts by its area, and not when it
//! looks the other way; a point behind its plane is unlit.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "Layered(samples: 50, march: Uniform, refract: false)")?;
//! diaphane::techniques::read(&text)?;
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

mod bakes;
mod maps;
mod multiple;

use super::{Scattered, Technique};
use crate::frame::{Member, Surface};
use crate::gpu::{Bind, Blend, Format, Layer, Raster, Sampler};
use crate::optics::medium::Medium;
use crate::optics::phase::Phase;
use crate::problem::{Problem, counted};
use crate::scene::{Material, Substance, Varying};
use crate::store::Plan;
use crate::uniform;
use bakes::{MapStream, Planes, Slopes};
use glam::{DVec3, Vec3};
use maps::DepthMaps;
use multiple::Multiple;
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Layered {
    #[serde(deserialize_with = "steps")]
    pub samples: u32,
    pub march: March,
    pub refract: bool,
    #[serde(deserialize_with = "share")]
    pub epsilon: f64,
    pub multiple: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum March {
    #[default]
    Analytic,
    Uniform,
}

impl Default for Layered {
    fn default() -> Layered {
        Layered { samples: 12, march: March::Analytic, refract: true, epsilon: 0.01, multiple: false }
    }
}

/// More steps than this tell nothing new.
const MOST_STEPS: u32 = 1000;

fn steps<'de, D: Deserializer<'de>>(from: D) -> Result<u32, D::Error> {
    match u32::deserialize(from)? {
        steps @ 1..=MOST_STEPS => Ok(steps),
        steps => Err(D::Error::custom(format!("{steps} steps are not allowed: from 1 to {MOST_STEPS}"))),
    }
}

fn share<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    let share = f64::deserialize(from)?;
    match share > 0.0 && share < 1.0 {
        true => Ok(share),
        false => Err(D::Error::custom(format!("{share} is no share of light that counts: above 0 and below 1"))),
    }
}

uniform! {
    struct Steps {
        samples: u32,
    }
}

uniform! {
    struct Stack {
        first: u32,
        last: u32,
        map: i32,
        deepest: f32,
        reach: f32,
        bend: f32,
    }
}

uniform! {
    struct Stratum {
        sigma_t: Vec3,
        depth: f32,
        sigma_s: Vec3,
        is_schlick: u32,
        parameter: Vec3,
    }
}

/// The medium that the eye's ray enters first.
fn outermost(material: &Material) -> Option<&Medium> {
    material.layers.first().map(|layer| &layer.medium).or(material.medium.medium())
}

/// How far around a vertex the surface is one plane, mm [Francois2006, eq. 8].
fn neighbourhood(material: &Material, epsilon: f64) -> f64 {
    outermost(material).map_or(0.0, |medium| -epsilon.ln() / (medium.sigma_t().element_sum() / 3.0))
}

impl Technique for Layered {
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
        let mut stacks =
            vec![Stack { first: 0, last: 0, map: -1, deepest: 0.0, reach: 0.0, bend: 1.0 }; surface.places()];
        let mut strata = Vec::new();
        let mut maps = DepthMaps::default();
        let mut often = self.multiple.then(|| Multiple::of(surface.places()));
        for member in surface.members() {
            let map = maps.add(plan, member.material);
            let unit = 1.0 / surface.mm_per_unit();
            stacks[member.place()] = Stack {
                first: strata.len() as u32,
                last: (strata.len() + member.material.layers.len()) as u32,
                map,
                deepest: (maps::deepest(member.material) * unit) as f32,
                reach: (3f64.sqrt() * surface.extent(&member)) as f32,
                bend: if self.refract { member.material.surface.ior as f32 } else { 1.0 },
            };
            strata.extend(strata_of(member.material, surface.mm_per_unit()));
            if let Some(often) = &mut often {
                often.add(plan, &member, self.refract, surface.mm_per_unit());
            }
        }
        let mut flags = Vec::new();
        let mut binds: Vec<(&'static str, Bind)> = vec![
            ("camera", surface.camera()),
            ("objects", surface.objects()),
            ("packed_map", surface.packed()),
            ("march", Bind::uniform(&Steps { samples: self.samples })),
            ("stacks", Bind::list(&stacks)),
            ("strata", Bind::list(&strata)),
        ];
        if self.march == March::Uniform {
            flags.push("UNIFORM");
        }
        if let Some(lights) = surface.lights() {
            flags.push("LIGHTS");
            binds.push(("lights", lights));
        }
        if let Some(visibility) = surface.visibility(plan)? {
            flags.push("SHADOWS");
            binds.push(("visibility", visibility));
        }
        if let Some(lamps) = surface.sky_lamps(plan) {
            flags.push("SKY_LAMPS");
            binds.push(("sky_lamps", lamps));
        }
        if let Some(often) = often {
            flags.push("MULTIPLE");
            binds.extend(often.binds(plan));
        }
        let maps = maps.upload(plan);
        if let Some(maps) = maps {
            flags.push("DEPTHS");
            binds.push(("depth_maps", Bind::Texture(maps, 0)));
            binds.push(("repeat", Bind::Sampler(Sampler::LinearRepeat)));
        }
        let mut draws = Vec::new();
        for member in surface.members() {
            let planes = self.planes(plan, surface, &member);
            let mut streams = vec![surface.upload(plan, planes)];
            streams.extend(surface.sky_shares(plan, &member)?);
            if maps.is_some() {
                let slopes = plan.bake(Slopes { mesh: member.mesh });
                streams.extend([0, 1].map(|part| plan.add(MapStream { mesh: member.mesh, slopes, part })));
            }
            draws.push(surface.draw(plan, &member, streams));
        }
        Ok(plan.add(Raster {
            name: "technique.layered",
            about: format!(
                "light that scattered {}below {}, {} steps a ray",
                if self.multiple { "" } else { "once " },
                counted(draws.len(), "thing"),
                self.samples
            ),
            shader: surface.shader("techniques/layered/march.wgsl", &flags)?,
            size: surface.size(),
            targets: vec![(Format::Rgba32Float, Blend::Replace)],
            depth: surface.depth(),
            layers: vec![Layer::meshes(draws)],
            array: false,
            binds,
        }))
    }

    /// A mean free path: what is farther away from a shadow's edge sees none of it.
    fn entry_mm(&self, material: &Material) -> f64 {
        neighbourhood(material, (-1f64).exp())
    }
}

impl Layered {
    fn planes(&self, plan: &mut Plan, surface: &Surface, member: &Member) -> crate::store::Slot<Vec<glam::Vec4>> {
        let radius = neighbourhood(member.material, self.epsilon) / surface.mm_per_unit();
        // A clear layer has no such radius: the fit says what is too much. Infinity would be no number in a key.
        plan.bake(Planes { mesh: member.mesh, radius: radius.min(surface.extent(member)) })
    }
}

/// A material's layers and, last, what lies below them: their media and phase functions.
fn media(material: &Material) -> impl Iterator<Item = (&Medium, Phase)> {
    let Substance::Translucent(below) = &material.medium else {
        unreachable!("what is opaque is rendered as such");
    };
    let layers = material.layers.iter().map(|layer| (&layer.medium, layer.phase));
    layers.chain([(below, material.phase)])
}

/// The same for the device; lengths are scene units. No layer ends above the one outside it.
fn strata_of(material: &Material, mm_per_unit: f64) -> Vec<Stratum> {
    let mut deepest = 0f64;
    let ends = material.layers.iter().map(|layer| {
        if let Varying::Constant(depth) = &layer.depth {
            deepest = deepest.max(*depth);
        }
        deepest
    });
    let stratum = |((medium, phase), depth): ((&Medium, Phase), f64)| Stratum {
        sigma_t: (medium.sigma_t() * mm_per_unit).as_vec3(),
        depth: (depth / mm_per_unit) as f32,
        sigma_s: (medium.sigma_s * mm_per_unit).as_vec3(),
        is_schlick: (phase == Phase::Schlick) as u32,
        parameter: DVec3::from_array(medium.g.to_array().map(|g| phase.parameter(g))).as_vec3(),
    };
    media(material).zip(ends.chain([0.0])).map(stratum).collect()
}
