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
    Ok(RelMse { errors: relative(&error), noise: variance.map(|_| relative(&noise_of)) })
}
