//! WGSL with includes: found, joined, named, checked by naga before a driver sees it, and mapped back to the lines that
//! people wrote.
//!
//! `#include "lib/sphere.wgsl"` on a line of its own brings that file, once however often it is named. Paths are relative
//! to the shader folder. Lines between `#if NAME` and `#endif` (or `#else`) are there only when the pass asks for NAME: what
//! a scene does not need is absent, not switched off. One file is one pass: its entry points are called `vertex`,
//! `fragment` and `compute`.
//!
//! The program carries its shaders with it; a shader folder on disk replaces them. Each file is read once, until
//! [`Shaders::look_again`]: whoever looks at the scene's files anew looks at these too.

use crate::problem::{At, Problem};
use crate::store::{Files, Key};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use serde::{Serialize, Serializer};
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// Where a line of joined text came from.
struct Line {
    file: Arc<PathBuf>,
    /// 1-based.
    number: usize,
}

/// A shader that naga accepted. It serialises as the name of its joined text, so an edit anywhere in it is a new pass.
#[derive(Clone)]
pub struct Shader(Arc<Checked>);

pub struct Checked {
    pub name: String,
    pub key: Key,
    pub text: String,
    pub module: naga::Module,
    pub info: ModuleInfo,
}

impl std::ops::Deref for Shader {
    type Target = Checked;
    fn deref(&self) -> &Checked {
        &self.0
    }
}

impl Serialize for Shader {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.key.serialize(serializer)
    }
}

impl std::fmt::Debug for Shader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Shader({:?}, {:?})", self.name, self.key)
    }
}

/// All shaders, from a folder or from the program itself. What was checked once is not checked again.
pub struct Shaders {
    folder: Option<PathBuf>,
    files: Arc<Files>,
    known: Mutex<Known>,
    standing_in: Option<Mutex<StandIns>>,
}

#[derive(Default)]
struct Known {
    /// By the name of the joined text: for good.
    checked: HashMap<Key, Result<Shader, Problem>>,
    /// By file and flags: as the files were when they were last looked at. A plan asks for the same few over and over.
    loaded: HashMap<String, Vec<Loaded>>,
}

/// What came of a file with these flags.
type Loaded = (Vec<String>, Result<Shader, Problem>);

/// The last good shader for each name with its flags, and the first problem of one that it stood in for.
#[derive(Default)]
struct StandIns {
    good: HashMap<Key, Shader>,
    trouble: Option<Problem>,
}

impl Shaders {
    /// Shaders from `folder`, or those that the program carries.
    pub fn new(folder: Option<PathBuf>, files: Arc<Files>) -> Shaders {
        Shaders { folder, files, known: Mutex::default(), standing_in: None }
    }

    /// From now on a shader that cannot be loaded any more is replaced by its last good self, so that a picture can be
    /// looked at while somebody mends it; [`Shaders::trouble`] says what is wrong.
    pub fn with_stand_ins(self) -> Shaders {
        Shaders { standing_in: Some(Mutex::default()), ..self }
    }

    /// The first problem that a stand-in covered since this was last asked.
    pub fn trouble(&self) -> Option<Problem> {
        self.standing_in.as_ref()?.lock().expect("no panic while standing in").trouble.take()
    }

    /// The shader folder that an artist would expect to be read: the one that the environment names, the one here, the
    /// one that the program was built from; else none.
    pub fn usual_folder() -> Option<PathBuf> {
        if let Some(folder) = std::env::var_os("DIAPHANE_SHADERS").filter(|folder| !folder.is_empty()) {
            return Some(folder.into());
        }
        let is_ours = |folder: &PathBuf| EMBEDDED.iter().all(|(name, _)| folder.join(name).is_file());
        let built_from = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        [PathBuf::from("shaders"), built_from].into_iter().find(is_ours)
    }

    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// All shaders that the program carries, by name.
    pub fn names() -> impl Iterator<Item = &'static str> {
        EMBEDDED.iter().map(|(name, _)| *name)
    }

    /// Forgets what the files held, so that each is read anew when it is next asked for.
    pub fn look_again(&self) {
        self.known().loaded.clear();
    }

    /// The shader `name` (`frame/gbuffer.wgsl`) with all that it includes, and the lines that `flags` ask for.
    pub fn load(&self, name: &str, flags: &[&str]) -> Result<Shader, Problem> {
        let loaded = self.load_once(name, flags);
        let Some(standing_in) = &self.standing_in else { return loaded };
        let mut standing_in = standing_in.lock().expect("no panic while standing in");
        let role = Key::of(&(name, flags));
        match loaded {
            Ok(shader) => {
                standing_in.good.insert(role, shader.clone());
                Ok(shader)
            }
            Err(problem) => {
                let good = standing_in.good.get(&role).cloned().ok_or(problem.clone())?;
                standing_in.trouble.get_or_insert(problem);
                Ok(good)
            }
        }
    }

    fn load_once(&self, name: &str, flags: &[&str]) -> Result<Shader, Problem> {
        let loaded = |known: &Known| {
            let of_name = known.loaded.get(name)?;
            of_name.iter().find(|(with, _)| with == flags).map(|(_, shader)| shader.clone())
        };
        if let Some(loaded) = loaded(&self.known()) {
            return loaded;
        }
        let shader = self.read(name, flags);
        let flags = flags.iter().map(|flag| flag.to_string()).collect();
        self.known().loaded.entry(name.to_string()).or_default().push((flags, shader.clone()));
        shader
    }

    fn read(&self, name: &str, flags: &[&str]) -> Result<Shader, Problem> {
        let mut joined = Joined { flags, text: String::new(), lines: Vec::new(), seen: BTreeSet::new() };
        self.join(name, None, &mut joined)?;
        let Joined { text, lines, .. } = joined;
        let key = Key::of(&(name, &text));
        if let Some(checked) = self.known().checked.get(&key) {
            return checked.clone();
        }
        let checked = check(name, key, text, &lines);
        self.known().checked.insert(key, checked.clone());
        checked
    }

    fn known(&self) -> std::sync::MutexGuard<'_, Known> {
        self.known.lock().expect("nobody panics while noting a shader")
    }

    fn source(&self, name: &str) -> Result<(PathBuf, String), String> {
        match &self.folder {
            Some(folder) => {
                let path = folder.join(name);
                let file = self.files.read(&path).map_err(|error| error.to_string())?;
                let text = std::str::from_utf8(&file.bytes).map_err(|_| "it is not UTF-8 text".to_string())?;
                Ok((path, text.to_string()))
            }
            None => EMBEDDED
                .iter()
                .find(|(known, _)| *known == name)
                .map(|(_, text)| (Path::new("shaders").join(name), text.to_string()))
                .ok_or_else(|| "the program carries no such shader".to_string()),
        }
    }

    fn join(&self, name: &str, included_at: Option<At>, joined: &mut Joined) -> Result<(), Problem> {
        if !joined.seen.insert(name.to_string()) {
            return Ok(());
        }
        let (path, source) = self.source(name).map_err(|why| {
            let hint = match (crate::problem::nearest(name, Shaders::names()), &self.folder) {
                (Some(near), _) if near != name => format!("there is {near}"),
                (_, Some(folder)) => format!(
                    "put it into {}, or name no folder in DIAPHANE_SHADERS: the program carries its own shaders",
                    folder.display()
                ),
                (_, None) => "restore the file".into(),
            };
            let problem = Problem::files(format!("the shader {name} cannot be read: {why}")).hint(hint);
            match included_at {
                Some(at) => problem.at(at),
                None => problem,
            }
        })?;
        let file = Arc::new(path);
        let mut offset = 0;
        // Whether each open `#if` lets its lines through.
        let mut open: Vec<bool> = Vec::new();
        for (i, line) in source.lines().enumerate() {
            let at = || At::span(&file, &source, offset..offset + line.len());
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                ["#if", flag] => open.push(joined.flags.contains(flag)),
                ["#else"] if !open.is_empty() => open.iter_mut().next_back().into_iter().for_each(|o| *o = !*o),
                ["#endif"] if !open.is_empty() => drop(open.pop()),
                _ if open.contains(&false) => {}
                ["#include", wanted] if wanted.len() > 2 && wanted.starts_with('"') && wanted.ends_with('"') => {
                    self.join(wanted.trim_matches('"'), Some(at()), joined)?;
                }
                [word, ..] if word.starts_with('#') => {
                    return Err(Problem::files(format!("`{}` is no instruction here", line.trim()))
                        .at(at())
                        .hint("#include \"lib/sphere.wgsl\", #if NAME, #else and #endif are"));
                }
                _ => {
                    joined.text.push_str(line);
                    joined.text.push('\n');
                    joined.lines.push(Line { file: file.clone(), number: i + 1 });
                }
            }
            offset += line.len() + 1;
        }
        match open.is_empty() {
            true => Ok(()),
            false => {
                Err(Problem::files("an #if is never closed").at(At::span(&file, &source, 0..0)).hint("add #endif"))
            }
        }
    }
}

/// A shader on its way to being one text.
struct Joined<'a> {
    flags: &'a [&'a str],
    text: String,
    lines: Vec<Line>,
    seen: BTreeSet<String>,
}

fn check(name: &str, key: Key, text: String, lines: &[Line]) -> Result<Shader, Problem> {
    let module = naga::front::wgsl::parse_str(&text).map_err(|error| {
        let span = error.location(&text).map(|l| l.offset as usize..(l.offset + l.length) as usize);
        let new = |note: &&str| !note.is_empty() && !error.message().contains(*note);
        let notes: Vec<_> = error.labels().map(|(_, note)| note).filter(new).collect();
        let problem = Problem::files(format!("the shader {name} is wrong: {}", error.message()));
        place(problem, &text, lines, span).hint(if notes.is_empty() {
            "mend it and save".into()
        } else {
            notes.join("; ")
        })
    })?;
    // Whatever the device lacks, it says itself; here only what no device can do is found.
    let info = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module).map_err(|error| {
        let span = error.spans().next().and_then(|(span, _)| span.to_range());
        let mut what = format!("the shader {name} is wrong: {error}");
        let mut source: Option<&dyn std::error::Error> = std::error::Error::source(error.as_inner());
        while let Some(cause) = source {
            what += &format!(": {cause}");
            source = cause.source();
        }
        place(Problem::files(what), &text, lines, span).hint("mend it and save")
    })?;
    Ok(Shader(Arc::new(Checked { name: name.to_string(), key, text, module, info })))
}

/// Puts a problem at the line that somebody wrote, rather than at that of the joined text.
fn place(problem: Problem, text: &str, lines: &[Line], span: Option<std::ops::Range<usize>>) -> Problem {
    let Some(span) = span else { return problem };
    let mut at = At::span(Path::new(""), text, span);
    match lines.get(at.line - 1).or(lines.last()) {
        Some(line) => {
            at.file = line.file.to_path_buf();
            at.line = line.number;
            problem.at(at)
        }
        None => problem,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shaders(files: &[(&str, &str)]) -> (tempfile::TempDir, Shaders) {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let shaders = Shaders::new(Some(folder.path().into()), Arc::default());
        (folder, shaders)
    }

    #[test]
    fn every_shader_that_the_program_carries_is_valid() {
        let shaders = Shaders::new(None, Arc::default());
        for name in Shaders::names() {
            shaders.load(name, &[]).unwrap_or_else(|problem| panic!("{problem}"));
        }
    }

    #[test]
    fn an_include_comes_once_and_errors_name_the_line_that_was_written() {
        let (_folder, good) = shaders(&[
            ("a.wgsl", "#include \"b.wgsl\"\n#include \"b.wgsl\"\nfn a() -> f32 { return b(); }\n"),
            ("b.wgsl", "fn b() -> f32 { return 1.0; }\n"),
        ]);
        assert_eq!(good.load("a.wgsl", &[]).unwrap().text.matches("fn b").count(), 1);

        let (_folder, bad) = shaders(&[
            ("a.wgsl", "#include \"b.wgsl\"\n\nfn a() -> f32 { return b(); }\n"),
            ("b.wgsl", "// one\nfn b() -> f32 {\n  return oops;\n}\n"),
        ]);
        let problem = bad.load("a.wgsl", &[]).unwrap_err();
        let at = problem.at.unwrap();
        assert!(at.file.ends_with("b.wgsl"));
        assert_eq!((at.line, at.column, at.width), (3, 10, 4), "{}", problem.what);
        assert!(problem.what.contains("oops"), "{}", problem.what);
    }

    #[test]
    fn validation_and_missing_files_have_places_too() {
        let (_folder, wrong) = shaders(&[("a.wgsl", "// one\nfn a() -> f32 {\n  return 1u;\n}\n")]);
        assert_eq!(wrong.load("a.wgsl", &[]).unwrap_err().at.unwrap().line, 2);
        let (_folder, missing) = shaders(&[("a.wgsl", "// x\n#include \"c.wgsl\"\n")]);
        let problem = missing.load("a.wgsl", &[]).unwrap_err();
        assert_eq!(problem.at.unwrap().line, 2);
        let (_folder, cycle) = shaders(&[
            ("a.wgsl", "#include \"b.wgsl\"\nconst x = 1;\n"),
            ("b.wgsl", "#include \"a.wgsl\"\nconst y = 2;\n"),
        ]);
        cycle.load("a.wgsl", &[]).unwrap();
    }

    #[test]
    fn the_last_good_shader_stands_in_for_a_broken_one_until_it_is_mended() {
        let (folder, plain) = shaders(&[("a.wgsl", "const a = 1;\n")]);
        let shaders = Shaders::new(Some(folder.path().into()), Arc::default()).with_stand_ins();
        let write = |text: &str| {
            std::fs::write(folder.path().join("a.wgsl"), text).unwrap();
            shaders.look_again();
        };
        let good = shaders.load("a.wgsl", &[]).unwrap().key;
        write("const a = oops;\n");
        assert_eq!(shaders.load("a.wgsl", &[]).unwrap().key, good);
        assert!(shaders.trouble().unwrap().what.contains("oops") && shaders.trouble().is_none());
        // Nothing stands in where nobody asked for it, nor for what never was.
        assert!(plain.load("a.wgsl", &[]).is_err() && shaders.load("a.wgsl", &["NEW"]).is_err());
        write("const a = 2;\n");
        assert_ne!(shaders.load("a.wgsl", &[]).unwrap().key, good);
        assert!(shaders.trouble().is_none());
    }

    #[test]
    fn flags_choose_lines() {
        let (_folder, shaders) = shaders(&[("a.wgsl", "#if A\nconst a = 1;\n#else\nconst b = 1;\n#endif\n")]);
        assert_eq!(shaders.load("a.wgsl", &["A"]).unwrap().text, "const a = 1;\n");
        assert_eq!(shaders.load("a.wgsl", &[]).unwrap().text, "const b = 1;\n");
    }
}
