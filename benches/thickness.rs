//! What thickness costs and what it is worth: `cargo bench --bench thickness -- rays` compares the sweeps that bake lengths with
//! a traversal of a hierarchy of boxes, and `-- pictures` draws a figure lit from three sides by each method, measures it
//! against the truth with the brightness of all pictures made alike, as [Tomaszewska2012, fig. 4] does with observers, and
//! writes `docs/thickness.png`.

use diaphane::frame::Part;
use diaphane::geometry::{sculpture, thickness};
use diaphane::image::{Display, Format, Image, Tone, write_file};
use diaphane::metric::{Comparison, Pair};
use diaphane::render::Look;
use diaphane::scene::{LightKind, Scene, TechniqueText};
use diaphane::session::{Options, Session};
use diaphane::store::Watch;
use glam::{DQuat, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use std::path::Path;
use std::time::{Duration, Instant};

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let asked = |word: &str| words.iter().any(|w| w == word);
    let neither = !asked("rays") && !asked("pictures");
    if asked("rays") || neither {
        rays();
    }
    if asked("pictures") || neither {
        pictures();
    }
}

/// Rays that leave a figure's vertices inwards, on one thread.
fn rays() {
    const DIRECTIONS: usize = 256;
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
    for turn in 1..=3 {
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
    }
}

struct Quiet;
impl Watch for Quiet {}

const SIDES: [&str; 3] = ["back", "front", "left"];
const SIZE: (u32, u32) = (64, 64);
/// How many pixels of the sheet show one of a picture, along each side.
const SHOWN: u32 = 2;
const TRUTH: &str = "Reference(light: Direct, max_error: 0.03, max_spp: 128)";
const FIGURE: [&str; 5] = [
    "Opaque()",
    "FilteredNormals()",
    "DepthMapThickness()",
    "SphericalThickness()",
    "SphericalThickness(terms: Paper, attenuation: Linear, encode: Thickness)",
];

struct Studio {
    session: Session,
}

impl Studio {
    fn scene(&self, side: &str) -> Scene {
        let path = format!("scenes/bench/thickness-{side}.ron");
        self.session.scene(Path::new(&path)).unwrap_or_else(|problems| panic!("{problems}")).0
    }

    fn picture(&mut self, scene: &Scene, technique: &str, skip: bool) -> Image {
        let mut look = Look::of(scene);
        look.technique = TechniqueText::from_flag("--technique", technique).expect("it can be read");
        look.view.size = SIZE;
        look.view.part = Part::Scattered;
        look.view.skip = skip;
        let drawn = self.session.render(scene, &look, &Quiet).unwrap_or_else(|problem| panic!("{problem}"));
        drawn.1.as_ref().clone()
    }

    /// The median of five frames, ms, the lamp a little farther round each time.
    fn frame(&mut self, scene: &Scene, technique: &str, skip: bool) -> f64 {
        self.picture(scene, technique, skip);
        let mut times = [1, 2, 3, 4, 5].map(|i| {
            let mut moved = scene.clone();
            for light in &mut moved.lights {
                if let LightKind::Directional { direction, .. } = &mut light.kind {
                    *direction = DQuat::from_rotation_y(1e-3 * f64::from(i)) * *direction;
                }
            }
            let started = Instant::now();
            self.picture(&moved, technique, skip);
            1e3 * started.elapsed().as_secs_f64()
        });
        times.sort_by(f64::total_cmp);
        times[2]
    }
}

fn mean(image: &Image) -> f32 {
    image.pixels.iter().flatten().sum::<f32>() / (3 * image.pixels.len()) as f32
}

/// As bright as another in the mean.
fn alike(image: &Image, other: &Image) -> Image {
    let factor = mean(other) / mean(image).max(f32::MIN_POSITIVE);
    let pixels = image.pixels.iter().map(|pixel| pixel.map(|v| factor * v)).collect();
    Image { pixels, ..image.clone() }
}

fn pictures() {
    let options = Options { cache_dir: std::env::var_os("DIAPHANE_CACHE").map(Into::into), ..Options::default() };
    let mut studio = Studio { session: Session::new(options) };
    let mut rows: Vec<Vec<Image>> = Vec::new();
    println!(
        "\nside, method: mean over the truth's; DSSIM, FLIP at the truth's brightness; DSSIM, FLIP as it is; frame, ms"
    );
    for side in SIDES {
        let scene = studio.scene(side);
        let truth = studio.picture(&scene, TRUTH, true);
        let mut row = vec![truth.clone()];
        let measure = |studio: &mut Studio, technique: &str, skip: bool, name: &str| {
            let picture = studio.picture(&scene, technique, skip);
            let shown = alike(&picture, &truth);
            let told = |image: &Image| {
                let pair = Pair::new(image, &truth).expect("they are of one size");
                let found = Comparison::of(&pair, None).expect("they can be compared");
                format!("{:.4} {:.4}", found.dssim.all.mean, found.flip.spread.mean)
            };
            println!(
                "{side:5} {name:75} {:.3}  {}  {}  {:.1}",
                mean(&picture) / mean(&truth),
                told(&shown),
                told(&picture),
                studio.frame(&scene, technique, skip)
            );
            shown
        };
        for technique in FIGURE {
            let shown = measure(&mut studio, technique, true, technique);
            row.push(shown);
        }
        for bands in 2..=7 {
            let technique = format!("SphericalThickness(bands: {bands}, front_bands: {bands})");
            measure(&mut studio, &technique, true, &format!("{} coefficients", bands * bands));
        }
        rows.push(row);
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
