//! Measured media by name: the twelve of [Jensen2001] (reduced coefficients, g = 0) and the layers of the fish of
//! [Francois2006, table 1] (Schlick's phase function).

use crate::optics::Rgb;
use crate::optics::medium::Medium;
use crate::optics::phase::Phase;

/// A medium from the literature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    pub name: &'static str,
    pub medium: Medium,
    pub phase: Phase,
    /// The boundary's relative index of refraction that goes with it.
    pub ior: f64,
    /// A key of the bibliography.
    pub source: &'static str,
}

/// Name, sigma_s', sigma_a (1/mm), index of refraction.
type Reduced = (&'static str, [f64; 3], [f64; 3], f64);

const JENSEN_2001: [Reduced; 12] = [
    ("apple", [2.29, 2.39, 1.97], [0.003, 0.0034, 0.046], 1.3),
    ("chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19], 1.3),
    ("chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.2], 1.3),
    ("cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163], 1.3),
    ("ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45], 1.3),
    ("marble", [2.19, 2.62, 3.0], [0.0021, 0.0041, 0.0071], 1.5),
    ("potato", [0.68, 0.7, 0.55], [0.0024, 0.009, 0.12], 1.3),
    ("skimmilk", [0.7, 1.22, 1.9], [0.0014, 0.0025, 0.0142], 1.3),
    ("skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48], 1.3),
    ("skin2", [1.09, 1.59, 1.79], [0.013, 0.07, 0.145], 1.3),
    ("spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0], 1.5),
    ("wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014], 1.3),
];

/// Name, sigma_s, sigma_t (1/mm), Schlick's k. The paper bends no rays at the surface: its index is 1.
type Layer = (&'static str, [f64; 3], [f64; 3], f64);

const FRANCOIS_2006: [Layer; 3] = [
    ("fish dermis", [2.0, 1.0, 1.0], [2.6, 1.6, 1.6], 0.25),
    ("fish blood", [6.0, 3.0, 2.0], [6.6, 3.6, 2.6], 0.40),
    ("fish organs", [1.0, 1.0, 2.0], [1.5, 1.5, 2.5], 0.80),
];

/// All presets: those of [Jensen2001] by name, then the fish from the outside inwards.
pub fn presets() -> impl Iterator<Item = Preset> {
    let jensen = JENSEN_2001.into_iter().map(|(name, sigma_s_prime, sigma_a, ior)| Preset {
        name,
        medium: Medium::reduced_coefficients(sigma_a.into(), sigma_s_prime.into()),
        phase: Phase::HenyeyGreenstein,
        ior,
        source: "Jensen2001",
    });
    let francois = FRANCOIS_2006.into_iter().map(|(name, sigma_s, sigma_t, k)| {
        let (sigma_s, sigma_t) = (Rgb::from(sigma_s), Rgb::from(sigma_t));
        let phase = Phase::Schlick;
        let medium = Medium::coefficients(sigma_t - sigma_s, sigma_s, Rgb::splat(phase.mean_cosine(k)));
        Preset { name, medium, phase, ior: 1.0, source: "Francois2006" }
    });
    jensen.chain(francois)
}

/// The preset of that name, spelt exactly.
pub fn preset(name: &str) -> Option<Preset> {
    presets().find(|preset| preset.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::papers::PAPERS;

    #[test]
    fn every_preset_is_found_is_physical_and_has_its_source() {
        assert_eq!(presets().count(), 15);
        for p in presets() {
            assert_eq!(preset(p.name), Some(p));
            assert!(PAPERS.iter().any(|paper| paper.key == p.source));
            assert!(p.medium.sigma_a.min_element() >= 0.0 && p.medium.sigma_s.min_element() > 0.0);
        }
        assert_eq!(preset("Marble"), None);
    }

    #[test]
    fn the_fish_keeps_its_table() {
        let organs = preset("fish organs").unwrap();
        assert!((organs.medium.sigma_t() - Rgb::new(1.5, 1.5, 2.5)).abs().max_element() < 1e-15);
        assert!((organs.phase.parameter(organs.medium.g.x) - 0.8).abs() < 1e-12);
        // With the paper's k for g, the reduced scattering would be 0.2 instead.
        assert!((organs.medium.sigma_s_prime().x - 0.368).abs() < 5e-4);
    }
}
