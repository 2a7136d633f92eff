//! How much of the light that enters a slab comes out at its far side, scattered on its way.
//!
//! Light that arrives head on scatters for the first time at depth z with density sigma_s' e^(-sigma_t' z), and diffuses from
//! there. Between extrapolated boundaries, z_b outside of each face, the share that diffuses out through the far face is
//! sinh(sigma_tr (z + z_b)) / sinh(sigma_tr (d + 2 z_b)): the sum of all images of a multipole [Donner2005]. With classical
//! D, and z_b from exact Fresnel moments. What crosses without a reduced event was still scattered, forwards, unless it
//! crosses without any. Lengths in mm, one value per channel.

use crate::optics::Rgb;
use crate::optics::fresnel::fresnel_moment;
use crate::optics::medium::Medium;

/// The share of entering light that leaves a slab of `thickness` mm at the far side after it was scattered, for a boundary
/// of relative index `ior`: 0 for a thickness of 0, at most 1.
pub struct Slab {
    sigma_s_prime: Rgb,
    sigma_t_prime: Rgb,
    sigma_t: Rgb,
    sigma_tr: Rgb,
    /// Beyond each face, mm.
    extrapolation: Rgb,
}

impl Slab {
    pub fn new(medium: &Medium, ior: f64) -> Slab {
        let reflects = (1.0 + 3.0 * fresnel_moment(2, ior)) / (1.0 - 2.0 * fresnel_moment(1, ior));
        Slab {
            sigma_s_prime: medium.sigma_s_prime(),
            sigma_t_prime: medium.sigma_t_prime(),
            sigma_t: medium.sigma_t(),
            sigma_tr: medium.sigma_tr(),
            extrapolation: 2.0 * medium.diffusion_classical() * reflects,
        }
    }

    pub fn transmittance(&self, thickness: f64) -> Rgb {
        Rgb::from_array(std::array::from_fn(|c| self.channel(c, thickness)))
    }

    fn channel(&self, c: usize, d: f64) -> f64 {
        let (a, k, b) = (self.sigma_t_prime[c], self.sigma_tr[c], self.extrapolation[c]);
        if a == 0.0 || d == 0.0 {
            return 0.0;
        }
        let whole = d + 2.0 * b;
        let diffused = if k * whole < STRAIGHT {
            // The sinh are straight lines: nothing is lost on the way.
            (b * d * mean_exp(a * d) + first_moment(a, d)) / whole
        } else {
            // Both sinh times 2 e^(-k whole), so that nothing overflows.
            let near = (-k * b).exp() * d * (-a.min(k) * d).exp() * mean_exp((a - k).abs() * d);
            let far = (-3.0 * k * b - k * d).exp() * d * mean_exp((a + k) * d);
            (near - far) / -(-2.0 * k * whole).exp_m1()
        };
        let forwards = (-a * d).exp() - (-self.sigma_t[c] * d).exp();
        // Where light is mostly scattered back, reduced events are more than all events: none of them is left over.
        self.sigma_s_prime[c] * diffused + forwards.max(0.0)
    }
}

/// Below it sinh x is x to 1e-9.
const STRAIGHT: f64 = 1e-4;

/// The mean of e^-u over [0, x].
fn mean_exp(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
}

/// ∫ z e^(-a z) dz over [0, d].
fn first_moment(a: f64, d: f64) -> f64 {
    let x = a * d;
    // The difference below loses its digits as x² does.
    if x < 1e-3 { d * d * (0.5 - x / 3.0 + x * x / 8.0) } else { d * (mean_exp(x) - (-x).exp()) / a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::Rng;

    fn medium(sigma_a: f64, sigma_s: f64, g: f64) -> Medium {
        Medium::coefficients(Rgb::splat(sigma_a), Rgb::splat(sigma_s), Rgb::splat(g))
    }

    fn transmitted(medium: &Medium, ior: f64, d: f64) -> f64 {
        Slab::new(medium, ior).transmittance(d).x
    }

    /// Walks through a slab with an index-matched boundary: the share that comes out behind, scattered.
    fn walked(albedo: f64, d: f64) -> f64 {
        let mut random = Pcg64Mcg::new(7);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        const WALKS: usize = 40_000;
        let mut sum = 0.0;
        for _ in 0..WALKS {
            let (mut z, mut cos, mut weight, mut events) = (0.0, 1.0, 1.0, 0);
            loop {
                z -= cos * (1.0 - uniform()).ln();
                if z >= d && events > 0 {
                    sum += weight;
                }
                if z >= d || z <= 0.0 || weight < 1e-6 {
                    break;
                }
                (cos, weight, events) = (2.0 * uniform() - 1.0, weight * albedo, events + 1);
            }
        }
        sum / WALKS as f64
    }

    #[test]
    fn walks_come_out_as_diffusion_says() {
        for (albedo, d) in [(0.999, 1.0), (0.999, 4.0), (0.999, 12.0), (0.95, 2.0), (0.95, 6.0), (0.8, 3.0)] {
            let (truth, ours) = (walked(albedo, d), transmitted(&medium(1.0 - albedo, albedo, 0.0), 1.0, d));
            println!("albedo {albedo}, {d} mean free paths: {truth:.4} walked, {ours:.4} diffused");
            assert!((ours / truth - 1.0).abs() < 0.15, "albedo {albedo}, {d}: {ours} {truth}");
            let wrong = transmitted(&medium(1.0 - albedo, albedo, 0.0), 1.0, 1.5 * d + 1.0);
            assert!((wrong / truth - 1.0).abs() > 0.15, "a thicker slab is not told from this one");
        }
    }

    #[test]
    fn it_is_a_share_whatever_the_medium() {
        for density in [1e-9, 1e-3, 1.0, 1e3, 1e9] {
            for sigma_a in [0.0, 1e-12, 1e-6, 1e-3, 0.3, 0.5, 3.0, 1e6] {
                for g in [-0.99, 0.0, 0.99] {
                    for ior in [1.0, 1.3, 3.0] {
                        let slab = Slab::new(&medium(density * sigma_a, density, g), ior);
                        for d in [0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e9] {
                            let t = slab.transmittance(d).x;
                            assert!((0.0..=1.0).contains(&t), "{density} {sigma_a} {g} {ior} {d}: {t}");
                        }
                        assert_eq!(slab.transmittance(0.0), Rgb::ZERO);
                    }
                }
            }
        }
        assert_eq!(transmitted(&medium(0.0, 0.0, 0.0), 1.4, 3.0), 0.0);
    }

    #[test]
    fn nothing_jumps_where_one_formula_takes_over_from_another() {
        let at = |sigma_a: f64, d: f64| transmitted(&medium(sigma_a, 1.0, 0.0), 1.4, d);
        // sigma_tr whole = 1e-4 near sigma_a = 1e-10, and sigma_t' = sigma_tr at sigma_a = 0.5.
        for (one, other) in [(at(0.0, 5.0), at(1e-9, 5.0)), (at(0.5 - 1e-9, 5.0), at(0.5 + 1e-9, 5.0))] {
            assert!((one / other - 1.0).abs() < 1e-6, "{one} {other}");
        }
        let thin = |d: f64| at(0.0, d) / d;
        assert!((thin(0.99e-3) / thin(1.01e-3) - 1.0).abs() < 1e-4);
        // Scale: only products of lengths and coefficients count.
        let scaled = transmitted(&medium(0.2, 10.0, 0.3), 1.4, 0.5) / transmitted(&medium(0.02, 1.0, 0.3), 1.4, 5.0);
        assert!((scaled - 1.0).abs() < 1e-12);
    }
}
