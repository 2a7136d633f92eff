//! Light that comes through: what the two techniques that know thickness have to get right, and where each is known to fail.

mod studio;

use diaphane::image::Image;
use diaphane::optics::Rgb;
use diaphane::optics::fresnel::fresnel_dielectric;
use diaphane::optics::medium::Medium;
use diaphane::optics::slab::Slab;
use studio::{Studio, most_apart, studio};

const WAX: &str = "Material(version: 1, surface: (ior: 1.4), medium: Coefficients(sigma_a: (0.01, 0.02, 0.05), sigma_s: (1.0, 1.2, 1.5), g: 0.0))";

fn wax() -> Medium {
    Medium::coefficients(Rgb::new(0.01, 0.02, 0.05), Rgb::new(1.0, 1.2, 1.5), Rgb::ZERO)
}

/// What a technique scatters of a lamp of irradiance 1 that shines along `direction`; 10 mm a unit.
fn scattered(studio: &mut Studio, technique: &str, objects: &str, direction: &str) -> Image {
    under(studio, technique, objects, &format!("Directional(name: \"lamp\", direction: {direction}, irradiance: 1)"))
}

/// Likewise of other lights.
fn under(studio: &mut Studio, technique: &str, objects: &str, lights: &str) -> Image {
    studio.write("wax.ron", WAX);
    let image = studio.scattered(&format!(
        "mm_per_unit: 10.0, camera: (eye: (0, 0, 40), target: (0, 0, 0), fov_y_deg: 4),
         lights: [{lights}],
         objects: [{objects}], view: (technique: {technique}, size: (48, 48), antialias: 1)"
    ));
    image.as_ref().clone()
}

fn middle(image: &Image) -> Rgb {
    let [r, g, b] = image.pixels[(24 * image.width + 24) as usize];
    Rgb::new(r.into(), g.into(), b.into())
}

fn slab(thickness: f64) -> String {
    format!("(name: \"slab\", mesh: Slab(size: (6, 6, {thickness}), segments: (24, 24)), material: \"wax.ron\"),")
}

#[test]
fn a_slab_lit_from_behind_is_as_bright_as_diffusion_says() {
    let mut studio = studio();
    let leaves = 1.0 - fresnel_dielectric(1.0, 1.4);
    for thickness in [0.2, 0.6] {
        let expected = leaves / std::f64::consts::PI * Slab::new(&wax(), 1.4).transmittance(10.0 * thickness);
        for (technique, within) in [("DepthMapThickness()", 0.01), ("SphericalThickness(bands: 8)", 0.04)] {
            let image = scattered(&mut studio, technique, &slab(thickness), "(0, 0, 1)");
            let off = (middle(&image) / expected - 1.0).abs();
            println!("{technique}, {thickness}: {off:.3} off");
            assert!(off.max_element() < within, "{technique}: {} instead of {expected}", middle(&image));
        }
        // What does not know thickness lets nothing through.
        assert_eq!(middle(&scattered(&mut studio, "Opaque()", &slab(thickness), "(0, 0, 1)")), Rgb::ZERO);
    }
}

/// A slab is so thick sideways that few bands cannot tell how thin it is ahead.
#[test]
fn lengths_as_a_series_let_through_what_lengths_do_not() {
    let mut studio = studio();
    let expected =
        Slab::new(&wax(), 1.4).transmittance(6.0) * (1.0 - fresnel_dielectric(1.0, 1.4)) / std::f64::consts::PI;
    let mut off = |encode: &str| {
        let technique = format!("SphericalThickness(encode: {encode})");
        (middle(&scattered(&mut studio, &technique, &slab(0.6), "(0, 0, 1)")) / expected - 1.0).abs().max_element()
    };
    let (left, lengths) = (off("Transmittance"), off("Thickness"));
    assert!(left < 0.3 && lengths > 1.0, "{left} {lengths}");
}

#[test]
fn triangles_are_not_seen_in_what_comes_through() {
    let mut studio = studio();
    let ball = |subdivisions: u32| {
        format!("(name: \"ball\", mesh: Sphere(radius: 1.2, subdivisions: {subdivisions}), material: \"wax.ron\"),")
    };
    let mut take = |subdivisions| scattered(&mut studio, "SphericalThickness()", &ball(subdivisions), "(0.3, -0.2, 1)");
    let (coarse, fine) = (take(4), take(6));
    let most = fine.pixels.iter().flatten().fold(0.0f32, |most, v| most.max(*v));
    // What lies well within the ball.
    let inner = |image: &Image| {
        let rows = (12..36usize).flat_map(|y| image.pixels[48 * y + 12..48 * y + 36].to_vec());
        Image { width: 24, height: 24, pixels: rows.collect() }
    };
    let apart = most_apart(&inner(&coarse), &inner(&fine)) / f64::from(most);
    println!("{apart:.4} of the brightest apart");
    assert!(most > 0.0 && apart < 0.05, "{apart}");
}

#[test]
fn moving_a_thing_with_its_lamp_and_eye_changes_nothing() {
    let mut studio = studio();
    let knot = |turn: &str| {
        format!(
            "(name: \"knot\", mesh: TorusKnot(p: 2, q: 3, radius: 0.7, tube: 0.3, segments: (60, 12)), material: \"wax.ron\",
              transform: (rotate_deg: {turn})),"
        )
    };
    for technique in ["SphericalThickness()", "DepthMapThickness()"] {
        // Turned about the view by a quarter, the lamp with it: the picture turns.
        let still = scattered(&mut studio, technique, &knot("(0, 0, 0)"), "(0.5, 0, 1)");
        let turned = scattered(&mut studio, technique, &knot("(0, 0, 90)"), "(0, 0.5, 1)");
        let (mut apart, mut light) = (0.0, 0.0);
        for y in 0..48 {
            for x in 0..48 {
                let (a, b) = (still.pixels[48 * y + x], turned.pixels[48 * (47 - x) + y]);
                apart += f64::from((a[0] - b[0]).abs());
                light += f64::from(a[0]);
            }
        }
        println!("{technique}: {:.4} of the light is elsewhere", apart / light);
        assert!(light > 0.0 && apart < 0.03 * light, "{technique}: {}", apart / light);
    }
}

/// The inner product of two series is what many lamps add up to, one by one.
#[test]
fn an_even_sky_is_as_many_lamps_as_one_likes() {
    let mut studio = studio();
    let ball = "(name: \"ball\", mesh: Sphere(radius: 1.2, subdivisions: 4), material: \"wax.ron\"),";
    let technique = "SphericalThickness(bands: 5, front_bands: 5)";
    const LAMPS: usize = 128;
    let lamp = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / LAMPS as f64;
        let (y, x) = (i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt())).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let irradiance = 4.0 * std::f64::consts::PI / LAMPS as f64;
        format!(
            "Directional(direction: ({}, {}, {z}), irradiance: {irradiance}, shadow: false),",
            across * x,
            across * y
        )
    };
    let lamps: String = (0..LAMPS).map(lamp).collect();
    let sky = |radiance: f64| format!("Environment(radiance: {radiance}, shadow: false)");
    let added = under(&mut studio, technique, ball, &lamps);
    let mut apart =
        |radiance| (middle(&under(&mut studio, technique, ball, &sky(radiance))) / middle(&added) - 1.0).abs();
    let off = apart(1.0);
    println!("{off:.4} off");
    assert!(off.max_element() < 0.02, "{off}");
    assert!(apart(1.05).min_element() > 0.02, "five in a hundred are noticed");
}

/// Few bands of a step ring: behind an edge they fall below what is there. A window damps that.
#[test]
fn a_window_leaves_less_contrast_the_stronger_it_is() {
    let mut studio = studio();
    let knot = "(name: \"knot\", mesh: TorusKnot(p: 2, q: 3, radius: 0.7, tube: 0.3, segments: (60, 12)), material: \"wax.ron\"),";
    let mut contrast = |window: f64| {
        let technique = format!("SphericalThickness(bands: 6, front_bands: 6, diffuse: 0, window: {window})");
        let image = scattered(&mut studio, &technique, knot, "(0.2, 0.1, 1)");
        let seen: Vec<f64> = image.pixels.iter().map(|p| f64::from(p[0])).filter(|v| *v > 0.0).collect();
        let mean = seen.iter().sum::<f64>() / seen.len() as f64;
        (seen.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / seen.len() as f64).sqrt() / mean
    };
    let [none, some, much] = [0.0, 1.0, 4.0].map(&mut contrast);
    println!("{none:.3} {some:.3} {much:.3}");
    assert!(none > 1.02 * some && some > 1.02 * much, "{none} {some} {much}");
}

/// Two walls with a gap between them, as one mesh: a depth map holds the first entry only, and counts the gap as filled.
#[test]
fn a_depth_map_takes_a_hollow_thing_for_a_solid_one() {
    let mut studio = studio();
    let mut obj = String::new();
    for (wall, z) in [(0, -1.0), (1, 0.8)] {
        for (x, y, dz) in
            [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
        {
            obj += &format!("v {} {} {}\n", 2 * x, 2 * y, z + 0.2 * f64::from(dz));
        }
        for face in [[4, 3, 2, 1], [5, 6, 7, 8], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [4, 1, 5, 8]] {
            obj += &format!(
                "f {} {} {} {}\n",
                face[0] + 8 * wall,
                face[1] + 8 * wall,
                face[2] + 8 * wall,
                face[3] + 8 * wall
            );
        }
    }
    studio.write("walls.obj", obj);
    let walls = "(name: \"walls\", mesh: File(\"walls.obj\"), material: \"wax.ron\", normals: Flat),";
    let map = middle(&scattered(&mut studio, "DepthMapThickness(attenuation: Beer)", walls, "(0, 0, 1)"));
    let beer = |mm: f64| (-wax().sigma_tr() * mm).exp() * (1.0 - fresnel_dielectric(1.0, 1.4)) / std::f64::consts::PI;
    assert!((map / beer(20.0) - 1.0).abs().max_element() < 0.03, "{map} {}", beer(20.0));
    assert!((map / beer(4.0) - 1.0).abs().min_element() > 0.1, "4 mm of it are wax");
}
