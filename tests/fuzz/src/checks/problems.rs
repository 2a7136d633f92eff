//! What must hold of every problem: it names a place that exists, and can be read.

use diaphane::problem::{Problem, Problems};
use std::path::Path;

/// Nobody reads more of one problem, characters.
const LONGEST: usize = 8192;
/// Nobody reads more problems.
const MOST: usize = 1000;

/// That a problem with bytes or their meaning makes sense; `files` are those it may name, with what they hold.
pub fn sound(problem: &Problem, files: &[(&Path, &[u8])]) {
    let said = problem.to_string();
    assert!(said.chars().count() <= LONGEST, "{} characters of problem: {said:.200}…", said.chars().count());
    assert!(!problem.what.trim().is_empty());
    problem.json();
    let Some(at) = &problem.at else { return };
    if at.line == 0 {
        assert_eq!(at.column, 0, "{said}");
        return;
    }
    let Some((_, bytes)) = files.iter().find(|(path, _)| *path == at.file) else { return };
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let line = text.split('\n').nth(at.line - 1).unwrap_or_else(|| panic!("there is no such line: {said}"));
    let line = line.trim_end_matches('\r');
    assert!((1..=line.chars().count() + 1).contains(&at.column), "there is no such column: {said}");
    // Of a long line only a part is shown.
    let shown = at.source.trim_matches('…').trim_end();
    assert!(line.contains(shown), "{line:?} does not hold {shown:?}");
    let end = at.mark.saturating_sub(1) + at.width;
    assert!(at.width >= 1 && end <= at.source.chars().count().max(at.mark).max(1), "marks beyond the line: {said}");
}

/// The same of all that was found; there is an error among them.
pub fn all_sound(Problems(problems): &Problems, files: &[(&Path, &[u8])]) {
    assert!(problems.iter().any(Problem::is_error), "nothing is wrong, but it was refused");
    warnings_sound(problems, files);
}

/// The same of what may be nothing but warnings.
pub fn warnings_sound(problems: &[Problem], files: &[(&Path, &[u8])]) {
    assert!(problems.len() <= MOST, "{} problems", problems.len());
    problems.iter().for_each(|problem| sound(problem, files));
}
