//! What filtered normals cost and how exact they are: engines, kernels and sizes of a mesh.
//!
//! `cargo bench --bench filters` prints a table; `cargo bench --bench filters -- --write` also writes it, with the machine, to
//! `tools/runs/filters.txt`. Arguments are the numbers of vertices, in thousands: `-- 2 35 140`; eigenpairs are found for up
//! to `PAIRS` of them. *bake* is from a mesh to its basis, *edit* from a kernel to new normals, on one core. Errors are the
//! largest difference from 40 steps of the same engine with poles around this kernel alone, which the tests hold against
//! dense algebra on smaller meshes.

use diaphane::bench::Machine;
use diaphane::geometry::mesh::Mesh;
use diaphane::geometry::shapes;
use diaphane::geometry::spectrum::kernel::Kernel;
use diaphane::geometry::spectrum::{Band, Basis, harmonic_normals, krylov_normals};
use diaphane::session::{Options, Session};
use std::fmt::Write;
use std::time::Instant;

/// Thousands of vertices for which eigenpairs are found, too.
const PAIRS: usize = 3;

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

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = Instant::now();
    let value = work();
    (value, 1e3 * begin.elapsed().as_secs_f64())
}

fn most_apart(a: &Basis, b: &Basis, kernel: &Kernel) -> f32 {
    let (a, b) = (a.filter(kernel, 1.0), b.filter(kernel, 1.0));
    a.iter().zip(&b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let mut sizes: Vec<usize> = words.iter().filter_map(|word| word.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![2, 35, 140];
    }
    let still = |_: f64| Ok(());
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be had");
    let mut table =
        String::from("vertices  engine     modes      bake     edit  kernel (knee over omega_m)     error\n");
    for thousands in sizes {
        let mesh = mesh(thousands);
        let vertices = mesh.positions.len();
        let omega_m = std::f64::consts::TAU / (10.0 * mesh.mean_edge_length());
        for share in [0.25, 1.0, 2.0] {
            let knee = share * omega_m;
            let band = Band::PerUnit(0.7 * knee, 2.8 * knee);
            let (basis, bake) =
                timed(|| one.install(|| krylov_normals(&mesh, band, &still)).expect("it has a Laplacian"));
            let exact = krylov_normals(&mesh, Band::PerUnit(knee, knee), &still).expect("it has a Laplacian");
            for kernel in [
                Kernel::Gaussian { width: 1.0 / knee },
                Kernel::Exponential { width: 1.0 / knee },
                Kernel::Medium { sigma_tr: knee },
            ] {
                let (_, edit) = timed(|| one.install(|| basis.filter(&kernel, 1.0)));
                let name = format!("{kernel:?}");
                let name = name.split(' ').next().unwrap_or_default();
                writeln!(
                    table,
                    "{vertices:8}  Krylov    {:6} {bake:7.0} ms {edit:5.1} ms  {name:<12} {share:5.2}          {:9.1e}",
                    basis.omega.len(),
                    most_apart(&basis, &exact, &kernel)
                )
                .expect("a text grows");
            }
        }
        if thousands <= PAIRS {
            let kernel = Kernel::Gaussian { width: 4.0 / omega_m };
            let (pairs, bake) =
                timed(|| one.install(|| harmonic_normals(&mesh, f64::MAX, &still)).expect("it has pairs"));
            let exact =
                krylov_normals(&mesh, Band::PerUnit(0.25 * omega_m, 0.25 * omega_m), &still).expect("it has one");
            let (_, edit) = timed(|| one.install(|| pairs.filter(&kernel, 1.0)));
            writeln!(
                table,
                "{vertices:8}  Harmonics {:6} {bake:7.0} ms {edit:5.1} ms  Gaussian      0.25          {:9.1e}",
                pairs.omega.len(),
                most_apart(&pairs, &exact, &kernel)
            )
            .expect("a text grows");
        }
        print!("{table}");
    }
    if words.iter().any(|word| word == "--write") {
        let mut session = Session::new(Options { no_cache: true, ..Options::default() });
        let machine = session.gpu().map(Machine::of).expect("there is an adapter, software will do");
        let profile = if cfg!(debug_assertions) { "a development build: upper bounds" } else { "a release build" };
        let Machine { cpu, threads, commit, date, .. } = machine;
        let text =
            format!("CPU:    {cpu}, {threads} threads\ncommit: {commit}\ndate:   {date}\nbuild:  {profile}\n\n{table}");
        std::fs::write("tools/runs/filters.txt", text).expect("tools/runs can be written");
    }
}
