//! The second integrator against quadrature of the profile itself.

use super::*;
use crate::optics::profile::{Model, Profile};
use crate::scene::Reader;
use crate::store::{Files, Store};

const MODELS: [Model; 3] = [Model::PhotonBeamDiffusion, Model::BetterDipole, Model::NormalizedDiffusion];

fn medium(sigma_t: Rgb, albedo: Rgb) -> medium::Medium {
    medium::Medium::extinction(sigma_t, albedo, Rgb::ZERO)
}

fn separable(model: Model, ior: f64, medium: medium::Medium) -> Matter {
    let bssrdf = Bssrdf::new(model, medium, Phase::HenyeyGreenstein, ior);
    Matter::Bssrdf { surface: surface(ior, 0.0), bssrdf: Box::new(bssrdf) }
}

fn profiles(model: Model, ior: f64, medium: &medium::Medium) -> [Profile; 3] {
    Profile::of_medium(model, medium, Phase::HenyeyGreenstein, ior)
}

fn slab() -> Mesh {
    shapes::slab(DVec3::new(40.0, 20.0, 40.0), (1, 1))
}

#[test]
fn under_an_even_sky_a_plane_sends_back_its_profiles_albedo() {
    let medium = medium(Rgb::new(8.0, 10.0, 15.0), Rgb::new(0.5, 0.9, 0.97));
    for (model, ior) in MODELS.into_iter().zip([1.33, 1.5, 1.0]) {
        let tracer = tracer(vec![(slab(), separable(model, ior, medium))], Vec::new(), Some(1.0), Light::Full, 8);
        for cos in [1.0f64, 0.4] {
            let d = DVec3::new((1.0 - cos * cos).sqrt(), -cos, 0.0);
            let eye = |_: &mut Random| (DVec3::new(0.1, 10.0, 0.2) - 5.0 * d, d);
            let albedo = Rgb::from_array(profiles(model, ior, &medium).map(|profile| profile.albedo()));
            let measured = measure(&tracer, 90_000, eye, |p| p.scattered);
            agree(&format!("{model:?} cos {cos}"), measured, (1.0 - fresnel_dielectric(cos, ior)) * albedo);
            let (glossy, _) = measure(&tracer, 64, eye, |p| p.glossy);
            assert!((glossy - fresnel_dielectric(cos, ior)).abs().max_element() < 1e-9, "{glossy}");
            let (unscattered, _) = measure(&tracer, 64, eye, |p| p.unscattered);
            assert_eq!(unscattered, Rgb::ZERO);
        }
    }
}

/// What is drawn against a sum over the whole surface, where it is curved, behind, and beside itself.
#[test]
fn entries_are_found_wherever_they_are() {
    let medium = medium(Rgb::new(2.0, 5.0, 20.0), Rgb::new(0.99, 0.9, 0.8));
    let model = Model::BetterDipole;
    let matter = separable(model, 1.3, medium);
    let Matter::Bssrdf { bssrdf, .. } = &matter else { unreachable!() };
    let profiles = profiles(model, 1.3, &medium);
    for mesh in [shapes::sphere(0.8, 4), shapes::torus_knot(2, 3, 0.5, 0.15, (96, 12))] {
        // Another thing around it, which is not to be found.
        let things = vec![(mesh, matter.clone()), (shapes::sphere(1.0, 2), matter.clone())];
        let world = tracer(things, Vec::new(), None, Light::Direct, 1).world;
        let mut exit = world.along(0, DVec3::new(0.4, 0.05, 0.1), DVec3::new(0.2, 0.1, 1.0).normalize())[0];
        // As interpolated normals are: not that of the triangle.
        exit.normal = (exit.normal + DVec3::new(0.1, 0.2, 0.0)).normalize();
        let light = |p: DVec3| 1.0 + 0.8 * p.x + 0.5 * p.y;
        let mut expected = Rgb::ZERO;
        let mesh = &world.things[0].mesh;
        let n = 6;
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(triangle);
            let area = 0.5 * (b - a).cross(c - a).length() / (n * n) as f64;
            for (i, j) in (0..n).flat_map(|i| (0..2 * (n - i) - 1).map(move |j| (i, j))) {
                // Upright triangles and, between them, those that stand on their heads.
                let third = if j % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
                let (u, v) = ((i as f64 + third) / n as f64, ((j / 2) as f64 + third) / n as f64);
                let p = a + u * (b - a) + v * (c - a);
                let r_d = profiles.each_ref().map(|profile| profile.r_d(p.distance(exit.p)));
                expected += area * light(p) * Rgb::from_array(r_d);
            }
        }
        let samples = 200_000;
        let (mut sum, mut squares) = (Rgb::ZERO, Rgb::ZERO);
        let mut random = Random::new(5, 5, 5);
        for _ in 0..samples {
            let value = bssrdf.entry(&world, &exit, 0.3, &mut random).map_or(Rgb::ZERO, |entry| {
                assert_eq!(entry.point.thing(), 0);
                let weight = entry.weight / bssrdf.density(&exit, &entry.point, world.balls[0]);
                weight * light(entry.point.p) * bssrdf.r_d(&exit, &entry.point)
            });
            (sum, squares) = (sum + value, squares + value * value);
        }
        let mean = sum / samples as f64;
        agree("entries", (mean, ((squares / samples as f64 - mean * mean) / samples as f64).sqrt()), expected);
    }
}

#[test]
fn a_near_lamp_lights_a_plane_by_its_profile() {
    let medium = medium(Rgb::new(2.0, 4.0, 8.0), Rgb::new(0.99, 0.9, 0.7));
    let (height, far) = (0.6, 0.5);
    for (model, ior) in MODELS.into_iter().zip([1.3, 1.0, 1.5]) {
        let position = DVec3::new(far, 10.0 + height, 0.0);
        let lamp = Lamp { kind: Kind::Point { position, intensity: Rgb::ONE }, shadow: true };
        let tracer = tracer(vec![(slab(), separable(model, ior, medium))], vec![lamp], None, Light::Full, 8);
        let down = |_: &mut Random| (DVec3::new(0.0, 10.3, 0.0), DVec3::NEG_Y);
        let profiles = profiles(model, ior, &medium);
        // ∫ R E dA around the point that is seen, by steps of ln r.
        let (steps, turns) = (400, 64);
        let (first, last) = (1e-6f64.ln(), 10.0f64.ln());
        let step = (last - first) / steps as f64;
        let mut expected = Rgb::ZERO;
        for i in 0..steps {
            let r = (first + (i as f64 + 0.5) * step).exp();
            let entered: f64 = (0..turns)
                .map(|turn| {
                    let (sin, cos) = (2.0 * PI * (turn as f64 + 0.5) / turns as f64).sin_cos();
                    let square = (r * cos - far).powi(2) + (r * sin).powi(2) + height * height;
                    let mu = height / square.sqrt();
                    (1.0 - fresnel_dielectric(mu, ior)) * mu / square
                })
                .sum();
            let r_d = Rgb::from_array(profiles.each_ref().map(|profile| profile.r_d(r)));
            expected += r_d * entered * r * r * step * 2.0 * PI / turns as f64;
        }
        let c = crate::optics::fresnel::diffuse_transmittance(ior);
        expected *= (1.0 - fresnel_dielectric(1.0, ior)) / (c * PI);
        agree(&format!("{model:?}"), measure(&tracer, 400_000, down, |p| p.scattered), expected);
    }
}

/// Between plates, each entry sends on the plate's albedo; a lamp without shadow lights the lower one alone.
#[test]
fn light_enters_again_as_often_as_it_may() {
    let medium = medium(Rgb::splat(100.0), Rgb::new(0.9, 0.97, 0.99));
    let model = Model::BetterDipole;
    let matter = separable(model, 1.0, medium);
    let mut lid = shapes::slab(DVec3::new(40.0, 1.0, 40.0), (1, 1));
    lid.positions.iter_mut().for_each(|p| p.y += 10.7);
    let albedo = Rgb::from_array(profiles(model, 1.0, &medium).map(|profile| profile.albedo()));
    let down = |_: &mut Random| (DVec3::new(0.1, 10.1, 0.2), DVec3::NEG_Y);
    for (max_depth, expected) in
        [(1, albedo), (2, albedo), (3, albedo * (1.0 + albedo * albedo)), (1000, albedo / (1.0 - albedo * albedo))]
    {
        let things = vec![(slab(), matter.clone()), (lid.clone(), matter.clone())];
        let lamp = Lamp { shadow: false, ..sun(DVec3::NEG_Y) };
        let mut tracer = tracer(things, vec![lamp], None, Light::Full, max_depth);
        let measured = measure(&tracer, 120_000, down, |p| p.scattered);
        agree(&format!("{max_depth} entries"), measured, expected / PI);
        tracer.light = Light::Direct;
        let measured = measure(&tracer, 120_000, down, |p| p.scattered);
        agree("direct light", measured, albedo / PI);
    }
}

#[test]
fn what_is_dense_and_white_is_white_paint() {
    let matter = separable(Model::BetterDipole, 1.5, medium(Rgb::splat(1e5), Rgb::ONE));
    let tracer = tracer(corner(&matter), Vec::new(), Some(1.0), Light::Full, 1000);
    agree("a corner", measure(&tracer, 160_000, at_corner, total), Rgb::ONE);
}

/// A knot in sun and sky, whose sizes are multiplied by `size` and whose units are divided by it.
fn picture(size: f64, integrator: Integrator, threads: usize) -> (crate::store::Key, Film) {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let (eye, radius, tube) = (5.0 * size, size, 0.3 * size);
    let text = format!(
        r#"Scene(version: 1, mm_per_unit: {:?}, camera: (eye: (0, 0, {eye:?}), fov_y_deg: 36),
        lights: [Directional(direction: (-1, -1, -1)), Environment(radiance: 1)],
        objects: [(mesh: TorusKnot(radius: {radius:?}, tube: {tube:?}, segments: (64, 12)), material: "marble.ron")])"#,
        2.0 / size
    );
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).expect("a file can be written");
    let marble = r#"Material(version: 1, medium: Preset("marble"))"#;
    std::fs::write(folder.path().join("marble.ron"), marble).expect("a file can be written");
    let (scene, _) = Reader::new(Arc::new(Files::default())).scene(&path, &[]).expect("the scene is valid");
    let settings = Settings {
        integrator,
        light: Light::Full,
        camera: scene.camera,
        size: (16, 12),
        time_s: 0.0,
        max_depth: 16,
        seed: 3,
        bands: (0, 1),
    };
    let mut plan = Plan::default();
    let slot = super::plan(&mut plan, &scene, &settings, 8);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be had");
    let film = pool.install(|| Store::in_memory().get(&plan, slot).expect("paths end"));
    (slot.key(), film.as_ref().clone())
}

#[test]
fn threads_and_units_do_not_matter_and_integrators_do() {
    let (key, film) = picture(1.0, Integrator::Bssrdf, 1);
    let part = crate::scene::Part::Scattered;
    assert!(film.picture(part).pixels.iter().flatten().any(|value| *value > 0.1));
    assert_eq!(picture(1.0, Integrator::Bssrdf, 2), (key, film.clone()));
    // Powers of two are exact.
    let (_, other) = picture(4.0, Integrator::Bssrdf, 2);
    assert_eq!(other, film);
    let (volume_key, volume) = picture(1.0, Integrator::Volume, 2);
    assert!(volume_key != key && volume != film);
}
