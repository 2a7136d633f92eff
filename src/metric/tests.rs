//! Laws of the measures: what is equal, symmetric, scaled, worse or no number, and that each of them has teeth.

use super::*;

const SIZE: (u32, u32) = (40, 30);

/// A lit ball before a gradient, all of it within a display's range.
fn ball() -> Image {
    let pixel = |i: u32| {
        let (x, y) = ((i % SIZE.0) as f32 / 20.0 - 1.0, (i / SIZE.0) as f32 / 15.0 - 1.0);
        let height = 0.7 - x * x - y * y;
        let light = if height > 0.0 { 0.3 + 0.5 * height.sqrt() * (1.0 + x) } else { 0.05 + 0.03 * y };
        [0.9 * light, 0.7 * light, 0.4 * light + 0.02]
    };
    Image { width: SIZE.0, height: SIZE.1, pixels: (0..SIZE.0 * SIZE.1).map(pixel).collect() }
}

fn map(image: &Image, change: impl Fn(usize, [f32; 3]) -> [f32; 3]) -> Image {
    let pixels = image.pixels.iter().enumerate().map(|(i, pixel)| change(i, *pixel)).collect();
    Image { pixels, ..*image }
}

fn scaled(image: &Image, factor: f32) -> Image {
    map(image, |_, pixel| pixel.map(|v| factor * v))
}

fn compare(image: &Image, reference: &Image) -> Comparison {
    Comparison::of(&Pair::new(image, reference).unwrap(), None).unwrap()
}

fn measured(image: &Image, reference: &Image) -> [f64; 7] {
    let comparison = compare(image, reference);
    MEASURES.map(|(_, value)| value(&comparison))
}

/// A deterministic standard normal value: the sum of twelve uniform ones, less 6.
fn normal(n: u64) -> f64 {
    let uniform = |k: u64| {
        let mut x = (n * 12 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(uniform).sum::<f64>() - 6.0
}

#[test]
fn equal_images_are_no_way_apart() {
    for image in [ball(), Image::filled(5, 3, [0.0; 3]), Image::filled(1, 1, [3.0, 0.0, 1e6])] {
        assert_eq!(measured(&image, &image), [0.0; 7]);
    }
}

#[test]
fn a_change_that_an_eye_would_see_is_noticed_by_every_measure_that_should() {
    let ball = ball();
    let brighter = measured(&scaled(&ball, 1.03), &ball);
    let swapped = measured(&map(&ball, |_, [r, g, b]| [b, g, r]), &ball);
    let shifted = measured(&map(&ball, |i, _| ball.pixels[i - usize::from(i % 40 > 0)]), &ball);
    // relmse, relmse_p99, dssim, dssim_p99, flip_mean, flip_p99, bias; 0 where a measure is blind by its nature.
    let limits = [
        (brighter, [6e-4, 8e-4, 5e-5, 8e-5, 0.05, 0.07, 0.029]),
        (swapped, [0.2, 0.4, 0.02, 0.04, 0.3, 0.5, 0.9]),
        (shifted, [1e-3, 0.05, 5e-3, 0.1, 0.01, 0.2, 0.0]),
    ];
    for (found, least) in limits {
        for (k, (name, _)) in MEASURES.iter().enumerate() {
            assert!(found[k] >= least[k], "{name}: {} < {}, of {found:?}", found[k], least[k]);
        }
    }
}

#[test]
fn more_error_is_more_by_every_measure() {
    let ball = ball();
    let mut last = [0.0; 7];
    for factor in [1.02, 1.05, 1.1, 1.2, 1.4] {
        let found = measured(&scaled(&ball, factor), &ball);
        for (k, (name, _)) in MEASURES.iter().enumerate() {
            assert!(found[k] > last[k], "{name} at {factor}: {found:?}");
        }
        last = found;
    }
}

#[test]
fn constant_images_have_the_values_of_the_formulas() {
    let grey = |v: f32| Image::filled(30, 30, [v; 3]);
    let close = |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() <= tolerance * b.abs(), "{a} {b}");
    // (0.1)^2 / (1 + 0.01), everywhere.
    let found = compare(&grey(1.1), &grey(1.0));
    close(found.relmse.errors.all.mean, 0.01 / 1.01, 1e-6);
    close(found.relmse.errors.all.p99, 0.01 / 1.01, 1e-6);
    close(found.bias.all, 0.1, 1e-6);
    // Without structure SSIM is its luminance term, of the displayed values.
    let found = compare(&grey(0.2), &grey(0.4)).dssim;
    let (x, y): (f64, f64) = (tone::srgb_from_linear(0.2).into(), tone::srgb_from_linear(0.4).into());
    close(found.all.mean, 0.5 - 0.5 * (2.0 * x * y + 1e-4) / (x * x + y * y + 1e-4), 1e-6);
    // FLIP of greys: the difference of L*, to the power of 0.7, against that of the hues farthest apart, green and blue,
    // 41.28; up to 0.4 of that it is stretched to 0.95, beyond it to 1 [Andersson2020, section 4.1.3].
    let lightness = |level: u32| {
        let y = f64::from(tone::linear_from_srgb(level as f32 / 255.0));
        116.0 * y.cbrt() - 16.0
    };
    let expected = |difference: f64| match difference.powf(0.7) / 41.28 {
        share if share < 0.4 => share * 0.95 / 0.4,
        share => 0.95 + (share - 0.4) / 0.6 * 0.05,
    };
    let level = |level: u32| grey(tone::linear_from_srgb(level as f32 / 255.0));
    for (a, b) in [(100, 110), (128, 200), (60, 61)] {
        let found = compare(&level(a), &level(b)).flip;
        close(found.spread.mean, expected(lightness(b) - lightness(a)), 5e-3);
    }
    close(compare(&grey(0.0), &grey(1.0)).flip.spread.mean, expected(100.0), 5e-3);
}

#[test]
fn a_brighter_scene_has_the_same_relative_error_and_order_matters_only_to_what_is_relative() {
    let (image, reference) = (scaled(&ball(), 1.1), ball());
    let plain = compare(&image, &reference);
    for factor in [1e-12, 64.0, 1e12] {
        let other = compare(&scaled(&image, factor), &scaled(&reference, factor));
        let same = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-5, "{factor}: {a} {b}");
        same(other.relmse.errors.all.mean, plain.relmse.errors.all.mean);
        same(other.relmse.errors.channels[2].p99, plain.relmse.errors.channels[2].p99);
        same(other.bias.channels[0], plain.bias.channels[0]);
    }
    let back = compare(&reference, &image);
    assert_eq!((back.dssim.all, back.flip.map == plain.flip.map), (plain.dssim.all, true));
    assert!(back.bias.all < 0.0 && plain.bias.all > 0.0);
    assert!(back.relmse.errors.all.mean < plain.relmse.errors.all.mean);
}

#[test]
fn channels_are_told_apart() {
    let ball = ball();
    let found = compare(&map(&ball, |_, [r, g, b]| [r, 0.9 * g, b]), &ball);
    for c in [0, 2] {
        assert_eq!((found.relmse.errors.channels[c].mean, found.dssim.channels[c].mean), (0.0, 0.0));
        assert_eq!(found.bias.channels[c], 0.0);
    }
    let of_all: f64 = found.relmse.errors.channels.iter().map(|spread| spread.mean).sum();
    assert!((of_all / 3.0 / found.relmse.errors.all.mean - 1.0).abs() < 1e-12);
    assert!((found.bias.channels[1] + 0.1).abs() < 1e-6 && (found.bias.largest() - 0.1).abs() < 1e-6);
    assert!(found.dssim.channels[1].mean > 1e-4 && found.relmse.errors.per_pixel()[620] > 0.0);
}

#[test]
fn what_the_image_holds_outside_of_the_mask_changes_nothing() {
    let reference = ball();
    let mask: Vec<bool> = reference.pixels.iter().map(|pixel| pixel[0] > 0.2).collect();
    let image = scaled(&reference, 1.05);
    let outside = map(&image, |i, pixel| if mask[i] { pixel } else { [0.9, 0.0, 0.5] });
    let of = |image: &Image| {
        let pair = Pair::new(image, &reference).unwrap().masked(&mask).unwrap();
        assert_eq!(pair.count(), mask.iter().filter(|counts| **counts).count());
        let comparison = Comparison::of(&pair, None).unwrap();
        MEASURES.map(|(_, value)| value(&comparison))
    };
    assert_eq!(of(&image), of(&outside));
    assert!(of(&image).iter().all(|value| *value > 0.0));
    assert!(measured(&outside, &reference)[0] > 2.0 * of(&outside)[0], "without the mask it is seen");

    let white = map(&reference, |i, _| [f32::from(u8::from(mask[i])); 3]);
    assert_eq!(super::mask(&white, &image).unwrap(), mask);
    let empty = vec![false; mask.len()];
    assert!(Pair::new(&image, &reference).unwrap().masked(&empty).unwrap_err().what.contains("no pixel"));
}

#[test]
fn what_is_no_number_or_of_another_size_is_refused_with_its_place() {
    let fine = ball();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut broken = fine.clone();
        broken.pixels[2 * 40 + 7][1] = bad;
        let of_image = Pair::new(&broken, &fine).unwrap_err().to_string();
        assert!(
            of_image.contains("1 pixel(s) of the image are NaN or infinite, the first at x = 7, y = 2"),
            "{of_image}"
        );
        assert!(Pair::new(&fine, &broken).unwrap_err().what.contains("of the reference"));
        let pair = Pair::new(&fine, &fine).unwrap();
        assert!(relmse(&pair, Some(&broken)).unwrap_err().what.contains("the variance are NaN"));
        assert!(z_test(&pair, &broken, 0.01).unwrap_err().what.contains("the standard error are NaN"));
        assert!(mask(&broken, &fine).unwrap_err().what.contains("the mask are NaN"));
    }
    let small = Image::filled(4, 30, [0.0; 3]);
    assert!(Pair::new(&small, &fine).unwrap_err().what.contains("4 x 30 pixels, but the reference has 40 x 30"));
    assert!(mask(&small, &fine).is_err() && relmse(&Pair::new(&fine, &fine).unwrap(), Some(&small)).is_err());
    assert!(Pair::new(&Image::default(), &Image::default()).unwrap_err().what.contains("no pixel"));
    let negative = map(&fine, |i, _| [if i == 41 { -1.0 } else { 0.0 }; 3]);
    let refused = relmse(&Pair::new(&fine, &fine).unwrap(), Some(&negative)).unwrap_err();
    assert!(refused.what.contains("below 0 at x = 1, y = 1"));
}

#[test]
fn an_error_relative_to_black_is_infinite_and_never_no_number() {
    let (black, lit) = (Image::filled(4, 4, [0.0; 3]), Image::filled(4, 4, [0.5; 3]));
    let found = measured(&lit, &black);
    assert_eq!((found[0], found[6]), (f64::INFINITY, f64::INFINITY));
    assert!(found.iter().all(|value| !value.is_nan()));
}

#[test]
fn the_variance_of_the_reference_is_taken_off() {
    let truth = scaled(&ball(), 4.0);
    let se = 0.02_f32;
    let noisy = map(&truth, |i, pixel| std::array::from_fn(|c| pixel[c] + se * normal((3 * i + c) as u64) as f32));
    let variance = Image::filled(SIZE.0, SIZE.1, [se * se; 3]);
    let pair = Pair::new(&truth, &noisy).unwrap();
    let plain = relmse(&pair, None).unwrap();
    let less = relmse(&pair, Some(&variance)).unwrap();
    let noise = less.noise.unwrap();
    // Of the image that is right, next to nothing is left; of one that is wrong, its own error.
    assert!(plain.noise.is_none() && noise.all.mean > 1e-3);
    assert!((plain.errors.all.mean - noise.all.mean - less.errors.all.mean).abs() < 1e-12);
    assert!(less.errors.all.mean.abs() < 0.15 * noise.all.mean, "{:?} {:?}", less.errors.all, noise.all);
    let wrong = scaled(&truth, 1.3);
    let found = relmse(&Pair::new(&wrong, &noisy).unwrap(), Some(&variance)).unwrap();
    let right = relmse(&Pair::new(&wrong, &truth).unwrap(), None).unwrap();
    assert!((found.errors.all.mean / right.errors.all.mean - 1.0).abs() < 0.1);
}

#[test]
fn the_standard_error_of_relmse_is_that_of_other_noise() {
    let truth = scaled(&ball(), 4.0);
    // Small against the floor, or the quotient is off by more than its error.
    let se = 0.004_f32;
    let variance = Image::filled(SIZE.0, SIZE.1, [se * se; 3]);
    for factor in [1.0, 1.1] {
        let image = scaled(&truth, factor);
        let right = relmse(&Pair::new(&image, &truth).unwrap(), None).unwrap().errors.all.mean;
        let squares: Vec<f64> = (0..40)
            .map(|k| {
                let noisy =
                    map(&truth, |i, pixel| pixel.map(|v| v + se * normal((100_000 * (k + 1) + i) as u64) as f32));
                let found = relmse(&Pair::new(&image, &noisy).unwrap(), Some(&variance)).unwrap();
                ((found.errors.all.mean - right) / found.standard_error.unwrap()).powi(2)
            })
            .collect();
        let rms = (squares.iter().sum::<f64>() / 40.0).sqrt();
        // A little below 1 where there is no error: there its estimate is never below 0.
        assert!((0.4..1.4).contains(&rms), "{factor}: {rms}");
    }
}

#[test]
fn percentiles_are_those_of_nearest_rank() {
    let spread = Spread::of((1..=200).map(f64::from));
    assert_eq!((spread.mean, spread.p99), (100.5, 198.0));
    assert_eq!(Spread::of([7.0]), Spread { mean: 7.0, p99: 7.0 });
    assert_eq!(Spread::of([1.0, 5.0]).p99, 5.0);
}

#[test]
fn noise_passes_the_z_test_and_each_kind_of_error_fails_it() {
    let truth = ball();
    let errors = map(&truth, |i, _| [0.01 + 1e-5 * i as f32, 0.02, 0.03]);
    let noisy = |seed: u64| {
        map(&truth, |i, pixel| {
            let z = |c: usize| normal(seed * 100_000 + (3 * i + c) as u64) as f32;
            std::array::from_fn(|c| pixel[c] + errors.pixels[i][c] * z(c))
        })
    };
    let test = |image: &Image, seed: u64| z_test(&Pair::new(image, &noisy(seed)).unwrap(), &errors, 0.01).unwrap();
    let refused = (0..50).filter(|seed| !test(&truth, *seed).passes()).count();
    assert!(refused <= 3, "{refused} of 50");
    let fine = test(&truth, 1);
    assert_eq!(fine.count, 3600);
    // 1 - (1 - 0.01/3)^(1/3600), two-sided.
    assert!((fine.largest_limit - 4.9).abs() < 0.1 && (fine.mean_limit - 2.935).abs() < 0.01);

    // One pixel, told by its place.
    let mut one = truth.clone();
    one.pixels[41][2] += 10.0 * errors.pixels[41][2];
    let found = test(&one, 1);
    assert!(found.largest > found.largest_limit && found.at == (1, 1, 2) && found.mean <= found.mean_limit);
    // All of it, by a tenth of the noise.
    let brighter = map(&truth, |i, pixel| std::array::from_fn(|c| pixel[c] + 0.1 * errors.pixels[i][c]));
    let found = test(&brighter, 1);
    assert!(found.mean > found.mean_limit && found.largest <= found.largest_limit);
    // Now up, now down, half as much as the noise.
    let uneven = map(&truth, |i, pixel| {
        std::array::from_fn(|c| pixel[c] + 0.5 * errors.pixels[i][c] * if i % 2 == 0 { 1.0 } else { -1.0 })
    });
    let found = test(&uneven, 1);
    assert!(found.square > found.square_limit && found.mean <= found.mean_limit);
    // Where there is no noise, nothing may differ.
    let sure = Image::filled(SIZE.0, SIZE.1, [0.0; 3]);
    let pair = Pair::new(&truth, &truth).unwrap();
    let same = z_test(&pair, &sure, 0.01).unwrap();
    assert!(same.passes() && same.count == 0);
    let found = z_test(&Pair::new(&one, &truth).unwrap(), &sure, 0.01).unwrap();
    assert!(!found.passes() && found.largest == f64::INFINITY && found.at == (1, 1, 2));
}
