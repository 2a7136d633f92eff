//! The integrator against closed forms.

use super::*;
use crate::geometry::shapes;
use crate::optics::fresnel::{fresnel_dielectric, refracted_cosine};
use crate::optics::half_space::HalfSpace;
use crate::scene::Varying;
use glam::DMat3;
use std::f64::consts::PI;
use std::sync::Arc;

fn surface(ior: f64, roughness: f64) -> Boundary {
    Boundary { ior, roughness: Varying::Constant(roughness), color: Varying::Constant(Rgb::ONE) }
}

fn translucent(ior: f64, roughness: f64, sigma_a: Rgb, sigma_s: Rgb, g: f64) -> Matter {
    let medium = Medium { sigma_a, sigma_s, phase: Phase::HenyeyGreenstein, parameter: Rgb::splat(g) };
    Matter::Translucent { surface: surface(ior, roughness), medium, layers: None }
}

fn tracer(things: Vec<(Mesh, Matter)>, lamps: Vec<Lamp>, sky: Option<f64>, light: Light, max_depth: u32) -> Tracer {
    let thing = |(mesh, matter)| Thing {
        mesh: Arc::new(mesh),
        world_from_object: DAffine3::IDENTITY,
        turn: DMat3::IDENTITY,
        matter,
    };
    let world = World::new(things.into_iter().map(thing).collect());
    let beams = |(i, lamp): (usize, &Lamp)| {
        let kind = lamp.kind.clone();
        let world = &world;
        (0..world.things.len()).filter_map(move |thing| Refracted::new(world, i, &kind, thing)).collect::<Vec<_>>()
    };
    let refracted = lamps.iter().enumerate().flat_map(beams).collect();
    let sky = sky.map(|radiance| light::Sky { scale: Rgb::splat(radiance), image: None, shadow: true });
    Tracer { world, lamps, sky, refracted, light, max_depth, single: false, joins: true, field: None, kin: false }
}

/// A square light at a height, of a half-edge, that shines down; and its mesh.
fn light_above(height: f64, half: f64) -> (Kind, Mesh) {
    // cross(x, z) = -y.
    let (u, v) = (half * DVec3::X, half * DVec3::Z);
    let corners = [-u - v, u - v, u + v, v - u];
    let mesh = Mesh {
        positions: corners.map(|p| (height * DVec3::Y + p).as_vec3()).to_vec(),
        normals: vec![glam::Vec3::NEG_Y; 4],
        uvs: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    (Kind::Rect { center: height * DVec3::Y, u, v, radiance: Rgb::ONE }, mesh)
}

fn sun(direction: DVec3) -> Lamp {
    Lamp { kind: Kind::Directional { direction: direction.normalize(), irradiance: Rgb::ONE }, shadow: true }
}

/// Mean and standard error of what `part` says of many paths along rays that `ray` makes.
fn measure(
    tracer: &Tracer,
    paths: u64,
    ray: impl Fn(&mut Random) -> (DVec3, DVec3) + Sync,
    part: impl Fn(&path::Parts) -> Rgb + Sync,
) -> (Rgb, Rgb) {
    let sums: Vec<(Rgb, Rgb)> = (0..64u64)
        .into_par_iter()
        .map(|batch| {
            let (mut sum, mut squares) = (Rgb::ZERO, Rgb::ZERO);
            for i in 0..paths / 64 {
                let mut random = Random::new(9, batch, i);
                let (origin, direction) = ray(&mut random);
                let mut strand = [tracer.trace(origin, direction, Inside::default(), &mut random)];
                tracer.settle(&mut strand);
                let value = part(&strand[0].parts);
                sum += value;
                squares += value * value;
            }
            (sum, squares)
        })
        .collect();
    let n = (paths / 64 * 64) as f64;
    let sum: Rgb = sums.iter().map(|(sum, _)| *sum).sum();
    let squares: Rgb = sums.iter().map(|(_, squares)| *squares).sum();
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(Rgb::ZERO) / n).sqrt())
}

/// The mean of what blocks of kin bring, and its standard error; a block counts as one sample.
fn over_blocks(blocks: u64, block: impl Fn(u64) -> Rgb + Sync + Send) -> (Rgb, Rgb) {
    let values: Vec<Rgb> = (0..blocks).into_par_iter().map(block).collect();
    let n = blocks as f64;
    let mean = values.iter().sum::<Rgb>() / n;
    let squares = values.iter().map(|value| (*value - mean) * (*value - mean)).sum::<Rgb>();
    (mean, (squares / (n * (n - 1.0))).sqrt())
}

/// Every channel within 4 standard errors, which must be small enough in one of them to notice a bias of 2 %.
fn agree(what: &str, (mean, error): (Rgb, Rgb), expected: Rgb) {
    let error = error.max(1e-9 * expected);
    let z = (mean - expected) / error;
    assert!(z.abs().max_element() < 4.0, "{what}: {mean} +- {error}, expected {expected}, z {z}");
    let biased = (mean - 1.02 * expected) / error;
    assert!(
        biased.abs().max_element() > 4.0,
        "{what}: {mean} +- {error}, expected {expected}, would hide a bias of 2 %"
    );
}

fn total(parts: &path::Parts) -> Rgb {
    parts.scattered + parts.glossy + parts.unscattered
}

/// Rays from all around at a thing within the unit sphere.
fn from_around(random: &mut Random) -> (DVec3, DVec3) {
    let mut direction = || {
        let (z, phi) = (2.0 * random.unit() - 1.0, 2.0 * PI * random.unit());
        let ring = ((1.0 - z) * (1.0 + z)).sqrt();
        DVec3::new(ring * phi.cos(), ring * phi.sin(), z)
    };
    let (eye, target) = (3.0 * direction(), 0.5 * direction());
    (eye, (target - eye).normalize())
}

#[test]
fn nothing_is_lost_in_a_white_furnace() {
    let knot = || shapes::torus_knot(2, 3, 0.5, 0.2, (96, 12));
    let colored = Rgb::new(3.0, 5.0, 8.0);
    for (ior, sigma_s, g, paths) in [
        (1.0, Rgb::splat(4.0), 0.0, 6_000),
        (1.0, colored, 0.0, 30_000),
        (1.3, Rgb::splat(4.0), 0.6, 6_000),
        (1.5, Rgb::splat(8.0), -0.4, 6_000),
        (1.5, colored, 0.3, 50_000),
    ] {
        let matter = translucent(ior, 0.0, Rgb::ZERO, sigma_s, g);
        for light in [Light::Direct, Light::Full] {
            // A sphere keeps what it sends out to itself; a knot sends some of it back in, which only full light counts.
            let mesh = if light == Light::Direct { shapes::sphere(0.8, 3) } else { knot() };
            let tracer = tracer(vec![(mesh, matter.clone())], Vec::new(), Some(1.0), light, 100_000);
            agree(&format!("ior {ior} {light:?}"), measure(&tracer, paths, from_around, total), Rgb::ONE);
        }
    }
}

#[test]
fn a_half_space_sends_back_its_albedo() {
    for ior in [1.0, 1.33, 1.5] {
        let albedo = Rgb::new(0.5, 0.9, 0.97);
        let matter = translucent(ior, 0.0, 10.0 * (1.0 - albedo), 10.0 * albedo, 0.0);
        let slab = shapes::slab(DVec3::new(40.0, 20.0, 40.0), (1, 1));
        let mut tracer = tracer(vec![(slab, matter)], Vec::new(), Some(1.0), Light::Direct, 100_000);
        // A path that is its own only kin.
        tracer.kin = true;
        // The sky is even, so light that enters everywhere and leaves towards the eye is, by reciprocity, light that
        // enters along the ray and leaves anywhere.
        let down = |_: &mut Random| (DVec3::new(0.1, 15.0, 0.2), DVec3::NEG_Y);
        let expected = albedo.map(|albedo| HalfSpace::new(ior).albedo_normal(1.0 - albedo));
        let entered = 1.0 - fresnel_dielectric(1.0, ior);
        agree(&format!("ior {ior}"), measure(&tracer, 60_000, down, |p| p.scattered), entered * expected);
    }
}

/// Chandrasekhar's single scattering of a half space, below a refracting plane.
#[test]
fn a_lamp_is_seen_through_a_smooth_boundary() {
    for (ior, tilt) in [(1.0, 0.6f64), (1.3, 0.6), (1.5, 1.2)] {
        let (albedo, sigma_t) = (0.8, 10.0);
        let matter = translucent(ior, 0.0, Rgb::splat(sigma_t * (1.0 - albedo)), Rgb::splat(sigma_t * albedo), 0.3);
        let slab = || shapes::slab(DVec3::new(40.0, 20.0, 40.0), (2, 2));
        let direction = DVec3::new(tilt.sin(), -tilt.cos(), 0.0);
        let far = 1e4;
        let point = Lamp {
            kind: Kind::Point { position: -far * direction + 10.0 * DVec3::Y, intensity: Rgb::splat(far * far) },
            shadow: true,
        };
        let (mu_i, mu_o) = (refracted_cosine(tilt.cos(), ior).unwrap(), 1.0);
        let entered = (1.0 - fresnel_dielectric(tilt.cos(), ior)) * tilt.cos() / mu_i;
        // Inside, the light travels down at mu_i and the eye's path straight down: the phase angle is between the two.
        let phase = Phase::HenyeyGreenstein.value(mu_i, 0.3);
        let inside = albedo * phase * entered * mu_i / (mu_i + mu_o);
        let expected = inside * (1.0 - fresnel_dielectric(1.0, ior)) / (ior * ior);
        for lamp in [sun(direction), point] {
            // Two events: into the medium, and the first particle.
            let tracer = tracer(vec![(slab(), matter.clone())], vec![lamp], None, Light::Direct, 2);
            let down = |_: &mut Random| (DVec3::new(0.1, 15.0, 0.2), DVec3::NEG_Y);
            let measured = measure(&tracer, 60_000, down, |p| p.scattered);
            agree(&format!("ior {ior}, tilt {tilt}"), measured, Rgb::splat(expected));
        }
    }
}

/// A lamp found by its beams against a small, far area light that paths must find by themselves; on a curved boundary.
#[test]
fn beams_agree_with_paths_on_a_curved_boundary() {
    for (roughness, by_beam, by_path) in [(0.0, 12_000, 650_000), (0.2, 40_000, 1_050_000), (0.45, 40_000, 450_000)] {
        let matter = translucent(1.4, roughness, Rgb::new(0.5, 1.0, 2.0), Rgb::splat(2.0), 0.0);
        let direction = DVec3::new(-0.3, -1.0, -0.5).normalize();
        let (x, y) = direction.any_orthonormal_pair();
        let (distance, half) = (60.0, 6.0);
        let radiance = Rgb::splat(distance * distance / (4.0 * half * half));
        let (u, v) = if x.cross(y).dot(direction) > 0.0 { (half * x, half * y) } else { (half * y, half * x) };
        let center = -distance * direction;
        let lamp = Lamp { kind: Kind::Rect { center, u, v, radiance }, shadow: false };
        let body = || (shapes::sphere(1.0, 4), matter.clone());
        let by_beams = tracer(vec![body()], vec![sun(direction)], None, Light::Direct, 1000);
        let by_paths = tracer(vec![body()], vec![lamp], None, Light::Direct, 1000);
        let eye = |random: &mut Random| {
            let (a, b) = random.pair();
            (DVec3::new(0.9 * (a - 0.5), 0.9 * (b - 0.5), 5.0), DVec3::NEG_Z)
        };
        let (a, a_error) = measure(&by_beams, by_beam, eye, |p| p.scattered);
        let (b, b_error) = measure(&by_paths, by_path, eye, |p| p.scattered);
        let z = (a - b) / (a_error * a_error + b_error * b_error).sqrt();
        let what = format!("roughness {roughness}: {a} +- {a_error}, {b} +- {b_error}, z {z}");
        println!("{what}");
        assert!(z.abs().max_element() < 4.0, "{what}");
        assert!((b_error / b).min_element() < 0.02, "{what} proves too little");
    }
}

#[test]
fn opaque_things_are_lambertian() {
    let floor = Matter::Opaque { surface: surface(1.0, 0.0), albedo: Rgb::new(0.2, 0.5, 0.8) };
    let slab = shapes::slab(DVec3::new(4.0, 1.0, 4.0), (1, 1));
    let direction = DVec3::new(0.6, -0.8, 0.0);
    let lit = tracer(vec![(slab.clone(), floor.clone())], vec![sun(direction)], None, Light::Full, 8);
    let down = |_: &mut Random| (DVec3::new(0.1, 15.0, 0.2), DVec3::NEG_Y);
    agree("a lamp", measure(&lit, 640, down, total), Rgb::new(0.2, 0.5, 0.8) * 0.8 / PI);
    let lit = tracer(vec![(slab, floor)], Vec::new(), Some(2.0), Light::Full, 8);
    agree("the sky", measure(&lit, 640, down, total), 2.0 * Rgb::new(0.2, 0.5, 0.8));
}

/// Rough and smooth boundaries of index 1 are no boundaries; an area light and the sky are found by both ways of looking.
#[test]
fn ways_of_finding_light_share_it_out() {
    let matter = |ior: f64, roughness: f64| translucent(ior, roughness, Rgb::splat(0.5), Rgb::splat(3.0), 0.5);
    let (rect, quad) = light_above(4.0, 2.0);
    let lamp = Lamp { kind: rect, shadow: true };
    let eye = |random: &mut Random| {
        let (a, b) = random.pair();
        (DVec3::new(a - 0.5, b, 5.0), DVec3::NEG_Z)
    };
    for (ior, roughness) in [(1.0, 0.0), (1.4, 0.5), (1.4, 0.0)] {
        let things = || vec![(shapes::sphere(1.0, 3), matter(ior, roughness)), (quad.clone(), Matter::Emitter(0))];
        let joined = tracer(things(), vec![lamp.clone()], None, Light::Direct, 1000);
        let mut alone = tracer(things(), vec![lamp.clone()], None, Light::Direct, 1000);
        alone.joins = false;
        let (a, a_error) = measure(&joined, 60_000, eye, |p| p.scattered);
        let (b, b_error) = measure(&alone, 300_000, eye, |p| p.scattered);
        let z = (a - b) / (a_error * a_error + b_error * b_error).sqrt();
        assert!(z.abs().max_element() < 4.0, "ior {ior}: {a} +- {a_error}, {b} +- {b_error}, z {z}");
        assert!((b_error / b).max_element() < 0.02, "ior {ior}: {b} +- {b_error} proves too little");
    }
}

/// A floor under an area light, with a thing in between that can only be told by its mesh.
#[test]
fn what_is_clear_and_index_matched_takes_no_light() {
    let floor = || {
        let white = Matter::Opaque { surface: surface(1.0, 0.0), albedo: Rgb::splat(0.8) };
        (shapes::slab(DVec3::new(4.0, 1.0, 4.0), (1, 1)), white)
    };
    let clear = || {
        let mut mesh = shapes::slab(DVec3::new(8.0, 0.5, 8.0), (1, 1));
        mesh.positions.iter_mut().for_each(|p| p.y += 2.0);
        (mesh, translucent(1.0, 0.0, Rgb::ZERO, Rgb::ZERO, 0.0))
    };
    let (rect, quad) = light_above(4.0, 2.0);
    let lamp = || vec![Lamp { kind: rect.clone(), shadow: true }];
    let lit = |things| {
        let tracer = tracer(things, lamp(), None, Light::Full, 100);
        let eye = |_: &mut Random| (DVec3::new(3.0, 0.9, 0.0), DVec3::new(-2.5, -0.4, 0.2).normalize());
        measure(&tracer, 240_000, eye, |p| p.scattered)
    };
    let lamp_alone = lit(vec![floor(), (quad.clone(), Matter::Emitter(0))]);
    let behind = lit(vec![floor(), (quad, Matter::Emitter(0)), clear()]);
    layers::agree_both("behind what is clear", behind, lamp_alone);
}

/// A floor and a wall: what one sends out, the other takes in.
fn corner(matter: &Matter) -> Vec<(Mesh, Matter)> {
    let floor = shapes::slab(DVec3::new(4.0, 1.0, 4.0), (1, 1));
    let mut wall = shapes::slab(DVec3::new(1.0, 2.0, 4.0), (1, 1));
    wall.positions.iter_mut().for_each(|p| *p += glam::Vec3::new(-1.0, 1.5, 0.0));
    vec![(floor, matter.clone()), (wall, matter.clone())]
}

/// Into the corner.
fn at_corner(random: &mut Random) -> (DVec3, DVec3) {
    let (a, b) = random.pair();
    let target = DVec3::new(0.5 * a - 0.5, 0.5, b - 0.5);
    let eye = DVec3::new(3.0, 4.0, 0.5);
    (eye, (target - eye).normalize())
}

#[test]
fn nothing_is_lost_between_white_surfaces() {
    for (ior, roughness) in [(1.0, 0.0), (1.5, 0.0), (3.0, 0.1)] {
        let white = Matter::Opaque { surface: surface(ior, roughness), albedo: Rgb::ONE };
        let tracer = tracer(corner(&white), Vec::new(), Some(1.0), Light::Full, 1000);
        agree(&format!("ior {ior}"), measure(&tracer, 20_000, at_corner, total), Rgb::ONE);
    }
}

mod bssrdf;
mod kin;
mod layers;
mod light_paths;
mod single;
