//! `render` and `doctor`: pictures, their names, and what is in the way of them.

use crate::{Desk, NO_ADAPTER, SCENE};
use diaphane::image::png_text;
use std::path::Path;

/// Linear values of an image that was written, row by row.
fn pixels(desk: &Desk, name: &str) -> (u32, u32, Vec<[f32; 3]>) {
    let image = diaphane::image::decode(&desk.read(name), Path::new(name), diaphane::image::Encoding::Srgb).unwrap();
    let image = image.image();
    (image.width, image.height, image.pixels)
}

#[test]
fn a_picture_is_written_where_the_words_say_with_what_made_it() {
    let desk = Desk::new();
    if !desk.draws() {
        return;
    }
    let ran = desk.run(&["render", "scene.ron", "-o", "out/deep/a.png"]).ok();
    assert!(ran.out.starts_with("out/deep/a.png  24 x 16  ") && ran.err.is_empty(), "{ran:#?}");
    ran.says(&["0 bakes from disk", "passes drawn"]);
    let (width, height, seen) = pixels(&desk, "out/deep/a.png");
    assert_eq!((width, height), (24, 16));
    assert!(seen[8 * 24 + 12][0] > 0.1 && seen[0] == [0.0; 3], "a lit ball in the middle of nothing");
    let text = png_text(&desk.read("out/deep/a.png"), Path::new("a.png")).unwrap();
    let value = |text: &[(String, String)], name: &str| text.iter().find(|(key, _)| key == name).unwrap().1.clone();
    assert_eq!(value(&text, "diaphane:technique"), "Opaque()");
    assert_eq!(value(&text, "Software"), concat!("diaphane ", env!("CARGO_PKG_VERSION")));
    assert_eq!(value(&text, "diaphane:scene").len(), 64);

    // The same again is the same file; another size, technique and scene are told.
    desk.run(&["render", "scene.ron", "-o", "b.png"]).ok().says(&["0 made"]);
    assert_eq!(desk.read("b.png"), desk.read("out/deep/a.png"));
    let words = ["render", "scene.ron", "-o", "c.png", "--size", "10x20", "--technique", "FilteredNormals()"];
    desk.run(&[&words[..], &["--set", "lights.sun.irradiance=1"]].concat()).ok();
    assert_eq!(pixels(&desk, "c.png").1, 20);
    let other = png_text(&desk.read("c.png"), Path::new("c.png")).unwrap();
    assert_eq!(value(&other, "diaphane:technique"), "FilteredNormals()");
    assert_ne!(value(&other, "diaphane:scene"), value(&text, "diaphane:scene"));

    // Linear, and the same light; an extension is one in capitals too.
    let json = desk.run(&["render", "scene.ron", "-o", "a.EXR", "--json", "--timings"]).ok();
    assert!(json.err.is_empty());
    assert_eq!(json.json()["images"][0]["path"], "a.EXR");
    let (_, _, linear) = pixels(&desk, "a.EXR");
    assert!((linear[8 * 24 + 12][0] - seen[8 * 24 + 12][0]).abs() < 0.01);
}

#[test]
fn parts_sum_to_the_whole_and_nothing_is_skipped_that_shows() {
    let desk = Desk::new();
    if !desk.draws() {
        return;
    }
    // A neighbour outside of the view, for there to be something to leave out.
    let other =
        r#"(name: "far", mesh: Sphere(subdivisions: 1), material: "stone.ron", transform: (translate: (50, 0, 0))),"#;
    desk.write("two.ron", SCENE.replace("objects: [", &format!("objects: [{other}")));
    let render = |out: &str, more: &[&str]| {
        desk.run(&[&["render", "two.ron", "-o", out], more].concat()).ok();
        pixels(&desk, out).2
    };
    let whole = render("full.exr", &[]);
    let parts = ["scattered", "glossy", "unscattered"].map(|part| render(&format!("{part}.exr"), &["--part", part]));
    for (i, pixel) in whole.iter().enumerate() {
        for c in 0..3 {
            let sum: f32 = parts.iter().map(|part| part[i][c]).sum();
            assert!((sum - pixel[c]).abs() <= 1e-5 * (1.0 + pixel[c]), "{sum} {}", pixel[c]);
        }
    }
    assert!(parts[0] != whole && parts[1] != whole);
    assert_eq!(render("all.exr", &["--no-skip"]), whole);
}

#[test]
fn rows_of_pictures_turn_and_pass_in_time() {
    let desk = Desk::new();
    if !desk.draws() {
        return;
    }
    // A lit side, so that turning shows; a twist in time, so that time does.
    let twist = "deform: [Twist(deg_per_unit: 90, speed_hz: 1)],";
    let cube = SCENE.replace("Sphere(radius: 1, subdivisions: 2)", "Box(size: (1, 2, 1))");
    desk.write("row.ron", cube.replace("material: \"stone.ron\"", &format!("material: \"stone.ron\", {twist}")));
    let ran = desk.run(&["render", "row.ron", "--frames", "2", "--fps", "8", "-o", "f.%04d.png", "--timings"]).ok();
    ran.says(&["f.0000.png  24 x 16", "f.0001.png  24 x 16", " ms  frame.gbuffer"]);
    assert_ne!(desk.read("f.0000.png"), desk.read("f.0001.png"));
    desk.run(&["render", "row.ron", "--time", "0.125", "-o", "t.png"]).ok();
    let rows = |name: &str| pixels(&desk, name).2;
    assert_eq!(rows("t.png"), rows("f.0001.png"));
    desk.run(&["render", "row.ron", "--turntable", "2", "-o", "turn/%d.png"]).ok().says(&["turn/0.png", "turn/1.png"]);
    assert_eq!(rows("turn/0.png"), rows("f.0000.png"));
    assert!(rows("turn/1.png") != rows("turn/0.png"), "the sun is behind it");
    desk.run(&["render", "row.ron", "--camera", "close", "-o", "close.png"]).ok();
    assert_ne!(rows("close.png"), rows("turn/0.png"));
}

#[test]
fn words_that_ask_for_no_picture_are_told_before_any_work() {
    let desk = Desk::new();
    let render = |words: &[&str]| desk.run_with(&NO_ADAPTER, &[&["render", "scene.ron"], words].concat());
    for name in ["a.jpg", "a", "png", "a.png.txt"] {
        render(&["-o", name]).fails(2, &[name, "ends in .png or .exr"]);
    }
    render(&["-o", "a.png", "--frames", "2"]).fails(2, &["-o out.%04d.png"]);
    render(&["-o", "a.%070000d.png", "--frames", "2"]).fails(2, &["-o out.%04d.png"]);
    render(&["-o", "a.%d.png", "--frames", "0"]).fails(2, &["at least 1"]);
    render(&["-o", "a.%d.png", "--frames", "-1"]).fails(2, &[]);
    render(&["-o", "a.%d.png", "--frames", "2", "--turntable", "2"]).fails(2, &["--turntable"]);
    for fps in ["0", "NaN", "-3"] {
        render(&["-o", "a.%d.png", "--frames", "2", &format!("--fps={fps}")]).fails(2, &["--fps", "above 0"]);
    }
    for size in ["0x5", "5", "5x", "-1x5", "99999x1", "4 x 4", "5x5x5"] {
        render(&["-o", "a.png", &format!("--size={size}")]).fails(2, &["WIDTHxHEIGHT"]);
    }
    render(&["-o", "a.png", "--time", "inf"]).fails(2, &["--time"]);
    render(&["-o", "a.png", "--camera", "cloze"]).fails(2, &["no bookmark `cloze`", "did you mean `close`?"]);
    render(&["-o", "a.png", "--camera", "from the moon"]).fails(2, &["the scene has `close`"]);
    render(&["-o", "a.png", "--camera", "x", "--set", "bookmarks={}"]).fails(2, &["add bookmarks: {"]);
    render(&["-o", "a.png", "--technique", "Opake()"]).fails(2, &["--technique:1:1", "did you mean `Opaque`?"]);
    render(&["-o", "a.png", "--technique", "Opaque("]).fails(2, &["--technique:1:7", "never closed"]);
    render(&["-o", "a.png", "--technique", "Opaque(x: 1)"]).fails(2, &["--technique:1:8", "`x`"]);
    assert_eq!(desk.files("").len(), 2, "nothing was written");
}

#[test]
fn without_an_adapter_it_says_what_to_install() {
    let desk = Desk::new();
    for words in [&["render", "scene.ron", "-o", "a.png"][..], &["doctor"]] {
        desk.run_with(&NO_ADAPTER, words).fails(3, &["there is no graphics adapter", "hint: install", "driver"]);
    }
    assert!(!desk.path("a.png").exists());
    if desk.draws() {
        let doctor = desk.run(&["doctor", "--json"]).ok().json();
        let name = doctor["adapters"][0]["name"].as_str().unwrap().to_string();
        // A part of the name is enough, in whatever case; a slip is told.
        desk.run(&["doctor", "--adapter", &name[..4].to_uppercase()]).ok().says(&[&format!("* {name}")]);
        let words = ["render", "scene.ron", "-o", "a.png", "--adapter"];
        desk.run(&[&words[..], &["GeForce 256"]].concat()).fails(3, &["no adapter `GeForce 256`", &name]);
        desk.run(&[&words[..], &[&format!("{name}x")]].concat()).fails(3, &[&format!("did you mean `{name}`?")]);
    }
}

#[test]
fn a_picture_that_cannot_be_made_or_written_leaves_the_old_one() {
    let desk = Desk::new();
    desk.write("a.png", "the old picture");
    desk.write("bad.ron", SCENE.replace("radius: 1", "radios: 1"));
    desk.run(&["render", "bad.ron", "-o", "a.png"]).fails(1, &["bad.ron:7:43", "did you mean `radius`?"]);
    desk.run(&["render", "nothing.ron", "-o", "a.png"]).fails(1, &["nothing.ron", "no such file"]);
    desk.run_with(&NO_ADAPTER, &["render", "scene.ron", "-o", "a.png"]).fails(3, &[]);
    assert_eq!(desk.read("a.png"), b"the old picture");
    if !desk.draws() {
        return;
    }
    // A folder where the picture should be, and a file where its folder should be.
    desk.write("folder.png/a.txt", "");
    for (out, why) in
        [("folder.png", "directory"), ("a.png/b.png", "a.png/b.png"), ("/dev/full/c.png", "/dev/full/c.png")]
    {
        desk.run(&["render", "scene.ron", "-o", out]).fails(5, &["it cannot be written", why, "hint: "]);
    }
    assert_eq!(desk.read("a.png"), b"the old picture");
    // A full disk, as far as one can be had.
    if Path::new("/dev/full").exists() {
        std::os::unix::fs::symlink("/dev/full", desk.path("full.png")).unwrap();
        desk.run(&["render", "scene.ron", "-o", "full.png"]).fails(5, &["No space left"]);
    }
    // A cache that cannot be written is a pity, and no failure.
    let ran = desk.run(&["render", "scene.ron", "-o", "a.png", "--cache-dir", "stone.ron"]).ok();
    assert!(ran.err.starts_with("warning: bakes cannot be kept in stone.ron"), "{ran:#?}");
    assert_ne!(desk.read("a.png"), b"the old picture");
    // More than the adapter holds.
    let words = ["render", "scene.ron", "-o", "b.png", "--size", "16384x1", "--set", "view.antialias=4"];
    desk.run(&words).fails(2, &["16384 x 1 pixels of 4 x 4 samples", "at most"]);
}

/// Whoever reads only the first line, or has no room, gets no trace of the program's insides.
#[cfg(unix)]
#[test]
fn a_reader_that_stops_and_a_full_disk_are_taken_calmly() {
    let desk = Desk::new();
    let program = assert_cmd::cargo::cargo_bin!("diaphane").display().to_string();
    let shell = |line: &str| {
        let output = std::process::Command::new("sh").args(["-c", line]).current_dir(desk.path("")).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    // `true` reads nothing, and is gone before anything is said.
    assert_eq!(
        shell(&format!("(sleep 0.2; '{program}' media list; echo $? >status) | true")),
        (Some(0), String::new())
    );
    assert_eq!(desk.read("status"), b"0\n");
    if Path::new("/dev/full").exists() {
        let (status, said) = shell(&format!("'{program}' media list >/dev/full"));
        assert!(status == Some(5) && said.contains("stdout cannot be written: No space left"), "{said}");
    }
    assert_eq!(shell(&format!("'{program}' check nothing.ron 2>&-")).0, Some(1));
}
