//! What became slower or wronger since an earlier run, beyond what chance does.
//!
//! A time has become longer when the quartiles of the two runs do not meet, the medians lie further apart than one and a half
//! times the wider of the two spreads, and by more than a twentieth. What was measured fewer than three times has no spread:
//! it has to take twice as long. An error has grown when it did so by more than three standard errors of the truth's noise;
//! measures without one, when they grew by a twentieth and a thousandth.

use super::samples::{Samples, Subject};
use super::statistics::Quartiles;
use super::summary::{SURE, number};

/// Something that got worse.
#[derive(Clone, Debug, PartialEq)]
pub struct Worse {
    pub subject: Subject,
    pub measure: String,
    pub before: f64,
    pub now: f64,
}

impl Worse {
    pub fn words(&self) -> String {
        let Worse { subject, measure, before, now } = self;
        let (before, now) = (number(*before), number(*now));
        let place = format!("{}, {}, {}", subject.scene, subject.words(), subject.size);
        match is_time(measure) {
            true => format!("{place}: {measure} takes {now} ms, and took {before} ms"),
            false => format!("{place}: {measure} is {now}, and was {before}"),
        }
    }
}

const WIDER: f64 = 1.5;
const SHARE: f64 = 0.05;
const FEW: usize = 3;
const FEW_FACTOR: f64 = 2.0;
/// Of DSSIM and FLIP: a tenth of what can be seen.
const UNSEEN: f64 = 1e-3;
/// Of a bias: what different drivers may round.
const ROUNDING: f64 = 1e-4;

fn is_time(measure: &str) -> bool {
    measure == "frame" || measure == "bake" || measure.starts_with("pass:") || measure.starts_with("edit:")
}

/// What both hold and the second has worse. Times only where they can be held against each other.
pub fn worse(before: &Samples, now: &Samples, times_too: bool) -> Vec<Worse> {
    let mut found = Vec::new();
    for subject in now.subjects() {
        for measure in now.measures(subject) {
            let of = |samples: &Samples| Quartiles::of(samples.values(subject, measure));
            let (Some(old), Some(new)) = (of(before), of(now)) else { continue };
            // Of `relmse@volume` it is `relmse_se@volume`.
            let noise = || {
                let name = measure.replacen('@', "_se@", 1);
                let value = |samples: &Samples| samples.value(subject, &name).unwrap_or(0.0);
                SURE * value(before).hypot(value(now))
            };
            let grew = new.median - old.median;
            let is_worse = match measure.split('@').next().unwrap_or_default() {
                _ if is_time(measure) => times_too && is_slower(&old, &new),
                "relmse" => grew > noise().max(1e-3 * old.median),
                "bias" => new.median.abs() - old.median.abs() > noise().max(ROUNDING),
                "dssim" | "flip_mean" | "flip_p99" => grew > (SHARE * old.median).max(UNSEEN),
                _ => false,
            };
            if is_worse {
                let (before, now) = (old.median, new.median);
                found.push(Worse { subject: subject.clone(), measure: measure.to_string(), before, now });
            }
        }
    }
    found
}

fn is_slower(old: &Quartiles, new: &Quartiles) -> bool {
    if old.count.min(new.count) < FEW {
        return new.median > FEW_FACTOR * old.median;
    }
    let spread = old.spread().max(new.spread());
    new.low > old.high && new.median - old.median > (WIDER * spread).max(SHARE * old.median)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{samples, subject};
    use super::*;

    fn measures(found: &[Worse]) -> Vec<(&str, &str)> {
        found.iter().map(|worse| (worse.subject.technique.as_str(), worse.measure.as_str())).collect()
    }

    #[test]
    fn what_got_slower_is_told_and_what_only_trembles_is_not() {
        let (before, _) = samples(&[("A", 10.0, 0.04, 1e-3), ("B", 10.0, 0.04, 1e-3)]);
        assert_eq!(worse(&before, &before, true), []);
        let (trembling, _) = samples(&[("A", 10.3, 0.04, 1e-3), ("B", 9.0, 0.04, 1e-3)]);
        assert_eq!(worse(&before, &trembling, true), []);
        let (slow, _) = samples(&[("A", 12.0, 0.04, 1e-3), ("B", 10.0, 0.04, 1e-3)]);
        let found = worse(&before, &slow, true);
        assert_eq!(measures(&found), [("A", "frame"), ("A", "pass:a")]);
        assert_eq!(found[0].words(), "ball, A(), 32x32: frame takes 12.0 ms, and took 10.0 ms");
        assert_eq!(worse(&before, &slow, false), [], "times of another machine");
        // The bake was measured once.
        let (mut longer, _) = samples(&[("A", 10.0, 0.04, 1e-3)]);
        let bake = longer.0.iter_mut().find(|sample| sample.measure == "bake").unwrap();
        bake.value = 9.0;
        assert_eq!(worse(&before, &longer, true), []);
        longer.0.iter_mut().filter(|sample| sample.measure == "bake").for_each(|sample| sample.value = 11.0);
        assert_eq!(measures(&worse(&before, &longer, true)), [("A", "bake")]);
    }

    #[test]
    fn what_got_wronger_is_told_beyond_the_noise() {
        let (before, _) = samples(&[("A", 10.0, 0.04, 1e-3)]);
        let (within, _) = samples(&[("A", 10.0, 0.044, 1e-3)]);
        assert_eq!(worse(&before, &within, true), []);
        let (beyond, _) = samples(&[("A", 10.0, 0.045, 1e-3)]);
        assert_eq!(measures(&worse(&before, &beyond, true)), [("A", "relmse@volume")]);
        let changed = |measure: &str, value: f64| {
            let mut samples = before.clone();
            samples.0.iter_mut().filter(|sample| sample.measure == measure).for_each(|sample| sample.value = value);
            measures(&worse(&before, &samples, true)).into_iter().map(|(_, m)| m.to_string()).collect::<Vec<_>>()
        };
        assert_eq!(changed("bias@volume", 0.2), ["bias@volume"], "too bright is no better than too dark");
        assert_eq!(changed("bias@volume", -0.14), [""; 0]);
        assert_eq!(changed("flip_mean@volume", 0.11), ["flip_mean@volume"]);
        assert_eq!(changed("dssim@volume", 0.09), [""; 0]);
    }

    #[test]
    fn what_only_one_of_the_runs_holds_is_no_news() {
        let (before, _) = samples(&[("A", 10.0, 0.04, 1e-3)]);
        let (other, _) = samples(&[("B", 1000.0, 4.0, 1e-3)]);
        assert_eq!(worse(&before, &other, true), []);
        assert_eq!(other.subjects(), [&subject("B", "")]);
    }
}
