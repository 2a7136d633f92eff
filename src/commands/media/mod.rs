//! What is known of media, by name, by file or by coefficients.

mod profile;
mod show;

use super::Answer;
use crate::optics::medium::Medium;
use crate::optics::phase::Phase;
use crate::optics::presets::{Preset, preset, presets};
use crate::optics::profile::Model;
use crate::problem::{Cause, Problem, Problems, nearest};
use crate::session::{Options, Session};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::Path;

/// Look into the library of measured media
#[derive(clap::Subcommand)]
pub enum Media {
    /// List all of them with their coefficients
    List,
    Show(show::Show),
    Profile(profile::ProfileOf),
}

impl Media {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let session = Session::new(options);
        match self {
            Media::List => Ok(list()),
            Media::Show(command) => command.run(&session),
            Media::Profile(command) => command.run(&session),
        }
    }
}

fn list() -> Answer {
    let three = |v: DVec3| format!("{:>8} {:>8} {:>8}", short(v.x), short(v.y), short(v.z));
    let line = |preset: Preset| {
        let medium = preset.medium;
        format!(
            "{:<12}  {}  {}  {:>4}  {}\n",
            preset.name,
            three(medium.sigma_s_prime()),
            three(medium.sigma_a),
            preset.ior,
            preset.source
        )
    };
    let head = format!(
        "{:<12}  {:<26}  {:<26}   ior  measured by\n",
        "", "sigma_s' [1/mm]  R  G  B", "sigma_a [1/mm]  R  G  B"
    );
    let facts: Vec<Value> = presets()
        .map(|preset| {
            json!({ "name": preset.name, "ior": preset.ior, "source": preset.source, "medium": preset.medium })
        })
        .collect();
    Answer::new(head + &presets().map(line).collect::<String>(), json!({ "media": facts }))
}

/// To four digits, without the zeros that follow.
fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// A medium with what lies about it.
struct Found {
    medium: Medium,
    phase: Phase,
    ior: f64,
    model: Model,
    warnings: Vec<Problem>,
}

/// The medium that words name: one of the library, or a material's file.
fn find(name: &str, session: &Session) -> Result<Found, Problems> {
    if let Some(Preset { medium, phase, ior, .. }) = preset(name) {
        return Ok(Found { medium, phase, ior, model: Model::default(), warnings: Vec::new() });
    }
    if Path::new(name).is_file() {
        let (material, warnings) = session.reader.material(Path::new(name))?;
        let medium = material.medium.medium().copied().ok_or_else(|| {
            Problem::files(format!("{name} is opaque: nothing scatters below its surface"))
                .hint("name a material with a medium")
        })?;
        let (phase, ior, model) = (material.phase, material.surface.ior, material.profile);
        return Ok(Found { medium, phase, ior, model, warnings });
    }
    let near = nearest(name, presets().map(|preset| preset.name));
    Err(Problem::new(Cause::Words, format!("there is no medium and no file `{name}`"))
        .hint(match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => "`diaphane media list` lists the media".into(),
        })
        .into())
}

/// JSON knows no infinity.
fn finite(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}
