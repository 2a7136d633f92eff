//! A homogeneous medium, all that derives from its coefficients, and every way of spelling it.
//!
//! Coefficients are 1/mm per channel, lengths mm. A medium that holds nothing (sigma_t = 0) is a vacuum: its albedo is 0
//! and its mean free path infinite, so that no derived quantity is ever NaN.

use crate::optics::Rgb;
use crate::optics::half_space::HalfSpace;
use serde::{Deserialize, Serialize};

/// What light meets below a boundary. `g` is the true mean cosine, in (-1, 1), whatever the phase function: see
/// [`Phase::mean_cosine`](crate::optics::phase::Phase::mean_cosine).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Medium {
    /// Absorption, 1/mm.
    pub sigma_a: Rgb,
    /// Scattering, 1/mm.
    pub sigma_s: Rgb,
    pub g: Rgb,
}

/// Each spelling of a medium has a constructor here; the derived quantity of the same name is the way back.
impl Medium {
    pub fn coefficients(sigma_a: Rgb, sigma_s: Rgb, g: Rgb) -> Medium {
        Medium { sigma_a, sigma_s, g }
    }

    /// Measured reduced coefficients, as published by [Jensen2001]: g = 0 stands in for the unknown one.
    pub fn reduced_coefficients(sigma_a: Rgb, sigma_s_prime: Rgb) -> Medium {
        Medium::coefficients(sigma_a, sigma_s_prime, Rgb::ZERO)
    }

    /// Extinction, 1/mm, and single-scattering albedo in [0, 1].
    pub fn extinction(sigma_t: Rgb, albedo: Rgb, g: Rgb) -> Medium {
        Medium::coefficients((1.0 - albedo) * sigma_t, albedo * sigma_t, g)
    }

    /// Single-scattering albedo in [0, 1] and mean free path, mm, above 0.
    pub fn albedo_mfp(albedo: Rgb, mean_free_path: Rgb, g: Rgb) -> Medium {
        Medium::extinction(1.0 / mean_free_path, albedo, g)
    }

    /// The words of [OpenPBR2024]: a colour in [0, 1], a mean free path `radius` · `radius_scale`, mm, and a mean cosine.
    /// The colour is the [`Medium::multiple_scattering_albedo`] under a smooth boundary of relative index `ior`.
    pub fn color(color: Rgb, radius: f64, radius_scale: Rgb, anisotropy: Rgb, ior: f64) -> Medium {
        let space = HalfSpace::new(ior);
        let reduced = color.map(|color| space.coalbedo(color));
        // (1 - alpha') = (1 - alpha)/(1 - alpha g), solved for 1 - alpha, which keeps its bits near alpha = 1.
        let coalbedo = reduced * (1.0 - anisotropy) / (1.0 - reduced * anisotropy);
        let sigma_t = 1.0 / (radius * radius_scale);
        Medium::coefficients(coalbedo * sigma_t, (1.0 - coalbedo) * sigma_t, anisotropy)
    }

    /// sigma_t = sigma_a + sigma_s.
    pub fn sigma_t(&self) -> Rgb {
        self.sigma_a + self.sigma_s
    }

    /// sigma_s' = sigma_s (1 - g).
    pub fn sigma_s_prime(&self) -> Rgb {
        self.sigma_s * (1.0 - self.g)
    }

    /// sigma_t' = sigma_a + sigma_s'.
    pub fn sigma_t_prime(&self) -> Rgb {
        self.sigma_a + self.sigma_s_prime()
    }

    /// Single-scattering albedo sigma_s / sigma_t.
    pub fn albedo(&self) -> Rgb {
        share(self.sigma_s, self.sigma_t())
    }

    /// Reduced albedo alpha' = sigma_s' / sigma_t'.
    pub fn albedo_prime(&self) -> Rgb {
        share(self.sigma_s_prime(), self.sigma_t_prime())
    }

    /// 1/sigma_t, mm.
    pub fn mean_free_path(&self) -> Rgb {
        1.0 / self.sigma_t()
    }

    /// 1/sigma_t', mm.
    pub fn mean_free_path_prime(&self) -> Rgb {
        1.0 / self.sigma_t_prime()
    }

    /// Classical effective transport coefficient sqrt(3 sigma_a sigma_t'), 1/mm [Jensen2001].
    pub fn sigma_tr(&self) -> Rgb {
        (3.0 * self.sigma_a * self.sigma_t_prime()).sqrt()
    }

    /// Classical diffusion coefficient D = 1/(3 sigma_t'), mm.
    pub fn diffusion_classical(&self) -> Rgb {
        1.0 / (3.0 * self.sigma_t_prime())
    }

    /// Grosjean's diffusion coefficient (2 sigma_a + sigma_s')/(3 sigma_t'²), mm [dEon2011].
    pub fn diffusion_grosjean(&self) -> Rgb {
        (2.0 - self.albedo_prime()) * self.diffusion_classical()
    }

    /// Of the light that has entered a half space of this medium at normal incidence, under a smooth boundary of relative
    /// index `ior`, the share that leaves again: internal reflection included, what the boundary reflected before it
    /// entered not. This is what `color` means. See [`crate::optics::half_space`].
    pub fn multiple_scattering_albedo(&self, ior: f64) -> Rgb {
        let (space, sigma_t_prime) = (HalfSpace::new(ior), self.sigma_t_prime());
        Rgb::from_array(std::array::from_fn(|c| match sigma_t_prime[c] {
            0.0 => 0.0,
            whole => space.albedo_normal(self.sigma_a[c] / whole),
        }))
    }

    /// The medium of mean cosine `g` in (-1, 1) that diffuses light as this one does: the same sigma_a and sigma_s'.
    pub fn similar(&self, g: Rgb) -> Medium {
        Medium::coefficients(self.sigma_a, self.sigma_s_prime() / (1.0 - g), g)
    }
}

/// part / whole; nothing is no share of nothing.
fn share(part: Rgb, whole: Rgb) -> Rgb {
    Rgb::select(whole.cmpeq(Rgb::ZERO), Rgb::ZERO, part / whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rgb(range: std::ops::Range<f64>) -> impl Strategy<Value = Rgb> {
        prop::array::uniform3(range).prop_map(Rgb::from_array)
    }

    prop_compose! {
        /// Media over twelve orders of magnitude in density and absorption.
        fn medium()(a in rgb(-6.0..6.0), s in rgb(-6.0..6.0), g in rgb(-0.95..0.95)) -> Medium {
            Medium::coefficients(a.map(|x| 10f64.powf(x)), s.map(|x| 10f64.powf(x)), g)
        }
    }

    /// Within `tolerance` of the extinction, in each channel.
    fn same(a: &Medium, b: &Medium, tolerance: f64) -> bool {
        let off = (a.sigma_a - b.sigma_a).abs().max((a.sigma_s - b.sigma_s).abs());
        (off / a.sigma_t()).max_element() <= tolerance && (a.g - b.g).abs().max_element() <= 1e-14
    }

    #[test]
    fn marble_by_hand() {
        let red = Medium::reduced_coefficients(Rgb::splat(0.0021), Rgb::splat(2.19));
        assert!((red.sigma_tr().x - 0.117_516).abs() < 1e-5, "{}", red.sigma_tr().x);
        assert!((red.mean_free_path().x - 0.456_184).abs() < 1e-6);
        assert!((red.albedo_prime().x - 0.999_042).abs() < 1e-6);
        assert!((red.diffusion_grosjean().x / (2.0 * 0.0021 + 2.19) * 3.0 * 2.1921f64.powi(2) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_vacuum_and_a_perfect_scatterer_have_no_nan() {
        let vacuum = Medium::coefficients(Rgb::ZERO, Rgb::ZERO, Rgb::splat(0.5));
        let white = Medium::coefficients(Rgb::ZERO, Rgb::ONE, Rgb::splat(0.5));
        let black = Medium::coefficients(Rgb::ONE, Rgb::ZERO, Rgb::splat(0.5));
        for (medium, albedo) in [(vacuum, 0.0), (white, 1.0), (black, 0.0)] {
            assert_eq!(medium.albedo(), Rgb::splat(albedo));
            assert_eq!(medium.albedo_prime(), Rgb::splat(albedo));
            for ior in [1.0, 1.5] {
                assert_eq!(medium.multiple_scattering_albedo(ior), Rgb::splat(albedo));
            }
            for derived in [medium.sigma_tr(), medium.diffusion_classical(), medium.diffusion_grosjean()] {
                assert!(!derived.is_nan());
            }
            assert_eq!(Medium::albedo_mfp(medium.albedo(), medium.mean_free_path(), medium.g), medium);
            assert_eq!(Medium::extinction(medium.sigma_t(), medium.albedo(), medium.g), medium);
        }
        for color in [0.0, 1.0] {
            let medium = Medium::color(Rgb::splat(color), 2.0, Rgb::ONE, Rgb::splat(0.3), 1.4);
            assert_eq!(medium.albedo(), Rgb::splat(color));
            assert_eq!(medium.mean_free_path(), Rgb::splat(2.0));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn every_spelling_comes_back(m in medium(), ior in 1.0..=3.0f64) {
            prop_assert!(same(&m, &Medium::coefficients(m.sigma_a, m.sigma_s, m.g), 0.0));
            prop_assert!(same(&m, &Medium::extinction(m.sigma_t(), m.albedo(), m.g), 1e-14));
            prop_assert!(same(&m, &Medium::albedo_mfp(m.albedo(), m.mean_free_path(), m.g), 1e-14));
            let reduced = Medium::reduced_coefficients(m.sigma_a, m.sigma_s_prime());
            prop_assert!(same(&m, &reduced.similar(m.g), 1e-14));
            let color = m.multiple_scattering_albedo(ior);
            let back = Medium::color(color, 0.5, 2.0 * m.mean_free_path(), m.g, ior);
            prop_assert!(same(&m, &back, 1e-11), "{m:?} {back:?}");
        }

        #[test]
        fn similar_media_diffuse_alike_and_others_do_not(m in medium(), g in rgb(-0.9..0.9)) {
            let other = m.similar(g);
            let ratio = other.sigma_tr() / m.sigma_tr();
            prop_assert!((ratio - 1.0).abs().max_element() < 1e-12);
            let off = other.multiple_scattering_albedo(1.3) - m.multiple_scattering_albedo(1.3);
            prop_assert!(off.abs().max_element() < 1e-9);
            let thicker = Medium { sigma_s: m.sigma_s * 1.1, ..m };
            prop_assert!((thicker.sigma_tr() - m.sigma_tr()).min_element() > 0.0);
        }

        #[test]
        fn albedo_depends_on_ratios_only(m in medium(), scale in -6.0..6.0f64) {
            let scale = 10f64.powf(scale);
            let scaled = Medium::coefficients(m.sigma_a * scale, m.sigma_s * scale, m.g);
            let off = scaled.multiple_scattering_albedo(1.4) - m.multiple_scattering_albedo(1.4);
            prop_assert!(off.abs().max_element() < 1e-13);
            let tr = scaled.sigma_tr() / (m.sigma_tr() * scale) - 1.0;
            prop_assert!(tr.abs().max_element() < 1e-12);
        }
    }
}
