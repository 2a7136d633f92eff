use super::Answer;
use crate::problem::{Cause, Problem, Problems, nearest};
use crate::techniques::REGISTRY;
use serde_json::json;

/// List the techniques, or print the manual of one
#[derive(clap::Args)]
pub struct Techniques {
    name: Option<String>,
}

impl Techniques {
    pub fn run(self) -> Result<Answer, Problems> {
        let Some(name) = self.name else {
            let text: String = REGISTRY.iter().map(|entry| format!("  {}\n", entry.summary())).collect();
            let facts: Vec<_> =
                REGISTRY.iter().map(|entry| json!({ "name": entry.name, "about": entry.summary() })).collect();
            return Ok(Answer::new(text, json!({ "techniques": facts })));
        };
        let entry = REGISTRY.iter().find(|entry| entry.name.eq_ignore_ascii_case(&name)).ok_or_else(|| {
            let names: Vec<&str> = REGISTRY.iter().map(|entry| entry.name).collect();
            let near = nearest(&name, names.iter().copied());
            Problem::new(Cause::Words, format!("there is no technique `{name}`"))
                .hint(near.map_or(format!("there is {}", names.join(", ")), |near| format!("did you mean {near}?")))
        })?;
        let manual = entry.manual_text();
        Ok(Answer::new(manual.clone(), json!({ "name": entry.name, "manual": manual })))
    }
}
