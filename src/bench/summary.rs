//! One line per contender, and sentences made of the numbers.

use super::samples::{Samples, Subject};
use super::statistics::Quartiles;
use crate::scene::Truth;
use serde::Serialize;

/// How far from a truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Error {
    /// Less the truth's own variance.
    pub relmse: f64,
    /// Its standard error, from the truth's noise.
    pub relmse_se: f64,
    pub dssim: f64,
    pub flip_mean: f64,
    pub flip_p99: f64,
    /// Signed: below 0 is too dark.
    pub bias: f64,
    pub bias_se: f64,
}

/// What is left after the noise was taken off means something from so many of its standard errors on.
pub const SURE: f64 = 3.0;

impl Error {
    fn of(samples: &Samples, subject: &Subject, truth: Truth) -> Option<Error> {
        let value = |measure: &str| samples.value(subject, &format!("{measure}@{}", truth.word()));
        Some(Error {
            relmse: value("relmse")?,
            relmse_se: value("relmse_se")?,
            dssim: value("dssim")?,
            flip_mean: value("flip_mean")?,
            flip_p99: value("flip_p99")?,
            bias: value("bias")?,
            bias_se: value("bias_se")?,
        })
    }

    /// What cannot be told from no error.
    pub fn noise(&self) -> f64 {
        SURE * self.relmse_se
    }

    pub fn is_noise(&self) -> bool {
        self.relmse < self.noise()
    }

    /// relMSE, or the most that it can be where it is lost in the noise.
    pub fn at_most(&self) -> f64 {
        self.relmse.max(self.noise())
    }

    /// `0.0123`, or `≤ noise`.
    pub fn words(&self) -> String {
        if self.is_noise() { format!("≤ noise ({})", number(self.noise())) } else { number(self.relmse) }
    }
}

/// All that there is to be said of a contender.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    pub technique: String,
    pub settings: String,
    #[serde(skip)]
    pub words: String,
    /// ms
    pub frame: Option<Quartiles>,
    /// ms
    pub bake: Option<f64>,
    /// bytes
    pub peak_memory: Option<f64>,
    #[serde(serialize_with = "by_truth")]
    pub errors: Vec<(Truth, Error)>,
    /// The median of each pass, ms; the longest first.
    pub passes: Vec<(String, f64)>,
    /// Likewise of each kind of edit.
    pub edits: Vec<(String, f64)>,
}

fn by_truth<S: serde::Serializer>(errors: &[(Truth, Error)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(errors.iter().map(|(truth, error)| (truth.word(), error)))
}

impl Line {
    pub fn of(samples: &Samples, subject: &Subject, truths: &[Truth]) -> Line {
        let error = |&truth: &Truth| Some((truth, Error::of(samples, subject, truth)?));
        let medians = |prefix: &str| {
            let median = |measure: &str| {
                let name = measure.strip_prefix(prefix)?;
                Some((name.to_string(), Quartiles::of(samples.values(subject, measure))?.median))
            };
            let mut found: Vec<_> = samples.measures(subject).into_iter().filter_map(median).collect();
            found.sort_by(|a, b| b.1.total_cmp(&a.1));
            found
        };
        Line {
            technique: subject.technique.clone(),
            settings: subject.settings.clone(),
            words: subject.words(),
            frame: Quartiles::of(samples.values(subject, "frame")),
            bake: samples.value(subject, "bake"),
            peak_memory: samples.value(subject, "peak_memory"),
            errors: truths.iter().filter_map(error).collect(),
            passes: medians("pass:"),
            edits: medians("edit:"),
        }
    }

    pub fn error(&self, truth: Truth) -> Option<&Error> {
        self.errors.iter().find(|(known, _)| *known == truth).map(|(_, error)| error)
    }

    /// Median time, ms, and relMSE against a truth, or its limit where noise hides it. Only what a logarithm can show.
    pub fn point(&self, truth: Truth) -> Option<(f64, f64)> {
        let point = (self.frame?.median, self.error(truth)?.at_most());
        (point.0 > 0.0 && point.1 > 0.0 && point.0.is_finite() && point.1.is_finite()).then_some(point)
    }
}

/// What the numbers say against a truth: who is nearest to it, and how much farther and slower or faster the others are.
/// How far is the root of relMSE, a relative difference.
pub fn sentences(lines: &[Line], truth: Truth) -> Vec<String> {
    let mut placed: Vec<(&Line, &Error)> = lines.iter().filter_map(|line| Some((line, line.error(truth)?))).collect();
    placed.sort_by(|(_, a), (_, b)| a.at_most().total_cmp(&b.at_most()));
    let Some(&(best, least)) = placed.first() else { return Vec::new() };
    let title = truth.title();
    let mut said = vec![match least.is_noise() {
        true => format!(
            "{} cannot be told from the {title}: what is left of its error lies within the truth's noise, a relative \
             difference of {}.",
            best.words,
            percent(least.noise().sqrt())
        ),
        false => format!(
            "{} is nearest to the {title}: a relative difference of {}{}.",
            best.words,
            percent(least.relmse.sqrt()),
            brightness(least)
        ),
    }];
    for (line, error) in &placed[1..] {
        if error.is_noise() {
            said.push(format!("{} cannot be told from the {title} either.", line.words));
            continue;
        }
        // Against what is lost in the noise only a least ratio is known.
        let least_word = if least.is_noise() { "at least " } else { "" };
        let far = (error.relmse / least.at_most()).sqrt();
        let time = match (line.frame, best.frame) {
            (Some(own), Some(other)) => format!(", at {} × the time", ratio(own.median / other.median)),
            _ => String::new(),
        };
        let how = match ratio(far).as_str() {
            "1.0" => format!("as far from the {title} as"),
            far => format!("{least_word}{far} × as far from the {title} as"),
        };
        said.push(format!("{} is {how} {}{time}{}.", line.words, best.words, brightness(error)));
    }
    said
}

/// `; 12 % too dark on the whole`, where that is sure.
fn brightness(error: &Error) -> String {
    if !error.bias.is_finite() || error.bias.abs() < (SURE * error.bias_se).max(0.005) {
        return String::new();
    }
    let word = if error.bias < 0.0 { "dark" } else { "bright" };
    format!("; on the whole {} too {word}", percent(error.bias.abs()))
}

fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if value < 9.95 { format!("{value:.1} %") } else { format!("{value:.0} %") }
}

fn ratio(value: f64) -> String {
    if value < 9.95 { format!("{value:.1}") } else { format!("{value:.0}") }
}

/// To three digits.
pub fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        a if (1e-3..1e5).contains(&a) => {
            let digits = (2 - a.log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.2e}"),
    }
}

/// `12.3 MB`
pub fn bytes(value: f64) -> String {
    format!("{} MB", number(value / 1e6))
}

/// `3.2 ms`, or with its quartiles `3.2 ms (3.1 to 3.4)`.
pub fn milliseconds(time: &Quartiles) -> String {
    match time.count {
        1 => format!("{} ms", number(time.median)),
        _ => format!("{} ms ({} to {})", number(time.median), number(time.low), number(time.high)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::samples;
    use super::*;

    #[test]
    fn sentences_say_what_the_numbers_do() {
        let (_, lines) = samples(&[("A", 10.0, 0.04, 1e-4), ("B", 20.0, 0.01, 1e-4), ("C", 5.0, 0.0101, 1e-4)]);
        assert!(lines[0].error(Truth::Bssrdf).is_none() && sentences(&lines, Truth::Bssrdf).is_empty());
        assert_eq!(
            sentences(&lines, Truth::Volume),
            [
                "B() is nearest to the volumetric truth: a relative difference of 10 %; on the whole 12 % too dark.",
                "C() is as far from the volumetric truth as B(), at 0.2 × the time; on the whole 12 % too dark.",
                "A() is 2.0 × as far from the volumetric truth as B(), at 0.5 × the time; on the whole 12 % too dark.",
            ]
        );
    }

    #[test]
    fn what_noise_hides_is_said_to_be_hidden() {
        let (_, lines) = samples(&[("A", 10.0, 0.04, 1e-3), ("B", 20.0, 2e-3, 1e-3), ("C", 20.0, -1e-3, 2e-3)]);
        assert_eq!(lines[1].error(Truth::Volume).unwrap().words(), "≤ noise (0.00300)");
        assert_eq!(lines[0].error(Truth::Volume).unwrap().words(), "0.0400");
        let said = sentences(&lines, Truth::Volume);
        assert!(said[0].starts_with("B() cannot be told from the volumetric truth"), "{said:?}");
        assert!(said[1].starts_with("C() cannot") && said[1].ends_with("either."), "{said:?}");
        assert!(said[2].starts_with("A() is at least 3.7 × as far"), "{said:?}");
        assert_eq!(lines[2].point(Truth::Volume).unwrap().1, 6e-3);
    }
}
