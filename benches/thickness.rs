//! What thickness costs and what it is worth: `cargo bench --bench thickness -- rays` compares the sweeps that bake lengths with
//! a traversal of a hierarchy of boxes, and `-- pictures` draws a figure lit from three sides by each method, measures it
//! against the truth with the brightness of all pictures made alike, as [Tomaszewska2012, fig. 4] does with observers, and
//! writes `docs/thickness.png`. Truths are those of `diaphane bench scenes/bench/thickness-*.ron`, which takes the times:
//! whoever of the two comes second finds them made, and so does who was interrupted. They take most of the time, some minutes
//! for each side; `-- pictures 128` makes do with 128 paths per pixel.

use diaphane::bench::errors;
use diaphane::geometry::{sculpture, thickness};
use diaphane::image::{Display, Format, Image, Tone, write_file};
use diaphane::metric::{Comparison, Pair};
use diaphane::render::Look;
use diaphane::scene::{Scene, TechniqueText, Truth};
use diaphane::session::{Goal, Options, Session};
use diaphane::store::{PlannedStep, Watch};
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let asked = |word: &str| words.iter().any(|w| w == word);
    let neither = !asked("rays") && !asked("pictures");
    if asked("rays") || neither {
        rays();
    }
    if asked("pictures") || neither {
        let paths = words.iter().find_map(|word| word.parse().ok()).unwrap_or(MAX_SAMPLES);
        pictures(paths.max(MIN_SAMPLES));
    }
}

/// Rays that leave a figure's vertices inwards, on one thread.
fn rays() {
    const DIRECTIONS: usize = 256;
    const TURNS: usize = 7;
    let mesh = sculpture::sculpture(sculpture::Figure::Hare, 5.0, 190);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be had");
    let count = mesh.positions.len() * DIRECTIONS / 2;
    println!("{} vertices, {} triangles, {count} rays inwards", mesh.positions.len(), mesh.triangles.len());

    let place = |v: u32| Vec3A::from(mesh.positions[v as usize]);
    let triangles: Vec<Triangle> =
        mesh.triangles.iter().map(|[a, b, c]| Triangle { v0: place(*a), v1: place(*b), v2: place(*c) }).collect();
    let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::slow_build(), &mut Duration::default());
    let ordered: Vec<Triangle> = bvh.primitive_indices.iter().map(|i| triangles[*i as usize]).collect();
    let directions: Vec<Vec3A> = thickness::antipodal_directions(DIRECTIONS).iter().map(|d| d.as_vec3a()).collect();
    let offset = 3e-5 * mesh.bounds().diagonal() as f32;
    let traced = |all: bool| {
        let (started, mut cast, mut met) = (Instant::now(), 0, 0.0);
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            for d in directions.iter().filter(|d| d.dot(Vec3A::from(*n)) < 0.0) {
                let ray = Ray::new(Vec3A::from(*p) - offset * Vec3A::from(*n), *d, 0.0, f32::INFINITY);
                let mut hit = RayHit::none();
                bvh.ray_traverse(ray, &mut hit, |ray, i| match ordered[i].intersect(ray) {
                    t if all => {
                        met += t.min(1.0);
                        f32::INFINITY
                    }
                    t => t,
                });
                cast += 1;
                met += hit.t.min(1.0);
            }
        }
        assert!(met > 0.0, "something is met");
        f64::from(cast) / started.elapsed().as_secs_f64()
    };
    let mut ratios = Vec::new();
    for turn in 1..=TURNS {
        let (first, every) = (traced(false), traced(true));
        let started = Instant::now();
        one.install(|| thickness::lengths(&mesh, DIRECTIONS, &|_| Ok(()))).expect("nobody interrupts");
        let swept = count as f64 / started.elapsed().as_secs_f64();
        println!(
            "run {turn}: CwBvh {:.2} M rays/s first hit, {:.2} all hits; sweeps {:.2} M rays/s, all hits, outward rays \
             for nothing: {:.2} times the first hits",
            first / 1e6,
            every / 1e6,
            swept / 1e6,
            swept / first
        );
        ratios.push(swept / first);
    }
    ratios.sort_by(f64::total_cmp);
    let (least, median, most) = (ratios[0], ratios[TURNS / 2], ratios[TURNS - 1]);
    println!("sweeps over first hits of the CwBvh: median {median:.2}, {least:.2} to {most:.2}");
}

/// A line for each tenth of what takes long.
#[derive(Default)]
struct Told(Mutex<(&'static str, u32)>);

impl Watch for Told {
    fn progress(&self, step: &PlannedStep, share: f64) {
        let now = (step.name, (10.0 * share) as u32);
        let mut last = self.0.lock().expect("no panic while telling");
        if step.is_bake() && *last != now {
            *last = now;
            eprintln!("  {}: {} %", step.about, 10 * now.1);
        }
    }
}

const SIDES: [&str; 3] = ["back", "front", "left"];
/// As `scenes/bench/thickness-*.bench.ron` have it.
const SIZE: (u32, u32) = (80, 128);
const AT_MOST: f64 = 0.02;
const MIN_SAMPLES: u64 = 64;
const MAX_SAMPLES: u64 = 1024;
/// How many pixels of the sheet show one of a picture, along each side.
const SHOWN: u32 = 2;
/// The columns of the sheet, behind the truth.
const COLUMNS: [&str; 4] = ["SphericalThickness()", "DepthMapThickness()", "FilteredNormals()", "Opaque()"];
const PAPERS: [&str; 2] = [
    "SphericalThickness(terms: Paper, attenuation: Linear, encode: Thickness)",
    "DepthMapThickness(terms: Paper, attenuation: Beer, sigma: Extinction)",
];

struct Studio {
    session: Session,
    told: Told,
}

/// What pictures are measured against.
struct Truthful {
    picture: Image,
    variance: Image,
    mask: Vec<bool>,
}

impl Studio {
    fn look(scene: &Scene, technique: &str) -> Look {
        let mut look = Look::of(scene);
        look.technique = TechniqueText::from_flag("--technique", technique).expect("it can be read");
        look.view.size = SIZE;
        look.view.part = errors::PART;
        look
    }

    fn truth(&mut self, scene: &Scene, max_samples: u64) -> Truthful {
        let view = Studio::look(scene, "Opaque()").view;
        let settings = errors::settings(Truth::Volume, scene, &view);
        let goal = Goal::Error { part: errors::PART, at_most: AT_MOST, min_samples: MIN_SAMPLES, max_samples };
        let film = self.session.trace(scene, &settings, &goal, &self.told, |film| {
            eprintln!("  {}", film.level(errors::PART));
        });
        let film = film.unwrap_or_else(|problem| panic!("{problem}"));
        println!("the truth: {}", film.level(errors::PART));
        Truthful {
            picture: film.picture(errors::PART),
            variance: film.variance(errors::PART),
            mask: film.pixels.iter().map(|pixel| pixel.is_object).collect(),
        }
    }

    fn picture(&mut self, scene: &Scene, technique: &str) -> Image {
        let look = Studio::look(scene, technique);
        let drawn = self.session.render(scene, &look, &self.told).unwrap_or_else(|problem| panic!("{problem}"));
        drawn.1.as_ref().clone()
    }
}

impl Truthful {
    fn mean(&self, image: &Image) -> f32 {
        let seen = || image.pixels.iter().zip(&self.mask).filter(|(_, is_object)| **is_object);
        seen().flat_map(|(pixel, _)| pixel).sum::<f32>() / (3 * seen().count()) as f32
    }

    /// As bright as the truth in the mean, and what that took.
    fn alike(&self, image: &Image) -> (Image, f32) {
        let factor = self.mean(&self.picture) / self.mean(image).max(f32::MIN_POSITIVE);
        let pixels = image.pixels.iter().map(|pixel| pixel.map(|v| factor * v)).collect();
        (Image { pixels, ..image.clone() }, factor)
    }

    fn told(&self, image: &Image) -> String {
        let pair =
            Pair::new(image, &self.picture).and_then(|pair| pair.masked(&self.mask)).expect("they are of one size");
        let found = Comparison::of(&pair, Some(&self.variance)).expect("they can be compared");
        format!("{:.4} {:.4} {:.4}", found.relmse.errors.all.mean, found.dssim.all.mean, found.flip.spread.mean)
    }
}

fn pictures(max_samples: u64) {
    let options = Options { cache_dir: std::env::var_os("DIAPHANE_CACHE").map(Into::into), ..Options::default() };
    let mut studio = Studio { session: Session::new(options), told: Told::default() };
    let mut rows: Vec<Vec<Image>> = Vec::new();
    println!("factor to the truth's brightness; relMSE, DSSIM, FLIP with it; the same three without");
    for side in SIDES {
        let path = format!("scenes/bench/thickness-{side}.ron");
        println!("\n{path}");
        let scene = studio.session.scene(Path::new(&path)).unwrap_or_else(|problems| panic!("{problems}")).0;
        let truth = studio.truth(&scene, max_samples);
        let mut measure = |technique: &str| {
            let picture = studio.picture(&scene, technique);
            let (shown, factor) = truth.alike(&picture);
            println!("{technique:75} {factor:7.3}  {}  {}", truth.told(&shown), truth.told(&picture));
            shown
        };
        let drawn: Vec<Image> = COLUMNS.iter().map(|technique| measure(technique)).collect();
        for technique in PAPERS {
            measure(technique);
        }
        for bands in 2..=7 {
            measure(&format!("SphericalThickness(bands: {bands}, front_bands: {bands})"));
        }
        rows.push([truth.picture].into_iter().chain(drawn).collect());
    }
    let (width, height) = (rows[0].len() as u32 * SIZE.0 * SHOWN, rows.len() as u32 * SIZE.1 * SHOWN);
    let texel = |i: u32| {
        let (x, y) = (i % width / SHOWN, i / width / SHOWN);
        let image = &rows[(y / SIZE.1) as usize][(x / SIZE.0) as usize];
        image.pixels[(y % SIZE.1 * SIZE.0 + x % SIZE.0) as usize]
    };
    let sheet = Image { width, height, pixels: (0..width * height).map(texel).collect() };
    let display = Display { tone: Tone::Srgb, exposure_ev: 0.0 };
    let png = sheet.encode(Format::Png, display, &[]).expect("a picture can be encoded");
    write_file(Path::new("docs/thickness.png"), &png).unwrap_or_else(|problem| panic!("{problem}"));
}
