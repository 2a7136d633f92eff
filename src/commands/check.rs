use super::{Answer, counted};
use crate::problem::{Problem, Problems};
use crate::render;
use crate::scene::Kind;
use crate::session::{Options, Session};
use crate::techniques;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Read files with all that they name, and report every problem; draws nothing
#[derive(clap::Args)]
pub struct Check {
    /// Scenes and materials, and what is to be measured of scenes
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print each file with every default written out
    #[arg(long)]
    defaults: bool,
}

/// One file without errors.
struct Sound {
    text: String,
    facts: Value,
    warnings: Vec<Problem>,
}

impl Check {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let session = Session::new(options);
        let (mut text, mut facts, mut told) = (String::new(), Vec::new(), Vec::new());
        for file in &self.files {
            let found = match self.one(&session, file) {
                Ok(sound) => {
                    text += &sound.text;
                    facts.push(sound.facts);
                    sound.warnings
                }
                Err(Problems(found)) => found,
            };
            // Scenes share materials, and a material may be asked for by itself too.
            found.into_iter().for_each(|problem| {
                if !told.contains(&problem) {
                    told.push(problem)
                }
            });
        }
        match told.iter().any(Problem::is_error) {
            true => Err(Problems(told)),
            false => Ok(Answer::new(text, json!({ "files": facts })).warn(told)),
        }
    }

    fn one(&self, session: &Session, file: &Path) -> Result<Sound, Problems> {
        let (kind, what, warnings) = match session.reader.kind_of(file)? {
            Kind::Scene => {
                let (scene, warnings) = session.scene(file)?;
                if let Err(Problems(refused)) = render::check(&scene, &scene.view.technique) {
                    return Err(Problems(warnings.into_iter().chain(refused).collect()));
                }
                let (objects, lights) = (counted(scene.objects.len(), "object"), counted(scene.lights.len(), "light"));
                ("scene", format!("a scene of {objects} and {lights}"), warnings)
            }
            Kind::Material => ("material", "a material".to_string(), session.reader.material(file)?.1),
            Kind::Bench => {
                let settings = session.reader.bench(file)?;
                let named = settings.techniques.unwrap_or_default();
                let wrong: Vec<Problem> = named.iter().filter_map(|text| techniques::read(text).err()).collect();
                if !wrong.is_empty() {
                    return Err(Problems(wrong));
                }
                ("bench", "what to measure of a scene".to_string(), Vec::new())
            }
        };
        let mut facts = json!({ "file": file.display().to_string(), "kind": kind });
        let text = match self.defaults {
            true => {
                let text = session.reader.defaults(file)?;
                facts["defaults"] = json!(text);
                format!("// {} with every default written out.\n{text}", file.display())
            }
            false => {
                let judgement = if warnings.is_empty() { "sound".into() } else { counted(warnings.len(), "warning") };
                format!("{}: {what}: {judgement}\n", file.display())
            }
        };
        Ok(Sound { text, facts, warnings })
    }
}
