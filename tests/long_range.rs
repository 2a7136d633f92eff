//! What has to hold for light that crosses things: of the plates and balls here the right picture is known.

mod studio;

use diaphane::gpu::Shaders;
use diaphane::image::Image;
use diaphane::optics::Rgb;
use diaphane::optics::medium::Medium;
use diaphane::optics::phase::Phase;
use diaphane::optics::profile::{Model, Profile};
use diaphane::render::{self, Look};
use glam::{DVec3, dvec3};
use std::f64::consts::PI;
use std::sync::Arc;
use studio::{Studio, mean, most_apart, studio};

/// Nothing is lost at its boundary; light goes about 2 units far in it at 20 mm per unit.
const MILK: &str = "Material(version: 1, surface: (ior: 1, roughness: 0.5), medium: AlbedoMfp(albedo: (0.5, 0.9, 0.98), mfp: 1, g: 0))";

fn profiles() -> [Profile; 3] {
    let medium = Medium::albedo_mfp(dvec3(0.5, 0.9, 0.98), Rgb::ONE, Rgb::ZERO);
    Profile::of_medium(Model::PhotonBeamDiffusion, &medium, Phase::HenyeyGreenstein, 1.0)
}

fn ready() -> std::sync::MutexGuard<'static, Studio> {
    let studio = studio();
    studio.write("milk.ron", MILK);
    studio
}

fn v(v: DVec3) -> String {
    format!("({:?}, {:?}, {:?})", v.x, v.y, v.z)
}

/// The pixel in the middle.
fn middle(image: &Image) -> DVec3 {
    DVec3::from(image.at(image.width / 2, image.height / 2).map(f64::from))
}

/// A plate whose upper side is y = 0, seen from `eye`.
fn plate(eye: DVec3, size: u32, technique: &str, lights: &str, more: &str) -> String {
    format!(
        r#"mm_per_unit: 20, camera: (eye: {}, target: (0, 0, 0), up: (0, 0.1, -1), fov_y_deg: 50), lights: [{lights}],
        objects: [(name: "plate", mesh: Slab(size: (16, 16, 4), segments: (32, 32)), material: "milk.ron",
            transform: (translate: (0, -2, 0), rotate_deg: (-90, 0, 0))){more}],
        view: (technique: {technique}, size: ({size}, {size}), antialias: 1)"#,
        v(eye)
    )
}

const DOWN: &str = "Directional(direction: (0, -1, 0), irradiance: 2)";

#[test]
fn an_even_plate_shows_the_profile_s_albedo_at_any_zoom_tilt_and_resolution() {
    let mut studio = ready();
    let albedo = DVec3::from(profiles().map(|profile| profile.albedo()));
    for technique in ["ScreenSpace()", "LongRange()"] {
        // Seen at an angle, a pixel covers an ellipse, for which a disk stands: it is nearer to its middle.
        for (eye, size, bound) in [
            (dvec3(0.0, 6.0, 0.0), 24, 0.015),
            (dvec3(0.0, 6.0, 0.0), 96, 0.015),
            (dvec3(0.0, 9.0, 0.0), 47, 0.015),
            (dvec3(0.0, 18.0, 0.0), 64, 0.015),
            (dvec3(0.0, 60.0, 0.0), 64, 0.015),
            (dvec3(0.0, 5.0, 5.0), 64, 0.05),
        ] {
            let found = middle(&studio.picture(&plate(eye, size, technique, DOWN, ""))) * PI / 2.0 / albedo;
            println!("{technique} from {eye}, {size} pixels: {found:.3}");
            assert!((found - 1.0).abs().max_element() < bound, "{technique} from {eye}, {size} pixels: {found}");
        }
    }
    // The paper's brightening does not keep that.
    let text = plate(dvec3(0.0, 2.0, 0.0), 96, "ScreenSpace(brighten: Paper)", DOWN, "");
    let found = middle(&studio.picture(&text)) * PI / 2.0 / albedo;
    assert!(found.z > 1.2, "{found}");
}

#[test]
fn near_the_eye_and_off_the_picture_the_far_part_takes_over() {
    let mut studio = ready();
    let albedo = DVec3::from(profiles().map(|profile| profile.albedo()));
    for height in [1.5, 0.6] {
        let eye = dvec3(0.0, height, 0.0);
        let whole = middle(&studio.picture(&plate(eye, 48, "LongRange()", DOWN, ""))) * PI / 2.0 / albedo;
        let seen = middle(&studio.picture(&plate(eye, 48, "ScreenSpace()", DOWN, ""))) * PI / 2.0 / albedo;
        println!("from {height}: {whole:.3}, {seen:.3} of it on the screen");
        // What is left of a patch around the picture lies beside it, as disks and not as a frame.
        assert!((whole - 1.0).abs().max_element() < 0.12, "from {height}: {whole}");
        assert!(seen.z < whole.z, "from {height}: {seen}");
    }
}

#[test]
fn a_spot_of_light_spreads_as_the_profile_says() {
    let mut studio = ready();
    // Four boards leave a hole of 0.2 x 0.2 at the origin, and the eye looks in below them.
    let board = |name: &str, x: f64, z: f64, sx: f64, sz: f64| {
        format!(
            r#", (name: "{name}", mesh: Box(size: ({sx}, 0.1, {sz})), material: "milk.ron", transform: (translate: ({x}, 2.5, {z})))"#
        )
    };
    let boards = board("a", 6.1, 0.0, 12.0, 24.0)
        + &board("b", -6.1, 0.0, 12.0, 24.0)
        + &board("c", 0.0, 6.1, 0.2, 12.0)
        + &board("d", 0.0, -6.1, 0.2, 12.0);
    let eye = dvec3(0.0, 2.2, 2.0);
    // Cells that are narrower than the spot: the profile falls steeply there.
    let text = plate(eye, 128, "ScreenSpace(n_l: 16, layers: 24)", DOWN, &boards);
    let picture = studio.picture(&text);
    let forward = -eye.normalize();
    let right = forward.cross(dvec3(0.0, 0.1, -1.0)).normalize();
    let up = right.cross(forward);
    let mut sums = [(0.0, DVec3::ZERO, DVec3::ZERO); 3];
    let profiles = profiles();
    for y in 0..picture.height {
        for x in 0..picture.width {
            let at = |i: u32| ((i as f64 + 0.5) / 64.0 - 1.0) * 25f64.to_radians().tan();
            let ray = forward + at(x) * right - at(y) * up;
            let p = eye - ray * (eye.y / ray.y);
            let r = p.length();
            for (bin, (from, to)) in [(0.25, 0.35), (0.5, 0.6), (0.9, 1.0)].into_iter().enumerate() {
                if ray.y < 0.0 && (from..to).contains(&r) {
                    // The hole is as wide as light goes in the channel that absorbs most.
                    let expected = profiles.each_ref().map(|profile| {
                        let sent = |i: u32| {
                            let hole = dvec3((i % 6) as f64 - 2.5, 0.0, (i / 6) as f64 - 2.5) * 0.2 / 6.0;
                            0.04 / 36.0 * 2.0 * profile.r_d_tabulated(20.0 * p.distance(hole)) * 400.0 / PI
                        };
                        (0..36).map(sent).sum::<f64>()
                    });
                    sums[bin].0 += 1.0;
                    sums[bin].1 += DVec3::from(picture.at(x, y).map(f64::from));
                    sums[bin].2 += DVec3::from(expected);
                }
            }
        }
    }
    for (bin, (count, found, expected)) in sums.into_iter().enumerate() {
        let ratio = found / expected;
        println!("{count} pixels of ring {bin}: {ratio:.3}");
        // A cell spreads the spot over all of itself: what falls off within one is told by it and not by the profile. Light
        // of the channel that absorbs most falls by ten thousands from ring to ring.
        assert!(count > 50.0 && (ratio.z - 1.0).abs() < 0.25, "ring {bin}: {ratio}");
    }
}

/// A ball of radius 1 in even light from all sides.
fn ball(eye: DVec3, target: DVec3, mm: f64, technique: &str) -> String {
    format!(
        r#"mm_per_unit: {mm:?}, camera: (eye: {}, target: {}, fov_y_deg: 30), lights: [Environment(radiance: 1)],
        objects: [(name: "ball", mesh: Sphere(radius: 1, subdivisions: 5), material: "milk.ron")],
        view: (technique: {technique}, size: (64, 64), antialias: 1)"#,
        v(eye),
        v(target)
    )
}

#[test]
fn a_ball_in_even_light_is_evenly_bright_from_everywhere() {
    let mut studio = ready();
    for mm in [40.0, 8.0] {
        // A chord r cuts off a cap of the area pi r²: as on a plane, up to the diameter.
        let all = DVec3::from(profiles().map(|profile| profile.albedo() * profile.cdf(2.0 * mm)));
        for (eye, target, bound) in [
            (dvec3(0.0, 0.0, 2.2), DVec3::ZERO, 0.08),
            (dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 0.08),
            (dvec3(3.0, 4.0, 12.0), DVec3::ZERO, 0.08),
            // Six pixels wide: of those at the rim nothing is known.
            (dvec3(0.0, 0.0, 40.0), DVec3::ZERO, 0.13),
            // Half of it off the picture.
            (dvec3(0.0, 0.0, 4.0), dvec3(1.3, 0.0, 0.0), 0.08),
            // The eye within reach of the surface: patches fill the picture, and its rim cuts them.
            (dvec3(0.0, 0.0, 1.3), dvec3(0.0, 0.0, 1.0), 0.05),
            (dvec3(0.0, 0.0, 1.1), dvec3(0.3, 0.0, 1.0), 0.12),
            (dvec3(0.0, 0.0, 1.02), dvec3(0.3, 0.0, 1.0), 0.25),
        ] {
            let picture = studio.scattered(&ball(eye, target, mm, "LongRange()"));
            let lit: Vec<DVec3> =
                picture.pixels.iter().map(|p| DVec3::from(p.map(f64::from))).filter(|p| p.z > 0.0).collect();
            let mean = lit.iter().sum::<DVec3>() / lit.len() as f64 / all;
            let spread = lit.iter().map(|p| (*p / all - mean).abs()).sum::<DVec3>() / lit.len() as f64;
            println!("{mm} mm, from {eye}: {mean:.3} ± {spread:.3} of {} pixels", lit.len());
            // At the rim, where pixels are ellipses, it is brighter.
            assert!((mean - 1.0).abs().max_element() < bound, "{mm} mm from {eye}: {mean}");
            assert!(spread.max_element() < 0.12f64.max(bound), "{mm} mm from {eye}: {spread}");
        }
    }
    // The screen alone lacks the far side.
    let picture = studio.scattered(&ball(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 1.0, "ScreenSpace()"));
    let both = studio.scattered(&ball(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 1.0, "LongRange()"));
    println!("{} of {}", mean(&picture), mean(&both));
    assert!(mean(&picture) < 0.8 * mean(&both));
}

#[test]
fn splitting_triangles_changes_nothing() {
    let mut studio = ready();
    let mut bar = |segments: &str| {
        studio.picture(&format!(
            r#"mm_per_unit: 6, camera: (eye: (1, 1.5, 6), target: (0, 0, 0), fov_y_deg: 30),
            lights: [Directional(direction: (0.3, -0.2, 1), irradiance: 5)],
            objects: [(name: "bar", mesh: Slab(size: (2, 2, 0.6), segments: {segments}), material: "milk.ron")],
            view: (technique: LongRange(), size: (64, 64), antialias: 1)"#
        ))
    };
    let (coarse, middling, fine) = (bar("(1, 1)"), bar("(7, 3)"), bar("(40, 40)"));
    for other in [&middling, &fine] {
        let ratio = mean(other) / mean(&coarse);
        println!("{ratio}, most {}", most_apart(&coarse, other) / mean(&coarse));
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    }
}

#[test]
fn as_many_patches_as_there_may_be_lose_no_light() {
    let mut studio = ready();
    // From behind, so that all light crosses the plate: more splats than some devices allow turns of a loop.
    let mut plate = |splats: u32| {
        studio.picture(&format!(
            r#"mm_per_unit: 6, camera: (eye: (0, 0, 6), target: (0, 0, 0), fov_y_deg: 30),
            lights: [Directional(direction: (0, 0, 1), irradiance: 5)],
            objects: [(name: "plate", mesh: Slab(size: (2, 2, 0.6), segments: (100, 100)), material: "milk.ron")],
            view: (technique: LongRange(splats: {splats}), size: (24, 24), antialias: 1)"#
        ))
    };
    let ratio = mean(&plate(100_000)) / mean(&plate(2000));
    println!("{ratio}");
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

#[test]
fn what_touches_does_not_bleed() {
    let mut studio = ready();
    studio.write("red.ron", MILK.replace("(0.5, 0.9, 0.98)", "(0.9, 0.1, 0.1)"));
    studio.write("blue.ron", MILK.replace("(0.5, 0.9, 0.98)", "(0.1, 0.1, 0.9)"));
    for technique in ["ScreenSpace()", "LongRange()"] {
        let mut pair = |material: &str| {
            studio.picture(&format!(
                r#"mm_per_unit: 6, camera: (eye: (0, 2, 6), target: (0, 0, 0), fov_y_deg: 30),
                lights: [Directional(direction: (-0.3, -1, -1), irradiance: 5, shadow: false)],
                objects: [(name: "a", mesh: Box(size: (1, 1, 1)), material: "milk.ron", transform: (translate: (-0.5, 0, 0))),
                    (name: "b", mesh: Box(size: (1, 1, 1)), material: "{material}", transform: (translate: (0.5, 0, 0)))],
                view: (technique: {technique}, size: (64, 64), antialias: 1)"#
            ))
        };
        let (red, blue) = (pair("red.ron"), pair("blue.ron"));
        // All that differs is the right half, the touching pixel column aside.
        let differs = |x: u32| (0..red.height).filter(|&y| red.at(x, y) != blue.at(x, y)).count();
        assert_eq!((0..31).map(differs).sum::<usize>(), 0, "{technique}");
        assert!(differs(40) > 5);
    }
}

fn twisting(time: f64) -> String {
    format!(
        r#"mm_per_unit: 6, camera: (eye: (1, 1.5, 6), target: (0, 0, 0), fov_y_deg: 30),
        lights: [Directional(direction: (0.3, -0.2, 1), irradiance: 5)],
        objects: [(name: "bar", mesh: Slab(size: (1, 2, 0.6), segments: (10, 20)), material: "milk.ron",
            deform: [Twist(deg_per_unit: 60, speed_hz: 0.25)])],
        view: (technique: LongRange(), size: (48, 48), antialias: 1, time_s: {time:?})"#
    )
}

#[test]
fn deforming_bakes_nothing_and_there_and_back_is_the_same() {
    let mut studio = ready();
    let first = studio.picture(&twisting(0.4));
    let other = studio.picture(&twisting(0.9));
    studio.picture(&twisting(0.1));
    assert_eq!(first.pixels, Studio::picture(&mut studio, &twisting(0.4)).pixels);
    assert!(most_apart(&first, &other) > 0.05 * mean(&first));
    let bakes = |studio: &Studio, time: f64| {
        let scene = studio.scene(&twisting(time));
        let (plan, _) = render::plan(&scene, &Look::of(&scene), &Shaders::new(None, Arc::default())).unwrap();
        plan.steps().iter().filter(|step| step.is_bake()).map(|step| step.key).collect::<Vec<_>>()
    };
    assert_eq!(bakes(&studio, 0.4), bakes(&studio, 0.9));
    // A session that remembers nothing makes the same bits.
    let fresh = Studio::new();
    fresh.write("milk.ron", MILK);
    let mut fresh = fresh;
    assert_eq!(first.pixels, fresh.picture(&twisting(0.4)).pixels);
}

#[test]
fn light_of_many_lamps_adds_up() {
    let mut studio = ready();
    let lamps: Vec<String> = (0..16)
        .map(|i| {
            let turn = i as f64 / 16.0 * 2.0 * PI;
            let (x, z) = (3.0 * turn.cos(), 3.0 * turn.sin());
            format!("Point(position: ({x:?}, {:?}, {z:?}), intensity: ({}, 2, 1))", 1.0 + 0.1 * i as f64, i % 3)
        })
        .collect();
    let mut lit = |lights: &str| {
        studio.picture(&format!(
            r#"mm_per_unit: 6, camera: (eye: (1, 1.5, 6), target: (0, 0, 0), fov_y_deg: 30), lights: [{lights}],
            objects: [(name: "knot", mesh: TorusKnot(p: 2, q: 3, radius: 0.8, tube: 0.3, segments: (80, 16)), material: "milk.ron")],
            view: (technique: LongRange(), size: (32, 32), antialias: 1)"#
        ))
    };
    let all = lit(&lamps.join(", "));
    let (left, right) = (lit(&lamps[..7].join(", ")), lit(&lamps[7..].join(", ")));
    let brightest = all.pixels.iter().flatten().fold(0.0f32, |most, v| most.max(*v)) as f64;
    let sum = Image {
        pixels: left.pixels.iter().zip(&right.pixels).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c])).collect(),
        ..(*left).clone()
    };
    assert!(most_apart(&all, &sum) < 1e-3 * brightest, "{} of {brightest}", most_apart(&all, &sum));
}
