//! Paths that share what they find, against paths that do not.

use super::*;

/// A ray at one place of the thing.
fn at_one_place(random: &mut Random) -> (DVec3, DVec3) {
    let (a, b) = random.pair();
    (DVec3::new(0.25 + 0.1 * a, 0.35 + 0.1 * b, 5.0), DVec3::NEG_Z)
}

/// The mean over all paths of some blocks of kin, and its standard error; a block counts as one sample.
fn measure_kin(tracer: &Tracer, blocks: u64) -> (Rgb, Rgb) {
    let block = |block: u64| {
        let path = |path| {
            let mut random = Random::new(3, block, path);
            let (origin, direction) = at_one_place(&mut random);
            tracer.trace(origin, direction, Inside::default(), &mut random)
        };
        let mut strands: Vec<kin::Strand> = (0..8).map(path).collect();
        tracer.settle(&mut strands);
        strands.iter().map(|strand| strand.parts.scattered).sum::<Rgb>() / strands.len() as f64
    };
    over_blocks(blocks, block)
}

fn agree_with_plain(what: &str, mut tracer: Tracer, blocks: u64) {
    tracer.kin = true;
    let (a, a_error) = measure_kin(&tracer, blocks);
    tracer.kin = false;
    let (b, b_error) = measure(&tracer, 128_000, at_one_place, |p| p.scattered);
    let error = (a_error * a_error + b_error * b_error).sqrt();
    let z = (a - b) / error;
    println!("{what}: {a} +- {a_error}, {b} +- {b_error}, z {z}");
    assert!(z.abs().max_element() < 4.0, "{what}: {a} +- {a_error}, {b} +- {b_error}, z {z}");
    assert!((0.03 * b / error).max_element() > 4.0, "{what}: {b} +- {error} would hide a bias of 3 %");
}

#[test]
fn kin_change_nothing_but_noise() {
    let (rect, quad) = light_above(3.0, 2.0);
    let knot = || shapes::torus_knot(2, 3, 0.5, 0.25, (96, 12));
    let sun = || sun(DVec3::new(-0.4, -0.5, -1.0));
    let colored = (Rgb::new(0.1, 0.3, 0.6), Rgb::new(2.0, 4.0, 9.0));
    // Cut short, since what comes late is the same for both, and takes most of the time.
    for (what, ior, roughness, g, light, max_depth, blocks) in [
        ("smooth and cut short", 1.4, 0.0, -0.4, Light::Full, 6, 4_000),
        ("index-matched and cut short", 1.0, 0.0, 0.4, Light::Direct, 5, 4_000),
    ] {
        let lamp = Lamp { kind: rect.clone(), shadow: true };
        let things =
            vec![(knot(), translucent(ior, roughness, colored.0, colored.1, g)), (quad.clone(), Matter::Emitter(0))];
        agree_with_plain(what, tracer(things, vec![lamp, sun()], Some(3.0), light, max_depth), blocks);
    }
}

#[test]
fn kin_change_nothing_but_noise_of_profiles() {
    let (rect, quad) = light_above(3.0, 2.0);
    let medium = medium::Medium::extinction(Rgb::new(4.0, 6.0, 15.0), Rgb::new(0.98, 0.9, 0.8), Rgb::ZERO);
    let bssrdf = Bssrdf::new(Default::default(), medium, Phase::HenyeyGreenstein, 1.3);
    let matter = Matter::Bssrdf { surface: surface(1.3, 0.0), bssrdf: Box::new(bssrdf) };
    let knot = shapes::torus_knot(2, 3, 0.5, 0.25, (96, 12));
    let things = vec![(knot, matter), (quad, Matter::Emitter(0))];
    let lamp = Lamp { kind: rect, shadow: true };
    let tracer = tracer(things, vec![lamp, sun(DVec3::new(-0.4, -0.5, -1.0))], Some(3.0), Light::Direct, 16);
    agree_with_plain("a profile", tracer, 16_000);
}
