//! The picture that the README shows is the picture that the program makes.
//!
//! The software adapter computes the same bits every time, so that on it a golden is compared almost exactly; another
//! adapter rounds differently, and gets a wider, stated tolerance. `UPDATE=1` writes the golden; look at it before it is
//! committed.

use diaphane::image::{Display, Format};
use diaphane::render::Look;
use diaphane::session::{Options, Session};
use diaphane::store::{Finished, Watch};
use image::RgbImage;
use std::path::Path;

struct Quiet;
impl Watch for Quiet {
    fn finished(&self, _: &Finished) {}
}

const SIZE: (u32, u32) = (640, 360);

/// A scene as a PNG shows it.
fn render(session: &mut Session, scene: &Path) -> Vec<u8> {
    let (scene, _) = session.scene(scene).unwrap_or_else(|problems| panic!("{problems}"));
    let mut look = Look::of(&scene);
    look.view.size = SIZE;
    let (_, picture) = session.render(&scene, &look, &Quiet).unwrap_or_else(|problem| panic!("{problem}"));
    let display = Display { tone: scene.view.tone, exposure_ev: scene.view.exposure_ev as f32 };
    picture.encode(Format::Png, display, &[]).unwrap()
}

fn decoded(png: &[u8]) -> RgbImage {
    image::load_from_memory(png).expect("a golden is a PNG").to_rgb8()
}

/// The share of pixels that differ by more than `levels` in any channel.
fn differing(a: &RgbImage, b: &RgbImage, levels: u8) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions(), "pictures of one size are compared");
    let far = |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| (0..3).any(|c| a[c].abs_diff(b[c]) > levels);
    a.pixels().zip(b.pixels()).filter(|pair| far(*pair)).count() as f64 / (SIZE.0 * SIZE.1) as f64
}

/// Whether a picture is the golden one: what differs, by how much, for which share of the pixels.
fn same(a: &RgbImage, b: &RgbImage, software: bool) -> Result<(), String> {
    let (levels, share) = if software { (1, 0.0005) } else { (6, 0.01) };
    let found = differing(a, b, levels);
    match found <= share {
        true => Ok(()),
        false => Err(format!("{:.3} % of the pixels differ by more than {levels} levels", 100.0 * found)),
    }
}

fn options(sets: &[(&str, &str)]) -> Options {
    let sets = sets.iter().map(|(path, ron)| (path.to_string(), ron.to_string())).collect();
    Options { cache_dir: Some(Path::new(env!("CARGO_TARGET_TMPDIR")).join("bakes")), sets, ..Options::default() }
}

#[test]
fn first_light_is_the_golden_picture() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let golden = root.join("tests/golden/first-light.png");
    let mut session = Session::new(options(&[]));
    let png = render(&mut session, &root.join("scenes/first-light.ron"));
    if std::env::var_os("UPDATE").is_some() {
        std::fs::create_dir_all(golden.parent().unwrap()).unwrap();
        std::fs::write(&golden, &png).unwrap();
    }
    let expected = std::fs::read(&golden)
        .unwrap_or_else(|_| panic!("{} is missing: run with UPDATE=1, look at it, commit it", golden.display()));
    let software = session.gpu().unwrap().is_software();
    let (actual, expected) = (decoded(&png), decoded(&expected));
    if let Err(how) = same(&actual, &expected, software) {
        let failed = Path::new(env!("CARGO_TARGET_TMPDIR")).join("first-light.actual.png");
        std::fs::write(&failed, &png).unwrap();
        panic!("first-light is not what it was: {how}; see {}", failed.display());
    }

    // Teeth: whatever ought to be seen is seen.
    let mut shifted = actual.clone();
    for (x, y, pixel) in shifted.enumerate_pixels_mut() {
        *pixel = *actual.get_pixel(x.saturating_sub(1), y);
    }
    assert!(same(&shifted, &expected, software).is_err(), "a shift of one pixel is not noticed");
    let mut swapped = actual.clone();
    swapped.pixels_mut().for_each(|pixel| pixel.0.swap(0, 2));
    assert!(same(&swapped, &expected, software).is_err(), "swapped channels are not noticed");
    if software {
        // The jade's mean free path, a tenth longer.
        let jade = std::fs::read_to_string(root.join("materials/jade.ron")).unwrap();
        let longer = jade.replace("radius: 1.0,", "radius: 1.1,");
        assert_ne!(jade, longer);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jade.ron");
        std::fs::write(&file, longer).unwrap();
        let mut session =
            Session::new(options(&[("objects.hare.material", &format!("{:?}", file.display().to_string()))]));
        let other = decoded(&render(&mut session, &root.join("scenes/first-light.ron")));
        assert!(same(&other, &expected, software).is_err(), "a longer mean free path is not noticed");
    }
}
