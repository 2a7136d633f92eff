//! Golden values, totals, limits and laws of profiles, and of drawing radii from them.

use super::*;
use crate::optics::quadrature::{double_exponential, gauss_legendre, integrate};
use proptest::prelude::*;
use std::f64::consts::PI;

fn channel(sigma_a: f64, sigma_s: f64, g: f64) -> Channel {
    Channel { sigma_a, sigma_s, g, phase: Phase::HenyeyGreenstein }
}

/// Of sigma_t' = 1 per mm.
fn of_albedo(model: Model, alpha: f64, g: f64, ior: f64) -> Profile {
    Profile::new(model, channel(1.0 - alpha, alpha / (1.0 - g), g), ior)
}

/// 2 pi ∫ r R dr without a closed form.
fn summed(r_d: impl Fn(f64) -> f64, end: f64) -> f64 {
    double_exponential(0.01, end).map(|(r, weight)| 2.0 * PI * r * weight * r_d(r)).sum()
}

#[test]
fn golden_values() {
    let profile = |model| of_albedo(model, 0.9, 0.0, 1.33);
    let (beam, dipole, better) =
        (profile(Model::PhotonBeamDiffusion), profile(Model::Dipole), profile(Model::BetterDipole));
    let normalized = NormalizedDiffusion::of_albedo(0.9);
    for (r, golden) in [
        (0.01, [0.2796250, 4.587758, 0.06495735, 0.03317756, 6.810453]),
        (0.1, [0.1055553, 0.2612586, 0.06395592, 0.03277093, 0.6433651]),
        (0.5, [0.02942649, 0.01069718, 0.04563528, 0.02512811, 0.1009103]),
        (1.0, [0.01266397, 0.001103233, 0.02149017, 0.01406736, 0.03807123]),
        (2.0, [0.003858759, 3.38675e-5, 0.00476386, 0.004412329, 0.01158049]),
        (5.0, [0.0002788982, 7.212957e-9, 0.0002401625, 0.0003050149, 0.001447996]),
        (10.0, [7.354803e-6, 2.660923e-14, 5.998901e-6, 7.863486e-6, 0.0001413353]),
    ] {
        let found = [beam.multiple(r), beam.single(r), dipole.r_d(r), better.r_d(r), normalized.value(r)];
        for (found, golden) in found.into_iter().zip(golden) {
            assert!((found / golden - 1.0).abs() < 5e-7, "at {r}: {found} is not {golden}");
        }
    }
    for (profile, golden) in [(&beam, 0.295799), (&dipole, 0.294128), (&better, 0.233951)] {
        assert!((profile.albedo() - golden).abs() < 2e-6, "{} is not {golden}", profile.albedo());
    }
    // Another index is another profile.
    for model in [Model::PhotonBeamDiffusion, Model::Dipole, Model::BetterDipole] {
        let off = of_albedo(model, 0.9, 0.0, 1.34).r_d(1.0) / profile(model).r_d(1.0) - 1.0;
        assert!(off.abs() > 1e-4);
    }
    // The medium's own albedo, not that of one event.
    assert!((profile(Model::NormalizedDiffusion).albedo() - 0.280329).abs() < 1e-4);
}

#[test]
fn totals_are_the_integrals() {
    for model in Model::ALL {
        for ior in [1.0, 1.01, 1.33, 1.5, 3.0] {
            for (alpha, g) in [(0.1, 0.0), (0.9, 0.9), (0.99, -0.6), (0.9, -0.99), (0.5, 0.99)] {
                let profile = of_albedo(model, alpha, g, ior);
                let (total, sum) = (profile.albedo(), summed(|r| profile.r_d(r), 400.0));
                assert!((total - sum).abs() < 1e-9 * total, "{model:?} {ior} {alpha} {g}: {total} {sum}");
            }
        }
    }
    // Without a boundary, single isotropic scattering has the total rho (1 - ln 2)/2.
    let profile = of_albedo(Model::PhotonBeamDiffusion, 0.8, 0.0, 1.0);
    let exact = 0.4 * (1.0 - 2f64.ln());
    assert!((summed(|r| profile.single(r), 400.0) - exact).abs() < 1e-10);
    // Jensen's own closed form.
    let s = 0.3f64.sqrt();
    let internal = -1.440 / (1.33 * 1.33) + 0.710 / 1.33 + 0.668 + 0.0636 * 1.33;
    let a = (1.0 + internal) / (1.0 - internal);
    let exact = 0.45 * (1.0 + (-4.0 / 3.0 * a * s).exp()) * (-s).exp();
    assert!((of_albedo(Model::Dipole, 0.9, 0.0, 1.33).albedo() - exact).abs() < 1e-14);
}

#[test]
fn without_absorption_dipoles_return_all_and_photon_beams_the_documented_excess() {
    for ior in [1.0, 1.0 + 1e-12, 1.33, 1.5, 3.0] {
        for coalbedo in [0.0, 1e-300, 1e-18] {
            for model in [Model::Dipole, Model::BetterDipole, Model::NormalizedDiffusion] {
                let albedo = Profile::new(model, channel(coalbedo, 1.0, 0.0), ior).albedo();
                assert!((albedo - 1.0).abs() < 1e-7, "{model:?} {ior} {coalbedo}: {albedo}");
            }
        }
        for model in [Model::Dipole, Model::BetterDipole] {
            let albedo = Profile::new(model, channel(0.0, 2.0, 0.0), ior).albedo();
            assert!((albedo - 1.0).abs() < 1e-12, "{model:?} {ior}: {albedo}");
        }
    }
    let beam = Profile::new(Model::PhotonBeamDiffusion, channel(0.0, 1.0, 0.0), 1.33);
    assert!((beam.albedo() - 1.0329).abs() < 1e-4, "{}", beam.albedo());
    let backwards = Profile::new(Model::PhotonBeamDiffusion, channel(0.0, 1.0, -0.6), 1.0);
    assert!((backwards.albedo() - 1.3001).abs() < 1e-4, "{}", backwards.albedo());
    let conserving = beam.clone().with_albedo(1.0);
    assert!((conserving.albedo() - 1.0).abs() < 1e-14);
    assert!((conserving.r_d(0.7) * beam.albedo() / beam.r_d(0.7) - 1.0).abs() < 1e-14);
}

/// Far away the two sources of a dipole cancel to (2 z_b (1 + z_b) / D c_phi + 2 (1 + z_b) c_E) / (4 pi r³) where nothing
/// is absorbed.
#[test]
fn nothing_cancels_far_away() {
    let better = of_albedo(Model::BetterDipole, 1.0, 0.0, 1.0);
    // Without a boundary D = 1/3, z_b = 2/3, c_phi = 1/4, c_E = 1/2.
    let exact = (2.0 * (2.0 / 3.0) * (5.0 / 3.0) * 3.0 / 4.0 + 5.0 / 3.0) / (4.0 * PI);
    for r in [1e5, 1e7, 1e12, 1e60] {
        assert!((better.r_d(r) * r * r * r / exact - 1.0).abs() < 1e-9, "{}", better.r_d(r) * r * r * r / exact);
    }
    // With hardly any absorption, near by it makes no difference.
    let hardly = Profile::new(Model::BetterDipole, channel(1e-20, 1.0, 0.0), 1.0);
    assert!((hardly.r_d(100.0) / better.r_d(100.0) - 1.0).abs() < 1e-7);
}

/// The double exponential rules against Gauss-Legendre in other variables.
#[test]
fn photon_beams_are_integrated_to_the_last_digits() {
    let panels = |end: f64, f: &dyn Fn(f64) -> f64| {
        let n = (2.0 * end).ceil().max(8.0) as usize;
        let width = end / n as f64;
        (0..n).map(|i| integrate(&gauss_legendre(20, i as f64 * width, (i + 1) as f64 * width), f)).sum::<f64>()
    };
    for (ior, alpha, g) in [(1.0, 0.9, 0.0), (1.001, 0.5, -0.9), (1.33, 0.9, 0.0), (1.5, 0.999, 0.9), (3.0, 0.3, -0.99)]
    {
        let profile = of_albedo(Model::PhotonBeamDiffusion, alpha, g, ior);
        let ratios = Ratios { alpha, coalbedo: 1.0 - alpha };
        let source = Diffusion::grosjean(ratios, ior);
        for r in [1e-6f64, 1e-3, 0.1, 1.0, 3.0, 30.0] {
            // z = r sinh v, so that d_r = r cosh v.
            let multiple = panels((50.0 / r).asinh(), &|v: f64| {
                let z = r * v.sinh();
                let kappa = 1.0 - (-2.0 * (r * v.cosh() + z)).exp();
                r * v.cosh() * (-z).exp() * kappa * source.exitance(r, z)
            });
            let off = profile.multiple(r) / multiple - 1.0;
            assert!(off.abs() < 1e-9, "multiple, {ior} {alpha} {g} at {r}: {off:e}");

            let sigma_s = alpha / (1.0 - g);
            let (sigma_t, tangent) = (1.0 - alpha + sigma_s, ((ior - 1.0) * (ior + 1.0)).sqrt());
            // t - t_c = r sinh² w takes the root at t_c away.
            let single = panels((50.0 / sigma_t / r).sqrt().asinh(), &|w: f64| {
                let t = r * (tangent + w.sinh().powi(2));
                let d = r.hypot(t);
                let outside = r * w.sinh() * (w.sinh().powi(2) + 2.0 * tangent).sqrt() / d;
                let through = 1.0 - crate::optics::fresnel::fresnel_dielectric(outside, ior);
                let scattered = Phase::HenyeyGreenstein.value(t / d, g) * through * t / d;
                2.0 * r * w.sinh() * w.cosh() * sigma_s * (-sigma_t * (t + d)).exp() / (d * d) * scattered
            });
            let off = profile.single(r) - single;
            assert!(off.abs() <= 1e-9 * single, "single, {ior} {alpha} {g} at {r}: {off:e} of {single:e}");
        }
    }
}

#[test]
fn ends_are_what_the_documentation_says() {
    for model in Model::ALL {
        for (sigma_a, sigma_s) in [(0.0, 0.0), (1.0, 0.0), (f64::MIN_POSITIVE, 0.0)] {
            let black = Profile::new(model, channel(sigma_a, sigma_s, 0.3), 1.4);
            assert_eq!((black.r_d(0.0), black.r_d(1.0), black.albedo()), (0.0, 0.0, 0.0));
            assert_eq!((black.sample(0.5), black.pdf(1.0), black.cdf(1.0)), (None, 0.0, 0.0));
            assert_eq!(black.with_albedo(0.5).albedo(), 0.0);
        }
        let profile = of_albedo(model, 0.9, 0.5, 1.4);
        let singular = matches!(model, Model::PhotonBeamDiffusion | Model::NormalizedDiffusion);
        assert_eq!(profile.r_d(0.0) == f64::INFINITY, singular, "{model:?}");
        assert!(profile.r_d(1e-100).is_finite());
        assert_eq!(profile.r_d(1e200), 0.0);
    }
}

#[test]
fn radii_are_drawn_in_proportion_and_none_is_left_out() {
    use rand_pcg::rand_core::Rng;
    for model in Model::ALL {
        for (alpha, g, ior) in [(0.9, 0.0, 1.33), (1.0, 0.5, 1.5), (0.3, 0.95, 1.0), (1e-6, -0.9, 1.3)] {
            let profile = of_albedo(model, alpha, g, ior);
            let mut random = rand_pcg::Pcg64Mcg::new(5);
            let mut uniform = || (random.next_u64() >> 11) as f64 * 2f64.powi(-53);
            let (mut sum, mut squares, n) = (0.0, 0.0, 2000);
            for _ in 0..n {
                let u = uniform();
                let r = profile.sample(u).unwrap();
                assert!((profile.cdf(r) - u).abs() < 1e-12, "{model:?}: {u} {r} {}", profile.cdf(r));
                // The density is the slope of the share.
                let (a, b) = (r * 0.999_99, r * 1.000_01);
                let slope = (profile.cdf(b) - profile.cdf(a)) / (PI * (b - a) * (b + a));
                let near = profile.pdf(a).min(profile.pdf(b)) * 0.999..profile.pdf(a).max(profile.pdf(b)) * 1.001;
                assert!(u > 0.999_999 || near.contains(&slope), "{model:?} {alpha}: {slope} {near:?}");
                let weight = profile.r_d(r) / profile.pdf(r);
                sum += weight;
                squares += weight * weight;
            }
            let (mean, count) = (sum / f64::from(n), f64::from(n));
            let error = ((squares / count - mean * mean).max(0.0) / count).sqrt();
            let albedo = profile.albedo();
            assert!((mean - albedo).abs() < 5.0 * error + 1e-12, "{model:?} {alpha}: {mean} {albedo} {error}");
            // So even is the weight that nearly nothing is noise.
            assert!(error < 1e-3 * albedo, "{model:?} {alpha}: {error} of {albedo}");
            // From the first millionth of the light to beyond the last, no weight is out of bounds.
            for r in [1e-12, 1e-8, 1e-3, 1.0, 30.0, 1e3, 1e6, 1e12] {
                let weight = profile.r_d(r) / profile.pdf(r);
                assert!((0.0..1.1 * albedo).contains(&weight), "{model:?} {alpha} at {r}: {weight} of {albedo}");
            }
            let worst = (0..2000).map(|i| {
                let r = profile.sample(1.0 - 10f64.powf(-6.0 * f64::from(i) / 2000.0)).unwrap();
                if r == 0.0 { 0.0 } else { (profile.r_d_tabulated(r) / profile.r_d(r) - 1.0).abs() }
            });
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < 1e-4, "{model:?} {alpha}: {worst}");
            for r in [0.0, 1e-9, 1e30] {
                assert_eq!(profile.r_d_tabulated(r), profile.r_d(r));
            }
            assert_eq!(profile.sample(0.0), Some(0.0));
            assert!(profile.sample(1.0 - f64::EPSILON / 2.0).unwrap() > 20.0 * profile.sample(0.5).unwrap());
        }
    }
}

fn any_channel() -> impl Strategy<Value = Channel> {
    (-6.0..6.0f64, -6.0..6.0f64, -0.99..=0.99f64).prop_map(|(a, s, g)| channel(10f64.powf(a), 10f64.powf(s), g))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]
    #[test]
    fn profiles_are_finite_and_fall(
        channel in any_channel(), clear in prop::bool::weighted(0.2), ior in 1.0..=3.0f64, at in -9.0..9.0f64,
    ) {
        let channel = Channel { sigma_a: if clear { 0.0 } else { channel.sigma_a }, ..channel };
        for model in Model::ALL {
            let profile = Profile::new(model, channel, ior);
            let r = 10f64.powf(at);
            let (near, far) = (profile.r_d(r), profile.r_d(1.01 * r));
            prop_assert!(near.is_finite() && 0.0 <= far, "{:?} {} {}", model, near, far);
            // Dipoles are flat near 0, and far away nothing is left.
            let flat = r * profile.sigma_t_prime < 1e-3 || near < 1e-250;
            prop_assert!(far < near || flat && far <= near * (1.0 + 1e-14), "{:?} {} {}", model, near, far);
            let albedo = profile.albedo();
            let highest = if model == Model::PhotonBeamDiffusion { 1.5 } else { 1.0 + 1e-12 };
            prop_assert!((0.0..=highest).contains(&albedo), "{:?} {}", model, albedo);
        }
    }

    #[test]
    fn a_denser_medium_has_the_same_profile_smaller(
        channel in any_channel(), ior in 1.0..=3.0f64, k in -3.0..3.0f64, x in -6.0..2.0f64,
    ) {
        let k = 10f64.powf(k);
        let dense = Channel { sigma_a: channel.sigma_a / k, sigma_s: channel.sigma_s / k, ..channel };
        for model in Model::ALL {
            let (one, other) = (Profile::new(model, channel, ior), Profile::new(model, dense, ior));
            let r = 10f64.powf(x) / one.sigma_t_prime;
            let off = other.r_d(k * r) * k * k - one.r_d(r);
            prop_assert!(off.abs() <= 1e-12 * one.r_d(r), "{:?} {:e} of {:e}", model, off, one.r_d(r));
        }
    }

    #[test]
    fn profiles_do_not_jump_at_the_index_of_nothing(channel in any_channel(), x in -3.0..1.0f64) {
        let r = 10f64.powf(x) / (channel.sigma_a + channel.sigma_s * (1.0 - channel.g));
        for model in Model::ALL {
            let at = |ior| Profile::new(model, channel, ior).r_d(r);
            prop_assert!((at(1.0 + 1e-10) / at(1.0) - 1.0).abs() < 1e-3, "{:?}", model);
        }
    }
}
