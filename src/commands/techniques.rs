use super::Answer;
use crate::papers::PAPERS;
use crate::problem::{Cause, Problem, Problems, nearest};
use crate::techniques::{Entry, REGISTRY, not_in_this_version};
use serde_json::json;

/// List the techniques, or print the manual of one
#[derive(clap::Args)]
pub struct Techniques {
    /// Print this one's manual: what it does, what it costs, where it fails
    name: Option<String>,
}

impl Techniques {
    pub fn run(self) -> Result<Answer, Problems> {
        let Some(name) = self.name else {
            let width = REGISTRY.iter().map(|entry| entry.name.len()).max().unwrap_or_default();
            let mut text: String =
                REGISTRY.iter().map(|entry| format!("{:<width$}  {}\n", entry.name, about(entry))).collect();
            text += "\n`diaphane techniques NAME` prints a manual.\n";
            let facts: Vec<_> =
                REGISTRY.iter().map(|entry| json!({ "name": entry.name, "about": about(entry) })).collect();
            return Ok(Answer::new(text, json!({ "techniques": facts })));
        };
        // With brackets, as scenes have it, it is the same name.
        let name = name.split('(').next().unwrap_or_default().trim();
        let entry = REGISTRY.iter().find(|entry| entry.name.eq_ignore_ascii_case(name)).ok_or_else(|| {
            let names: Vec<&str> = REGISTRY.iter().map(|entry| entry.name).collect();
            let near = nearest(name, names.iter().copied());
            let (what, hint) = not_in_this_version(name).unwrap_or_else(|| {
                let hint =
                    near.map_or(format!("there is {}", names.join(", ")), |near| format!("did you mean {near}?"));
                (format!("there is no technique `{name}`"), hint)
            });
            Problem::new(Cause::Words, what).hint(hint)
        })?;
        let manual = manual(entry);
        Ok(Answer::new(manual.clone(), json!({ "name": entry.name, "manual": manual })))
    }
}

/// The manual's first line without the name that it begins with.
fn about(entry: &Entry) -> String {
    let summary = entry.summary();
    summary.strip_prefix(entry.name).map_or(summary.as_str(), |rest| rest.trim_start_matches([':', ' '])).to_string()
}

/// The manual as it is read on a terminal: its example is the words of a scene, and the papers that it cites are named.
fn manual(entry: &Entry) -> String {
    let text = entry.manual_text();
    // What stands between the fences is checked Rust; nobody who writes scenes wants to read it.
    let prose: String = text.split("```").step_by(2).collect();
    let example = text.split_once("\"--technique\", \"").and_then(|(_, rest)| Some(rest.split_once('"')?.0));
    let example = example.map_or(format!("{}()", entry.name), str::to_string);
    let mut manual = format!("{}\n\nIn a scene:\n\n    view: (technique: {example}),\n", prose.trim_end());
    let cited: Vec<String> = PAPERS
        .iter()
        .filter(|paper| text.contains(&format!("[{}", paper.key)))
        .map(|paper| format!("  [{}] {}\n", paper.key, paper.text))
        .collect();
    if !cited.is_empty() {
        manual += &format!("\nPapers:\n\n{}", cited.concat());
    }
    manual
}
