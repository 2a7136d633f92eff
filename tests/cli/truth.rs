//! `reference`, and the technique of that name: the truth, without an adapter.

use crate::{Desk, NO_ADAPTER};
use diaphane::image::{Encoding, decode};
use std::path::Path;

fn pixels(desk: &Desk, name: &str) -> Vec<[f32; 4]> {
    decode(&desk.read(name), Path::new(name), Encoding::Linear).unwrap().texels
}

#[test]
fn the_truth_needs_no_adapter_and_goes_on_where_it_was() {
    let desk = Desk::new();
    let trace = |out: &str, more: &[&str]| {
        let words = [&["reference", "scene.ron", "-o", out, "--json"], more].concat();
        desk.run_with(&NO_ADAPTER, &words).ok().json()
    };
    // Straight away, and on from a run that was over sooner.
    trace("sooner.exr", &["--spp", "2"]);
    let on = trace("on.exr", &["--spp", "8", "--variance", "on.variance.exr"]);
    assert_eq!((on["samples"].as_u64(), on["from_disk"].as_u64()), (Some(8), Some(3)), "shape, one sample, two");
    let whole = trace("whole.exr", &["--spp", "8", "--cache-dir", "other"]);
    assert_eq!(whole["from_disk"], 0);
    assert_eq!(desk.read("on.exr"), desk.read("whole.exr"));
    let lit = |name: &str| pixels(&desk, name).iter().filter(|texel| texel[0] > 0.0).count();
    assert!(lit("on.exr") > 40 && lit("on.variance.exr") > 40, "a lit ball, and noise");
    // Another seed is another picture; threads are no matter.
    trace("seed.exr", &["--spp", "8", "--seed", "2"]);
    assert_ne!(pixels(&desk, "seed.exr"), pixels(&desk, "whole.exr"));
    let env = [&NO_ADAPTER[..], &[("RAYON_NUM_THREADS", "1")]].concat();
    desk.run_with(&env, &["reference", "scene.ron", "-o", "one.exr", "--spp", "8", "--no-cache"]).ok();
    assert_eq!(desk.read("one.exr"), desk.read("whole.exr"));
}

#[test]
fn tiles_merge_into_the_bits_of_one_run() {
    let desk = Desk::new();
    let trace = |out: &str, more: &[&str]| {
        desk.run_with(&NO_ADAPTER, &[&["reference", "scene.ron", "--spp", "4", "-o", out], more].concat())
    };
    trace("whole.exr", &[]).ok();
    for i in ["1/3", "2/3", "3/3"] {
        trace(&format!("tile{}.exr", &i[..1]), &["--tile", i]).ok();
    }
    let merge = |tiles: &[&str]| desk.run(&[&["reference", "merge", "-o", "merged.exr"], tiles].concat());
    merge(&["tile1.exr", "tile2.exr"]).fails(2, &["tile 3/3 is missing"]);
    merge(&["tile1.exr", "tile2.exr", "tile2.exr"]).fails(1, &["there twice"]);
    merge(&["tile1.exr", "whole.exr"]).fails(1, &["whole.exr", "no tile"]);
    trace("far.exr", &["--tile", "1/4294967295"]).ok();
    merge(&["far.exr"]).fails(2, &["tile 2/4294967295 is missing"]);
    trace("seed.exr", &["--tile", "3/3", "--seed", "5"]).ok();
    merge(&["tile1.exr", "tile2.exr", "seed.exr"]).fails(1, &["another picture"]);
    assert!(!desk.path("merged.exr").exists());
    merge(&["tile3.exr", "tile1.exr", "tile2.exr"]).ok();
    assert_eq!(desk.read("merged.exr"), desk.read("whole.exr"));
    trace("a.png", &["--tile", "1/2"]).fails(2, &["--tile"]);
    trace("a.exr", &["--tile", "3/2"]).fails(2, &["3/2"]);
}

#[test]
fn a_view_can_be_the_truth_and_an_object_cannot() {
    let desk = Desk::new();
    let truth = "Reference(light: Direct, max_spp: 4)";
    desk.run_with(&NO_ADAPTER, &["render", "scene.ron", "-o", "a.exr", "--technique", truth]).ok();
    desk.run_with(&NO_ADAPTER, &["reference", "scene.ron", "-o", "b.exr", "--light", "direct", "--spp", "4"]).ok();
    assert_eq!(pixels(&desk, "a.exr"), pixels(&desk, "b.exr"));
    desk.run(&["explain", "scene.ron", "--technique", truth]).ok().says(&["path by path", "paths 3 to 4"]);
    desk.run(&["render", "scene.ron", "-o", "a.exr", "--technique", "Reference(max_error: 0)"])
        .fails(2, &["max_error", "above 0"]);
    let object = "objects.ball.technique=Reference()";
    desk.run(&["check", "scene.ron", "--set", object]).fails(2, &["objects[0].technique", "name it in the view"]);
}

#[test]
fn layers_are_seen_by_those_that_follow_light_through_them() {
    let desk = Desk::new();
    let layer = r#"Material(version: 1, medium: Coefficients(sigma_a: 1, sigma_s: 9, g: 0), layers: [
        (name: "skin", medium: Coefficients(sigma_a: (0, 5, 9), sigma_s: (9, 5, 1), g: 0), depth: 0.5)])"#;
    desk.write("layers.ron", layer);
    desk.write("even.ron", layer.replace("0.5)", "0)"));
    let trace = |integrator: &str, material: &str| {
        let set = format!("objects.ball.material=\"{material}\"");
        let words = ["reference", "scene.ron", "--spp", "2", "-o", "a.exr", "--integrator", integrator, "--set", &set];
        desk.run_with(&NO_ADAPTER, &words).ok();
        pixels(&desk, "a.exr")
    };
    for integrator in ["volume", "layered", "bssrdf"] {
        let differs = trace(integrator, "layers.ron") != trace(integrator, "even.ron");
        assert_eq!(differs, integrator != "bssrdf", "{integrator}");
    }
    assert_ne!(trace("layered", "layers.ron"), trace("volume", "layers.ron"));
    let layered = "Reference(integrator: Layered, max_spp: 2)";
    let words =
        ["render", "scene.ron", "-o", "b.exr", "--technique", layered, "--set", "objects.ball.material=\"layers.ron\""];
    desk.run_with(&NO_ADAPTER, &words).ok();
    assert_eq!(pixels(&desk, "b.exr"), trace("layered", "layers.ron"));
}

#[test]
fn the_truth_says_how_far_it_is() {
    let desk = Desk::new();
    let words = ["reference", "scene.ron", "-o", "a.exr", "--light", "direct"];
    let run = |more: &[&str]| desk.run(&[&words[..], more].concat());
    let far = run(&["--max-error", "0.0001", "--set", "reference.max_spp=4", "--json"]).ok();
    assert!(far.err.contains("max_spp") && far.json()["samples"] == 4, "{far:#?}");
    let near = run(&["--max-error", "0.5", "--json"]).ok().json();
    assert!(near["relative_standard_error"].as_f64().unwrap() <= 0.5);
    run(&["--seconds", "0.2"]).ok();
    run(&["--seconds", "0"]).fails(2, &["--seconds"]);
    run(&["--integrator", "walks"]).fails(2, &["--integrator"]);
    run(&["--spp", "0"]).fails(2, &["--spp"]);
    run(&["--variance", "v.png"]).fails(2, &["--variance", ".exr"]);
}
