//! The spellings of a medium in a file, and what each of them comes to.

use crate::optics::Rgb;
use crate::optics::medium::Medium;
use crate::optics::phase::Phase;
use crate::optics::presets::{Preset, preset, presets};
use crate::scene::fields::Triple;
use crate::scene::meaning::Judge;
use crate::scene::path::join;
use serde::{Deserialize, Serialize};

/// What lies inside a surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Substance {
    Translucent(Medium),
    /// Lambertian: nothing gets in.
    Opaque {
        albedo: Rgb,
    },
}

impl Substance {
    pub fn medium(&self) -> Option<&Medium> {
        match self {
            Substance::Translucent(medium) => Some(medium),
            Substance::Opaque { .. } => None,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MediumSpec {
    ReducedCoefficients(ReducedCoefficients),
    Coefficients(Coefficients),
    Extinction(Extinction),
    AlbedoMfp(AlbedoMfp),
    Color(Color),
    Preset(String),
    Opaque(Opaque),
}

macro_rules! spelling {
    ($(#[$meta:meta])* $name:ident { $($field:ident: $type:ty = $default:expr),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(pub $field: $type),*
        }
        impl Default for $name {
            fn default() -> $name {
                $name { $($field: $default),* }
            }
        }
    };
}

spelling! {
    /// Measured by diffusion, so that g is unknown and 0, 1/mm.
    ReducedCoefficients { sigma_a: Triple = Triple::all(0.01), sigma_s_prime: Triple = Triple::all(1.0) }
}
spelling! {
    /// 1/mm
    Coefficients { sigma_a: Triple = Triple::all(0.01), sigma_s: Triple = Triple::all(1.0), g: f64 = 0.0 }
}
spelling! {
    /// sigma_t in 1/mm; the albedo of a single scattering event
    Extinction { sigma_t: Triple = Triple::all(1.0), albedo: Triple = Triple::all(0.99), g: f64 = 0.0 }
}
spelling! {
    /// The albedo of a single scattering event; the mean free path in mm
    AlbedoMfp { albedo: Triple = Triple::all(0.99), mfp: Triple = Triple::all(1.0), g: f64 = 0.0 }
}
spelling! {
    /// [OpenPBR2024]: the albedo of all scattering together; the mean free path `radius * radius_scale` in mm
    Color {
        color: Triple = Triple::all(0.8),
        radius: f64 = 1.0,
        radius_scale: Triple = Triple([1.0, 0.5, 0.25]),
        anisotropy: f64 = 0.0,
    }
}
spelling! { Opaque { albedo: Triple = Triple::all(0.8) } }

const AT_LEAST_0: &str = "1/mm, 0 or more";
const SHARE: &str = "from 0 to 1";

impl MediumSpec {
    /// Every number within its range. `path` is where the medium stands.
    pub fn check(&self, judge: &mut Judge<'_>, path: &str) {
        let mut coefficients = |values: &[(&str, Triple)]| {
            for (name, value) in values {
                judge.all(&join(path, name), &value.0, |v| v >= 0.0, AT_LEAST_0);
            }
        };
        let g = match self {
            MediumSpec::ReducedCoefficients(m) => {
                coefficients(&[("sigma_a", m.sigma_a), ("sigma_s_prime", m.sigma_s_prime)]);
                None
            }
            MediumSpec::Coefficients(m) => {
                coefficients(&[("sigma_a", m.sigma_a), ("sigma_s", m.sigma_s)]);
                Some(("g", m.g))
            }
            MediumSpec::Extinction(m) => {
                judge.all(&join(path, "sigma_t"), &m.sigma_t.0, |v| v >= 0.0, AT_LEAST_0);
                judge.all(&join(path, "albedo"), &m.albedo.0, |v| (0.0..=1.0).contains(&v), SHARE);
                Some(("g", m.g))
            }
            MediumSpec::AlbedoMfp(m) => {
                judge.all(&join(path, "albedo"), &m.albedo.0, |v| (0.0..=1.0).contains(&v), SHARE);
                judge.all(&join(path, "mfp"), &m.mfp.0, |v| v > 0.0, "mm, above 0");
                Some(("g", m.g))
            }
            MediumSpec::Color(m) => {
                judge.all(&join(path, "color"), &m.color.0, |v| (0.0..=1.0).contains(&v), SHARE);
                judge.all(&join(path, "radius"), &[m.radius], |v| v > 0.0, "mm, above 0");
                judge.all(&join(path, "radius_scale"), &m.radius_scale.0, |v| v > 0.0, "above 0");
                Some(("anisotropy", m.anisotropy))
            }
            MediumSpec::Preset(name) => {
                let names: Vec<&str> = presets().map(|p| p.name).collect();
                judge.known(path, name, "preset", &names);
                None
            }
            MediumSpec::Opaque(m) => {
                judge.all(&join(path, "albedo"), &m.albedo.0, |v| (0.0..=1.0).contains(&v), SHARE);
                None
            }
        };
        if let Some((name, g)) = g {
            judge.all(&join(path, name), &[g], |v| v.abs() < 1.0, "between -1 and 1, both excluded");
        }
    }

    pub fn is_opaque(&self) -> bool {
        matches!(self, MediumSpec::Opaque(_))
    }

    fn preset(&self) -> Option<Preset> {
        match self {
            MediumSpec::Preset(name) => preset(name),
            _ => None,
        }
    }

    /// The index of refraction of a surface that does not give one.
    pub fn default_ior(&self) -> f64 {
        match self {
            MediumSpec::Opaque(_) => 1.0,
            _ => self.preset().map_or(1.3, |p| p.ior),
        }
    }

    /// The phase function of a medium for which none is given.
    pub fn default_phase(&self) -> Phase {
        self.preset().map_or(Phase::default(), |p| p.phase)
    }

    /// What the spelling comes to, under a surface of this index of refraction. Its numbers are within their ranges.
    /// g is the phase function's own parameter; the medium's is the mean cosine that follows.
    pub fn resolve(&self, ior: f64, phase: Phase) -> Substance {
        let rgb = |t: Triple| Rgb::from(t.0);
        let g = |parameter: f64| Rgb::splat(phase.mean_cosine(parameter));
        Substance::Translucent(match self {
            MediumSpec::ReducedCoefficients(m) => Medium::reduced_coefficients(rgb(m.sigma_a), rgb(m.sigma_s_prime)),
            MediumSpec::Coefficients(m) => Medium::coefficients(rgb(m.sigma_a), rgb(m.sigma_s), g(m.g)),
            MediumSpec::Extinction(m) => Medium::extinction(rgb(m.sigma_t), rgb(m.albedo), g(m.g)),
            MediumSpec::AlbedoMfp(m) => Medium::albedo_mfp(rgb(m.albedo), rgb(m.mfp), g(m.g)),
            MediumSpec::Color(m) => Medium::color(rgb(m.color), m.radius, rgb(m.radius_scale), g(m.anisotropy), ior),
            MediumSpec::Preset(name) => preset(name).expect("unknown names were refused").medium,
            MediumSpec::Opaque(m) => return Substance::Opaque { albedo: rgb(m.albedo) },
        })
    }
}
