//! A technique as a file or a flag spells it. Who knows the techniques reads it; this room keeps its words and place.

use crate::problem::Problem;
use crate::scene::document::{parse, typed};
use crate::scene::path::join;
use crate::scene::tree::{Node, Source};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;
use std::sync::Arc;

/// `SphericalThickness(bands: 5)`: equal when the words are, whatever the spaces and comments.
#[derive(Clone, Debug, Serialize)]
pub struct TechniqueText {
    pub name: String,
    /// The name with its settings, in one line, without comments.
    pub ron: String,
    /// Where it stands in its file: `objects[0].technique`.
    #[serde(skip)]
    path: String,
    #[serde(skip)]
    node: Arc<Node>,
}

impl PartialEq for TechniqueText {
    fn eq(&self, other: &TechniqueText) -> bool {
        self.ron == other.ron
    }
}

impl TechniqueText {
    pub(super) fn of(node: &Node, path: &str) -> Result<TechniqueText, Problem> {
        let node = node.unwrapped();
        match node.name() {
            Some(name) => Ok(TechniqueText {
                name: name.to_string(),
                ron: node.canonical(),
                path: path.to_string(),
                node: Arc::new(node.clone()),
            }),
            None => Err(Problem::files("expected a technique")
                .at(node.at())
                .path(path)
                .hint("write its name with brackets: LongRange() or LongRange(layers: 8)")),
        }
    }

    /// The words of a flag, `--technique`. Paths in them are relative to the current folder.
    pub fn from_flag(flag: &str, text: &str) -> Result<TechniqueText, Problem> {
        let node = parse(&Source::of_flag(flag, Path::new(""), text.to_string()))?;
        TechniqueText::of(&node, "")
    }

    /// The settings in the brackets, a struct with `#[serde(default, deny_unknown_fields)]`. `Name` reads as `Name()`.
    pub fn settings<T: DeserializeOwned>(&self) -> Result<T, Problem> {
        typed(&self.node.content(), &self.path)
    }

    /// A problem with one of its settings, or with all of it when `setting` is empty.
    pub fn problem(&self, setting: &str, what: impl Into<String>) -> Problem {
        let node = self.node.nearest(setting);
        let path = if setting.is_empty() { self.path.clone() } else { join(&self.path, setting) };
        let problem = Problem::files(what).at(node.at());
        if path.is_empty() { problem } else { problem.path(path) }
    }

    /// The problem that there is no technique of this name.
    pub fn unknown(&self, known: &[&str]) -> Problem {
        let mut problem = self.problem("", format!("there is no technique `{}`", self.name));
        if let Some(at) = &mut problem.at {
            at.width = at.width.min(self.name.chars().count());
        }
        problem.hint(crate::scene::de::suggest(&self.name, known.iter().copied()))
    }
}
