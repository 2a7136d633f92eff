//! How wrong a technique is: the scattered part of its picture under direct light, over the pixels in which an object is
//! seen, against the truth by paths.

use super::samples::{Sample, Subject};
use crate::image::Image;
use crate::metric::{Comparison, Pair};
use crate::problem::Problem;
use crate::reference::{Integrator, Settings, film::Film, volume::Light};
use crate::scene::{Part, Scene, Truth};
use std::sync::Arc;

/// The part in which techniques differ.
pub const PART: Part = Part::Scattered;

/// What the measures of an error are called before the `@`. `bias` keeps its sign: -0.02 is 2 % too dark. What ends with
/// `_se` is the standard error that the truth's own noise leaves in the measure before it.
pub const MEASURES: [&str; 7] = ["relmse", "relmse_se", "dssim", "flip_mean", "flip_p99", "bias", "bias_se"];

impl Truth {
    /// As in `relmse@volume`.
    pub fn word(self) -> &'static str {
        match self {
            Truth::Volume => "volume",
            Truth::Bssrdf => "bssrdf",
        }
    }

    /// In a sentence.
    pub fn title(self) -> &'static str {
        match self {
            Truth::Volume => "volumetric truth",
            Truth::Bssrdf => "diffusion truth",
        }
    }
}

/// A truth as it was traced.
pub struct Traced {
    pub truth: Truth,
    pub film: Arc<Film>,
    pub picture: Image,
    variance: Image,
    /// Pixels in which an object is seen.
    pub mask: Vec<bool>,
}

/// How to trace a truth of a scene as `view` looks at it.
pub fn settings(truth: Truth, scene: &Scene, view: &crate::frame::View) -> Settings {
    Settings {
        integrator: match truth {
            Truth::Volume => Integrator::Volume,
            Truth::Bssrdf => Integrator::Bssrdf,
        },
        light: Light::Direct,
        camera: view.camera,
        size: view.size,
        time_s: view.time_s,
        max_depth: scene.reference.max_depth,
        seed: scene.reference.seed,
        bands: (0, 1),
    }
}

impl Traced {
    /// Of a film of at least two samples per pixel.
    pub fn new(truth: Truth, film: Arc<Film>) -> Traced {
        let mask = film.pixels.iter().map(|pixel| pixel.is_object).collect();
        Traced { truth, picture: film.picture(PART), variance: film.variance(PART), mask, film }
    }

    fn pair<'a>(&'a self, picture: &'a Image) -> Result<Pair<'a>, Problem> {
        Pair::new(picture, &self.picture)?.masked(&self.mask)
    }

    /// The rows of a picture's errors, in the order of [`MEASURES`].
    pub fn errors(&self, subject: &Subject, picture: &Image) -> Result<Vec<Sample>, Problem> {
        let Comparison { relmse, dssim, flip, bias } = Comparison::of(&self.pair(picture)?, Some(&self.variance))?;
        let values = [
            relmse.errors.all.mean,
            relmse.standard_error.expect("a variance was given"),
            dssim.all.mean,
            flip.spread.mean,
            flip.spread.p99,
            bias.all,
            self.bias_error(bias.all),
        ];
        let sample = |(measure, value): (&str, f64)| Sample {
            subject: subject.clone(),
            measure: format!("{measure}@{}", self.truth.word()),
            unit: "1",
            repeat: 1,
            value,
        };
        Ok(MEASURES.into_iter().zip(values).map(sample).collect())
    }

    /// The standard error of a bias: that of the truth's mean, relative to it, times what the bias divides by it. A path
    /// brings light to all channels at once, so their noise is taken to go together; that of pixels does not.
    fn bias_error(&self, bias: f64) -> f64 {
        let counted = || (0..self.mask.len()).filter(|i| self.mask[*i]);
        let sum = |image: &Image, c: usize| counted().map(|i| f64::from(image.pixels[i][c])).sum::<f64>();
        let light: f64 = (0..3).map(|c| sum(&self.picture, c)).sum();
        let noise: f64 = (0..3).map(|c| sum(&self.variance, c).sqrt()).sum();
        if noise == 0.0 { 0.0 } else { (1.0 + bias).abs() * noise / light }
    }

    /// The relative error in every pixel, without what the truth's noise is taken off: a root of less than 0 is none.
    pub fn map(&self, picture: &Image) -> Result<Vec<f64>, Problem> {
        let errors = crate::metric::relmse(&self.pair(picture)?, None)?.errors;
        Ok(errors.per_pixel().into_iter().map(f64::sqrt).collect())
    }
}
