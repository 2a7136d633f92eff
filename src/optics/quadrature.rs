//! Rules of quadrature as lists of (node, weight): Gauss-Legendre on an interval, plain or crowded at an end, double
//! exponential on the half line.

use gauss_quad::legendre::GaussLegendre;
use std::num::NonZeroUsize;

/// The `n`-point Gauss-Legendre rule on [a, b]: exact for polynomials up to degree 2n - 1. Panics when `n` is 0.
pub fn gauss_legendre(n: usize, a: f64, b: f64) -> Vec<(f64, f64)> {
    let rule = GaussLegendre::new(NonZeroUsize::new(n).expect("a quadrature rule has at least one node"));
    let half = 0.5 * (b - a);
    rule.iter().map(|(x, w)| (a + half * (1.0 + x), half * w)).collect()
}

/// The rule that x = a + (b - a) s³ makes of `n` Gauss-Legendre nodes in s: its nodes crowd at `a`, so integrands with a
/// square root, a logarithm or a branch point near there converge as fast as smooth ones. Panics when `n` is 0.
pub fn graded(n: usize, a: f64, b: f64) -> Vec<(f64, f64)> {
    gauss_legendre(n, 0.0, 1.0).into_iter().map(|(s, w)| (a + (b - a) * s.powi(3), 3.0 * (b - a) * s * s * w)).collect()
}

/// A rule on the interval between `peak` and `far`, whichever is larger, for integrands with a peak at the one as narrow as
/// `width`, above 0: Gauss-Legendre on pieces of it, each half as long as the one beside it, down to that width. A
/// Lorentzian, and what is as smooth at each distance from its peak, is summed to 1e-9.
pub fn halving(peak: f64, far: f64, width: f64) -> Vec<(f64, f64)> {
    let unit = gauss_legendre(12, 0.0, 1.0);
    let (mut outer, mut rule) = (far - peak, Vec::new());
    loop {
        let inner = if outer.abs() > width { 0.5 * outer } else { 0.0 };
        let length = outer - inner;
        rule.extend(unit.iter().map(|(s, w)| (peak + inner + s * length, w * length.abs())));
        if inner == 0.0 {
            return rule;
        }
        outer = inner;
    }
}

/// A rule on [0, ∞) for integrands that fall to nothing by `end`, whatever they do at 0 (a root, a logarithm, no end of
/// derivatives), and however many decades lie between `end` and `scale`, the length of their finest detail: the
/// trapezoidal rule after x = scale exp(u - e^-u) [Takahasi1974]. Nodes are even in ln x, five to a factor of e, so what
/// matters is where the integrand is singular in ln x: up to 1 away from the real axis, as for x = ±i scale, it is good
/// to about 1e-13 of the whole.
pub fn double_exponential(scale: f64, end: f64) -> impl Iterator<Item = (f64, f64)> {
    // What lies below the first node, x/scale = 1e-15, is left out.
    let nodes = (FIRST..).map(move |i| {
        let u = STEP * f64::from(i);
        let (x, slope) = (scale * (u - (-u).exp()).exp(), 1.0 + (-u).exp());
        (x, STEP * x * slope)
    });
    nodes.take_while(move |(x, _)| *x < end)
}

/// Of u, in [`double_exponential`].
const STEP: f64 = 0.2;
const FIRST: i32 = -17;

/// The sum that `rule` makes of `f`.
pub fn integrate(rule: &[(f64, f64)], f: impl Fn(f64) -> f64) -> f64 {
    rule.iter().map(|&(x, w)| w * f(x)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_up_to_degree_2n_minus_1_are_exact_and_no_further() {
        let moment =
            |n, p| integrate(&gauss_legendre(n, 1.0, 3.0), |x| x.powi(p)) - (3f64.powi(p + 1) - 1.0) / (p + 1) as f64;
        for n in 1..20 {
            let p = 2 * n as i32 - 1;
            let scale = 3f64.powi(p + 1);
            assert!(moment(n, p).abs() < 1e-14 * scale, "{n}");
        }
        assert!(moment(4, 8).abs() > 1e-3);
    }

    #[test]
    fn a_double_exponential_rule_takes_any_end_and_any_scale() {
        // ∫ e^-x x^(p-1) dx = Gamma(p).
        let gamma =
            |p: f64, scale| double_exponential(scale, 50.0).map(|(x, w)| w * (-x).exp() * x.powf(p - 1.0)).sum();
        let check = |found: f64, exact: f64| assert!((found / exact - 1.0).abs() < 1e-11, "{found} {exact}");
        check(gamma(1.0, 1.0), 1.0);
        check(gamma(1.5, 1.0), 0.5 * std::f64::consts::PI.sqrt());
        check(gamma(4.0, 0.1), 6.0);
        // ∫ s/(s² + x²) dx over all is pi/2, and over what lies beyond `end` s/end.
        for scale in [1e-12f64, 1e-3, 1.0] {
            let sum: f64 =
                double_exponential(scale, 1e13 * scale).map(|(x, w)| w * scale / (x * x + scale * scale)).sum();
            check(sum, 0.5 * std::f64::consts::PI);
        }
        assert!(double_exponential(1.0, 50.0).count() < 40);
    }

    #[test]
    fn a_halving_rule_takes_a_peak_of_any_width_from_either_side() {
        let lorentzian = |width: f64| move |x: f64| width / (width * width + (x - 1.0) * (x - 1.0));
        for width in [1e-12f64, 1e-4, 0.3, 7.0] {
            let error = |detail, far: f64| {
                let exact = ((far - 1.0).abs() / width).atan();
                (integrate(&halving(1.0, far, detail), lorentzian(width)) / exact - 1.0).abs()
            };
            // Places beside 1 are known to 1e-16.
            let bound = 1e-9 + 1e-16 / width;
            assert!(error(width, 3.0) < bound && error(width, 0.2) < bound, "{width}: {}", error(width, 3.0));
            assert!(width > 0.2 || error(1.0, 3.0) > 1e-5, "{width} {}", error(1.0, 3.0));
        }
        assert_eq!(integrate(&halving(0.5, 0.5, 0.1), |_| 1.0), 0.0);
    }

    #[test]
    fn a_graded_rule_tames_singular_ends() {
        let f = |x: f64| x.sqrt() * x.ln();
        let error = |rule: &[(f64, f64)]| (integrate(rule, f) + 4.0 / 9.0).abs();
        assert!(error(&graded(24, 0.0, 1.0)) < 1e-9);
        assert!(error(&gauss_legendre(24, 0.0, 1.0)) > 1e-6);
    }
}
