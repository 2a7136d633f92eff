//! Paths into a tree: `objects[0].transform.scale`, `objects.bunny.mesh.radius`, `bookmarks["ear, backlit"].fov_y_deg`.
//!
//! Messages write them, `--set` reads them. A member of a list goes by its number or by its `name:`.

use crate::problem::{Problem, nearest};
use crate::scene::tree::{Field, MAX_DEPTH, Node, Source, Value};
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// One step of a path.
#[derive(Clone, Debug)]
enum Step {
    /// `[0]`
    Index(usize),
    /// `.name`, `["name"]`, or `.0`, which is a number only where nothing has it as its name.
    Name(String),
}

impl Step {
    fn name(&self) -> String {
        match self {
            Step::Index(i) => i.to_string(),
            Step::Name(name) => name.clone(),
        }
    }
    fn number(&self) -> Option<usize> {
        match self {
            Step::Index(i) => Some(*i),
            Step::Name(name) => name.parse().ok(),
        }
    }
    fn is(&self, word: &str) -> bool {
        matches!(self, Step::Name(name) if name == word)
    }
}

fn steps(path: &str) -> Vec<Step> {
    let mut out = Vec::new();
    let mut rest = path;
    while !rest.is_empty() {
        if let Some(quoted) = rest.strip_prefix("[\"") {
            let (key, after) = quoted.split_once("\"]").unwrap_or((quoted, ""));
            out.push(Step::Name(key.to_string()));
            rest = after;
        } else {
            let bracket = rest.starts_with('[');
            let bare = rest.trim_start_matches(['.', '[']);
            let end = bare.find(['.', '[', ']']).unwrap_or(bare.len());
            out.push(match bare[..end].parse() {
                Ok(i) if bracket => Step::Index(i),
                _ => Step::Name(bare[..end].to_string()),
            });
            rest = bare[end..].trim_start_matches(']');
        }
    }
    out
}

/// `path.name`, or `name` at the root.
pub fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_string() } else { format!("{path}.{name}") }
}

impl Node {
    fn member(&self, step: &Step) -> Option<&Node> {
        match &self.value {
            Value::Struct(_, fields) => fields.iter().find(|f| step.is(&f.name)).map(|f| &f.value),
            Value::List(items) => position(items, step).map(|i| &items[i]),
            Value::Map(items) => items.iter().find(|(k, _)| step.is(key(k))).map(|(_, v)| v),
            Value::Tuple(_, items) => match step.number() {
                Some(i) => items.get(i),
                None => items.first().filter(|_| items.len() == 1)?.member(step),
            },
            _ => None,
        }
    }

    /// The value at `path`, if it is there.
    pub fn get(&self, path: &str) -> Option<&Node> {
        steps(path).iter().try_fold(self, |node, step| node.member(step))
    }

    /// The value at `path`, or what would hold it: a value that was left out has no place of its own.
    pub fn nearest(&self, path: &str) -> &Node {
        let mut node = self;
        for step in steps(path) {
            match node.member(&step) {
                Some(member) => node = member,
                None => break,
            }
        }
        node
    }

    /// Calls `visit` with every value below this one and its path, in the order of the text.
    pub fn walk<'a>(&'a self, path: &str, visit: &mut dyn FnMut(&str, &'a Node)) {
        visit(path, self);
        match &self.value {
            Value::Struct(_, fields) => fields.iter().for_each(|f| f.value.walk(&join(path, &f.name), visit)),
            Value::List(items) => items.iter().enumerate().for_each(|(i, n)| n.walk(&format!("{path}[{i}]"), visit)),
            Value::Tuple(_, items) => items.iter().enumerate().for_each(|(i, n)| n.walk(&format!("{path}.{i}"), visit)),
            Value::Map(items) => {
                items.iter().for_each(|(k, v)| v.walk(&format!("{path}[{}]", k.canonical()), visit));
            }
            _ => {}
        }
    }

    /// The path of the innermost value, or name of a field, that holds `span` of `source`.
    pub fn path_of(&self, source: &Arc<Source>, span: &Range<usize>) -> String {
        let mut found = String::new();
        self.walk("", &mut |path, node| {
            let here = Arc::ptr_eq(&node.source, source) && node.span.start <= span.start && span.end <= node.span.end;
            if here {
                found = path.to_string();
            }
            for field in node.fields().unwrap_or_default() {
                if Arc::ptr_eq(&field.source, source) && field.name_span == *span {
                    found = join(path, &field.name);
                }
            }
        });
        found
    }

    /// Puts `value` at `path`, adding the field when it is not there. `at` is the place to complain about.
    fn set(&mut self, path: &[Step], done: &mut String, value: Node, flag: &Flag) -> Result<(), Problem> {
        let Some((step, rest)) = path.split_first() else {
            *self = value;
            return Ok(());
        };
        // A word or an empty bracket is a struct that leaves out everything.
        if let Value::Word(name) = &self.value {
            self.value = Value::Struct(Some(name.clone()), Vec::new());
        } else if let Value::Tuple(name, items) = &self.value
            && items.is_empty()
        {
            self.value = Value::Struct(name.clone(), Vec::new());
        }
        let parent = std::mem::take(done);
        match &mut self.value {
            Value::Struct(_, fields) => {
                *done = join(&parent, &step.name());
                let i = fields.iter().position(|f| step.is(&f.name)).unwrap_or_else(|| {
                    fields.push(flag.field(&step.name()));
                    fields.len() - 1
                });
                fields[i].value.set(rest, done, value, flag)
            }
            Value::Map(items) => {
                let _ = write!(done, "{parent}[{:?}]", step.name());
                let i = items.iter().position(|(k, _)| step.is(key(k))).unwrap_or_else(|| {
                    items.push((flag.text(&step.name()), flag.empty()));
                    items.len() - 1
                });
                items[i].1.set(rest, done, value, flag)
            }
            Value::List(items) => match position(items, step) {
                Some(i) => {
                    let _ = write!(done, "{parent}[{i}]");
                    items[i].set(rest, done, value, flag)
                }
                None => Err(flag.no_member(&parent, &step.name(), items)),
            },
            Value::Tuple(_, items) => match step.number() {
                Some(i) if i < items.len() => {
                    let _ = write!(done, "{parent}.{i}");
                    items[i].set(rest, done, value, flag)
                }
                None if items.len() == 1 => {
                    *done = parent;
                    items[0].set(path, done, value, flag)
                }
                _ => Err(flag.problem(format!("`{parent}` has no member `{}`", step.name()))),
            },
            _ => Err(flag.problem(format!("`{parent}` is a single value and has no field `{}`", step.name()))),
        }
    }

    /// `--set PATH=RON`, in place. What is set comes from a text of its own, `PATH=RON`, so that a problem with it says so.
    pub fn set_from_flag(&mut self, path: &str, ron: &str, dir: &Path) -> Result<(), Problem> {
        let source = Source::of_flag("--set", dir, format!("{path}={ron}"));
        let flag = Flag { source: source.clone(), path: 0..path.len() };
        let steps = steps(path);
        // As with brackets in a text: who walks the tree goes as deep as it is.
        if steps.len() > MAX_DEPTH {
            return Err(flag.problem(format!("the path has more than {MAX_DEPTH} members")));
        }
        let value = Node::parse(&source, path.len() + 1).map_err(|e| e.problem(&source).path(path))?;
        self.set(&steps, &mut String::new(), value, &flag)
    }
}

fn key(node: &Node) -> &str {
    match &node.value {
        Value::Text(text) => text,
        _ => node.text(),
    }
}

/// The name of a member of a list: its `name:`.
fn name_of(node: &Node) -> Option<&str> {
    match &node.field("name")?.value {
        Value::Text(name) => Some(name),
        _ => None,
    }
}

fn position(items: &[Node], step: &Step) -> Option<usize> {
    let named = match step {
        Step::Index(_) => None,
        Step::Name(name) => items.iter().position(|n| name_of(n) == Some(name)),
    };
    named.or(step.number()).filter(|i| *i < items.len())
}

/// The words `--set PATH=RON`.
struct Flag {
    source: Arc<Source>,
    path: Range<usize>,
}

impl Flag {
    fn problem(&self, what: String) -> Problem {
        Problem::files(what).at(self.source.at(self.path.clone())).hint("PATH is like objects.bunny.transform.scale")
    }
    fn no_member(&self, list: &str, step: &str, items: &[Node]) -> Problem {
        let names: Vec<&str> = items.iter().filter_map(name_of).collect();
        let hint = match nearest(step, names.iter().copied()) {
            Some(name) => format!("did you mean `{name}`?"),
            None if items.is_empty() => "the list is empty".to_string(),
            None => format!("0 to {}, or one of {}", items.len() - 1, names.join(", ")),
        };
        Problem::files(format!("`{list}` has no member `{step}`")).at(self.source.at(self.path.clone())).hint(hint)
    }
    fn node(&self, value: Value) -> Node {
        Node { source: self.source.clone(), span: self.path.clone(), value }
    }
    fn empty(&self) -> Node {
        self.node(Value::Struct(None, Vec::new()))
    }
    fn text(&self, text: &str) -> Node {
        self.node(Value::Text(text.to_string()))
    }
    fn field(&self, name: &str) -> Field {
        let (source, name_span) = (self.source.clone(), self.path.clone());
        Field { name: name.to_string(), source, name_span, value: self.empty() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(text: &str) -> Node {
        Node::parse(&Source::of_file(Path::new("a.ron"), text.to_string()), 0).unwrap()
    }

    const SCENE: &str =
        r#"Scene(objects: [(name: "bunny", mesh: Sphere(radius: 2))], marks: {"ear, back": (fov: 3)}, eye: (1, 2, 3))"#;

    #[test]
    fn members_go_by_number_name_and_key() {
        let tree = tree(SCENE);
        for (path, text) in [
            ("objects[0].mesh.radius", "2"),
            ("objects.0.mesh.radius", "2"),
            ("objects.bunny.mesh.radius", "2"),
            ("marks[\"ear, back\"].fov", "3"),
            ("eye.1", "2"),
        ] {
            assert_eq!(tree.get(path).unwrap().text(), text, "{path}");
        }
        assert!(tree.get("objects[1]").is_none());
        assert_eq!(tree.nearest("objects[0].mesh.subdivisions").text(), "Sphere(radius: 2)");
        let mut paths = Vec::new();
        tree.walk("", &mut |path, node| {
            assert!(std::ptr::eq(tree.get(path).unwrap(), node), "{path}");
            paths.push(path.to_string());
        });
        assert!(paths.contains(&"marks[\"ear, back\"].fov".to_string()));
    }

    #[test]
    fn what_is_set_is_found_again_and_the_rest_stays() {
        for (path, ron) in [
            ("objects.bunny.mesh.radius", "7"),
            ("objects.bunny.transform.scale", "(1, 2, 3)"),
            ("objects[0].mesh", "File(\"a.obj\")"),
            ("marks.new.fov", "4"),
            ("eye.2", "9"),
            ("view", "(technique: LongRange(layers: 8))"),
        ] {
            let mut set = tree(SCENE);
            set.set_from_flag(path, ron, Path::new("")).unwrap();
            assert_eq!(set.get(path).unwrap().canonical(), ron, "{path}");
            assert_eq!(set.get("objects.bunny.name").unwrap().text(), "\"bunny\"");
            assert_eq!(set.get("eye.0").unwrap().text(), "1");
        }
        let deep = format!("eye{}", ".x".repeat(100_000));
        assert!(tree("Scene()").set_from_flag(&deep, "1", Path::new("")).unwrap_err().what.contains("64 members"));
        let error = tree(SCENE).set_from_flag("objects.bunni.mesh", "1", Path::new("")).unwrap_err();
        assert_eq!(
            error.to_string(),
            "--set:1:1: error: `objects` has no member `bunni`\n  |\n1 | objects.bunni.mesh=1\n  | ^^^^^^^^^^^^^^^^^^\n  \
             = hint: did you mean `bunny`?"
        );
    }
}
