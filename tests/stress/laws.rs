//! What has to hold between pictures, each with its bound and how it comes about.

use crate::booth::Shot;
use diaphane::image::Image;
use diaphane::reference::film::Film;
use diaphane::scene::Part;

/// Light that comes back from white surroundings, as a share of theirs. The sky is 256 directions for what is drawn, and
/// they know its irradiance on a plane to a hundredth.
const WHITE: f64 = 1.02;
/// The same of techniques that know the light less well. Two gather it by profiles, of which those of media that throw light
/// backwards (g of -0.99 and less) return up to 1.028 of what enters; one of them brings part of it from every fourth pixel to
/// all, and is most too bright near rims. One takes the sky for sixteen lamps.
const WHITE_IN_PIECES: [(&str, f64); 3] = [("ScreenSpace", 1.04), ("LongRange", 1.1), ("Layered(multiple", 1.06)];
/// Two pictures whose every operation differs by powers of two only, of the brightest number in them: nothing is rounded
/// otherwise, but for what a library's functions do.
const EXACTLY: f64 = 1e-5;
/// Of a picture's mean: by how much a pixel has to differ to count, which share of the pixels may, and how far the means
/// may be apart. Edges of shadows and of things fall to other pixels when everything is rounded otherwise, and some paths
/// go another way.
const NEARLY: (f64, f64, f64) = (5e-3, 0.04, 0.02);
/// Of a sum of pictures, of the brightest number in it: floats are added in another order.
const ADDED: f64 = 1e-5;
/// How many standard errors the mean of a traced picture may be away from where it belongs. Few paths with much light
/// make its error look smaller than it is.
const SIGMAS: f64 = 8.0;

/// No more light comes back than there is. A technique answers for the light that it scatters, a path for all.
pub fn no_more_than_white(shot: &Shot, technique: &str) -> Result<String, String> {
    match &shot.film {
        None => {
            let bound = WHITE_IN_PIECES.iter().find(|(name, _)| technique.starts_with(name)).map_or(WHITE, |b| b.1);
            let most = shot.image.pixels.iter().flatten().fold(0.0f64, |most, v| most.max((*v).into()));
            let told = format!("{most:.4} of the surroundings' radiance is scattered back at most");
            if most <= bound { Ok(told) } else { Err(format!("{told}, more than {bound}")) }
        }
        Some(film) => {
            let (mean, error) = mean_and_error(film);
            let told = format!("the mean is {mean:.4} ± {error:.4} of the surroundings' radiance");
            if mean <= 1.0 + SIGMAS * error + 1e-6 { Ok(told) } else { Err(told) }
        }
    }
}

/// A picture's mean over pixels and channels, and its standard error.
fn mean_and_error(film: &Film) -> (f64, f64) {
    let sum = |image: Image| image.pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    let count = 3.0 * film.pixels.len() as f64;
    // Channels of a pixel share their paths: added up as if they were one.
    (sum(film.picture(Part::Full)) / count, (3.0 * sum(film.variance(Part::Full))).sqrt() / count)
}

fn brightest(shot: &Shot) -> f64 {
    shot.image.pixels.iter().flatten().fold(0.0, |most, v| f64::from(*v).max(most))
}

fn mean(shot: &Shot) -> f64 {
    let pixels = &shot.image.pixels;
    pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * pixels.len()) as f64
}

/// The largest difference from what is expected at each pixel, and where.
fn most_apart(shot: &Shot, expected: impl Fn(usize, usize) -> f64) -> (f64, String) {
    let mut worst = (0.0, String::new());
    for (i, pixel) in shot.image.pixels.iter().enumerate() {
        for (c, value) in pixel.iter().enumerate() {
            let apart = (f64::from(*value) - expected(i, c)).abs();
            if apart > worst.0 {
                let (x, y) = (i % shot.image.width as usize, i / shot.image.width as usize);
                worst = (apart, format!("pixel {x}, {y} is {value:e} instead of {:e}", expected(i, c)));
            }
        }
    }
    worst
}

fn within(shot: &Shot, bound: f64, expected: impl Fn(usize, usize) -> f64) -> Result<String, String> {
    let (apart, place) = most_apart(shot, expected);
    let limit = bound * brightest(shot);
    if apart <= limit { Ok(format!("{apart:.1e} apart")) } else { Err(format!("{place}, farther than {limit:.1e}")) }
}

/// Every number times `factor`, a power of two.
pub fn times(shot: &Shot, factor: f64, other: &Shot) -> Result<String, String> {
    within(shot, EXACTLY, |i, c| factor * f64::from(other.image.pixels[i][c]))
}

pub fn nearly(shot: &Shot, other: &Shot) -> Result<String, String> {
    let (of_mean, share, means) = NEARLY;
    let (here, there) = (mean(shot), mean(other));
    let pairs = shot.image.pixels.iter().zip(&other.image.pixels);
    let differs = |(a, b): &(&[f32; 3], &[f32; 3])| (0..3).any(|c| f64::from((a[c] - b[c]).abs()) > of_mean * there);
    let apart = pairs.filter(differs).count() as f64 / shot.image.pixels.len() as f64;
    let told = format!("{:.1} % of the pixels differ, the means are {here:.4} and {there:.4}", 100.0 * apart);
    if apart <= share && (here - there).abs() <= means * there { Ok(told) } else { Err(told) }
}

/// Paths are the same whatever power the lamps have, so that traced pictures add up as drawn ones do.
pub fn sum(shot: &Shot, one: &Shot, other: &Shot) -> Result<String, String> {
    within(shot, ADDED, |i, c| f64::from(one.image.pixels[i][c]) + f64::from(other.image.pixels[i][c]))
}
