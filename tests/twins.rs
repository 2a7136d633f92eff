//! What is spelled twice, in Rust and in WGSL, is the same function: each twin is evaluated on a grid on the device and
//! compared with f64.

mod studio;

use diaphane::gpu::{Bind, Buffer, Compute, Gpu, Shaders};
use diaphane::image::{Display, Format, Tone};
use diaphane::optics::{fresnel, microfacet, phase, sh, strata};
use diaphane::render::{self, Look};
use diaphane::store::{Key, Plan, Store};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use studio::{Nobody, studio};

type Function = Box<dyn Fn(&[f64]) -> Vec<f64>>;

struct Twin {
    /// `src/optics/STEM.rs` and `shaders/optics/STEM.wgsl`.
    stem: &'static str,
    name: &'static str,
    /// Every argument's values; the grid is all combinations.
    axes: Vec<Vec<f64>>,
    rust: Function,
    /// How many numbers come out.
    results: usize,
    /// Relative to the value, or to `floor` where the value is smaller. f32 has 6e-8.
    tolerance: f64,
    floor: f64,
    /// An edit of the shader that a person could make by mistake, and the test must see.
    mistake: (&'static str, &'static str),
}

fn cosines() -> Vec<f64> {
    [0.0, 1e-4, 1e-3, 0.01].into_iter().chain((1..=32).map(|i| i as f64 / 32.0)).collect()
}

fn roughnesses() -> Vec<f64> {
    vec![0.03, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0]
}

fn parameters() -> Vec<f64> {
    vec![-0.99, -0.6, -0.1, 0.0, 0.25, 0.4, 0.8, 0.99]
}

/// Of absorption and scattering, per length.
fn coefficients() -> Vec<f64> {
    vec![0.0, 1e-6, 0.02, 0.5, 3.0, 40.0]
}

fn directions() -> Vec<f64> {
    (-8..=8).map(|i| i as f64 / 8.0).collect()
}

fn twins() -> Vec<Twin> {
    vec![
        Twin {
            stem: "fresnel",
            name: "fresnel_dielectric",
            axes: vec![cosines(), vec![0.25, 0.5, 0.75, 0.9999, 1.0, 1.0001, 1.1, 1.3, 1.33, 1.5, 2.4, 4.0]],
            rust: Box::new(|a| vec![fresnel::fresnel_dielectric(a[0], a[1])]),
            results: 1,
            // Where the two sides are nearly alike r_s is a small difference of large numbers.
            tolerance: 1e-5,
            floor: 0.01,
            mistake: ("eta * cos - cos_t", "cos - eta * cos_t"),
        },
        Twin {
            stem: "microfacet",
            name: "ggx_d",
            axes: vec![cosines(), roughnesses()],
            rust: Box::new(|a| vec![microfacet::ggx_d(a[0], a[1])]),
            results: 1,
            tolerance: 1e-5,
            floor: 1e-6,
            mistake: ("let alpha = roughness * roughness;", "let alpha = roughness;"),
        },
        Twin {
            stem: "microfacet",
            name: "smith_g2",
            axes: vec![cosines(), cosines(), roughnesses()],
            rust: Box::new(|a| vec![microfacet::smith_g2(a[0], a[1], a[2])]),
            results: 1,
            tolerance: 1e-5,
            floor: 1e-3,
            mistake: ("2.0 * cos_i * cos_o", "1.99 * cos_i * cos_o"),
        },
        Twin {
            stem: "microfacet",
            name: "ggx_lobe",
            axes: vec![cosines(), cosines(), cosines(), roughnesses()],
            rust: Box::new(|a| vec![microfacet::ggx_lobe(a[0], a[1], a[2], a[3])]),
            results: 1,
            tolerance: 2e-5,
            floor: 1e-6,
            mistake: ("* 0.5 * cos_i / both", "* 0.5 * cos_o / both"),
        },
        Twin {
            stem: "sh",
            name: "sh_basis_3",
            axes: vec![directions(), directions(), directions()],
            rust: Box::new(|a| sh::sh_basis_3(a[0], a[1], a[2]).to_vec()),
            results: 9,
            tolerance: 1e-6,
            floor: 1.0,
            mistake: ("0.4886025119029199 * x", "-0.4886025119029199 * x"),
        },
        Twin {
            stem: "sh",
            name: "sh_basis_8",
            axes: vec![directions(), directions(), directions()],
            rust: Box::new(|a| sh::sh_basis_8(a[0], a[1], a[2]).to_vec()),
            results: 64,
            // Off the sphere, as here, high bands are large numbers.
            tolerance: 1e-5,
            floor: 1.0,
            mistake: ("z * value - before / step_before", "z * value - before / step"),
        },
        Twin {
            stem: "phase",
            name: "henyey_greenstein",
            axes: vec![directions(), parameters()],
            rust: Box::new(|a| vec![phase::henyey_greenstein(a[0], a[1])]),
            results: 1,
            // The peak of 0.99 is as sharp as what f32 knows of 1 - g.
            tolerance: 2e-5,
            floor: 1e-3,
            mistake: ("sign(g) * cos", "-sign(g) * cos"),
        },
        Twin {
            stem: "phase",
            name: "schlick",
            axes: vec![directions(), parameters()],
            rust: Box::new(|a| vec![phase::schlick(a[0], a[1])]),
            results: 1,
            tolerance: 2e-5,
            floor: 1e-3,
            mistake: ("(q * q)", "(q * sqrt(q))"),
        },
        Twin {
            stem: "strata",
            name: "admittance",
            axes: vec![coefficients(), coefficients()],
            rust: Box::new(|a| vec![strata::admittance(a[0], a[1])]),
            results: 1,
            tolerance: 1e-6,
            floor: 1e-3,
            mistake: ("sqrt(sigma_a / (sigma_a + sigma_s_prime))", "sqrt(sigma_a / (sigma_a + 2.0 * sigma_s_prime))"),
        },
        Twin {
            stem: "strata",
            name: "mean_exp",
            axes: vec![coefficients(), coefficients()],
            rust: Box::new(|a| vec![strata::mean_exp(a[0], a[1])]),
            results: 1,
            tolerance: 2e-5,
            floor: 1e-3,
            mistake: ("exp(-min(a, b))", "exp(-max(a, b))"),
        },
        Twin {
            stem: "strata",
            name: "below_all",
            axes: vec![coefficients(), coefficients(), vec![1e-4, 0.3, 0.7, 1.0]],
            rust: Box::new(|a| strata::below_all(a[0], a[1], a[2]).to_vec()),
            results: 2,
            tolerance: 1e-5,
            floor: 1e-3,
            mistake: ("1.7320508 * q * cos", "1.7320508 * q"),
        },
        Twin {
            stem: "strata",
            name: "on_top",
            axes: vec![
                coefficients(),
                coefficients(),
                vec![0.0, 1e-3, 0.3, 5.0],
                vec![1e-4, 0.6, 1.0],
                vec![1e-3, 0.3, 1.0],
                vec![0.0, 0.4, 0.99],
            ],
            rust: Box::new(|a| strata::on_top(a[0], a[1], a[2], a[3], a[4], a[5]).to_vec()),
            results: 2,
            // Without absorption the two waves in a layer all but cancel.
            tolerance: 5e-4,
            floor: 0.01,
            mistake: ("own - q", "q - own"),
        },
        Twin {
            stem: "strata",
            name: "often",
            axes: vec![vec![0.0, 0.1, 1.0], vec![0.0, 1e-3, 0.3], vec![0.0, 0.1, 0.6], vec![1e-6, 0.1, 1.0]],
            rust: Box::new(|a| vec![strata::often(a[0], a[1], a[2], a[3])]),
            results: 1,
            tolerance: 1e-5,
            floor: 1e-3,
            mistake: ("1.0 - once_white", "1.0 + once_white"),
        },
    ]
}

/// Every point of the grid, as f32 sees it.
fn grid(axes: &[Vec<f64>]) -> Vec<Vec<f32>> {
    axes.iter().fold(vec![Vec::new()], |points, axis| {
        let longer = |point: &Vec<f32>, v: f64| point.iter().copied().chain([v as f32]).collect();
        points.iter().flat_map(|point| axis.iter().map(|v| longer(point, *v)).collect::<Vec<_>>()).collect()
    })
}

/// A compute shader that calls the twin once per invocation.
fn harness(twin: &Twin) -> String {
    let n = twin.axes.len();
    let arguments: Vec<String> = (0..n).map(|i| format!("arguments[{n}u * i + {i}u]")).collect();
    let call = format!("{}({})", twin.name, arguments.join(", "));
    let store = match twin.results {
        1 => format!("results[i] = {call};"),
        r => format!("let all = {call};\n{}", store_all(r)),
    };
    format!(
        "#include \"lib/element.wgsl\"\n#include \"optics/{}.wgsl\"\n\
         @group(0) @binding(0) var<storage, read> arguments: array<f32>;\n\
         @group(0) @binding(1) var<storage, read_write> results: array<f32>;\n\
         @compute @workgroup_size(64)\n\
         fn compute(@builtin(global_invocation_id) id: vec3u) {{\n\
         let i = element(id);\n\
         if i >= arrayLength(&results) / {}u {{ return; }}\n{store}\n}}\n",
        twin.stem, twin.results,
    )
}

fn store_all(results: usize) -> String {
    (0..results).map(|k| format!("results[{results}u * i + {k}u] = all[{k}];\n")).collect()
}

/// The twin's values on the device, its shader edited.
fn on_device(gpu: &Gpu, twin: &Twin, edit: (&str, &str)) -> Vec<f32> {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("it is in the folder")).expect("a folder can be made");
        std::fs::write(path, text).expect("a file can be written");
    };
    let read = |name: &str| std::fs::read_to_string(Path::new("shaders").join(name)).expect("the shader is there");
    let optics = format!("optics/{}.wgsl", twin.stem);
    let original = read(&optics);
    let edited = original.replace(edit.0, edit.1);
    assert!(edit.0 == edit.1 || edited != original, "{}: nothing reads `{}`", twin.name, edit.0);
    write(&optics, &edited);
    write("lib/element.wgsl", &read("lib/element.wgsl"));
    write("twin.wgsl", &harness(twin));

    let arguments: Vec<f32> = grid(&twin.axes).concat();
    let shaders = Shaders::new(Some(folder.path().into()), Arc::default());
    let mut plan = Plan::default();
    let given = Arc::new(Buffer::new(gpu, bytemuck::cast_slice(&arguments)));
    let arguments = plan.given("twin.arguments", twin.name, Key::of(twin.name), given);
    let results = plan.add(Compute {
        name: "twin",
        about: twin.name.into(),
        shader: shaders.load("twin.wgsl", &[]).unwrap_or_else(|problem| panic!("{problem}")),
        output: ("results", 4 * twin.results as u32),
        over: arguments,
        over_stride: 4 * twin.axes.len() as u32,
        binds: vec![("arguments", Bind::Buffer(arguments))],
    });
    let mut store = Store::in_memory();
    let buffer = store.get_with(&plan, results, Some(gpu), &Nobody).unwrap_or_else(|problem| panic!("{problem}"));
    let bytes = gpu.read_buffer(&buffer.buffer, buffer.bytes).unwrap_or_else(|problem| panic!("{problem}"));
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("4 bytes"))).collect()
}

/// The largest error in units of the tolerance, and where it is.
fn worst(twin: &Twin, values: &[f32]) -> (f64, String) {
    let points = grid(&twin.axes);
    assert_eq!(values.len(), points.len() * twin.results);
    let mut worst = (0.0, String::new());
    for (point, found) in points.iter().zip(values.chunks_exact(twin.results)) {
        let exact = (twin.rust)(&point.iter().map(|v| *v as f64).collect::<Vec<_>>());
        for (exact, found) in exact.iter().zip(found) {
            let error = (*found as f64 - exact).abs() / (twin.tolerance * exact.abs().max(twin.floor));
            // A NaN on either side is as wrong as can be.
            if error.is_nan() || error > worst.0 {
                let error = if error.is_nan() { f64::INFINITY } else { error };
                worst = (error, format!("{}{point:?} is {found} on the device and {exact} in Rust", twin.name));
            }
        }
    }
    worst
}

#[test]
fn twins_agree_and_a_wrong_one_is_noticed() {
    let mut studio = studio();
    let gpu = studio.session.gpu().unwrap_or_else(|problem| panic!("{problem}"));
    for twin in twins() {
        let (error, place) = worst(&twin, &on_device(gpu, &twin, ("", "")));
        println!("{}: {error:.3} of its tolerance", twin.name);
        assert!(error <= 1.0, "{place}: {error:.1} times the tolerance");
        let (error, _) = worst(&twin, &on_device(gpu, &twin, twin.mistake));
        assert!(error > 10.0, "{}: a planted mistake is not noticed", twin.name);
    }
}

/// Names and arguments of the functions in a shader: `fn name(a: f32, b: f32)`.
fn shader_functions(text: &str) -> Vec<(String, Vec<String>)> {
    text.lines().filter_map(|line| signature(line.strip_prefix("fn ")?)).collect()
}

fn signature(text: &str) -> Option<(String, Vec<String>)> {
    let (name, rest) = text.split_once('(')?;
    let arguments = rest.split_once(')')?.0.split(',').filter_map(|a| a.split_once(':')).map(|(a, _)| a.trim().into());
    Some((name.to_string(), arguments.collect()))
}

#[test]
fn every_twin_has_its_partner() {
    let tested: BTreeSet<(String, String)> = twins().iter().map(|t| (t.stem.into(), t.name.into())).collect();
    let mut found = BTreeSet::new();
    for path in std::fs::read_dir("shaders/optics").expect("it is there").map(|entry| entry.expect("listed").path()) {
        let stem = path.file_stem().and_then(|stem| stem.to_str()).expect("a plain name").to_string();
        let rust = std::fs::read_to_string(format!("src/optics/{stem}.rs"))
            .unwrap_or_else(|_| panic!("{} has no twin src/optics/{stem}.rs", path.display()));
        let functions: Vec<_> = rust.lines().filter_map(|line| signature(line.strip_prefix("pub fn ")?)).collect();
        for function in shader_functions(&std::fs::read_to_string(&path).expect("it is text")) {
            assert!(
                functions.contains(&function),
                "{}: no such pub fn in src/optics/{stem}.rs: {function:?}",
                path.display()
            );
            found.insert((stem.clone(), function.0));
        }
        // Who says that it has a twin must have one.
        let twin = format!("`{stem}.wgsl`");
        let mut says = false;
        for line in rust.lines() {
            says |= line.starts_with("///") && line.contains("Twin") && line.contains(&twin);
            if let Some((name, _)) = line.strip_prefix("pub fn ").and_then(signature) {
                let there = found.contains(&(stem.clone(), name.clone()));
                assert_eq!(says, there, "src/optics/{stem}.rs: what {name} says of its twin");
                says = false;
            }
        }
    }
    assert_eq!(found, tested, "twins that are there (left) and tested (right)");
    assert_eq!(shader_functions("fn a(x: f32) -> f32 {\n}\nfn b(y: f32, z: vec3f) {\n").len(), 2);
}

/// The levels that a window shows, by pixel, and those of a PNG.
fn levels(curve: Tone, exposure_ev: f32) -> (Vec<[u8; 3]>, Vec<[u8; 3]>) {
    let mut studio = studio();
    studio.write("paint.ron", "Material(version: 1, medium: Opaque(albedo: 0.9))");
    // From black far into white, coloured light on one side.
    let scene = studio.scene(
        r#"mm_per_unit: 10, camera: (eye: (0, 0, 5)),
        lights: [
            Directional(direction: (-1, -0.4, -0.2), irradiance: (60, 20, 1)),
            Directional(direction: (1, 0.2, -0.6), irradiance: (0.02, 0.3, 0.9), shadow: false),
            Environment(radiance: (0.001, 0.004, 0.002)),
        ],
        objects: [(name: "ball", mesh: Sphere(radius: 1, subdivisions: 4), material: "paint.ron")],
        view: (technique: Opaque(), size: (64, 48), antialias: 2)"#,
    );
    let look = Look::of(&scene);
    let display = Display { tone: curve, exposure_ev };
    let (_, image) = studio.shoot(&scene, &look);
    let png = image.encode(Format::Png, display, &[]).unwrap_or_else(|problem| panic!("{problem}"));
    let png = image::load_from_memory(&png).expect("it is a PNG").to_rgb8().pixels().map(|pixel| pixel.0).collect();
    let shown =
        render::plan_shown(&scene, &look, display, &studio.session.shaders, |_, _| 0).expect("it can be planned");
    let shown = studio.session.get(&shown.plan, shown.picture, &Nobody).unwrap_or_else(|problem| panic!("{problem}"));
    let gpu = studio.session.gpu().unwrap_or_else(|problem| panic!("{problem}"));
    let bytes = gpu.read_texture(&shown.0[0]).unwrap_or_else(|problem| panic!("{problem}"));
    (bytes.chunks_exact(4).map(|texel| [texel[0], texel[1], texel[2]]).collect(), png)
}

fn furthest(a: &[[u8; 3]], b: &[[u8; 3]]) -> u8 {
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

#[test]
fn a_window_shows_the_levels_that_a_png_stores() {
    for curve in [Tone::Clamp, Tone::Srgb, Tone::Filmic] {
        for exposure_ev in [-3.0, 0.0, 2.5] {
            let (window, png) = levels(curve, exposure_ev);
            let apart = furthest(&window, &png);
            assert!(apart <= 1, "{curve:?} at {exposure_ev}: {apart} levels apart");
        }
    }
    // The pictures have all that could differ, and a curve taken for another is seen.
    let (filmic, _) = levels(Tone::Filmic, 0.0);
    let (dark, bright) = (filmic.iter().flatten().min(), filmic.iter().flatten().max());
    assert!(dark < Some(&20) && bright > Some(&235), "{dark:?} to {bright:?}");
    assert!(furthest(&filmic, &levels(Tone::Srgb, 0.0).1) > 5);
    assert!(furthest(&filmic, &levels(Tone::Filmic, 0.1).1) > 2);
}
