//! Photon beam diffusion [Habel2013] for a ray that enters straight down: diffuse light from sources all along it, and
//! single scattering without approximation. The unit of length is 1/sigma_t', but for single scattering 1/sigma_t.
//!
//! R_MS(r) = ∫ e^-z kappa exitance(r, z) dz, with kappa = 1 - e^(-2 (d_r + z)) for sources so near that no light from them
//! could have diffused [Habel2013].
//!
//! R_SS(r) = rho ∫ e^(-t - d)/d² p(mu) (1 - F(mu)) mu dt, over the depths t from which the boundary lets light out:
//! t above t_c = r sqrt(eta² - 1), with d = sqrt(r² + t²), mu = t/d, and p for directions that both point away from
//! where light scatters.

use super::diffusion::Diffusion;
use super::{Channel, Ratios};
use crate::optics::fresnel::{fresnel_dielectric, refracted_cosine};
use crate::optics::phase::Phase;
use crate::optics::quadrature::{double_exponential, gauss_legendre, graded, integrate};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug)]
pub(super) struct PhotonBeam {
    diffusion: Diffusion,
    /// sigma_t / sigma_t': 1/(1 - g) without absorption.
    stretch: f64,
    /// The albedo of a single event, sigma_s / sigma_t.
    rho: f64,
    phase: Phase,
    /// The phase function's own.
    parameter: f64,
    eta: f64,
}

/// Depths, in mean free paths, below which e^-z leaves nothing to add: 1e-20.
const DEEPEST: f64 = 46.0;

impl PhotonBeam {
    pub fn new(ratios: Ratios, channel: Channel, sigma_t_prime: f64, eta: f64) -> PhotonBeam {
        let sigma_t = channel.sigma_a + channel.sigma_s;
        PhotonBeam {
            diffusion: Diffusion::grosjean(ratios, eta),
            stretch: sigma_t / sigma_t_prime,
            rho: channel.sigma_s / sigma_t,
            phase: channel.phase,
            parameter: channel.phase.parameter(channel.g),
            eta,
        }
    }

    /// R_MS at the optical radius `x`: 37 to 150 nodes, good to 1e-11. Infinite at 0, as -ln x.
    pub fn multiple(&self, x: f64) -> f64 {
        if x == 0.0 {
            return f64::INFINITY;
        }
        // Seen in ln z the integrand is smooth, with its branch points at z = ±i x a quarter turn away.
        double_exponential(x.min(1.0), DEEPEST)
            .map(|(z, weight)| {
                let kappa = -(-2.0 * (x.hypot(z) + z)).exp_m1();
                weight * (-z).exp() * kappa * self.diffusion.exitance(x, z)
            })
            .sum()
    }

    /// R_SS at the optical radius `x`, in reduced mean free paths: as many nodes. Infinite at 0, as 1/x.
    pub fn single(&self, x: f64) -> f64 {
        let r = x * self.stretch;
        if r == 0.0 {
            return f64::INFINITY;
        }
        let t_c = r * self.tangent_of_escape();
        // The depth beyond t_c takes the square root's kink of F at t_c into the rule's singular end.
        let sum: f64 = double_exponential(r.min(1.0), DEEPEST)
            .map(|(beyond, weight)| {
                let t = t_c + beyond;
                let d = r.hypot(t);
                // The cosine outside is sqrt(t² - t_c²)/d, and F is the same from both sides.
                let outside = (beyond * (beyond + 2.0 * t_c)).sqrt() / d;
                weight * (-t - d).exp() / d / d * self.leaves(t / d, outside)
            })
            .sum();
        self.rho * sum * self.stretch * self.stretch
    }

    /// sqrt(eta² - 1): the depth per radius at which light is just not totally reflected.
    fn tangent_of_escape(&self) -> f64 {
        ((self.eta - 1.0) * (self.eta + 1.0)).sqrt()
    }

    /// p(mu) (1 - F(mu)) mu, with `mu` the cosine inside and `outside` the one outside.
    fn leaves(&self, mu: f64, outside: f64) -> f64 {
        self.phase.value(mu, self.parameter) * (1.0 - fresnel_dielectric(outside, self.eta)) * mu
    }

    /// 2 pi ∫ r R_SS dr = 2 pi rho ∫ p(mu) (1 - F(mu)) mu/(1 + mu) dmu: in polar coordinates about the point of entry the
    /// radius integrates away.
    pub fn total_single(&self) -> f64 {
        // Over the cosine outside, eta² mu dmu = c dc, with nodes crowded at both ends: a phase function may have
        // its peak at one, and an index close to 1 has its branch point at the other.
        let rule = |a, b| graded(64, a, b);
        let integrand = |c: f64| {
            let mu = refracted_cosine(c, self.eta).expect("a denser medium refracts every ray");
            self.leaves(mu, c) * c / (mu * (1.0 + mu))
        };
        // A rule from 1 down to ½ has negative weights.
        let sum = integrate(&rule(0.0, 0.5), integrand) - integrate(&rule(1.0, 0.5), integrand);
        2.0 * PI * self.rho * sum / (self.eta * self.eta)
    }

    /// 2 pi ∫ r R_MS dr: the closed form without kappa, less what kappa takes away, in polar coordinates about the point of
    /// entry: z = rho mu, r = rho sqrt(1 - mu²).
    pub fn total_multiple(&self) -> f64 {
        let depths = graded(48, 0.0, DEEPEST);
        let taken = integrate(&gauss_legendre(32, 0.0, 1.0), |mu| {
            // e^-z (1 - kappa) = e^(-rate rho)
            let rate = 2.0 + 3.0 * mu;
            let along = integrate(&depths, |depth| {
                let rho = depth / rate;
                let r = rho * ((1.0 - mu) * (1.0 + mu)).sqrt();
                rho * rho * (-depth).exp() * self.diffusion.exitance(r, rho * mu)
            });
            along / rate
        });
        self.diffusion.total_along_ray() - 2.0 * PI * taken
    }
}
