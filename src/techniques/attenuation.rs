//! What is left of light that crosses a thickness: the ways that the techniques which know thickness share.

use crate::gpu::Bind;
use crate::optics::Rgb;
use crate::optics::medium::Medium;
use crate::optics::slab::Slab;
use crate::problem::Problem;
use crate::scene::{Material, Substance, TechniqueText};
use crate::uniform;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// How light fades with the thickness d.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Attenuation {
    /// As much as comes out behind a slab of the medium as thick as d: [`Slab`].
    #[default]
    Slab,
    /// exp(-sigma d), per channel.
    Beer,
    /// 1 - d / max_thickness, the literal (1 - d) [Tomaszewska2012, eq. 3].
    Linear,
}

/// The coefficient of [`Attenuation::Beer`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Sigma {
    /// sigma_tr: what remains after many scatterings.
    #[default]
    Transport,
    /// sigma_t: what was never scattered.
    Extinction,
}

/// How the terms of eq. 3 go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Terms {
    /// Light that comes through counts as it would on a slab whose faces are the surface here, and what goes through does
    /// not come back where it entered.
    #[default]
    Balanced,
    /// The literal sum: the scatter term has the same weight wherever the lamp stands.
    Paper,
}

/// What of the light is left, as a function of the thickness in mm, with no more in it than that function reads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Response {
    Slab { medium: Medium, ior: f64 },
    Beer { sigma: Rgb },
    Linear { max_thickness: f64 },
}

impl Response {
    /// That of a material; `max_thickness` in mm. None for what lets no light in.
    pub fn of(attenuation: Attenuation, sigma: Sigma, max_thickness: f64, material: &Material) -> Option<Response> {
        let Substance::Translucent(medium) = &material.medium else { return None };
        Some(match attenuation {
            Attenuation::Slab => Response::Slab { medium: *medium, ior: material.surface.ior },
            Attenuation::Beer => Response::Beer {
                sigma: match sigma {
                    Sigma::Transport => medium.sigma_tr(),
                    Sigma::Extinction => medium.sigma_t(),
                },
            },
            Attenuation::Linear => Response::Linear { max_thickness },
        })
    }

    /// The function itself, of mm.
    pub fn function(&self) -> Box<dyn Fn(f64) -> Rgb> {
        match *self {
            Response::Slab { medium, ior } => {
                let slab = Slab::new(&medium, ior);
                Box::new(move |d| slab.transmittance(d))
            }
            Response::Beer { sigma } => Box::new(move |d| (-sigma * d).exp()),
            Response::Linear { max_thickness } => Box::new(move |d| Rgb::splat((1.0 - d / max_thickness).max(0.0))),
        }
    }

    /// Its values up to `end` mm, as `techniques/transmittance.wgsl` reads them: denser where it is thin.
    pub fn table(&self, end: f64) -> Bind {
        let function = self.function();
        let row = |i: usize| {
            let at = i as f64 / (ROWS - 1) as f64;
            Transmittance { rgb: function(end * at * at).as_vec3() }
        };
        Bind::list(&(0..ROWS).map(row).collect::<Vec<Transmittance>>())
    }
}

/// Of the table. Between two of them a slab's transmittance is known to 0.2 % of its largest value at 100 mean free paths.
const ROWS: usize = 256;

uniform! {
    struct Transmittance {
        rgb: Vec3,
    }
}

/// How much light from behind counts, given the cosine between the normal and the way to the lamp: 1 where the lamp is right
/// behind, 0 where it is right in front, and an eighth at the edge between them, where a medium lets light around. Its
/// integral over all directions is pi, as that of a cosine is, so that no light is added.
pub fn behind(cos: f64) -> f64 {
    (0.5 * (1.0 - cos)).powi(3)
}

/// What both techniques ask of their numbers.
pub fn positive(text: &TechniqueText, setting: &str, value: f64, or_zero: bool) -> Result<(), Problem> {
    if value.is_finite() && (value > 0.0 || or_zero && value == 0.0) {
        return Ok(());
    }
    let hint = if or_zero { "0 or more" } else { "above 0" };
    Err(text.problem(setting, format!("{value:?} is not allowed")).hint(hint))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::quadrature::{gauss_legendre, integrate};
    use std::f64::consts::PI;

    #[test]
    fn light_from_behind_weighs_as_much_as_a_cosine() {
        let whole = 2.0 * PI * integrate(&gauss_legendre(8, -1.0, 1.0), behind);
        assert!((whole - PI).abs() < 1e-12 && behind(-1.0) == 1.0 && behind(1.0) == 0.0);
    }

    #[test]
    fn a_table_holds_the_function() {
        let medium = Medium::coefficients(Rgb::splat(0.01), Rgb::new(1.0, 10.0, 0.1), Rgb::ZERO);
        let beer = Response::Beer { sigma: Rgb::new(0.1, 1.0, 3.0) };
        for response in [Response::Slab { medium, ior: 1.4 }, beer, Response::Linear { max_thickness: 7.0 }] {
            let Bind::Data { bytes, .. } = response.table(10.0) else { panic!("a table is data") };
            let rows: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
            let function = response.function();
            for i in 0..1000 {
                let share = i as f64 / 1000.0;
                let at = share.sqrt() * (ROWS - 1) as f64;
                let (low, f) = ((at as usize).min(ROWS - 2), at - at.floor());
                for c in 0..3 {
                    let row = |k: usize| f64::from(rows[4 * k + c]);
                    let found = row(low) * (1.0 - f) + row(low + 1) * f;
                    assert!((found - function(10.0 * share)[c]).abs() < 2.5e-3, "{response:?} {share} {c}");
                }
            }
        }
    }
}
