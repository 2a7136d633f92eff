//! Every mistake is told in the expected words: one test per `tests/problems/*.ron`, which `*.txt` says what is said of.
//!
//! `UPDATE=1 cargo test --test problems` writes what is expected anew. A scene or material without its text fails, and so
//! does a text without its scene or material.

use diaphane::problem::Problems;
use diaphane::scene::{Kind, Reader};
use libtest_mimic::{Arguments, Trial};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Relative, since messages show it.
const FOLDER: &str = "tests/problems";

fn main() -> ExitCode {
    std::env::set_current_dir(env!("CARGO_MANIFEST_DIR")).expect("the project's folder is there");
    let update = std::env::var_os("UPDATE").is_some_and(|value| value == "1");
    let stems: BTreeSet<PathBuf> = std::fs::read_dir(FOLDER)
        .expect("the folder of problems can be listed")
        .map(|entry| entry.expect("the folder of problems can be listed").path())
        .filter(|path| path.extension().is_some_and(|e| e == "ron" || e == "txt"))
        .map(|path| path.with_extension(""))
        .collect();
    let trials: Vec<Trial> = stems
        .into_iter()
        .map(|stem| {
            let name = stem.file_name().expect("a file has a name").to_string_lossy().into_owned();
            Trial::test(name, move || judge(&stem, update).map_err(Into::into))
        })
        .collect();
    assert!(trials.len() >= 40, "the problems are gone");
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

fn judge(stem: &Path, update: bool) -> Result<(), String> {
    let (file, expected) = (stem.with_extension("ron"), stem.with_extension("txt"));
    if !file.is_file() {
        return Err(format!("{} belongs to no {}", expected.display(), file.display()));
    }
    let said = said(&file);
    if update {
        std::fs::write(&expected, &said).map_err(|error| format!("{}: {error}", expected.display()))?;
    }
    match std::fs::read_to_string(&expected) {
        Ok(text) if text == said => Ok(()),
        Ok(text) => Err(format!("expected\n{text}but it says\n{said}UPDATE=1 rewrites what is expected")),
        Err(_) => Err(format!("{} is missing; it says\n{said}UPDATE=1 writes it", expected.display())),
    }
}

/// All that is said of a file.
fn said(file: &Path) -> String {
    let reader = Reader::new(Default::default());
    let read = match reader.kind_of(file) {
        Ok(Kind::Scene) => reader.scene(file, &[]).map(|(_, warnings)| warnings),
        Ok(Kind::Material) => reader.material(file).map(|(_, warnings)| warnings),
        Ok(Kind::Bench) => reader.bench(file).map(|_| Vec::new()),
        Err(problem) => Err(problem.into()),
    };
    let problems = read.unwrap_or_else(|Problems(problems)| problems);
    problems.iter().map(|problem| format!("{problem}\n")).collect()
}
