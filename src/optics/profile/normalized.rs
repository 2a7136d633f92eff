//! Normalised diffusion [Christensen2015]: A s (e^(-s r/l) + e^(-s r/(3 l))) / (8 pi l r), whose integral is A for any s.
//!
//! A is the medium's own albedo under its boundary, from [`HalfSpace`], and l its *reduced* mean free path, since the fit
//! was made for isotropic scattering and others are similar to that. s is the fit for light that enters straight down.
//! The boundary enters by A alone: far from the point of entry the profile is several times too dark.

use super::Ratios;
use crate::optics::half_space::HalfSpace;
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug)]
pub(super) struct NormalizedDiffusion {
    albedo: f64,
    s: f64,
}

impl NormalizedDiffusion {
    pub fn new(ratios: Ratios, eta: f64) -> NormalizedDiffusion {
        let albedo = HalfSpace::new(eta).albedo_normal(ratios.coalbedo);
        // Where hardly anything scatters the albedo is proportional to alpha', of which the co-albedo has lost bits.
        let seen = 1.0 - ratios.coalbedo;
        NormalizedDiffusion::of_albedo(if seen == 0.0 { 0.0 } else { albedo * (ratios.alpha / seen) })
    }

    /// Of the surface albedo A.
    pub fn of_albedo(albedo: f64) -> NormalizedDiffusion {
        NormalizedDiffusion { albedo, s: 1.85 - albedo + 7.0 * (albedo - 0.8).abs().powi(3) }
    }

    /// R at the optical radius `x`.
    pub fn value(&self, x: f64) -> f64 {
        let s = self.s;
        self.albedo * s * ((-s * x).exp() + (-s * x / 3.0).exp()) / (8.0 * PI * x)
    }

    pub fn albedo(&self) -> f64 {
        self.albedo
    }
}
