//! FLIP for images of a low dynamic range [Andersson2020], by its authors' own program: a map in [0, 1] of the difference
//! that an eye sees when it alternates between two images on a display.
//!
//! The images go there as a display gets them: sRGB, cut off to [0, 1], rounded to 8 bits. So a difference of less than
//! half a level is none, and what is brighter than 1 is white.

use super::{Pair, Spread, displayed};
use nv_flip::FlipImageRgb8;

/// Pixels per degree of visual angle: a display 0.7 m wide with 3840 pixels, seen from 0.7 m [Andersson2020].
pub const PIXELS_PER_DEGREE: f32 = 67.0;

#[derive(Clone, Debug)]
pub struct Flip {
    pub spread: Spread,
    /// As the pixels lie in the images, [0, 1]; 0 where the mask is not.
    pub map: Vec<f64>,
}

/// At [`PIXELS_PER_DEGREE`].
pub fn flip(pair: &Pair) -> Flip {
    let (width, height) = (pair.image.width, pair.image.height);
    let levels = |pixel: [f32; 3]| displayed(pixel).map(|v| (255.0 * v).round() as u8);
    let reference: Vec<[u8; 3]> = pair.reference.pixels.iter().map(|pixel| levels(*pixel)).collect();
    // The eye's filters reach beyond the mask, where there shall be nothing to see.
    let image: Vec<[u8; 3]> = pair
        .image
        .pixels
        .iter()
        .enumerate()
        .map(|(i, pixel)| if pair.counts(i) { levels(*pixel) } else { reference[i] })
        .collect();
    let theirs = |levels: &[[u8; 3]]| FlipImageRgb8::with_data(width, height, levels.as_flattened());
    let map = nv_flip::flip(theirs(&reference), theirs(&image), PIXELS_PER_DEGREE).to_vec();
    let map: Vec<f64> = map.into_iter().enumerate().map(|(i, v)| if pair.counts(i) { v.into() } else { 0.0 }).collect();
    Flip { spread: Spread::of(pair.counted().map(|i| map[i])), map }
}
