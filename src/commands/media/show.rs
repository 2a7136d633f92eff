use super::{Answer, Found, find, finite};
use crate::optics::phase::Phase;
use crate::problem::Problems;
use crate::scene::Scene;
use crate::session::Session;
use glam::DVec3;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Print every quantity that follows from a medium, in mm
#[derive(clap::Args)]
pub struct Show {
    /// A medium of the library, or a material's file
    #[arg(value_name = "NAME|FILE")]
    medium: String,
    /// Print it also in units of this scene, in pixels, and as a share of its objects
    #[arg(long, value_name = "SCENE")]
    scene: Option<PathBuf>,
}

/// How a quantity changes with the unit of length.
#[derive(Clone, Copy, PartialEq)]
enum Dimension {
    Number,
    Length,
    PerLength,
}
use Dimension::{Length, Number, PerLength};

struct Quantity {
    name: &'static str,
    dimension: Dimension,
    value: DVec3,
}

impl Quantity {
    /// As it is printed, and named among the facts.
    fn title(&self) -> String {
        match self.dimension {
            Number => self.name.to_string(),
            Length => format!("{} [mm]", self.name),
            PerLength => format!("{} [1/mm]", self.name),
        }
    }
}

impl Show {
    pub fn run(self, session: &Session) -> Result<Answer, Problems> {
        let found = find(&self.medium, session)?;
        let quantities = quantities(&found);
        let Found { ior, phase, mut warnings, .. } = found;
        let mut text =
            format!("{}, ior {ior}, phase {phase:?}\n{:<41} {:>10} {:>10} {:>10}\n", self.medium, "", "R", "G", "B");
        let mut facts = json!({ "name": self.medium, "ior": ior, "phase": phase });
        for quantity in &quantities {
            text += &row(&quantity.title(), quantity.value);
            facts[quantity.title()] = three(quantity.value);
        }
        if let Some(path) = &self.scene {
            let (scene, told) = session.scene(path)?;
            warnings.extend(told);
            let (more, in_scene) = against(&scene, &quantities);
            text += &format!("\nIn {}, where one unit is {} mm\n{more}", path.display(), scene.mm_per_unit);
            facts["scene"] = in_scene;
        }
        Ok(Answer::new(text, facts).warn(warnings))
    }
}

fn row(title: &str, v: DVec3) -> String {
    format!("{title:<41} {:>10.5} {:>10.5} {:>10.5}\n", v.x, v.y, v.z)
}

fn three(v: DVec3) -> Value {
    json!(v.to_array().map(finite))
}

const SCATTERING_DISTANCE: &str = "scattering distance 1/sigma_tr";

fn quantities(found: &Found) -> Vec<Quantity> {
    let Found { medium, phase, ior, .. } = found;
    let quantity = |name, dimension, value| Quantity { name, dimension, value };
    let mut all = vec![
        quantity("sigma_a", PerLength, medium.sigma_a),
        quantity("sigma_s", PerLength, medium.sigma_s),
        quantity("g", Number, medium.g),
    ];
    if *phase == Phase::Schlick {
        all.push(quantity("k of the phase function", Number, medium.g.map(|g| phase.parameter(g))));
    }
    all.extend([
        quantity("sigma_t", PerLength, medium.sigma_t()),
        quantity("sigma_s'", PerLength, medium.sigma_s_prime()),
        quantity("sigma_t'", PerLength, medium.sigma_t_prime()),
        quantity("sigma_tr", PerLength, medium.sigma_tr()),
        quantity("albedo", Number, medium.albedo()),
        quantity("reduced albedo", Number, medium.albedo_prime()),
        quantity("multiple-scattering albedo", Number, medium.multiple_scattering_albedo(*ior)),
        quantity("mean free path", Length, medium.mean_free_path()),
        quantity("reduced mean free path", Length, medium.mean_free_path_prime()),
        quantity(SCATTERING_DISTANCE, Length, 1.0 / medium.sigma_tr()),
        quantity("diffusion coefficient, classical", Length, medium.diffusion_classical()),
        quantity("diffusion coefficient, Grosjean's", Length, medium.diffusion_grosjean()),
    ]);
    all
}

/// Coefficients and lengths against a scene: in its units, and lengths also in pixels at the camera's target and as a
/// share of each object.
fn against(scene: &Scene, quantities: &[Quantity]) -> (String, Value) {
    let camera = &scene.camera;
    let pixel = 2.0 * (0.5 * camera.fov_y_deg.to_radians()).tan() * camera.eye.distance(camera.target)
        / f64::from(scene.view.size.1);
    let (mut text, mut facts) = (String::new(), serde_json::Map::new());
    for Quantity { name, dimension, value } in quantities {
        let entry = match dimension {
            Number => continue,
            PerLength => {
                let value = *value * scene.mm_per_unit;
                text += &row(&format!("{name} [1/scene unit]"), value);
                json!({ "per_unit": three(value) })
            }
            Length => {
                let value = *value / scene.mm_per_unit;
                text += &row(&format!("{name} [scene units]"), value);
                text += &row("  [pixels]", value / pixel);
                let mut shares = serde_json::Map::new();
                for object in &scene.objects {
                    let share = value / crate::frame::extent(object);
                    text += &row(&format!("  as a share of `{}`", object.name), share);
                    shares.insert(object.name.clone(), three(share));
                }
                json!({ "units": three(value), "pixels": three(value / pixel), "share_of_object": shares })
            }
        };
        facts.insert(name.to_string(), entry);
    }
    // How far light goes is what most ask for: it stands by itself too.
    let mut distance = facts[SCATTERING_DISTANCE].clone();
    distance["quantities"] = Value::Object(facts);
    (text, distance)
}
