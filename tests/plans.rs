//! What is planned for a scene, and what is planned anew after an edit: all without a device.
//!
//! `UPDATE=1 cargo test --test plans` writes the expectations in `tests/plans` anew; one that is missing is a failure.

use diaphane::gpu::Shaders;
use diaphane::render::{self, Look};
use diaphane::scene::{Reader, Scene};
use diaphane::store::{Files, Key, Plan};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

fn read(path: &Path, sets: &[(String, String)]) -> Scene {
    let reader = Reader::new(Arc::new(Files::default()));
    let (scene, _) = reader.scene(path, sets).unwrap_or_else(|problems| panic!("{problems}"));
    scene
}

fn plan_of(scene: &Scene) -> Plan {
    let shaders = Shaders::new(None, Arc::default());
    render::plan(scene, &Look::of(scene), &shaders).unwrap_or_else(|problem| panic!("{problem}")).0
}

/// Steps by number, with what they read; then what was left out.
fn text_of(plan: &Plan) -> String {
    let mut text = String::new();
    for (i, step) in plan.steps().iter().enumerate() {
        let inputs: Vec<String> = step.inputs.iter().map(|input| input.to_string()).collect();
        let kind = if step.is_given() {
            "given"
        } else if step.is_bake() {
            "bake"
        } else {
            "pass"
        };
        text += &format!("{i:3} {kind:5} {:28} [{}] {}\n", step.name, inputs.join(" "), step.about);
    }
    for skipped in plan.skipped() {
        text += &format!("not {}: {}\n", skipped.what, skipped.why);
    }
    text
}

/// Compares a text with its file, or writes it when asked to.
fn expect(file: &str, text: &str) {
    let path = Path::new("tests/plans").join(file);
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, text).expect("an expectation can be written");
    }
    let expected = std::fs::read_to_string(&path)
        .unwrap_or_else(|_| panic!("{} is missing; UPDATE=1 cargo test --test plans writes it", path.display()));
    for (i, (found, expected)) in text.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, expected, "{}:{}: UPDATE=1 if this is meant", path.display(), i + 1);
    }
    assert_eq!(text.lines().count(), expected.lines().count(), "{}: UPDATE=1 if this is meant", path.display());
}

#[test]
fn scenes_are_planned_as_their_texts_say() {
    for name in ["all", "dark", "sky"] {
        let scene = read(Path::new(&format!("tests/scenes/{name}.scene.ron")), &[]);
        expect(&format!("{name}.txt"), &text_of(&plan_of(&scene)));
    }
}

#[test]
fn a_plan_is_the_same_every_time() {
    let scene = read(Path::new("tests/scenes/all.scene.ron"), &[]);
    let keys = |scene: &Scene| plan_of(scene).keys().collect::<Vec<Key>>();
    assert_eq!(keys(&scene), keys(&scene));
    // Every step is named once, and reads only what stands before it.
    let plan = plan_of(&scene);
    assert_eq!(plan.keys().collect::<BTreeSet<_>>().len(), plan.steps().len());
    for (i, step) in plan.steps().iter().enumerate() {
        assert!(step.inputs.iter().all(|&input| (input as usize) < i));
    }
}

#[test]
fn filtered_normals_take_the_steps_of_opaque_but_for_the_bake() {
    // One translucent thing: with a painted floor beside it there would be two techniques in the picture, and a pass more.
    let names = |technique: &str| {
        let sets = [("view.technique", technique), ("objects.floor.visible", "false")];
        let sets = sets.map(|(path, ron)| (path.to_string(), ron.to_string()));
        let plan = plan_of(&read(Path::new("tests/scenes/dark.scene.ron"), &sets));
        plan.steps().iter().map(|step| step.name).collect::<Vec<_>>()
    };
    let (filtered, opaque) = (names("FilteredNormals()"), names("Opaque()"));
    let is_prepared = |name: &str| name.starts_with("filtered_normals.") || name == "gpu.upload";
    let drawn = |names: &[&'static str]| names.iter().copied().filter(|name| !is_prepared(name)).collect::<Vec<_>>();
    assert_eq!(drawn(&filtered), drawn(&opaque));
    let count = |name| filtered.iter().filter(|step| **step == name).count();
    // The bake, its two uploads; then two of the channels absorb alike, and have one normal.
    assert_eq!(filtered.len(), opaque.len() + 1 + 2 + 2 * 2);
    assert_eq!((count(KRYLOV), count("filtered_normals.reconstruct")), (1, 2));
    assert!(!opaque.contains(&KRYLOV));
}

/// An edit of a kernel, and whether it needs another basis.
#[test]
fn an_edit_of_a_kernel_runs_one_pass_over_the_vertices_and_no_bake() {
    let neighbours = "Neighbours(sigma_tr: 0.5, radius: 4, alpha: 0.3, weights: Area, length: Keep)";
    assert!(BALL.contains(neighbours));
    let plan = |filter: &str| Desk::new(&BALL.replace(neighbours, filter)).plan(&[]);
    let passes = BTreeMap::from(
        ["filtered_normals.kernel", "filtered_normals.reconstruct", "frame.environment"].map(|name| (name, 1)),
    );
    // The floor is drawn anew, too, where shadows on the ball are looked up farther from it: they are one picture's.
    let drawn = |made: &mut BTreeMap<&'static str, usize>| {
        assert!(matches!(made.remove("technique.local"), Some(1..=2)));
    };
    let look: Vec<&str> = vec![
        "frame.compose",
        "frame.gbuffer",
        "frame.gloss",
        "frame.image",
        "frame.merge",
        "frame.through",
        "frame.visibility",
    ];
    for (before, after, is_new) in [
        ("Gaussian(width: 2)", "Gaussian(width: 1.5)", None),
        ("Gaussian(width: 2)", "Exponential(width: 2.4)", None),
        ("Exponential(width: 2)", "Curve(points: [(0, 1), (0.9, 0)])", None),
        ("Normalized(std: 0.3)", "Normalized(std: 0.2)", None),
        ("Box(wavelength: 4)", "Box(wavelength: 5)", None),
        ("Gaussian(width: 2)", "Gaussian(width: 0.1)", Some(KRYLOV)),
        ("Gaussian(width: 2)", "Box(wavelength: 4)", Some("filtered_normals.harmonics")),
        ("Box(wavelength: 4)", "Box(wavelength: 0.4)", Some("filtered_normals.harmonics")),
    ] {
        let mut made = made_anew(&plan(before), &plan(after));
        made.retain(|name, _| !look.contains(name));
        drawn(&mut made);
        match is_new {
            None => assert_eq!(made, passes, "{before} -> {after}"),
            Some(bake) => {
                assert_eq!((made.remove(bake), made.remove("gpu.upload")), (Some(1), Some(2)), "{before} -> {after}");
                assert_eq!(made, passes, "{before} -> {after}");
            }
        }
    }
    // One channel's width: its normal alone, and what the surroundings send to it.
    let [all, red] = ["(2, 2.1, 2.2)", "(1.9, 2.1, 2.2)"].map(|width| plan(&format!("Gaussian(width: {width})")));
    let mut made = made_anew(&all, &red);
    made.retain(|name, _| !look.contains(name));
    drawn(&mut made);
    assert_eq!(made, passes);
    assert_eq!(all.steps().iter().filter(|step| step.name == "frame.environment").count(), 4, "three, and the floor's");
}

#[test]
fn a_kernel_that_lets_everything_pass_needs_no_modes() {
    let neighbours = "Neighbours(sigma_tr: 0.5, radius: 4, alpha: 0.3, weights: Area, length: Keep)";
    let steps = |width: &str, technique: &str| {
        let desk = Desk::new(&BALL.replace(neighbours, &format!("Gaussian(width: {width})")));
        let plan = desk.plan(&[("view.technique", technique)]);
        plan.steps().iter().filter(|step| step.name.starts_with("filtered_normals.")).count()
    };
    for technique in ["FilteredNormals()", "FilteredNormals(engine: Harmonics)", "FilteredNormals(signal: Irradiance)"]
    {
        assert_eq!(steps("0", technique), 0, "{technique}");
        assert!(steps("(0, 0, 0.1)", technique) > 0, "{technique}");
    }
}

/// A scene with one of everything, and its material, both to be edited.
const SCENE: &str = r#"Scene(
    version: 1,
    mm_per_unit: 10.0,
    camera: (eye: (0, 2, 8), target: (0, 0.5, 0), up: (0, 1, 0), fov_y_deg: 40),
    bookmarks: { "side": (eye: (8, 2, 0), target: (0, 0.5, 0)) },
    lights: [
        Directional(name: "sun", direction: (-1, -2, -1), irradiance: (2, 2, 2)),
        Point(name: "lamp", position: (3, 4, 3), intensity: (8, 8, 8)),
        Rect(name: "window", center: (-4, 4, -3), u: (0.6, 0.6, 0), v: (0, 0, 1), radiance: (6, 6, 6)),
        Environment(name: "room", radiance: (0.2, 0.25, 0.3)),
    ],
    objects: [
        (name: "ball", mesh: Sphere(radius: 1, subdivisions: 3), material: "ball.ron", transform: (translate: (0, 1, 0))),
        (name: "floor", mesh: Box(size: (8, 0.5, 8)), material: "floor.ron", transform: (translate: (0, -0.25, 0))),
    ],
    view: (technique: FilteredNormals(), size: (64, 48), antialias: 1),
)"#;

const BALL: &str = r#"Material(
    version: 1,
    surface: (ior: 1.5, roughness: 0.3, color: (1, 1, 1)),
    medium: Coefficients(sigma_a: (0.02, 0.03, 0.05), sigma_s: (1.2, 1.3, 1.4), g: 0.1),
    phase: HenyeyGreenstein,
    profile: PhotonBeamDiffusion,
    filter: Neighbours(sigma_tr: 0.5, radius: 4, alpha: 0.3, weights: Area, length: Keep),
    layers: [],
)"#;

const FLOOR: &str = "Material(version: 1, medium: Opaque(albedo: (0.7, 0.6, 0.5)))";

/// Edits of the scene: path and RON.
const SCENE_EDITS: &[(&str, &str)] = &[
    ("mm_per_unit", "11"),
    ("camera.eye", "(0.1, 2, 8)"),
    ("camera.target", "(0, 0.6, 0)"),
    ("camera.up", "(0.1, 1, 0)"),
    ("camera.fov_y_deg", "41"),
    ("bookmarks.side.fov_y_deg", "20"),
    ("lights.sun.direction", "(-1, -2, -1.1)"),
    ("lights.sun.irradiance", "(2, 2, 2.1)"),
    ("lights.sun.shadow", "false"),
    ("lights.sun.enabled", "false"),
    ("lights.sun.name", "\"moon\""),
    ("lights.lamp.position", "(3, 4, 3.1)"),
    ("lights.lamp.intensity", "(8, 8, 9)"),
    ("lights.lamp.shadow", "false"),
    ("lights.lamp.enabled", "false"),
    ("lights.window.center", "(-4, 4, -3.1)"),
    ("lights.window.u", "(0.6, 0.7, 0)"),
    ("lights.window.v", "(0, 0, 1.1)"),
    ("lights.window.radiance", "(6, 6, 7)"),
    ("lights.window.shadow", "false"),
    ("lights.window.enabled", "false"),
    ("lights.room.radiance", "(0.2, 0.25, 0.4)"),
    ("lights.room.scale", "1.1"),
    ("lights.room.rotation_deg", "10"),
    ("lights.room.shadow", "false"),
    ("lights.room.enabled", "false"),
    ("objects.ball.name", "\"sphere\""),
    ("objects.ball.mesh", "Sphere(radius: 1.1, subdivisions: 3)"),
    ("objects.ball.mesh", "Sphere(radius: 1, subdivisions: 4)"),
    ("objects.ball.transform.translate", "(0.1, 1, 0)"),
    ("objects.ball.transform.rotate_deg", "(0, 10, 0)"),
    ("objects.ball.transform.scale", "1.1"),
    ("objects.ball.normals", "Flat"),
    ("objects.ball.visible", "false"),
    ("objects.ball.deform", "[Twist(deg_per_unit: 10)]"),
    ("objects.ball.material", "\"floor.ron\""),
    ("objects.ball.technique", "Opaque()"),
    ("view.technique", "Opaque()"),
    ("view.size", "(80, 48)"),
    ("view.exposure_ev", "1"),
    ("view.tone", "Filmic"),
    ("view.time_s", "1"),
    ("view.antialias", "2"),
    ("reference.max_error", "0.1"),
    ("reference.max_spp", "16"),
    ("reference.max_depth", "7"),
    ("reference.seed", "2"),
];

/// Edits of the ball's material: what it says, and what it says then.
const MATERIAL_EDITS: &[(&str, &str)] = &[
    ("ior: 1.5", "ior: 1.4"),
    ("roughness: 0.3", "roughness: 0.4"),
    ("color: (1, 1, 1)", "color: (1, 1, 0.9)"),
    ("sigma_a: (0.02, 0.03, 0.05)", "sigma_a: (0.02, 0.03, 0.06)"),
    ("sigma_s: (1.2, 1.3, 1.4)", "sigma_s: (1.2, 1.3, 1.5)"),
    ("g: 0.1", "g: 0.2"),
    ("phase: HenyeyGreenstein", "phase: Schlick"),
    ("profile: PhotonBeamDiffusion", "profile: Dipole"),
    ("sigma_tr: 0.5", "sigma_tr: 0.6"),
    ("radius: 4", "radius: 5"),
    ("alpha: 0.3", "alpha: 0.4"),
    ("weights: Area", "weights: Uniform"),
    ("length: Keep", "length: Unit"),
    ("Neighbours(sigma_tr: 0.5, radius: 4, alpha: 0.3, weights: Area, length: Keep)", "FromMedium()"),
    ("layers: []", "layers: [(name: \"skin\", medium: Preset(\"skin1\"), depth: 0.5)]"),
];

/// Scene and materials in a folder.
struct Desk(tempfile::TempDir);

impl Desk {
    fn new(ball: &str) -> Desk {
        let folder = tempfile::tempdir().expect("a folder can be made");
        for (name, text) in [("scene.ron", SCENE), ("ball.ron", ball), ("floor.ron", FLOOR)] {
            std::fs::write(folder.path().join(name), text).expect("a file can be written");
        }
        Desk(folder)
    }

    fn plan(&self, sets: &[(&str, &str)]) -> Plan {
        let sets: Vec<_> = sets.iter().map(|(path, ron)| (path.to_string(), ron.to_string())).collect();
        plan_of(&read(&self.0.path().join("scene.ron"), &sets))
    }
}

/// The names of the steps that only the second plan has, with their number.
fn made_anew(before: &Plan, after: &Plan) -> BTreeMap<&'static str, usize> {
    let known: BTreeSet<Key> = before.keys().collect();
    let mut names = BTreeMap::new();
    for step in after.steps().iter().filter(|step| !known.contains(&step.key)) {
        *names.entry(step.name).or_insert(0) += 1;
    }
    names
}

fn after_set(path: &str, ron: &str) -> BTreeMap<&'static str, usize> {
    let desk = Desk::new(BALL);
    made_anew(&desk.plan(&[]), &desk.plan(&[(path, ron)]))
}

fn after_material(says: &str, then: &str) -> BTreeMap<&'static str, usize> {
    assert!(BALL.contains(says), "{says} stands in the material");
    made_anew(&Desk::new(BALL).plan(&[]), &Desk::new(&BALL.replace(says, then)).plan(&[]))
}

#[test]
fn an_edit_makes_anew_what_the_table_says() {
    let mut table = String::from("What is made anew after an edit, and how often.\n");
    let mut row = |edit: String, names: BTreeMap<&str, usize>| {
        let names: Vec<String> =
            names.iter().map(|(name, n)| if *n == 1 { name.to_string() } else { format!("{name} x{n}") }).collect();
        let names = if names.is_empty() { "nothing".to_string() } else { names.join(", ") };
        table += &format!("\n{edit}\n    {names}\n");
    };
    for (path, ron) in SCENE_EDITS {
        row(format!("scene: {path} = {ron}"), after_set(path, ron));
    }
    for (says, then) in MATERIAL_EDITS {
        row(format!("material: {says} -> {then}"), after_material(says, then));
    }
    expect("edits.txt", &table);
}

/// Names of steps that cost time worth saving.
const SHADOW: &str = "frame.shadow";
const SKY: &str = "sky.visibility";
const NORMALS: &str = "filtered_normals.neighbours";
const KRYLOV: &str = "filtered_normals.krylov";
const SHAPE: &str = "geometry.shape";

#[test]
fn edits_make_nothing_that_does_not_depend_on_them() {
    let spares = |made: BTreeMap<&str, usize>, spared: &[&str], edit: &str| {
        for name in spared {
            assert!(!made.contains_key(name), "{edit} makes {name} anew");
        }
        assert!(made.contains_key("frame.image"), "{edit} makes a new picture");
    };
    for (path, ron) in SCENE_EDITS.iter().filter(|(path, _)| path.starts_with("camera.")) {
        spares(after_set(path, ron), &[SHADOW, SKY, NORMALS, SHAPE, "gpu.upload", "gloss.albedo"], path);
    }
    for (path, ron) in [
        ("lights.sun.irradiance", "3"),
        ("lights.lamp.intensity", "3"),
        ("lights.window.radiance", "3"),
        ("lights.room.radiance", "3"),
        ("lights.room.scale", "3"),
    ] {
        spares(after_set(path, ron), &[SHADOW, SKY, NORMALS, SHAPE, "gpu.upload", "gloss.albedo"], path);
    }
    for path in ["objects.ball.transform.translate", "objects.ball.transform.rotate_deg"] {
        let made = after_set(path, "(0.2, 1, 0)");
        assert!(made.contains_key(SHADOW) && made.contains_key(SKY), "who stands where decides shadows: {made:?}");
        spares(made, &[NORMALS, SHAPE, "geometry.worn"], path);
    }
    for (path, ron) in [("view.size", "(32, 32)"), ("view.antialias", "2")] {
        spares(after_set(path, ron), &[SHADOW, SKY, NORMALS, SHAPE, "gpu.upload"], path);
    }
    for (says, then) in &MATERIAL_EDITS[..8] {
        let made = after_material(says, then);
        for name in [SHADOW, SKY, NORMALS, SHAPE] {
            assert!(!made.contains_key(name), "{then} makes {name} anew");
        }
    }
    for (says, then) in &MATERIAL_EDITS[8..13] {
        let made = after_material(says, then);
        assert_eq!(made.get(NORMALS), Some(&1), "{then}");
        spares(made, &[SHADOW, SKY, SHAPE], then);
    }
}

#[test]
fn what_no_picture_depends_on_makes_nothing_anew() {
    for (path, ron) in SCENE_EDITS {
        let is_idle = ["bookmarks.", "view.exposure_ev", "view.tone", "view.time_s", "reference."];
        if is_idle.iter().any(|idle| path.starts_with(idle)) {
            assert_eq!(after_set(path, ron), BTreeMap::new(), "{path}");
        }
    }
    // A name is no light, and no shape.
    for path in ["lights.sun.name", "lights.lamp.name", "lights.window.name", "objects.ball.name", "objects.floor.name"]
    {
        assert_eq!(after_set(path, "\"another\""), BTreeMap::new(), "{path}");
    }
    // Time moves what is deformed in time, and only that.
    let desk = Desk::new(BALL);
    let twist = ("objects.ball.deform", "[Twist(deg_per_unit: 10, speed_hz: 1)]");
    let made = made_anew(&desk.plan(&[twist]), &desk.plan(&[twist, ("view.time_s", "0.1")]));
    assert_eq!(made.get("geometry.worn"), Some(&1), "{made:?}");
    assert!(!made.contains_key(SHAPE) && !made.contains_key(SKY), "{made:?}");
}

#[test]
fn undoing_an_edit_finds_all_that_was_there() {
    let desk = Desk::new(BALL);
    let before: Vec<Key> = desk.plan(&[]).keys().collect();
    for (path, ron) in SCENE_EDITS {
        desk.plan(&[(path, ron)]);
        assert_eq!(desk.plan(&[]).keys().collect::<Vec<_>>(), before, "{path}");
    }
    assert_eq!(Desk::new(BALL).plan(&[]).keys().collect::<Vec<_>>(), before, "another folder with the same content");
}

/// A plan of the ball with another technique, after edits of the scene and of its material.
fn with_technique(technique: &str, sets: &[(&str, &str)], ball: &str) -> Plan {
    let all: Vec<(&str, &str)> = [("view.technique", technique)].into_iter().chain(sets.iter().copied()).collect();
    Desk::new(ball).plan(&all)
}

#[test]
fn thickness_is_baked_of_shapes_and_what_it_leaves_of_light_of_media() {
    const LENGTHS: &str = "thickness.lengths";
    const LEFT: &str = "thickness.transmittance";
    let is_bake = |name: &&str| name.starts_with("thickness.");
    for technique in ["SphericalThickness()", "SphericalThickness(encode: Thickness, attenuation: Beer)"] {
        let before = with_technique(technique, &[], BALL);
        let baked = |sets: &[(&str, &str)], ball: &str| {
            let made = made_anew(&before, &with_technique(technique, sets, ball));
            assert!(made.contains_key("frame.image"), "{technique} {sets:?}");
            made.into_keys().filter(is_bake).collect::<Vec<_>>()
        };
        assert!(before.steps().iter().any(|step| step.name == LENGTHS && step.is_bake()));
        for (path, ron) in [
            ("lights.sun.irradiance", "3"),
            ("lights.sun.direction", "(0, -1, 1)"),
            ("lights.lamp.position", "(3, 4, -3)"),
            ("lights.room.radiance", "3"),
            ("lights.room.rotation_deg", "10"),
            ("camera.eye", "(0.1, 2, 8)"),
            ("objects.ball.transform.translate", "(0.2, 1, 0)"),
            ("objects.ball.transform.rotate_deg", "(10, 20, 30)"),
        ] {
            assert_eq!(baked(&[(path, ron)], BALL), Vec::<&str>::new(), "{technique}: {path}");
        }
        let edit = |says: &str, then: &str| {
            assert!(BALL.contains(says));
            baked(&[], &BALL.replace(says, then))
        };
        assert_eq!(edit("color: (1, 1, 1)", "color: (1, 1, 0.9)"), Vec::<&str>::new());
        assert_eq!(edit("roughness: 0.3", "roughness: 0.4"), Vec::<&str>::new());
        assert_eq!(edit("sigma_a: (0.02, 0.03, 0.05)", "sigma_a: (0.02, 0.03, 0.06)"), [LEFT]);
        let shape = baked(&[("objects.ball.transform.scale", "1.1")], BALL);
        assert!(shape.contains(&LENGTHS) && shape.contains(&LEFT), "{shape:?}");
    }
    // What the response does not read is not in its name.
    let linear = "SphericalThickness(attenuation: Linear, max_thickness: 9)";
    let denser = BALL.replace("sigma_a: (0.02, 0.03, 0.05)", "sigma_a: (0.02, 0.03, 0.06)");
    let made = made_anew(&with_technique(linear, &[], BALL), &with_technique(linear, &[], &denser));
    assert!(!made.keys().any(is_bake), "{made:?}");
}

#[test]
fn lamps_in_front_of_a_thing_ask_for_fewer_coefficients() {
    let said = |direction: &str| {
        let plan = with_technique("SphericalThickness()", &[("lights.sun.direction", direction)], BALL);
        let found = plan.steps().iter().find(|step| step.name.ends_with(".through") && step.about.contains("`sun`"));
        found.expect("the sun sends light through the ball").about.clone()
    };
    assert!(said("(0, -0.2, -1)").ends_with("4 coefficients") && said("(0, -0.2, 1)").ends_with("25 coefficients"));
}
