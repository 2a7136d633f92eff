//! An error per pixel as a picture with a scale that has numbers.
//!
//! The colours are a spiral through Oklab [Ottosson2020]: lightness rises evenly from black to white, so that the order is
//! seen without the scale and in print, while hue turns from violet through red and orange to yellow and tells levels
//! apart. Chroma is as high as sRGB allows along this path. Grey is no colour of it but at its ends, and stands for pixels
//! that do not count.

use super::Spread;
use super::digits::{self, ADVANCE, HEIGHT};
use crate::image::Image;

/// How the numbers of a scale are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// As they are.
    Plain,
    /// Shares of one, written in per cent.
    Percent,
}

/// Lightness of what is not the map: pixels that do not count, and the ground of the scale.
const GROUND: f64 = 0.35;

/// `values`, one per pixel and none NaN, on the left; the scale on the right. It begins at 0, below which nothing is told
/// apart, and ends at the round number next above the 99th percentile, so that a few wild pixels do not darken all
/// others; a `+` at the end says that there are some above it. Linear, to be shown by the sRGB curve.
pub fn heat_map(values: &[f64], width: u32, height: u32, mask: Option<&[bool]>, unit: Unit) -> Image {
    assert_eq!(values.len(), width as usize * height as usize, "a value per pixel");
    let counts = |i: usize| mask.is_none_or(|mask| mask[i]);
    let counted = || (0..values.len()).filter(|i| counts(*i)).map(|i| values[i]);
    let factor = if unit == Unit::Percent { 100.0 } else { 1.0 };
    let (top, divisions) = round_above(factor * Spread::of(counted()).p99);
    let more = counted().any(|v| factor * v > top);
    let labels: Vec<String> = (0..=divisions)
        .map(|k| {
            let number = label(top * f64::from(k) / f64::from(divisions));
            let unit = if unit == Unit::Percent { "%" } else { "" };
            number + unit + if k == divisions && more { "+" } else { "" }
        })
        .collect();

    // Figures grow with the picture, and a small one leaves the scale room below.
    let size = (height / 400).max(1);
    let longest = labels.iter().map(|label| label.len() as u32).max().unwrap_or(0);
    let (gap, bar) = (4 * size, 10 * size);
    let canvas = (width + gap + bar + gap + ADVANCE * size * longest + gap, height.max(70 * size));
    let mut image = Image::filled(canvas.0, canvas.1, colour(GROUND, 0.0));
    for (i, value) in values.iter().enumerate().filter(|(i, _)| counts(*i)) {
        let (x, y) = (i as u32 % width, i as u32 / width);
        image.pixels[(y * canvas.0 + x) as usize] = heat((factor * value / top).clamp(0.0, 1.0));
    }
    let (left, margin) = (width + gap, HEIGHT * size);
    let length = canvas.1 - 2 * margin;
    for row in 0..length {
        let share = 1.0 - f64::from(row) / f64::from(length - 1);
        let start = ((margin + row) * canvas.0 + left) as usize;
        image.pixels[start..start + bar as usize].fill(heat(share));
    }
    for (k, label) in labels.iter().enumerate() {
        let share = 1.0 - k as f64 / f64::from(divisions);
        let middle = margin + (share * f64::from(length - 1)).round() as u32;
        digits::write(&mut image, label, (left + bar + gap, middle - HEIGHT * size / 2), size, [1.0; 3]);
    }
    image
}

/// The least of 1, 2, 5, 10, … times a power of ten that is not below `value`, and into how many parts it is divided. Of
/// what has no such number, 1.
fn round_above(value: f64) -> (f64, u32) {
    if !(value > 1e-12 && value.is_finite()) {
        return (1.0, 5);
    }
    let exponent = value.log10().floor() as i32;
    let steps = [(1.0, 5), (2.0, 4), (5.0, 5), (10.0, 5)];
    // Divided by a whole power of ten, 0.2 is the same number that is written so.
    let scaled = |step: f64| if exponent < 0 { step / 10f64.powi(-exponent) } else { step * 10f64.powi(exponent) };
    let found = steps.map(|(step, parts)| (scaled(step), parts)).into_iter().find(|(top, _)| *top >= value);
    found.expect("ten times a number's own power of ten is above it")
}

/// `0`, `0.25`, `40`, `2e-5`
fn label(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e5).contains(&value) {
        return format!("{value:.0e}");
    }
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// The colour of a share of the scale, [0, 1].
fn heat(share: f64) -> [f32; 3] {
    colour(share, 0.16 * (std::f64::consts::PI * share).sin())
}

/// Linear Rec.709 of a lightness and a chroma on the spiral [Ottosson2020].
fn colour(lightness: f64, chroma: f64) -> [f32; 3] {
    let hue = (285.0 + 185.0 * lightness).to_radians();
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let l = (lightness + 0.3963377774 * a + 0.2158037573 * b).powi(3);
    let m = (lightness - 0.1055613458 * a - 0.0638541728 * b).powi(3);
    let s = (lightness - 0.0894841775 * a - 1.2914855480 * b).powi(3);
    [
        4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
        -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
        -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s,
    ]
    .map(|v| v as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_stay_on_the_display_and_brighten_evenly() {
        let mut last = -1.0;
        for k in 0..=1000 {
            let rgb = heat(f64::from(k) / 1000.0);
            assert!(rgb.iter().all(|v| (-1e-3..=1.001).contains(v)), "{k}: {rgb:?}");
            let luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
            assert!(luminance > last, "{k}");
            last = luminance;
        }
        assert!(heat(0.0) == [0.0; 3] && heat(1.0).iter().all(|v| (v - 1.0).abs() < 1e-3));
    }

    #[test]
    fn scales_end_at_round_numbers() {
        for (value, top, parts) in [
            (0.0, 1.0, 5),
            (0.2, 0.2, 4),
            (0.21, 0.5, 5),
            (7.0, 10.0, 5),
            (1.0, 1.0, 5),
            (1.1e-5, 2e-5, 4),
            (130.0, 200.0, 4),
        ] {
            assert_eq!(round_above(value), (top, parts), "{value}");
        }
        assert_eq!(round_above(f64::INFINITY), (1.0, 5));
        assert_eq!([0.0, 0.25, 40.0, 2e-5, 0.004, 2e7].map(label), ["0", "0.25", "40", "2e-5", "0.004", "2e7"]);
    }

    #[test]
    fn the_map_holds_every_pixel_and_the_scale_its_numbers() {
        let values: Vec<f64> = (0..100 * 80).map(|i| f64::from(i % 100) * 0.002).collect();
        let mut mask = vec![true; values.len()];
        mask[0] = false;
        let map = heat_map(&values, 100, 80, Some(&mask), Unit::Percent);
        assert_eq!(map.at(0, 0), colour(GROUND, 0.0));
        assert_eq!(map.at(50, 70), heat(0.5));
        // From 0 % to 20 %, in four parts.
        assert_eq!((map.width, map.height), (100 + 12 + 10 + 18, 80));
        assert_eq!((map.at(105, 7), map.at(105, 72)), (heat(1.0), heat(0.0)));
        let written = |y: u32| (118..map.width).filter(|x| map.at(*x, y) == [1.0; 3]).count();
        assert!([4, 20, 37, 53, 69].iter().all(|y| (0..7).map(|dy| written(y + dy)).sum::<usize>() > 15));
        assert_eq!(written(14), 0);
        // One wild pixel changes the scale's last label and nothing else.
        let mut wild = values.clone();
        wild[5] = f64::INFINITY;
        let other = heat_map(&wild, 100, 80, None, Unit::Percent);
        assert_eq!((other.width, other.at(5, 0)), (map.width + 6, heat(1.0)));
        assert_eq!(other.at(6, 0), map.at(6, 0));
        assert_eq!(heat_map(&[0.0], 1, 1, None, Unit::Plain).height, 70);
    }
}
