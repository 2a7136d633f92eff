//! From the bytes of a file to a checked tree: encoding, syntax, version, `base:`, `--set`, then the schema.
//!
//! These stop at the first error, since what follows it would be guesswork. Meaning comes later, all at once, in
//! [`super::meaning`].

use crate::problem::{At, Problem, nearest};
use crate::scene::de;
use crate::scene::tree::{Field, Node, Source, SyntaxError, Value, shown};
use crate::store::{File, Files};
use ron::extensions::Extensions;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Scenes and materials are written by hand; more than this is a mistake.
const MAX_BYTES: usize = 64 << 20;
/// The versions of the format that this program reads.
const VERSIONS: [u32; 1] = [1];
/// Structs that may be written with their name; any other name is a variant of an enum.
const STRUCTS: [&str; 2] = ["Material", "Surface"];

impl SyntaxError {
    pub fn problem(self, source: &Source) -> Problem {
        let mut problem = Problem::files(self.what).at(source.at(self.span));
        problem.hint = self.hint;
        problem
    }
}

/// RON as these files use it.
pub fn ron() -> ron::Options {
    ron::Options::default()
        .with_default_extension(Extensions::IMPLICIT_SOME | Extensions::UNWRAP_VARIANT_NEWTYPES)
        .with_recursion_limit(128)
}

/// The tree of a text, which must be RON.
pub fn parse(source: &Arc<Source>) -> Result<Node, Problem> {
    let tree = Node::parse(source, 0).map_err(|e| e.problem(source))?;
    // ron has the last word, and its position is where it stopped.
    ron().from_str::<serde::de::IgnoredAny>(&source.text).map_err(|e| {
        let line = source.text.split_inclusive('\n').take(e.span.start.line - 1).map(str::len).sum::<usize>();
        let column = source.text[line..].chars().take(e.span.start.col - 1).map(char::len_utf8).sum::<usize>();
        Problem::files(format!("this is not RON: {}", e.code)).at(source.at(line + column..line + column + 1))
    })?;
    Ok(tree)
}

/// The text of a file that was read.
pub fn text(file: &File) -> Result<Arc<Source>, Problem> {
    let whole = |what: String| Problem::files(what).at(At::file(&shown(&file.path)));
    if file.bytes.len() > MAX_BYTES {
        let what = format!("the file has {} bytes, more than the {MAX_BYTES} that are read", file.bytes.len());
        return Err(whole(what).hint("is this a scene or a material?"));
    }
    match std::str::from_utf8(&file.bytes) {
        Ok(text) if text.trim_start_matches('\u{feff}').trim().is_empty() => {
            Err(whole("the file is empty".into()).hint("begin with Scene(version: 1, …) or Material(version: 1, …)"))
        }
        Ok(text) => Ok(Source::of_file(&file.path, text.strip_prefix('\u{feff}').unwrap_or(text).to_string())),
        Err(_) => {
            Err(whole("the file is not UTF-8 text".into()).hint("is this a scene or a material? Then save it as UTF-8"))
        }
    }
}

/// A file that nothing names but the user.
pub fn read(files: &Files, path: &Path) -> Result<File, Problem> {
    files.read(path).map_err(|e| unreadable(path, &e, "is the name right?"))
}

pub fn open(files: &Files, path: &Path) -> Result<Node, Problem> {
    parse(&text(&read(files, path)?)?)
}

/// What a file is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Scene,
    Material,
    /// What is to be measured of a scene.
    Bench,
}

impl Kind {
    pub fn word(self) -> &'static str {
        match self {
            Kind::Scene => "Scene",
            Kind::Material => "Material",
            Kind::Bench => "Bench",
        }
    }
    /// By its name, or by fields that only one of them has.
    pub fn of(root: &Node) -> Option<Kind> {
        let has = |names: &[&str]| names.iter().any(|n| root.field(n).is_some());
        match root.name() {
            Some("Scene") => Some(Kind::Scene),
            Some("Material") => Some(Kind::Material),
            Some("Bench") => Some(Kind::Bench),
            Some(_) => None,
            None if has(&["mm_per_unit", "objects", "camera", "lights"]) => Some(Kind::Scene),
            None if has(&["medium", "surface", "base", "layers", "filter"]) => Some(Kind::Material),
            None if has(&["techniques", "repetitions", "truths"]) => Some(Kind::Bench),
            None => None,
        }
    }
}

/// That the root is a struct of this kind and of a version that is read.
pub fn check_head(root: &Node, kind: Kind) -> Result<(), Problem> {
    let word = kind.word();
    let head = || root.source.at(root.span.start..root.span.start + root.name().map_or(1, str::len));
    if let Some(name) = root.name().filter(|n| *n != word) {
        let hint = match Kind::of(root) {
            Some(other) => format!("name a file that holds a {word}( ), not a {}", other.word()),
            None => format!("write {word}( )"),
        };
        return Err(Problem::files(format!("expected {word}( ), found `{name}`")).at(head()).hint(hint));
    }
    let Some(fields) = root.fields() else {
        return Err(Problem::files(format!("expected {word}( )")).at(root.at()).hint(format!("{word}(version: 1, …)")));
    };
    let read = VERSIONS.map(|v| v.to_string()).join(", ");
    let Some(version) = fields.iter().find(|f| f.name == "version") else {
        let hint = format!("begin with {word}(version: 1, …); this program reads version {read}");
        return Err(Problem::files("the field `version` is missing").at(root.at()).hint(hint));
    };
    match version.value.value {
        Value::Number(n) if VERSIONS.iter().any(|v| f64::from(*v) == n) => Ok(()),
        _ => Err(Problem::files(format!("version {} is not one that this program reads", version.value.text()))
            .at(version.value.at())
            .path("version")
            .hint(format!("this program reads version {read}; a newer one may read this file"))),
    }
}

/// Reads a typed value and says where it failed. `path` is where `node` stands in its file.
pub fn typed<T: serde::de::DeserializeOwned>(node: &Node, path: &str) -> Result<T, Problem> {
    de::from_node(node).map_err(|e| e.problem(node, path))
}

/// Where a path that stands in `node` leads.
pub fn resolve(node: &Node, path: &str) -> PathBuf {
    node.source.dir.join(path)
}

/// Reads the file that `node`, a text, names.
pub fn named(files: &Files, node: &Node, path: &str) -> Result<File, Problem> {
    let full = resolve(node, path);
    let rule = match node.source.file.to_str() {
        Some("--set") => "paths are relative to the scene's file",
        _ => "paths are relative to the file that names them",
    };
    files.read(&full).map_err(|e| unreadable(&full, &e, rule).at(node.at()))
}

/// Whether a problem stands in a text, or is one of a file as a whole.
pub fn has_line(problem: &Problem) -> bool {
    problem.at.as_ref().is_some_and(|at| at.line > 0)
}

/// A problem found in another file, told at the place that names that file.
pub fn at_its_name(problem: Problem, node: &Node) -> Problem {
    let place = match &problem.at {
        Some(at) if at.line > 0 => format!("{}:{}:{}: ", at.file.display(), at.line, at.column),
        Some(at) => format!("{}: ", at.file.display()),
        None => String::new(),
    };
    Problem { what: format!("{place}{}", problem.what), ..problem }.at(node.at())
}

/// What to say of a file that cannot be read: why, where it was looked for, and what is there; else the `rule` for paths.
fn unreadable(path: &Path, error: &std::io::Error, rule: &str) -> Problem {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let why = match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_string(),
        std::io::ErrorKind::IsADirectory => "it is a folder".to_string(),
        _ => error.to_string(),
    };
    let mut there: Vec<String> = std::fs::read_dir(folder)
        .map(|all| all.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect())
        .unwrap_or_default();
    there.sort();
    // What all names share, the extension, says nothing of which is meant.
    let stem = |name: &str| Path::new(name).with_extension("").to_string_lossy().into_owned();
    let alike = |name: &String| Path::new(name).extension() == path.extension();
    let stems: Vec<String> = there.iter().filter(|name| alike(name)).map(|name| stem(name)).collect();
    let near = nearest(&stem(&file), stems.iter().map(String::as_str));
    let near = there.iter().find(|name| alike(name) && Some(stem(name).as_str()) == near);
    let looked = match shown(folder) {
        here if here.as_os_str() == "." => "looked in the current folder".to_string(),
        folder => format!("looked in {}", folder.display()),
    };
    let hint = match near {
        _ if path.is_dir() => "name a file in it".to_string(),
        Some(right) if *right != file => format!("{looked}; did you mean `{right}`?"),
        _ if path.components().any(|c| c.as_os_str() == "models") => {
            format!("{looked}; tools/fetch-models brings the models")
        }
        _ if folder.is_file() => format!("{looked}, which is a file, not a folder"),
        _ if !folder.is_dir() => format!("{looked}, which is not there; {rule}"),
        _ => format!("{looked}; {rule}"),
    };
    Problem::files(format!("cannot read `{}`: {why}", shown(path).display())).at(At::file(&shown(path))).hint(hint)
}

/// A material file with all that it inherits, each value with the place that it came from.
///
/// `fits` is asked about every file of the chain by itself, so that what is wrong in a base is found where it stands even
/// when it is overridden.
pub fn material(files: &Files, file: &File, fits: &dyn Fn(&Node) -> Result<(), Problem>) -> Result<Node, Problem> {
    let mut chain = vec![file.path.clone()];
    let mut tree = head_of(file, fits)?;
    while let Some(base) = tree.field("base").map(Node::unwrapped).filter(|n| n.name() != Some("None")).cloned() {
        let name = match &base.value {
            Value::Text(name) => name.clone(),
            _ => typed::<String>(&base, "base")?,
        };
        let next = named(files, &base, &name).map_err(|e| e.path("base"))?;
        // The same file, whatever links lead to it.
        let real = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| shown(path));
        if chain.iter().any(|path| real(path) == real(&next.path)) {
            chain.push(next.path.clone());
            let shown: Vec<String> = chain.iter().map(|p| shown(p).display().to_string()).collect();
            return Err(Problem::files("a material cannot inherit from itself")
                .at(base.at())
                .path("base")
                .hint(format!("break the circle {}", shown.join(" -> "))));
        }
        chain.push(next.path.clone());
        // The base's own `base` leads on; the one that was just followed is done with.
        let mut under =
            head_of(&next, fits).map_err(|e| if has_line(&e) { e } else { at_its_name(e, &base).path("base") })?;
        if let Value::Struct(_, fields) = &mut tree.value {
            fields.retain(|f| f.name != "base");
        }
        merge(&mut under, tree);
        tree = under;
    }
    if let Value::Struct(_, fields) = &mut tree.value {
        fields.retain(|f| f.name != "base");
    }
    Ok(tree)
}

fn head_of(file: &File, fits: &dyn Fn(&Node) -> Result<(), Problem>) -> Result<Node, Problem> {
    let tree = parse(&text(file)?)?;
    check_head(&tree, Kind::Material)?;
    fits(&tree)?;
    Ok(tree)
}

/// Structs merge; lists, enum variants and single values replace whole. The place of a merged struct is `over`'s.
fn merge(under: &mut Node, over: Node) {
    let plain =
        |node: &Node| node.name().is_none_or(|n| STRUCTS.contains(&n)) && matches!(node.value, Value::Struct(..));
    if !(plain(under) && plain(&over)) {
        *under = over;
        return;
    }
    let (source, span) = (over.source.clone(), over.span.clone());
    let (Value::Struct(_, old), Value::Struct(_, new)) = (&mut under.value, over.value) else { unreachable!() };
    for Field { name, source, name_span, value } in new {
        match old.iter_mut().find(|f| f.name == name) {
            Some(field) => {
                merge(&mut field.value, value);
                (field.source, field.name_span) = (source, name_span);
            }
            None => old.push(Field { name, source, name_span, value }),
        }
    }
    (under.source, under.span) = (source, span);
}

/// Makes the texts of `image:` fields, inherited from other folders, relative to the file `path`.
pub fn rebase(root: &mut Node, path: &Path) {
    fn each(node: &mut Node, home: &Path) {
        match &mut node.value {
            Value::Struct(_, fields) => {
                for field in fields {
                    let dir = field.value.source.dir.clone();
                    if let (Value::Text(text), "image") = (&mut field.value.value, field.name.as_str()) {
                        // A base's folder begins with the one that named it, so what follows leads there.
                        let full = dir.join(&*text);
                        *text = full.strip_prefix(home).unwrap_or(&full).to_string_lossy().into_owned();
                    }
                    each(&mut field.value, home);
                }
            }
            Value::List(items) | Value::Tuple(_, items) => items.iter_mut().for_each(|item| each(item, home)),
            _ => {}
        }
    }
    each(root, path.parent().unwrap_or(Path::new("")));
}
