//! What is wrong with files, seen with its place, its exact words, and the right exit status.

use crate::{Desk, MATERIAL, NO_ADAPTER, SCENE};
use std::path::Path;

/// That exactly this is said of `scene.ron`, by whoever reads it, and ends with status 1.
#[track_caller]
fn told(desk: &Desk, expected: &str) {
    for words in [&["check", "scene.ron"][..], &["explain", "scene.ron"], &["render", "scene.ron", "-o", "a.png"]] {
        assert_eq!(desk.run_with(&NO_ADAPTER, words).fails(1, &[]).err.trim_end(), expected);
    }
}

/// The same of a scene in which `from` became `to`.
#[track_caller]
fn scene(from: &str, to: &str, expected: &str) {
    let desk = Desk::new();
    assert!(SCENE.contains(from));
    desk.write("scene.ron", SCENE.replace(from, to));
    told(&desk, expected);
}

/// The same of a scene of filtered normals with this material.
#[track_caller]
fn material(text: &str, expected: &str) {
    let desk = Desk::new();
    desk.write("scene.ron", SCENE.replace("Opaque()", "FilteredNormals()"));
    desk.write("stone.ron", text);
    told(&desk, expected);
}

#[test]
fn a_misspelt_field() {
    scene(
        "irradiance: 3",
        "iradiance: 3",
        r#"scene.ron:6:62: error: lights[0].iradiance: there is no field `iradiance`
  |
6 |     lights: [Directional(name: "sun", direction: (0, 0, -1), iradiance: 3)],
  |                                                              ^^^^^^^^^
  = hint: did you mean `irradiance`? Known are name, direction, irradiance, shadow, enabled"#,
    );
}

#[test]
fn a_missing_mesh() {
    scene(
        "Sphere(radius: 1, subdivisions: 2)",
        "File(\"ball.obj\")",
        r#"scene.ron:7:41: error: objects[0].mesh: cannot read `ball.obj`: there is no such file
  |
7 |     objects: [(name: "ball", mesh: File("ball.obj"), material: "stone.ron")],
  |                                         ^^^^^^^^^^
  = hint: looked in the current folder; paths are relative to the file that names them"#,
    );
}

#[test]
fn not_a_number() {
    scene(
        "mm_per_unit: 10",
        "mm_per_unit: NaN",
        r#"scene.ron:3:18: error: mm_per_unit: NaN is not a finite number
  |
3 |     mm_per_unit: NaN,
  |                  ^^^
  = hint: write a number"#,
    );
}

#[test]
fn a_negative_sigma() {
    material(
        "Material(version: 1, medium: Coefficients(sigma_a: (0.1, -0.1, 0.1), sigma_s: 1))",
        r#"stone.ron:1:58: error: medium.sigma_a: -0.1 is not allowed
  |
1 | Material(version: 1, medium: Coefficients(sigma_a: (0.1, -0.1, 0.1), sigma_s: 1))
  |                                                          ^^^^
  = hint: 1/mm, 0 or more"#,
    );
}

#[test]
fn an_unknown_preset() {
    material(
        "Material(version: 1, medium: Preset(\"marbel\"))",
        r#"stone.ron:1:37: error: medium: there is no preset `marbel`
  |
1 | Material(version: 1, medium: Preset("marbel"))
  |                                     ^^^^^^^^
  = hint: did you mean `marble`? Known are apple, chicken1, chicken2, cream, ketchup, marble, potato, skimmilk, skin1, skin2, spectralon, wholemilk, fish dermis, fish blood, fish organs"#,
    );
}

#[test]
fn a_circle_of_bases() {
    let desk = Desk::new();
    desk.write("stone.ron", "Material(version: 1, base: \"rock.ron\")");
    desk.write("rock.ron", "Material(version: 1, base: \"stone.ron\")");
    told(
        &desk,
        r#"rock.ron:1:28: error: base: a material cannot inherit from itself
  |
1 | Material(version: 1, base: "stone.ron")
  |                            ^^^^^^^^^^^
  = hint: break the circle stone.ron -> rock.ron -> stone.ron"#,
    );
}

#[test]
fn an_image_that_claims_eight_gigabytes() {
    let desk = Desk::new();
    // 32768 x 32768 pixels of 16 bits a channel, of which nothing follows.
    let mut header = b"IHDR\0\0\x80\0\0\0\x80\0\x10\x06\0\0\0".to_vec();
    let sum = header.iter().fold(!0_u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| if sum & 1 == 1 { (sum >> 1) ^ 0xedb8_8320 } else { sum >> 1 })
    });
    header.extend_from_slice(&(!sum).to_be_bytes());
    desk.write("huge.png", [b"\x89PNG\r\n\x1a\n\0\0\0\x0d", &header[..], b"\0\0\0\x09IDAT"].concat());
    desk.write("stone.ron", "Material(version: 1, surface: (color: Texture(image: \"huge.png\")))");
    told(
        &desk,
        r#"stone.ron:1:54: error: surface.color.image: huge.png: the image says that it is 32768 x 32768 pixels, which take 17179869184 bytes
  |
1 | Material(version: 1, surface: (color: Texture(image: "huge.png")))
  |                                                      ^^^^^^^^^^
  = hint: at most 16384 pixels on a side and 1073741824 bytes are read (16 a pixel): scale it down, or write it again if that is not its size"#,
    );
}

#[test]
fn an_empty_obj() {
    let desk = Desk::new();
    desk.write("scene.ron", SCENE.replace("Sphere(radius: 1, subdivisions: 2)", "File(\"empty.obj\")"));
    for content in ["", "# nothing\n"] {
        desk.write("empty.obj", content);
        told(
            &desk,
            r#"scene.ron:7:41: error: objects[0].mesh: empty.obj: there is no mesh in this file
  |
7 |     objects: [(name: "ball", mesh: File("empty.obj"), material: "stone.ron")],
  |                                         ^^^^^^^^^^^
  = hint: an OBJ mesh has lines `v x y z` and faces `f 1 2 3`"#,
        );
    }
}

#[test]
fn a_kernel_that_is_too_steep_for_an_engine() {
    // It is told where it is written, in the base, and only while that engine is asked for.
    let desk = Desk::new();
    desk.write("stone.ron", "Material(version: 1, base: \"rock.ron\")");
    desk.write("rock.ron", "Material(version: 1, filter: Box(wavelength: 2))");
    desk.run(&["explain", "scene.ron", "--technique", "FilteredNormals()"]).ok();
    let words = ["explain", "scene.ron", "--technique", "FilteredNormals(engine: Krylov)"];
    desk.run(&words).fails(
        1,
        &["rock.ron:1:30: error: filter: this kernel falls too steeply for FilteredNormals(engine: Krylov)", "Auto"],
    );
    desk.write("scene.ron", SCENE.replace("Opaque()", "FilteredNormals(engine: Krylov)"));
    desk.run(&["explain", "scene.ron", "--technique", "Opaque()"]).ok();
}

#[test]
fn light_that_is_filtered_needs_eigenpairs_of_all_areas() {
    let desk = Desk::new();
    let explain = |technique: &str| desk.run(&["explain", "scene.ron", "--technique", technique]);
    let refused = "FilteredNormals(signal: Irradiance";
    for (filter, more, what, hint) in [
        ("Gaussian(width: 2)", "laplacian: MeanArea", "over one mean area light would not be conserved", "MeanArea"),
        ("Gaussian(width: 2)", "engine: Krylov", "a basis that is made for normals does not hold light", "Krylov"),
        ("Neighbours(sigma_tr: 1, radius: 2)", "engine: Auto", "filters by frequency, not over neighbours", "Normals"),
    ] {
        desk.write("stone.ron", format!("Material(version: 1, filter: {filter})"));
        let told = explain(&format!("{refused}, {more})"));
        told.fails(1, &["stone.ron:1:30: error: filter: ", what, hint]);
        explain(&format!("FilteredNormals({more})")).ok();
    }
    desk.write("stone.ron", "Material(version: 1, filter: Gaussian(width: 2))");
    explain("FilteredNormals(signal: Irradiance)").ok();
}

#[test]
fn a_technique_that_is_not_there_yet() {
    let desk = Desk::new();
    for name in ["SphericalThickness(bands: 5)", "LongRange()", "ScreenSpace", "Auto"] {
        desk.write("later.ron", SCENE.replace("Opaque()", name));
        let ran = desk.run(&["check", "later.ron"]);
        if ran.status != 0 {
            ran.fails(
                1,
                &["later.ron:8:23: error: view.technique: ", "is not in this version", "hint: there is Opaque, "],
            );
        }
    }
    desk.write("wrong.ron", SCENE.replace("Opaque()", "Opake()"));
    desk.run(&["check", "wrong.ron"]).fails(1, &["wrong.ron:8:23", "there is no technique `Opake`", "did you mean"]);
    // Another technique in its place is a way out.
    desk.run(&["explain", "wrong.ron", "--technique", "Opaque()"]).ok();
}

#[test]
fn a_file_of_the_wrong_kind() {
    let desk = Desk::new();
    desk.run(&["render", "stone.ron", "-o", "a.png"])
        .fails(1, &["stone.ron:1:1: error: expected Scene( ), found `Material`"]);
    desk.run(&["explain", "."]).fails(1, &[".: error: cannot read `.`: it is a folder", "name a file in it"]);
    desk.write("scene.ron", SCENE.replace("\"stone.ron\"", "\"scene.ron\""));
    desk.run(&["check", "scene.ron"]).fails(1, &["expected Material( ), found `Scene`"]);
    desk.run(&["check", "scane.ron"]).fails(1, &["scane.ron: error: cannot read", "did you mean `scene.ron`?"]);
    desk.run(&["check", "no/such/scene.ron"]).fails(1, &["looked in no/such, which is not there"]);
    desk.run(&["check", "scene.ron/scene.ron"]).fails(1, &["looked in scene.ron, which is a file"]);
    if Path::new("/dev/zero").exists() {
        desk.run(&["check", "/dev/zero"]).fails(1, &["it is not a regular file"]);
    }
}

#[test]
fn content_that_is_no_scene() {
    let desk = Desk::new();
    let deep = format!("Scene(version: 1, mm_per_unit: {}1{})", "(".repeat(100_000), ")".repeat(100_000));
    let large = format!("Scene(version: 1, mm_per_unit: 1, /* {} */)", " ".repeat(100 << 20));
    let cases: [(&[u8], &[&str]); 8] = [
        (b"", &["scene.ron: error: the file is empty", "hint: begin with Scene(version: 1"]),
        (b"\xef\xbb\xbf \r\n", &["scene.ron: error: the file is empty"]),
        (b"\x7fELF\x02\x01\x01\0\0\xff\xfe\xb0", &["scene.ron: error: the file is not UTF-8 text", "hint: is this"]),
        (b"Scene(version: 1, mm_per_unit: 1) // caf\xe9", &["scene.ron: error: the file is not UTF-8 text"]),
        (b"Scene(version: 2, mm_per_unit: 1)", &["scene.ron:1:16: error: version: version 2", "reads version 1"]),
        (b"Scene(mm_per_unit: 1)", &["scene.ron:1:1: error: the field `version` is missing"]),
        (deep.as_bytes(), &["scene.ron:1:96: error: brackets are nested more than 64 deep"]),
        (large.as_bytes(), &["scene.ron: error: the file has 104857641 bytes, more than the 67108864 that are read"]),
    ];
    for (content, words) in cases {
        desk.write("scene.ron", content);
        let ran = desk.run(&["check", "scene.ron"]).fails(1, words);
        assert!(ran.err.lines().all(|line| line.chars().count() < 250), "an enormous line is not shown whole");
        desk.run(&["explain", "scene.ron"]).fails(1, &words[..1]);
    }
}

#[test]
fn other_editors_line_ends_and_marks_are_fine_and_places_stay_right() {
    let desk = Desk::new();
    let foreign = format!("\u{feff}{}", SCENE.replace('\n', "\r\n"));
    desk.write("scene.ron", &foreign);
    desk.write("stone.ron", format!("\u{feff}{}", MATERIAL.replace('\n', "\r\n")));
    desk.run(&["check", "scene.ron", "stone.ron"]).ok();
    desk.write("scene.ron", foreign.replace("radius: 1", "radius: -1"));
    desk.run(&["check", "scene.ron"]).fails(1, &["scene.ron:7:51: error: objects[0].mesh.radius: -1 is not allowed"]);
}

#[test]
fn what_is_set_is_named_by_its_path_and_wrong_words_are_words() {
    let desk = Desk::new();
    let set = |set: &str| desk.run_with(&NO_ADAPTER, &["explain", "scene.ron", "--json", "--set", set]);
    // By name, by index, and what the file leaves out.
    let key = |ran: crate::Ran| ran.ok().json()["steps"][0]["about"].as_str().unwrap().to_string();
    assert!(key(set("objects.ball.mesh.radius=2")).contains("radius 2"));
    assert_eq!(key(set("objects.0.mesh.radius=2")), key(set("objects.ball.mesh = Sphere(radius: 2, subdivisions: 2)")));
    for absent in
        ["objects.ball.transform.scale=2", "view.tone=Filmic", "reference.seed=7", "objects.ball.visible=true"]
    {
        set(absent).ok();
    }
    let fails = |wrong: &str, words: &[&str]| drop(desk.run(&["explain", "scene.ron", "--set", wrong]).fails(2, words));
    fails("objects", &["--set objects: there is no `=`", "hint: write the path"]);
    fails("objects.bal.visible=true", &["--set:1:1", "no member `bal`", "did you mean `ball`?"]);
    fails("objects.7.visible=true", &["no member `7`", "or one of ball"]);
    fails("objects.ball.visibel=true", &["objects[0].visibel", "did you mean `visible`?"]);
    fails("view.size=(1, 1", &["--set:1:11", "never closed"]);
    fails("view.size=(0, 1)", &["--set:1:12", "0 is not allowed"]);
    fails("objects.ball.mesh.radius=\"2\"", &["--set:1:26", "expected a number, found a text"]);
    fails("objects.ball.material=\"sand.ron\"", &["--set:1:23", "no such file", "relative to the scene's file"]);
    fails("mm_per_unit=", &["--set:1:13", "found the end of the text"]);
    // A file that is wrong elsewhere is still the file.
    desk.write("scene.ron", SCENE.replace("mm_per_unit: 10", "mm_per_unit: 0"));
    desk.run(&["explain", "scene.ron", "--set", "view.tone=Clamp"]).fails(1, &["scene.ron:3:18"]);
    desk.run(&["explain", "scene.ron", "--set", "mm_per_unit=1"]).ok();
}

/// A copy of the shaders, in which one may be broken.
fn shaders(desk: &Desk) {
    fn copy(from: &Path, name: &str, desk: &Desk) {
        for entry in std::fs::read_dir(from).unwrap().flatten() {
            let below = format!("{name}/{}", entry.file_name().to_string_lossy());
            match entry.path() {
                path if path.is_dir() => copy(&path, &below, desk),
                path => desk.write(&below, std::fs::read(path).unwrap()),
            }
        }
    }
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), "shaders", desk);
}

#[test]
fn a_broken_shader_is_told_at_its_line_and_a_missing_one_by_its_name() {
    let desk = Desk::new();
    shaders(&desk);
    let explain = |folder: &str| desk.run_with(&[("DIAPHANE_SHADERS", folder)], &["explain", "scene.ron"]);
    assert_eq!(explain("shaders").ok().out, explain("").ok().out);
    let included = "shaders/lib/octahedron.wgsl";
    let text = String::from_utf8(desk.read(included)).unwrap();
    let line = text.lines().count() + 1;
    desk.write(included, format!("{text}fn broken() -> f32 {{ return oops; }}\n"));
    let place = format!("{included}:{line}:29: error: the shader ");
    let ran = explain("shaders").fails(1, &[&place, "oops", "return oops;", "^^^^", "hint: "]);
    assert!(ran.err.starts_with(&place), "{ran:#?}");
    let render = ["render", "scene.ron", "-o", "a.png"];
    desk.run_with(&[("DIAPHANE_SHADERS", "shaders")], &render).fails(1, &[&place]);
    assert!(!desk.path("a.png").exists());

    std::fs::remove_file(desk.path("shaders/techniques/local.wgsl")).unwrap();
    desk.write(included, text);
    explain("shaders").fails(1, &["the shader techniques/local.wgsl cannot be read", "put it into shaders"]);
    explain("nowhere").fails(1, &["cannot be read", "DIAPHANE_SHADERS"]);
}
