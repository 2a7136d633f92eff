//! Pictures obey the laws of light. All of them are small, linear, and compared with a formula or with each other.

mod studio;

use diaphane::frame::Part;
use diaphane::image::Image;
use diaphane::render::Look;
use glam::{DVec2, DVec3, dvec3};
use std::f64::consts::PI;
use studio::{Studio, mean, most_apart, share_apart, studio};

const WHITE: &str = "Material(version: 1, medium: Opaque(albedo: 1))";
const PAINT: &str = "Material(version: 1, medium: Opaque(albedo: (0.8, 0.5, 0.2)))";
const VIEW: &str = "view: (technique: Opaque(), size: (48, 36), antialias: 1)";

fn ready() -> std::sync::MutexGuard<'static, Studio> {
    let studio = studio();
    studio.write("white.ron", WHITE);
    studio.write("paint.ron", PAINT);
    studio
}

/// A camera above the floor y = 0.
#[derive(Clone, Copy)]
struct Eye {
    eye: DVec3,
    target: DVec3,
    fov_y_deg: f64,
}

const ABOVE: Eye = Eye { eye: dvec3(0.0, 8.0, 5.0), target: DVec3::ZERO, fov_y_deg: 40.0 };

impl Eye {
    fn text(&self) -> String {
        let v = |v: DVec3| format!("({:?}, {:?}, {:?})", v.x, v.y, v.z);
        format!("camera: (eye: {}, target: {}, fov_y_deg: {})", v(self.eye), v(self.target), self.fov_y_deg)
    }

    /// The direction through the centre of a pixel, row 0 at the top.
    fn ray(&self, x: u32, y: u32, image: &Image) -> DVec3 {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let half = (0.5 * self.fov_y_deg.to_radians()).tan();
        let at = (DVec2::new(x as f64, y as f64) + 0.5) / image.height as f64 * 2.0;
        let (i, j) = (at.x - image.width as f64 / image.height as f64, 1.0 - at.y);
        (forward + half * (i * right + j * up)).normalize()
    }

    /// Where a pixel sees the floor.
    fn on_floor(&self, x: u32, y: u32, image: &Image) -> DVec3 {
        let d = self.ray(x, y, image);
        self.eye - d * (self.eye.y / d.y)
    }
}

fn pixels(image: &Image) -> impl Iterator<Item = (u32, u32, DVec3)> + '_ {
    (0..image.height)
        .flat_map(move |y| (0..image.width).map(move |x| (x, y, DVec3::from(image.at(x, y).map(|v| v as f64)))))
}

const FLOOR: &str = r#"(name: "floor", mesh: Box(size: (40, 1, 40)), material: "paint.ron",
    transform: (translate: (0, -0.5, 0)))"#;

fn floor_scene(lights: &str, more: &str) -> String {
    format!("mm_per_unit: 10, {}, lights: [{lights}], objects: [{FLOOR}, {more}], {VIEW}", ABOVE.text())
}

/// The floor's radiance, pixel by pixel, is what a formula says of its irradiance.
fn floor_obeys(image: &Image, tolerance: f64, irradiance: impl Fn(DVec3) -> f64) {
    let albedo = dvec3(0.8, 0.5, 0.2);
    for (x, y, found) in pixels(image) {
        let expected = albedo / PI * irradiance(ABOVE.on_floor(x, y, image));
        let error = ((found - expected).abs() / expected.max(DVec3::splat(1e-9))).max_element();
        assert!(error <= tolerance, "pixel {x}, {y} is {found}, expected {expected}: off by {error:.2e}");
    }
}

#[test]
fn a_lambertian_floor_shines_as_its_irradiance_says() {
    let mut studio = ready();
    let lamp = dvec3(1.0, 3.0, -1.0);
    for shadow in [true, false] {
        let light = format!("Point(position: (1, 3, -1), intensity: 7, shadow: {shadow})");
        floor_obeys(&studio.picture(&floor_scene(&light, "")), 1e-3, |p| {
            let to = lamp - p;
            7.0 * to.y / to.length().powi(3)
        });
        let light = format!("Directional(direction: (1, -2, 2), irradiance: 3, shadow: {shadow})");
        floor_obeys(&studio.picture(&floor_scene(&light, "")), 1e-3, |_| 3.0 * 2.0 / 3.0);
    }
    let light = "Rect(center: (0, 10, 0), u: (0.5, 0, 0), v: (0, 0, 0.5), radiance: 50)";
    floor_obeys(&studio.picture(&floor_scene(light, "")), 1e-2, |p| {
        let steps = 40;
        let sum: f64 = (0..steps * steps)
            .map(|i| {
                let at = |k: i32| ((k as f64 + 0.5) / steps as f64 - 0.5) * 1.0;
                let to = dvec3(at(i % steps), 10.0, at(i / steps)) - p;
                to.y * to.y / to.length().powi(4)
            })
            .sum();
        50.0 * sum / (steps * steps) as f64
    });
    // The other side of the light is dark: cross(u, v) points away from the floor here.
    let light = "Rect(center: (0, 10, 0), u: (0, 0, 0.5), v: (0.5, 0, 0), radiance: 50)";
    assert_eq!(mean(&studio.picture(&floor_scene(&light.replace("(0, 10, 0)", "(0, 12, 30)"), ""))), 0.0);
}

fn lone_sphere(material: &str, radiance: f64, technique: &str) -> String {
    format!(
        "mm_per_unit: 10, camera: (eye: (0, 0, 4), target: (0, 0, 0), fov_y_deg: 36),
         lights: [Environment(radiance: {radiance})],
         objects: [(mesh: Sphere(radius: 1, subdivisions: 5), material: \"{material}\")],
         view: (technique: {technique}, size: (48, 36), antialias: 1)"
    )
}

#[test]
fn a_white_furnace_leaves_nothing_to_see() {
    let mut studio = ready();
    let image = studio.picture(&lone_sphere("white.ron", 2.0, "Opaque()"));
    for (x, y, found) in pixels(&image) {
        assert!((found - 2.0).abs().max_element() <= 0.02, "pixel {x}, {y} is {found} in a sky of 2");
    }
    // Teeth: a paint that absorbs a twentieth is seen.
    studio.write("grey.ron", WHITE.replace("albedo: 1", "albedo: 0.95"));
    let image = studio.picture(&lone_sphere("grey.ron", 2.0, "Opaque()"));
    assert!((image.at(24, 18)[0] - 1.9).abs() < 0.02);
}

#[test]
fn what_refracts_without_absorbing_gives_back_all_light_and_no_more() {
    let mut studio = ready();
    // Smooth: 256 directions know half a sky to a few hundredths at the limb. Rough: a lobe of single reflections loses
    // light where it is grazed, so only all of the picture is bounded from below.
    for (roughness, lost) in [(0.0, 0.05), (0.3, 1.0), (1.0, 1.0)] {
        studio.write(
            "glass.ron",
            format!(
                "Material(version: 1, surface: (ior: 1.5, roughness: {roughness}),
                 medium: AlbedoMfp(albedo: 1, mfp: 0.001))"
            ),
        );
        let image = studio.picture(&lone_sphere("glass.ron", 1.0, "Opaque()"));
        for (x, y, found) in pixels(&image) {
            let (low, high) = (found.min_element(), found.max_element());
            assert!(high <= 1.015 && low >= 1.0 - lost, "roughness {roughness}, pixel {x}, {y}: {found}");
        }
        println!("roughness {roughness}: mean {}", mean(&image));
        assert!(mean(&image) > 0.95, "roughness {roughness}: mean {}", mean(&image));
    }
}

const LIGHTS: [&str; 4] = [
    "Directional(direction: (-1, -2, -1), irradiance: (2, 1.9, 1.7))",
    "Point(position: (3, 4, 3), intensity: (8, 8, 9))",
    "Rect(center: (-4, 4, -3), u: (0.6, 0.6, 0), v: (0, 0, 1), radiance: (6, 6, 6))",
    "Environment(radiance: (0.2, 0.25, 0.3))",
];

/// The things, the horizon and what is above it.
const ASIDE: Eye = Eye { eye: dvec3(0.0, 3.0, 9.0), target: dvec3(-0.5, 1.8, 0.0), fov_y_deg: 50.0 };

/// Two spheres, one of them translucent, on a floor.
fn still_life(studio: &Studio, lights: &str, technique: &str) -> String {
    studio.write(
        "wax.ron",
        "Material(version: 1, surface: (ior: 1.5, roughness: 0.3),
         medium: ReducedCoefficients(sigma_a: (0.01, 0.02, 0.05), sigma_s_prime: (2.0, 2.2, 2.5)))",
    );
    format!(
        "mm_per_unit: 10, {}, lights: [{lights}],
         objects: [{FLOOR},
            (name: \"a\", mesh: Sphere(radius: 1, subdivisions: 3), material: \"wax.ron\",
             transform: (translate: (-1, 1, 0))),
            (name: \"b\", mesh: Sphere(radius: 0.7, subdivisions: 3), material: \"paint.ron\",
             transform: (translate: (1, 0.7, 0.6)))],
         view: (technique: {technique}, size: (48, 36), antialias: 1)",
        ASIDE.text()
    )
}

fn sum(images: &[std::sync::Arc<Image>]) -> Image {
    let mut sum = Image::filled(images[0].width, images[0].height, [0.0; 3]);
    for image in images {
        for (to, from) in sum.pixels.iter_mut().zip(&image.pixels) {
            *to = std::array::from_fn(|c| to[c] + from[c]);
        }
    }
    sum
}

#[test]
fn light_adds_up_and_so_do_its_parts() {
    let mut studio = ready();
    // The area light stands in every picture, dark or not: it casts shadows and is seen.
    let dark = |light: &str| light.replace("radiance: (6, 6, 6)", "radiance: 0");
    let one: Vec<_> = (0..4)
        .map(|i| {
            let lights = if i == 2 { LIGHTS[2].to_string() } else { format!("{}, {}", LIGHTS[i], dark(LIGHTS[2])) };
            let text = still_life(&studio, &lights, "FilteredNormals()");
            studio.picture(&text)
        })
        .collect();
    let text = still_life(&studio, &LIGHTS.join(", "), "FilteredNormals()");
    let all = studio.picture(&text);
    let limit = 1e-4 * mean(&all);
    assert!(most_apart(&sum(&one), &all) < limit, "lights: {} of {limit}", most_apart(&sum(&one), &all));
    assert!(most_apart(&sum(&one[..3]), &all) > 100.0 * limit, "a missing light would be noticed");

    let scene = studio.scene(&text);
    let mut parts = Vec::new();
    for part in [Part::Scattered, Part::Glossy, Part::Unscattered] {
        let mut look = Look::of(&scene);
        look.view.part = part;
        parts.push(studio.shoot(&scene, &look).1);
        assert!(mean(&parts[parts.len() - 1]) > 10.0 * limit, "{part:?} is there");
    }
    assert!(most_apart(&sum(&parts), &all) < limit, "parts: {}", most_apart(&sum(&parts), &all));
}

/// The still life turned about z by `turn` degrees, then scaled, then moved: everything, lights and camera too.
fn moved(studio: &Studio, turn: f64, scale: f64, by: DVec3, technique: &str) -> String {
    let rotation = glam::DQuat::from_rotation_z(turn.to_radians());
    studio.write(
        "wax.ron",
        "Material(version: 1, surface: (ior: 1.5, roughness: 0.3),
         medium: ReducedCoefficients(sigma_a: (0.01, 0.02, 0.05), sigma_s_prime: (2.0, 2.2, 2.5)))",
    );
    let text = |v: DVec3| format!("({:?}, {:?}, {:?})", v.x, v.y, v.z);
    let p = |x: f64, y: f64, z: f64| text(scale * (rotation * dvec3(x, y, z)) + by);
    let d = |x: f64, y: f64, z: f64| text(scale * (rotation * dvec3(x, y, z)));
    let s = |v: f64| format!("{:?}", scale * v);
    let at = |x, y, z| format!("transform: (translate: {}, rotate_deg: (0, 0, {turn:?}))", p(x, y, z));
    format!(
        "mm_per_unit: {:?}, camera: (eye: {}, target: {}, up: {}, fov_y_deg: 40),
         lights: [
            Directional(direction: {}, irradiance: (2, 1.9, 1.7)),
            Point(position: {}, intensity: {}),
            Rect(center: {}, u: {}, v: {}, radiance: 6),
            Environment(radiance: (0.2, 0.25, 0.3), shadow: false)],
         objects: [
            (name: \"floor\", mesh: Box(size: ({f}, {}, {f})), material: \"paint.ron\", {}),
            (name: \"a\", mesh: Sphere(radius: {}, subdivisions: 3), material: \"wax.ron\", {}),
            (name: \"b\", mesh: Sphere(radius: {}, subdivisions: 3), material: \"paint.ron\", {})],
         view: (technique: {technique}, size: (48, 36), antialias: 1)",
        10.0 / scale,
        p(0.0, 8.0, 5.0),
        p(0.0, 0.0, 0.0),
        text(rotation * DVec3::Y),
        text(rotation * dvec3(-1.0, -2.0, -1.0)),
        p(3.0, 4.0, 3.0),
        8.0 * scale * scale,
        p(-4.0, 4.0, -3.0),
        d(0.6, 0.6, 0.0),
        d(0.0, 0.0, 1.0),
        s(1.0),
        at(0.0, -0.5, 0.0),
        s(1.0),
        at(-1.0, 1.0, 0.0),
        s(0.7),
        at(1.0, 0.7, 0.6),
        f = s(16.0),
    )
}

#[test]
fn size_place_and_orientation_change_nothing() {
    let mut studio = ready();
    for technique in ["Opaque()", "FilteredNormals()"] {
        let text = moved(&studio, 0.0, 1.0, DVec3::ZERO, technique);
        let here = studio.picture(&text);
        let limit = 2e-3 * mean(&here);
        let far = dvec3(1e6, 2e6, -1e6);
        // Texels of shadow maps fall elsewhere when things turn, and edges of shadows with them.
        for (what, turn, scale, by, may_differ) in [
            ("a thousandth", 0.0, 1e-3, DVec3::ZERO, 0.005),
            ("a thousandfold", 0.0, 1e3, DVec3::ZERO, 0.005),
            ("far away", 0.0, 1.0, far, 0.005),
            ("moved", 0.0, 1.0, dvec3(3.0, -2.0, 11.0), 0.005),
            ("turned", 90.0, 1.0, dvec3(0.0, 5.0, 0.0), 0.05),
            ("turned a little", 33.0, 1.0, DVec3::ZERO, 0.06),
        ] {
            let text = moved(&studio, turn, scale, by, technique);
            let there = studio.picture(&text);
            let share = share_apart(&here, &there, limit);
            println!(
                "{technique} {what}: {share:.4} of the pixels differ, at most by {:.2e}",
                most_apart(&here, &there)
            );
            assert!(share <= may_differ, "{technique} {what}: {share} of the pixels differ");
            assert!((mean(&here) / mean(&there) - 1.0).abs() < 2e-3, "{technique} {what}: another mean");
        }
        // Teeth: without the scale of mm, a translucent thing looks otherwise.
        if technique == "FilteredNormals()" {
            let text =
                moved(&studio, 0.0, 1e-3, DVec3::ZERO, technique).replace("mm_per_unit: 10000.0", "mm_per_unit: 10");
            assert!(share_apart(&here, &studio.picture(&text), limit) > 0.03);
        }
    }
}

const BLOCKER: &str = r#"(name: "blocker", mesh: Box(size: (2, 0.2, 2)), material: "paint.ron",
    transform: (translate: (0, 2, 0)))"#;

#[test]
fn full_shadow_is_black_and_its_edge_is_where_it_belongs() {
    let mut studio = ready();
    // Seen from the side, so that the blocker hides nothing of its shadow.
    let view = Eye { eye: dvec3(0.0, 3.0, 12.0), target: dvec3(2.0, 0.5, 0.0), fov_y_deg: 30.0 };
    for (light, towards) in [
        ("Directional(direction: (1, -1, 0), irradiance: 3", None),
        ("Point(position: (-4, 6, 0), intensity: 50", Some(dvec3(-4.0, 6.0, 0.0))),
    ] {
        let text = |shadow: bool| {
            let lights = format!("lights: [{light}, shadow: {shadow})]");
            format!("mm_per_unit: 10, {}, {lights}, objects: [{FLOOR}, {BLOCKER}], {VIEW}", view.text())
        };
        let (shaded, lit) = (studio.picture(&text(true)), studio.picture(&text(false)));
        let (mut dark, mut bright) = (0, 0);
        for (x, y, found) in pixels(&shaded) {
            let ray = view.ray(x, y, &shaded);
            if ray.y > -1e-3 || hits_box(view.eye, ray, 1e9) {
                continue;
            }
            let p = view.on_floor(x, y, &shaded);
            if p.x.abs() > 19.0 || p.z.abs() > 19.0 {
                continue;
            }
            let to = towards.map_or(dvec3(-1.0, 1.0, 0.0) * 100.0, |lamp| lamp - p);
            // Clear of the edge by a pixel and a texel's filter.
            let around = [(0.0, 0.0), (0.25, 0.0), (-0.25, 0.0), (0.0, 0.25), (0.0, -0.25)];
            let hits = around.iter().filter(|(a, b)| hits_box(p + dvec3(*a, 1e-6, *b), to, 1.0)).count();
            let free = DVec3::from(lit.at(x, y).map(|v| v as f64));
            if hits == around.len() {
                dark += 1;
                assert_eq!(found, DVec3::ZERO, "{light}: pixel {x}, {y} at {p} lies in full shadow");
            } else if hits == 0 {
                bright += 1;
                assert!((found / free - 1.0).abs().max_element() < 1e-3, "{light}: pixel {x}, {y} at {p} is lit");
            }
        }
        assert!(dark > 10 && bright > 200, "{light}: {dark} pixels in shadow, {bright} lit");
    }
}

#[test]
fn nothing_leaks_where_the_faces_of_a_shadow_cube_meet() {
    let mut studio = ready();
    // The corners of the cube of maps look at those of a hood that stands on the floor, beyond which there is only night.
    let hood = r#"(name: "hood", mesh: Box(size: (1.96, 1.96, 1.96)), material: "paint.ron",
        transform: (translate: (0, 0.99, 0)))"#;
    let view = Eye { eye: dvec3(2.5, 1.0, 2.5), target: dvec3(1.05, 0.0, 1.05), fov_y_deg: 12.0 };
    for height in [0.99, 1.1] {
        let lamp = format!("Point(position: (0, {height}, 0), intensity: 50)");
        let head = format!("mm_per_unit: 10, {}, lights: [{lamp}]", view.text());
        let dark = studio.picture(&format!("{head}, objects: [{FLOOR}, {hood}], {VIEW}"));
        assert!(pixels(&dark).all(|(.., found)| found == DVec3::ZERO), "light of a lamp at {height} leaks");
        let bright = studio.picture(&format!("{head}, objects: [{FLOOR}], {VIEW}"));
        assert!(pixels(&bright).all(|(.., found)| found.min_element() > 0.0));
    }
}

/// Whether the way from `p` along `d`, up to `length` of it, meets the blocker.
fn hits_box(p: DVec3, d: DVec3, length: f64) -> bool {
    let (low, high) = (dvec3(-1.0, 1.9, -1.0), dvec3(1.0, 2.1, 1.0));
    let (a, b) = ((low - p) / d, (high - p) / d);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    enter <= leave && leave > 0.0 && enter < length
}

#[test]
fn a_penumbra_is_as_soft_as_the_light_is_wide() {
    let mut studio = ready();
    let light = "Rect(center: (-4, 6, 0), u: (0.8, 0.6, 0), v: (0, 0, 1), radiance: 20)";
    let view = Eye { eye: dvec3(0.0, 3.0, 12.0), target: dvec3(2.0, 0.5, 0.0), fov_y_deg: 30.0 };
    let text = format!("mm_per_unit: 10, {}, lights: [{light}], objects: [{FLOOR}, {BLOCKER}], {VIEW}", view.text());
    let image = studio.picture(&text);
    let (u, v) = (dvec3(0.8, 0.6, 0.0), DVec3::Z);
    let normal = u.cross(v).normalize();
    let (mut worst, mut squares, mut count, mut soft) = (0f64, 0.0, 0, 0);
    for (x, y, found) in pixels(&image) {
        let ray = view.ray(x, y, &image);
        if ray.y > -1e-3 || hits_box(view.eye, ray, 1e9) {
            continue;
        }
        let p = view.on_floor(x, y, &image);
        if p.x.abs() > 19.0 || p.z.abs() > 19.0 {
            continue;
        }
        let steps = 24;
        let (mut open, mut all) = (0.0, 0.0);
        for i in 0..steps * steps {
            let at = |k: i32| (k as f64 + 0.5) / steps as f64 * 2.0 - 1.0;
            let to = dvec3(-4.0, 6.0, 0.0) + at(i % steps) * u + at(i / steps) * v - p;
            let geometry = to.y * (-normal.dot(to)).max(0.0) / to.length().powi(4) * 4.0 / (steps * steps) as f64;
            all += geometry;
            open += if hits_box(p + dvec3(0.0, 1e-6, 0.0), to, 1.0) { 0.0 } else { geometry };
        }
        if all == 0.0 {
            continue;
        }
        let error = (found.x / (0.8 / PI * 20.0) - open) / all;
        soft += (open > 0.05 * all && open < 0.95 * all) as i32;
        worst = worst.max(error.abs());
        squares += error * error;
        count += 1;
    }
    // Sixteen samples step where the truth slopes: by an eighth along an edge that is parallel to their rows.
    let rms = (squares / count as f64).sqrt();
    println!("penumbra: worst {worst:.3}, rms {rms:.4}, {soft} of {count} pixels in it");
    assert!(soft > 30, "only {soft} pixels lie in the penumbra");
    assert!(worst < 0.17 && rms < 0.05, "worst {worst:.3}, rms {rms:.4}");
}

#[test]
fn a_sphere_does_not_shade_its_own_lit_side() {
    let mut studio = ready();
    for radius in [0.01, 1.0, 1000.0] {
        for light in [
            "Directional(direction: (-1, -1, -1), irradiance: 3".to_string(),
            format!("Point(position: ({0:?}, {0:?}, {0:?}), intensity: {1:?}", 3.0 * radius, radius * radius),
            format!(
                "Rect(center: ({0:?}, {0:?}, {0:?}), u: ({1:?}, {1:?}, {2:?}), v: ({1:?}, {2:?}, 0), radiance: 9",
                3.0 * radius,
                0.3 * radius,
                -0.3 * radius
            ),
        ] {
            let text = |shadow: bool| {
                format!(
                    "mm_per_unit: 10, camera: (eye: (0, 0, {:?}), target: (0, 0, 0), fov_y_deg: 30),
                     lights: [{light}, shadow: {shadow})],
                     objects: [(mesh: Sphere(radius: {radius:?}, subdivisions: 5), material: \"white.ron\")], {VIEW}",
                    4.0 * radius
                )
            };
            let (shaded, free) = (studio.picture(&text(true)), studio.picture(&text(false)));
            let most = free.pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
            assert!(most > 0.0, "{light} reaches the sphere");
            for (x, y, found) in pixels(&shaded) {
                let lit = DVec3::from(free.at(x, y).map(|v| v as f64));
                // Away from the terminator: a fifth of the brightest.
                if lit.x > 0.2 * most as f64 {
                    let lost = 1.0 - found.x / lit.x;
                    assert!(lost.abs() < 0.01, "radius {radius}, {light}: pixel {x}, {y} loses {lost:.3}");
                }
            }
        }
    }
}

/// A sky that is dark but for one place: longitude from -z through +x as a share of the way around.
fn bright_at(studio: &Studio, share: f64) {
    let mut sky = Image::filled(64, 32, [0.0; 3]);
    let x = ((share * 64.0) as usize) % 64;
    for (x, y) in [(x, 15), (x, 16), ((x + 63) % 64, 15), ((x + 63) % 64, 16)] {
        sky.pixels[y * 64 + x] = [100.0; 3];
    }
    studio.write_exr("sky.exr", &sky);
}

#[test]
fn an_image_of_the_sky_lights_what_faces_it() {
    let mut studio = ready();
    bright_at(&studio, 0.75); // +x
    let from = |studio: &mut Studio, eye: &str, rotation: f64| {
        mean(&studio.picture(&format!(
            "mm_per_unit: 10, camera: (eye: {eye}, target: (0, 0, 0), fov_y_deg: 20),
             lights: [Environment(image: \"sky.exr\", rotation_deg: {rotation:?})],
             objects: [(mesh: Sphere(radius: 1, subdivisions: 4), material: \"white.ron\")], {VIEW}"
        )))
    };
    let (lit, side, dark) = (
        from(&mut studio, "(4, 0, 0)", 0.0),
        from(&mut studio, "(0, 0, 4)", 0.0),
        from(&mut studio, "(-4, 0, 0)", 0.0),
    );
    assert!(lit > 1.5 * side && side > 3.0 * dark, "from +x {lit}, from the side {side}, from -x {dark}");
    // A quarter turn about y brings what was at +x to -z, as it does for an object, and to +z with the opposite sign.
    let (turned, back) = (from(&mut studio, "(0, 0, -4)", 90.0), from(&mut studio, "(0, 0, 4)", -90.0));
    assert!((turned / lit - 1.0).abs() < 0.05 && (back / lit - 1.0).abs() < 0.05, "{turned} and {back} of {lit}");
}

#[test]
fn filtered_normals_of_a_sphere_are_shorter_by_a_known_factor() {
    let mut studio = ready();
    let (sigma_tr, reach, radius_mm, alpha) = (0.15, 12.0, 10.0, 0.3);
    for (length, expected) in [("Keep", None), ("Unit", Some(1.0))] {
        studio.write(
            "ball.ron",
            format!(
                "Material(version: 1, surface: (ior: 1), medium: Coefficients(sigma_a: 0.1, sigma_s: 5, g: 0),
                 filter: Neighbours(sigma_tr: {sigma_tr}, radius: {reach:?}, alpha: {alpha}, length: {length}))"
            ),
        );
        let text = |technique: &str| {
            format!(
                "mm_per_unit: 10, camera: (eye: (0, 0, 4), target: (0, 0, 0), fov_y_deg: 30),
                 lights: [Directional(direction: (-1, -1, -2), irradiance: 3, shadow: false)],
                 objects: [(mesh: Sphere(radius: 1, subdivisions: 4), material: \"ball.ron\")],
                 view: (technique: {technique}, size: (48, 36), antialias: 1)"
            )
        };
        let (opaque, filtered) = (studio.picture(&text("Opaque()")), studio.picture(&text("FilteredNormals()")));
        // On a sphere the area within a chord r is pi r², and the cosine between two normals 1 - r²/(2 R²).
        let steps = 10_000;
        let (mut sum, mut weight) = (0.0, 0.0);
        for i in 0..steps {
            let r: f64 = (i as f64 + 0.5) / steps as f64 * reach;
            let w = r * (-sigma_tr * r).exp();
            sum += w * (1.0 - r * r / (2.0 * radius_mm * radius_mm));
            weight += w;
        }
        let factor = expected.unwrap_or((alpha + sum / weight) / (alpha + 1.0));
        let most = opaque.pixels.iter().map(|p| p[0]).fold(0.0, f32::max) as f64;
        for (x, y, found) in pixels(&filtered) {
            let wanted = factor * opaque.at(x, y)[0] as f64;
            assert!((found.x - wanted).abs() < 0.01 * most, "{length}: pixel {x}, {y} is {}, not {wanted}", found.x);
        }
        assert!(expected.is_some() || factor < 0.95, "the factor {factor} can be told from 1");
    }
}

#[test]
fn a_medium_that_absorbs_nothing_is_bright_under_filtered_normals() {
    let mut studio = ready();
    studio.write("snow.ron", "Material(version: 1, surface: (ior: 1), medium: AlbedoMfp(albedo: 1, mfp: 0.01))");
    let opaque = mean(&studio.picture(&lone_sphere("snow.ron", 1.0, "Opaque()")));
    let filtered = mean(&studio.picture(&lone_sphere("snow.ron", 1.0, "FilteredNormals()")));
    assert!(filtered > 0.6 * opaque, "{filtered} of {opaque}");
}

#[test]
fn odd_scenes_have_finite_pictures() {
    let mut studio = ready();
    studio.write("clear.ron", "Material(version: 1, medium: Coefficients(sigma_a: 0, sigma_s: (1, 2, 3), g: 0.5))");
    studio.write("void.ron", "Material(version: 1, medium: Coefficients(sigma_a: 0, sigma_s: 0, g: 0))");
    let lamps = LIGHTS.join(", ");
    let sixteen: String = (0..16)
        .map(|i| format!("Point(position: ({}, 4, {}), intensity: 1),", i % 4 - 2, i / 4 - 2))
        .collect::<Vec<_>>()
        .concat();
    let ball = |material: &str| format!("(mesh: Sphere(radius: 1, subdivisions: 3), material: \"{material}\")");
    let camera = "camera: (eye: (0, 0, 5))";
    let inside = "camera: (eye: (0.1, 0.2, 0.1), target: (1, 0, 0))";
    let down = "camera: (eye: (0, 5, 0), target: (0, 0, 0), up: (0, 0, -1))";
    let view = |technique: &str, size: &str| format!("view: (technique: {technique}, size: {size}, antialias: 1)");
    for technique in ["Opaque()", "FilteredNormals()"] {
        let usual = view(technique, "(32, 24)");
        for (what, camera, lights, objects, view) in [
            ("inside", inside, lamps.as_str(), ball("clear.ron"), usual.clone()),
            ("one pixel", camera, &lamps, ball("clear.ron"), view(technique, "(1, 1)")),
            ("one row", camera, &lamps, ball("clear.ron"), view(technique, "(33, 1)")),
            ("sixteen lights", camera, &sixteen, ball("clear.ron"), usual.clone()),
            ("no lights", camera, "", ball("clear.ron"), usual.clone()),
            ("nothing", camera, "", String::new(), usual.clone()),
            ("no objects", camera, &lamps, String::new(), usual.clone()),
            ("a lamp among nothing", camera, LIGHTS[1], String::new(), usual.clone()),
            ("no absorption", camera, &lamps, ball("clear.ron"), usual.clone()),
            ("a void", camera, &lamps, ball("void.ron"), usual.clone()),
            ("straight down", down, &lamps, ball("clear.ron"), usual.clone()),
            ("a lamp inside", camera, "Point(position: (0, 0, 0))", ball("clear.ron"), usual.clone()),
            ("a lamp at the eye", camera, "Point(position: (0, 0, 5))", ball("clear.ron"), usual.clone()),
        ] {
            let text = format!("mm_per_unit: 10, {camera}, lights: [{lights}], objects: [{objects}], {view}");
            let scene = studio.scene(&text);
            // What is seen from inside a thing is dark: no way leads from its surface to an eye within.
            // A picture with a NaN is refused, and `shoot` panics.
            let (_, image) = studio.shoot(&scene, &Look::of(&scene));
            let is_dark = mean(&image) == 0.0;
            println!("{technique} {what}: mean {:.4}", mean(&image));
            assert!(image.pixels.iter().flatten().all(|v| *v >= 0.0), "{technique}, {what}: negative light");
            assert!(
                !is_dark || ["inside", "no lights", "nothing", "a lamp among nothing", "a lamp inside"].contains(&what),
                "{what}"
            );
        }
    }
}

#[test]
fn two_sessions_make_the_same_bits() {
    let shot = || {
        let mut studio = Studio::new();
        studio.write("paint.ron", PAINT);
        let text = still_life(&studio, &LIGHTS.join(", "), "FilteredNormals()");
        studio.picture(&text)
    };
    assert_eq!(shot().pixels, shot().pixels);
}

/// A texture may stand for a number by any of its channels, over any range, from either end.
#[test]
fn a_texture_is_the_number_that_its_words_make_of_it() {
    let mut studio = ready();
    studio.write_exr("map.exr", &Image::filled(4, 4, [0.9, 0.25, 0.1]));
    let mut with = |roughness: &str| {
        studio.write(
            "rough.ron",
            format!("Material(version: 1, surface: (ior: 1.5, roughness: {roughness}), medium: Opaque(albedo: 0.3))"),
        );
        studio.picture(&format!(
            "mm_per_unit: 10, camera: (eye: (0, 0, 4), target: (0, 0, 0), fov_y_deg: 40),
             lights: [Directional(direction: (-1, -1, -2), irradiance: 3)],
             objects: [(mesh: Sphere(radius: 1, subdivisions: 4), material: \"rough.ron\")], {VIEW}"
        ))
    };
    let mapped = with("Texture(image: \"map.exr\", channel: G, range: (0.2, 0.6), invert: true)");
    let (same, other) = (with("0.5"), with("0.3"));
    assert!(most_apart(&mapped, &same) < 0.01, "{}", most_apart(&mapped, &same));
    assert!(most_apart(&mapped, &other) > 0.1, "{}", most_apart(&mapped, &other));
}
