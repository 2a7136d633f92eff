use super::Answer;
use crate::image::{Display, Encoding, Format, Image, Tone, write_file};
use crate::metric::{Comparison, Errors, MEASURES, Measure, Pair, Spread, Unit, heat_map, mask, relmse};
use crate::problem::{At, Cause, Problem, Problems, nearest};
use crate::session::{Options, Session};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Say how far an image is from a reference: PNG or EXR
#[derive(clap::Args)]
pub struct Compare {
    /// The image that is judged
    #[arg(value_name = "A")]
    image: PathBuf,
    /// What it is to be: the reference
    #[arg(value_name = "B")]
    reference: PathBuf,
    /// The variance of each of B's pixels, which is taken off relMSE
    #[arg(long, value_name = "FILE")]
    variance: Option<PathBuf>,
    /// Let only the pixels count that are brighter than one half in this image
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
    /// Write a picture of the relative error in every pixel, with a scale: .png or .exr
    #[arg(long, value_name = "FILE")]
    heatmap: Option<PathBuf>,
    /// Fail with status 4 when a measure is larger: flip_mean=0.01. May stand several times; the measures are relmse,
    /// dssim, flip (their means), relmse_p99, dssim_p99, flip_p99 (their 99th percentiles) and bias (the worst channel)
    #[arg(long, value_name = "METRIC=VALUE", value_parser = parse_limit)]
    max: Vec<Limit>,
}

/// How large a measure may be.
#[derive(Clone, Copy)]
struct Limit {
    measure: Measure,
    most: f64,
}

/// `flip_p99=0.1`; case does not matter, and a mean may be named as such or not.
fn parse_limit(text: &str) -> Result<Limit, String> {
    let (name, value) = text.split_once('=').ok_or("there is no `=`; write METRIC=VALUE, as in flip_mean=0.01")?;
    let wanted = name.trim().to_lowercase();
    let means = |known: &str| known == wanted || known.trim_end_matches("_mean") == wanted.trim_end_matches("_mean");
    let known = MEASURES.map(|(known, _)| known);
    let measure = MEASURES.into_iter().find(|(known, _)| means(known)).ok_or_else(|| {
        match nearest(&wanted, known.into_iter().chain(["flip"])) {
            Some(near) => format!("there is no measure `{name}`; did you mean `{near}`?"),
            None => format!("there is no measure `{name}`; there are {}", known.join(", ")),
        }
    })?;
    let most: f64 = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    match most >= 0.0 && most.is_finite() {
        true => Ok(Limit { measure, most }),
        false => Err(format!("{value} is no limit of an error: write 0 or more")),
    }
}

impl Compare {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let heatmap = match self.heatmap.as_deref() {
            Some(file) => Some((file, Format::of(file)?)),
            None => None,
        };
        let session = Session::new(options);
        let mut warnings = Vec::new();
        let mut read = |file: &Path, encoding: Encoding| -> Result<Image, Problems> {
            let (texture, told) = session.reader.image(file, encoding)?;
            warnings.extend(told);
            Ok(texture.image())
        };
        let image = read(&self.image, Encoding::Srgb)?;
        let reference = read(&self.reference, Encoding::Srgb)?;
        let variance = self.variance.as_deref().map(|file| read(file, Encoding::Linear)).transpose()?;
        let white = self.mask.as_deref().map(|file| read(file, Encoding::Linear)).transpose()?;

        let at = |file: &Option<PathBuf>| At::file(file.as_deref().unwrap_or(&self.image));
        let mut pair = Pair::new(&image, &reference).map_err(|problem| problem.at(At::file(&self.image)))?;
        let counts = match &white {
            Some(white) => Some(mask(white, &image).map_err(|problem| problem.at(at(&self.mask)))?),
            None => None,
        };
        if let Some(counts) = &counts {
            pair = pair.masked(counts).map_err(|problem| problem.at(at(&self.mask)))?;
        }
        let found = Comparison::of(&pair, variance.as_ref()).map_err(|problem| problem.at(at(&self.variance)))?;

        let mut text =
            format!("{} against {}: {}\n", self.image.display(), self.reference.display(), extent(&pair, &image));
        text += &table(&found);
        let mut facts = facts(&found);
        facts["pixels"] = json!(pair.count());
        if let Some((file, format)) = heatmap {
            // Of the image as it is, noise and all: the root of a square less a variance may not exist.
            let error: Vec<f64> = relmse(&pair, None)?.errors.per_pixel().into_iter().map(f64::sqrt).collect();
            let map = heat_map(&error, image.width, image.height, counts.as_deref(), Unit::Percent);
            let display = Display { tone: Tone::Srgb, exposure_ev: 0.0 };
            write_file(file, &map.encode(format, display, &[("Software", "diaphane compare")])?)?;
            text += &format!("{}  relative error per pixel\n", file.display());
            facts["heatmap"] = json!(file.display().to_string());
        }
        let mut answer = Answer::new(text, facts).warn(warnings);
        answer.failures = self.max.iter().filter_map(|limit| limit.failure(&found)).collect();
        Ok(answer)
    }
}

impl Limit {
    fn failure(&self, found: &Comparison) -> Option<Problem> {
        let (name, value) = (self.measure.0, self.measure.1(found));
        let problem = || {
            Problem::new(Cause::Comparison, format!("{name} is {}, more than {}", number(value), self.most))
                .hint("--heatmap OUT.png shows where the images differ")
        };
        (value > self.most).then(problem)
    }
}

/// `640 x 480 pixels, of which 12345 count`
fn extent(pair: &Pair, image: &Image) -> String {
    let of = match pair.count() {
        all if all == image.pixels.len() => String::new(),
        some => format!(", of which {some} count"),
    };
    format!("{} x {} pixels{of}", image.width, image.height)
}

fn table(found: &Comparison) -> String {
    let row = |name: &str, values: &[f64]| {
        let values: String = values.iter().map(|value| format!(" {:>11}", number(*value))).collect();
        format!("{name:<22}{values}\n")
    };
    let mut text = format!("{:<22} {:>11} {:>11} {:>11} {:>11}\n", "", "all", "R", "G", "B");
    let mut rows = |name: &str, errors: &Errors| {
        for (what, of) in [("mean", (|s| s.mean) as fn(&Spread) -> f64), ("99 %", |s| s.p99)] {
            let values: Vec<f64> = std::iter::once(&errors.all).chain(&errors.channels).map(of).collect();
            text += &row(&format!("{name}, {what}"), &values);
        }
    };
    rows("relMSE", &found.relmse.errors);
    if let Some(noise) = &found.relmse.noise {
        rows("  taken off", noise);
    }
    rows("DSSIM", &found.dssim);
    text += &row("FLIP, mean", &[found.flip.spread.mean]);
    text += &row("FLIP, 99 %", &[found.flip.spread.p99]);
    text + &row("bias", &[&[found.bias.all], &found.bias.channels[..]].concat())
}

/// To four digits.
fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        a if (1e-3..1e4).contains(&a) => {
            let digits = (3 - a.log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.3e}"),
    }
}

fn facts(found: &Comparison) -> Value {
    // JSON knows no infinity, and what is infinite becomes null.
    let errors =
        |errors: &Errors| json!({ "mean": errors.all.mean, "p99": errors.all.p99, "channels": errors.channels });
    let mut facts = json!({
        "relmse": errors(&found.relmse.errors),
        "dssim": errors(&found.dssim),
        "flip": found.flip.spread,
        "bias": found.bias,
    });
    if let Some(noise) = &found.relmse.noise {
        facts["relmse"]["taken_off"] = errors(noise);
    }
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_and_numbers_have_four_digits() {
        let limit = |text: &str| parse_limit(text).map(|limit| (limit.measure.0, limit.most));
        assert_eq!(limit("relMSE=0.01"), Ok(("relmse", 0.01)));
        assert_eq!(limit("flip=1e-3"), Ok(("flip_mean", 1e-3)));
        assert_eq!(limit("dssim_mean = 0"), Ok(("dssim", 0.0)));
        assert_eq!(limit("FLIP_P99=1"), Ok(("flip_p99", 1.0)));
        assert!(limit("flop=1").unwrap_err().contains("did you mean `flip"));
        assert!(limit("error=1").unwrap_err().contains("there are relmse, relmse_p99"));
        for wrong in ["flip", "flip=", "flip=x", "flip=-1", "flip=NaN", "flip=inf"] {
            assert!(limit(wrong).is_err(), "{wrong}");
        }
        let numbers = [0.0, 1.0, 0.012345, -0.5, 123.456, 1e-9, 54321.0, f64::INFINITY].map(number);
        assert_eq!(numbers, ["0", "1.000", "0.01235", "-0.5000", "123.5", "1.000e-9", "5.432e4", "inf"]);
    }
}
