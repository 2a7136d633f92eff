//! What samples add up to: mean and variance of every pixel, by part.

use super::kin::SIDE;
use super::path::Parts;
use crate::image::Image;
use crate::optics::Rgb;
use crate::problem::counted;
use crate::scene::Part;
use serde::{Deserialize, Serialize};

/// The parts and their sum, in the order of [`place`].
const PARTS: usize = 4;

fn place(part: Part) -> usize {
    match part {
        Part::Scattered => 0,
        Part::Glossy => 1,
        Part::Unscattered => 2,
        Part::Full => 3,
    }
}

/// Some rows of a picture after some samples. Kept as f32, rounded after each doubling of the samples, so that a run that
/// was interrupted and resumed has the same bits as one that was not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Film {
    pub width: u32,
    pub height: u32,
    /// The bands of [`SIDE`] rows that are here: `first`, `first + step`, …
    pub first: u32,
    pub step: u32,
    /// Per pixel.
    pub samples: u64,
    pub pixels: Vec<Pixel>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pixel {
    mean: [[f32; 3]; PARTS],
    /// The sum of squared differences from the mean.
    spread: [[f32; 3]; PARTS],
    /// Whether any sample met an object.
    pub is_object: bool,
}

/// How far a film is from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Per pixel.
    pub samples: u64,
    /// See [`Film::relative_standard_error`].
    pub error: f64,
}

impl Level {
    /// Whether the error is known, and at most this.
    pub fn reaches(&self, max_error: f64) -> bool {
        self.samples > 1 && self.error <= max_error
    }
}

impl std::fmt::Display for Level {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} per pixel", counted(self.samples as usize, "sample"))?;
        match self.error.is_finite() {
            true => write!(f, ", relative standard error {:.4}", self.error),
            false => Ok(()),
        }
    }
}

/// Welford's running moments, f64.
#[derive(Clone, Copy, Default)]
pub struct Moments {
    count: f64,
    mean: [Rgb; PARTS],
    spread: [Rgb; PARTS],
    is_object: bool,
}

impl Moments {
    pub fn add(&mut self, parts: &Parts, is_object: bool) {
        let total = parts.scattered + parts.glossy + parts.unscattered;
        self.count += 1.0;
        self.is_object |= is_object;
        for (i, value) in [parts.scattered, parts.glossy, parts.unscattered, total].into_iter().enumerate() {
            let off = value - self.mean[i];
            self.mean[i] += off / self.count;
            self.spread[i] += off * (value - self.mean[i]);
        }
    }

    /// With those of `count` earlier samples.
    pub fn pixel(&self, earlier: Option<(&Pixel, u64)>) -> Pixel {
        let mut pixel = Pixel { is_object: self.is_object, ..Pixel::default() };
        for i in 0..PARTS {
            let (mut mean, mut spread) = (self.mean[i], self.spread[i]);
            if let Some((before, count)) = earlier {
                let count = count as f64;
                let (old, old_spread) = (rgb(before.mean[i]), rgb(before.spread[i]));
                let (all, off) = (count + self.count, mean - old);
                spread += old_spread + off * off * (count * self.count / all);
                mean = old + off * (self.count / all);
                pixel.is_object |= before.is_object;
            }
            (pixel.mean[i], pixel.spread[i]) = (mean.as_vec3().to_array(), spread.as_vec3().to_array());
        }
        pixel
    }
}

/// The rows of every `step`-th band from the `first` on: the tiles of a picture.
pub fn rows((first, step): (u32, u32), height: u32) -> impl Iterator<Item = u32> {
    let bands = (first..height.div_ceil(SIDE)).step_by(step as usize);
    bands.flat_map(move |band| band * SIDE..height.min((band + 1) * SIDE))
}

fn rgb(value: [f32; 3]) -> Rgb {
    glam::Vec3::from(value).as_dvec3()
}

impl Film {
    /// Black, after so many samples.
    pub fn new((width, height): (u32, u32), (first, step): (u32, u32), samples: u64) -> Film {
        let mut film = Film { width, height, first, step, samples, pixels: Vec::new() };
        film.pixels = vec![Pixel::default(); film.rows().count() * width as usize];
        film
    }

    /// The rows that are here.
    pub fn rows(&self) -> impl Iterator<Item = u32> + use<> {
        rows((self.first, self.step), self.height)
    }

    fn image(&self, value: impl Fn(&Pixel) -> [f32; 3]) -> Image {
        let mut image = Image::filled(self.width, self.height, [0.0; 3]);
        for (y, row) in self.rows().zip(self.pixels.chunks(self.width as usize)) {
            let start = (y * self.width) as usize;
            image.pixels[start..start + row.len()].iter_mut().zip(row).for_each(|(to, pixel)| *to = value(pixel));
        }
        image
    }

    /// The mean of the samples; rows that are not here are black.
    pub fn picture(&self, part: Part) -> Image {
        self.image(|pixel| pixel.mean[place(part)])
    }

    /// The variance of that mean: the square of its standard error. Infinite after one sample.
    pub fn variance(&self, part: Part) -> Image {
        let n = self.samples as f64;
        self.image(|pixel| pixel.spread[place(part)].map(|spread| (spread as f64 / (n * (n - 1.0))) as f32))
    }

    /// sqrt(mean over object pixels and channels of se² / (x² + 0.01 mean(x²))); infinite after one sample, 0 where no
    /// object is seen or nothing shines.
    pub fn relative_standard_error(&self, part: Part) -> f64 {
        let n = self.samples as f64;
        let values = || self.pixels.iter().filter(|pixel| pixel.is_object);
        let count = 3.0 * values().count() as f64;
        let square = |pixel: &Pixel| rgb(pixel.mean[place(part)]).length_squared();
        let floor = 0.01 * values().map(square).sum::<f64>() / count;
        if count == 0.0 || floor == 0.0 {
            return 0.0;
        }
        if self.samples < 2 {
            return f64::INFINITY;
        }
        let sum: f64 = values()
            .map(|pixel| {
                let (mean, spread) = (rgb(pixel.mean[place(part)]), rgb(pixel.spread[place(part)]));
                (spread / (n * (n - 1.0)) / (mean * mean + floor)).element_sum()
            })
            .sum();
        (sum / count).sqrt()
    }

    pub fn level(&self, part: Part) -> Level {
        Level { samples: self.samples, error: self.relative_standard_error(part) }
    }

    /// One film from films of other rows of the same picture. The error names what does not fit.
    pub fn merged(films: &[Film]) -> Result<Film, String> {
        let first = films.first().ok_or("there is nothing to merge")?;
        let mut rows: Vec<Option<&[Pixel]>> = vec![None; first.height as usize];
        for film in films {
            if (film.width, film.height, film.samples) != (first.width, first.height, first.samples) {
                return Err(format!(
                    "one is {} x {} with {} samples a pixel, another {} x {} with {}",
                    first.width, first.height, first.samples, film.width, film.height, film.samples
                ));
            }
            for (y, row) in film.rows().zip(film.pixels.chunks(film.width as usize)) {
                if rows[y as usize].replace(row).is_some() {
                    return Err(format!("row {y} is there twice"));
                }
            }
        }
        let all: Option<Vec<&[Pixel]>> = rows.iter().copied().collect();
        let all = all.ok_or_else(|| {
            let missing = rows.iter().position(Option::is_none).unwrap_or(0);
            format!("row {missing} is missing")
        })?;
        Ok(Film { first: 0, step: 1, pixels: all.concat(), ..*first })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(value: f64) -> Parts {
        Parts { scattered: Rgb::splat(value), glossy: Rgb::splat(1.0), unscattered: Rgb::ZERO }
    }

    #[test]
    fn samples_in_two_batches_are_samples_in_one() {
        let values = [1.0, 4.0, 2.0, 8.0, 5.0, 7.0];
        let of = |values: &[f64]| {
            let mut moments = Moments::default();
            values.iter().for_each(|v| moments.add(&parts(*v), true));
            moments
        };
        let film = |pixel| Film { width: 1, height: 1, first: 0, step: 1, samples: 6, pixels: vec![pixel] };
        let whole = film(of(&values).pixel(None));
        let half = of(&values[..2]).pixel(None);
        let both = film(of(&values[2..]).pixel(Some((&half, 2))));
        for part in [Part::Scattered, Part::Full] {
            let (a, b) = (whole.variance(part).pixels[0][0], both.variance(part).pixels[0][0]);
            assert!((a / b - 1.0).abs() < 1e-6 && a > 0.0);
        }
        let mean = values.iter().sum::<f64>() / 6.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 30.0;
        assert!((whole.picture(Part::Scattered).pixels[0][1] as f64 - mean).abs() < 1e-6);
        assert!((whole.variance(Part::Full).pixels[0][1] as f64 - variance).abs() < 1e-6);
        let expected = (variance / (1.01 * mean * mean)).sqrt();
        assert!((whole.relative_standard_error(Part::Scattered) / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn tiles_merge_into_the_whole_and_say_what_is_missing() {
        let pixel = |v: f32| Pixel { mean: [[v; 3]; PARTS], ..Pixel::default() };
        let tile = |first: u32| {
            let mut film = Film::new((1, 3 * SIDE - 1), (first, 2), 4);
            film.pixels = film.rows().map(|y| pixel(y as f32)).collect();
            film
        };
        let whole = Film::merged(&[tile(1), tile(0)]).unwrap();
        let rows: Vec<[f32; 3]> = (0..3 * SIDE - 1).map(|y| [y as f32; 3]).collect();
        assert_eq!(whole.picture(Part::Full).pixels, rows);
        assert!(Film::merged(&[tile(0)]).unwrap_err().contains(&format!("row {SIDE} is missing")));
        assert!(Film::merged(&[tile(0), tile(0)]).unwrap_err().contains("twice"));
        assert!(Film::merged(&[tile(0), Film { samples: 8, ..tile(1) }]).unwrap_err().contains("samples"));
    }
}
