//! What the tests of this room share, and those of the room as a whole.

use super::*;
use crate::scene::Truth;
use summary::Line;

pub fn machine() -> Machine {
    Machine {
        adapter: "llvmpipe <1> (Vulkan, Cpu)".into(),
        driver: "Mesa".into(),
        is_software: true,
        cpu: "a CPU".into(),
        threads: 2,
        commit: "unknown".into(),
        is_optimised: true,
        date: "2024-02-29".into(),
    }
}

pub fn subject(technique: &str, settings: &str) -> Subject {
    let [scene, technique, settings, size] = ["ball", technique, settings, "32x32"].map(String::from);
    Subject { scene, technique, settings, size }
}

pub fn sample(subject: &Subject, measure: &str, repeat: u32, value: f64) -> Sample {
    let unit = if measure.contains('@') { "1" } else { "ms" };
    Sample { subject: subject.clone(), measure: measure.into(), unit, repeat, value }
}

/// A contender with a time, and an error with its standard error.
pub fn samples(contenders: &[(&str, f64, f64, f64)]) -> (Samples, Vec<Line>) {
    let mut samples = Samples::default();
    for (name, time, relmse, se) in contenders {
        let of = subject(name, "");
        samples.0.extend((1..=3).map(|n| sample(&of, "frame", n, time * (0.98 + 0.01 * f64::from(n)))));
        samples.0.extend((1..=3).map(|n| sample(&of, "pass:a", n, time / 2.0)));
        samples.0.push(sample(&of, "bake", 1, 5.0));
        let errors = [("relmse", *relmse), ("relmse_se", *se), ("dssim", 0.1), ("flip_mean", 0.1)];
        let rest = [("flip_p99", 0.2), ("bias", -0.12), ("bias_se", 0.01)];
        samples
            .0
            .extend(errors.into_iter().chain(rest).map(|(m, value)| sample(&of, &format!("{m}@volume"), 1, value)));
    }
    let lines = contenders
        .iter()
        .map(|(name, ..)| Line::of(&samples, &subject(name, ""), &[Truth::Volume, Truth::Bssrdf]))
        .collect();
    (samples, lines)
}

/// Whether every tag of XML is closed in order, and every attribute quoted; a declaration may stand in front.
pub fn is_well_formed(text: &str) -> bool {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = text.strip_prefix("<!DOCTYPE html>").unwrap_or(text);
    while let Some(start) = rest.find('<') {
        let Some(end) = rest[start..].find('>').map(|end| start + end) else { return false };
        let tag = &rest[start + 1..end];
        if rest[..start].contains('>') || tag.matches('"').count() % 2 == 1 || tag.contains('<') {
            return false;
        }
        let name = tag.trim_matches('/').split(' ').next().unwrap_or_default();
        if tag.starts_with('/') {
            if open.pop() != Some(name) {
                return false;
            }
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        rest = &rest[end + 1..];
    }
    open.is_empty()
}

#[test]
fn tags_that_do_not_fit_are_noticed() {
    assert!(is_well_formed("<a b=\"c\"><d/>text</a>"));
    for wrong in ["<a>", "<a></b>", "<a b=\"c></a>", "<a>1 > 2</a>", "</a>", "<a", "<a <b/></a>"] {
        assert!(!is_well_formed(wrong), "{wrong}");
    }
}

#[test]
fn lots_are_drawn_and_nothing_is_lost() {
    let mut lots: Vec<usize> = (0..50).map(|i| i / 10).collect();
    let sorted = lots.clone();
    shuffle(&mut lots);
    assert_ne!(lots, sorted);
    let mut twin = sorted.clone();
    shuffle(&mut twin);
    assert_eq!(lots, twin, "the same lots every time");
    lots.sort_unstable();
    assert_eq!(lots, sorted);
}

#[test]
fn the_code_that_is_named_is_there() {
    fingerprint(&CODE);
}
