//! Single scattering against closed forms, against the first integrator cut short, and against itself turned round.

use super::layers::{agree_both, from_the_front, layered, layered_by, medium, stripes, two_media};
use super::*;

/// A lamp above plane-parallel layers: what scatters once, below a plane that refracts.
#[test]
fn plane_layers_scatter_once_by_their_closed_form() {
    let [skin, flesh] = two_media();
    let below = medium(Rgb::new(4.0, 3.0, 2.0), Rgb::new(8.0, 12.0, 16.0), Phase::HenyeyGreenstein, 0.2);
    let depths = [0.1, 0.3];
    for (ior, layers) in [(1.0, 2), (1.3, 2), (1.3, 0)] {
        let list = [(&skin, depths[0]), (&flesh, depths[1])];
        let matter = layered(ior, &list[..layers], &below);
        let slab = shapes::slab(DVec3::new(40.0, 20.0, 40.0), (2, 2));
        let (cos_i, cos_o) = (0.8f64, 0.9f64);
        let lamp = sun(DVec3::new((1.0 - cos_i * cos_i).sqrt(), -cos_i, 0.0));
        let eye = DVec3::new(0.0, -cos_o, (1.0 - cos_o * cos_o).sqrt());
        // Inside.
        let (mu_i, mu_o) = [cos_i, cos_o].map(|cos| refracted_cosine(cos, ior).expect("denser inside")).into();
        let light = DVec3::new((1.0 - mu_i * mu_i).sqrt(), -mu_i, 0.0);
        let path = DVec3::new(0.0, -mu_o, (1.0 - mu_o * mu_o).sqrt());
        let mut through = Rgb::splat((1.0 - fresnel_dielectric(cos_i, ior)) * cos_i / mu_i);
        let (mut expected, mut top, slope) = (Rgb::ZERO, 0.0, 1.0 / mu_i + 1.0 / mu_o);
        for (medium, end) in list[..layers].iter().copied().chain([(&below, f64::INFINITY)]) {
            let passes = if end.is_finite() { (-slope * (end - top) * medium.sigma_t()).exp() } else { Rgb::ZERO };
            // Both point away from the particle.
            let phase = medium.parameter.map(|k| medium.phase.value(light.dot(path), k));
            expected += through * phase * medium.sigma_s / medium.sigma_t() * (1.0 - passes) / (slope * mu_o);
            (through, top) = (through * passes, end);
        }
        expected *= (1.0 - fresnel_dielectric(cos_o, ior)) / (ior * ior);
        let mut tracer = tracer(vec![(slab, matter)], vec![lamp], None, Light::Direct, 1000);
        tracer.single = true;
        let ray = |_: &mut Random| (DVec3::new(0.1, 10.0, 0.2) - 5.0 * eye, eye);
        agree(&format!("ior {ior}, {layers} layers"), measure(&tracer, 100_000, ray, |p| p.scattered), expected);
    }
}

/// Two events, in and at a particle, are single scattering of lamps without extent; three, and out, that of all other light
/// if paths find it by themselves.
#[test]
fn single_scattering_is_the_beginning_of_all_scattering() {
    let [skin, flesh] = two_media();
    let (rect, quad) = light_above(1.6, 3.0);
    let point = Kind::Point { position: DVec3::new(0.5, 1.5, 2.0), intensity: Rgb::ONE };
    for (ior, layers) in [(1.0, 1), (1.3, 1), (1.3, 0)] {
        for (kind, max_depth, paths) in [(Some(&point), 2, 60_000), (None, 3, 140_000), (Some(&rect), 3, 240_000)] {
            let matter = layered(ior, &[(&skin, 0.12)][..layers], &flesh);
            let mut things = vec![(shapes::cuboid(DVec3::new(1.8, 1.2, 1.4)), matter)];
            if max_depth == 3 && kind.is_some() {
                things.push((quad.clone(), Matter::Emitter(0)));
            }
            let lamps = kind.map(|kind| Lamp { kind: kind.clone(), shadow: true });
            let sky = lamps.is_none().then_some(1.0);
            let mut tracer = tracer(things, lamps.into_iter().collect(), sky, Light::Direct, 1000);
            tracer.single = true;
            let (a, a_error) = measure(&tracer, paths, from_the_front, |p| p.scattered);
            (tracer.single, tracer.max_depth, tracer.joins) = (false, max_depth, false);
            let (b, b_error) = measure(&tracer, paths, from_the_front, |p| p.scattered);
            let error = (a_error * a_error + b_error * b_error).sqrt();
            let z = (a - b) / error.max(1e-9 * b);
            let what = format!("ior {ior}, {layers} layers, {max_depth} events");
            assert!(z.abs().max_element() < 4.0, "{what}: {a} +- {a_error}, {b} +- {b_error}, z {z}");
            assert!((error / b).min_element() < 0.02, "{what}: {b} +- {error} proves too little");
        }
    }
}

/// The share that plane layers send from one direction into another is that which they send back.
#[test]
fn planes_send_light_back_as_it_came() {
    let [skin, flesh] = two_media();
    // So dark that paths are short.
    let dense = |m: &Medium| Medium { sigma_a: 16.0 * m.sigma_a, sigma_s: 4.0 * m.sigma_s, ..m.clone() };
    let (skin, flesh) = (dense(&skin), dense(&flesh));
    // Towards lamp or eye.
    let ways = [DVec3::new(0.3, 0.95, 0.0), DVec3::new(-0.2, 0.5, 0.8)].map(DVec3::normalize);
    for (layers, single) in [(0, false), (1, false), (1, true)] {
        let sent = |from: DVec3, to: DVec3| {
            let slab = shapes::slab(DVec3::new(40.0, 20.0, 40.0), (1, 1));
            let matter = layered(1.3, &[(&skin, 0.05)][..layers], &flesh);
            let mut tracer = tracer(vec![(slab, matter)], vec![sun(-from)], None, Light::Direct, 1000);
            tracer.single = single;
            let ray = |_: &mut Random| (DVec3::new(0.1, 10.0, 0.2) + 5.0 * to, -to);
            let (mean, error) = measure(&tracer, 50_000, ray, |p| p.scattered);
            (mean / from.y, error / from.y)
        };
        let [a, b] = ways;
        agree_both(&format!("{layers} layers, single {single}"), sent(a, b), sent(b, a));
    }
}

/// And so is what a thing sends from one direction into another, all of its sides together.
#[test]
fn things_send_light_back_as_it_came() {
    let [skin, flesh] = two_media();
    let ways = [DVec3::new(0.3, 0.95, 0.0), DVec3::new(-0.2, 0.8, 0.3)].map(DVec3::normalize);
    // Through a boundary that refracts the reference knows no light that is reflected inside before it scatters, and of
    // single scattering that is no part.
    for (ior, single) in [(1.0, false), (1.3, true)] {
        let sent = |from: DVec3, to: DVec3| {
            let matter = layered_by(ior, vec![(skin.clone(), stripes(0.02, 0.3))], &flesh);
            let things = vec![(shapes::cuboid(DVec3::new(2.0, 0.5, 2.0)), matter)];
            let mut tracer = tracer(things, vec![sun(-from)], None, Light::Direct, 1000);
            tracer.single = single;
            // Evenly through all of the thing.
            let ray = |random: &mut Random| {
                let (a, b) = random.pair();
                (1.2 * DVec3::new(2.0 * a - 1.0, 0.0, 2.0 * b - 1.0) + 5.0 * to, -to)
            };
            let (mean, error) = measure(&tracer, 200_000, ray, |p| p.scattered);
            (to.y * mean, to.y * error)
        };
        let [a, b] = ways;
        agree_both(&format!("ior {ior}, single {single}"), sent(a, b), sent(b, a));
    }
}
