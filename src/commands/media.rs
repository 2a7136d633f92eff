use super::Answer;
use crate::optics::medium::Medium;
use crate::optics::presets::{Preset, preset, presets};
use crate::problem::{Cause, Problem, Problems, nearest};
use crate::scene::Scene;
use crate::session::{Options, Session};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Look into the library of measured media
#[derive(clap::Subcommand)]
pub enum Media {
    /// List all of them with their coefficients
    List,
    /// Print every quantity that follows from a medium, in mm
    Show {
        /// A medium of the library, or a material's file
        #[arg(value_name = "NAME|FILE")]
        medium: String,
        /// Print it also in units of this scene, in pixels, and as a share of its objects
        #[arg(long, value_name = "SCENE")]
        scene: Option<PathBuf>,
    },
}

impl Media {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        match self {
            Media::List => Ok(list()),
            Media::Show { medium, scene } => show(&medium, scene.as_deref(), options),
        }
    }
}

fn row(v: DVec3) -> String {
    format!("{:>10.5} {:>10.5} {:>10.5}", v.x, v.y, v.z)
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

fn show(name: &str, scene: Option<&Path>, options: Options) -> Result<Answer, Problems> {
    let session = Session::new(options);
    let (medium, ior, mut warnings) = match preset(name) {
        Some(preset) => (preset.medium, preset.ior, Vec::new()),
        None if Path::new(name).is_file() => {
            let (material, warnings) = session.reader.material(Path::new(name))?;
            let medium = material.medium.medium().copied().ok_or_else(|| {
                Problem::files(format!("{name} is opaque: nothing scatters below its surface"))
                    .hint("name a material with a medium")
            })?;
            (medium, material.surface.ior, warnings)
        }
        None => {
            let near = nearest(name, presets().map(|preset| preset.name));
            return Err(Problem::new(Cause::Words, format!("there is no medium and no file `{name}`"))
                .hint(match near {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => "`diaphane media list` lists the media".into(),
                })
                .into());
        }
    };
    let quantities = quantities(&medium, ior);
    let mut text = format!("{name}, ior {ior}\n{:<38} {:>10} {:>10} {:>10}\n", "", "R", "G", "B");
    for (name, value) in &quantities {
        text += &format!("{name:<38} {}\n", row(*value));
    }
    let mut facts = json!({ "name": name, "ior": ior });
    for (name, value) in &quantities {
        facts[name] = json!(value.to_array().map(finite));
    }
    if let Some(path) = scene {
        let (scene, told) = session.scene(path)?;
        warnings.extend(told);
        let (more, in_scene) = against(&scene, &medium);
        text += &more;
        facts["scene"] = in_scene;
    }
    Ok(Answer::new(text, facts).warn(warnings))
}

/// JSON knows no infinity.
fn finite(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

fn quantities(medium: &Medium, ior: f64) -> Vec<(&'static str, DVec3)> {
    vec![
        ("sigma_a [1/mm]", medium.sigma_a),
        ("sigma_s [1/mm]", medium.sigma_s),
        ("g", medium.g),
        ("sigma_t [1/mm]", medium.sigma_t()),
        ("sigma_s' [1/mm]", medium.sigma_s_prime()),
        ("sigma_t' [1/mm]", medium.sigma_t_prime()),
        ("sigma_tr [1/mm]", medium.sigma_tr()),
        ("albedo", medium.albedo()),
        ("reduced albedo", medium.albedo_prime()),
        ("multiple-scattering albedo", medium.multiple_scattering_albedo(ior)),
        ("mean free path [mm]", medium.mean_free_path()),
        ("reduced mean free path [mm]", medium.mean_free_path_prime()),
        ("scattering distance 1/sigma_tr [mm]", 1.0 / medium.sigma_tr()),
    ]
}

/// The scattering distance against a scene: in its units, as a share of each object, in pixels at the camera's target.
fn against(scene: &Scene, medium: &Medium) -> (String, Value) {
    let distance = 1.0 / medium.sigma_tr() / scene.mm_per_unit;
    let camera = &scene.camera;
    let pixel = 2.0 * (0.5 * camera.fov_y_deg.to_radians()).tan() * camera.eye.distance(camera.target)
        / f64::from(scene.view.size.1);
    let mut text = format!("{:<38} {}\n", "scattering distance [scene units]", row(distance));
    text += &format!("{:<38} {}\n", "scattering distance [pixels]", row(distance / pixel));
    let mut shares = serde_json::Map::new();
    for object in &scene.objects {
        let share = distance / crate::frame::extent(object);
        text += &format!("{:<38} {}\n", format!("  as a share of `{}`", object.name), row(share));
        shares.insert(object.name.clone(), json!(share.to_array().map(finite)));
    }
    let facts = json!({
        "units": distance.to_array().map(finite),
        "pixels": (distance / pixel).to_array().map(finite),
        "share_of_object": shares,
    });
    (text, facts)
}
