//! The harness notices what it is there for: faults are planted in shaders and bakes, and found where they were planted.

use crate::booth::{Booth, Miss};
use crate::columns::{self, Column};
use crate::inputs::{Input, Law};
use crate::stage::{BULB, Lamp, SUN, Stage};
use diaphane::gpu::Shaders;
use diaphane::problem::Problem;
use diaphane::store::{Bake, Plan, Run, Step};
use glam::Vec3;
use libtest_mimic::{Failed, Trial};
use serde::Serialize;
use std::path::Path;

/// A mistake in a shader: what it replaces, and what a failure must name.
struct Fault {
    name: &'static str,
    shader: &'static str,
    right: &'static str,
    wrong: &'static str,
    input: fn() -> Input,
    names: &'static [&'static str],
}

const LOCAL: &str = "techniques/local.wgsl";
const RETURNED: &str = "return vec4f(leaves * object.scatter * entered, 1.0);";

const FAULTS: [Fault; 6] = [
    Fault {
        name: "a NaN in one pixel",
        shader: LOCAL,
        right: RETURNED,
        wrong: "let odd = select(0.0, sqrt(-in.clip.x), pixel.x == 9 && pixel.y == 7);
                return vec4f(leaves * object.scatter * entered + odd, 1.0);",
        input: usual,
        names: &["technique.local", "pixel 9, 7", "NaN"],
    },
    Fault {
        name: "an infinity in one pixel",
        shader: LOCAL,
        right: RETURNED,
        wrong: "let odd = select(0.0, exp(1e3 * in.clip.x), pixel.x == 8 && pixel.y == 9);
                return vec4f(leaves * object.scatter * entered + odd, 1.0);",
        input: usual,
        names: &["technique.local", "pixel 8, 9", "inf"],
    },
    Fault {
        name: "a pixel of negative light",
        shader: LOCAL,
        right: RETURNED,
        wrong: "return vec4f(leaves * object.scatter * entered - select(0.0, 9.0, pixel.x == 9 && pixel.y == 7), 1.0);",
        input: usual,
        names: &["technique.local", "pixel 9, 7", "-"],
    },
    Fault {
        name: "a length that does not scale",
        shader: "frame/lights.wgsl",
        right: "light.power / (distance * distance), distance, 0.0",
        wrong: "light.power / (distance * distance + 1e-4), distance, 0.0",
        input: tiny,
        names: &["instead of"],
    },
    Fault {
        name: "more light than there is",
        shader: "frame/environment.wgsl",
        right: "irradiance[i] = vec4f(sum, 0.0);",
        wrong: "irradiance[i] = vec4f(1.2 * sum, 0.0);",
        input: white,
        names: &["more than"],
    },
    Fault {
        name: "lights that do not add up",
        shader: LOCAL,
        right: RETURNED,
        wrong: "return vec4f(leaves * object.scatter * entered * (1.0 + 0.01 * entered), 1.0);",
        input: lights,
        names: &["instead of"],
    },
];

fn input(stage: Stage, law: Law) -> Input {
    Input { name: "planted".into(), stage, law, often: true }
}

fn usual() -> Input {
    input(Stage::default(), Law::Sound)
}

fn tiny() -> Input {
    let size = 2f64.powi(-20);
    let stage = Stage { size, mm_per_unit: 10.0 / size, ..Stage::default() };
    input(stage, Law::SameAs(Box::default()))
}

fn white() -> Input {
    let mut stage = Stage { lamps: vec![Lamp::Sky { radiance: 1.0 }], is_alone: true, ..Stage::default() };
    stage.medium.sigma_a = [0.0; 3];
    stage.surface = "ior: 1".into();
    input(stage, Law::White)
}

fn lights() -> Input {
    let with = |sun: f64, bulb: f64| Stage { lamps: vec![SUN.times(sun), BULB.times(bulb)], ..Stage::default() };
    input(with(1.0, 1.0), Law::SumOf(Box::new(with(1.0, 0.0)), Box::new(with(0.0, 1.0))))
}

pub fn trials() -> Vec<Trial> {
    let shaders = FAULTS.iter().map(|fault| Trial::test(format!("teeth/{}", fault.name), || planted(fault)));
    let bakes = [
        Trial::test("teeth/a NaN in a bake", || in_a_bake(f32::NAN, "NaN")),
        Trial::test("teeth/an infinity in a bake", || in_a_bake(f32::NEG_INFINITY, "-inf")),
        Trial::test("teeth/a negative number in a bake", || in_a_bake(-1e-30, "-")),
        Trial::test("teeth/a value that nobody can look into", hidden),
    ];
    let laws = unlawful().into_iter().flat_map(|(name, input)| {
        let columns =
            columns::all().into_iter().filter(|column| ["FilteredNormals", "Volume Full"].contains(&&*column.name));
        columns.map(move |column| {
            let input = input.clone();
            Trial::test(format!("teeth/{name}, {}", column.name), move || {
                match Booth::new(column.is_traced).judge(&input, &column) {
                    Ok(kept) => Err(format!("the law was kept: {kept}").into()),
                    Err(Miss::Law(_)) => Ok(()),
                    Err(miss) => Err(told(Err(miss)).unwrap_or_default().into()),
                }
            })
        })
    });
    shaders.chain(bakes).chain(laws).collect()
}

/// Pictures that keep no law, since something else was changed.
fn unlawful() -> Vec<(&'static str, Input)> {
    let brighter = Stage { lamps: vec![Lamp::Sky { radiance: 2.0 }], ..white().stage };
    let denser = |factor: f64| Stage { density: factor, ..Stage::default() };
    let Law::SumOf(one, other) = lights().law else { unreachable!("lights add up") };
    let more = Stage { lamps: one.lamps.iter().map(|lamp| lamp.times(1.001)).collect(), ..*one };
    vec![
        ("brighter surroundings", input(brighter, Law::White)),
        ("a thinner thing", input(denser(0.3), Law::NearlySameAs(Box::default()))),
        ("a slightly denser thing", input(denser(1.001), Law::SameAs(Box::default()))),
        ("another sum", input(lights().stage, Law::SumOf(Box::new(more), other))),
    ]
}

/// What shows the faults most plainly.
fn column() -> Column {
    Column::drawn("Opaque")
}

fn planted(fault: &Fault) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    copy(Path::new("shaders"), folder.path())?;
    let path = folder.path().join(fault.shader);
    let text = std::fs::read_to_string(&path)?;
    if text.matches(fault.right).count() != 1 {
        return Err(format!("{} has no `{}` any more: plant the fault elsewhere", fault.shader, fault.right).into());
    }
    let input = (fault.input)();
    let mut booth = Booth::new(false);
    // Without the fault nothing is found.
    told(booth.judge(&input, &column())).map_or(Ok(()), |what| Err(format!("without a fault: {what}")))?;
    std::fs::write(&path, text.replace(fault.right, fault.wrong))?;
    let files = booth.session.files.clone();
    booth.session.shaders = Shaders::new(Some(folder.path().to_path_buf()), files);
    names(told(booth.judge(&input, &column())), fault.names)
}

fn told(found: Result<String, Miss>) -> Option<String> {
    match found {
        Ok(_) => None,
        Err(Miss::Flaw(flaw)) => Some(flaw.to_string()),
        Err(Miss::Law(what) | Miss::Refused(what)) => Some(what),
    }
}

fn names(told: Option<String>, words: &[&str]) -> Result<(), Failed> {
    let told = told.ok_or("the fault was not noticed")?;
    match words.iter().find(|word| !told.contains(**word)) {
        Some(word) => Err(format!("`{word}` is not named: {told}").into()),
        None => Ok(()),
    }
}

fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        let (path, to) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() { copy(&path, &to)? } else { std::fs::copy(&path, &to).map(drop)? }
    }
    Ok(())
}

/// Irradiance at three points, one of it wrong.
#[derive(Serialize)]
struct Wrong {
    green: f32,
}

impl Step for Wrong {
    type Output = Vec<Vec3>;
    fn name(&self) -> &'static str {
        "stress.wrong"
    }
    fn about(&self) -> String {
        "light with a mistake in it".into()
    }
    fn run(&self, _: &Run) -> Result<Vec<Vec3>, Problem> {
        Ok(vec![Vec3::ONE, Vec3::ONE, Vec3::new(1.0, self.green, 1.0)])
    }
}

impl Bake for Wrong {
    const CODE: &'static [&'static str] = &["src/store/"];
}

fn in_a_bake(green: f32, what: &str) -> Result<(), Failed> {
    let mut plan = Plan::default();
    let slot = plan.bake(Wrong { green });
    let mut booth = Booth::new(true);
    booth.get(&plan, slot).map_err(|problem| problem.to_string())?;
    names(booth.inspect(&plan).err().map(|flaw| flaw.to_string()), &["stress.wrong", "[2][1]", what])
}

/// A pass that makes something of its own.
#[derive(Serialize)]
struct Hidden;

struct Secret;

impl Step for Hidden {
    type Output = Secret;
    fn name(&self) -> &'static str {
        "stress.hidden"
    }
    fn about(&self) -> String {
        "a value of a type of its own".into()
    }
    fn run(&self, _: &Run) -> Result<Secret, Problem> {
        Ok(Secret)
    }
}

fn hidden() -> Result<(), Failed> {
    let mut plan = Plan::default();
    let slot = plan.add(Hidden);
    let mut booth = Booth::new(true);
    booth.get(&plan, slot).map_err(|problem| problem.to_string())?;
    names(booth.inspect(&plan).err().map(|flaw| flaw.to_string()), &["stress.hidden", "cannot look into"])
}
