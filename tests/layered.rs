//! Layers obey the laws of light that scatters once: closed forms where there are some, and what may not matter.

mod studio;

use diaphane::image::Image;
use diaphane::optics::fresnel::{diffuse_transmittance, fresnel_dielectric, refracted_cosine};
use diaphane::optics::half_space::HalfSpace;
use diaphane::optics::phase::Phase;
use diaphane::optics::strata;
use diaphane::render::{self, Look};
use diaphane::store::{Key, Plan};
use glam::{DVec3, dvec3};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use studio::{mean, most_apart, read, studio};

/// One medium, 1/mm, with its phase function's own parameter.
#[derive(Clone, Copy)]
struct Medium {
    sigma_a: DVec3,
    sigma_s: DVec3,
    phase: Phase,
    parameter: f64,
}

const SKIN: Medium = Medium {
    sigma_a: dvec3(0.3, 0.6, 1.0),
    sigma_s: dvec3(2.0, 1.5, 1.0),
    phase: Phase::HenyeyGreenstein,
    parameter: 0.25,
};
const FLESH: Medium =
    Medium { sigma_a: dvec3(0.8, 0.2, 0.1), sigma_s: dvec3(1.0, 3.0, 6.0), phase: Phase::Schlick, parameter: 0.6 };
const BLACK: Medium =
    Medium { sigma_a: dvec3(9.0, 9.0, 9.0), sigma_s: DVec3::ZERO, phase: Phase::HenyeyGreenstein, parameter: 0.0 };

impl Medium {
    fn sigma_t(&self) -> DVec3 {
        self.sigma_a + self.sigma_s
    }

    fn text(&self) -> String {
        let v = |v: DVec3| format!("({:?}, {:?}, {:?})", v.x, v.y, v.z);
        // A file gives what its phase function is named after: Schlick's k for Schlick.
        format!(
            "medium: Coefficients(sigma_a: {}, sigma_s: {}, g: {:?}), phase: {:?}",
            v(self.sigma_a),
            v(self.sigma_s),
            self.parameter,
            self.phase
        )
    }
}

fn material(ior: f64, layers: &[(Medium, String)], below: Medium) -> String {
    let layers: String =
        layers.iter().map(|(medium, depth)| format!("({}, depth: {depth}), ", medium.text())).collect();
    format!("Material(version: 1, surface: (ior: {ior:?}, roughness: 0.3), {}, layers: [{layers}])", below.text())
}

fn constant(layers: &[(Medium, f64)]) -> Vec<(Medium, String)> {
    layers.iter().map(|(medium, depth)| (*medium, format!("{depth:?}"))).collect()
}

const SIZE: (u32, u32) = (24, 16);
const FOV: f64 = 50.0;

/// A wide slab below y = 0, of 40 mm.
fn slab(eye: DVec3, lights: &str, technique: &str) -> String {
    format!(
        r#"mm_per_unit: 10, camera: (eye: ({:?}, {:?}, {:?}), target: (0, 0, 0), fov_y_deg: {FOV:?}), lights: [{lights}],
        objects: [(mesh: Slab(size: (90, 90, 4), segments: (6, 6)), material: "thing.ron",
            transform: (translate: (0, -2, 0), rotate_deg: (-90, 0, 0)))],
        view: (technique: {technique}, size: {SIZE:?}, antialias: 1)"#,
        eye.x, eye.y, eye.z
    )
}

fn ray(eye: DVec3, x: u32, y: u32) -> DVec3 {
    let forward = -eye.normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let half = (0.5 * FOV.to_radians()).tan() * 2.0 / f64::from(SIZE.1);
    let (i, j) = (f64::from(x) + 0.5 - 0.5 * f64::from(SIZE.0), 0.5 * f64::from(SIZE.1) - f64::from(y) - 0.5);
    (forward + half * (i * right + j * up)).normalize()
}

/// Radiance that scatters once in a stack of layers over a half space and goes to the eye against `view`, for irradiance 1
/// on a plane that faces `to_light`; up is y. `bend` is the index by which rays are bent.
fn once(ior: f64, bend: f64, view: DVec3, to_light: DVec3, layers: &[(Medium, f64)], below: Medium) -> DVec3 {
    let below_surface = |outside: DVec3| {
        let along = dvec3(outside.x, 0.0, outside.z) / bend;
        along + DVec3::Y * (1.0 - along.length_squared()).sqrt()
    };
    let (to_eye, to_light_in) = (below_surface(-view), below_surface(to_light));
    let (out, into) = (to_eye.y, to_light_in.y);
    let width = if bend == 1.0 { 1.0 } else { to_light.y / into };
    let through =
        (1.0 - fresnel_dielectric(-view.y, ior)) * (1.0 - fresnel_dielectric(to_light.y, ior)) * width / (bend * bend);
    let (mut sum, mut passed, mut top) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for (medium, bottom) in layers.iter().copied().chain([(below, f64::INFINITY)]) {
        let rate = medium.sigma_t() * (1.0 / out + 1.0 / into);
        let phase = medium.phase.value(to_eye.dot(to_light_in), medium.parameter);
        let lost = 1.0 - (-rate * (bottom - top)).exp();
        sum += (-passed).exp() * medium.sigma_s * phase * lost / (rate * out);
        passed += rate * (bottom - top);
        top = bottom;
    }
    through * sum
}

/// The largest relative error of a picture against a formula of the view's direction.
fn error(image: &Image, eye: DVec3, expected: impl Fn(DVec3) -> DVec3) -> f64 {
    let mut worst = 0.0f64;
    for y in 0..image.height {
        for x in 0..image.width {
            let found = DVec3::from(image.at(x, y).map(f64::from));
            let expected = expected(ray(eye, x, y));
            worst = worst.max(((found - expected) / expected).abs().max_element());
            assert!(found.is_finite());
        }
    }
    worst
}

const ABOVE: DVec3 = dvec3(0.5, 4.0, 3.0);
const SUN: &str = "Directional(direction: (-1, -2, -0.5), irradiance: 1, shadow: false)";

fn to_sun() -> DVec3 {
    dvec3(1.0, 2.0, 0.5).normalize()
}

#[test]
fn a_stack_of_layers_has_its_closed_form_in_few_steps() {
    let mut studio = studio();
    let five = [(SKIN, 0.2), (FLESH, 0.3), (SKIN, 0.45), (BLACK, 0.5), (FLESH, 2.0)];
    for layers in [&[][..], &[(SKIN, 0.4)], &[(FLESH, 0.3), (SKIN, 0.9)], &five] {
        for (ior, refract) in [(1.33, true), (1.33, false), (1.0, true)] {
            studio.write("thing.ron", material(ior, &constant(layers), FLESH));
            let bend = if refract { ior } else { 1.0 };
            for samples in [1, 5] {
                let image =
                    studio.scattered(&slab(ABOVE, SUN, &format!("Layered(samples: {samples}, refract: {refract})")));
                let error = error(&image, ABOVE, |view| once(ior, bend, view, to_sun(), layers, FLESH));
                assert!(
                    error < 3e-3,
                    "{} layers, ior {ior}, refract {refract}, {samples} steps: {error:.2e}",
                    layers.len()
                );
            }
        }
    }
    // Teeth: another depth, another phase function, another index.
    let layers = [(SKIN, 0.4)];
    studio.write("thing.ron", material(1.33, &constant(&layers), FLESH));
    let image = studio.scattered(&slab(ABOVE, SUN, "Layered()"));
    let other = Medium { phase: Phase::Schlick, ..SKIN };
    assert!(error(&image, ABOVE, |view| once(1.33, 1.33, view, to_sun(), &[(SKIN, 0.42)], FLESH)) > 5e-3);
    assert!(error(&image, ABOVE, |view| once(1.33, 1.33, view, to_sun(), &[(other, 0.4)], FLESH)) > 5e-3);
    assert!(error(&image, ABOVE, |view| once(1.38, 1.38, view, to_sun(), &layers, FLESH)) > 5e-3);
}

#[test]
fn the_papers_steps_get_there_slowly_and_steps_in_closed_form_at_once() {
    let mut studio = studio();
    let layers = [(SKIN, 0.3), (FLESH, 0.8)];
    studio.write("thing.ron", material(1.33, &constant(&layers), SKIN));
    let mut of = |technique: &str| {
        let image = studio.scattered(&slab(ABOVE, SUN, technique));
        error(&image, ABOVE, |view| once(1.33, 1.33, view, to_sun(), &layers, SKIN))
    };
    let uniform = [10, 50, 100, 800].map(|n| of(&format!("Layered(march: Uniform, samples: {n})")));
    assert!(uniform.is_sorted_by(|a, b| a > b), "{uniform:?}");
    assert!(uniform[0] > 0.1 && uniform[3] < 0.02, "{uniform:?}");
    assert!(of("Layered(samples: 2)") < 0.2 * uniform[2]);
}

#[test]
fn layers_that_are_none_change_nothing() {
    let mut studio = studio();
    for technique in ["Layered()", "Layered(multiple: true)"] {
        let ball = format!(
            r#"mm_per_unit: 10, camera: (eye: (0, 1, 4), target: (0, 0, 0), fov_y_deg: 36),
            lights: [Directional(direction: (-1, -2, -1), irradiance: 3), Environment(radiance: 0.5)],
            objects: [(mesh: Sphere(radius: 1, subdivisions: 4), material: "thing.ron")],
            view: (technique: {technique}, size: (32, 32), antialias: 1)"#
        );
        what_changes_nothing(|layers, below| {
            studio.write("thing.ron", material(1.4, &constant(layers), below));
            studio.scattered(&ball)
        });
    }
}

fn what_changes_nothing(mut of: impl FnMut(&[(Medium, f64)], Medium) -> std::sync::Arc<Image>) {
    // One medium in any number of layers is that medium, but for where its steps end.
    let whole = of(&[], SKIN);
    let bright = mean(&whole);
    assert!(bright > 1e-3);
    assert!(most_apart(&whole, &of(&[(SKIN, 0.3)], SKIN)) < 0.01 * bright);
    assert!(
        most_apart(&whole, &of(&[(SKIN, 0.1), (SKIN, 0.2), (SKIN, 0.3), (SKIN, 0.5), (SKIN, 1.0)], SKIN))
            < 0.01 * bright
    );
    // Split in two.
    let two = of(&[(SKIN, 0.3), (FLESH, 0.8)], SKIN);
    assert!(most_apart(&two, &of(&[(SKIN, 0.1), (SKIN, 0.3), (FLESH, 0.8)], SKIN)) < 0.01 * bright);
    assert!(most_apart(&two, &whole) > 0.1 * bright);
    // What absorbs, and lies deeper under what does so too, is darker.
    let depths = [0.05, 0.1, 0.3, 1.0].map(|depth| mean(&of(&[(BLACK, depth)], SKIN)));
    assert!(depths.is_sorted_by(|a, b| a > b), "{depths:?}");
}

/// A PNG of one grey level on the left and another on the right.
fn halves(left: u8, right: u8) -> Vec<u8> {
    let image = image::GrayImage::from_fn(8, 8, |x, _| image::Luma([if x < 4 { left } else { right }]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("a PNG can be written");
    bytes.into_inner()
}

#[test]
fn maps_say_where_layers_end() {
    let mut studio = studio();
    studio.write("even.png", halves(51, 51));
    studio.write("halves.png", halves(51, 204));
    let scene = slab(ABOVE, SUN, "Layered()");
    let mut of = |layers: &[(Medium, String)]| {
        studio.write("thing.ron", material(1.33, layers, FLESH));
        studio.scattered(&scene)
    };
    let map = |image: &str, more: &str| format!("Texture(image: \"{image}\", range: (0.0, 2.0){more})");
    let plain = of(&[(SKIN, "0.4".into())]);
    let close = |a: &Image, b: &Image| most_apart(a, b) < 2e-3 * mean(b);
    assert!(close(&of(&[(SKIN, map("even.png", ""))]), &plain));
    assert!(close(&of(&[(SKIN, map("even.png", ", channel: G, invert: true"))]), &of(&[(SKIN, "1.6".into())])));
    assert!(!close(&plain, &of(&[(SKIN, "0.42".into())])));
    // A map that varies lies between its extremes.
    let (varied, deep) = (of(&[(SKIN, map("halves.png", ""))]), of(&[(SKIN, "1.6".into())]));
    assert!(!close(&varied, &plain) && !close(&varied, &deep));
    for (at, value) in varied.pixels.iter().enumerate() {
        for c in 0..3 {
            let (a, b) = (plain.pixels[at][c], deep.pixels[at][c]);
            assert!(value[c] > 0.97 * a.min(b) && value[c] < 1.03 * a.max(b), "pixel {at}: {value:?}");
        }
    }
    // A layer that ends above the one outside it is not there.
    let over = of(&[(SKIN, "0.4".into()), (BLACK, map("even.png", ", invert: false"))]);
    assert!(close(&over, &plain));
    let above = of(&[(SKIN, map("even.png", ", invert: true")), (BLACK, map("even.png", ""))]);
    assert!(close(&above, &deep));
}

#[test]
fn what_grazes_stays_a_number_and_near_its_limit() {
    let mut studio = studio();
    let layers = [(SKIN, 0.4)];
    for (ior, bend) in [(1.0, 1.0), (1.33, 1.33)] {
        studio.write("thing.ron", material(ior, &constant(&layers), FLESH));
        for elevation in [0.1, 1e-2, 1e-3f64] {
            // A low sun.
            let to_light = dvec3(1.0, elevation, 0.0).normalize();
            let light = format!("Directional(direction: (-1, {:?}, 0), irradiance: 1, shadow: false)", -elevation);
            let image = studio.scattered(&slab(ABOVE, &light, "Layered()"));
            let error = error(&image, ABOVE, |view| once(ior, bend, view, to_light, &layers, FLESH));
            // Normals are known to 3e-5.
            assert!(error < 0.01 + 5e-5 / elevation, "ior {ior}, sun at {elevation}: {error:.2e}");
            // A low eye: the lower half of the picture sees the slab.
            let eye = dvec3(0.0, 4.0 * elevation, 4.0);
            let image = studio.scattered(&slab(eye, SUN, "Layered()"));
            let brightest = mean(&studio.scattered(&slab(ABOVE, SUN, "Layered()")));
            for (i, pixel) in image.pixels.iter().enumerate().filter(|(i, _)| i / SIZE.0 as usize >= 9) {
                let view = ray(eye, i as u32 % SIZE.0, i as u32 / SIZE.0);
                let expected = once(ior, bend, view, to_sun(), &layers, FLESH);
                let off = (DVec3::from(pixel.map(f64::from)) - expected).abs().max_element();
                assert!(off < 0.02 * brightest, "ior {ior}, eye at {elevation}, pixel {i}: {pixel:?}, not {expected}");
            }
        }
    }
}

#[test]
fn the_surroundings_shine_in_as_an_integral_over_them_says() {
    let mut studio = studio();
    let layers = [(SKIN, 0.4)];
    for (ior, bend) in [(1.0, 1.0), (1.33, 1.33)] {
        studio.write("thing.ron", material(ior, &constant(&layers), FLESH));
        let image = studio.scattered(&slab(ABOVE, "Environment(radiance: 1)", "Layered()"));
        let error = error(&image, ABOVE, |view| {
            let n = 64;
            let cell = |i: usize| {
                let (u, v) = (((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
                let (cos, phi) = (u, v * std::f64::consts::TAU);
                let sin = (1.0 - cos * cos).sqrt();
                once(ior, bend, view, dvec3(sin * phi.cos(), cos, sin * phi.sin()), &layers, FLESH)
            };
            (0..n * n).map(cell).sum::<DVec3>() * std::f64::consts::TAU / (n * n) as f64
        });
        assert!(error < 0.08, "ior {ior}: {error:.3}");
    }
}

/// The same medium, of which the channels are grey.
fn grey(sigma_a: f64, sigma_s: f64) -> Medium {
    let (sigma_a, sigma_s) = (DVec3::splat(sigma_a), DVec3::splat(sigma_s));
    Medium { sigma_a, sigma_s, phase: Phase::HenyeyGreenstein, parameter: 0.0 }
}

#[test]
fn what_scatters_often_under_a_lamp_is_what_a_half_space_sends_back_but_once() {
    let mut studio = studio();
    for (ior, below) in [(1.0, grey(0.2, 1.8)), (1.4, grey(0.05, 2.0)), (1.4, grey(1.0, 1.0))] {
        // As one medium, and in layers of it.
        for layers in [&[][..], &[(below, 0.3), (below, 0.9)]] {
            studio.write("thing.ron", material(ior, &constant(layers), below));
            let once = studio.scattered(&slab(ABOVE, SUN, "Layered()"));
            let all = studio.scattered(&slab(ABOVE, SUN, "Layered(multiple: true)"));
            let often = Image { pixels: zip(&all, &once, |a, b| a - b), ..(*all).clone() };
            let [sigma_a, sigma_s] = [below.sigma_a.x, below.sigma_s.x];
            let cos = to_sun().y;
            let returned = |cos: f64| {
                let inside = refracted_cosine(cos, ior).expect("it enters");
                let whole = HalfSpace::new(ior).albedos_from(sigma_a / (sigma_a + sigma_s), &[inside])[0];
                whole - sigma_s / (sigma_a + sigma_s) * strata::single(below.phase, 0.0, ior, ior, cos)
            };
            // Over light from everywhere: it leaves in a direction as it would be returned from there.
            let nodes: Vec<f64> = (0..24).map(|i| ((f64::from(i) + 0.5) / 24.0).sqrt()).collect();
            let enters = |cos: f64| 1.0 - fresnel_dielectric(cos, ior);
            let whole: f64 = nodes.iter().map(|cos| enters(*cos)).sum();
            let mean = nodes.iter().map(|cos| enters(*cos) * returned(*cos)).sum::<f64>() / whole;
            let entered = cos * enters(cos) / (PI * diffuse_transmittance(ior)) * returned(cos) / mean;
            let expected =
                |times: f64| move |view: DVec3| DVec3::splat(times * enters(-view.y) * entered * returned(-view.y));
            let error_of = |times: f64| error(&often, ABOVE, expected(times));
            let off = error_of(1.0);
            assert!(off < 0.02, "index {ior}, {} layers: {off:.4}", layers.len());
            assert!(error_of(1.05) > 0.03 && error_of(0.95) > 0.03);
        }
    }
}

#[test]
fn white_layers_send_back_all_that_an_even_sky_sends() {
    let mut studio = studio();
    // What shines evenly from everywhere, and is not absorbed, is as bright from below: but for what the boundary reflects.
    for (ior, layers) in [(1.0, &[][..]), (1.4, &[]), (1.4, &[(grey(0.0, 0.3), 0.5), (grey(0.0, 6.0), 1.0)])] {
        studio.write("thing.ron", material(ior, &constant(layers), grey(0.0, 2.0)));
        let image = studio.scattered(&slab(ABOVE, "Environment(radiance: 1)", "Layered(multiple: true)"));
        let off = error(&image, ABOVE, |view| DVec3::splat(1.0 - fresnel_dielectric(-view.y, ior)));
        assert!(off < 0.12, "index {ior}, {} layers: {off:.4}", layers.len());
        assert!(image.pixels.iter().flatten().all(|value| *value < 1.02));
    }
    studio.write("thing.ron", material(1.4, &[], grey(0.02, 2.0)));
    let image = studio.scattered(&slab(ABOVE, "Environment(radiance: 1)", "Layered(multiple: true)"));
    assert!(error(&image, ABOVE, |view| DVec3::splat(1.0 - fresnel_dielectric(-view.y, 1.4))) > 0.15);
}

#[test]
fn what_scatters_often_has_lost_light_twice_or_more() {
    let mut studio = studio();
    // Grazed, where diffusion by the mean cosine alone is most wrong: what scatters back, and what scatters on.
    let eye = dvec3(0.0, 0.6, 4.0);
    for (albedo, parameter) in [(0.2, -0.9), (0.5, -0.9), (0.2, 0.9), (0.5, 0.9)] {
        studio.write("thing.ron", material(1.0, &[], Medium { parameter, ..grey(1.0 - albedo, albedo) }));
        let all = studio.scattered(&slab(eye, "Environment(radiance: 1)", "Layered(multiple: true)"));
        let once = studio.scattered(&slab(eye, "Environment(radiance: 1)", "Layered()"));
        let often = zip(&all, &once, |a, b| a - b);
        let most = often.iter().flatten().fold(0f32, |most, value| most.max(*value));
        let least = often.iter().flatten().fold(f32::INFINITY, |least, value| least.min(*value));
        assert!(f64::from(most) < albedo * albedo, "albedo {albedo}, {parameter}: {most}");
        assert!(least >= 0.0 && most > 0.0, "albedo {albedo}, {parameter}: {least} to {most}");
    }
}

#[test]
fn the_reference_of_layers_sees_a_lamp_from_the_eye_as_the_eye_from_the_lamp() {
    let mut studio = studio();
    studio.write("thing.ron", material(1.0, &constant(&[(SKIN, 0.2), (FLESH, 0.5)]), SKIN));
    let (one, other) = (dvec3(0.2, 0.4, 0.9).normalize(), dvec3(-0.3, 1.0, 0.1).normalize());
    for integrator in ["Layered", "Volume"] {
        let technique = format!("Reference(integrator: {integrator}, light: Direct, max_error: 1e-6, max_spp: 64)");
        // Of all places the same: so many more samples.
        let mut seen = |to_eye: DVec3, to_light: DVec3| {
            let [x, y, z] = (-to_light).to_array();
            let light = format!("Directional(direction: ({x:?}, {y:?}, {z:?}), irradiance: 1, shadow: false)");
            let scene = slab(60.0 * to_eye, &light, &technique).replace("fov_y_deg: 50.0", "fov_y_deg: 1.0");
            mean(&studio.scattered(&scene))
        };
        let (there, back) = (seen(one, other), seen(other, one));
        let off = (there / other.y) / (back / one.y) - 1.0;
        assert!(off.abs() < 0.05, "{integrator}: {there} {back} {off}");
        assert!((there / back - 1.0).abs() > 0.2, "the two directions are too much alike to tell");
    }
}

#[test]
fn layers_of_constant_depth_need_no_texture_coordinates() {
    let mut studio = studio();
    studio.write("thing.ron", material(1.33, &constant(&[(SKIN, 0.2)]), FLESH));
    let corners = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n";
    let faces = [[4, 3, 2, 1], [5, 6, 7, 8], [1, 2, 6, 5], [3, 4, 8, 7], [2, 3, 7, 6], [4, 1, 5, 8]];
    let mut boxed = |mapped: bool| {
        let corner = |i: &i32| if mapped { format!(" {i}/{i}") } else { format!(" {i}") };
        let face = |face: &[i32; 4]| format!("f{}\n", face.iter().map(corner).collect::<String>());
        let uvs: String =
            (0..8).map(|i| format!("vt {:?} {:?}\n", f64::from(i) / 8.0, f64::from(i % 3) / 3.0)).collect();
        let uvs = if mapped { uvs } else { String::new() };
        studio.write("box.obj", format!("{corners}{uvs}{}", faces.iter().map(face).collect::<String>()));
        studio.scattered(&format!(
            r#"mm_per_unit: 10, camera: (eye: (2, 3, 5), target: (0, 0, 0), fov_y_deg: 36), lights: [{SUN}],
            objects: [(mesh: File("box.obj"), material: "thing.ron")],
            view: (technique: Layered(multiple: true), size: {SIZE:?}, antialias: 1)"#
        ))
    };
    let (without, with) = (boxed(false), boxed(true));
    assert!(mean(&without) > 1e-3);
    assert!(most_apart(&without, &with) < 1e-6);
}

fn zip(a: &Image, b: &Image, f: fn(f32, f32) -> f32) -> Vec<[f32; 3]> {
    a.pixels.iter().zip(&b.pixels).map(|(a, b)| std::array::from_fn(|c| f(a[c], b[c]))).collect()
}

fn anew(before: &Plan, after: &Plan) -> BTreeMap<&'static str, usize> {
    let known: BTreeSet<Key> = before.keys().collect();
    let mut names = BTreeMap::new();
    for step in after.steps().iter().filter(|step| !known.contains(&step.key)) {
        *names.entry(step.name).or_insert(0) += 1;
    }
    names
}

#[test]
fn an_edit_of_a_map_or_a_layer_bakes_nothing() {
    let studio = studio();
    studio.write("map.png", halves(51, 204));
    let map = |channel: &str| format!("Texture(image: \"map.png\", channel: {channel}, range: (0.0, 2.0))");
    let plan = |layers: &[(Medium, String)], scene: &str| {
        studio.write("thing.ron", material(1.33, layers, FLESH));
        let scene = read(&studio.write("scene.ron", format!("Scene(version: 1, {scene})")));
        render::plan(&scene, &Look::of(&scene), &studio.session.shaders).expect("it can be planned").0
    };
    let scene = slab(ABOVE, SUN, "Layered()");
    let layers = [(SKIN, map("R"))];
    let before = plan(&layers, &scene);
    let of = |after: Plan| anew(&before, &after);
    // Another image: what was read of it, and the picture.
    studio.write("map.png", halves(60, 200));
    let edited = of(plan(&layers, &scene));
    let names: Vec<&str> = edited.keys().copied().collect();
    assert_eq!(names, ["frame.compose", "frame.image", "image.file", "layered.maps", "technique.layered"]);
    studio.write("map.png", halves(51, 204));
    assert_eq!(of(plan(&layers, &scene)), BTreeMap::new());
    // Another density below the first layer touches no plane; one of the first layer does.
    let thicker = Medium { sigma_s: 2.0 * SKIN.sigma_s, ..SKIN };
    let deep = plan(&[(SKIN, map("R")), (SKIN, "1.5".into())], &scene);
    let denser = anew(&deep, &plan(&[(SKIN, map("R")), (thicker, "1.5".into())], &scene));
    assert!(!denser.contains_key("layered.planes") && !denser.contains_key("layered.maps"), "{denser:?}");
    let outside = of(plan(&[(thicker, map("R"))], &scene));
    assert!(outside.contains_key("layered.planes") && !outside.contains_key("layered.slopes"), "{outside:?}");
    // Steps, bent rays and lamps are no business of bakes.
    for technique in ["Layered(samples: 20)", "Layered(refract: false)", "Layered(march: Uniform)"] {
        let made = of(plan(&layers, &slab(ABOVE, SUN, technique)));
        assert!(
            made.keys().all(|name| ["frame.compose", "frame.image", "technique.layered"].contains(name)),
            "{made:?}"
        );
    }
    // What layers send back is baked for each boundary and each phase function: coefficients and depths do not touch it, and
    // one phase function not what was baked for others.
    let often = slab(ABOVE, SUN, "Layered(multiple: true)");
    let before = plan(&layers, &often);
    let baked = |made: &BTreeMap<&'static str, usize>| {
        ["layered.diffusion", "layered.once"].map(|name| made.get(name).copied())
    };
    assert_eq!(baked(&anew(&Plan::default(), &before)), [Some(1), Some(2)]);
    let changed = anew(&before, &plan(&[(thicker, "0.2".into())], &often));
    assert!(baked(&changed) == [None, None] && changed.contains_key("technique.layered"), "{changed:?}");
    assert!(!changed.contains_key("layered.returns"), "{changed:?}");
    let turned = Medium { parameter: 0.3, ..SKIN };
    assert_eq!(baked(&anew(&before, &plan(&[(turned, map("R"))], &often))), [None, Some(1)]);
    studio.write("other.ron", material(1.33, &constant(&[(turned, 0.2)]), FLESH));
    let two = often.replace("objects: [", "objects: [(mesh: Sphere(radius: 1), material: \"other.ron\"), ");
    assert_ne!(two, often);
    assert_eq!(baked(&anew(&before, &plan(&layers, &two))), [None, Some(1)]);
    // Without images nothing of a map is planned.
    let plain = plan(&constant(&[(SKIN, 0.4)]), &scene);
    assert!(plain.steps().iter().all(|step| !["layered.maps", "layered.slopes"].contains(&step.name)));
}
