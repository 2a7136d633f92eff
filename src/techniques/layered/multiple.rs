//! Light that scatters more than once below layers: what the device needs to know of each thing.

use super::media;
use crate::frame::Member;
use crate::gpu::{Bind, Buffer, Gpu};
use crate::optics::fresnel::diffuse_transmittance;
use crate::optics::medium::Medium;
use crate::optics::phase::Phase;
use crate::optics::strata::{boundary, correction, single, survival};
use crate::problem::Problem;
use crate::store::{Bake, Plan, Run, Slot, Step};
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
    pub fn add(&mut self, plan: &mut Plan, member: &Member, refract: bool, mm_per_unit: f64) {
        let ior = member.material.surface.ior;
        let bend = if refract { ior } else { 1.0 };
        let once = |(medium, phase): (&Medium, Phase)| {
            let parameters = medium.g.to_array().map(|g| phase.parameter(g));
            plan.bake(Once { ior, bend, phase, parameters })
        };
        let once = media(member.material).map(once).collect();
        let table = Table { diffusion: plan.bake(Diffusion { ior }), once };
        self.bodies[member.place()] = Body {
            returns: self.returns.add(table) as u32,
            knots: KNOTS as u32,
            boundary: boundary(ior) as f32,
            spread: (1.0 / (PI * diffuse_transmittance(ior))) as f32,
        };
        self.reduced.extend(media(member.material).map(|(medium, _)| Reduced {
            sigma_a: (medium.sigma_a * mm_per_unit).as_vec3(),
            sigma_s_prime: (medium.sigma_s_prime() * mm_per_unit).as_vec3(),
        }));
    }

    pub fn binds(self, plan: &mut Plan) -> Vec<(&'static str, Bind)> {
        vec![
            ("reduced", Bind::list(&self.reduced)),
            ("bodies", Bind::list(&self.bodies)),
            ("returns", Bind::Buffer(plan.add(self.returns))),
        ]
    }
}

type Rows = Vec<[f32; 4]>;

/// The cosines outside, and the admittances, of a table.
fn knots() -> [f64; KNOTS] {
    std::array::from_fn(|i| i as f64 / (KNOTS - 1) as f64)
}

/// What is known of half spaces below a boundary, whatever they hold: by admittance and by the cosine outside, the
/// correction of diffusion and the root of what survives more than one event. As a root that is nearly straight.
#[derive(Serialize)]
struct Diffusion {
    ior: f64,
}

impl Step for Diffusion {
    type Output = Rows;
    fn name(&self) -> &'static str {
        "layered.diffusion"
    }
    fn about(&self) -> String {
        format!("how much light half spaces of index {} send back", self.ior)
    }
    fn run(&self, run: &Run) -> Result<Rows, Problem> {
        let mut rows = Vec::new();
        for q in knots() {
            run.tick(q)?;
            let both = correction(q, self.ior, &knots()).into_iter().zip(survival(q, self.ior, &knots()));
            rows.extend(both.map(|(correction, survival)| [correction as f32, survival.sqrt() as f32, 0.0, 0.0]));
        }
        Ok(rows)
    }
}

impl Bake for Diffusion {
    const CODE: &'static [&'static str] = &["src/optics/", "src/techniques/layered/multiple.rs"];
}

/// By the cosine outside, what half spaces with this phase function send back after one event without absorption. Knows
/// neither coefficients nor depths.
#[derive(Serialize)]
struct Once {
    ior: f64,
    /// The index by which rays are bent.
    bend: f64,
    phase: Phase,
    /// For each channel.
    parameters: [f64; 3],
}

impl Step for Once {
    type Output = Rows;
    fn name(&self) -> &'static str {
        "layered.once"
    }
    fn about(&self) -> String {
        "how much light comes back after one event".into()
    }
    fn run(&self, run: &Run) -> Result<Rows, Problem> {
        let row = |cos: f64| {
            run.tick(cos)?;
            let [r, g, b] = self.parameters.map(|k| single(self.phase, k, self.ior, self.bend, cos) as f32);
            Ok([r, g, b, 0.0])
        };
        knots().map(row).into_iter().collect()
    }
}

impl Bake for Once {
    const CODE: &'static [&'static str] = &["src/optics/", "src/techniques/layered/multiple.rs"];
}

/// What a thing's layers send back: diffusion's rows, then each stratum's own.
#[derive(PartialEq, Serialize)]
struct Table {
    diffusion: Slot<Rows>,
    once: Vec<Slot<Rows>>,
}

impl Table {
    fn len(&self) -> usize {
        KNOTS * (KNOTS + self.once.len())
    }
}

/// All tables of a picture, one after the other, on the device.
#[derive(Serialize)]
struct Returns {
    tables: Vec<Table>,
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
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "layered.returns"
    }
    fn about(&self) -> String {
        "how much light layers send back, to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let slots =
            self.tables.iter().flat_map(|table| [table.diffusion].into_iter().chain(table.once.iter().copied()));
        let rows: Rows = slots.flat_map(|slot| run.get(slot).to_vec()).collect();
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&rows)))
    }
}
