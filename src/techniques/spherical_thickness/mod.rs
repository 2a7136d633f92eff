//! SphericalThickness: each vertex knows how thick the object is in every direction, as spherical harmonics [Tomaszewska2012].
//!
//! The paper's claim: thickness baked per vertex and looked up towards the lamp shows light through concave objects without
//! the seams of a depth map, with 25 coefficients for lamps behind an object and 4 for those in front. Light out is the sum
//! of eq. 3: ambient, diffuse and scattered light here, and gloss, which is the frame's.
//!
//! - `bands: 5`, from 1 to 8, gives bands² coefficients, of which lamps in front of the object (seen from the eye) get
//!   `front_bands: 2`; in between the others fade. `--no-skip` gives all to all.
//! - `encode: Transmittance` keeps what is left of light in each direction, per channel, so that its truncated series is the
//!   only error. `Thickness` is the paper's: it keeps lengths, and exp of a truncated series is not one of exp.
//! - `attenuation: Slab` is the share of light that comes out behind a slab as thick as the ray is long. `Beer` is
//!   exp(-sigma d), with `sigma: Transport` (sigma_tr) or `Extinction` (sigma_t). `Linear` is the paper's 1 - d, with d in
//!   units of `max_thickness` mm, the object's longest side unless told.
//! - `terms: Balanced` counts light from behind in full, from the side by an eighth, and from in front not at all, so that a
//!   sphere and a slab come out right, and takes from the diffuse term what went through: in white surroundings no more
//!   comes out than went in. `Paper` is the literal sum, which counts light from everywhere.
//! - `ambient`, `diffuse`, `scatter`: the factors k of eq. 3, 1 each.
//! - `window: 0` damps band l by (sin(x)/x)^window, x = pi l/bands: less ringing, less detail. Nothing is negative in any case.
//!
//! `SphericalThickness(terms: Paper, attenuation: Linear, encode: Thickness)` is the paper to the letter.
//!
//! Measured on `scenes/bench/thickness-back.ron` and its neighbours (`tools/runs/thickness.txt`): `Slab` is 26 % too bright
//! behind, `Beer` three times as bright as it should be with sigma_tr, the paper's sum eight times. The paper's claim holds
//! in front: 4 coefficients are as good as 49. Behind it holds for what is seen, DSSIM falls by 3 % from 25 to 49, and not
//! for relMSE, which falls by a seventh at the truth's brightness.
//!
//! Costs: a bake of lengths per shape (256 directions, 1024 above 5 bands; all vertices at once), and one of coefficients,
//! which is all that an edit of the medium makes anew. Then every lamp costs its coefficients times the vertices, once:
//! nothing of it depends on the eye. Moving and turning an object turns the lamps, and bakes nothing. The surroundings are
//! one inner product. What deforms is baked for every picture.
//!
//! Fails where light does not go straight: it spreads sideways in truth, so that the far side of a thick thing is too dark
//! behind a thin neighbour and edges of thickness show on the surface, softened only by how few bands there are. It sees the
//! mesh's vertices: thin parts need some, and the narrow ear of `scenes/bench/ears.ron` is mottled along its rim. A lamp near
//! the surface shines as bright behind as it does at the vertex itself. Holes in a mesh let light in.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "SphericalThickness(bands: 5, encode: Transmittance)")?;
//! diaphane::techniques::read(&text)?;
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

mod bake;

use super::attenuation::{Attenuation, Response, Sigma, Terms, positive};
use super::{Scattered, Technique};
use crate::frame::{Lamp, Member, Surface};
use crate::gpu::{Bind, Blend, Buffer, Compute, Format, Layer, Raster};
use crate::problem::{Problem, counted};
use crate::scene::TechniqueText;
use crate::store::{Plan, Slot};
use crate::uniform;
use bake::{Halves, Kept, Lengths, ThicknessSeries, TransmittanceSeries, words};
use glam::Vec4;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Encode {
    Thickness,
    #[default]
    Transmittance,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SphericalThickness {
    bands: usize,
    front_bands: usize,
    encode: Encode,
    attenuation: Attenuation,
    sigma: Sigma,
    /// mm
    max_thickness: Option<f64>,
    terms: Terms,
    ambient: f64,
    diffuse: f64,
    scatter: f64,
    window: f64,
}

impl Default for SphericalThickness {
    fn default() -> SphericalThickness {
        SphericalThickness {
            bands: 5,
            front_bands: 2,
            encode: Encode::default(),
            attenuation: Attenuation::default(),
            sigma: Sigma::default(),
            max_thickness: None,
            terms: Terms::default(),
            ambient: 1.0,
            diffuse: 1.0,
            scatter: 1.0,
            window: 0.0,
        }
    }
}

/// Directions of the bake, as `bands` needs them to rise above the noise.
fn directions(bands: usize) -> usize {
    if bands > 5 { 1024 } else { 256 }
}

/// Eight bands are what the shader evaluates.
const MOST_BANDS: usize = 8;
/// A lamp stands in front of an object when the cosine between the ways to it and to the eye is above this, and behind it
/// below 0.
const IN_FRONT: f64 = 0.25;

uniform! {
    struct Series {
        low: Vec4,
        high: Vec4,
        bands: u32,
        words: u32,
    }
}

uniform! {
    struct Stored {
        count: u32,
        words: u32,
    }
}

uniform! {
    struct Factors {
        ambient: f32,
        diffuse: f32,
        scatter: f32,
    }
}

/// What the steps of one object share.
struct Through {
    positions: Slot<Buffer>,
    normals: Slot<Buffer>,
    /// Of what is left of light in every direction; halves.
    transmittance: Slot<Buffer>,
    kept: Slot<Buffer>,
    /// Of the thickness, as a share of the diagonal of the object's box, and what is left of light by that share.
    thickness: Option<(Slot<Buffer>, Bind)>,
}

impl SphericalThickness {
    pub fn read(text: &TechniqueText) -> Result<Box<dyn Technique>, Problem> {
        let settings: SphericalThickness = text.settings()?;
        for (name, bands) in [("bands", settings.bands), ("front_bands", settings.front_bands)] {
            if !(1..=MOST_BANDS).contains(&bands) {
                let what = format!("{bands} bands are not allowed");
                return Err(text.problem(name, what).hint(format!("1 to {MOST_BANDS}")));
            }
        }
        if let Some(max_thickness) = settings.max_thickness {
            positive(text, "max_thickness", max_thickness, false)?;
        }
        let SphericalThickness { ambient, diffuse, scatter, window, .. } = settings;
        for (name, value) in [("ambient", ambient), ("diffuse", diffuse), ("scatter", scatter), ("window", window)] {
            positive(text, name, value, true)?;
        }
        Ok(Box::new(settings))
    }

    fn is_balanced(&self) -> bool {
        self.terms == Terms::Balanced
    }

    /// What each band of light from a lamp is multiplied with, and how many bands there are.
    fn weights(&self, plan: &mut Plan, surface: &Surface, member: &Member, lamp: &Lamp) -> ([f64; MOST_BANDS], usize) {
        let front = self.front_bands.min(self.bands);
        let shown = if surface.skips() { (1.0 - lamp.in_front / IN_FRONT).clamp(0.0, 1.0) } else { 1.0 };
        let bands = if shown > 0.0 { self.bands } else { front };
        if bands < self.bands {
            let what = format!("bands {bands} to {} of `{}` for `{}`", self.bands - 1, member.name, lamp.name);
            plan.skip(what, "the lamp stands in front of it");
        }
        let weight = |l: usize| {
            let x = PI * l as f64 / self.bands as f64;
            let window = if l == 0 { 1.0 } else { (x.sin() / x).powf(self.window) };
            if l < front { window } else { shown * window }
        };
        (std::array::from_fn(|l| if l < bands { weight(l) } else { 0.0 }), bands)
    }

    fn bakes(&self, plan: &mut Plan, surface: &Surface, member: &Member) -> Option<Through> {
        let mm_per_unit = surface.mm_per_unit();
        let max_thickness = self.max_thickness.unwrap_or(surface.extent(member) * mm_per_unit);
        let response = Response::of(self.attenuation, self.sigma, max_thickness, member.material)?;
        let (mesh, bands, is_balanced) = (member.mesh, self.bands, self.is_balanced());
        let lengths = plan.bake(Lengths { mesh, directions: directions(bands) });
        let series = plan.bake(TransmittanceSeries { lengths, mesh, mm_per_unit, response, bands, is_balanced });
        let thickness = (self.encode == Encode::Thickness).then(|| {
            let end = surface.diagonal(member);
            let series = plan.bake(ThicknessSeries { lengths, end, bands });
            (plan.add(Halves { series }), response.table(end * mm_per_unit))
        });
        Some(Through {
            positions: surface.positions(plan, member),
            normals: surface.normals(plan, member),
            transmittance: plan.add(Halves { series }),
            kept: plan.add(Kept { series, is_balanced }),
            thickness,
        })
    }

    /// Irradiance that comes through to each vertex, from the surroundings and all lamps. None where nothing shines.
    fn through(
        &self,
        plan: &mut Plan,
        surface: &Surface,
        member: &Member,
        baked: &Through,
    ) -> Result<Option<Slot<Buffer>>, Problem> {
        let words = words(self.bands) as u32;
        let mut sum = None;
        if let Some(sky) = surface.sky_harmonics(plan, member, self.bands) {
            let stored = Stored { count: (self.bands * self.bands) as u32, words };
            sum = Some(plan.add(Compute {
                name: "spherical_thickness.surroundings",
                about: format!("what the surroundings send through `{}`", member.name),
                shader: surface.shader("techniques/spherical_thickness/surroundings.wgsl", &[])?,
                output: ("through", 16),
                over: baked.normals,
                over_stride: 12,
                binds: vec![
                    ("stored", Bind::uniform(&stored)),
                    ("coefficients", Bind::Buffer(baked.transmittance)),
                    ("sky", Bind::Buffer(sky)),
                ],
            }));
        }
        for lamp in surface.lamps(member) {
            let (weights, bands) = self.weights(plan, surface, member, &lamp);
            let quarter = |i: usize| Vec4::from_array(std::array::from_fn(|l| weights[i + l] as f32));
            let series = Series { low: quarter(0), high: quarter(4), bands: bands as u32, words };
            let (mut flags, mut binds) =
                (Vec::new(), vec![("series", Bind::uniform(&series)), ("lamp", lamp.bind.clone())]);
            binds.extend([("positions", Bind::Buffer(baked.positions)), ("normals", Bind::Buffer(baked.normals))]);
            if self.is_balanced() {
                flags.push("BALANCED");
            }
            match &baked.thickness {
                Some((coefficients, table)) => {
                    flags.push("THICKNESS");
                    binds.extend([("coefficients", Bind::Buffer(*coefficients)), ("transmittances", table.clone())]);
                }
                None => binds.push(("coefficients", Bind::Buffer(baked.transmittance))),
            }
            if let Some(others) = surface.others(plan, member, &lamp)? {
                flags.push("SHADOWS");
                binds.extend(others);
            }
            if let Some(before) = sum {
                flags.push("MORE");
                binds.push(("before", Bind::Buffer(before)));
            }
            sum = Some(plan.add(Compute {
                name: "spherical_thickness.through",
                about: format!(
                    "what `{}` sends through `{}`, {}",
                    lamp.name,
                    member.name,
                    counted(bands * bands, "coefficient")
                ),
                shader: surface.shader("techniques/spherical_thickness/through.wgsl", &flags)?,
                output: ("through", 16),
                over: baked.normals,
                over_stride: 12,
                binds,
            }));
        }
        Ok(sum)
    }
}

impl Technique for SphericalThickness {
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
        let factors =
            Factors { ambient: self.ambient as f32, diffuse: self.diffuse as f32, scatter: self.scatter as f32 };
        let mut flags = Vec::new();
        let mut binds = vec![
            ("camera", surface.camera()),
            ("objects", surface.objects()),
            ("packed_map", surface.packed()),
            ("factors", Bind::uniform(&factors)),
        ];
        if let Some(lights) = surface.lights() {
            flags.push("LIGHTS");
            binds.push(("lights", lights));
        }
        if let Some(visibility) = surface.visibility(plan)? {
            flags.push("SHADOWS");
            binds.push(("visibility", visibility));
        }
        let (mut draws, mut is_through, mut environment) = (Vec::new(), false, false);
        for member in surface.members() {
            let Some(baked) = self.bakes(plan, surface, &member) else { continue };
            let mut streams = vec![baked.normals, baked.kept];
            if let Some(through) = self.through(plan, surface, &member, &baked)? {
                is_through = true;
                streams.push(through);
            }
            if let Some(sky) = surface.environment(plan, &member, baked.normals)? {
                environment = true;
                streams.push(sky);
            }
            draws.push(surface.draw(plan, &member, streams));
        }
        // Who shines on one of them shines on all.
        if is_through {
            flags.push("THROUGH");
        }
        if environment {
            flags.push("ENVIRONMENT");
        }
        Ok(plan.add(Raster {
            name: "spherical_thickness.scatter",
            about: format!("light that {} scattered where it entered or let through", counted(draws.len(), "thing")),
            shader: surface.shader("techniques/spherical_thickness/scatter.wgsl", &flags)?,
            size: surface.size(),
            targets: vec![(Format::Rgba32Float, Blend::Replace)],
            depth: surface.depth(),
            layers: vec![Layer::meshes(draws)],
            array: false,
            binds,
        }))
    }
}
