//! What filtered normals cost and how exact they are: engines, kernels and sizes of a mesh.
//!
//! `cargo bench --bench filters -- fields` prints a table of fields of normals, `-- frames` one of frames and pictures
//! ([`frames`]), without either word both; with `--write` they are written, with the machine, to `tools/runs/filters.txt` and
//! `tools/runs/filtered-frames.txt`. Other arguments are the numbers of vertices, in thousands: `-- fields 2 35 140`;
//! eigenpairs are found for up to [`PAIRS`] of them. *bake* is from a mesh to its basis, *first* from a kernel to new normals
//! for the first time and *edit* the median of more, in time that one core had for it: what else the machine does makes it no
//! longer. Errors are the largest difference at any vertex from a space made for this kernel alone with a tolerance of 1e-8,
//! which the tests hold against dense algebra on smaller meshes.

mod frames;

use diaphane::bench::Machine;
use diaphane::geometry::laplacian::{Areas, Laplacian};
use diaphane::geometry::mesh::Mesh;
use diaphane::geometry::shapes;
use diaphane::geometry::spectrum::kernel::Kernel;
use diaphane::geometry::spectrum::{Band, Basis, harmonic_normals, krylov, krylov_normals};
use diaphane::session::{Options, Session};
use glam::Vec3;
use std::fmt::Write;

/// Thousands of vertices for which eigenpairs are found, too: a hundred times the work.
const PAIRS: usize = 40;

/// Edits of each kind.
const EDITS: usize = 9;

/// A knot with ripples, of about so many thousand vertices.
fn mesh(thousands: usize) -> Mesh {
    let along = (9000.0 * thousands as f64).sqrt() as u32;
    let around = thousands as u32 * 1000 / along;
    let mut mesh = shapes::torus_knot(2, 3, 1.0, 0.3, (along, around));
    for (p, n) in mesh.positions.iter_mut().zip(&mesh.normals) {
        *p += 0.01 * (40.0 * p.x).sin() * (37.0 * p.y).cos() * *n;
    }
    mesh.with_normals(diaphane::geometry::normals::Normals::Smooth { crease_deg: 180.0 })
}

/// How long this thread has had a core, ms. Linux brings that up to date when a thread yields.
fn core_ms() -> f64 {
    std::thread::yield_now();
    let books = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux tells a thread's time");
    1e-6 * books.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).expect("nanoseconds come first")
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = core_ms();
    let value = work();
    (value, core_ms() - begin)
}

/// The first edit's time and the median of more, ms.
fn edits(basis: &Basis, kernel: &Kernel) -> (f64, f64) {
    let edit = || timed(|| std::hint::black_box(basis.filter(kernel, 1.0))).1;
    let first = edit();
    let mut more: Vec<f64> = (0..EDITS).map(|_| edit()).collect();
    more.sort_by(f64::total_cmp);
    (first, more[EDITS / 2])
}

/// What a mesh's normals are through a kernel, to all digits that count.
struct Exact<'a> {
    mesh: &'a Mesh,
    laplacian: Laplacian,
}

impl Exact<'_> {
    fn of(mesh: &Mesh) -> Exact<'_> {
        Exact { mesh, laplacian: Laplacian::of(mesh, Areas::VertexArea) }
    }

    /// By how much a basis is off, at most.
    fn error(&self, basis: &Basis, kernel: &Kernel, knee: f64) -> f32 {
        let laplacian = &self.laplacian;
        let field = laplacian.at_samples(self.mesh.normals.iter().map(|n| n.as_dvec3()));
        let knee = knee * laplacian.edge;
        let (modes, _) = krylov::modes(laplacian, &field, (knee, knee), 1e-8, &|_| Ok(())).expect("it has modes");
        let sums = modes.sum(laplacian.samples(), |lambda| kernel.at(lambda.sqrt() / laplacian.edge, 1.0));
        let exact: Vec<Vec3> =
            laplacian.means(&field).iter().zip(&sums).map(|(mean, sum)| (*mean + *sum).as_vec3()).collect();
        let found = basis.filter(kernel, 1.0);
        let apart = found.iter().zip(&laplacian.sample).map(|(found, s)| found.distance(exact[*s as usize]));
        apart.fold(0.0, f32::max)
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let asked = |word: &str| words.iter().any(|w| w == word);
    let sizes: Vec<usize> = words.iter().filter_map(|word| word.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![2, 35, 140] } else { sizes };
    let neither = !asked("fields") && !asked("frames");
    for (word, table, file) in [
        ("fields", fields as fn(&[usize]) -> String, "tools/runs/filters.txt"),
        ("frames", frames::frames, "tools/runs/filtered-frames.txt"),
    ] {
        if !asked(word) && !neither {
            continue;
        }
        let table = table(&sizes);
        if asked("--write") {
            // What is below the rule is thought, not written.
            let before = std::fs::read_to_string(file).unwrap_or_default();
            let below = before.find("\n----\n").map_or("", |rule| &before[rule..]);
            std::fs::write(file, format!("{}\n{table}{below}", machine())).expect("tools/runs can be written");
        }
    }
}

/// What it was measured on.
fn machine() -> String {
    let mut session = Session::new(Options { no_cache: true, ..Options::default() });
    let machine = session.gpu().map(Machine::of).expect("there is an adapter, software will do");
    let profile = if cfg!(debug_assertions) { "a development build: upper bounds" } else { "a release build" };
    let Machine { cpu, threads, commit, date, .. } = &machine;
    let drawn_on = machine.drawn_on();
    format!(
        "CPU:    {cpu}, {threads} threads\ndrawn:  {drawn_on}\ncommit: {commit}\ndate:   {date}\nbuild:  {profile}\n"
    )
}

/// The table of bakes, edits and errors of fields.
fn fields(sizes: &[usize]) -> String {
    let still = |_: f64| Ok(());
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be had");
    let mut table =
        String::from("vertices  engine     modes      bake     first     edit  kernel (knee over omega_m)     error\n");
    for &thousands in sizes {
        let mesh = mesh(thousands);
        let vertices = mesh.positions.len();
        let exact = Exact::of(&mesh);
        let omega_m = std::f64::consts::TAU / (10.0 * mesh.mean_edge_length());
        for share in [0.25, 1.0, 2.0] {
            let knee = share * omega_m;
            let band = Band::PerUnit(0.7 * knee, 2.8 * knee);
            let (basis, bake) = one.install(|| {
                timed(|| krylov_normals(&mesh, Areas::VertexArea, band, &still).expect("it has a Laplacian"))
            });
            for kernel in [
                Kernel::Gaussian { width: 1.0 / knee },
                Kernel::Exponential { width: 1.0 / knee },
                Kernel::Medium { sigma_tr: knee },
            ] {
                let (first, edit) = one.install(|| edits(&basis, &kernel));
                let name = format!("{kernel:?}");
                let name = name.split(' ').next().unwrap_or_default();
                writeln!(
                    table,
                    "{vertices:8}  Krylov    {:6} {bake:7.0} ms {first:6.1} ms {edit:5.1} ms  {name:<12} {share:5.2}          {:9.1e}",
                    basis.omega.len(),
                    exact.error(&basis, &kernel, knee)
                )
                .expect("a text grows");
            }
        }
        if thousands <= PAIRS {
            let kernel = Kernel::Gaussian { width: 4.0 / omega_m };
            let (pairs, bake) = one.install(|| {
                timed(|| harmonic_normals(&mesh, Areas::VertexArea, f64::MAX, &still).expect("it has pairs"))
            });
            let (first, edit) = one.install(|| edits(&pairs, &kernel));
            writeln!(
                table,
                "{vertices:8}  Harmonics {:6} {bake:7.0} ms {first:6.1} ms {edit:5.1} ms  Gaussian      0.25          {:9.1e}",
                pairs.omega.len(),
                exact.error(&pairs, &kernel, 0.25 * omega_m)
            )
            .expect("a text grows");
        }
        print!("{table}");
    }
    table
}
