use super::Answer;
use crate::image::write_file;
use crate::optics::presets::{preset, presets};
use crate::problem::{At, Cause, Problem, Problems, nearest};
use serde_json::json;
use std::path::PathBuf;

/// Write a commented scene and a material that render as they are
#[derive(clap::Args)]
pub struct New {
    /// The scene's name: NAME.ron and NAME.material.ron are written
    name: PathBuf,
    /// The substance to begin with; `diaphane media list` lists them
    #[arg(long, value_name = "PRESET", default_value = "marble")]
    from: String,
}

impl New {
    pub fn run(self) -> Result<Answer, Problems> {
        let Some(found) = preset(&self.from) else {
            let names: Vec<&str> = presets().map(|preset| preset.name).collect();
            let near = nearest(&self.from, names.iter().copied());
            return Err(Problem::new(Cause::Words, format!("--from: there is no preset `{}`", self.from))
                .hint(near.map_or(format!("there is {}", names.join(", ")), |near| format!("did you mean `{near}`?")))
                .into());
        };
        let name = self.name.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let name = name.strip_suffix(".ron").unwrap_or(&name).to_string();
        if name.is_empty() {
            return Err(Problem::new(Cause::Words, "a scene needs a name").hint("diaphane new pebble").into());
        }
        // The name is a text in the scene, and words that are typed again and again.
        if let Some(odd) = name.chars().find(|c| c.is_control() || "\"\\{}".contains(*c)) {
            let what = format!("{odd:?} cannot stand in the name of a scene");
            return Err(Problem::new(Cause::Words, what).hint("letters, digits, - and _ can").into());
        }
        let scene = self.name.with_file_name(format!("{name}.ron"));
        let material = self.name.with_file_name(format!("{name}.material.ron"));
        for file in [&scene, &material] {
            if file.exists() {
                return Err(Problem::new(Cause::Words, "it is there already, and stays as it is")
                    .at(At::file(file))
                    .hint("choose another name, or move the file away")
                    .into());
            }
        }
        let fill = |template: &str| template.replace("{NAME}", &name).replace("{PRESET}", found.name);
        write_file(&material, fill(include_str!("new_material.ron")).as_bytes())?;
        write_file(&scene, fill(include_str!("new_scene.ron")).as_bytes())?;
        let text = format!(
            "{}\n{}\n\nNow: diaphane render {} -o {}\n",
            scene.display(),
            material.display(),
            typed(&scene.display().to_string()),
            typed(&format!("{name}.png")),
        );
        let files = [scene.display().to_string(), material.display().to_string()];
        Ok(Answer::new(text, json!({ "files": files })))
    }
}

/// A word as a shell wants it.
fn typed(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./,".contains(c);
    if word.chars().all(plain) { word.to_string() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}
