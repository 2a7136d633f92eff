//! The glossy lobe of a rough dielectric boundary: GGX normals [Walter2007] under height-correlated Smith masking and
//! shadowing [Heitz2014], single reflection only, so a rough boundary loses a little energy and never gains any.
//!
//! `roughness` is perceptual, in [0, 1]; the paper's alpha is its square. Cosines are with the surface normal, on the
//! outer side: `cos_i` of the light, `cos_o` of the eye, `cos_h` of the half vector. A smooth boundary (roughness 0) has a
//! delta for a lobe, which no density can hold: the functions give 0 there, and the caller reflects it as a mirror does.

use crate::optics::fresnel::fresnel_dielectric;
use crate::optics::quadrature::gauss_legendre;
use std::f64::consts::PI;

/// Density of microfacet normals per solid angle of them, 1/sr. Twin: `microfacet.wgsl`.
pub fn ggx_d(cos_h: f64, roughness: f64) -> f64 {
    let alpha = roughness * roughness;
    let q = (1.0 - cos_h) * (1.0 + cos_h) + alpha * alpha * cos_h * cos_h;
    if cos_h <= 0.0 || q == 0.0 {
        return 0.0;
    }
    let s = alpha / q;
    s * s / PI
}

/// Height-correlated share of microfacets that see both the light and the eye. Twin: `microfacet.wgsl`.
pub fn smith_g2(cos_i: f64, cos_o: f64, roughness: f64) -> f64 {
    if cos_i <= 0.0 || cos_o <= 0.0 {
        return 0.0;
    }
    let (root_i, root_o) = (smith_root(cos_i, roughness), smith_root(cos_o, roughness));
    2.0 * cos_i * cos_o / (cos_o * root_i + cos_i * root_o)
}

/// The glossy lobe without Fresnel, times the light's cosine: D G2 / (4 cos_o), 1/sr. Times F at the angle between light
/// and half vector and times the light's irradiance facing it, this is radiance. Twin: `microfacet.wgsl`.
pub fn ggx_lobe(cos_i: f64, cos_o: f64, cos_h: f64, roughness: f64) -> f64 {
    let both = cos_o * smith_root(cos_i, roughness) + cos_i * smith_root(cos_o, roughness);
    if cos_i <= 0.0 || cos_o < 0.0 || both == 0.0 {
        return 0.0;
    }
    ggx_d(cos_h, roughness) * 0.5 * cos_i / both
}

/// cos (1 + 2 Lambda), finite at grazing.
fn smith_root(cos: f64, roughness: f64) -> f64 {
    let a = roughness.powi(4);
    (a + (1.0 - a) * cos * cos).sqrt()
}

/// The share of light from a uniform hemisphere, or by reciprocity of light from `cos`, that the glossy lobe reflects
/// under a boundary of relative index `eta`: ∫ F D G2 / (4 cos_o) d omega_i. Smooth boundaries give Fresnel itself.
pub fn directional_albedo(cos: f64, roughness: f64, eta: f64) -> f64 {
    lobe_albedo(cos, roughness, |cos_d| fresnel_dielectric(cos_d, eta))
}

/// [`directional_albedo`] for the split sum of environment reflection [Karis2013], with exact Fresnel and therefore one
/// table for each index. Value [j][i] is at cos = i/(width - 1), roughness = j/(height - 1), so a shader reads it at
/// ((cos (width - 1) + ½)/width, …). Panics when a side has less than two values.
pub fn directional_albedo_table(eta: f64, width: usize, height: usize) -> Vec<f64> {
    assert!(width > 1 && height > 1, "the table holds both ends of each axis");
    (0..height * width)
        .map(|at| {
            let (j, i) = (at / width, at % width);
            directional_albedo(i as f64 / (width - 1) as f64, j as f64 / (height - 1) as f64, eta)
        })
        .collect()
}

/// Integrates over the normals that the eye sees: the visible half of the hemisphere, stretched by alpha, is a cap of
/// the unit sphere around which mirror directions are uniform [Dupuy2023]. What is left under the integral,
/// F G2/G1, is smooth at any roughness.
fn lobe_albedo(cos: f64, roughness: f64, fresnel: impl Fn(f64) -> f64) -> f64 {
    let alpha = roughness * roughness;
    if roughness.powi(4) == 0.0 {
        return fresnel(cos);
    }
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    let length = (alpha * sin).hypot(cos);
    // The eye in the stretched space, in the plane y = 0.
    let (x_eye, z_eye) = (alpha * sin / length, cos / length);
    let root_o = smith_root(cos, roughness);
    let mut sum = 0.0;
    for (z, weight) in gauss_legendre(CAP_NODES, -z_eye, 1.0) {
        for turn in 0..CAP_NODES {
            let phi = PI * (turn as f64 + 0.5) / CAP_NODES as f64;
            let ring = ((1.0 - z) * (1.0 + z)).sqrt();
            let (hx, hy, hz) = (alpha * (ring * phi.cos() + x_eye), alpha * ring * phi.sin(), z + z_eye);
            let norm = (hx * hx + hy * hy + hz * hz).sqrt();
            let cos_d = ((sin * hx + cos * hz) / norm).min(1.0);
            let cos_i = 2.0 * cos_d * hz / norm - cos;
            if cos_i > 0.0 {
                // G2/G1(eye), with the eye's cosine divided out.
                let g = cos_i * (cos + root_o) / (cos * smith_root(cos_i, roughness) + cos_i * root_o);
                sum += weight * g * fresnel(cos_d);
            }
        }
    }
    sum / (CAP_NODES as f64 * (1.0 + z_eye))
}

/// Per axis of the cap: errs by about 3e-4 of the albedo at worst, where part of the lobe is below the horizon.
const CAP_NODES: usize = 48;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::quadrature::integrate;
    use proptest::prelude::*;

    /// The lobe's albedo by brute force over directions of the light.
    fn brute_force(cos: f64, roughness: f64, fresnel: impl Fn(f64) -> f64) -> f64 {
        let (sin, turns) = ((1.0 - cos * cos).sqrt(), 400);
        integrate(&gauss_legendre(400, 0.0, 1.0), |cos_i| {
            let sin_i = (1.0 - cos_i * cos_i).sqrt();
            let ring = (0..turns).map(|i| {
                let dot = cos * cos_i + sin * sin_i * (PI * (i as f64 + 0.5) / turns as f64).cos();
                let cos_d = (0.5 * (1.0 + dot)).sqrt();
                let cos_h = (0.5 * (cos + cos_i) / cos_d).min(1.0);
                fresnel(cos_d) * ggx_lobe(cos_i, cos, cos_h, roughness)
            });
            ring.sum::<f64>() * 2.0 * PI / turns as f64
        })
    }

    #[test]
    fn normals_cover_the_surface_once() {
        // ∫ D cos d omega, with s = sin² / (sin² + alpha² cos²) in place of the angle, so that any lobe is smooth.
        for roughness in [0.05, 0.3, 0.7, 1.0f64] {
            let a = roughness.powi(4);
            let covered = integrate(&gauss_legendre(64, 0.0, 1.0), |s| {
                let sin2 = a * s / (1.0 - s + a * s);
                let slope = a / (1.0 - s + a * s).powi(2);
                PI * ggx_d((1.0 - sin2).sqrt(), roughness) * slope
            });
            assert!((covered - 1.0).abs() < 1e-9, "roughness {roughness}: {covered}");
        }
    }

    #[test]
    fn albedo_agrees_with_brute_force_and_smooth_is_fresnel() {
        for (cos, roughness) in [(0.2, 0.6), (0.7, 0.6), (0.2, 1.0), (1.0, 1.0), (0.5, 0.4)] {
            let fresnel = |c| fresnel_dielectric(c, 1.5);
            let (fast, slow) = (lobe_albedo(cos, roughness, fresnel), brute_force(cos, roughness, fresnel));
            assert!((fast - slow).abs() < 2e-3 * slow, "cos {cos} roughness {roughness}: {fast} {slow}");
        }
        // Seen along the normal at alpha = 1, D is 1/pi and G2 = 2c/(1 + c): 1 - ln 2.
        assert!((lobe_albedo(1.0, 1.0, |_| 1.0) - (1.0 - 2f64.ln())).abs() < 1e-3);
        for cos in [0.0, 0.1, 0.5, 1.0] {
            assert_eq!(directional_albedo(cos, 0.0, 1.4), fresnel_dielectric(cos, 1.4));
        }
        assert!((directional_albedo(0.5, 0.02, 1.4) - fresnel_dielectric(0.5, 1.4)).abs() < 1e-5);
        let table = directional_albedo_table(1.5, 4, 3);
        assert_eq!((table.len(), table[4 + 2]), (12, directional_albedo(2.0 / 3.0, 0.5, 1.5)));
    }

    #[test]
    fn limits_are_numbers() {
        for roughness in [0.0, 1e-100, 1e-9, 0.5, 1.0] {
            for cos in [0.0, 1e-100, 1.0] {
                for other in [0.0, 1e-100, 1.0] {
                    assert!(ggx_d(cos, roughness).is_finite());
                    assert!((0.0..=1.0).contains(&smith_g2(cos, other, roughness)));
                    assert!(ggx_lobe(cos, other, 0.5, roughness) >= 0.0);
                }
                assert!((0.0..=1.0 + 1e-12).contains(&directional_albedo(cos, roughness, 1.5)));
                assert_eq!(directional_albedo(cos, roughness, 1.0), 0.0);
            }
        }
        assert!((smith_g2(0.3, 0.8, 0.0) - 1.0).abs() < 1e-15);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn a_white_furnace_is_never_outshone(cos in 0.0..=1.0f64, roughness in 0.0..=1.0f64) {
            let white = lobe_albedo(cos, roughness, |_| 1.0);
            prop_assert!(white <= 1.0 + 1e-12 && white > 0.3, "{white}");
            prop_assert!(directional_albedo(cos, roughness, 1.5) <= white + 1e-12);
        }

        #[test]
        fn the_lobe_is_reciprocal(i in 0.01..=1.0f64, o in 0.01..=1.0f64, h in 0.01..=1.0f64, r in 0.05..=1.0f64) {
            let (there, back) = (ggx_lobe(i, o, h, r) / i, ggx_lobe(o, i, h, r) / o);
            prop_assert!((there - back).abs() <= 1e-12 * there);
            prop_assert!((there - ggx_d(h, r) * smith_g2(i, o, r) / (4.0 * i * o)).abs() <= 1e-12 * there);
        }
    }
}
