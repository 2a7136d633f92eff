//! What holds for the text of the project as a whole: the order of the rooms, citations, names, sizes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Each room uses only those to its left.
const ROOMS: [&str; 17] = [
    "problem",
    "image",
    "metric",
    "papers",
    "optics",
    "geometry",
    "store",
    "scene",
    "reference",
    "gpu",
    "frame",
    "techniques",
    "render",
    "session",
    "bench",
    "preview",
    "commands",
];

fn files_below(folder: &str, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.map(|entry| entry.expect("a source folder can be listed").path()) {
        match path.is_dir() {
            true => files_below(path.to_str().expect("source paths are text"), found),
            false => found.push(path),
        }
    }
    found.sort();
}

/// Path with forward slashes, and text, of every file in `folders` whose name ends with one of `endings`.
fn texts(folders: &[&str], endings: &[&str]) -> Vec<(String, String)> {
    let mut found = Vec::new();
    folders.iter().for_each(|folder| files_below(folder, &mut found));
    found
        .into_iter()
        .map(|path| path.to_str().expect("source paths are text").replace('\\', "/"))
        .filter(|path| endings.iter().any(|ending| path.ends_with(ending)))
        // Some wrong files among the tests are no text.
        .filter_map(|path| Some((path.clone(), std::fs::read_to_string(path).ok()?)))
        .collect()
}

fn sources() -> Vec<(String, String)> {
    let found = texts(&["src"], &[".rs"]);
    assert!(found.len() > 50, "the tests run where the sources are");
    found
}

fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// What stands above a file's own tests.
fn without_tests<'a>(path: &str, text: &'a str) -> &'a str {
    if path.ends_with("/tests.rs") {
        return "";
    }
    text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default()
}

fn word(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    &text[..end]
}

/// The rooms that code names after `crate::`: by path, or in a list of paths.
fn rooms_named(code: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            None => drop(found.insert(word(rest).to_string())),
            Some(list) => {
                let (mut depth, mut begins) = (0, true);
                for (i, c) in list.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => begins = true,
                        c if depth == 0 && begins && c.is_alphanumeric() => {
                            found.insert(word(&list[i..]).to_string());
                            begins = false;
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    // A macro stands at the root whatever room it is written in.
    found.retain(|room| !room.is_empty() && room != "uniform");
    found
}

/// What is wrong with where a file looks.
fn disorder(path: &str, text: &str) -> Vec<String> {
    let room = word(path.strip_prefix("src/").expect("a source file"));
    if room == "lib" || room == "main" {
        return Vec::new();
    }
    let Some(own) = ROOMS.iter().position(|known| *known == room) else {
        return vec![format!("{path}: the room `{room}` has no place in the order")];
    };
    let code = without_comments(text);
    let mut wrong = Vec::new();
    for other in rooms_named(&code) {
        match ROOMS.iter().position(|known| *known == other) {
            None => wrong.push(format!("{path}: `crate::{other}` is no room")),
            Some(place) if place > own => {
                wrong.push(format!("{path}: `{room}` uses `{other}`, which lies to its right"))
            }
            Some(_) => {}
        }
    }
    // A room's first file could go around `crate::`.
    if path == format!("src/{room}.rs") || path == format!("src/{room}/mod.rs") {
        for (at, _) in code.match_indices("super::") {
            let other = word(&code[at + "super::".len()..]);
            if ROOMS.contains(&other) {
                wrong.push(format!("{path}: `super::{other}`: rooms are named by `crate::`"));
            }
        }
    }
    wrong
}

fn none_of(wrong: Vec<String>) {
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn rooms_use_only_rooms_to_their_left() {
    // Tests may look at the whole from anywhere.
    none_of(sources().iter().flat_map(|(path, text)| disorder(path, without_tests(path, text))).collect());
    let library = std::fs::read_to_string("src/lib.rs").expect("there is a library");
    for (at, _) in library.match_indices("pub mod ") {
        let room = word(&library[at + "pub mod ".len()..]);
        assert!(ROOMS.contains(&room), "src/lib.rs: the room `{room}` has no place in the order");
    }
}

#[test]
fn disorder_is_noticed() {
    let wrong = |path: &str, text: &str| disorder(path, text).len();
    assert_eq!(wrong("src/optics/sh.rs", "use crate::problem::Problem;\nuse crate::optics::Rgb;"), 0);
    assert_eq!(wrong("src/optics/sh.rs", "// use crate::scene::Scene;\n/// [`crate::gpu::Gpu`]"), 0);
    assert_eq!(wrong("src/optics/sh.rs", "use crate::scene::Scene;"), 1);
    assert_eq!(wrong("src/optics/sh.rs", "fn f() -> crate::gpu::Gpu {}"), 1);
    assert_eq!(wrong("src/store/key.rs", "use crate::{problem::{Problem, At}, scene::Scene, frame};"), 2);
    assert_eq!(wrong("src/store/mod.rs", "use super::scene::Scene;"), 1);
    assert_eq!(wrong("src/session.rs", "use crate::commands::Words;"), 1);
    assert_eq!(wrong("src/toolbox.rs", ""), 1);
    assert_eq!(wrong("src/render.rs", "use crate::toolbox::saw;"), 1);
}

/// Names that say nothing of what is in them.
const EMPTY_NAMES: [&str; 8] = ["util", "utils", "common", "helper", "helpers", "manager", "misc", "shared"];

#[test]
fn modules_are_named_by_what_they_hold() {
    let mut wrong = Vec::new();
    for (path, _) in texts(&["src", "shaders", "tests", "benches"], &[".rs", ".wgsl"]) {
        let parts = path.trim_end_matches(".rs").trim_end_matches(".wgsl").split('/');
        for part in parts.flat_map(|part| part.split('_')).filter(|part| EMPTY_NAMES.contains(part)) {
            wrong.push(format!("{path}: `{part}` says nothing"));
        }
    }
    none_of(wrong);
}

/// Code that is not there yet, or that gives up without a reason.
fn unfinished(path: &str, text: &str) -> Vec<String> {
    let library = without_comments(without_tests(path, text));
    let all = without_comments(text);
    // Spelled in two halves, or this file would find itself.
    let never = [("todo", "!("), ("unimplemented", "!("), ("#[", "ignore"), ("dbg", "!("), ("#[allow", "(")];
    let mut wrong: Vec<String> = never
        .iter()
        .map(|(a, b)| format!("{a}{b}"))
        .filter(|words| all.contains(words.as_str()))
        .map(|words| format!("{path}: {words}"))
        .collect();
    let count = library.matches(concat!(".unwrap", "()")).count();
    if path.starts_with("src/") && count > 0 {
        wrong.push(format!("{path}: {count} unwrap(s) without a reason: use expect(\"why it holds\")"));
    }
    wrong
}

#[test]
fn nothing_is_unfinished_and_what_cannot_fail_says_why() {
    none_of(texts(&["src", "tests", "benches"], &[".rs"]).iter().flat_map(|(p, t)| unfinished(p, t)).collect());
    assert_eq!(unfinished("src/a.rs", concat!("fn f() { x.unwrap", "() }\nfn g() { todo", "!() }")).len(), 2);
    assert_eq!(unfinished("src/a.rs", concat!("#[cfg(test)]\nmod tests {\n x.unwrap", "() }")).len(), 0);
    assert_eq!(unfinished("src/a/tests.rs", concat!("#[", "ignore]")).len(), 1);
}

/// `[Patro2007, eq. 3]` and `[Heitz2014; Walter2007]`: the keys in brackets that look like a name and a year.
fn citations(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for part in text.split('[').skip(1) {
        let inside = part.split(']').next().unwrap_or_default();
        for token in inside.split(|c: char| !c.is_alphanumeric()) {
            let name = token.trim_end_matches(|c: char| c.is_ascii_digit());
            if token.len() == name.len() + 4 && name.len() > 1 && name.chars().all(char::is_alphabetic) {
                found.insert(token.to_string());
            }
        }
    }
    found
}

#[test]
fn every_citation_has_its_paper_and_every_paper_is_cited() {
    let known: BTreeSet<&str> = diaphane::papers::PAPERS.iter().map(|paper| paper.key).collect();
    assert_eq!(known.len(), diaphane::papers::PAPERS.len(), "a key stands twice");
    let mut cited = BTreeSet::new();
    let mut wrong = Vec::new();
    for (path, text) in texts(&["src", "shaders", "tests", "benches"], &[".rs", ".wgsl"]) {
        if path == "src/papers.rs" || path == "tests/tidy.rs" {
            continue;
        }
        for key in citations(&text) {
            if !known.contains(key.as_str()) {
                wrong.push(format!("{path}: [{key}] is not in src/papers.rs"));
            }
            cited.insert(key);
        }
    }
    none_of(wrong);
    // A paper may wait for the technique that is made from it; it is told, not refused.
    for key in known.iter().filter(|key| !cited.contains(**key)) {
        println!("not cited yet: {key}");
    }
    assert_eq!(
        citations("[Patro2007, eq. 3] and [Heitz2014; dEon2011], not [`a`], x[2007] nor [u8; 1024]"),
        ["Patro2007", "Heitz2014", "dEon2011"].map(String::from).into()
    );
}

#[test]
fn papers_stand_in_the_order_of_their_keys() {
    let keys: Vec<String> = diaphane::papers::PAPERS.iter().map(|paper| paper.key.to_lowercase()).collect();
    assert!(keys.is_sorted(), "{keys:?}");
}

#[test]
fn every_dependency_says_what_it_is_for() {
    let manifest = std::fs::read_to_string("Cargo.toml").expect("there is a manifest");
    let mut table = "";
    let mut wrong = Vec::new();
    for line in manifest.lines().filter(|line| !line.is_empty()) {
        if line.starts_with('[') {
            table = line;
        } else if table.contains("dependencies]") && !line.starts_with('#') {
            let comment = line.rsplit_once('#').map_or("", |(_, comment)| comment.trim());
            if comment.len() < 3 {
                wrong.push(line.to_string());
            }
        }
    }
    none_of(wrong);
}

#[test]
fn no_file_is_too_long_to_be_read_in_one_sitting() {
    let files = texts(&["src", "shaders", "tests", "benches", "tools"], &[".rs", ".wgsl", ""]);
    // Raw numbers are read by programs.
    let is_read = |path: &str| !path.starts_with("tools/runs/") && !path.ends_with(".txt") && !path.ends_with(".lock");
    let long = files.iter().filter(|(path, text)| is_read(path) && text.lines().count() > 700);
    none_of(long.map(|(path, text)| format!("{path}: {} lines", text.lines().count())).collect());
}

#[test]
fn no_line_is_wider_than_the_format_allows() {
    let mut wrong = Vec::new();
    for (path, text) in texts(&["src", "shaders", "tests", "benches", "scenes", "materials"], &[".rs", ".wgsl", ".ron"])
    {
        // The corpus of wrong files has what it has.
        if path.starts_with("tests/problems/") {
            continue;
        }
        for (i, line) in text.lines().enumerate() {
            // A string may be as long as it must; all else is the formatter's to break.
            if line.chars().count() > 140 && !line.contains('"') {
                wrong.push(format!("{path}:{}: {} columns", i + 1, line.chars().count()));
            }
            if line.ends_with(' ') || line.contains('\t') && !line.contains("'\\t'") {
                wrong.push(format!("{path}:{}: a tab, or a space at the end", i + 1));
            }
        }
    }
    none_of(wrong);
}

#[test]
fn the_project_speaks_of_itself_alone() {
    let words =
        [("/wo", "rk/"), ("sha", "red/"), ("design", ".md"), ("facts", ".md"), ("files", ".md"), ("NOTES", ".md")];
    let hosts = [
        ("npmjs", ".org"),
        ("pypi", ".org"),
        ("index.crates", ".io"),
        ("deb.debian", ".org"),
        ("proxy.golang", ".org"),
    ];
    let words: Vec<String> = words.iter().chain(&hosts).map(|(a, b)| format!("{a}{b}")).collect();
    let mut wrong = Vec::new();
    let folders = ["src", "shaders", "tests", "benches", "scenes", "materials", "tools", "docs", ".ci"];
    let mut files = texts(&folders, &[".rs", ".wgsl", ".ron", ".md", ".txt", ".toml", ".yml", ".sh"]);
    files.extend(texts(&["tools", ".ci"], &["start", "test", "setup", "stress", "fuzz", "fetch-models"]));
    for path in
        ["README.md", "Cargo.toml", "build.rs", ".gitignore"].into_iter().filter(|path| Path::new(path).exists())
    {
        files.push((path.to_string(), std::fs::read_to_string(path).expect("it is text")));
    }
    for (path, text) in files {
        for word in words.iter().filter(|word| text.contains(word.as_str())) {
            wrong.push(format!("{path}: {word}"));
        }
    }
    none_of(wrong);
}
