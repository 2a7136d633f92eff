//! Structural dissimilarity, (1 - SSIM) / 2 [Wang2004, eq. 13]: 0 for equal images, 1/2 for unrelated ones, 1 for inverted
//! ones.
//!
//! Per channel, of values as displayed: sRGB-encoded, cut off to [0, 1], so that the dynamic range is L = 1. The constants
//! are the paper's: K1 = 0.01, K2 = 0.03, a Gaussian window of 11 x 11 with standard deviation 1.5 pixels. Pixels beyond
//! the image's border or the mask's weigh nothing, and the rest of the window is normalised to 1; so every pixel that
//! counts has a value, made of pixels that count alone. (The paper's own program leaves the border out.)

use super::{Errors, Pair, displayed};

const K1: f64 = 0.01;
const K2: f64 = 0.03;
const SIGMA: f64 = 1.5;
/// The window is 2 * 5 + 1 pixels wide.
const RADIUS: usize = 5;

/// (1 - SSIM) / 2 of every pixel.
pub fn dssim(pair: &Pair) -> Errors {
    let size = (pair.image.width as usize, pair.image.height as usize);
    let weight: Vec<f64> = (0..size.0 * size.1).map(|i| if pair.counts(i) { 1.0 } else { 0.0 }).collect();
    let total = blurred(&weight, size);
    let shown = |pixels: &[[f32; 3]]| pixels.iter().map(|pixel| displayed(*pixel)).collect::<Vec<_>>();
    let (x, y) = (shown(&pair.image.pixels), shown(&pair.reference.pixels));
    let channels: [Vec<f64>; 3] = std::array::from_fn(|c| {
        let value = |i: usize| (f64::from(x[i][c]), f64::from(y[i][c]));
        // The moments under the window around each pixel.
        let moment = |of: &dyn Fn((f64, f64)) -> f64| {
            let values: Vec<f64> = weight.iter().enumerate().map(|(i, w)| w * of(value(i))).collect();
            blurred(&values, size).into_iter().zip(&total).map(|(sum, total)| sum / total).collect::<Vec<_>>()
        };
        let (mean_x, mean_y) = (moment(&|(x, _)| x), moment(&|(_, y)| y));
        let (xx, yy, xy) = (moment(&|(x, _)| x * x), moment(&|(_, y)| y * y), moment(&|(x, y)| x * y));
        let (c1, c2) = (K1 * K1, K2 * K2);
        (0..weight.len())
            .map(|i| {
                let (mx, my) = (mean_x[i], mean_y[i]);
                let variances = (xx[i] - mx * mx) + (yy[i] - my * my);
                let covariance = xy[i] - mx * my;
                let ssim =
                    (2.0 * mx * my + c1) * (2.0 * covariance + c2) / ((mx * mx + my * my + c1) * (variances + c2));
                0.5 * (1.0 - ssim)
            })
            .collect()
    });
    let map = (0..weight.len()).map(|i| match pair.counts(i) {
        true => std::array::from_fn(|c| channels[c][i]),
        false => [0.0; 3],
    });
    Errors::of(pair, map.collect())
}

/// Sums under the window, along rows and then along columns; 0 beyond the border.
fn blurred(values: &[f64], (width, height): (usize, usize)) -> Vec<f64> {
    let gauss: Vec<f64> = (0..=RADIUS).map(|d| (-((d * d) as f64) / (2.0 * SIGMA * SIGMA)).exp()).collect();
    let along = |values: &[f64], length: usize, stride: usize| -> Vec<f64> {
        (0..values.len())
            .map(|i| {
                let at = i / stride % length;
                let from = at.saturating_sub(RADIUS);
                let to = (at + RADIUS).min(length - 1);
                (from..=to).map(|k| gauss[k.abs_diff(at)] * values[i + k * stride - at * stride]).sum()
            })
            .collect()
    };
    along(&along(values, width, 1), height, width)
}
