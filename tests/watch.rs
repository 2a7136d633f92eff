//! `watch` from outside: files are edited as people do it, and what it says and draws is looked at.
//!
//! Nothing here depends on how long anything takes: what must not happen is proved by what happens next.

use assert_cmd::cargo::cargo_bin;
use diaphane::image::png_text;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Nothing takes so long, unless it never comes.
const DEADLINE: Duration = Duration::from_secs(60);

const SCENE: &str = r#"Scene(
    version: 1,
    mm_per_unit: 10,
    camera: (eye: (0, 0, 6)),
    lights: [Directional(name: "sun", direction: (0, 0, -1), irradiance: 3)],
    objects: [(name: "thing", mesh: File("thing.obj"), material: "stone.ron")],
    view: (technique: Opaque(), size: (64, 64), antialias: 1),
)
"#;
const STONE: &str = r#"Material(
    version: 1,
    base: "base.ron",
    surface: (color: Texture(image: "color.png")),
)
"#;
const BASE: &str = r#"Material(version: 1, medium: Preset("marble"))"#;
const TETRAHEDRON: &str = "v 1 1 1\nv -1 -1 1\nv -1 1 -1\nv 1 -1 -1\nvt 0.5 0.5\n\
                           f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\nf 2/1 3/1 4/1\n";

/// A picture of one colour.
fn png(color: [u8; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&color).unwrap();
    bytes
}

/// A folder to work in, with shaders and a cache of its own.
struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Desk {
        let desk = Desk(tempfile::tempdir().unwrap());
        desk.write("scene.ron", SCENE);
        desk.write("stone.ron", STONE);
        desk.write("base.ron", BASE);
        desk.write("thing.obj", TETRAHEDRON);
        desk.write("color.png", png([200, 100, 50]));
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    /// As editors do that never leave half a file behind.
    fn replace(&self, name: &str, content: impl AsRef<[u8]>) {
        self.write(".aside.swp", content);
        std::fs::rename(self.path(".aside.swp"), self.path(name)).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The name of the scene that a picture was made of.
    fn scene_of(&self, picture: &str) -> String {
        let text = png_text(&self.read(picture), Path::new(picture)).unwrap();
        text.into_iter().find(|(key, _)| key == "diaphane:scene").unwrap().1
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(cargo_bin!("diaphane"));
        command.current_dir(self.0.path()).args(words).env("DIAPHANE_CACHE", self.path("cache"));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn watch(&self) -> Watched {
        Watched::new(self.command(&["watch", "scene.ron", "-o", "out.png", "--json"]))
    }

    /// What `render` makes of the files as they are now.
    fn rendered(&self) -> Vec<u8> {
        let output = self.command(&["render", "scene.ron", "-o", "other.png"]).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        self.read("other.png")
    }
}

/// A program that is at work, and what it says.
struct Watched {
    child: Child,
    out: Receiver<String>,
    err: Receiver<String>,
}

fn lines(pipe: impl Read + Send + 'static) -> Receiver<String> {
    let (line, lines) = channel();
    std::thread::spawn(move || {
        BufReader::new(pipe).lines().map_while(Result::ok).for_each(|text| _ = line.send(text));
    });
    lines
}

impl Watched {
    fn new(mut command: Command) -> Watched {
        let mut child = command.spawn().unwrap();
        let (out, err) = (lines(child.stdout.take().unwrap()), lines(child.stderr.take().unwrap()));
        Watched { child, out, err }
    }

    #[track_caller]
    fn next(&mut self) -> Value {
        let line = self.out.recv_timeout(DEADLINE).unwrap_or_else(|why| {
            panic!("nothing was told: {why}; it ended: {:?}; said: {:?}", self.child.try_wait(), self.said())
        });
        serde_json::from_str(&line).unwrap_or_else(|why| panic!("{why}: {line}"))
    }

    /// The next thing told is that there is a picture because these files changed.
    #[track_caller]
    fn pictures(&mut self, changed: &[&str]) -> Value {
        let told = self.next();
        assert_eq!((&told["event"], names(&told)), (&Value::from("picture"), sorted(changed)), "{told:#}");
        told
    }

    #[track_caller]
    fn breaks(&mut self, changed: &[&str]) -> Value {
        let told = self.next();
        assert_eq!((&told["event"], names(&told)), (&Value::from("problem"), sorted(changed)), "{told:#}");
        told["problems"][0].clone()
    }

    /// What was said to people so far.
    fn said(&self) -> String {
        self.err.try_iter().map(|line| line + "\n").collect()
    }

    #[cfg(unix)]
    fn interrupt(mut self) -> (Option<i32>, String) {
        let sent = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let status = self.child.wait().unwrap();
        // The pipe ends with the program.
        let said: String = self.err.iter().map(|line| line + "\n").collect();
        (status.code(), said)
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.child.kill().ok(); // it may have ended
        self.child.wait().ok();
    }
}

fn names(told: &Value) -> Vec<String> {
    let name = |path: &Value| Path::new(path.as_str().unwrap()).file_name().unwrap().to_str().unwrap().to_string();
    let mut names: Vec<String> = told["changed"].as_array().unwrap().iter().map(name).collect();
    names.sort();
    names
}

fn sorted(names: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
    names.sort();
    names
}

#[test]
fn a_file_of_any_kind_makes_a_new_picture_and_undoing_it_is_free() {
    let desk = Desk::new();
    let mut watched = desk.watch();
    let first = watched.pictures(&[]);
    assert!(first["ran"].as_u64().unwrap() > 3 && first["width"] == 64, "{first:#}");
    let before = desk.read("out.png");
    let edits: [(&str, Vec<u8>); 5] = [
        ("scene.ron", SCENE.replace("irradiance: 3", "irradiance: 2").into()),
        ("stone.ron", STONE.replace("(color", "(roughness: 0.9, color").into()),
        ("base.ron", BASE.replace("marble", "skin1").into()),
        ("thing.obj", TETRAHEDRON.replace("v 1 1 1", "v 1 2 1").into()),
        ("color.png", png([20, 100, 50])),
    ];
    for (i, (name, content)) in edits.iter().enumerate() {
        let original = desk.read(name);
        // Half are saved in place, half by renaming.
        if i % 2 == 0 {
            desk.write(name, content)
        } else {
            desk.replace(name, content)
        }
        let told = watched.pictures(&[name]);
        assert!(told["ran"].as_u64().unwrap() > 0 && told["ran"].as_u64() < first["ran"].as_u64(), "{told:#}");
        assert_ne!(desk.read("out.png"), before, "{name}");
        desk.replace(name, original);
        let told = watched.pictures(&[name]);
        assert_eq!(told["ran"], 0, "{name} was undone: {told:#}");
        assert_eq!(desk.read("out.png"), before, "{name} was undone");
    }
    assert_eq!(desk.rendered(), before);
}

#[test]
fn shaders_are_followed_too() {
    let desk = Desk::new();
    let copied = Command::new("cp").arg("-r").arg("shaders").arg(desk.path("shaders")).status();
    assert!(copied.unwrap().success());
    let mut watched = desk.watch();
    watched.pictures(&[]);
    let before = desk.read("out.png");
    let shader = "shaders/frame/compose.wgsl";
    let text = String::from_utf8(desk.read(shader)).unwrap();
    desk.write(shader, text.replace("fn fragment(", "fn fragment((")); // a slip
    let problem = watched.breaks(&["compose.wgsl"]);
    let line = 1 + text.lines().position(|line| line.starts_with("fn fragment(")).unwrap();
    assert!(problem["file"].as_str().unwrap().ends_with("compose.wgsl") && problem["line"] == line, "{problem:#}");
    assert_eq!(desk.read("out.png"), before);
    desk.write(shader, text.replace("var radiance = vec3f(0.0);", "var radiance = vec3f(0.5);"));
    assert!(watched.pictures(&["compose.wgsl"])["ran"].as_u64().unwrap() > 0);
    assert_ne!(desk.read("out.png"), before);
    desk.write(shader, &text);
    assert_eq!(watched.pictures(&["compose.wgsl"])["ran"], 0);
    assert_eq!(desk.read("out.png"), before);
}

#[test]
fn what_changes_no_content_makes_no_picture() {
    let desk = Desk::new();
    let mut watched = desk.watch();
    watched.pictures(&[]);
    for _ in 0..10 {
        desk.write("stone.ron", STONE);
        desk.replace("scene.ron", SCENE);
        desk.write("notes.txt", "not a part of it");
        desk.write("out.png", "somebody else's picture");
    }
    // Else something would be told of before this; and the picture lies in the folder that is watched.
    for irradiance in ["2", "1", "0.5"] {
        desk.write("scene.ron", SCENE.replace("irradiance: 3", &format!("irradiance: {irradiance}")));
        watched.pictures(&["scene.ron"]);
    }
    assert_eq!(desk.read("out.png"), desk.rendered());
}

#[test]
fn whatever_is_broken_is_told_at_its_place_and_the_last_picture_stands() {
    let desk = Desk::new();
    let mut watched = desk.watch();
    watched.pictures(&[]);
    let before = desk.read("out.png");
    desk.write("stone.ron", STONE.replace("color: ", "colour: "));
    let problem = watched.breaks(&["stone.ron"]);
    assert_eq!((&problem["file"], &problem["line"]), (&"stone.ron".into(), &4.into()), "{problem:#}");
    assert!(problem["column"].is_u64() && problem["hint"].as_str().unwrap().contains("color"), "{problem:#}");
    // Another mistake in what is not read before the first is mended.
    desk.write("base.ron", "Material(");
    desk.write("stone.ron", STONE);
    assert_eq!(watched.breaks(&["stone.ron"])["file"], "base.ron");
    assert_eq!(desk.read("out.png"), before);
    desk.write("base.ron", BASE);
    assert_eq!(watched.pictures(&["base.ron"])["ran"], 0);

    std::fs::remove_file(desk.path("thing.obj")).unwrap();
    let problem = watched.breaks(&["thing.obj"]);
    assert!(problem["file"] == "scene.ron" && problem["line"] == 6, "at the line that names it: {problem:#}");
    assert_eq!(desk.read("out.png"), before);
    desk.write("thing.obj", TETRAHEDRON);
    assert_eq!(watched.pictures(&["thing.obj"])["ran"], 0);
    assert_eq!(desk.read("out.png"), before);
    let said = watched.said();
    for words in ["stone.ron:4:", "surface: (colour: ", "^", "hint: ", "scene.ron:6:"] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
}

#[cfg(unix)]
#[test]
fn it_waits_for_files_that_are_still_missing_and_ends_well() {
    let desk = Desk::new();
    std::fs::rename(desk.path("scene.ron"), desk.path("later.ron")).unwrap();
    let mut command = desk.command(&["watch", "scene.ron", "-o", "new/out.png", "--size", "32x16", "--timings"]);
    command.env("DIAPHANE_SHADERS", ""); // an empty variable is one that is not set
    let watched = Watched::new(command);
    let wait_for = |words: &str| {
        let mut said = String::new();
        while !said.contains(words) {
            said += &watched.err.recv_timeout(DEADLINE).unwrap_or_else(|why| panic!("no {words:?}: {why} in {said}"));
            said += "\n";
        }
        said
    };
    wait_for("following 1 file; Ctrl-C ends it");
    assert!(!desk.path("new").exists());
    std::fs::rename(desk.path("later.ron"), desk.path("scene.ron")).unwrap();
    wait_for("scene.ron changed: new/out.png  32 x 16  ");
    wait_for(" ms  frame.gbuffer");
    desk.write("base.ron", "Material(version: 1, medium: Preset(\"marbel\"))");
    let said = wait_for("new/out.png stays as it was until this is mended");
    assert!(said.contains("base.ron:1:"), "{said}");
    desk.write("base.ron", BASE);
    let said = wait_for("base.ron changed: new/out.png  32 x 16  ");
    assert!(said.contains("  0 of ") && said.contains(" steps ran"), "{said}");
    let (status, said) = watched.interrupt();
    assert_eq!(status, Some(0), "{said}");
}

#[test]
fn words_that_no_edit_mends_end_it_at_once() {
    let desk = Desk::new();
    let run = |words: &[&str]| {
        let output = desk.command(&[&["watch", "scene.ron"], words].concat()).output().unwrap();
        assert!(output.stdout.is_empty(), "{output:?}");
        (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    for words in [
        &["-o", "out.jpg"][..],
        &["-o", "out.png", "--technique", "Opake()"],
        &["-o", "out.png", "--camera", "nowhere"],
        &["-o", "out.png", "--set", "viev.size=(1, 1)"],
    ] {
        let (status, said) = run(words);
        assert!(status == 2 && said.contains("error: ") && said.contains("hint: "), "{words:?}: {status} {said}");
    }
    let mut command = desk.command(&["watch", "scene.ron", "-o", "out.png"]);
    let output = command.env("VK_DRIVER_FILES", "/nowhere.json").env("VK_ICD_FILENAMES", "/nowhere.json").output();
    assert_eq!(output.unwrap().status.code(), Some(3));
    assert!(!desk.path("out.png").exists());
}

#[test]
fn of_many_edits_the_last_one_wins() {
    let desk = Desk::new();
    let mut watched = desk.watch();
    watched.pictures(&[]);
    let edit = |i: u32| SCENE.replace("irradiance: 3", &format!("irradiance: {}", 0.01 * f64::from(i)));
    let started = Instant::now();
    for i in 1..=200 {
        if i % 2 == 0 {
            desk.write("scene.ron", edit(i))
        } else {
            desk.replace("scene.ron", edit(i))
        }
        std::thread::sleep((started + i * Duration::from_millis(10)).saturating_duration_since(Instant::now()));
    }
    let last = desk.rendered();
    let scene = desk.scene_of("other.png");
    // A file that is written in place may be read while it is half there; that is a mistake for a moment.
    while desk.scene_of("out.png") != scene {
        assert_eq!(names(&watched.next()), ["scene.ron"]);
    }
    assert_eq!(desk.read("out.png"), last);
    // And it rests: what is told next is the next edit.
    desk.write("stone.ron", STONE.replace("(color", "(roughness: 0.9, color"));
    loop {
        // The picture may have been there a moment before it was told of.
        let told = watched.next();
        if names(&told) == ["stone.ron"] {
            break;
        }
        assert_eq!(names(&told), ["scene.ron"], "{told:#}");
        assert_eq!(desk.scene_of("out.png"), scene);
    }
}

/// Its surroundings are looked for by rays from a great many vertices.
fn slow() -> String {
    SCENE
        .replace("File(\"thing.obj\")", "Sphere(subdivisions: 7)")
        .replace("lights: [", "lights: [Environment(name: \"sky\", radiance: 1), ")
}

/// Waits until a step of the slow scene is kept, so that the next one is being made.
fn wait_for_a_bake(desk: &Desk, watched: &mut Watched) {
    let bakes = || {
        let folders = std::fs::read_dir(desk.path("cache")).into_iter().flatten().flatten();
        folders.map(|folder| std::fs::read_dir(folder.path()).into_iter().flatten().count()).sum::<usize>()
    };
    let before = bakes();
    desk.write("scene.ron", slow());
    let started = Instant::now();
    while bakes() == before {
        assert!(watched.child.try_wait().unwrap().is_none() && started.elapsed() < DEADLINE, "{}", watched.said());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_bake_that_is_overtaken_by_an_edit_is_given_up() {
    let desk = Desk::new();
    let mut watched = desk.watch();
    watched.pictures(&[]);
    wait_for_a_bake(&desk, &mut watched);
    desk.replace("scene.ron", SCENE.replace("irradiance: 3", "irradiance: 1"));
    watched.pictures(&["scene.ron"]); // the first since: of the slow scene there is none
    assert_eq!(desk.read("out.png"), desk.rendered());
    // What was given up is taken up again when it is wanted, and so is what was there at first.
    desk.write("scene.ron", SCENE);
    watched.pictures(&["scene.ron"]);
}

#[cfg(unix)]
#[test]
fn an_interrupted_bake_keeps_the_picture_and_ends_it() {
    let desk = Desk::new();
    let mut watched = desk.watch();
    watched.pictures(&[]);
    let before = desk.read("out.png");
    wait_for_a_bake(&desk, &mut watched);
    let (status, said) = watched.interrupt();
    assert_eq!(status, Some(5), "{said}");
    assert!(said.contains("was interrupted") && said.contains("hint: "), "{said}");
    assert_eq!(desk.read("out.png"), before);
}
