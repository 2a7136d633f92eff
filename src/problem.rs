//! The only error that a user sees: where, what, and what to do.
//!
//! A [`Problem`] is one thing that is wrong; [`Problems`] is what a reader hands back, since errors of meaning are
//! reported all at once. Warnings are problems too, of [`Severity::Warning`]: the picture will come, and disappoint.

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A place in a text file, 1-based, with the line itself, so that the message can show it after the file has changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct At {
    pub file: PathBuf,
    pub line: usize,
    pub column: usize,
    /// What is shown of the source line, without its end: all of one that somebody wrote, the surroundings of the value in
    /// one that a program did.
    pub source: String,
    /// Where in that the value begins, 1-based.
    pub mark: usize,
    /// How many characters of it the value takes, at least 1.
    pub width: usize,
}

impl At {
    /// The place of the bytes `span` in `text`, which is the content of `file`.
    pub fn span(file: &Path, text: &str, span: Range<usize>) -> At {
        let mut start = span.start.min(text.len());
        while !text.is_char_boundary(start) {
            start -= 1;
        }
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
        let mut end = span.end.clamp(start, line_end);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let number = text[..start].matches('\n').count() + 1;
        At::in_line(file, number, &text[line_start..line_end], start - line_start..end - line_start)
    }

    /// The place of the bytes `span` in the line of that number.
    pub fn in_line(file: &Path, number: usize, line: &str, span: Range<usize>) -> At {
        const WHOLE: usize = 200;
        const BEFORE: usize = 40;
        const SHOWN: usize = 120;
        let line = line.trim_end_matches('\r');
        let (start, end) = (span.start.min(line.len()), span.end.min(line.len()));
        let column = line[..start].chars().count() + 1;
        let width = line[start..end].chars().count().max(1);
        let length = line.chars().count();
        let (source, mark, width) = match length <= WHOLE {
            true => (line.to_string(), column, width),
            false => {
                let skipped = (column - 1).saturating_sub(BEFORE);
                let shown: String = line.chars().skip(skipped).take(SHOWN).collect();
                let lead = if skipped > 0 { "…" } else { "" };
                let tail = if length > skipped + SHOWN { "…" } else { "" };
                let mark = column - skipped + lead.chars().count();
                (format!("{lead}{shown}{tail}"), mark, width.min(SHOWN - BEFORE))
            }
        };
        At { file: file.to_path_buf(), line: number, column, source, mark, width }
    }

    /// A file as a whole (an image, a mesh): no line.
    pub fn file(file: &Path) -> At {
        At { file: file.to_path_buf(), line: 0, column: 0, source: String::new(), mark: 0, width: 1 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    Error,
    /// It renders, but will disappoint.
    Warning,
}

/// The exit status that a problem leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The files are wrong: 1.
    Files,
    /// The words on the command line are wrong: 2.
    Words,
    /// There is no adapter: 3.
    Adapter,
    /// A comparison failed: 4.
    Comparison,
    /// It could not finish: disk full, device lost, interrupted: 5.
    Unfinished,
}

impl Cause {
    pub fn exit_status(self) -> u8 {
        match self {
            Cause::Files => 1,
            Cause::Words => 2,
            Cause::Adapter => 3,
            Cause::Comparison => 4,
            Cause::Unfinished => 5,
        }
    }
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    pub severity: Severity,
    pub cause: Cause,
    pub at: Option<Box<At>>,
    /// The field's path in its file: `objects[0].transform.scale`.
    pub path: Option<String>,
    /// What is wrong, one sentence without a full stop.
    pub what: String,
    /// What to do about it, with the allowed range or the nearest right word.
    pub hint: Option<String>,
}

impl Problem {
    pub fn new(cause: Cause, what: impl Into<String>) -> Problem {
        Problem { severity: Severity::Error, cause, at: None, path: None, what: what.into(), hint: None }
    }
    /// A problem of the files, the usual one.
    pub fn files(what: impl Into<String>) -> Problem {
        Problem::new(Cause::Files, what)
    }
    pub fn warning(what: impl Into<String>) -> Problem {
        Problem { severity: Severity::Warning, ..Problem::files(what) }
    }
    pub fn at(mut self, at: At) -> Problem {
        self.at = Some(Box::new(at));
        self
    }
    pub fn path(mut self, path: impl Into<String>) -> Problem {
        self.path = Some(path.into());
        self
    }
    pub fn hint(mut self, hint: impl Into<String>) -> Problem {
        self.hint = Some(hint.into());
        self
    }
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// The same facts for programs.
    pub fn json(&self) -> serde_json::Value {
        serde_json::json!({
            "severity": if self.is_error() { "error" } else { "warning" },
            "file": self.at.as_ref().map(|at| at.file.display().to_string()),
            "line": self.at.as_ref().filter(|at| at.line > 0).map(|at| at.line),
            "column": self.at.as_ref().filter(|at| at.line > 0).map(|at| at.column),
            "path": self.path,
            "what": self.what,
            "hint": self.hint,
        })
    }
}

/// ```text
/// scenes/a.ron:12:20: error: objects[0].transform.scale: 0 is not allowed
///    |
/// 12 |     transform: (scale: 0.0),
///    |                        ^^^
///    = hint: a number above 0
/// ```
impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(at) = &self.at {
            match at.line {
                0 => write!(f, "{}: ", at.file.display())?,
                line => write!(f, "{}:{}:{}: ", at.file.display(), line, at.column)?,
            }
        }
        write!(f, "{}: ", if self.is_error() { "error" } else { "warning" })?;
        if let Some(path) = &self.path {
            write!(f, "{}: ", clipped(path))?;
        }
        write!(f, "{}", clipped(&self.what))?;
        if let Some(at) = self.at.as_ref().filter(|at| at.line > 0) {
            let number = at.line.to_string();
            let margin = " ".repeat(number.len());
            // A tab stays a tab, so that the marks stand under their value.
            let lead: String =
                at.source.chars().take(at.mark.saturating_sub(1)).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
            write!(f, "\n{margin} |\n{number} | {}\n{margin} | {lead}{}", at.source, "^".repeat(at.width))?;
            if let Some(hint) = &self.hint {
                write!(f, "\n{margin} = hint: {}", clipped(hint))?;
            }
        } else if let Some(hint) = &self.hint {
            write!(f, "\n  hint: {}", clipped(hint))?;
        }
        Ok(())
    }
}

impl std::error::Error for Problem {}

/// As much of a text as anybody reads: a file may hold a name of any length.
fn clipped(text: &str) -> Cow<'_, str> {
    const READ: usize = 1500;
    match text.char_indices().nth(READ) {
        Some((end, _)) => format!("{}…", &text[..end]).into(),
        None => text.into(),
    }
}

/// All that is wrong with what was read, in the order of the files; never empty when it is an `Err`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Problems(pub Vec<Problem>);

impl Problems {
    pub fn cause(&self) -> Cause {
        self.0.iter().find(|p| p.is_error()).map_or(Cause::Files, |p| p.cause)
    }
}

impl From<Problem> for Problems {
    fn from(problem: Problem) -> Problems {
        Problems(vec![problem])
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.0.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{problem}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}

/// A number of things, in words: `1 view`, `96 views`.
pub fn counted(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

/// The word in `known` that `word` was probably meant to be.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // To compare two words takes time and memory in proportion to both, and a file may name anything.
    const LONGEST: usize = 256;
    if word.len() > LONGEST {
        return None;
    }
    let lower = word.to_lowercase();
    known
        .into_iter()
        .filter(|k| k.len() <= LONGEST)
        .map(|k| (strsim::damerau_levenshtein(&lower, &k.to_lowercase()), k))
        .filter(|(distance, k)| *distance <= 1 + k.len().min(word.len()) / 3 && *distance < k.len().max(word.len()))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, k)| k)
}

/// How long work reports the share that is done, 0 to 1, and learns that nobody waits for it any more: an `Err` is to be
/// passed up at once.
pub type Tick<'a> = &'a (dyn Fn(f64) -> Result<(), Problem> + Sync);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_an_enormous_line_the_surroundings_are_shown_with_the_marks_at_their_place() {
        let text = format!("{}OOPS{}", "(".repeat(5000), ")".repeat(5000));
        let problem = Problem::files("no").at(At::span(Path::new("a.ron"), &text, 5000..5004)).to_string();
        let lines: Vec<Vec<char>> = problem.lines().map(|line| line.chars().collect()).collect();
        assert!(problem.starts_with("a.ron:1:5001: error: no") && lines.iter().all(|line| line.len() < 140));
        let marks = lines[3].iter().position(|c| *c == '^').unwrap();
        assert_eq!(lines[2][marks..marks + 4], ['O', 'O', 'P', 'S']);
        assert!(lines[2][4] == '…' && lines[2].ends_with(&['…']));
    }

    #[test]
    fn names_of_any_length_are_told_and_compared_at_once() {
        let name = "n".repeat(10_000_000);
        let problem = Problem::files(format!("there is no `{name}`")).path(&name).hint(format!("not {name}"));
        assert!(problem.to_string().len() < 5000 && problem.to_string().contains("there is no `nnn"));
        assert_eq!(nearest(&name, ["n", &name]), None);
        assert_eq!(nearest("nn", ["n", &name]), Some("n"));
    }

    #[test]
    fn a_word_of_which_nothing_is_right_is_near_to_none() {
        assert_eq!(nearest("9", ["a", "ball"]), None);
        assert_eq!(nearest("bal", ["a", "ball"]), Some("ball"));
    }
}
