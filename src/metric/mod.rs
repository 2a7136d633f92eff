//! How far an image is from a reference. Both are linear, of one size; all arithmetic is f64.
//!
//! | measure | what it is | its inputs | 0 means |
//! |---|---|---|---|
//! | [`relmse`] | squared error over squared radiance: what a renderer gets wrong | linear, unbounded | equal |
//! | [`dssim`] | (1 - SSIM) / 2: lost or invented structure [Wang2004] | as displayed, cut off at 1 | equal |
//! | [`flip`] | what an eye sees that alternates between the two [Andersson2020] | as displayed, 8 bits | no visible difference |
//! | [`bias`] | signed error of the mean: light that was lost or invented | linear, unbounded | equal energy |
//! | [`z_test`] | whether what differs can be the reference's own noise | linear, with its standard error | |
//!
//! *As displayed* is the sRGB transfer function of values cut off to [0, 1]; alpha is not looked at. A *mask* says which
//! pixels count, those in which an object is seen, say; without one all do. No measure is changed by what the image
//! holds where the mask is not. What is NaN or infinite is refused with the pixel's place, masked out or not.
//! [`heat_map`] makes a picture of an error per pixel.

mod bias;
mod digits;
mod dssim;
mod flip;
mod heat;
mod relmse;
#[cfg(test)]
mod tests;
mod z_test;

pub use bias::{Bias, bias};
pub use dssim::dssim;
pub use flip::{Flip, PIXELS_PER_DEGREE, flip};
pub use heat::{Unit, heat_map};
pub use relmse::{RelMse, relmse};
pub use z_test::{ZTest, z_test};

use crate::image::{Image, tone};
use crate::problem::Problem;
use serde::Serialize;

/// An image and its reference that can be compared: of one size, finite, with at least one pixel that counts.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    image: &'a Image,
    reference: &'a Image,
    mask: Option<&'a [bool]>,
}

impl<'a> Pair<'a> {
    /// Every pixel counts. Refused are images without pixels or of two sizes, and values that are no numbers.
    pub fn new(image: &'a Image, reference: &'a Image) -> Result<Pair<'a>, Problem> {
        same_size(image, reference, "the image", "the reference")?;
        if image.pixels.is_empty() {
            return Err(Problem::files("there is no pixel to compare").hint("name images that have some"));
        }
        finite(image, "the image")?;
        finite(reference, "the reference")?;
        Ok(Pair { image, reference, mask: None })
    }

    /// Only the pixels where `mask` is true count; one value per pixel, as they lie in the images.
    pub fn masked(self, mask: &'a [bool]) -> Result<Pair<'a>, Problem> {
        assert_eq!(mask.len(), self.image.pixels.len(), "a mask has as many pixels as the images");
        if !mask.contains(&true) {
            return Err(
                Problem::files("the mask leaves no pixel to compare").hint("white is what counts, black is not")
            );
        }
        Ok(Pair { mask: Some(mask), ..self })
    }

    /// How many pixels count.
    pub fn count(&self) -> usize {
        self.counted().count()
    }

    fn counts(&self, pixel: usize) -> bool {
        self.mask.is_none_or(|mask| mask[pixel])
    }

    /// The indices of the pixels that count, in reading order.
    fn counted(&self) -> impl Iterator<Item = usize> {
        (0..self.image.pixels.len()).filter(|&i| self.counts(i))
    }

    /// (x, ref) of a channel of a pixel.
    fn values(&self, pixel: usize, channel: usize) -> (f64, f64) {
        (self.image.pixels[pixel][channel].into(), self.reference.pixels[pixel][channel].into())
    }
}

/// The pixels of an image that count as a mask: brighter than one half. `other` is what it is to mask.
pub fn mask(image: &Image, other: &Image) -> Result<Vec<bool>, Problem> {
    same_size(image, other, "the mask", "the image")?;
    finite(image, "the mask")?;
    Ok(image.pixels.iter().map(|pixel| pixel.iter().sum::<f32>() > 1.5).collect())
}

fn same_size(a: &Image, b: &Image, first: &str, second: &str) -> Result<(), Problem> {
    if (a.width, a.height) == (b.width, b.height) {
        return Ok(());
    }
    let (a, b) = (format!("{} x {}", a.width, a.height), format!("{} x {}", b.width, b.height));
    Err(Problem::files(format!("{first} has {a} pixels, but {second} has {b}"))
        .hint("only images of one size are compared: render one of them again"))
}

fn finite(image: &Image, name: &str) -> Result<(), Problem> {
    let Some(bad) = image.non_finite() else { return Ok(()) };
    let what = format!(
        "{} pixel(s) of {name} are NaN or infinite, the first at x = {}, y = {} from the top left",
        bad.count, bad.first.0, bad.first.1
    );
    Err(Problem::files(what).hint("an error of it would be no number either: find out what made it"))
}

/// A colour as displayed, [0, 1].
fn displayed(rgb: [f32; 3]) -> [f32; 3] {
    rgb.map(|v| tone::srgb_from_linear(v.clamp(0.0, 1.0)))
}

/// `a / b`, where no error relative to nothing is none. Infinite where there is an error relative to nothing.
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// What is said of many values: how they are on the whole, and how bad the bad ones are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    pub mean: f64,
    /// The 99th percentile by nearest rank: the least value that at least 99 of 100 do not exceed.
    pub p99: f64,
}

impl Spread {
    /// Of at least one value, none of them NaN.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Spread {
        let mut values: Vec<f64> = values.into_iter().collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let rank = (0.99 * values.len() as f64).ceil() as usize;
        let (_, p99, _) = values.select_nth_unstable_by(rank - 1, f64::total_cmp);
        Spread { mean, p99: *p99 }
    }
}

/// An error in every pixel and channel, and what is said of them.
#[derive(Clone, Debug)]
pub struct Errors {
    /// Of the mean over the channels of each pixel.
    pub all: Spread,
    pub channels: [Spread; 3],
    /// As the pixels lie in the images; 0 where the mask is not.
    pub map: Vec<[f64; 3]>,
}

impl Errors {
    fn of(pair: &Pair, map: Vec<[f64; 3]>) -> Errors {
        Errors {
            all: Spread::of(pair.counted().map(|i| mean(map[i]))),
            channels: std::array::from_fn(|c| Spread::of(pair.counted().map(|i| map[i][c]))),
            map,
        }
    }

    /// The mean over the channels of each pixel.
    pub fn per_pixel(&self) -> Vec<f64> {
        self.map.iter().map(|errors| mean(*errors)).collect()
    }
}

fn mean(channels: [f64; 3]) -> f64 {
    channels.iter().sum::<f64>() / 3.0
}

/// All measures of one pair.
#[derive(Clone, Debug)]
pub struct Comparison {
    pub relmse: RelMse,
    pub dssim: Errors,
    pub flip: Flip,
    pub bias: Bias,
}

impl Comparison {
    /// `variance` as in [`relmse`].
    pub fn of(pair: &Pair, variance: Option<&Image>) -> Result<Comparison, Problem> {
        Ok(Comparison { relmse: relmse(pair, variance)?, dssim: dssim(pair), flip: flip(pair), bias: bias(pair) })
    }
}

/// The name of a measure, and its value.
pub type Measure = (&'static str, fn(&Comparison) -> f64);

/// The single numbers by which comparisons are judged; less is better for each.
pub const MEASURES: [Measure; 7] = [
    ("relmse", |c| c.relmse.errors.all.mean),
    ("relmse_p99", |c| c.relmse.errors.all.p99),
    ("dssim", |c| c.dssim.all.mean),
    ("dssim_p99", |c| c.dssim.all.p99),
    ("flip_mean", |c| c.flip.spread.mean),
    ("flip_p99", |c| c.flip.spread.p99),
    ("bias", |c| c.bias.largest()),
];
