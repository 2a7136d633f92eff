//! Whether an image can be the truth that a noisy reference estimates.
//!
//! Each channel of each pixel gives z = (x - ref) / se, se being the reference's standard error there. When nothing but
//! noise differs, and that noise is normal and independent, all n of them are standard normal. Three questions are asked:
//!
//! - the largest |z|: is any pixel wrong? Among many, a large one is no wonder: its limit is Šidák's, at which n values
//!   exceed it with the asked probability; a mean may be right while one pixel is not;
//! - sqrt(n) mean(z), standard normal: is all of it a little too bright or too dark?
//! - sum(z²), chi-square with n degrees of freedom, made standard normal by Wilson and Hilferty's cube root: is it wrong
//!   now this way, now that, everywhere? Only too much of it counts; too little is a standard error that was too large.
//!
//! Together they refuse an image that is right with probability `significance` at most: each gets a third (Bonferroni).
//! Estimates from few samples have heavier tails than a normal distribution, and fail too often.

use super::{Pair, finite, same_size};
use crate::image::Image;
use crate::problem::Problem;

/// What was found, each with the limit that it is not to exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// How many values were judged: the channels of pixels with noise, or with a difference.
    pub count: usize,
    /// The largest |z|; infinite where a pixel without noise differs.
    pub largest: f64,
    pub largest_limit: f64,
    /// Where that is: x, y from the top left, and the channel.
    pub at: (u32, u32, usize),
    /// |sqrt(n) mean(z)|
    pub mean: f64,
    pub mean_limit: f64,
    /// sum(z²) as a standard normal value.
    pub square: f64,
    pub square_limit: f64,
}

impl ZTest {
    /// Whether noise alone explains all that differs.
    pub fn passes(&self) -> bool {
        self.largest <= self.largest_limit && self.mean <= self.mean_limit && self.square <= self.square_limit
    }
}

/// `standard_error` is that of the reference's pixels. `significance` in (0, 1): how often an image that is right may be
/// refused.
pub fn z_test(pair: &Pair, standard_error: &Image, significance: f64) -> Result<ZTest, Problem> {
    assert!(significance > 0.0 && significance < 1.0, "a significance of {significance}");
    same_size(standard_error, pair.reference, "the standard error", "the reference")?;
    finite(standard_error, "the standard error")?;
    let (mut count, mut sum, mut squares) = (0_usize, 0.0, 0.0);
    let (mut largest, mut at) = (0.0, (0, 0, 0));
    for i in pair.counted() {
        for c in 0..3 {
            let (x, reference) = pair.values(i, c);
            let se = f64::from(standard_error.pixels[i][c]);
            // Background, where nothing is estimated and nothing differs, says nothing.
            if se == 0.0 && x == reference {
                continue;
            }
            let z = (x - reference) / se;
            count += 1;
            sum += z;
            squares += z * z;
            if z.abs() > largest {
                let i = i as u32;
                (largest, at) = (z.abs(), (i % pair.image.width, i / pair.image.width, c));
            }
        }
    }
    let n = count.max(1) as f64;
    let each = significance / 3.0;
    // 1 - (1 - each)^(1/n), which is too small for a difference from 1.
    let sidak = -(f64::ln_1p(-each) / n).exp_m1();
    let third = 2.0 / (9.0 * n);
    Ok(ZTest {
        count,
        largest,
        largest_limit: quantile(sidak / 2.0),
        at,
        // What is infinite in one pixel is so in all sums.
        mean: if largest.is_finite() { (sum / n.sqrt()).abs() } else { f64::INFINITY },
        mean_limit: quantile(each / 2.0),
        square: if count == 0 { 0.0 } else { ((squares / n).cbrt() - (1.0 - third)) / third.sqrt() },
        square_limit: quantile(each),
    })
}

/// The z that a standard normal value exceeds with probability `p`, in (0, 1/2).
fn quantile(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if upper_tail(middle) > p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The probability that a standard normal value exceeds z >= 0, to about 12 digits relative.
fn upper_tail(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    if z < 3.0 {
        // 1/2 - density (z + z^3/3 + z^5/(3 5) + …)
        let (mut term, mut sum, mut k) = (z, z, 1.0);
        while term > 1e-18 * sum {
            k += 2.0;
            term *= z * z / k;
            sum += term;
        }
        0.5 - density * sum
    } else {
        // Laplace's continued fraction, from its far end.
        density / (1..=200).rev().fold(z, |rest, k| z + f64::from(k) / rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_has_its_known_values() {
        for (z, p) in
            [(0.0, 0.5), (1.0, 0.15865525393145705), (3.0, 0.0013498980316300946), (6.0, 9.865876450376946e-10)]
        {
            assert!((upper_tail(z) / p - 1.0).abs() < 1e-11, "{z}: {} {p}", upper_tail(z));
        }
        assert!((upper_tail(3.0 - 1e-12) / upper_tail(3.0) - 1.0).abs() < 1e-9, "the two ways meet");
        assert!((quantile(0.025) - 1.959963984540054).abs() < 1e-10);
        assert!((quantile(1e-12) - 7.034483).abs() < 1e-5);
    }
}
