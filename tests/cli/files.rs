//! Commands that read and write files without drawing: new, check, bake, cache.

use crate::{Desk, MATERIAL, NO_ADAPTER, SCENE};
use diaphane::optics::presets::presets;

#[test]
fn new_writes_files_that_check_has_nothing_to_say_of() {
    let desk = Desk::new();
    for preset in presets() {
        let name = format!("rooms/{}", preset.name);
        let ran = desk.run(&["new", &name, "--from", preset.name]).ok();
        assert!(ran.out.starts_with(&format!("{name}.ron\n{name}.material.ron\n")), "{ran:#?}");
        let checked = desk.run(&["check", &format!("{name}.ron"), &format!("{name}.material.ron")]).ok();
        // Some media are no good for diffusion, and that is said.
        assert!(checked.err.is_empty() || preset.name != "marble", "{checked:#?}");
        assert!(String::from_utf8(desk.read(&format!("{name}.material.ron"))).unwrap().contains("// "));
    }
    // What it says to type next is typed as it stands, whatever the name.
    desk.run(&["new", "my stone.ron"]).ok().says(&["my stone.ron\n", "render 'my stone.ron' -o 'my stone.png'"]);
}

#[test]
fn new_overwrites_nothing_and_refuses_absurd_names() {
    let desk = Desk::new();
    desk.run(&["new", "scene"]).fails(2, &["scene.ron: error: it is there already", "hint: choose another name"]);
    assert_eq!(desk.read("scene.ron"), SCENE.as_bytes());
    desk.write("half.material.ron", MATERIAL);
    desk.run(&["new", "half"]).fails(2, &["half.material.ron"]);
    assert!(!desk.path("half.ron").exists());
    desk.run(&["new", "a", "--from", "marbel"]).fails(2, &["no preset `marbel`", "did you mean `marble`?"]);
    desk.run(&["new", "a", "--from", "granite"]).fails(2, &["no preset `granite`", "skin1"]);
    for name in ["", "..", ".ron", "a\"b", "a\\b", "a\nb", "{NAME}"] {
        desk.run(&["new", name]).fails(2, &["error: "]);
    }
    desk.run(&["new", &"x".repeat(400)]).fails(5, &["too long", "hint: "]);
    desk.run(&["new", "scene.ron/below"]).fails(5, &["hint: "]);
    assert_eq!(desk.files("").len(), 3, "{:?}", desk.files(""));
}

#[test]
fn check_tells_what_is_sound_and_all_that_is_not() {
    let desk = Desk::new();
    let sound = desk.run_with(&NO_ADAPTER, &["check", "scene.ron", "stone.ron"]).ok();
    assert_eq!(sound.out, "scene.ron: a scene of 1 object and 1 light: sound\nstone.ron: a material: sound\n");
    desk.write("bad.ron", SCENE.replace("radius: 1", "radius: -1").replace("(24, 16)", "(0, 16)"));
    desk.write("worse.ron", "Material(version: 1, surface: (ior: 9))");
    let ran = desk.run(&["check", "bad.ron", "stone.ron", "worse.ron"]);
    ran.fails(1, &["bad.ron:7:51: error: objects[0].mesh.radius", "bad.ron:8:40: error: view.size", "worse.ron:1:37"]);
    // A warning is no error.
    desk.write("warned.ron", SCENE.replace("material: \"stone.ron\"", ""));
    let warned = desk.run(&["check", "warned.ron"]).ok();
    assert!(warned.err.starts_with("warned.ron:7:15: warning: ") && warned.out.contains("1 warning"), "{warned:#?}");
    let json = desk.run(&["check", "warned.ron", "--json"]).ok().json();
    assert_eq!(json["warnings"][0]["severity"], "warning");
}

#[test]
fn defaults_written_out_read_as_the_same_file() {
    let desk = Desk::new();
    for name in ["scene.ron", "stone.ron"] {
        let first = desk.run(&["check", "--defaults", name]).ok();
        assert!(first.err.is_empty());
        desk.write("again.ron", &first.out);
        let second = desk.run(&["check", "--defaults", "again.ron"]).ok();
        let body = |text: &str| text.split_once('\n').unwrap().1.to_string();
        assert_eq!(body(&first.out), body(&second.out));
        desk.run(&["check", "again.ron"]).ok();
    }
    let scene = desk.run(&["check", "--defaults", "scene.ron"]).ok();
    scene.says(&["exposure_ev: 0.0", "max_spp: 4096", "technique: Opaque()"]);
}

#[test]
fn a_second_bake_reads_all_from_disk_and_neither_needs_an_adapter() {
    let desk = Desk::new();
    let bake = |more: &[&str]| {
        let words = [&["bake", "scene.ron", "--technique", "FilteredNormals()", "--json"], more].concat();
        let json = desk.run_with(&NO_ADAPTER, &words).ok().json();
        ["bakes", "made", "from_disk"].map(|name| json[name].as_u64().unwrap())
    };
    let [bakes, made, from_disk] = bake(&[]);
    assert!(bakes >= 2 && made == bakes && from_disk == 0);
    assert_eq!(bake(&[]), [bakes, 0, bakes]);
    // Another size of the picture changes nothing, another shape all, and a sky wants bakes of its own.
    assert_eq!(bake(&["--size", "9x9"]), [bakes, 0, bakes]);
    assert_eq!(bake(&["--set", "objects.ball.mesh.radius=1.5"]), [bakes, bakes, 0]);
    let [all, more, from_disk] = bake(&["--set", "lights=[Environment(name: \"sky\")]"]);
    assert!(more >= 1 && from_disk == bakes && all == bakes + more);
    let made = bakes + more;

    let text = desk.run(&["bake", "scene.ron", "--technique", "FilteredNormals()"]).ok();
    text.says(&["cache", &format!("{bakes} bakes: {bakes} from disk, 0 made")]);
    let stat = desk.run(&["cache", "stat", "--json"]).ok().json();
    assert_eq!(stat["count"], bakes + made);
    desk.run(&["cache", "stat"]).ok().says(&["geometry.shape", " kB"]);
    desk.write("cache/00/notes.txt", "not a bake");
    assert_eq!(desk.run(&["cache", "clear", "--json"]).ok().json()["removed"], bakes + made);
    assert_eq!(desk.files("cache"), [desk.path("cache/00/notes.txt")]);
    desk.run(&["cache", "stat"]).ok().says(&["0 bakes"]);
}

#[test]
fn bakes_lie_where_the_words_say_or_nowhere() {
    let desk = Desk::new();
    desk.run(&["bake", "scene.ron", "--no-cache"]).ok();
    assert!(desk.files("cache").is_empty());
    desk.run(&["bake", "scene.ron", "--cache-dir", "elsewhere"]).ok().says(&["elsewhere  "]);
    assert!(desk.files("cache").is_empty() && !desk.files("elsewhere").is_empty());
    desk.run(&["bake", "scene.ron"]).ok();
    assert!(!desk.files("cache").is_empty());
    // An empty variable is one that is not set.
    let home = desk.path("home").display().to_string();
    let ran = desk.run_with(&[("DIAPHANE_CACHE", ""), ("HOME", &home), ("XDG_CACHE_HOME", "")], &["cache", "stat"]);
    ran.ok().says(&[&home]);
    // To bake into a place that keeps nothing is to fail; the file in its place stays.
    desk.run(&["bake", "scene.ron", "--cache-dir", "stone.ron"])
        .fails(5, &["cannot be kept in stone.ron", "--cache-dir"]);
    assert_eq!(desk.read("stone.ron"), MATERIAL.as_bytes());
}

#[test]
fn a_damaged_bake_is_told_and_made_again() {
    let desk = Desk::new();
    desk.run(&["bake", "scene.ron"]).ok();
    let bake = desk.files("cache").remove(0);
    let whole = std::fs::read(&bake).unwrap();
    std::fs::write(&bake, &whole[..whole.len() - 1]).unwrap();
    let ran = desk.run(&["bake", "scene.ron"]).ok();
    assert!(ran.err.starts_with("warning: the bake ") && ran.err.contains("made again"), "{ran:#?}");
    assert_eq!(std::fs::read(&bake).unwrap(), whole);
}

/// The word that an interruption is known by is the system's own.
#[cfg(unix)]
#[test]
fn an_interrupted_bake_keeps_what_was_done_and_the_next_goes_on() {
    use std::process::{Command, Stdio};
    let desk = Desk::new();
    // The shape takes a moment; what each of its points sees of the sky, much longer.
    let slow = SCENE.replace("subdivisions: 2", "subdivisions: 7");
    desk.write("slow.ron", slow.replace("lights: [", "lights: [Environment(name: \"sky\"), "));
    let mut baking = Command::new(assert_cmd::cargo::cargo_bin!("diaphane"))
        .args(["bake", "slow.ron"])
        .current_dir(desk.path(""))
        .env("DIAPHANE_CACHE", desk.path("cache"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !desk.files("cache").iter().any(|file| file.extension().is_some_and(|e| e == "bake")) {
        assert!(baking.try_wait().unwrap().is_none(), "it ended before anything was kept");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let sent = Command::new("kill").args(["-INT", &baking.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let output = baking.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert!(said.contains("was interrupted") && said.contains("what was finished is kept"), "{said}");
    assert!(output.stdout.is_empty());

    // What is left is little when nothing looks at the sky.
    let again = desk.run(&["bake", "slow.ron", "--set", "lights=[]", "--json"]).ok().json();
    assert!(again["from_disk"].as_u64().unwrap() >= 1, "{again}");
}

/// A square of side 1 in the plane z, with texture coordinates.
fn sheet(z: f64) -> String {
    format!("v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n")
}

#[test]
fn layers_paints_how_deep_a_mesh_lies_and_says_what_to_write() {
    let desk = Desk::new();
    desk.write("outer.obj", sheet(0.0));
    desk.write("inner.obj", sheet(-0.25));
    desk.write("deeper.obj", sheet(-0.5));
    let words =
        ["layers", "outer.obj", "inner.obj", "deeper.obj", "-o", "depths.png", "--size", "8x4", "--mm-per-unit", "10"];
    let ran = desk.run(&words).ok();
    let told =
        |channel: &str| format!("depth: Texture(image: \"depths.png\", channel: {channel}, range: (0.0, 5.000000))");
    ran.says(&["depths.png  2 layers, up to 5.000 mm deep", &told("R"), &told("G")]);
    let image = image::load_from_memory(&desk.read("depths.png")).expect("it is a PNG").to_rgb8();
    assert_eq!(image.dimensions(), (8, 4));
    // Numbers, not colours: half the depth is half the level.
    assert!(image.pixels().all(|pixel| pixel.0 == [128, 255, 255]), "{:?}", image.get_pixel(3, 2));
    let layer = |channel: &str| format!("(medium: Preset(\"skin1\"), {}), ", told(channel));
    desk.write("painted.ron", format!("Material(version: 1, layers: [{}{}])", layer("R"), layer("G")));
    desk.run(&["check", "painted.ron"]).ok();
    // The other way round the second layer would end above the first.
    desk.write("painted.ron", format!("Material(version: 1, layers: [{}{}])", layer("G"), layer("R")));
    let checked = desk.run(&["check", "painted.ron"]).ok();
    assert!(checked.err.contains("layers[1].depth: over 100 % of its map `layer 1` ends above"), "{checked:#?}");
    // Nothing below, no map, no mesh.
    let run = |outer: &str, inner: &str| desk.run(&["layers", outer, inner, "-o", "no.png"]);
    run("inner.obj", "outer.obj").fails(1, &["outer.obj", "no ray inwards meets it", "hint: "]);
    desk.write("bare.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
    run("bare.obj", "inner.obj").fails(1, &["bare.obj", "no texture coordinates", "hint: "]);
    run("outer.obj", "nothing.obj").fails(1, &["nothing.obj", "cannot be read"]);
    assert!(!desk.path("no.png").exists());
}
