//! Gauss-Legendre rules as lists of (node, weight).

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
    fn a_graded_rule_tames_singular_ends() {
        let f = |x: f64| x.sqrt() * x.ln();
        let error = |rule: &[(f64, f64)]| (integrate(rule, f) + 4.0 / 9.0).abs();
        assert!(error(&graded(24, 0.0, 1.0)) < 1e-9);
        assert!(error(&gauss_legendre(24, 0.0, 1.0)) > 1e-6);
    }
}
