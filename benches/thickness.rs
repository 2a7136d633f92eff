//! What thickness costs and what it is worth.
//!
//! `cargo bench --bench thickness -- rays` compares the sweeps that bake lengths with a traversal of a hierarchy of boxes.
//!
//! `-- pictures` draws a figure lit from three sides by each method and setting of `scenes/bench/thickness-*.bench.ron`, as
//! `diaphane bench` does, and holds each picture against the truth a second time, made as bright as that in the mean: so does
//! [Tomaszewska2012, fig. 4] with observers. Truths take most of the time, some minutes for each side; `-- pictures 128` makes
//! do with 128 paths per pixel. What was interrupted goes on where it was: samples are kept in `target/tmp/thickness`, truths
//! with all bakes. With `--write` the tables go to `tools/runs/thickness.txt`, above the words that stand there, and the sheet
//! of pictures to `docs/thickness.png`.

use diaphane::bench::errors::Traced;
use diaphane::bench::samples::{Samples, Subject};
use diaphane::bench::statistics::Quartiles;
use diaphane::bench::{Case, Machine, Measured, Record, Wishes, measure};
use diaphane::geometry::{sculpture, thickness};
use diaphane::image::{Display, Format, Image, Tone, write_file};
use diaphane::session::{Options, Session};
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
        pictures(words.iter().find_map(|word| word.parse().ok()), asked("--write"));
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
/// How many pixels of the sheet show one of a picture, along each side.
const SHOWN: u32 = 2;
/// The columns of the sheet, behind the truth.
const COLUMNS: [&str; 4] = ["SphericalThickness()", "DepthMapThickness()", "FilteredNormals()", "Opaque()"];
const SHEET: &str = "docs/thickness.png";
const TABLES: &str = "tools/runs/thickness.txt";
/// What is above is written, what is below is thought.
const RULE: &str = "----\n";

/// A picture as bright as the truth in the mean of what is seen, and the factor that takes.
fn alike(truth: &Traced, image: &Image) -> (Image, f32) {
    let mean = |image: &Image| {
        let seen = image.pixels.iter().zip(&truth.mask).filter(|(_, is_object)| **is_object);
        seen.flat_map(|(pixel, _)| pixel).map(|v| f64::from(*v)).sum::<f64>()
    };
    let factor = (mean(&truth.picture) / mean(image).max(f64::MIN_POSITIVE)) as f32;
    let pixels = image.pixels.iter().map(|pixel| pixel.map(|v| factor * v)).collect();
    (Image { pixels, ..image.clone() }, factor)
}

/// One row of both tables for one side: at the truth's brightness, and as it is.
fn rows(truth: &Traced, subject: &Subject, picture: &Image, samples: &Samples, plain: f64) -> [String; 2] {
    let (shown, factor) = alike(truth, picture);
    let errors = Samples(truth.errors(subject, &shown).unwrap_or_else(|problem| panic!("{problem}")));
    let error = |samples: &Samples, measure: &str| samples.value(subject, &format!("{measure}@volume")).expect("it is");
    let of = |samples: &Samples| ["relmse", "dssim", "flip_mean"].map(|measure| error(samples, measure));
    let [relmse, dssim, flip] = of(&errors);
    let alike = format!("{factor:8.3} {relmse:7.3} {dssim:.4} {flip:.4}");
    let [relmse, dssim, flip] = of(samples);
    let Quartiles { low, median, high, .. } =
        Quartiles::of(samples.values(subject, "frame").map(|time| time / plain)).expect("there are frames");
    let bias = error(samples, "bias");
    [alike, format!("{bias:+7.3} {relmse:7.3} {dssim:.4} {flip:.4} {median:5.2} ({low:4.2} to {high:5.2})")]
}

fn pictures(paths: Option<u64>, write: bool) {
    let options = Options { cache_dir: std::env::var_os("DIAPHANE_CACHE").map(Into::into), ..Options::default() };
    let mut session = Session::new(options);
    let machine = session.gpu().map(Machine::of).expect("there is an adapter, software will do");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("thickness");
    let mut record = Record::open(&folder, machine).unwrap_or_else(|problem| panic!("{problem}"));
    let Machine { cpu, threads, commit, date, .. } = &record.machine;
    let mut text = format!(
        "drawn:  {}\nCPU:    {cpu}, {threads} threads\ncommit: {commit}\ndate:   {date}\n",
        record.machine.drawn_on()
    );
    let (mut sheet, mut names, mut tables) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
    for side in SIDES {
        let path = format!("scenes/bench/thickness-{side}.ron");
        let wishes = Wishes::default();
        let mut case = Case::read(&session, Path::new(&path), &wishes).unwrap_or_else(|wrong| panic!("{wrong}")).0;
        case.max_samples = paths.unwrap_or(case.max_samples);
        let told = Told::default();
        let measured = measure(&mut session, &case, &mut record, &told, &|line| eprintln!("{line}"));
        let Measured { truths, shown, .. } = measured.unwrap_or_else(|problem| panic!("{problem}"));
        let [truth] = &truths[..] else { panic!("{path} is held against one truth") };
        text += &format!("{side:6} {}\n", truth.film.level(diaphane::bench::errors::PART));
        let picture = |name: &str| {
            let found = shown.iter().find(|shown| shown.subject.words() == name);
            found.unwrap_or_else(|| panic!("{path} is not measured with {name}"))
        };
        let plain = record.samples.values(&picture("Opaque()").subject, "frame");
        let plain = Quartiles::of(plain).expect("there are frames").median;
        names = shown.iter().map(|shown| shown.subject.words()).collect();
        for shown in &shown {
            let found = rows(truth, &shown.subject, &shown.picture, &record.samples, plain);
            tables.iter_mut().zip(found).for_each(|(table, row)| table.push(row));
        }
        let columns = COLUMNS.map(|name| alike(truth, &picture(name).picture).0);
        sheet.push([truth.picture.clone()].into_iter().chain(columns).collect::<Vec<Image>>());
    }
    let titles = [
        "At the brightness of the truth: the factor that this takes, relMSE, DSSIM, FLIP",
        "Brightness as it is: bias (0.26 is 26 % too bright), relMSE, DSSIM, FLIP, and the time of a frame over the median of \
         Opaque's, with quartiles",
    ];
    for (title, table) in titles.into_iter().zip(tables) {
        text += &format!("\n{title}\n\n{:90}", "");
        let width = table[0].len();
        SIDES.iter().for_each(|side| text += &format!("{side:^width$}   "));
        for (i, name) in names.iter().enumerate() {
            text += &format!("\n{name:90}");
            (0..SIDES.len()).for_each(|side| text += &format!("{}   ", table[side * names.len() + i]));
        }
        text += "\n";
    }
    println!("{text}");
    if write {
        let before = std::fs::read_to_string(TABLES).unwrap_or_default();
        let thought = before.split_once(RULE).map_or("", |(_, below)| below);
        std::fs::write(TABLES, format!("{text}\n{RULE}{thought}")).expect("tools/runs can be written");
        write_sheet(&sheet);
    }
}

/// One row for each side: the truth, then the columns.
fn write_sheet(rows: &[Vec<Image>]) {
    let (across, down) = (rows[0][0].width, rows[0][0].height);
    let (width, height) = (rows[0].len() as u32 * across * SHOWN, rows.len() as u32 * down * SHOWN);
    let texel = |i: u32| {
        let (x, y) = (i % width / SHOWN, i / width / SHOWN);
        rows[(y / down) as usize][(x / across) as usize].at(x % across, y % down)
    };
    let sheet = Image { width, height, pixels: (0..width * height).map(texel).collect() };
    let display = Display { tone: Tone::Srgb, exposure_ev: 0.0 };
    let png = sheet.encode(Format::Png, display, &[]).expect("a picture can be encoded");
    write_file(Path::new(SHEET), &png).unwrap_or_else(|problem| panic!("{problem}"));
}
