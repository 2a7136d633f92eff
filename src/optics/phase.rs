//! Phase functions: the share of scattered light per steradian, 1/sr, by the angle between two directions.
//!
//! `cos` is the cosine between omega_i and omega_o, which *both point away* from where light scatters: light that goes
//! straight on has cos = -1. Every function is 1 when integrated over the sphere, and is forward for a positive parameter.

use crate::optics::root::bracketed_root;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Which phase function a medium has. A [`Medium`](crate::optics::medium::Medium) knows its mean cosine g whatever the
/// function; [`Phase::parameter`] turns it into the function's own parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Phase {
    /// Its parameter is the mean cosine itself.
    #[default]
    HenyeyGreenstein,
    /// Its parameter is the k of [Francois2006].
    Schlick,
}

impl Phase {
    /// 1/sr, for the function's own `parameter` in (-1, 1).
    pub fn value(self, cos: f64, parameter: f64) -> f64 {
        match self {
            Phase::HenyeyGreenstein => henyey_greenstein(cos, parameter),
            Phase::Schlick => schlick(cos, parameter),
        }
    }

    /// The integral of [`Phase::value`] over the azimuth between two directions that are these angles off one axis, 1/rad:
    /// what scatters from the one cone into the other. In closed form, so that no peak falls between samples.
    pub fn around(self, from: f64, to: f64, parameter: f64) -> f64 {
        // Both functions are powers of a + b cos(azimuth), of which these are the least and the most.
        let k = parameter.abs();
        let half = 0.5 * if parameter < 0.0 { from - to } else { from + to - PI };
        let sines = from.sin() * to.sin();
        match self {
            Phase::HenyeyGreenstein => {
                let least = (1.0 - k) * (1.0 - k) + 4.0 * k * half.sin().powi(2);
                let most = least + 4.0 * k * sines;
                (1.0 - k) * (1.0 + k) / PI * elliptic_e(least / most) / (least * most.sqrt())
            }
            Phase::Schlick => {
                let least = 1.0 - k + 2.0 * k * half.sin().powi(2);
                let most = least + 2.0 * k * sines;
                0.25 * (1.0 - k) * (1.0 + k) * (least + most) / (least * most).powf(1.5)
            }
        }
    }

    /// A cosine for `u` in [0, 1] with the density 2 pi [`Phase::value`], growing with u. It is that of this module: light
    /// that travelled along omega goes on at the cosine -`sample` to omega.
    pub fn sample(self, u: f64, parameter: f64) -> f64 {
        match self {
            Phase::HenyeyGreenstein => sample_henyey_greenstein(u, parameter),
            Phase::Schlick => sample_schlick(u, parameter),
        }
    }

    /// The mean cosine g between the directions in which light travels before and after.
    pub fn mean_cosine(self, parameter: f64) -> f64 {
        match self {
            Phase::HenyeyGreenstein => parameter,
            Phase::Schlick => schlick_mean_cosine(parameter),
        }
    }

    /// The inverse of [`Phase::mean_cosine`], for g in (-1, 1).
    pub fn parameter(self, mean_cosine: f64) -> f64 {
        match self {
            Phase::HenyeyGreenstein => mean_cosine,
            Phase::Schlick => schlick_parameter(mean_cosine),
        }
    }
}

/// Scattering that has no preferred direction, 1/(4 pi).
pub fn isotropic() -> f64 {
    0.25 / PI
}

/// Henyey and Greenstein's function [Henyey1941] for the mean cosine `g` in (-1, 1). Twin: `phase.wgsl`.
pub fn henyey_greenstein(cos: f64, g: f64) -> f64 {
    let q = 1.0 + g * g + 2.0 * g * cos;
    0.25 / PI * (1.0 - g * g) / (q * q.sqrt())
}

/// The cosine below which the share `u` of [`henyey_greenstein`] lies: the textbook's inverse, multiplied out so that
/// g = 0 is no special case and the result never leaves [-1, 1].
pub fn sample_henyey_greenstein(u: f64, g: f64) -> f64 {
    let q = 1.0 + g - 2.0 * g * u;
    let above = 2.0 * u * ((1.0 - g) / q) * ((1.0 - g) / q) * (1.0 + g * (1.0 - u));
    let below = 2.0 * (1.0 - u) * ((1.0 + g) / q) * ((1.0 + g) / q) * (1.0 - g * u);
    between(above, below)
}

/// The cosine below which the share `u` of [`schlick`] lies.
pub fn sample_schlick(u: f64, k: f64) -> f64 {
    let q = 1.0 + k - 2.0 * k * u;
    between(2.0 * u * (1.0 - k) / q, 2.0 * (1.0 - u) * (1.0 + k) / q)
}

/// The cosine c for 1 + c and 1 - c, from the one that has more bits.
fn between(above: f64, below: f64) -> f64 {
    if above < below { above - 1.0 } else { 1.0 - below }
}

/// Schlick's function for `k` in (-1, 1), as [Francois2006] prints it. k is not the mean cosine. Twin: `phase.wgsl`.
pub fn schlick(cos: f64, k: f64) -> f64 {
    let q = 1.0 + k * cos;
    0.25 / PI * (1.0 - k * k) / (q * q)
}

/// The mean cosine of [`schlick`]: 1/k - (1 - k²)/k² artanh(k), which is 2k/3 for small k.
pub fn schlick_mean_cosine(k: f64) -> f64 {
    if k.abs() < 0.1 {
        // The two terms cancel: sum 2 k^(2n-1) / ((2n-1)(2n+1)) instead.
        let q = k * k;
        return 2.0
            * k
            * (1.0 / 3.0
                + q * (1.0 / 15.0
                    + q * (1.0 / 35.0 + q * (1.0 / 63.0 + q * (1.0 / 99.0 + q * (1.0 / 143.0 + q / 195.0))))));
    }
    1.0 / k - (1.0 - k * k) / (k * k) * k.atanh()
}

/// The k whose [`schlick_mean_cosine`] is `g` in (-1, 1).
pub fn schlick_parameter(g: f64) -> f64 {
    // Odd in g, and k lies between g and 3g/2.
    let k = bracketed_root(|k| schlick_mean_cosine(k) - g.abs(), g.abs(), (1.5 * g.abs()).min(1.0 - f64::EPSILON));
    k.copysign(g)
}

/// The complete elliptic integral of the second kind, E = ∫ sqrt(1 - m sin²) over a quarter turn, for 1 - m in (0, 1]: by
/// the arithmetic-geometric mean.
fn elliptic_e(one_less_m: f64) -> f64 {
    let (mut a, mut b) = (1.0, one_less_m.sqrt());
    let (mut sum, mut power) = (0.5 * (1.0 - one_less_m), 1.0);
    while a - b > 1e-15 * a {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        sum += power * c * c;
        power *= 2.0;
    }
    0.5 * PI / a * (1.0 - sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::quadrature::{gauss_legendre, halving, integrate};
    use proptest::prelude::*;

    #[test]
    fn the_papers_k_of_a_fishs_organs() {
        assert!((schlick_mean_cosine(0.8) - 0.632).abs() < 5e-4);
        assert!((schlick_mean_cosine(0.1 - 1e-12) - schlick_mean_cosine(0.1)).abs() < 1e-11);
    }

    #[test]
    fn antiderivatives_say_that_nothing_is_lost() {
        // 2 pi times the antiderivative in cos, from -1 to 1.
        for g in [-0.9, -0.3, 0.25, 0.8, 0.99f64] {
            let hg = |c: f64| -0.5 * (1.0 - g * g) / (g * (1.0 + g * g + 2.0 * g * c).sqrt());
            let schlick_total = |c: f64| -0.5 * (1.0 - g * g) / (g * (1.0 + g * c));
            assert!((hg(1.0) - hg(-1.0) - 1.0).abs() < 1e-12);
            assert!((schlick_total(1.0) - schlick_total(-1.0) - 1.0).abs() < 1e-12);
            for c in [-0.7, 0.0, 0.4] {
                let slope = |f: &dyn Fn(f64) -> f64| (f(c + 1e-5) - f(c - 1e-5)) / 2e-5;
                assert!((slope(&hg) - 2.0 * PI * henyey_greenstein(c, g)).abs() < 1e-6);
                assert!((slope(&schlick_total) - 2.0 * PI * schlick(c, g)).abs() < 1e-6);
            }
        }
        assert_eq!((henyey_greenstein(0.3, 0.0), schlick(0.3, 0.0)), (isotropic(), isotropic()));
    }

    /// (chi² - degrees of freedom) / sqrt(2 · degrees of freedom), which is about normal, of `draws` cosines from `sample`
    /// against the shares of bins whose edges are given.
    fn chi_square(draws: u32, edges: &[f64], share: impl Fn(f64, f64) -> f64, sample: impl Fn(f64) -> f64) -> f64 {
        use rand_pcg::rand_core::Rng;
        let mut random = rand_pcg::Pcg64Mcg::new(11);
        let mut counts = vec![0u32; edges.len() - 1];
        for _ in 0..draws {
            let cos = sample((random.next_u64() >> 11) as f64 * 2f64.powi(-53));
            counts[edges[1..edges.len() - 1].partition_point(|edge| *edge <= cos)] += 1;
        }
        let chi2: f64 = edges
            .windows(2)
            .zip(counts)
            .map(|(edge, count)| {
                let expected = f64::from(draws) * share(edge[0], edge[1]);
                (f64::from(count) - expected).powi(2) / expected
            })
            .sum();
        let freedom = (edges.len() - 2) as f64;
        (chi2 - freedom) / (2.0 * freedom).sqrt()
    }

    #[test]
    fn samples_have_the_density_and_a_wrong_density_is_noticed() {
        for phase in [Phase::HenyeyGreenstein, Phase::Schlick] {
            for parameter in [-0.99, -0.6, 0.0, 0.25, 0.8, 0.99] {
                // Bins that hold about equal shares of the true density, whatever `sample` does.
                let rule = gauss_legendre(40, 0.0, 1.0);
                let share = |parameter: f64| {
                    move |a: f64, b: f64| {
                        2.0 * PI * (b - a) * integrate(&rule, |t| phase.value(a + (b - a) * t, parameter))
                    }
                };
                let edges: Vec<f64> = (0..=64).map(|i| phase.sample(f64::from(i) / 64.0, parameter)).collect();
                let right = chi_square(100_000, &edges, share.clone()(parameter), |u| phase.sample(u, parameter));
                assert!(right.abs() < 5.0, "{phase:?} {parameter}: {right}");
                let wrong = chi_square(100_000, &edges, share(parameter), |u| phase.sample(u, 0.9 * parameter - 0.05));
                assert!(wrong > 5.0, "{phase:?} {parameter}: {wrong}");
            }
        }
    }

    #[test]
    fn around_an_axis_it_is_the_integral_over_turns_and_loses_nothing_of_any_peak() {
        let turns = gauss_legendre(400, 0.0, PI);
        for phase in [Phase::HenyeyGreenstein, Phase::Schlick] {
            for parameter in [-0.95, -0.4, 0.0, 0.7, 0.95f64] {
                for (from, to) in [(0.0, 0.3), (0.4, 0.4), (0.4, 2.7), (1.5, 1.6), (1.2, 0.1)] {
                    let (sines, cosines) = (f64::sin(from) * f64::sin(to), f64::cos(from) * f64::cos(to));
                    let sum = 2.0 * integrate(&turns, |turn| phase.value(cosines + sines * turn.cos(), parameter));
                    let found = phase.around(from, to, parameter);
                    assert!((found / sum - 1.0).abs() < 1e-8, "{phase:?} {parameter} {from} {to}: {found} {sum}");
                }
            }
            // All that scatters goes somewhere.
            for parameter in [-1.0 + 1e-10, -0.9999, -0.5, 0.0, 0.5, 0.9999, 1.0 - 1e-10] {
                for from in [0.0, 1e-3, 0.7, 0.5 * PI] {
                    let peak = if parameter < 0.0 { from } else { PI - from };
                    let all: f64 = [0.0, PI]
                        .iter()
                        .flat_map(|far| halving(peak, *far, 1.0 - f64::abs(parameter)))
                        .map(|(to, weight)| weight * to.sin() * phase.around(from, to, parameter))
                        .sum();
                    assert!((all - 1.0).abs() < 1e-5, "{phase:?} {parameter} {from}: {all}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn a_sample_is_the_inverse_of_what_lies_below(u in 0.0..=1.0f64, parameter in -0.99..=0.99f64) {
            for phase in [Phase::HenyeyGreenstein, Phase::Schlick] {
                prop_assert_eq!((phase.sample(0.0, parameter), phase.sample(1.0, parameter)), (-1.0, 1.0));
                prop_assert!((phase.sample(u, 0.0) - (2.0 * u - 1.0)).abs() <= f64::EPSILON);
                let cos = phase.sample(u, parameter);
                prop_assert!((-1.0..=1.0).contains(&cos) && phase.value(cos, parameter).is_finite());
                // The antiderivatives of the test above, from -1.
                let below = match phase {
                    Phase::HenyeyGreenstein => {
                        let (g, root) = (parameter, (1.0 + parameter * parameter + 2.0 * parameter * cos).sqrt());
                        // (1 - g²)/2g (1/(1 - g) - 1/root), without dividing by g.
                        (1.0 + g) * (1.0 + cos) / (root * (root + 1.0 - g))
                    }
                    Phase::Schlick => 0.5 * (1.0 + parameter) * (1.0 + cos) / (1.0 + parameter * cos),
                };
                prop_assert!((below - u).abs() < 1e-11, "{phase:?} {below}");
            }
        }

        #[test]
        fn normal_forward_and_of_the_stated_mean_cosine(parameter in -0.9..0.9f64) {
            let rule = gauss_legendre(200, -1.0, 1.0);
            for phase in [Phase::HenyeyGreenstein, Phase::Schlick] {
                let moment = |n| 2.0 * PI * integrate(&rule, |cos| (-cos).powi(n) * phase.value(cos, parameter));
                prop_assert!((moment(0) - 1.0).abs() < 1e-9);
                prop_assert!((moment(1) - phase.mean_cosine(parameter)).abs() < 1e-9);
                prop_assert!((phase.value(-1.0, parameter) - phase.value(1.0, parameter)) * parameter >= 0.0);
                prop_assert!((phase.parameter(phase.mean_cosine(parameter)) - parameter).abs() < 1e-12);
            }
        }
    }
}
