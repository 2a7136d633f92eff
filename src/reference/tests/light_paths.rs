//! Paths from the eye that meet paths from lamps, against paths that find lamps by themselves.

use super::*;
use light_paths::Field;

/// The mean over all paths of some blocks of kin, each with light paths of its own, and its standard error.
fn measure_met(tracer: &Tracer, blocks: u64, ray: impl Fn(&mut Random) -> (DVec3, DVec3) + Sync) -> (Rgb, Rgb) {
    let block = |block: u64| {
        let path = |path| {
            let mut random = Random::new(3, block, path);
            let (origin, direction) = ray(&mut random);
            tracer.trace(origin, direction, Inside::default(), &mut random)
        };
        let mut strands: Vec<Strand> = (0..16).map(path).collect();
        tracer.settle(&mut strands);
        let lit = tracer.light_paths(4, block).expect("light paths are of help here");
        tracer.meet_light(&mut strands, &lit, &mut Random::new(5, block, 0));
        strands.iter().map(|strand| strand.parts.scattered).sum::<Rgb>() / strands.len() as f64
    };
    over_blocks(blocks, block)
}

fn agree_with_plain(what: &str, mut tracer: Tracer, blocks: u64, ray: impl Fn(&mut Random) -> (DVec3, DVec3) + Sync) {
    tracer.kin = true;
    tracer.field = Some(Field::new(&tracer, 128).expect("light paths are of help here"));
    let (a, a_error) = measure_met(&tracer, blocks, &ray);
    (tracer.kin, tracer.field) = (false, None);
    let (b, b_error) = measure(&tracer, 24 * blocks, &ray, |p| p.scattered);
    let error = (a_error * a_error + b_error * b_error).sqrt();
    let z = (a - b) / error;
    println!("{what}: {a} +- {a_error}, {b} +- {b_error}, z {z}");
    assert!(z.abs().max_element() < 4.0, "{what}: {a} +- {a_error}, {b} +- {b_error}, z {z}");
    assert!((0.1 * b / error).max_element() > 4.0, "{what}: {b} +- {error} would hide a bias of 10 %");
}

fn knot() -> Mesh {
    shapes::torus_knot(2, 3, 0.5, 0.25, (48, 8))
}

fn colored(g: f64) -> Matter {
    translucent(1.4, 0.0, Rgb::new(0.1, 0.3, 0.6), Rgb::new(2.0, 4.0, 9.0), g)
}

/// Cut short, since what comes late is the same for both, and takes most of the time. Normals are far from the triangles'
/// own: what boundaries do is then not the same from either side.
#[test]
fn light_paths_change_nothing_but_noise() {
    let (rect, quad) = light_above(3.0, 2.0);
    let lamp = || Lamp { kind: rect.clone(), shadow: true };
    let things = || vec![(knot(), colored(-0.4)), (quad.clone(), Matter::Emitter(0))];
    let one = |sky, light, depth| tracer(things(), vec![lamp()], sky, light, depth);
    agree_with_plain("a lamp with extent", one(None, Light::Full, 8), 2_000, from_around);
    agree_with_plain("a sky", one(Some(1.0), Light::Direct, 6), 1_000, from_around);
    let suns = vec![sun(DVec3::new(-0.4, -0.5, -1.0))];
    let sunny = tracer(vec![(knot(), colored(0.3))], suns, None, Light::Full, 6);
    agree_with_plain("a lamp without extent", sunny, 500, from_around);
}

/// Some of the light takes ways that light paths do not, and some goes through another thing.
#[test]
fn light_paths_leave_what_is_not_theirs() {
    let (rect, quad) = light_above(3.0, 2.0);
    let lamp = || Lamp { kind: rect.clone(), shadow: true };
    let floor = shapes::cuboid(DVec3::new(6.0, 0.2, 6.0));
    let floor = Mesh { positions: floor.positions.iter().map(|p| *p - 1.3 * glam::Vec3::Y).collect(), ..floor };
    let white = Matter::Opaque { surface: surface(1.0, 0.0), albedo: Rgb::splat(0.9) };
    let things = vec![(knot(), colored(0.0)), (quad.clone(), Matter::Emitter(0)), (floor, white)];
    agree_with_plain("a floor", tracer(things, vec![lamp()], None, Light::Full, 8), 2_000, from_around);
    let glass = shapes::cuboid(DVec3::splat(2.6));
    let clear = translucent(1.2, 0.0, Rgb::splat(0.1), Rgb::splat(0.4), 0.9);
    let things = vec![(knot(), colored(0.0)), (quad, Matter::Emitter(0)), (glass, clear)];
    agree_with_plain("within another", tracer(things, vec![lamp()], Some(0.5), Light::Full, 8), 1_000, from_around);
}
