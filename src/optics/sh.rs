//! Real spherical harmonics and what a convolution with a zonal kernel does to them [Ramamoorthi2001].
//!
//! Y_lm stands at index l² + l + m; `bands` bands (l < bands) are bands² coefficients. Orthonormal over the sphere, without
//! the Condon-Shortley sign: band 1 is sqrt(3/(4 pi)) (y, z, x). Eight bands are what this project uses; the recurrence
//! is stable well beyond. Directions are unit vectors, z is the pole.

use crate::optics::fresnel::fresnel_dielectric;
use crate::optics::quadrature::graded;
use glam::DVec3;
use std::f64::consts::PI;

/// All harmonics of `bands` bands at the unit `direction`: bands² values.
///
/// For each order m, cos(m phi) and sin(m phi) times sin^m(theta) are the parts of (x + iy)^m, and what remains is a
/// polynomial in z, raised from l = m by the three-term recurrence of normalised Legendre functions.
pub fn sh_basis(direction: DVec3, bands: usize) -> Vec<f64> {
    let DVec3 { x, y, z } = direction;
    let mut basis = vec![0.0; bands * bands];
    let (mut re, mut im) = (1.0, 0.0);
    let mut diagonal = (0.25 / PI).sqrt();
    for m in 0..bands {
        let (mut before, mut value) = (0.0, diagonal);
        for l in m..bands {
            let centre = l * l + l;
            if m == 0 {
                basis[centre] = value;
            } else {
                basis[centre + m] = std::f64::consts::SQRT_2 * value * re;
                basis[centre - m] = std::f64::consts::SQRT_2 * value * im;
            }
            let ratio = |l: usize| {
                let (l2, m2) = ((l * l) as f64, (m * m) as f64);
                ((4.0 * l2 - 1.0) / (l2 - m2)).sqrt()
            };
            let next = ratio(l + 1) * (z * value - if l > m { before / ratio(l) } else { 0.0 });
            (before, value) = (value, next);
        }
        (re, im) = (re * x - im * y, re * y + im * x);
        diagonal *= ((2 * m + 3) as f64 / (2 * m + 2) as f64).sqrt();
    }
    basis
}

/// The nine harmonics of bands 0 to 2 at the unit direction (x, y, z). Twin: `sh.wgsl`.
pub fn sh_basis_3(x: f64, y: f64, z: f64) -> [f64; 9] {
    [
        0.28209479177387814,
        0.4886025119029199 * y,
        0.4886025119029199 * z,
        0.4886025119029199 * x,
        1.0925484305920792 * x * y,
        1.0925484305920792 * y * z,
        0.31539156525252005 * (3.0 * z * z - 1.0),
        1.0925484305920792 * x * z,
        0.5462742152960396 * (x * x - y * y),
    ]
}

/// The 64 harmonics of bands 0 to 7 at the unit direction (x, y, z). Twin: `sh.wgsl`.
pub fn sh_basis_8(x: f64, y: f64, z: f64) -> [f64; 64] {
    sh_basis(DVec3::new(x, y, z), 8).try_into().expect("eight bands are 64 harmonics")
}

/// Coefficients of band l that convolution with the zonal function `f` multiplies with: 2 pi ∫ f(z) P_l(z) dz, for each
/// l < bands. `rule` are the (node, weight) over z that the integral takes, split where `f` is not smooth.
pub fn convolution_coefficients(bands: usize, rule: &[(f64, f64)], f: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut coefficients = vec![0.0; bands];
    for &(z, weight) in rule {
        let value = 2.0 * PI * weight * f(z);
        let (mut before, mut p) = (0.0, 1.0);
        for (l, coefficient) in coefficients.iter_mut().enumerate() {
            *coefficient += value * p;
            let l = l as f64;
            (before, p) = (p, ((2.0 * l + 1.0) * z * p - l * before) / (l + 1.0));
        }
    }
    coefficients
}

/// Projection of the zonal function `f` about the pole: the coefficients of Y_l0 for each l < bands, all others being 0.
/// Turned towards an axis a, coefficient (l, m) is this times sqrt(4 pi/(2l + 1)) Y_lm(a).
pub fn project_zonal(bands: usize, rule: &[(f64, f64)], f: impl Fn(f64) -> f64) -> Vec<f64> {
    let coefficients = convolution_coefficients(bands, rule, f).into_iter().enumerate();
    coefficients.map(|(l, c)| c * ((2 * l + 1) as f64 / (4.0 * PI)).sqrt()).collect()
}

/// What turns radiance into irradiance, band by band: pi, 2 pi/3, pi/4, 0, -pi/24, … [Ramamoorthi2001].
pub fn clamped_cosine(bands: usize) -> Vec<f64> {
    transmitted_cosine(bands, 1.0)
}

/// What turns radiance outside into irradiance that enters a medium of relative index `eta`: the coefficients of
/// max(0, c) (1 - F(c, eta)).
pub fn transmitted_cosine(bands: usize, eta: f64) -> Vec<f64> {
    convolution_coefficients(bands, &graded(48, 0.0, 1.0), |c| c * (1.0 - fresnel_dielectric(c, eta)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::fresnel::diffuse_transmittance;
    use crate::optics::quadrature::gauss_legendre;
    use proptest::prelude::*;

    const BANDS: usize = 8;

    fn direction() -> impl Strategy<Value = DVec3> {
        (-1.0..=1.0f64, 0.0..2.0 * PI).prop_map(|(z, phi)| {
            let ring = (1.0 - z * z).sqrt();
            DVec3::new(ring * phi.cos(), ring * phi.sin(), z)
        })
    }

    #[test]
    fn harmonics_are_orthonormal() {
        // Exact: Gauss-Legendre in z, and as many meridians as the highest product of orders needs.
        let mut gram = vec![0.0; BANDS.pow(4)];
        for (z, weight) in gauss_legendre(BANDS, -1.0, 1.0) {
            for turn in 0..2 * BANDS {
                let phi = 2.0 * PI * (turn as f64 + 0.3) / (2 * BANDS) as f64;
                let ring = (1.0 - z * z).sqrt();
                let y = sh_basis(DVec3::new(ring * phi.cos(), ring * phi.sin(), z), BANDS);
                for (at, sum) in gram.iter_mut().enumerate() {
                    *sum += weight * PI / BANDS as f64 * y[at / y.len()] * y[at % y.len()];
                }
            }
        }
        for (at, sum) in gram.iter().enumerate() {
            let expected = if at / BANDS.pow(2) == at % BANDS.pow(2) { 1.0 } else { 0.0 };
            assert!((sum - expected).abs() < 1e-13, "{at}: {sum}");
        }
    }

    #[test]
    fn poles_and_known_values() {
        let y = sh_basis(DVec3::Z, BANDS);
        for l in 0..BANDS {
            for m in -(l as i32)..=l as i32 {
                let expected = if m == 0 { ((2 * l + 1) as f64 / (4.0 * PI)).sqrt() } else { 0.0 };
                assert!((y[((l * l + l) as i32 + m) as usize] - expected).abs() < 1e-14);
            }
        }
        // Y_33 = sqrt(35/(32 pi)) x (x² - 3y²), Y_3,-2 = sqrt(105/(4 pi)) xyz.
        let d = DVec3::new(0.48, 0.6, 0.64);
        let y = sh_basis(d, 4);
        assert!((y[15] - (35.0 / (32.0 * PI)).sqrt() * d.x * (d.x * d.x - 3.0 * d.y * d.y)).abs() < 1e-14);
        assert!((y[10] - (105.0 / (4.0 * PI)).sqrt() * d.x * d.y * d.z).abs() < 1e-14);
        assert!(sh_basis(d, 0).is_empty());
    }

    #[test]
    fn clamped_cosine_has_its_closed_form() {
        let expected = [1.0, 2.0 / 3.0, 0.25, 0.0, -1.0 / 24.0, 0.0, 1.0 / 64.0, 0.0].map(|x| x * PI);
        for (a, b) in clamped_cosine(BANDS).into_iter().zip(expected) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        for eta in [1.3, 1.5] {
            assert!((transmitted_cosine(1, eta)[0] - PI * diffuse_transmittance(eta)).abs() < 1e-10);
        }
    }

    /// A polynomial of degree below `bands` is held exactly.
    #[test]
    fn a_projected_kernel_is_the_kernel() {
        let rule = gauss_legendre(BANDS, -1.0, 1.0);
        let f = |z: f64| 1.0 + z - 3.0 * z.powi(4) + z.powi(7);
        let zonal = project_zonal(BANDS, &rule, f);
        for d in [DVec3::Z, DVec3::new(0.48, 0.6, 0.64), -DVec3::Z] {
            let y = sh_basis(d, BANDS);
            let sum: f64 = zonal.iter().enumerate().map(|(l, c)| c * y[l * l + l]).sum();
            assert!((sum - f(d.z)).abs() < 1e-12);
        }
    }

    proptest! {
        #[test]
        fn addition_theorem(a in direction(), b in direction()) {
            let (ya, yb) = (sh_basis(a, BANDS), sh_basis(b, BANDS));
            let legendre = convolution_coefficients(BANDS, &[(a.dot(b), 0.5 / PI)], |_| 1.0);
            for (l, p) in legendre.into_iter().enumerate() {
                let sum: f64 = (l * l..(l + 1) * (l + 1)).map(|i| ya[i] * yb[i]).sum();
                prop_assert!((sum - (2 * l + 1) as f64 / (4.0 * PI) * p).abs() < 1e-13);
            }
        }

        #[test]
        fn turning_keeps_the_energy_of_every_band(
            points in prop::collection::vec((direction(), -1.0..1.0f64), 3), axis in direction(), angle in 0.0..6.0f64,
        ) {
            let turn = glam::DQuat::from_axis_angle(axis, angle);
            let energy = |turn: glam::DQuat| {
                let mut sum = vec![0.0; BANDS * BANDS];
                for (point, weight) in &points {
                    sum.iter_mut().zip(sh_basis(turn * *point, BANDS)).for_each(|(s, y)| *s += weight * y);
                }
                (0..BANDS).map(|l| sum[l * l..(l + 1) * (l + 1)].iter().map(|c| c * c).sum()).collect::<Vec<f64>>()
            };
            for (still, turned) in energy(glam::DQuat::IDENTITY).into_iter().zip(energy(turn)) {
                prop_assert!((still - turned).abs() < 1e-12);
            }
        }

        #[test]
        fn the_twin_is_the_first_three_bands(d in direction()) {
            for (a, b) in sh_basis_3(d.x, d.y, d.z).into_iter().zip(sh_basis(d, 3)) {
                prop_assert!((a - b).abs() < 1e-14);
            }
        }
    }
}
