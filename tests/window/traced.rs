//! The truth in a window: it gets better as long as one waits, and begins again when anything changes.

use super::desktop::{Window, window};
use diaphane::image::{Encoding, decode};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// A scene with short paths.
fn scene(radiance: f64, technique: &str) -> String {
    format!(
        r#"Scene(
    version: 1,
    mm_per_unit: 10,
    camera: (eye: (0, 0, 4)),
    lights: [Environment(name: "sky", radiance: {radiance})],
    objects: [(name: "ball", mesh: Sphere(radius: 1, subdivisions: 2), material: "dark.ron")],
    view: (technique: {technique}),
)
"#
    )
}

const DARK: &str = "Material(version: 1, medium: AlbedoMfp(albedo: 0.5, mfp: 2))";

fn traced_window(technique: &str) -> Option<Window> {
    let window = window(&scene(1.0, technique), &[])?;
    window.write("work/dark.ron", DARK);
    Some(window)
}

fn samples(picture: &Value) -> u64 {
    picture["traced"]["samples"].as_u64().unwrap_or_else(|| panic!("{picture} is not traced"))
}

impl Window {
    /// The next picture with so many samples, whole and of what is wanted.
    #[track_caller]
    fn picture_of(&mut self, count: u64) -> Value {
        self.until("picture of so many samples", |event| {
            let whole = event["current"] == true && event["whole"] == true;
            event["event"] == "drawn" && whole && event["traced"]["samples"] == count
        })
    }

    /// The next picture that is good enough.
    #[track_caller]
    fn good_picture(&mut self) -> Value {
        self.until("good picture", |event| {
            event["event"] == "drawn" && event["whole"] == true && event["traced"]["refines"] == false
        })
    }
}

#[test]
fn the_truth_doubles_its_samples_until_it_is_good_enough_and_then_rests() {
    let Some(mut window) = traced_window("Reference(max_error: 0.2)") else { return };
    let first = window.picture_of(1);
    assert!(first["traced"]["refines"] == true && first["traced"]["relative_standard_error"].is_null(), "{first}");
    let good = window.good_picture();
    let drawn: Vec<Value> = window.seen.iter().filter(|event| event["event"] == "drawn").cloned().collect();
    assert!(drawn.len() > 3 && drawn.windows(2).all(|pair| samples(&pair[1]) == 2 * samples(&pair[0])), "{drawn:#?}");
    let errors: Vec<f64> = drawn.iter().filter_map(|e| e["traced"]["relative_standard_error"].as_f64()).collect();
    let (last, before) = errors.split_last().unwrap();
    assert!(*last <= 0.2 && before.iter().all(|error| *error > 0.2), "{errors:?}");

    // It is what `diaphane render` makes, to the last bit.
    window.tell("screenshot shown.png");
    window.event("screenshot");
    let program = assert_cmd::cargo::cargo_bin!("diaphane");
    let output = Command::new(program)
        .args(["render", "work/scene.ron", "--size", "160x120", "--no-cache", "-o", "made.png"])
        .current_dir(window.path(""))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let texels = |name: &str| {
        let bytes = std::fs::read(window.path(name)).unwrap();
        decode(&bytes, Path::new(name), Encoding::Linear).unwrap().texels
    };
    assert!(texels("shown.png") == texels("made.png"));

    // Brightness is no matter of paths, and a good picture draws nothing more.
    window.tell("exposure 1");
    let brighter = window.good_picture();
    assert_ne!(brighter["picture"], good["picture"]);
    assert!(samples(&brighter) == samples(&good) && brighter["bakes"]["run"] == 0, "{brighter}");
    window.tell("exposure 0");
    window.picture_that_is(&good["picture"]);
    let frames = window.status()["frames"].as_u64();
    std::thread::sleep(Duration::from_millis(1000));
    assert!(window.status()["frames"].as_u64() <= frames.map(|frames| frames + 5), "an idle window draws");
    assert!(window.close().success());
}

#[test]
fn edits_and_hands_begin_the_truth_anew_and_going_back_finds_it() {
    let Some(mut window) = traced_window("Reference(max_error: 0.2)") else { return };
    let good = window.good_picture();
    window.write("work/scene.ron", &scene(0.7, "Reference(max_error: 0.2)"));
    assert_ne!(window.picture_of(1)["picture"], good["picture"]);
    window.good_picture();
    window.write("work/scene.ron", &scene(1.0, "Reference(max_error: 0.2)"));
    let again = window.until("picture", |event| event["event"] == "drawn" && event["current"] == true);
    assert_eq!((&again["picture"], &again["bakes"]["run"]), (&good["picture"], &0.into()), "{again}");

    window.tell("orbit 30 0");
    assert_ne!(window.picture_of(1)["picture"], good["picture"]);
    window.tell("orbit -30 0");
    window.picture_that_is(&good["picture"]);
    // A hand that never rests sees pictures all the same.
    let mut seen = 0;
    while seen < 3 {
        window.tell("orbit 1 0");
        std::thread::sleep(Duration::from_millis(5));
        window.status();
        seen =
            window.seen.iter().rev().take_while(|e| e["picture"] != good["picture"]).filter(|e| is_traced(e)).count();
    }

    // What would take for ever is left for what is wanted now, and does not keep a window open.
    window.tell("technique Reference(max_error: 1e-9, max_spp: 1000000000)");
    window.picture_of(4);
    window.tell("technique Opaque()");
    assert!(window.picture()["traced"].is_null());
    window.tell("technique Reference(max_error: 1e-9, max_spp: 1000000000)");
    let further = window.until("picture", |event| event["event"] == "drawn" && event["traced"]["samples"].is_u64());
    assert!(samples(&further) >= 4, "{further}");
    assert!(window.close().success());
}

/// Whether it is a picture that was traced.
fn is_traced(event: &Value) -> bool {
    event["event"] == "drawn" && event["traced"]["samples"].is_u64()
}
