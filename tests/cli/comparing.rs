//! `compare`: numbers, limits, masks, heat maps, and images that cannot be compared. Needs no adapter.

use crate::{Desk, NO_ADAPTER, Ran};
use diaphane::image::{Display, Encoding, Format, Image, Tone, decode};
use std::path::Path;

const SIZE: (u32, u32) = (32, 24);

/// A gradient with a bright square in it.
fn picture(change: impl Fn(u32, u32, [f32; 3]) -> [f32; 3]) -> Image {
    let pixel = |i: u32| {
        let (x, y) = (i % SIZE.0, i / SIZE.0);
        let square = if (10..20).contains(&x) && (8..16).contains(&y) { 0.5 } else { 0.1 };
        change(x, y, [square + 0.01 * x as f32, square, 0.02 + 0.005 * y as f32])
    };
    Image { width: SIZE.0, height: SIZE.1, pixels: (0..SIZE.0 * SIZE.1).map(pixel).collect() }
}

impl Desk {
    fn put(&self, name: &str, image: &Image) {
        let display =
            Display { tone: if name.starts_with("mask") { Tone::Clamp } else { Tone::Srgb }, exposure_ev: 0.0 };
        self.write(name, image.encode(Format::of(Path::new(name)).unwrap(), display, &[]).unwrap());
    }

    /// With `b.exr`, and `a.exr` that is 10 % brighter.
    fn with_two() -> Desk {
        let desk = Desk::new();
        desk.put("b.exr", &picture(|_, _, pixel| pixel));
        desk.put("a.exr", &picture(|_, _, pixel| pixel.map(|v| 1.1 * v)));
        desk
    }

    fn compare(&self, more: &[&str]) -> Ran {
        self.run_with(&NO_ADAPTER, &[&["compare", "a.exr", "b.exr"], more].concat())
    }
}

#[test]
fn what_is_equal_is_no_way_apart_and_what_is_not_is_told_by_every_measure() {
    let desk = Desk::with_two();
    let same = desk.run_with(&NO_ADAPTER, &["compare", "b.exr", "b.exr"]).ok();
    assert!(same.out.starts_with("b.exr against b.exr: 32 x 24 pixels\n") && same.err.is_empty(), "{same:#?}");
    let numbers = same.out.lines().skip(2).flat_map(|line| line.split_whitespace().skip(1));
    assert!(numbers.filter(|word| word.parse::<f64>().is_ok()).count() > 20);
    let said = desk.compare(&[]).ok();
    said.says(&["relMSE, mean", "relMSE, 99 %", "DSSIM, mean", "DSSIM, 99 %", "FLIP, mean", "FLIP, 99 %", "bias"]);

    let facts = desk.compare(&["--json"]).ok().json();
    let number = |path: &str| facts.pointer(path).and_then(|v| v.as_f64()).unwrap_or_else(|| panic!("{path}: {facts}"));
    assert_eq!(number("/pixels"), 768.0);
    assert!((number("/bias/all") - 0.1).abs() < 1e-5 && (number("/bias/channels/2") - 0.1).abs() < 1e-5);
    assert!(number("/relmse/mean") > 0.005 && number("/relmse/p99") < 0.01);
    for path in ["/relmse/channels/0/mean", "/dssim/mean", "/dssim/channels/1/p99", "/flip/mean", "/flip/p99"] {
        assert!(number(path) > 0.0, "{path}");
    }
    // Half of the squared error is variance, and then half is left.
    let half = number("/relmse/mean") / 2.0;
    desk.put("v.exr", &picture(|_, _, pixel| pixel.map(|v| 0.005 * v * v)));
    let less = desk.compare(&["--variance", "v.exr", "--json"]).ok().json();
    assert!((less["relmse"]["mean"].as_f64().unwrap() / half - 1.0).abs() < 1e-3, "{less}");
    assert!((less["relmse"]["taken_off"]["mean"].as_f64().unwrap() / half - 1.0).abs() < 1e-3, "{less}");
    desk.compare(&["--variance", "v.exr"]).ok().says(&["  taken off, mean"]);
}

#[test]
fn a_png_is_the_light_that_it_shows() {
    let desk = Desk::with_two();
    desk.put("b.png", &picture(|_, _, pixel| pixel));
    let facts = desk.run(&["compare", "b.png", "b.exr", "--json"]).ok().json();
    assert!(facts["bias"]["all"].as_f64().unwrap().abs() < 2e-3, "{facts}");
    assert_eq!(facts["flip"]["mean"], 0.0, "both are the same 8 bits");
}

#[test]
fn beyond_a_limit_it_fails_with_status_4_and_names_the_measure() {
    let desk = Desk::with_two();
    desk.compare(&["--max", "relmse=0.02", "--max", "bias=0.2", "--max", "flip=1"]).ok();
    let ran = desk.compare(&["--max", "relMSE=1e-3", "--max", "dssim=1", "--max", "bias=0.05"]);
    assert_eq!(ran.status, 4, "{ran:#?}");
    let lines: Vec<&str> = ran.err.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(lines.len() == 2 && lines[0].starts_with("error: relmse is 0.00"), "{ran:#?}");
    assert!(lines[0].ends_with("more than 0.001") && lines[1] == "error: bias is 0.1000, more than 0.05", "{ran:#?}");
    ran.says(&["relMSE, mean"]);
    // A program gets the numbers and the problems.
    let ran = desk.compare(&["--max", "flip_p99=0", "--json"]);
    let facts = ran.json();
    assert_eq!(ran.status, 4);
    assert!(facts["flip"]["p99"].as_f64().unwrap() > 0.0, "{facts}");
    assert!(facts["problems"][0]["what"].as_str().unwrap().starts_with("flip_p99 is "), "{facts}");
    // What is infinite is beyond any limit.
    desk.put("b.exr", &picture(|_, _, _| [0.0; 3]));
    assert_eq!(desk.compare(&["--max", "relmse=1e300"]).status, 4);

    desk.compare(&["--max", "flipp=1"]).fails(2, &["no measure `flipp`", "did you mean `flip`?"]);
    desk.compare(&["--max", "error=1"]).fails(2, &["no measure `error`", "relmse, relmse_p99, dssim"]);
    for wrong in ["flip", "flip=", "flip=-1", "flip=NaN"] {
        desk.compare(&["--max", wrong]).fails(2, &["--max"]);
    }
}

#[test]
fn only_what_the_mask_shows_counts() {
    let desk = Desk::with_two();
    let inside = |x: u32, y: u32| (8..24).contains(&x) && (6..18).contains(&y);
    desk.put("mask.png", &picture(|x, y, _| if inside(x, y) { [1.0; 3] } else { [0.0; 3] }));
    desk.put("a.exr", &picture(|x, y, pixel| if inside(x, y) { pixel } else { [5.0, 0.0, 0.0] }));
    desk.compare(&["--mask", "mask.png", "--max", "relmse=0", "--max", "dssim=0", "--max", "flip=0"]).ok();
    desk.compare(&["--mask", "mask.png"]).ok().says(&["32 x 24 pixels, of which 192 count"]);
    assert_eq!(desk.compare(&["--max", "relmse=0.1"]).status, 4);
    desk.put("mask.png", &picture(|_, _, _| [0.4; 3]));
    desk.compare(&["--mask", "mask.png"]).fails(1, &["mask.png: error: the mask leaves no pixel to compare"]);
}

#[test]
fn a_heat_map_has_the_pixels_and_a_scale() {
    let desk = Desk::with_two();
    desk.put("a.exr", &picture(|x, _, pixel| if x < 16 { pixel } else { pixel.map(|v| 1.2 * v) }));
    desk.compare(&["--heatmap", "heat.png", "--max", "relmse=1"]).ok().says(&["heat.png  relative error per pixel\n"]);
    let map = decode(&desk.read("heat.png"), Path::new("heat.png"), Encoding::Linear).unwrap().image();
    assert!(map.width > SIZE.0 + 20 && map.height >= SIZE.1);
    assert!(map.at(4, 4) == [0.0; 3] && map.at(20, 12)[0] > 0.5, "{:?}", map.at(20, 12));
    desk.compare(&["--heatmap", "heat.EXR", "--json"]).ok();
    assert!(desk.path("heat.EXR").is_file());
    // It is written beyond a limit too: that is when it is needed.
    assert_eq!(desk.compare(&["--heatmap", "beyond.png", "--max", "flip=0"]).status, 4);
    assert!(desk.path("beyond.png").is_file());
    desk.compare(&["--heatmap", "heat.jpg"]).fails(2, &["heat.jpg", "ends in .png or .exr"]);
}

#[test]
fn images_that_cannot_be_compared_are_told() {
    let desk = Desk::with_two();
    let compare = |a: &str, b: &str| desk.run(&["compare", a, b]);
    desk.put("small.exr", &Image::filled(32, 23, [0.5; 3]));
    compare("small.exr", "b.exr")
        .fails(1, &["small.exr: error: the image has 32 x 23 pixels, but the reference has 32 x 24", "hint: "]);
    desk.compare(&["--mask", "small.exr"]).fails(1, &["small.exr: error: the mask has 32 x 23 pixels"]);
    desk.compare(&["--variance", "small.exr"]).fails(1, &["small.exr: error: the variance has 32 x 23 pixels"]);
    // What is no number is never averaged away, on either side.
    desk.put("nan.exr", &picture(|x, y, pixel| if (x, y) == (7, 3) { [0.0, f32::NAN, 0.0] } else { pixel }));
    for (a, b) in [("nan.exr", "b.exr"), ("b.exr", "nan.exr")] {
        compare(a, b).fails(1, &["nan.exr: error: 1 of 768 pixels are NaN or infinite, the first at x = 7, y = 3"]);
    }
    compare("c.exr", "b.exr").fails(1, &["c.exr", "there is no such file"]);
    compare("scene.ron", "b.exr").fails(1, &["scene.ron: error: "]);
    desk.run(&["compare", "a.exr"]).fails(2, &["<B>"]);
    // Light below nothing is suspicious, and no more.
    desk.put("dark.exr", &picture(|_, _, pixel| pixel.map(|v| v - 0.2)));
    let ran = compare("dark.exr", "b.exr").ok();
    assert!(ran.err.contains("dark.exr: warning: ") && ran.err.contains("negative"), "{ran:#?}");
}
