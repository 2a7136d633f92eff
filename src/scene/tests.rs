//! Laws of the room as a whole: messages are what they should be, and no text can hurt the reader.

use crate::problem::{Problem, Problems};
use crate::scene::document::{self, parse};
use crate::scene::tree::{Node, Source, Value};
use crate::scene::{Filter, LightKind, Material, MeshSource, Reader, Scene, Sky, Substance, Transform, Varying};
use crate::store::Files;
use glam::DVec3;
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn reader() -> Reader {
    Reader::new(Arc::new(Files::default()))
}

fn show(problems: &[Problem]) -> String {
    problems.iter().map(|p| format!("{p}\n")).collect()
}

fn scene(text: &str) -> Result<(Scene, Vec<Problem>), Problems> {
    with_file("scene.ron", text, |path| reader().scene(path, &[]))
}

fn material(text: &str) -> Result<(Material, Vec<Problem>), Problems> {
    with_file("material.ron", text, |path| reader().material(path))
}

fn with_file<T>(name: &str, text: &str, read: impl FnOnce(&Path) -> T) -> T {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, text).unwrap();
    read(&path)
}

#[test]
fn rotation_is_about_the_fixed_x_then_y_then_z_axis() {
    let turn = |deg: DVec3| Transform { translate: DVec3::X, rotate_deg: deg, scale: DVec3::splat(2.0) };
    let to = |deg: [f64; 3], p: DVec3| turn(DVec3::from(deg)).world_from_object().transform_point3(p);
    assert!(to([90.0, 90.0, 0.0], DVec3::Y).distance(DVec3::new(3.0, 0.0, 0.0)) < 1e-12);
    assert!(to([0.0, 90.0, 90.0], DVec3::X).distance(DVec3::new(1.0, 0.0, -2.0)) < 1e-12);
    assert!(to([90.0, 0.0, 90.0], DVec3::Y).distance(DVec3::new(1.0, 0.0, 2.0)) < 1e-12);
}

const FULL: &str = r#"// Every field.
Scene(
    version: 1,
    mm_per_unit: 10.0,
    camera: (eye: (0, 6, 22), target: (0, 4, 0), up: (0, 1, 0), fov_y_deg: 30),
    bookmarks: { "ear, backlit": (eye: (-8, 5, -6), target: (0, 5, 0), fov_y_deg: 18) },
    lights: [
        Directional(name: "sun", direction: (-1, -1, -0.5), irradiance: (3, 3, 3)), /* a /* nested */ comment */
        Point(name: "rim", position: (-6, 9, -12), intensity: [400, 390, 360]),
        Rect(name: "softbox", center: (0, 20, 0), u: (4, 0, 0), v: (0, 0, 4), radiance: 5, shadow: false),
        Environment(name: "studio", radiance: (1, 1, 1), scale: 0.6, rotation_deg: 30, enabled: false),
    ],
    objects: [
        (name: "knot", mesh: TorusKnot(p: 2, q: 3, radius: 2, tube: 0.5, segments: (64, 16)), normals: Smooth(crease_deg: 40),
         transform: (translate: (0, 1, 0), rotate_deg: (0, 30, 0), scale: (1, 2, 1)), material: "material.ron",
         deform: [Twist(axis: (0, 1, 0), deg_per_unit: 10, speed_hz: 0.5)],
         technique: SphericalThickness(bands: 5)),
        (name: "probe", mesh: Sphere(radius: 2, subdivisions: 5), material: "material.ron", visible: false),
    ],
    view: (technique: FilteredNormals(), size: (960, 540), exposure_ev: -1, tone: Filmic, time_s: 2, antialias: 4),
    reference: (max_error: 0.02, max_spp: 4096, max_depth: 512, seed: 1),
)
"#;
const LAYERED: &str = r#"Material(
    version: 1,
    base: None,
    surface: Surface(ior: Some(1.4), roughness: 0.2, color: [1, 0.9, 0.8]),
    medium: Coefficients(sigma_a: (0.01, 0.02, 0.04), sigma_s: 5, g: 0.7),
    phase: Schlick,
    profile: BetterDipole,
    filter: Neighbours(sigma_tr: 1.5, radius: 2.0, alpha: 0.3, weights: Uniform, length: Unit),
    layers: [
        (name: "dermis", medium: Preset("skin1"), phase: HenyeyGreenstein, depth: 0.5),
        (medium: AlbedoMfp(albedo: 0.9, mfp: 1, g: 0), depth: 1.5),
    ],
)"#;

/// A folder with a scene and the material that it names.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scene.ron");
    std::fs::write(&path, FULL).unwrap();
    std::fs::write(dir.path().join("material.ron"), LAYERED).unwrap();
    (dir, path)
}

fn set(path: &str, ron: &str) -> (String, String) {
    (path.to_string(), ron.to_string())
}

#[test]
fn a_full_scene_holds_what_its_file_says() {
    let (_dir, path) = folder();
    let (scene, _) = reader().scene(&path, &[]).unwrap();
    let LightKind::Directional { direction, .. } = scene.lights[0].kind else { panic!() };
    assert!((direction.length() - 1.0).abs() < 1e-15);
    assert!(Arc::ptr_eq(&scene.objects[0].material, &scene.objects[1].material));
    assert_eq!(scene.objects[0].technique.as_ref().unwrap().ron, "SphericalThickness(bands: 5)");
    assert_eq!(scene.view.technique.name, "FilteredNormals");
    let material = &scene.objects[0].material;
    let Substance::Translucent(medium) = &material.medium else { panic!() };
    // The true mean cosine, not Schlick's parameter.
    assert!(medium.g.x < 0.69 && medium.g.x > 0.4);
    assert_eq!(material.layers[1].name, "layer 1");
    assert!(matches!(material.layers[0].depth, Varying::Constant(0.5)));
    assert!(matches!(material.filter, Filter::Neighbours(_)));
    assert!(matches!(material.surface.color, Varying::Constant(c) if c.to_array() == [1.0, 0.9, 0.8]));
}

#[test]
fn what_is_not_required_has_a_default() {
    let (scene, warnings) = scene("Scene(version: 1, mm_per_unit: 1)").unwrap();
    assert!(scene.objects.is_empty() && warnings.is_empty());
    assert_eq!(
        (scene.view.size, scene.view.antialias, scene.view.technique.ron.as_str()),
        ((960, 540), 2, "FilteredNormals()")
    );
    let bare = r#"Scene(version: 1, mm_per_unit: 1, lights: [Environment(), Point()], objects: [(), ()])"#;
    let (bare, warnings) = self::scene(bare).unwrap();
    assert!(warnings.len() >= 4);
    assert!(matches!(bare.objects[1].mesh, MeshSource::Sphere { subdivisions: 5, .. }));
    assert!(matches!(bare.lights[0].kind, LightKind::Environment { sky: Sky::Constant(_), .. }));
    for (medium, ior) in [("Preset(\"marble\")", 1.5), ("Opaque()", 1.0), ("Coefficients()", 1.3), ("Color()", 1.3)] {
        let (read, _) = material(&format!("Material(version: 1, medium: {medium})")).unwrap();
        assert_eq!(read.surface.ior, ior, "{medium}");
    }
}

#[test]
fn a_material_takes_what_it_leaves_out_from_its_base() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write(
        "a.ron",
        "Material(version: 1, surface: (ior: 1.7, roughness: 0.6), filter: Gaussian(width: 2), layers: [()])",
    );
    write("b.ron", "Material(version: 1, base: \"a.ron\", surface: (color: 0.5), filter: Exponential())");
    write("c.ron", "Material(version: 1, base: \"b.ron\", surface: (roughness: 0.1), layers: [])");
    let (read, _) = reader().material(&dir.path().join("c.ron")).unwrap();
    assert_eq!(read.surface.ior, 1.7);
    assert_eq!(read.surface.roughness, Varying::Constant(0.1));
    assert!(matches!(read.surface.color, Varying::Constant(c) if c.x == 0.5));
    assert!(read.layers.is_empty());
    // Variants replace whole: the width of another kernel is none of this one's.
    assert!(matches!(read.filter, Filter::Exponential(k) if k.width.0 == [0.5; 3]));
}

#[test]
fn what_is_set_on_the_command_line_is_read_and_complained_about_as_such() {
    let (_dir, path) = folder();
    let sets = [
        set("objects.knot.transform.scale", "2"),
        set("objects.probe.transform.translate", "(1, 2, 3)"),
        set("view.technique", "LongRange(layers: 8)"),
        set("view.technique.layers", "9"),
        set("lights.sun.enabled", "false"),
    ];
    let (scene, _) = reader().scene(&path, &sets).unwrap();
    assert_eq!(scene.objects[0].transform.scale.to_array(), [2.0; 3]);
    assert_eq!(scene.objects[1].transform.translate.z, 3.0);
    assert_eq!(scene.view.technique.ron, "LongRange(layers: 9)");
    assert!(!scene.lights[0].enabled);
    for (at, ron, expected) in [
        (
            "objects.knot.transform.scale",
            "0",
            "--set:1:30: error: objects[0].transform.scale: 0 is not allowed\n  |\n1 | objects.knot.transform.scale=0\n  \
             |                              ^\n  = hint: above 0; turn the object instead of mirroring it\n",
        ),
        (
            "view.sise",
            "(1, 1)",
            "--set:1:1: error: view.sise: there is no field `sise`\n  |\n1 | view.sise=(1, 1)\n  | ^^^^^^^^^\n  \
             = hint: did you mean `size`? Known are technique, size, exposure_ev, tone, time_s, antialias\n",
        ),
        (
            "view.size",
            "(1, 1",
            "--set:1:11: error: view.size: this `(` is never closed\n  |\n1 | view.size=(1, 1\n  |           ^\n  \
             = hint: write `)` where it ends\n",
        ),
    ] {
        let Problems(problems) = reader().scene(&path, &[set(at, ron)]).unwrap_err();
        assert_eq!(show(&problems), expected);
    }
}

#[test]
fn defaults_written_out_read_as_the_same() {
    let (dir, path) = folder();
    let reader = reader();
    assert!(reader.defaults(&path).unwrap().contains("technique: SphericalThickness(bands: 5),"));
    for (file, again) in [("scene.ron", "again.ron"), ("material.ron", "again_material.ron")] {
        let text = reader.defaults(&dir.path().join(file)).unwrap();
        std::fs::write(dir.path().join(again), &text).unwrap();
        assert_eq!(reader.defaults(&dir.path().join(again)).unwrap(), text);
    }
    assert_eq!(reader.scene(&path, &[]).unwrap().0, reader.scene(&dir.path().join("again.ron"), &[]).unwrap().0);
    let material = |name: &str| reader.material(&dir.path().join(name)).unwrap().0;
    assert_eq!(material("material.ron"), material("again_material.ron"));
}

#[test]
fn every_material_of_the_library_is_sound_and_says_its_source() {
    let reader = reader();
    let mut count = 0;
    for file in std::fs::read_dir("materials").unwrap().map(|e| e.unwrap().path()) {
        let (read, _) = reader.material(&file).unwrap_or_else(|e| panic!("{e}"));
        let first = std::fs::read_to_string(&file).unwrap().lines().next().unwrap().to_string();
        assert!(first.starts_with("// ") && (first.contains("20") || first.contains("a look of our own")), "{first}");
        if let Some(preset) = crate::optics::presets::preset(file.file_stem().unwrap().to_str().unwrap()) {
            assert_eq!(read.medium, Substance::Translucent(preset.medium));
            assert_eq!(read.surface.ior, preset.ior);
        }
        count += 1;
    }
    assert!(count >= 20);
}

#[test]
fn settings_of_a_technique_are_read_with_their_places() {
    #[derive(Debug, PartialEq, serde::Deserialize)]
    #[serde(default, deny_unknown_fields)]
    struct Settings {
        layers: u32,
    }
    impl Default for Settings {
        fn default() -> Settings {
            Settings { layers: 10 }
        }
    }
    let of = |text: &str| super::TechniqueText::from_flag("--technique", text).unwrap();
    assert_eq!(of("LongRange").settings::<Settings>().unwrap().layers, 10);
    assert_eq!(of("LongRange( layers : 3 )").settings::<Settings>().unwrap().layers, 3);
    assert_eq!(of("LongRange( layers : 3 )"), of("LongRange(layers: 3)"));
    let error = of("LongRange(layer: 3)").settings::<Settings>().unwrap_err();
    assert_eq!((error.at.unwrap().column, error.what.as_str()), (11, "there is no field `layer`"));
    assert_eq!(of("LongRange(layers: 0)").problem("layers", "x").at.unwrap().column, 19);
    assert_eq!(of("LongRang()").unknown(&["LongRange"]).hint.unwrap(), "did you mean `LongRange`?");
}

#[test]
fn a_file_with_a_hundred_thousand_mistakes_is_told_the_first() {
    let many = |object: &str| format!("Scene(version: 1, mm_per_unit: 1, objects: [{}])", object.repeat(100_000));
    for text in
        [many("(name: \"\"),"), many("(transform: (scale: NaN)),"), many("(name: \"a\", material: \"no.ron\"),")]
    {
        let Problems(problems) = scene(&text).unwrap_err();
        assert!(problems.len() > 50 && problems.len() <= 200);
    }
    let skies = format!("Scene(version: 1, mm_per_unit: 1, lights: [{}])", "Environment(),".repeat(100_000));
    assert_eq!(scene(&skies).unwrap_err().0.len(), 100);
    assert_eq!(scene(&many("(name: \"a\", visible: 3),")).unwrap_err().0.len(), 1);
}

#[test]
fn a_material_has_a_few_layers() {
    let of = |layers: usize| {
        let layer = |i| format!("(depth: {i}, medium: Color()),");
        format!("Material(version: 1, layers: [{}])", (0..layers).map(layer).collect::<String>())
    };
    assert_eq!(material(&of(64)).unwrap().0.layers.len(), 64);
    assert!(show(&material(&of(65)).unwrap_err().0).contains("at most 64"));
}

#[test]
#[cfg(unix)]
fn a_circle_of_bases_is_seen_through_links_and_what_only_looks_like_one_is_not() {
    let dir = tempfile::tempdir().unwrap();
    let [one, two] = ["one", "two"].map(|name| dir.path().join(name));
    [&one, &two].into_iter().for_each(|folder| std::fs::create_dir(folder).unwrap());
    std::os::unix::fs::symlink(".", one.join("here")).unwrap();
    std::os::unix::fs::symlink(&two, one.join("there")).unwrap();
    let write = |path: PathBuf, base: &str| {
        std::fs::write(&path, format!("Material(version: 1, base: \"{base}\")")).unwrap();
        path
    };
    let Problems(problems) = reader().material(&write(one.join("a.ron"), "here/a.ron")).unwrap_err();
    assert!(problems[0].what.contains("inherit from itself"), "{problems:?}");
    // `there/..` is the folder of both, not `one`.
    let first = write(one.join("b.ron"), "there/../b.ron");
    std::fs::write(dir.path().join("b.ron"), "Material(version: 1, surface: (ior: 1.7))").unwrap();
    assert_eq!(reader().material(&first).unwrap().0.surface.ior, 1.7);
}

/// Every bare object is worth two warnings.
#[test]
fn warnings_neither_hide_an_error_nor_are_one() {
    let bare = |more: &str| format!("Scene(version: 1, mm_per_unit: 1, objects: [{}{more}])", "(),".repeat(20_000));
    let (scene_read, warnings) = scene(&bare("")).unwrap();
    assert_eq!((scene_read.objects.len(), warnings.len()), (20_000, 100));
    assert!(Arc::ptr_eq(&scene_read.objects[0].material, &scene_read.objects[1].material));
    let Problems(problems) = scene(&bare("(transform: (scale: 0))")).unwrap_err();
    assert!(problems.iter().any(|p| p.is_error() && p.path.as_deref() == Some("objects[20000].transform.scale")));
}

/// Files of which every part is well spelled.
const SOUND: [&str; 2] = [FULL, LAYERED];

/// The same numbers, texts and names of fields, as ron sees them.
fn agrees(node: &Node, value: &ron::Value) -> bool {
    match (&node.value, value) {
        (Value::Number(n), ron::Value::Number(m)) => m.into_f64() == *n,
        (Value::Text(a), ron::Value::String(b)) => a == b,
        (Value::Bool(a), ron::Value::Bool(b)) => a == b,
        (Value::Word(name), ron::Value::Option(None)) => name == "None",
        (Value::Word(_), ron::Value::Unit) => true,
        (Value::Tuple(Some(name), items), ron::Value::Option(Some(inner))) if name == "Some" => {
            agrees(&items[0], inner)
        }
        (Value::Tuple(_, items), ron::Value::Unit) => items.is_empty(),
        (Value::Tuple(_, a) | Value::List(a), ron::Value::Seq(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| agrees(a, b))
        }
        (Value::Struct(_, a), ron::Value::Map(b)) => {
            a.len() == b.len()
                && a.iter().all(|field| {
                    let named = |key: &ron::Value| matches!(key, ron::Value::String(name) if *name == field.name);
                    b.iter().any(|(key, value)| named(key) && agrees(&field.value, value))
                })
        }
        (Value::Map(a), ron::Value::Map(b)) => {
            a.len() == b.len() && a.iter().all(|(k, v)| b.iter().any(|(key, value)| agrees(k, key) && agrees(v, value)))
        }
        _ => false,
    }
}

#[test]
fn the_tree_agrees_with_ron() {
    for text in SOUND {
        let tree = parse(&Source::of_file(Path::new("a.ron"), text.to_string())).unwrap();
        let value: ron::Value = document::ron().from_str(text).unwrap();
        let mut compared = 0;
        tree.walk("", &mut |path, node| {
            compared += 1;
            assert_eq!(tree.path_of(&node.source, &node.span), path);
        });
        assert!(compared > 30);
        assert!(agrees(&tree, &value), "{text}");
    }
}

fn survives(text: &str) {
    let _ = scene(text);
    let _ = material(text);
    let source = Source::of_file(Path::new("a.ron"), text.to_string());
    match Node::parse(&source, 0) {
        Ok(tree) => {
            // What is written again is read as the same.
            let canonical = tree.canonical();
            let again = Node::parse(&Source::of_file(Path::new("a.ron"), canonical.clone()), 0).unwrap();
            assert_eq!(again.canonical(), canonical);
        }
        Err(error) => assert!(error.span.start <= text.len() && !error.what.is_empty()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_text_hurts_the_reader(text in "\\PC{0,200}") {
        survives(&text);
    }

    #[test]
    fn no_tokens_hurt_the_reader(tokens in prop::collection::vec(prop::sample::select(vec![
        "(", ")", "[", "]", "{", "}", ",", ":", "Scene", "Material", "version", "1", "-", "1e308", "NaN", "inf", "\"", "'", "\\",
        "/*", "*/", "//", "\n", "r#\"", "é", "\u{202e}", "None", "Some", "Sphere", "radius", "0x", "_", ".", "#![", "objects", " ",
    ]), 0..60)) {
        survives(&tokens.concat());
        survives(&format!("Scene(version: 1, mm_per_unit: 1, {})", tokens.concat()));
    }

    #[test]
    fn no_edit_of_a_sound_file_hurts_the_reader(
        which in 0..SOUND.len(), at in 0.0..1.0, cut in 0_usize..30,
        new in prop_oneof!["\\PC{0,6}", "[-0-9.e]{1,8}", Just("NaN".to_string()), Just("1e999".to_string()), Just("(".repeat(100))],
    ) {
        let text: Vec<char> = SOUND[which].chars().collect();
        let start = (at * text.len() as f64) as usize;
        let end = (start + cut).min(text.len());
        let edited: String = text[..start].iter().chain(new.chars().collect::<Vec<_>>().iter()).chain(&text[end..]).collect();
        survives(&edited);
    }

    #[test]
    fn what_is_set_is_what_is_read(value in -1e6..1e6_f64, axis in 0_usize..3) {
        let (_dir, path) = folder();
        let sets = [set("objects.probe.transform.translate", "(0, 0, 0)"),
            set(&format!("objects.probe.transform.translate.{axis}"), &format!("{value:?}"))];
        let (scene, _) = reader().scene(&path, &sets).unwrap();
        prop_assert_eq!(scene.objects[1].transform.translate[axis], value);
    }
}
