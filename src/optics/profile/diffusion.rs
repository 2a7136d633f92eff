//! The diffuse light that a point source below a boundary makes on it: the part that both dipoles and photon beam diffusion
//! share. The unit of length is 1/sigma_t'.
//!
//! A source at depth z and its negative mirror image at -(z + 2 z_b) make the fluence 0 at the height z_b, so at the
//! distance r on the surface, with d_r and d_v the distances from the two,
//!
//! ```text
//! phi = (e^(-s d_r)/d_r - e^(-s d_v)/d_v) / (4 pi D)
//! E   = (z (1 + s d_r) e^(-s d_r)/d_r³ + (z + 2 z_b) (1 + s d_v) e^(-s d_v)/d_v³) / (4 pi)
//! ```
//!
//! are fluence and flux, s the effective transport coefficient. What leaves is gain · (c_phi phi + c_E E) [dEon2011;
//! dEon2012]. [Jensen2001] counts E alone.

use super::Ratios;
use crate::optics::fresnel::{diffuse_transmittance, fresnel_moment};
use std::f64::consts::PI;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diffusion {
    /// D, in 1/sigma_t'.
    coefficient: f64,
    /// s = sqrt(sigma_a / D), in sigma_t'.
    sigma_tr: f64,
    z_b: f64,
    c_phi: f64,
    c_e: f64,
    gain: f64,
}

impl Diffusion {
    /// Classical diffusion under the boundary of [Jensen2001].
    pub fn classical(ratios: Ratios, eta: f64) -> Diffusion {
        let internal = diffuse_fresnel(eta);
        Diffusion {
            coefficient: 1.0 / 3.0,
            sigma_tr: (3.0 * ratios.coalbedo).sqrt(),
            // 2 A D
            z_b: 2.0 / 3.0 * (1.0 + internal) / (1.0 - internal),
            c_phi: 0.0,
            c_e: 1.0,
            gain: ratios.alpha,
        }
    }

    /// Grosjean's diffusion coefficient, in which alpha'² of the light is left to diffuse, under the boundary that
    /// the Fresnel moments of light from inside give.
    pub fn grosjean(ratios: Ratios, eta: f64) -> Diffusion {
        let coefficient = (1.0 + ratios.coalbedo) / 3.0;
        // 1 - 2 FM1, by the reciprocity of étendue.
        let leaving = diffuse_transmittance(eta) / (eta * eta);
        let fm2 = fresnel_moment(2, eta);
        Diffusion {
            coefficient,
            sigma_tr: (ratios.coalbedo / coefficient).sqrt(),
            z_b: 2.0 * coefficient * (1.0 + 3.0 * fm2) / leaving,
            c_phi: 0.25 * leaving,
            c_e: 0.5 * (1.0 - 3.0 * fm2),
            gain: ratios.alpha * ratios.alpha,
        }
    }

    /// What leaves at the distance `r` from above a source at depth `z`, per unit area.
    pub fn exitance(&self, r: f64, z: f64) -> f64 {
        let s = self.sigma_tr;
        let image = z + 2.0 * self.z_b;
        let (d_r, d_v) = (r.hypot(z), r.hypot(image));
        // d_v - d_r. Far away the two sources all but cancel, so their difference is what must be computed.
        let apart = 4.0 * self.z_b * (z + self.z_b) / (d_r + d_v);
        let phi = (apart / d_r - (-s * apart).exp_m1()) / d_v / self.coefficient;
        let fade = (-s * apart).exp();
        let e = z / d_r * (1.0 + s * d_r) / d_r / d_r + image / d_v * (1.0 + s * d_v) / d_v / d_v * fade;
        self.gain * (-s * d_r).exp() * (self.c_phi * phi + self.c_e * e) / (4.0 * PI)
    }

    /// 2 pi ∫ r exitance(r, z) dr.
    pub fn total(&self, z: f64) -> f64 {
        let s = self.sigma_tr;
        let between = 2.0 * s * self.z_b;
        // (1 - e^-x)/x, which is 1 without absorption.
        let loss = if between == 0.0 { 1.0 } else { -(-between).exp_m1() / between };
        let phi = self.z_b / self.coefficient * loss;
        let e = 0.5 * (1.0 + (-between).exp());
        self.gain * (-s * z).exp() * (self.c_phi * phi + self.c_e * e)
    }

    /// ∫ e^-z total(z) dz: sources all along a ray.
    pub fn total_along_ray(&self) -> f64 {
        self.total(0.0) / (1.0 + self.sigma_tr)
    }
}

/// F_dr, the share of diffuse light from inside that the boundary reflects: the polynomial of [Jensen2001], which is part of
/// that model, up to the index at which it meets the exact value. From there on it rises above it, and past 1 near
/// index 4, so the exact value takes over.
fn diffuse_fresnel(eta: f64) -> f64 {
    if eta > MEETS_EXACT { 2.0 * fresnel_moment(1, eta) } else { polynomial(eta) }
}

fn polynomial(eta: f64) -> f64 {
    -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta
}

/// Where [`polynomial`] crosses 2 FM1 for the last time.
const MEETS_EXACT: f64 = 1.986_051;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomial_hands_over_where_it_is_exact() {
        let off = |eta: f64| polynomial(eta) - 2.0 * fresnel_moment(1, eta);
        assert!(off(MEETS_EXACT).abs() < 1e-8, "{}", off(MEETS_EXACT));
        assert!(off(1.9) < 0.0 && off(2.1) > 0.0 && polynomial(4.0) > 1.0);
    }
}
