//! The exact albedo of a half space that scatters isotropically under a Fresnel boundary, and its inverse.
//!
//! Chandrasekhar's H function solves the half space without a boundary [Chandrasekhar1960]: of the flux that goes down
//! with cosine mu', the share K(mu, mu') dmu = omega/2 · mu/(mu + mu') · H(mu) H(mu') dmu comes up with cosine mu, and
//! sqrt(1 - omega) H(mu') is absorbed. The boundary sends the share F(mu) down again, so that the chances of leaving
//! and of being absorbed in the end, for light that starts down with mu', are
//!
//! ```text
//! e(mu') = ∫ K(mu, mu') (1 - F(mu)) dmu + ∫ K(mu, mu') F(mu) e(mu) dmu
//! a(mu') = sqrt(1 - omega) H(mu')       + ∫ K(mu, mu') F(mu) a(mu) dmu
//! ```
//!
//! a small linear system on quadrature nodes with two right-hand sides. e is accurate where little leaves and a where
//! little is absorbed, so the albedo is e / (e + a): within [0, 1] and right at both ends.
//!
//! Anisotropy enters by similarity: omega is the reduced albedo alpha'. Where almost nothing is absorbed, alpha' has too
//! few bits, so the functions of [`HalfSpace`] speak of the *co-albedo* 1 - alpha' = sigma_a / sigma_t'. All is a
//! function of ratios: no unit of length appears.

use crate::optics::fresnel::{critical_cosine, fresnel_dielectric, refracted_cosine};
use crate::optics::quadrature::graded;
use crate::optics::root::bracketed_root;

/// Albedo of light that has entered at normal incidence: the share of it that leaves again, in any direction, after
/// any number of scatterings and internal reflections. `alpha_prime` in [0, 1]; `eta` above 0, inside over outside.
pub fn albedo_normal(alpha_prime: f64, eta: f64) -> f64 {
    HalfSpace::new(eta).albedo_normal(1.0 - alpha_prime)
}

/// The same share for light that entered from a uniform hemisphere outside: a cosine weighted by Fresnel transmittance,
/// refracted.
pub fn albedo_diffuse(alpha_prime: f64, eta: f64) -> f64 {
    HalfSpace::new(eta).albedo_diffuse(1.0 - alpha_prime)
}

/// The alpha' whose [`albedo_normal`] is `albedo`, in [0, 1], to 1e-12.
pub fn alpha_prime(albedo: f64, eta: f64) -> f64 {
    1.0 - HalfSpace::new(eta).coalbedo(albedo)
}

/// A half space below a boundary of relative index `eta`: what does not depend on the medium, ready for many albedos.
pub struct HalfSpace {
    nodes: Vec<Node>,
}

/// A quadrature node over the cosine inside, with the internal reflectance there.
struct Node {
    mu: f64,
    weight: f64,
    reflectance: f64,
}

/// Nodes on either side of the critical angle: albedos are good to about 1e-9.
const NODES: usize = 16;

impl HalfSpace {
    pub fn new(eta: f64) -> HalfSpace {
        HalfSpace::with_nodes(eta, NODES)
    }

    /// `n` nodes on either side of the critical angle. H is not smooth at 0, which graded nodes tame; (1 - F) has a
    /// square root's kink at the critical angle, which vanishes in the cosine c outside: eta² mu dmu = c dc.
    fn with_nodes(eta: f64, n: usize) -> HalfSpace {
        let node = |(mu, weight)| Node { mu, weight, reflectance: fresnel_dielectric(mu, 1.0 / eta) };
        if eta <= 1.0 {
            return HalfSpace { nodes: graded(n, 0.0, 1.0).into_iter().map(node).collect() };
        }
        let reflected = graded(n, 0.0, critical_cosine(eta)).into_iter().map(node);
        let partly = graded(n, 0.0, 1.0).into_iter().map(|(c, weight)| {
            let mu = refracted_cosine(c, eta).expect("a denser medium refracts every ray");
            Node { mu, weight: weight * c / (eta * eta * mu), reflectance: fresnel_dielectric(c, eta) }
        });
        HalfSpace { nodes: reflected.chain(partly).collect() }
    }

    /// As the free function of this name, for a co-albedo 1 - alpha' in [0, 1].
    pub fn albedo_normal(&self, coalbedo: f64) -> f64 {
        self.albedos_from(coalbedo, &[1.0])[0]
    }

    /// The share that leaves again of light that goes down inside, at each of these cosines in [0, 1].
    pub fn albedos_from(&self, coalbedo: f64, cosines: &[f64]) -> Vec<f64> {
        let fates = self.fates(coalbedo);
        let h = HFunction::new(coalbedo);
        let albedo = |&cos: &f64| {
            let h_down = h.at(cos);
            let mut fate = Fate { leaves: 0.0, absorbed: coalbedo.sqrt() * h_down };
            for (node, (h, at)) in self.nodes.iter().zip(&fates) {
                let k = kernel(coalbedo, node.mu, *h, cos, h_down) * node.weight;
                fate.leaves += k * (1.0 - node.reflectance + node.reflectance * at.leaves);
                fate.absorbed += k * node.reflectance * at.absorbed;
            }
            fate.albedo()
        };
        cosines.iter().map(albedo).collect()
    }

    /// As the free function of this name, for a co-albedo 1 - alpha' in [0, 1].
    pub fn albedo_diffuse(&self, coalbedo: f64) -> f64 {
        // Light from a uniform hemisphere fills the cone of transmission evenly but for Fresnel: flux mu (1 - F) dmu.
        let (mut sum, mut total) = (0.0, 0.0);
        for (node, (_, fate)) in self.nodes.iter().zip(self.fates(coalbedo)) {
            let entered = node.weight * node.mu * (1.0 - node.reflectance);
            sum += entered * fate.albedo();
            total += entered;
        }
        sum / total
    }

    /// The co-albedo 1 - alpha' whose [`HalfSpace::albedo_normal`] is `albedo`, in [0, 1].
    pub fn coalbedo(&self, albedo: f64) -> f64 {
        if albedo == 0.0 {
            return 1.0;
        }
        // 1 - albedo is nearly linear in the square root of the co-albedo.
        let root = bracketed_root(|root| self.albedo_normal(root * root) - albedo, 0.0, 1.0);
        root * root
    }

    /// H and the fate of light that starts down, at each node.
    fn fates(&self, coalbedo: f64) -> Vec<(f64, Fate)> {
        let n = self.nodes.len();
        let h = HFunction::new(coalbedo);
        let h: Vec<f64> = self.nodes.iter().map(|node| h.at(node.mu)).collect();
        // Row j: light that starts down at node j; column i: comes up at node i. Two right-hand sides at the end.
        let width = n + 2;
        let mut system = vec![0.0; n * width];
        for (j, row) in system.chunks_exact_mut(width).enumerate() {
            for (i, node) in self.nodes.iter().enumerate() {
                let k = kernel(coalbedo, node.mu, h[i], self.nodes[j].mu, h[j]) * node.weight;
                row[i] = -k * node.reflectance;
                row[n] += k * (1.0 - node.reflectance);
            }
            row[j] += 1.0;
            row[n + 1] = coalbedo.sqrt() * h[j];
        }
        eliminate(&mut system, n);
        let fates = system.chunks_exact(width).map(|row| Fate { leaves: row[n], absorbed: row[n + 1] });
        h.into_iter().zip(fates).collect()
    }
}

/// What becomes of light inside: two shares whose sum is 1 but for the error of quadrature.
struct Fate {
    leaves: f64,
    absorbed: f64,
}

impl Fate {
    fn albedo(&self) -> f64 {
        self.leaves / (self.leaves + self.absorbed)
    }
}

/// K(mu, mu') per dmu: flux that comes up with mu for flux that goes down with mu'.
fn kernel(coalbedo: f64, mu: f64, h: f64, mu_down: f64, h_down: f64) -> f64 {
    0.5 * (1.0 - coalbedo) * h * h_down * mu / (mu + mu_down)
}

/// Gauss-Jordan on n rows of n coefficients followed by right-hand sides, which become the solutions. Without pivoting:
/// off the diagonal all is ≤ 0 and rows sum to at least 0 (no light is made), for which elimination is stable.
fn eliminate(system: &mut [f64], n: usize) {
    let width = system.len() / n;
    for p in 0..n {
        let (above, rest) = system.split_at_mut(p * width);
        let (pivot, below) = rest.split_at_mut(width);
        let scale = 1.0 / pivot[p];
        pivot[p..].iter_mut().for_each(|x| *x *= scale);
        for row in above.chunks_exact_mut(width).chain(below.chunks_exact_mut(width)) {
            let factor = row[p];
            row[p..].iter_mut().zip(&pivot[p..]).for_each(|(x, y)| *x -= factor * y);
        }
    }
}

/// Chandrasekhar's H for isotropic scattering, from its closed form
/// ln H(mu) = -1/pi ∫_0^∞ mu / (1 + mu² t²) ln(1 - omega arctan(t)/t) dt.
///
/// With t = e^u every singularity of the integrand lies on |Im u| = pi/2, whatever mu and omega, so the trapezoidal rule
/// of step h errs by e^(-pi²/h): 1e-13.
struct HFunction {
    /// t and the logarithm there times dt/(-pi).
    samples: Vec<(f64, f64)>,
}

impl HFunction {
    const STEP: f64 = 0.33;
    /// u from -31 to 24: what lies beyond adds less than 1e-11.
    const SAMPLES: std::ops::Range<i32> = -94..73;

    fn new(coalbedo: f64) -> HFunction {
        let sample = |i: i32| {
            let t = (f64::from(i) * Self::STEP).exp();
            // 1 - arctan(t)/t, as a series where the difference would cancel.
            let gap = if t < 0.05 {
                let q = t * t;
                q * (1.0 / 3.0 - q * (1.0 / 5.0 - q * (1.0 / 7.0 - q * (1.0 / 9.0 - q / 11.0))))
            } else {
                1.0 - t.atan() / t
            };
            let log = (coalbedo + (1.0 - coalbedo) * gap).ln();
            (t, -Self::STEP / std::f64::consts::PI * t * log)
        };
        HFunction { samples: Self::SAMPLES.map(sample).collect() }
    }

    fn at(&self, mu: f64) -> f64 {
        self.samples.iter().map(|(t, log)| mu * log / (1.0 + mu * mu * t * t)).sum::<f64>().exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::quadrature::integrate;
    use proptest::prelude::*;

    const ETAS: [f64; 8] = [0.8, 1.0, 1.0 + 1e-9, 1.01, 1.3, 1.33, 1.5, 2.5];

    #[test]
    fn h_has_its_tabulated_values_and_solves_its_equation() {
        // [Chandrasekhar1960, table XI] and, for the conservative case, its first moment 2/sqrt(3).
        assert!((HFunction::new(0.0).at(1.0) - 2.9078).abs() < 5e-5);
        let rule = graded(64, 0.0, 1.0);
        let h = HFunction::new(0.0);
        assert!((integrate(&rule, |mu| mu * h.at(mu)) - 2.0 / 3f64.sqrt()).abs() < 1e-10);
        for coalbedo in [0.0f64, 1e-9, 1e-3, 0.1, 0.7, 1.0] {
            let h = HFunction::new(coalbedo);
            for mu in [1e-9, 1e-3, 0.1, 0.5, 1.0] {
                let sum = integrate(&rule, |x| x * h.at(x) / (x + mu));
                let residual = h.at(mu) * (coalbedo.sqrt() + 0.5 * (1.0 - coalbedo) * sum) - 1.0;
                assert!(residual.abs() < 1e-9, "co-albedo {coalbedo} mu {mu}: {residual}");
            }
        }
    }

    #[test]
    fn albedos_agree_with_monte_carlo_under_water() {
        assert!((albedo_normal(0.9, 1.33) - 0.28033).abs() < 1e-4, "{}", albedo_normal(0.9, 1.33));
        assert!((albedo_normal(0.999, 1.33) - 0.86632).abs() < 2e-4, "{}", albedo_normal(0.999, 1.33));
    }

    /// The share of `paths` random walks that leave again, when they start down inside with the cosine `start` draws.
    fn random_walks(alpha: f64, eta: f64, paths: u32, start: impl Fn(&mut dyn FnMut() -> f64) -> f64) -> f64 {
        use rand_pcg::rand_core::Rng;
        let mut random = rand_pcg::Pcg64Mcg::new(7);
        let mut uniform = move || (random.next_u64() >> 11) as f64 * 2f64.powi(-53);
        let mut left = 0;
        for _ in 0..paths {
            let (mut depth, mut cos) = (0.0, start(&mut uniform));
            loop {
                depth -= cos * (1.0 - uniform()).ln();
                if depth <= 0.0 {
                    if uniform() >= fresnel_dielectric(-cos, 1.0 / eta) {
                        left += 1;
                        break;
                    }
                    // The way that is left beyond the boundary is as long as a fresh one: flight has no memory.
                    (depth, cos) = (0.0, -cos);
                } else if uniform() >= alpha {
                    break;
                } else {
                    cos = 2.0 * uniform() - 1.0;
                }
            }
        }
        f64::from(left) / f64::from(paths)
    }

    #[test]
    fn random_walks_agree_and_notice_another_index() {
        let (alpha, eta, paths) = (0.9, 1.5, 200_000);
        let normal = random_walks(alpha, eta, paths, |_| 1.0);
        let diffuse = random_walks(alpha, eta, paths, |uniform| {
            loop {
                let cos = uniform().sqrt();
                if uniform() >= fresnel_dielectric(cos, eta) {
                    return refracted_cosine(cos, eta).unwrap();
                }
            }
        });
        // Four standard errors.
        let tolerance = 4.0 * (0.25f64 * 0.75 / f64::from(paths)).sqrt();
        assert!((albedo_normal(alpha, eta) - normal).abs() < tolerance, "{} {normal}", albedo_normal(alpha, eta));
        assert!((albedo_diffuse(alpha, eta) - diffuse).abs() < tolerance, "{} {diffuse}", albedo_diffuse(alpha, eta));
        assert!((albedo_diffuse(alpha, 1.4) - diffuse).abs() > tolerance);
        assert!((albedo_normal(alpha, eta) - diffuse).abs() > tolerance);
    }

    #[test]
    fn without_a_boundary_the_albedo_is_chandrasekhars() {
        for alpha in [0.1, 0.5, 0.9, 0.999] {
            let exact = 1.0 - (1.0f64 - alpha).sqrt() * HFunction::new(1.0 - alpha).at(1.0);
            assert!((albedo_normal(alpha, 1.0) - exact).abs() < 1e-9);
        }
    }

    #[test]
    fn nothing_is_lost_and_nothing_made() {
        for eta in ETAS {
            for alpha in [0.0, 1e-300, 1e-16, 0.3, 0.9, 0.999_999, 1.0] {
                let space = HalfSpace::new(eta);
                for (node, (_, fate)) in space.nodes.iter().zip(space.fates(1.0 - alpha)) {
                    // Grazing directions are the least accurate ones and carry mu of the flux.
                    let lost = node.mu * (fate.leaves + fate.absorbed - 1.0);
                    assert!(lost.abs() < 1e-8, "eta {eta} alpha' {alpha}: {lost}");
                }
            }
            assert_eq!((albedo_normal(0.0, eta), albedo_diffuse(0.0, eta)), (0.0, 0.0));
            assert_eq!(albedo_normal(1.0, eta), 1.0);
            assert!((albedo_diffuse(1.0, eta) - 1.0).abs() < 1e-15);
            assert_eq!((alpha_prime(0.0, eta), alpha_prime(1.0, eta)), (0.0, 1.0));
        }
    }

    #[test]
    fn more_nodes_change_nothing_and_fewer_do() {
        let mut worst = [0.0f64; 3];
        for eta in ETAS {
            for coalbedo in [0.9, 0.1, 1e-2, 1e-4, 1e-8] {
                let fine = HalfSpace::with_nodes(eta, 80);
                for (worst, n) in worst.iter_mut().zip([4, 8, NODES]) {
                    let coarse = HalfSpace::with_nodes(eta, n);
                    let normal = coarse.albedo_normal(coalbedo) - fine.albedo_normal(coalbedo);
                    let diffuse = coarse.albedo_diffuse(coalbedo) - fine.albedo_diffuse(coalbedo);
                    *worst = worst.max(normal.abs()).max(diffuse.abs());
                }
            }
        }
        assert!(worst[2] < 1e-8 && worst[1] > 10.0 * worst[2] && worst[0] > 10.0 * worst[1], "{worst:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn albedo_grows_with_alpha_prime_and_stays_a_share(
            a in 0.0..=1.0f64, b in 0.0..=1.0f64, eta in 1.0..3.0f64,
        ) {
            let (low, high) = (a.min(b), a.max(b));
            for albedo in [albedo_normal, albedo_diffuse] {
                let (x, y) = (albedo(low, eta), albedo(high, eta));
                prop_assert!(0.0 <= x && x <= y && y <= 1.0);
                prop_assert!(high - low < 1e-9 || x < y);
            }
        }

        #[test]
        fn the_inverse_inverts(albedo in 0.0..=1.0f64, depth in 0.0..15.0f64, eta in 1.0..3.0f64) {
            let space = HalfSpace::new(eta);
            for albedo in [albedo, 10f64.powf(-depth), 1.0 - 10f64.powf(-depth)] {
                let coalbedo = space.coalbedo(albedo);
                prop_assert!((space.albedo_normal(coalbedo) - albedo).abs() < 1e-14);
                let alpha = alpha_prime(albedo, eta);
                prop_assert!((0.0..=1.0).contains(&alpha));
            }
        }
    }
}
