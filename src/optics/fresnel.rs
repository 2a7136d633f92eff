//! Reflectance of a smooth boundary between two dielectrics, and its moments over the hemisphere.
//!
//! A relative index of refraction is always that of the *far* side over that of the side the light comes from:
//! a material of index `ior` seen from outside is `fresnel_dielectric(cos, ior)`, from inside
//! `fresnel_dielectric(cos, 1 / ior)`. Cosines are those of the incident direction with the normal on its own side.

use crate::optics::quadrature::{graded, integrate};

/// The share of unpolarised light that is reflected, exact, total internal reflection included.
///
/// `cos` in [0, 1], `eta` above 0: index of the far side over that of the near side. Twin: `fresnel.wgsl`.
pub fn fresnel_dielectric(cos: f64, eta: f64) -> f64 {
    if eta == 1.0 {
        return 0.0;
    }
    // eta² cos_t², arranged so that near eta = 1 nothing cancels.
    let squared = (eta - 1.0) * (eta + 1.0) + cos * cos;
    if squared <= 0.0 {
        return 1.0;
    }
    let far = squared.sqrt();
    let cos_t = far / eta;
    let r_s = (cos - far) / (cos + far);
    let r_p = (eta * cos - cos_t) / (eta * cos + cos_t);
    0.5 * (r_s * r_s + r_p * r_p)
}

/// The cosine in the far medium of a ray that arrives with `cos`; `None` when it is totally reflected.
pub fn refracted_cosine(cos: f64, eta: f64) -> Option<f64> {
    let squared = (eta - 1.0) * (eta + 1.0) + cos * cos;
    (squared >= 0.0).then(|| squared.sqrt() / eta)
}

/// The cosine inside a medium of relative index `eta` below which light is totally reflected; 0 for eta up to 1.
pub fn critical_cosine(eta: f64) -> f64 {
    if eta > 1.0 { ((eta - 1.0) * (eta + 1.0)).sqrt() / eta } else { 0.0 }
}

/// ∫ mu^order F(mu) dmu over [0, 1] for light that arrives *from* a medium of index `eta` at one of index 1.
/// Order 1 and 2 are the FM1 and FM2 of the diffusion literature.
pub fn fresnel_moment(order: u32, eta: f64) -> f64 {
    let order = order as i32;
    let rule = graded(NODES, 0.0, 1.0);
    if eta <= 1.0 {
        return integrate(&rule, |mu| mu.powi(order) * fresnel_dielectric(mu, 1.0 / eta));
    }
    // All is reflected up to the critical cosine. Beyond it F has a square root's kink in mu and is smooth in the
    // cosine c outside, where eta² mu dmu = c dc and F is the same from both sides.
    let total = critical_cosine(eta).powi(order + 1) / f64::from(order + 1);
    let partial = integrate(&rule, |c| {
        let mu = refracted_cosine(c, eta).expect("a denser medium refracts every ray");
        c * mu.powi(order - 1) * fresnel_dielectric(c, eta)
    });
    total + partial / (eta * eta)
}

/// Enough for 1e-10 at any index from 1 to 4.
const NODES: usize = 48;

/// The share of diffuse light that gets *into* a medium of relative index `eta`: 2 ∫ mu (1 - F(mu)) dmu. It is also the
/// constant c = 1 - 2 FM1(1/eta) that normalises the outgoing side of a separable BSSRDF.
pub fn diffuse_transmittance(eta: f64) -> f64 {
    1.0 - 2.0 * fresnel_moment(1, 1.0 / eta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn normal_incidence_brewster_and_limits() {
        assert!((fresnel_dielectric(1.0, 1.5) - 0.04).abs() < 1e-15);
        assert_eq!(fresnel_dielectric(0.0, 1.5), 1.0);
        assert_eq!(fresnel_dielectric(0.0, 1.0), 0.0);
        assert_eq!(fresnel_dielectric(0.5, 1.0), 0.0);
        assert_eq!(fresnel_dielectric(0.5, 1.0 / 1.5), 1.0);
        // At Brewster's angle only s-polarised light is reflected: half of ((eta² - 1)/(eta² + 1))².
        let eta = 1.5f64;
        let brewster = 1.0 / (1.0 + eta * eta).sqrt();
        let r_s = (eta * eta - 1.0) / (eta * eta + 1.0);
        assert!((fresnel_dielectric(brewster, eta) - 0.5 * r_s * r_s).abs() < 1e-15);
        for eta in [1.0 - f64::EPSILON, 1.0 + f64::EPSILON] {
            assert!(fresnel_dielectric(0.0, eta).is_finite());
        }
    }

    #[test]
    fn moments_and_transmittance_have_their_exact_values() {
        for (eta, fm1, fm2) in [(1.3, 0.222228, 0.100089), (1.33, 0.235975, 0.109413), (1.5, 0.298173, 0.154810)] {
            assert!((fresnel_moment(1, eta) - fm1).abs() < 1e-6, "{}", fresnel_moment(1, eta));
            assert!((fresnel_moment(2, eta) - fm2).abs() < 1e-6, "{}", fresnel_moment(2, eta));
        }
        for order in 0..4 {
            assert_eq!(fresnel_moment(order, 1.0), 0.0);
        }
        for (eta, c) in [(1.3, 0.938868), (1.33, 0.934069), (1.4, 0.923188), (1.5, 0.908222)] {
            assert!((diffuse_transmittance(eta) - c).abs() < 1e-6, "{}", diffuse_transmittance(eta));
        }
    }

    /// What gets out of diffuse light is what gets in, over eta²; here summed from the inside, across the kink.
    #[test]
    fn diffuse_transmittance_obeys_etendue() {
        for eta in [1.0001, 1.01, 1.1, 1.33, 1.5, 2.0, 4.0] {
            let rule = graded(200, critical_cosine(eta), 1.0);
            let outwards = 2.0 * integrate(&rule, |mu| mu * (1.0 - fresnel_dielectric(mu, 1.0 / eta)));
            let inwards = diffuse_transmittance(eta);
            assert!((inwards - eta * eta * outwards).abs() < 1e-9, "eta {eta}: {inwards} {outwards}");
            assert!((diffuse_transmittance(1.0 / eta) - outwards).abs() < 1e-9, "eta {eta}");
        }
    }

    proptest! {
        #[test]
        fn reflectance_is_a_share_and_the_same_from_both_sides(cos in 0.0..=1.0f64, eta in 0.25..4.0f64) {
            let f = fresnel_dielectric(cos, eta);
            prop_assert!((0.0..=1.0).contains(&f));
            if let Some(cos_t) = refracted_cosine(cos, eta).filter(|c| *c > 1e-6) {
                prop_assert!((f - fresnel_dielectric(cos_t, 1.0 / eta)).abs() < 1e-8);
                let back = refracted_cosine(cos_t, 1.0 / eta).unwrap_or(0.0);
                prop_assert!((back - cos).abs() < 1e-7);
            } else {
                prop_assert!(f > 0.99);
            }
        }
    }
}
