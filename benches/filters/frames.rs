//! What a frame with filtered normals costs, and how far its picture is from the truth: a rippled knot in a sun and a room,
//! by each engine and kernel, beside `Opaque`.
//!
//! After a frame of each that is not counted, every round draws one more of each, in an order that is drawn by lot, with
//! camera and lights a step on, so that nothing stays but what a bake or the shape decides. Times are medians with their
//! quartiles; *over paint* are those of a frame divided by `Opaque`'s of the same round, so that what else the machine does
//! falls on both. *paint again* is `Opaque` in a scene of its own: how far its ratio and quartiles are from 1 is what the
//! machine alone does to them. Frames with one normal are seen to have `Opaque`'s passes.
//!
//! Errors are those of `diaphane bench`: relMSE less the truth's variance, DSSIM, FLIP, bias. Scenes and truths are kept, and
//! found by the next run; `diaphane bench` finds the scenes in `target/tmp`, and the truths of its own making are these.

use super::{PAIRS, mesh};
use diaphane::bench::errors::{self, PART, Traced};
use diaphane::bench::samples::Samples;
use diaphane::bench::statistics::Quartiles;
use diaphane::bench::timing::{Bakes, Warm, draw};
use diaphane::bench::{Case, Contender, ORDER_SEED, Wishes};
use diaphane::geometry::mesh::Mesh;
use diaphane::reference::random::Random;
use diaphane::scene::{TechniqueText, Truth};
use diaphane::session::{Goal, Options, Session};
use diaphane::store::{Values, Watch};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const ROUNDS: usize = 21;

/// Engine, technique and kernel, mm; the first is what the others are measured against.
const ROWS: [(&str, &str, &str); 15] = [
    ("paint", "Opaque()", "Gaussian(width: 1)"),
    ("paint again", "Opaque()", "Gaussian(width: 1)"),
    ("Krylov", "FilteredNormals()", "Gaussian(width: 1)"),
    ("Krylov", "FilteredNormals()", "Exponential(width: 1)"),
    ("Krylov", "FilteredNormals()", "Diffusion(time_mm2: 0.5)"),
    ("Krylov", "FilteredNormals()", "Curve(points: [(0, 1), (2, 0)])"),
    ("Krylov", "FilteredNormals(engine: Krylov)", "Normalized(std: 0.25)"),
    ("Krylov", "FilteredNormals()", "Gaussian(width: (1.2, 1, 0.8))"),
    ("Krylov", "FilteredNormals()", "FromMedium()"),
    ("Harmonics", "FilteredNormals(engine: Harmonics)", "Gaussian(width: 1)"),
    ("Harmonics", "FilteredNormals()", "Box(wavelength: 4)"),
    ("Harmonics", "FilteredNormals()", "Normalized(std: 0.25)"),
    ("light", "FilteredNormals(signal: Irradiance)", "Gaussian(width: 1)"),
    ("neighbours", "FilteredNormals()", "Neighbours(sigma_tr: 1, radius: 3)"),
    ("neighbours", "FilteredNormals()", "Neighbours(sigma_tr: (0.8, 1, 1.2), radius: 3)"),
];

struct Told;
impl Watch for Told {}

/// The knot as a file, and a scene of it for each kernel. What is there as it should be is not written again.
fn scene(folder: &Path, thousands: usize, mesh: &Mesh, row: usize) -> PathBuf {
    let write = |name: String, text: String| {
        let path = folder.join(name);
        if std::fs::read(&path).is_ok_and(|there| there == text.as_bytes()) {
            return path;
        }
        std::fs::write(&path, text).expect("the folder for such things can be written");
        path
    };
    let mut obj = String::new();
    for p in &mesh.positions {
        writeln!(obj, "v {} {} {}", p.x, p.y, p.z).expect("a text grows");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).expect("a text grows");
    }
    write(format!("knot-{thousands}.obj"), obj);
    let kernel = ROWS[row].2;
    let medium = "ReducedCoefficients(sigma_a: (0.008, 0.012, 0.02), sigma_s_prime: (2.4, 2.3, 2.2))";
    write(
        format!("knot-{row}.material.ron"),
        format!("Material(version: 1, surface: (ior: 1.4, roughness: 0.5), medium: {medium}, filter: {kernel})"),
    );
    write(
        format!("knot-{thousands}-{row}.ron"),
        format!(
            "Scene(version: 1, mm_per_unit: 10, camera: (eye: (0, 0, 12), fov_y_deg: 14),
             lights: [Directional(direction: (-1, -0.6, -0.7), irradiance: 3), Environment(radiance: 0.1)],
             objects: [(name: \"knot\", mesh: File(\"knot-{thousands}.obj\"), material: \"knot-{row}.material.ron\",
                        normals: Smooth(crease_deg: 180))],
             view: (size: (96, 64)), reference: (max_error: 0.15, max_spp: 1024))"
        ),
    )
}

/// One row as it is measured.
struct Entry {
    row: usize,
    contender: Contender,
    made: Values,
    warm: Warm,
    /// ms
    times: Vec<f64>,
    passes: Vec<&'static str>,
}

pub fn frames(sizes: &[usize]) -> String {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let options = Options { cache_dir: std::env::var_os("DIAPHANE_CACHE").map(Into::into), ..Options::default() };
    let mut session = Session::new(options);
    session.timed = true;
    let mut table = String::from(
        "                                                                                                                                relMSE  DSSIM   FLIP    bias\n\
         vertices  engine       kernel                                           normals   frame, ms (quartiles)   over paint (quartiles)   against the volumetric truth, then the diffusion truth\n",
    );
    for &thousands in sizes {
        let mesh = mesh(thousands);
        measured(&mut session, &folder, thousands, &mesh, &mut table);
        print!("{table}");
    }
    table
}

fn measured(session: &mut Session, folder: &Path, thousands: usize, mesh: &Mesh, table: &mut String) {
    let cancel = session.store.cancel.clone();
    let (mut entries, mut truths, mut bakes) = (Vec::new(), Vec::new(), Bakes::default());
    for (row, (engine, technique, kernel)) in ROWS.iter().enumerate() {
        if thousands > PAIRS && ["Harmonics", "light"].contains(engine) {
            continue;
        }
        eprintln!("{thousands} thousand vertices: {engine}, {kernel}");
        let techniques = vec![TechniqueText::from_flag("technique", technique).expect("it can be read")];
        let wishes = Wishes { techniques, ..Wishes::default() };
        let path = scene(folder, thousands, mesh, row);
        let mut case = Case::read(session, &path, &wishes).unwrap_or_else(|problems| panic!("{problems}")).0;
        // The truth knows nothing of kernels: that of the first scene is everybody's.
        for truth in [Truth::Volume, Truth::Bssrdf].into_iter().filter(|_| row == 0) {
            let settings = errors::settings(truth, &case.scene, &case.look.view);
            let goal =
                Goal::Error { part: PART, at_most: case.max_error, min_samples: 64, max_samples: case.max_samples };
            let film = session.trace(&case.scene, &settings, &goal, &Told, |film| eprintln!("  {}", film.level(PART)));
            let film = film.unwrap_or_else(|problem| panic!("{problem}"));
            writeln!(table, "{:8}  the {}: {}", mesh.positions.len(), truth.title(), film.level(PART))
                .expect("a text grows");
            truths.push(Traced::new(truth, film));
        }
        let contender = case.contenders.pop().expect("one technique was asked for");
        let made = bakes.made(session, &contender.frame.0, &Told).unwrap_or_else(|problem| panic!("{problem}"));
        let gpu = session.gpu().expect("there is an adapter, software will do");
        let warm = Warm::up(gpu, &contender, &made, &cancel, &Told).unwrap_or_else(|problem| panic!("{problem}"));
        entries.push(Entry { row, contender, made, warm, times: Vec::new(), passes: Vec::new() });
    }
    let gpu = session.gpu().expect("there is an adapter, software will do");
    let mut random = Random::new(ORDER_SEED, 0, 0);
    // The first round is not counted.
    for round in 0..=ROUNDS {
        let mut lots: Vec<usize> = (0..entries.len()).collect();
        for i in (1..lots.len()).rev() {
            lots.swap(i, random.choice(i + 1));
        }
        for place in lots {
            let entry = &mut entries[place];
            let passes = entry.warm.again(gpu, &entry.contender, &cancel, &Told);
            let passes = passes.unwrap_or_else(|problem| panic!("{problem}"));
            if round > 0 {
                entry.times.push(passes.values().sum());
            }
            entry.passes = passes.into_keys().collect();
        }
    }
    let paint = &entries[0];
    for entry in &entries {
        let (engine, _, kernel) = ROWS[entry.row];
        let one = entry.contender.frame.0.steps().iter().filter(|step| {
            ["filtered_normals.reconstruct", "filtered_normals.neighbours", "filtered_normals.spread"]
                .contains(&step.name)
        });
        let normals = one.count().max(1);
        assert!(engine == "light" || entry.passes == paint.passes, "{:?} {:?}", entry.passes, paint.passes);
        let quartiles = |values: Vec<f64>| Quartiles::of(values).expect("there are rounds");
        let frame = quartiles(entry.times.clone());
        let ratio = quartiles(entry.times.iter().zip(&paint.times).map(|(time, paint)| time / paint).collect());
        write!(
            table,
            "{:8}  {engine:<12} {:<48} {normals:2}  {:6.1} ({:5.1} to {:5.1})   {:5.3} ({:5.3} to {:5.3})  ",
            mesh.positions.len(),
            if engine.starts_with("paint") { "" } else { kernel },
            frame.median,
            frame.low,
            frame.high,
            ratio.median,
            ratio.low,
            ratio.high
        )
        .expect("a text grows");
        let picture = draw(gpu, &entry.contender.picture, &entry.made, &cancel, &Told);
        let picture = picture.unwrap_or_else(|problem| panic!("{problem}"));
        let subject = &entry.contender.subject;
        for truth in &truths {
            let found = Samples(truth.errors(subject, &picture).unwrap_or_else(|problem| panic!("{problem}")));
            let value = |measure: &str| {
                found.value(subject, &format!("{measure}@{}", truth.truth.word())).expect("it was measured")
            };
            write!(
                table,
                " {:7.4} {:6.4} {:6.4} {:+6.3}  ",
                value("relmse"),
                value("dssim"),
                value("flip_mean"),
                value("bias")
            )
            .expect("a text grows");
        }
        table.push('\n');
    }
}
