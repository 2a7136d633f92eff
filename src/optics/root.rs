//! Roots of monotone functions.

/// The x between `a` and `b` where `f` changes sign, to the last bits of x: Chandrupatla's bracketing method, which takes
/// an inverse quadratic step where that is safe and halves the bracket where it is not. f(a) and f(b) must not have the
/// same sign; a NaN from `f` comes back as NaN.
pub(super) fn bracketed_root(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    // `near` is the newest point, `far` holds the root between them, `old` is the point that was let go.
    let (mut far, mut near) = ((a, f(a)), (b, f(b)));
    let mut t = 0.5f64;
    loop {
        let best = if near.1.abs() < far.1.abs() { near } else { far };
        let tolerance = 2.0 * f64::EPSILON * best.0.abs() + f64::MIN_POSITIVE;
        let share = tolerance / (far.0 - near.0).abs();
        if best.1 == 0.0 || share > 0.5 {
            return best.0;
        }
        let x = near.0 + t.clamp(share, 1.0 - share) * (far.0 - near.0);
        let new = (x, f(x));
        if new.1.is_nan() {
            return f64::NAN;
        }
        let old = if new.1.signum() == near.1.signum() { near } else { std::mem::replace(&mut far, near) };
        near = new;

        let xi = (near.0 - far.0) / (old.0 - far.0);
        let phi = (near.1 - far.1) / (old.1 - far.1);
        t = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            near.1 / (far.1 - near.1) * old.1 / (far.1 - old.1)
                + (old.0 - near.0) / (far.0 - near.0) * near.1 / (old.1 - near.1) * far.1 / (old.1 - far.1)
        } else {
            0.5
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn roots_are_found_to_the_last_bits_with_few_evaluations() {
        type Case = (fn(f64) -> f64, f64, f64, f64);
        let cases: [Case; 5] = [
            (|x| x * x - 2.0, 0.0, 2.0, std::f64::consts::SQRT_2),
            (|x| x.powi(9) - 1e-9, 0.0, 1.0, 0.1),
            (|x| x - 1e-12, 0.0, 1.0, 1e-12),
            (|x| 1.0 - x, 0.0, 1.0, 1.0),
            (|x| -x, 0.0, 1.0, 0.0),
        ];
        for (f, a, b, root) in cases {
            let calls = Cell::new(0);
            let x = bracketed_root(
                |x| {
                    calls.set(calls.get() + 1);
                    f(x)
                },
                a,
                b,
            );
            assert!((x - root).abs() <= 4.0 * f64::EPSILON * root, "{x} is not {root}");
            assert!(calls.get() < 60, "{} evaluations", calls.get());
        }
        assert!(bracketed_root(|x| if x == 0.5 { f64::NAN } else { x - 0.4 }, 0.0, 1.0).is_nan());
    }
}
