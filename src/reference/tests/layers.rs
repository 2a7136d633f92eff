//! Media that vary in space, against things within things, closed forms and each other.

use super::*;
use crate::image::{Channel, Encoding, Texture};
use crate::reference::free_path::Fill;
use crate::scene::TextureMap;

const MM_PER_UNIT: f64 = 10.0;

pub fn medium(sigma_a: Rgb, sigma_s: Rgb, phase: Phase, parameter: f64) -> Medium {
    Medium { sigma_a, sigma_s, phase, parameter: Rgb::splat(parameter) }
}

/// Another in every channel, thicker here and thinner there.
pub fn two_media() -> [Medium; 2] {
    let skin = medium(Rgb::new(0.6, 0.8, 1.0), Rgb::new(3.0, 4.0, 5.0), Phase::HenyeyGreenstein, 0.4);
    let flesh = medium(Rgb::new(0.4, 0.2, 0.5), Rgb::new(2.0, 5.0, 3.0), Phase::Schlick, -0.6);
    [skin, flesh]
}

/// Depths in scene units.
pub fn layered(ior: f64, layers: &[(&Medium, f64)], below: &Medium) -> Matter {
    let depth = |depth: f64| Varying::Constant(MM_PER_UNIT * depth);
    layered_by(ior, layers.iter().map(|(medium, d)| ((*medium).clone(), depth(*d))).collect(), below)
}

pub fn layered_by(ior: f64, layers: Vec<(Medium, Varying<f64>)>, below: &Medium) -> Matter {
    let list: Vec<Layer> = layers.into_iter().map(|(medium, depth)| Layer { medium, depth }).collect();
    let layers = (!list.is_empty()).then_some(Layers { list, mm_per_unit: MM_PER_UNIT });
    Matter::Translucent { surface: surface(ior, 0.0), medium: below.clone(), layers }
}

/// Two estimates of one thing, which are good enough to notice a bias of 2 %.
pub fn agree_both(what: &str, (a, a_error): (Rgb, Rgb), (b, b_error): (Rgb, Rgb)) {
    agree(what, (a, (a_error * a_error + b_error * b_error).sqrt()), b);
}

fn map(texels: Vec<[f32; 4]>, channel: Channel, range: (f64, f64), invert: bool) -> Varying<f64> {
    Varying::Texture(Arc::new(TextureMap {
        path: "depth.png".into(),
        key: Key::of(&0),
        encoding: Encoding::Linear,
        channel,
        range,
        invert,
        texture: Arc::new(Texture { width: texels.len() as u32, height: 1, texels }),
    }))
}

/// A depth in scene units that goes up and down around a thing.
pub fn stripes(least: f64, most: f64) -> Varying<f64> {
    let texels = [0.0, 0.7, 0.2, 1.0, 0.4].map(|share| [share, 0.0, 0.0, 1.0]).to_vec();
    map(texels, Channel::R, (MM_PER_UNIT * least, MM_PER_UNIT * most), false)
}

/// From a patch of the side that looks to the eye.
pub fn from_the_front(random: &mut Random) -> (DVec3, DVec3) {
    let (a, b) = random.pair();
    let target = DVec3::new(0.8 * a - 0.4, 0.6 * b - 0.3, 0.5);
    let eye = DVec3::new(0.5, 0.8, 5.0);
    (eye, (target - eye).normalize())
}

/// The points of a box that lie deeper than its layer are a box: every path has its like in a box within a box.
#[test]
fn a_box_with_a_layer_is_a_box_within_a_box() {
    let [skin, flesh] = two_media();
    let (size, depth) = (DVec3::new(2.0, 1.2, 1.6), 0.25);
    let lamp = || sun(DVec3::new(-0.4, -0.7, -0.9));
    for (ior, lamps, single, paths) in [(1.0, vec![lamp()], true, 120_000), (1.3, Vec::new(), false, 140_000)] {
        let sky = lamps.is_empty().then_some(1.0);
        let layer = vec![(shapes::cuboid(size), layered(ior, &[(&skin, depth)], &flesh))];
        let inner = shapes::cuboid(size - 2.0 * depth);
        let nested = vec![(shapes::cuboid(size), layered(ior, &[], &skin)), (inner, layered(ior, &[], &flesh))];
        let [a, b] = [layer, nested].map(|things| {
            let mut tracer = tracer(things, lamps.clone(), sky, Light::Full, 1000);
            tracer.single = single;
            measure(&tracer, paths, from_the_front, |p| p.scattered)
        });
        agree_both(&format!("ior {ior}, single {single}"), a, b);
    }
}

#[test]
fn layers_of_one_medium_are_one_layer() {
    let [skin, flesh] = two_media();
    let size = DVec3::new(1.6, 1.2, 1.4);
    for (single, lamps, sky) in [(false, Vec::new(), Some(1.0)), (true, vec![sun(DVec3::new(-0.3, -0.5, -1.0))], None)]
    {
        let of = |paths: u64, layers: &[(&Medium, f64)], below: &Medium| {
            let things = vec![(shapes::cuboid(size), layered(1.3, layers, below))];
            let mut tracer = tracer(things, lamps.clone(), sky, Light::Direct, 1000);
            tracer.single = single;
            measure(&tracer, paths, from_the_front, |p| p.scattered)
        };
        let paths = if single { 50_000 } else { 100_000 };
        agree_both("one medium", of(paths, &[(&skin, 0.15)], &skin), of(paths, &[], &skin));
        // Layers thinner than a mean free path are passed in the same steps, however many they are.
        let whole = of(1280, &[(&skin, 0.15)], &flesh).0;
        assert_eq!(of(1280, &[(&skin, 0.1), (&skin, 0.15)], &flesh).0, whole);
        assert_ne!(of(1280, &[(&skin, 0.1), (&flesh, 0.15)], &flesh).0, whole);
    }
}

#[test]
fn nothing_is_lost_between_layers() {
    let white = |sigma_s: Rgb, g: f64| medium(Rgb::ZERO, sigma_s, Phase::HenyeyGreenstein, g);
    let (skin, clear) = (white(Rgb::new(9.0, 6.0, 3.0), 0.5), white(Rgb::ZERO, 0.0));
    let flesh = white(Rgb::new(2.0, 4.0, 6.0), -0.3);
    for (ior, paths) in [(1.0, 20_000), (1.3, 20_000)] {
        let matter = layered(ior, &[(&skin, 0.05), (&clear, 0.12)], &flesh);
        let mesh = shapes::torus_knot(2, 3, 0.5, 0.2, (32, 6));
        let tracer = tracer(vec![(mesh, matter)], Vec::new(), Some(1.0), Light::Full, 100_000);
        agree(&format!("ior {ior}"), measure(&tracer, paths, from_around, total), Rgb::ONE);
    }
}

#[test]
fn light_gets_through_layers_by_their_lengths() {
    let [skin, flesh] = two_media();
    let below = medium(Rgb::new(0.0, 0.1, 4.0), Rgb::new(0.3, 0.0, 3.0), Phase::Schlick, 0.0);
    let slab = shapes::slab(DVec3::new(40.0, 20.0, 40.0), (1, 1));
    let matter = layered(1.0, &[(&skin, 0.1), (&flesh, 0.25)], &below);
    let tracer = tracer(vec![(slab, matter)], Vec::new(), None, Light::Direct, 1);
    let (cos, length) = (0.6, 0.9);
    let fill = tracer.world.fill(0);
    let expected = -(skin.sigma_t() * 0.05 + flesh.sigma_t() * 0.15 + below.sigma_t() * (length * cos - 0.2)) / cos;
    let origin = DVec3::new(0.3, 10.0 - 0.05, 0.2);
    let direction = DVec3::new(0.8, -cos, 0.0);
    for below in [None, Some(0.05)] {
        let n = 30_000;
        let mut random = Random::new(3, 3, 3);
        let (mut sum, mut squares) = (Rgb::ZERO, Rgb::ZERO);
        for _ in 0..n {
            let through = fill.transmittance(origin, below, direction, length, &mut random);
            assert!(through.min_element() >= 0.0 && through.max_element() <= 1.0);
            (sum, squares) = (sum + through, squares + through * through);
        }
        let mean = sum / n as f64;
        agree("through", (mean, ((squares / n as f64 - mean * mean) / n as f64).sqrt()), expected.exp());
    }
}

#[test]
fn depths_are_read_as_the_texture_says() {
    let [skin, flesh] = two_media();
    let below = medium(Rgb::ONE, Rgb::ONE, Phase::Schlick, 0.0);
    // One texel to the left, one to the right: between their middles the depth is in between.
    let texels = vec![[0.2, 0.9, 0.0, 1.0], [0.6, 0.1, 0.0, 1.0]];
    let cases = [
        // (channel, range, invert, depth at the left texel's middle, at the right one's), mm
        (Channel::R, (0.0, 10.0), false, 2.0, 6.0),
        (Channel::R, (0.0, 10.0), true, 8.0, 4.0),
        (Channel::G, (1.0, 3.0), false, 2.8, 1.2),
        (Channel::G, (1.0, 3.0), true, 1.2, 2.8),
    ];
    for (channel, range, invert, left, right) in cases {
        let depth = map(texels.clone(), channel, range, invert);
        // The second layer ends at 3 mm, or with the first one where that reaches deeper.
        let layers = vec![(skin.clone(), depth), (flesh.clone(), Varying::Constant(3.0))];
        let slab = shapes::slab(DVec3::new(8.0, 8.0, 4.0), (2, 2));
        let tracer = tracer(vec![(slab, layered_by(1.0, layers, &below))], Vec::new(), None, Light::Direct, 1);
        let Fill::Layered(strata, thing) = tracer.world.fill(0) else { panic!("it has layers") };
        // u runs along x on the face towards z.
        for (x, first) in [(-2.0, left), (2.0, right), (0.0, 0.5 * (left + right))] {
            for i in 0..100 {
                let mm = 0.1 * i as f64 + 0.05;
                let (depth, found) = strata.at(thing, DVec3::new(x, 0.3, 2.0 - mm / MM_PER_UNIT));
                assert!((depth - mm / MM_PER_UNIT).abs() < 1e-12);
                let expected =
                    [(&skin, first), (&flesh, 3.0)].iter().find(|(_, ends)| *ends > mm).map_or(&below, |l| l.0);
                assert_eq!(found.sigma_t(), expected.sigma_t(), "{channel:?} x {x} mm {mm}");
                let around = strata.around(depth);
                assert!(around.most.cmpge(found.sigma_t()).all() && around.least.cmple(found.sigma_t()).all());
            }
        }
    }
    // The same depth everywhere is a constant.
    let of = |depth: Varying<f64>| {
        let things = vec![(shapes::sphere(0.8, 2), layered_by(1.3, vec![(skin.clone(), depth)], &flesh))];
        let tracer = tracer(things, Vec::new(), Some(1.0), Light::Direct, 100);
        measure(&tracer, 640, from_the_front, |p| p.scattered).0
    };
    let even = map(vec![[0.25, 0.0, 0.0, 1.0]; 2], Channel::R, (0.0, 8.0), true);
    assert_eq!(of(even), of(Varying::Constant(6.0)));
    assert_ne!(of(Varying::Constant(5.0)), of(Varying::Constant(6.0)));
}
