//! The spellings of a medium in a file, and what each of them comes to.

use crate::scene::document::Judge;
use crate::scene::fields::Triple;
use crate::scene::path::join;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Absorption and scattering, 1/mm, and the anisotropy of scattering.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Medium {
    pub sigma_a: DVec3,
    pub sigma_s: DVec3,
    pub g: f64,
}

impl Medium {
    pub fn sigma_s_prime(&self) -> DVec3 {
        self.sigma_s * (1.0 - self.g)
    }
    pub fn sigma_t_prime(&self) -> DVec3 {
        self.sigma_a + self.sigma_s_prime()
    }
    pub fn albedo_prime(&self) -> DVec3 {
        self.sigma_s_prime() / self.sigma_t_prime()
    }
    /// Classical: sqrt(3 sigma_a sigma_t').
    pub fn sigma_tr(&self) -> DVec3 {
        (3.0 * self.sigma_a * self.sigma_t_prime()).map(f64::sqrt)
    }
}

/// What lies inside a surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Substance {
    Translucent(Medium),
    /// Lambertian: nothing gets in.
    Opaque {
        albedo: DVec3,
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
        let before = judge.problems.len();
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
                let names: Vec<&str> = PRESETS.iter().map(|p| p.0).collect();
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
        if judge.problems.len() == before
            && let Substance::Translucent(medium) = self.resolve(1.3)
            && !(medium.sigma_a.is_finite() && medium.sigma_s.is_finite())
        {
            judge.wrong(path, "this medium is too dense to compute with", "a mean free path above 1e-300 mm");
        }
    }

    pub fn is_opaque(&self) -> bool {
        matches!(self, MediumSpec::Opaque(_))
    }

    /// The index of refraction of a surface that does not give one.
    pub fn default_ior(&self) -> f64 {
        match self {
            MediumSpec::Opaque(_) => 1.0,
            MediumSpec::Preset(name) => PRESETS.iter().find(|p| p.0 == name).map_or(1.3, |p| p.1),
            _ => 1.3,
        }
    }

    /// What the spelling comes to, under a surface of this index of refraction. Its numbers are within their ranges.
    pub fn resolve(&self, _ior: f64) -> Substance {
        let v = |t: Triple| DVec3::from(t.0);
        let (sigma_a, sigma_s, g) = match self {
            MediumSpec::ReducedCoefficients(m) => (v(m.sigma_a), v(m.sigma_s_prime), 0.0),
            MediumSpec::Coefficients(m) => (v(m.sigma_a), v(m.sigma_s), m.g),
            MediumSpec::Extinction(m) => (v(m.sigma_t) * (1.0 - v(m.albedo)), v(m.sigma_t) * v(m.albedo), m.g),
            MediumSpec::AlbedoMfp(m) => ((1.0 - v(m.albedo)) / v(m.mfp), v(m.albedo) / v(m.mfp), m.g),
            MediumSpec::Color(m) => {
                // Van de Hulst's relation, index-matched [OpenPBR2024, section 3.7].
                let single = v(m.color).map(|c| {
                    let s = 4.09712 + 4.20863 * c - (9.59217 + 41.6808 * c + 17.7126 * c * c).sqrt();
                    (1.0 - s * s) / (1.0 - m.anisotropy * s * s)
                });
                let sigma_t = 1.0 / (m.radius * v(m.radius_scale));
                (sigma_t * (1.0 - single), sigma_t * single, m.anisotropy)
            }
            MediumSpec::Preset(name) => {
                let [a, s] = PRESETS.iter().find(|p| p.0 == name).map_or([[0.0; 3]; 2], |p| [p.2, p.3]);
                (DVec3::from(a), DVec3::from(s), 0.0)
            }
            MediumSpec::Opaque(m) => return Substance::Opaque { albedo: v(m.albedo) },
        };
        Substance::Translucent(Medium { sigma_a, sigma_s, g })
    }
}

/// Name, index of refraction, sigma_a, sigma_s' [Jensen2001].
type Preset = (&'static str, f64, [f64; 3], [f64; 3]);
const PRESETS: [Preset; 12] = [
    ("apple", 1.3, [0.003, 0.0034, 0.046], [2.29, 2.39, 1.97]),
    ("chicken1", 1.3, [0.015, 0.077, 0.19], [0.15, 0.21, 0.38]),
    ("chicken2", 1.3, [0.018, 0.088, 0.2], [0.19, 0.25, 0.32]),
    ("cream", 1.3, [0.0002, 0.0028, 0.0163], [7.38, 5.47, 3.15]),
    ("ketchup", 1.3, [0.061, 0.97, 1.45], [0.18, 0.07, 0.03]),
    ("marble", 1.5, [0.0021, 0.0041, 0.0071], [2.19, 2.62, 3.0]),
    ("potato", 1.3, [0.0024, 0.009, 0.12], [0.68, 0.7, 0.55]),
    ("skimmilk", 1.3, [0.0014, 0.0025, 0.0142], [0.7, 1.22, 1.9]),
    ("skin1", 1.3, [0.032, 0.17, 0.48], [0.74, 0.88, 1.01]),
    ("skin2", 1.3, [0.013, 0.07, 0.145], [1.09, 1.59, 1.79]),
    ("spectralon", 1.3, [0.0, 0.0, 0.0], [11.6, 20.4, 14.9]),
    ("wholemilk", 1.3, [0.0011, 0.0024, 0.014], [2.55, 3.21, 3.77]),
];
