//! Pictures are what they were: one test per entry of `tests/golden/list.ron`, whose picture lies beside it.
//!
//! On Mesa's software driver, llvmpipe, which computes the same bits every time, a golden is compared almost exactly:
//! [`LLVMPIPE`]. Another adapter rounds and covers edges differently, and gets [`ANY_ADAPTER`]. Each comparison is shown
//! to have teeth: swapped channels and a shift of one pixel fail by both tolerances, a mean free path that is a tenth
//! longer by the first.
//!
//! `UPDATE=1 cargo test --test golden` writes the pictures anew; look at them before they are committed. A picture that is
//! missing fails and is not written, and so does one that no entry names. What fails is shown, side by side with what was
//! expected, in `target/golden-report/index.html`, which is gone as soon as nothing fails.

#[path = "golden/report.rs"]
mod report;

use diaphane::image::{Display, Encoding, Format, Image, decode};
use diaphane::metric::{Flip, Pair, flip};
use diaphane::render::Look;
use diaphane::scene::{Scene, Substance};
use diaphane::session::{Options, Session};
use diaphane::store::Watch;
use libtest_mimic::{Arguments, Failed, Trial};
use report::Case;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

const FOLDER: &str = "tests/golden";

/// How far a picture may be from its golden.
struct Tolerance {
    name: &'static str,
    /// Of 255, in any channel.
    levels: u8,
    /// The share of pixels that may be farther away than that.
    share: f64,
    flip_mean: f64,
}

const LLVMPIPE: Tolerance = Tolerance { name: "llvmpipe", levels: 1, share: 0.0, flip_mean: 1e-3 };
const ANY_ADAPTER: Tolerance = Tolerance { name: "any adapter", levels: 6, share: 0.01, flip_mean: 0.01 };

/// One picture.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Shot {
    name: String,
    /// Relative to the list.
    scene: PathBuf,
    /// Paths of values of the scene, and RON to put there.
    #[serde(default)]
    set: BTreeMap<String, String>,
}

fn main() -> ExitCode {
    std::env::set_current_dir(env!("CARGO_MANIFEST_DIR")).expect("the project's folder is there");
    let update = std::env::var_os("UPDATE").is_some_and(|value| value == "1");
    let list = std::fs::read_to_string(Path::new(FOLDER).join("list.ron")).expect("there is a list");
    let shots: Vec<Shot> = ron::from_str(&list).unwrap_or_else(|error| panic!("{FOLDER}/list.ron:{error}"));
    assert!(shots.len() >= 20, "the pictures are gone");

    let cases = Arc::new(Mutex::new(Vec::new()));
    let mut trials = dangling(&shots);
    trials.push(Trial::test("no light is black", no_light));
    let some = ["instances", "light-many", "clear", "twist-1"];
    let again: Vec<Shot> = shots.iter().filter(|shot| some.contains(&shot.name.as_str())).cloned().collect();
    trials.push(Trial::test("the same again is the same bits", move || the_same_bits(&again)));
    for shot in shots {
        let cases = cases.clone();
        trials.push(Trial::test(shot.name.clone(), move || {
            judge(&shot, update).map_err(|(message, case)| {
                cases.lock().unwrap_or_else(PoisonError::into_inner).extend(case);
                message.into()
            })
        }));
    }
    let conclusion = libtest_mimic::run(&Arguments::from_args(), trials);
    report::write(&cases.lock().unwrap_or_else(PoisonError::into_inner));
    conclusion.exit_code()
}

/// A failing test for every picture that no entry names and every scene that none shows.
fn dangling(shots: &[Shot]) -> Vec<Trial> {
    let names = |shot: &Shot| [format!("{}.png", shot.name), shot.scene.display().to_string()];
    let named: BTreeSet<String> = shots.iter().flat_map(names).collect();
    assert_eq!(shots.iter().map(|shot| &shot.name).collect::<BTreeSet<_>>().len(), shots.len(), "a name stands twice");
    std::fs::read_dir(FOLDER)
        .expect("the folder of pictures can be listed")
        .map(|entry| entry.expect("the folder of pictures can be listed").file_name().display().to_string())
        .filter(|file| (file.ends_with(".png") || file.ends_with(".scene.ron")) && !named.contains(file))
        .map(|file| {
            let message = format!("no entry of {FOLDER}/list.ron names {file}: remove it, or name it");
            Trial::test(file, move || Err(message.into()))
        })
        .collect()
}

struct Quiet;
impl Watch for Quiet {}

/// The session of all tests. They take turns; a test that failed leaves it usable.
fn session() -> MutexGuard<'static, Session> {
    static SESSION: OnceLock<Mutex<Session>> = OnceLock::new();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bakes");
    let open = || Mutex::new(Session::new(Options { cache_dir: Some(folder), ..Options::default() }));
    SESSION.get_or_init(open).lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shot {
    fn scene(&self, session: &Session) -> Result<Scene, String> {
        let sets: Vec<_> = self.set.clone().into_iter().collect();
        let read = session.reader.scene(&Path::new(FOLDER).join(&self.scene), &sets);
        read.map(|(scene, _)| scene).map_err(|problems| problems.to_string())
    }
}

fn render(session: &mut Session, scene: &Scene) -> Result<Arc<Image>, String> {
    let rendered = session.render(scene, &Look::of(scene), &Quiet);
    rendered.map(|(_, image)| image).map_err(|problem| problem.to_string())
}

/// A picture as its file shows it, and the file.
fn developed(image: &Image, scene: &Scene) -> (Image, Vec<u8>) {
    let display = Display { tone: scene.view.tone, exposure_ev: scene.view.exposure_ev as f32 };
    let png = image.encode(Format::Png, display, &[]).expect("a picture can be encoded");
    (shown(&png).expect("what was encoded can be decoded"), png)
}

fn shown(png: &[u8]) -> Result<Image, String> {
    decode(png, Path::new("golden"), Encoding::Srgb)
        .map(|texture| texture.image())
        .map_err(|problem| problem.to_string())
}

/// How far two pictures are apart: whether that is within the tolerance, in words, and the map of it.
fn apart(actual: &Image, expected: &Image, tolerance: &Tolerance) -> Result<(bool, String, Flip), String> {
    let pair = Pair::new(actual, expected).map_err(|problem| problem.to_string())?;
    let levels = |pixel: &[f32; 3]| pixel.map(|v| (255.0 * diaphane::image::tone::srgb_from_linear(v)).round() as u8);
    let differences = actual.pixels.iter().zip(&expected.pixels).map(|(a, b)| {
        let (a, b) = (levels(a), levels(b));
        (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0)
    });
    let differences: Vec<u8> = differences.collect();
    let most = differences.iter().max().copied().unwrap_or(0);
    let beyond = differences.iter().filter(|d| **d > tolerance.levels).count() as f64 / differences.len() as f64;
    let flip = flip(&pair);
    let within = beyond <= tolerance.share && flip.spread.mean <= tolerance.flip_mean;
    let words = format!(
        "up to {most} levels; {:.2} % of the pixels differ by more than {} ({:.2} % may); FLIP {:.5} in the mean ({} may \
         be), {:.5} at the 99th percentile; tolerance of {}",
        100.0 * beyond,
        tolerance.levels,
        100.0 * tolerance.share,
        flip.spread.mean,
        tolerance.flip_mean,
        flip.spread.p99,
        tolerance.name
    );
    Ok((within, words, flip))
}

/// What is wrong with a picture, and what there is to see of it.
type Wrong = (String, Option<Case>);

fn judge(shot: &Shot, update: bool) -> Result<(), Wrong> {
    let bare = |message: String| (message, None);
    let mut session = session();
    let scene = shot.scene(&session).map_err(bare)?;
    let (actual, png) = developed(&*render(&mut session, &scene).map_err(bare)?, &scene);
    let file = Path::new(FOLDER).join(format!("{}.png", shot.name));
    if update {
        std::fs::write(&file, &png).map_err(|error| bare(format!("{}: {error}", file.display())))?;
    }
    let case = |message: &str, expected: Option<Vec<u8>>, flip: Option<&Flip>| {
        let size = (actual.width, actual.height);
        Some(Case::new(&shot.name, message, expected, png.clone(), flip.map(|flip| (&flip.map[..], size))))
    };
    let Ok(golden) = std::fs::read(&file) else {
        let message = format!("{} is missing: UPDATE=1 writes it; look at it, commit it", file.display());
        return Err((message.clone(), case(&message, None, None)));
    };
    let expected = shown(&golden).map_err(bare)?;
    let exact = session.gpu().map_err(|problem| bare(problem.to_string()))?.adapter.name.contains("llvmpipe");
    let tolerance = if exact { LLVMPIPE } else { ANY_ADAPTER };
    match apart(&actual, &expected, &tolerance) {
        Ok((true, ..)) => {}
        Ok((false, message, flip)) => {
            let seen = case(&message, Some(golden), Some(&flip));
            return Err((message, seen));
        }
        Err(message) => {
            let seen = case(&message, Some(golden), None);
            return Err((message, seen));
        }
    }
    teeth(&mut session, &scene, &actual, &expected, exact).map_err(bare)
}

/// Whatever ought to be noticed in a picture is noticed.
fn teeth(session: &mut Session, scene: &Scene, actual: &Image, expected: &Image, exact: bool) -> Result<(), String> {
    let mut shifted = actual.clone();
    for (i, pixel) in shifted.pixels.iter_mut().enumerate() {
        *pixel = actual.pixels[i - usize::from(i % actual.width as usize > 0)];
    }
    let mut swapped = actual.clone();
    swapped.pixels.iter_mut().for_each(|pixel| pixel.swap(0, 2));
    for (changed, what) in [(shifted, "a shift of one pixel"), (swapped, "swapped channels")] {
        for tolerance in [LLVMPIPE, ANY_ADAPTER] {
            if let (true, words, _) = apart(&changed, expected, &tolerance)? {
                return Err(format!("{what} is not noticed: {words}"));
            }
        }
    }
    if exact {
        let longer = developed(&*render(session, &longer_paths(scene))?, scene).0;
        if let (true, words, _) = apart(&longer, expected, &LLVMPIPE)? {
            return Err(format!("a mean free path that is a tenth longer is not noticed: {words}"));
        }
    }
    Ok(())
}

/// The same scene, but for the mean free path of every medium, which is a tenth longer.
fn longer_paths(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for object in &mut scene.objects {
        let mut material = (*object.material).clone();
        if let Substance::Translucent(medium) = &mut material.medium {
            medium.sigma_a /= 1.1;
            medium.sigma_s /= 1.1;
        }
        object.material = Arc::new(material);
    }
    scene
}

fn no_light() -> Result<(), Failed> {
    let dark = Shot { name: "dark".into(), scene: "lights.scene.ron".into(), set: BTreeMap::new() };
    let mut session = session();
    let scene = dark.scene(&session)?;
    let image = render(&mut session, &scene)?;
    match image.pixels.iter().position(|pixel| *pixel != [0.0; 3]) {
        None => Ok(()),
        Some(i) => Err(format!("without light, pixel {i} is {:?}", image.pixels[i]).into()),
    }
}

/// Two sessions that know nothing of each other, and keep nothing.
fn the_same_bits(shots: &[Shot]) -> Result<(), Failed> {
    let take = || -> Result<Vec<Arc<Image>>, String> {
        let mut session = Session::new(Options { no_cache: true, ..Options::default() });
        shots.iter().map(|shot| shot.scene(&session).and_then(|scene| render(&mut session, &scene))).collect()
    };
    let (first, second) = (take()?, take()?);
    for ((a, b), shot) in first.iter().zip(&second).zip(shots) {
        let differs = |(a, b): (&[f32; 3], &[f32; 3])| a.map(f32::to_bits) != b.map(f32::to_bits);
        let count = a.pixels.iter().zip(&b.pixels).filter(|pair| differs(*pair)).count();
        if count > 0 {
            return Err(format!("{}: {count} of {} pixels differ", shot.name, a.pixels.len()).into());
        }
    }
    Ok(())
}
