//! Laws of the room as a whole: messages are what they should be, and no text can hurt the reader.

use crate::problem::{Problem, Problems};
use crate::scene::document::{self, Kind, parse};
use crate::scene::tree::{Node, Source, Value};
use crate::scene::{Filter, LightKind, Material, MeshSource, Reader, Scene, Sky, Substance, Varying};
use crate::store::Files;
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn reader() -> Reader {
    Reader::new(Arc::new(Files::default()))
}

fn show(problems: &[Problem]) -> String {
    problems.iter().map(|p| format!("{p}\n")).collect()
}

/// All that is said of a file.
fn said(path: &Path) -> String {
    let reader = reader();
    let read = match reader.kind_of(path) {
        Ok(Kind::Scene) => reader.scene(path, &[]).map(|read| read.1),
        Ok(Kind::Material) => reader.material(path).map(|read| read.1),
        Err(problem) => Err(problem.into()),
    };
    show(&read.unwrap_or_else(|Problems(problems)| problems))
}

fn scene(text: &str) -> Result<(Scene, Vec<Problem>), Problems> {
    with_file("scene.ron", text, |path| reader().scene(path, &[]))
}

fn material(text: &str) -> Result<(Material, Vec<Problem>), Problems> {
    with_file("material.ron", text, |path| reader().material(path))
}

fn with_file<T>(name: &str, text: &str, read: impl FnOnce(&Path) -> T) -> T {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, text).unwrap();
    read(&path)
}

#[test]
fn every_mistake_is_told_in_the_expected_words() {
    let mut cases: Vec<PathBuf> = std::fs::read_dir("tests/problems").unwrap().map(|e| e.unwrap().path()).collect();
    cases.retain(|path| path.extension().is_some_and(|e| e == "ron"));
    cases.sort();
    assert!(cases.len() >= 40);
    let update = std::env::var_os("UPDATE").is_some();
    let mut wrong = String::new();
    for case in &cases {
        let (expected, said) = (case.with_extension("txt"), said(case));
        if update {
            std::fs::write(&expected, &said).unwrap();
        }
        match std::fs::read_to_string(&expected) {
            Ok(text) if text == said => {}
            Ok(text) => wrong += &format!("{}: expected\n{text}but it says\n{said}\n", case.display()),
            Err(_) => wrong += &format!("{} is missing; it says\n{said}\n", expected.display()),
        }
    }
    assert!(wrong.is_empty(), "{wrong}UPDATE=1 rewrites what is expected");
}
