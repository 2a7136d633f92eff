//! Light that scatters more than once below layers: what the device needs to know of each thing.

use super::media;
use crate::frame::{Member, Surface};
use crate::gpu::Bind;
use crate::optics::fresnel::diffuse_transmittance;
use crate::optics::phase::Phase;
use crate::optics::strata::{boundary, correction, single};
use crate::problem::Problem;
use crate::store::{Bake, Plan, Run, Step};
use crate::uniform;
use glam::Vec3;
use serde::Serialize;
use std::f64::consts::PI;

/// Along each axis of a table.
const KNOTS: usize = 17;

uniform! {
    #[derive(Copy)]
    struct Body {
        returns: u32,
        knots: u32,
        boundary: f32,
        spread: f32,
    }
}

uniform! {
    struct Reduced {
        sigma_a: Vec3,
        sigma_s_prime: Vec3,
    }
}

/// All things of a picture.
pub struct Multiple {
    bodies: Vec<Body>,
    reduced: Vec<Reduced>,
    returns: Returns,
}

impl Multiple {
    pub fn of(places: usize) -> Multiple {
        let none = Body { returns: 0, knots: KNOTS as u32, boundary: 0.0, spread: 0.0 };
        Multiple { bodies: vec![none; places], reduced: Vec::new(), returns: Returns { tables: Vec::new() } }
    }

    /// Members come in the order of their strata.
    pub fn add(&mut self, member: &Member, refract: bool, mm_per_unit: f64) {
        let ior = member.material.surface.ior;
        let bend = if refract { ior } else { 1.0 };
        let phases = media(member.material)
            .map(|(medium, phase)| (phase, medium.g.to_array().map(|g| phase.parameter(g))))
            .collect();
        self.bodies[member.place()] = Body {
            returns: self.returns.add(Table { ior, bend, phases }) as u32,
            knots: KNOTS as u32,
            boundary: boundary(ior) as f32,
            spread: (1.0 / (PI * diffuse_transmittance(ior))) as f32,
        };
        self.reduced.extend(media(member.material).map(|(medium, _)| Reduced {
            sigma_a: (medium.sigma_a * mm_per_unit).as_vec3(),
            sigma_s_prime: (medium.sigma_s_prime() * mm_per_unit).as_vec3(),
        }));
    }

    pub fn binds(self, plan: &mut Plan, surface: &Surface) -> Vec<(&'static str, Bind)> {
        let returns = plan.bake(self.returns);
        vec![
            ("reduced", Bind::list(&self.reduced)),
            ("bodies", Bind::list(&self.bodies)),
            ("returns", Bind::Buffer(surface.upload_list(plan, returns, "what layers send back"))),
        ]
    }
}

/// Corrections of diffusion (the first number), by admittance and by the cosine outside, and, for each stratum and by that
/// cosine, what half spaces of it send back after one event without absorption. Knows neither coefficients nor depths.
#[derive(Serialize)]
struct Returns {
    tables: Vec<Table>,
}

#[derive(PartialEq, Serialize)]
struct Table {
    ior: f64,
    /// The index by which rays are bent.
    bend: f64,
    /// Each stratum's function, and its parameters.
    phases: Vec<(Phase, [f64; 3])>,
}

impl Table {
    fn len(&self) -> usize {
        KNOTS * (KNOTS + self.phases.len())
    }
}

impl Returns {
    /// Where a table begins: things that are alike share it.
    fn add(&mut self, table: Table) -> usize {
        let place = self.tables.iter().position(|other| *other == table).unwrap_or_else(|| {
            self.tables.push(table);
            self.tables.len() - 1
        });
        self.tables[..place].iter().map(Table::len).sum()
    }
}

impl Step for Returns {
    type Output = Vec<[f32; 4]>;
    fn name(&self) -> &'static str {
        "layered.returns"
    }
    fn about(&self) -> String {
        "how much light half spaces send back".into()
    }
    fn run(&self, run: &Run) -> Result<Vec<[f32; 4]>, Problem> {
        let knots: [f64; KNOTS] = std::array::from_fn(|i| i as f64 / (KNOTS - 1) as f64);
        let mut rows = Vec::new();
        for table in &self.tables {
            for q in knots {
                run.tick(rows.len() as f64 / self.tables.iter().map(Table::len).sum::<usize>() as f64)?;
                let corrections = correction(q, table.ior, &knots);
                rows.extend(corrections.iter().map(|value| [*value as f32, 0.0, 0.0, 0.0]));
            }
            for (phase, parameters) in &table.phases {
                for cos in knots {
                    let share = |k: f64| single(*phase, k, table.ior, table.bend, cos) as f32;
                    let [r, g, b] = parameters.map(share);
                    rows.push([r, g, b, 0.0]);
                }
            }
        }
        Ok(rows)
    }
}

impl Bake for Returns {
    const CODE: &'static [&'static str] = &["src/optics/", "src/techniques/layered/multiple.rs"];
}
