//! The grid of hard inputs: what is pushed, and which law its pictures have to keep.

use crate::meshes;
use crate::stage::{BULB, Lamp, Medium, PANEL, SKY, SUN, Shape, Stage, WAX};
use glam::{DVec3, dvec3};
use std::f64::consts::FRAC_PI_8;

/// What has to hold of a picture, besides that every number on the way to it is one.
#[derive(Clone)]
pub enum Law {
    /// No more.
    Sound,
    /// Surroundings of radiance 1 and nothing else: no more light comes back.
    White,
    /// The picture of another stage, up to rounding.
    SameAs(Box<Stage>),
    /// The same, but for what falls to the other side of a texel or of a random number.
    NearlySameAs(Box<Stage>),
    /// The sum of the pictures of two stages that differ in their lamps.
    SumOf(Box<Stage>, Box<Stage>),
    /// The picture of another stage times a power of two.
    Times(f64, Box<Stage>),
}

#[derive(Clone)]
pub struct Input {
    pub name: String,
    pub stage: Stage,
    pub law: Law,
    /// Among those that every run of the tests takes.
    pub often: bool,
}

struct Grid(Vec<Input>);

impl Grid {
    fn add(&mut self, name: impl Into<String>, often: bool, law: Law, stage: Stage) {
        self.0.push(Input { name: name.into(), stage, law, often });
    }

    /// Under lamps, and between white walls.
    fn both(&mut self, name: &str, often: bool, stage: Stage) {
        let white = Stage { lamps: vec![Lamp::Sky { radiance: 1.0 }], is_alone: true, ..stage.clone() };
        self.add(name, often, Law::Sound, stage);
        self.add(format!("{name}, in white"), often, Law::White, white);
    }
}

fn grey(sigma_a: f64, sigma_s: f64, g: f64) -> Medium {
    Medium { sigma_a: [sigma_a; 3], sigma_s: [sigma_s; 3], g, phase: "HenyeyGreenstein" }
}

/// All inputs, in the order of the table.
pub fn all() -> Vec<Input> {
    let mut grid = Grid(Vec::new());
    sizes(&mut grid);
    media(&mut grid);
    boundaries(&mut grid);
    lights(&mut grid);
    views(&mut grid);
    shapes(&mut grid);
    grid.0
}

/// The whole scene times a factor, and all coefficients by it.
fn sizes(grid: &mut Grid) {
    let usual = || Box::new(Stage::default());
    for (factor, name, often) in [
        (2f64.powi(-20), "2^-20", true),
        (2f64.powi(20), "2^20", true),
        (1e-6, "1e-6", false),
        (1e-3, "1e-3", false),
        (1e3, "1e3", false),
        (1e6, "1e6", true),
    ] {
        let law = || if name.starts_with('2') { Law::SameAs(usual()) } else { Law::NearlySameAs(usual()) };
        let base = Stage::default();
        let told = Stage { size: factor, mm_per_unit: base.mm_per_unit / factor, ..base.clone() };
        grid.add(format!("size {name}, told by mm_per_unit"), often, law(), told);
        let dense = Stage { size: factor, density: 1.0 / factor, ..base };
        grid.add(format!("size {name}, coefficients to match"), often, law(), dense);
    }
    // f32 knows places to 0.06 there.
    let far = Stage { at: dvec3(1e6, -2e6, 1e6), ..Stage::default() };
    grid.add("1e6 units from the origin", true, Law::NearlySameAs(usual()), far);
    let farther = Stage { at: dvec3(1e9, 1e9, -1e9), ..Stage::default() };
    grid.add("1e9 units from the origin", false, Law::NearlySameAs(usual()), farther);
}

fn media(grid: &mut Grid) {
    let mut add =
        |name: &str, often: bool, medium: Medium| grid.both(name, often, Stage { medium, ..Stage::default() });
    add("sigma_a = 0", true, grey(0.0, 1.0, 0.0));
    add("albedo 1 - 1e-9", true, grey(1e-9, 1.0, 0.0));
    for (sigma, often) in [(1e-6, true), (1e-3, false), (1.0, false), (1e3, false), (1e6, true)] {
        add(&format!("sigma {sigma:e} /mm"), often, grey(0.02 * sigma, sigma, 0.0));
        add(&format!("sigma_s {sigma:e} /mm, sigma_a = 0"), false, grey(0.0, sigma, 0.0));
        add(&format!("sigma_a {sigma:e} /mm alone"), false, grey(sigma, 0.0, 0.0));
    }
    add("nothing in it", false, grey(0.0, 0.0, 0.0));
    let unlike = Medium { sigma_a: [0.0, 1e-9, 1e3], sigma_s: [1e-6, 1.0, 1e6], ..WAX };
    add("channels 1e12 apart", true, unlike);
    for (g, often) in [(0.99, true), (-0.99, true), (0.9999, false), (-0.9999, false)] {
        add(&format!("g {g}"), often, grey(0.02, 1.0, g));
        add(&format!("g {g}, Schlick"), false, Medium { phase: "Schlick", ..grey(0.02, 1.0, g) });
    }
}

fn boundaries(grid: &mut Grid) {
    for (ior, roughness, often) in [
        (1.0, 0.3, true),
        (1.0 + 1e-9, 0.3, false),
        (1.0001, 0.0, false),
        (1.33, 1.0, false),
        (1.5, 0.0, false),
        (2.0, 0.01, false),
        (3.0, 0.0, true),
        (3.0, 1.0, true),
        (4.0, 0.5, false),
    ] {
        let surface = format!("ior: {ior:?}, roughness: {roughness:?}");
        grid.both(&format!("ior {ior}, roughness {roughness}"), often, Stage { surface, ..Stage::default() });
    }
    let layer = |sigma: f64, depth: f64| {
        format!("(medium: Coefficients(sigma_a: {:?}, sigma_s: {sigma:?}, g: 0.5), depth: {depth:?}),", 0.1 * sigma)
    };
    for (name, layers, often) in [
        ("layers of 1e-6 mm and 1e6 mm", layer(1.0, 1e-6) + &layer(2.0, 1e6), true),
        ("layers 1e9 apart in density", layer(1e-3, 1.0) + &layer(1e6, 2.0), false),
    ] {
        grid.both(name, often, Stage { layers, ..Stage::default() });
    }
    let black = "color: 0, ior: 1.4".to_string();
    grid.add("a black surface", false, Law::Sound, Stage { surface: black, ..Stage::default() });
}

fn lights(grid: &mut Grid) {
    let with = |lamps: Vec<Lamp>| Stage { lamps, ..Stage::default() };
    // All of them stand in every picture, dark or not: a panel casts shadows, and paths look for each lamp.
    let lit = |powers: [f64; 4]| {
        let lamps = [SUN, BULB, PANEL, SKY].iter().zip(powers);
        with(lamps.map(|(lamp, power)| lamp.times(power)).collect())
    };
    let (one, other) = (lit([1.0, 1.0, 0.0, 0.0]), lit([0.0, 0.0, 1.0, 1.0]));
    let law = Law::SumOf(Box::new(one), Box::new(other));
    grid.add("lights add up", true, law, lit([1.0; 4]));
    for (factor, name, often) in [(2f64.powi(20), "2^20", true), (2f64.powi(-40), "2^-40", false)] {
        let law = Law::Times(factor, Box::new(lit([1.0; 4])));
        grid.add(format!("lights times {name}"), often, law, lit([factor; 4]));
    }
    let around = |i: i32, power: f64| {
        let phi = FRAC_PI_8 * i as f64;
        let position = dvec3(3.0 * phi.cos(), 0.3 * (i % 5) as f64 + 0.5, 3.0 * phi.sin());
        match i % 3 {
            0 => Lamp::Directional { direction: -position, irradiance: power },
            _ => Lamp::Point { position, intensity: power },
        }
    };
    let half = |odd: i32| with((0..16).map(|i| around(i, if i % 2 == odd { 1.0 } else { 0.0 })).collect());
    let law = Law::SumOf(Box::new(half(0)), Box::new(half(1)));
    grid.add("16 lights", true, law, with((0..16).map(|i| around(i, 1.0)).collect()));
    grid.add("no lights", true, Law::Sound, with(Vec::new()));
    let mut sound = |name: &str, often: bool, lamps: Vec<Lamp>| grid.add(name, often, Law::Sound, with(lamps));
    let point = |position: DVec3| Lamp::Point { position, intensity: 1.0 };
    sound("a lamp inside", false, vec![point(DVec3::ZERO)]);
    sound("a lamp on a vertex", true, vec![point(DVec3::Y)]);
    sound("a lamp at the eye", false, vec![point(Stage::default().eye)]);
    sound("a lamp 1e-6 above the surface", false, vec![point(dvec3(0.0, 1.0 + 1e-6, 0.0))]);
    sound("a lamp 1e6 away", false, vec![Lamp::Point { position: dvec3(4e5, 8e5, 4e5), intensity: 1e12 }]);
    for (slope, often) in [(1e-3, false), (1e-7, true), (0.0, false)] {
        let direction = dvec3(1.0, -slope, 0.0);
        sound(
            &format!("light that grazes by {slope:e}"),
            often,
            vec![Lamp::Directional { direction, irradiance: 3.0 }],
        );
    }
    let panel = |center: DVec3, u: DVec3, v: DVec3| Lamp::Rect { center, u, v, radiance: 5.0 };
    sound("a panel edge-on", false, vec![panel(dvec3(-3.0, 0.0, 0.0), DVec3::Y, DVec3::X)]);
    sound("a panel through the thing", false, vec![panel(DVec3::ZERO, 2.0 * DVec3::X, 2.0 * DVec3::Z)]);
    sound("a panel as narrow as 1e-6", false, vec![panel(dvec3(0.0, 3.0, 0.0), DVec3::X, 1e-6 * DVec3::Z)]);
    sound("a panel 1e4 wide", false, vec![panel(dvec3(0.0, 9.0, 0.0), 1e4 * DVec3::X, 1e4 * DVec3::Z)]);
}

fn views(grid: &mut Grid) {
    let usual = Stage::default;
    let mut sound = |name: &str, often: bool, stage: Stage| grid.add(name, often, Law::Sound, stage);
    sound("a camera inside", true, Stage { eye: dvec3(0.1, 0.2, 0.1), target: DVec3::X, ..usual() });
    sound("a camera on a vertex", false, Stage { eye: DVec3::Y, target: 2.0 * DVec3::X, ..usual() });
    let near = dvec3(0.0, 1.0 + 1e-4, 0.0);
    sound(
        "a camera 1e-4 above the surface",
        true,
        Stage { eye: near, target: near + dvec3(1.0, -1e-3, 0.0), ..usual() },
    );
    sound(
        "a view that grazes",
        true,
        Stage { eye: dvec3(8.0, -1.1 + 1e-5, 0.0), target: dvec3(0.0, -1.1, 0.0), ..usual() },
    );
    sound("a single pixel", true, Stage { picture: (1, 1), ..usual() });
    sound("one row", false, Stage { picture: (33, 1), ..usual() });
    sound("one column", false, Stage { picture: (1, 33), ..usual() });
    sound("1e5 units away", false, Stage { eye: dvec3(0.0, 0.0, 1e5), ..usual() });
    sound("a view of 0.001 degrees", false, Stage { fov_y_deg: 1e-3, ..usual() });
    sound("a view of 179 degrees", false, Stage { fov_y_deg: 179.0, ..usual() });
    sound("straight down", false, Stage { eye: 5.0 * DVec3::Y, up: DVec3::NEG_Z, ..usual() });
    sound("nothing in view", false, Stage { target: dvec3(2.0, 20.0, 9.0), ..usual() });
    let twist = "deform: [Twist(axis: (0, 1, 0), deg_per_unit: 200, speed_hz: 0.7)],".to_string();
    sound("twisted, a million seconds on", true, Stage { wears: twist, time_s: 1e6, ..usual() });
    sound("flat normals", false, Stage { wears: "normals: Flat,".into(), ..usual() });
}

fn shapes(grid: &mut Grid) {
    let sheet = |thickness: f64| Shape::Slab { size: dvec3(1.8, 1.8, thickness) };
    for (thickness, often) in [(1e-2, false), (1e-4, true), (1e-6, false)] {
        grid.both(&format!("a slab of {thickness:e}"), often, Stage { shape: sheet(thickness), ..Stage::default() });
    }
    grid.both("an icosahedron", false, Stage { shape: Shape::Sphere { subdivisions: 0 }, ..Stage::default() });
    let often =
        ["slivers of 1e-7 rad", "faces without area", "an open mesh", "edges of many faces", "self-intersecting"];
    for (name, text) in meshes::hard() {
        let often = often.contains(&name) || ["one in another", "doubled and stray vertices"].contains(&name);
        let mut stage = Stage { shape: Shape::Obj(text), ..Stage::default() };
        if name == "far from its own origin" {
            stage.at = -dvec3(1e5, -1e5, 1e5);
            (stage.eye, stage.target) = (stage.eye - stage.at, stage.target - stage.at);
        }
        grid.both(name, often, stage);
    }
    for (name, path, scale) in meshes::scans() {
        let shape = Shape::File { path: path.display().to_string(), scale };
        grid.both(&format!("the scan {name}"), false, Stage { shape, picture: (32, 32), ..Stage::default() });
    }
}
