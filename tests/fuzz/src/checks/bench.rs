//! What is to be measured, and what was.

use super::parts;
use super::shelf::Shelf;
use diaphane::bench::Samples;
use diaphane::scene::{Kind, Reader};
use std::path::Path;

/// The settings, and a table after them.
pub fn check(bytes: &[u8]) {
    let parts = parts(bytes);
    let shelf = Shelf::of(&[("fuzz.ron", parts[0])]);
    let read = |reader: &Reader, path: &Path| reader.bench(path);
    if let Some(settings) = shelf.read(|reader, path| Ok((read(reader, path)?, Vec::new()))) {
        assert!((1..=1000).contains(&settings.repetitions) && !settings.truths.is_empty());
        assert!(settings.max_error.is_none_or(|error| error > 0.0 && error.is_finite()));
        if shelf.says_its_kind() {
            shelf.is(Kind::Bench);
            shelf.reads_again(&settings, read);
        }
    }
    for text in parts.iter().filter_map(|part| std::str::from_utf8(part).ok()) {
        match Samples::read(text) {
            // A value may be NaN, so what is printed is compared.
            Ok(samples) => {
                let again = Samples::read(&samples.csv()).expect("what was written is read");
                assert_eq!(format!("{again:?}"), format!("{samples:?}"));
            }
            Err((line, what)) => {
                assert!((1..=text.split('\n').count()).contains(&line) && what.len() < 8192, "{line}: {what}");
            }
        }
    }
}
