//! Relative mean squared error, linear light: the mean over pixels and channels of
//!
//! ```text
//! (x - ref)^2 / (ref^2 + 0.01 m),   m = mean over pixels and channels of ref^2
//! ```
//!
//! The second term keeps dark pixels from deciding alone; since it follows the reference, a scene that is twice as bright
//! has the same error. Without a root, an error of 10 % everywhere is 0.01 or a little less.
//!
//! A reference with noise of its own adds its variance: E (x - ref)^2 = (x - truth)^2 + var(ref). Given that variance, it
//! is taken off again, pixel by pixel and without a cut at 0, so that the mean is right on average, as long as the noise is
//! small against what it is divided by: the floor keeps a share of that true.

use super::{Errors, Pair, finite, ratio, same_size};
use crate::image::Image;
use crate::problem::Problem;

/// The share of the mean square that joins a pixel's own.
const FLOOR: f64 = 0.01;

#[derive(Clone, Debug)]
pub struct RelMse {
    /// Less the reference's variance, when that was given. Infinite where the reference is black everywhere and the image
    /// is not.
    pub errors: Errors,
    /// What was taken off for the reference's variance, in the same measure.
    pub noise: Option<Errors>,
    /// The standard error of the mean that the reference's noise leaves in it: below about three of them, what is left
    /// cannot be told from none.
    pub standard_error: Option<f64>,
}

/// `variance` is that of each of the reference's pixels: its standard error squared, W²/(m² sr)² in each channel.
pub fn relmse(pair: &Pair, variance: Option<&Image>) -> Result<RelMse, Problem> {
    if let Some(variance) = variance {
        same_size(variance, pair.reference, "the variance", "the reference")?;
        finite(variance, "the variance")?;
        if let Some(i) = variance.pixels.iter().position(|pixel| pixel.iter().any(|v| *v < 0.0)) {
            let (x, y) = (i % variance.width as usize, i / variance.width as usize);
            return Err(Problem::files(format!("the variance is below 0 at x = {x}, y = {y} from the top left"))
                .hint("it is a square: name the image that was written as the reference's variance"));
        }
    }
    let squares = pair.counted().flat_map(|i| (0..3).map(move |c| pair.values(i, c).1.powi(2)));
    let floor = FLOOR * squares.sum::<f64>() / (3 * pair.count()) as f64;
    let relative = |square: &dyn Fn(usize, usize) -> f64| {
        let map = (0..pair.image.pixels.len()).map(|i| {
            std::array::from_fn(|c| match pair.counts(i) {
                true => ratio(square(i, c), pair.values(i, c).1.powi(2) + floor),
                false => 0.0,
            })
        });
        Errors::of(pair, map.collect())
    };
    let noise_of = |i: usize, c: usize| variance.map_or(0.0, |variance| variance.pixels[i][c].into());
    let error = |i: usize, c: usize| {
        let (x, reference) = pair.values(i, c);
        (x - reference).powi(2) - noise_of(i, c)
    };
    let standard_error = variance.map(|_| {
        let relative = |i: usize, c: usize| {
            let (x, reference) = pair.values(i, c);
            ratio(deviation(x - reference, noise_of(i, c)), reference.powi(2) + floor)
        };
        // A path brings light to all channels at once: their noise is taken to go together, that of pixels not.
        let squares = pair.counted().map(|i| (0..3).map(|c| relative(i, c)).sum::<f64>().powi(2));
        squares.sum::<f64>().sqrt() / (3 * pair.count()) as f64
    });
    Ok(RelMse { errors: relative(&error), noise: variance.map(|_| relative(&noise_of)), standard_error })
}

/// The standard deviation of (x - ref)^2, where `off` is x - ref and ref is normal with variance v about the truth t: its
/// square is 4 (x - t)^2 v + 2 v^2, and (x - t)^2 is off^2 - v on average, but never below 0.
fn deviation(off: f64, v: f64) -> f64 {
    (4.0 * (off * off - v).max(0.0) * v + 2.0 * v * v).sqrt()
}
