use super::Answer;
use crate::problem::{Problem, Problems};
use crate::scene::Kind;
use crate::session::{Options, Session};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Read files with all that they name, and report every problem; draws nothing
#[derive(clap::Args)]
pub struct Check {
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Print each file with every default written out
    #[arg(long)]
    defaults: bool,
}

impl Check {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let session = Session::new(options);
        let mut answer = Answer::new("", json!({ "files": [] }));
        let (mut warnings, mut errors) = (Vec::new(), Vec::new());
        for file in &self.files {
            match self.one(&session, file) {
                Ok((text, found)) => {
                    answer.text += &text;
                    warnings.extend(found);
                }
                Err(Problems(found)) => errors.extend(found),
            }
        }
        if !errors.is_empty() {
            warnings.extend(errors);
            return Err(Problems(warnings));
        }
        let names: Vec<String> = self.files.iter().map(|file| file.display().to_string()).collect();
        answer.json = json!({ "files": names });
        Ok(answer.warn(&warnings))
    }

    fn one(&self, session: &Session, file: &Path) -> Result<(String, Vec<Problem>), Problems> {
        let (what, warnings) = match session.reader.kind_of(file)? {
            Kind::Scene => {
                let (scene, warnings) = session.scene(file)?;
                (format!("a scene of {} object(s) and {} light(s)", scene.objects.len(), scene.lights.len()), warnings)
            }
            Kind::Material => ("a material".to_string(), session.reader.material(file)?.1),
        };
        let text = match self.defaults {
            true => session.reader.defaults(file)? + "\n",
            false => format!("{}: {what}, no errors\n", file.display()),
        };
        Ok((text, warnings))
    }
}
