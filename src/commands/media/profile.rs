use super::{Answer, Found, find, finite};
use crate::optics::phase::Phase;
use crate::optics::profile::{Channel, Model, Profile};
use crate::problem::{Problems, nearest};
use crate::session::Session;
use serde_json::{Value, json};

/// Print how much of the light that enters at one point leaves at each distance from it, per mm²
#[derive(clap::Args)]
pub struct ProfileOf {
    /// A medium of the library, or a material's file, for its three channels; else give coefficients
    #[arg(value_name = "NAME|FILE", conflicts_with_all = ["sigma_a", "sigma_s", "g"])]
    medium: Option<String>,
    /// Absorption, 1/mm
    #[arg(long, value_name = "A", required_unless_present = "medium", value_parser = at_least_0)]
    sigma_a: Option<f64>,
    /// Scattering, 1/mm
    #[arg(long, value_name = "S", required_unless_present = "medium", value_parser = at_least_0)]
    sigma_s: Option<f64>,
    /// Mean cosine of Henyey and Greenstein's phase function, between -1 and 1; 0 when left out
    #[arg(long, value_name = "G", allow_negative_numbers = true, value_parser = mean_cosine)]
    g: Option<f64>,
    /// Index of refraction, from 1 to 4: the medium's when left out, 1.3 for coefficients
    #[arg(long, value_name = "N", value_parser = index)]
    ior: Option<f64>,
    /// PhotonBeamDiffusion, Dipole, BetterDipole or NormalizedDiffusion: the material's when left out
    #[arg(long, value_name = "MODEL", value_parser = model)]
    model: Option<Model>,
    /// Distances along the surface, mm
    #[arg(long, value_name = "R,R,…", required = true, value_delimiter = ',', value_parser = at_least_0)]
    radius: Vec<f64>,
}

fn within(text: &str, range: &str, allowed: impl Fn(f64) -> bool) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().map_err(|_| format!("a number is expected, {range}"))?;
    // NaN is within no range.
    if allowed(number) { Ok(number) } else { Err(format!("it must be {range}")) }
}

fn at_least_0(text: &str) -> Result<f64, String> {
    within(text, "0 or more", |v| (0.0..f64::INFINITY).contains(&v))
}

fn mean_cosine(text: &str) -> Result<f64, String> {
    within(text, "between -1 and 1, both excluded", |v| v.abs() < 1.0)
}

fn index(text: &str) -> Result<f64, String> {
    within(text, "from 1 (index-matched) to 4", |v| (1.0..=4.0).contains(&v))
}

/// The model of that name, as files spell it.
fn model(text: &str) -> Result<Model, String> {
    let names = Model::ALL.map(|model| format!("{model:?}"));
    let known = names.iter().position(|name| name == text).map(|at| Model::ALL[at]);
    known.ok_or_else(|| match nearest(text, names.iter().map(String::as_str)) {
        Some(near) => format!("did you mean {near}?"),
        None => format!("there is {}", names.join(", ")),
    })
}

impl ProfileOf {
    pub fn run(self, session: &Session) -> Result<Answer, Problems> {
        if let Some(name) = &self.medium {
            let Found { medium, phase, ior, model, warnings } = find(name, session)?;
            let (ior, model) = (self.ior.unwrap_or(ior), self.model.unwrap_or(model));
            let profiles = Profile::of_medium(model, &medium, phase, ior);
            return Ok(table(name, model, ior, &profiles, &self.radius).warn(warnings));
        }
        let channel = Channel {
            sigma_a: self.sigma_a.expect("required without a medium"),
            sigma_s: self.sigma_s.expect("required without a medium"),
            g: self.g.unwrap_or(0.0),
            phase: Phase::HenyeyGreenstein,
        };
        let (ior, model) = (self.ior.unwrap_or(1.3), self.model.unwrap_or_default());
        let Channel { sigma_a, sigma_s, g, .. } = channel;
        let name = format!("sigma_a {sigma_a}/mm, sigma_s {sigma_s}/mm, g {g}");
        Ok(table(&name, model, ior, &[Profile::new(model, channel, ior)], &self.radius))
    }
}

/// A row for each radius, a column for each channel. Among the facts one channel is a number and more are a list.
fn table(name: &str, model: Model, ior: f64, profiles: &[Profile], radii: &[f64]) -> Answer {
    let each = |of: &dyn Fn(&Profile) -> f64| -> Vec<f64> { profiles.iter().map(of).collect() };
    let row = |title: &str, values: &[f64]| {
        title.to_string() + &values.iter().map(|v| format!("  {v:>18.10e}")).collect::<String>() + "\n"
    };
    let fact = |values: &[f64]| match values {
        [one] => finite(*one),
        several => several.iter().map(|v| finite(*v)).collect::<Value>(),
    };
    let channels = if profiles.len() == 3 { "  R  G  B" } else { "" };
    let mut text = format!("{name}, ior {ior}, {model:?}\n{:>12}  R_d [1/mm²]{channels}\n", "r [mm]");
    let mut values = Vec::new();
    for r in radii {
        let r_d = each(&|profile| profile.r_d(*r));
        text += &row(&format!("{r:>12}"), &r_d);
        values.push(fact(&r_d));
    }
    let albedo = each(&Profile::albedo);
    text += &row(&format!("{:>12}", "albedo"), &albedo);
    let facts = json!({ "radius_mm": radii, "r_d": values, "albedo": fact(&albedo), "model": model, "ior": ior });
    Answer::new(text, facts)
}
