use super::*;
use crate::geometry::normals::Normals;
use crate::geometry::shapes;
use glam::{DAffine3, DMat3};
use half::f16;

fn still(_: f64) -> Result<(), Problem> {
    Ok(())
}

fn smooth(mesh: Mesh) -> Mesh {
    mesh.with_normals(Normals::Smooth { crease_deg: 180.0 })
}

/// Bumps on a sphere, so that its normals have all frequencies.
fn bumpy(level: u32) -> Mesh {
    let mut mesh = shapes::sphere(1.0, level);
    for p in &mut mesh.positions {
        let r = 1.0 + 0.25 * (5.0 * p.x).sin() * (4.0 * p.y + 1.0).cos() + 0.1 * (11.0 * p.z).sin();
        *p *= r;
    }
    smooth(mesh)
}

/// The same with its upper half pressed flat: needles of one to ten thousand.
fn slivers() -> Mesh {
    let mut mesh = bumpy(3);
    mesh.positions.iter_mut().filter(|p| p.y > 0.3).for_each(|p| p.x *= 1e-4);
    smooth(mesh)
}

fn together(mut one: Mesh, other: &Mesh) -> Mesh {
    let first = one.positions.len() as u32;
    one.positions.extend(&other.positions);
    one.normals.extend(&other.normals);
    one.uvs.clear();
    one.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    one
}

/// The same surface with its vertices and triangles in another order, and where each vertex went.
fn shuffled(mesh: &Mesh) -> (Mesh, Vec<usize>) {
    let n = mesh.positions.len() as u32;
    // No divisor in common: a permutation.
    let step = (7u32..)
        .find(|step| (2..=*step).all(|d| !step.is_multiple_of(d) || !n.is_multiple_of(d)))
        .expect("there is one");
    let to = move |v: u32| (step * v + 3) % n;
    let mut shuffled = Mesh { uvs: vec![], ..mesh.clone() };
    for v in 0..n {
        shuffled.positions[to(v) as usize] = mesh.positions[v as usize];
        shuffled.normals[to(v) as usize] = mesh.normals[v as usize];
    }
    shuffled.triangles = mesh.triangles.iter().rev().map(|t| t.map(to)).collect();
    (shuffled, (0..n).map(|v| to(v) as usize).collect())
}

fn normals(mesh: &Mesh, laplacian: &Laplacian) -> Vec<DVec3> {
    laplacian.at_samples(mesh.normals.iter().map(|n| n.as_dvec3()))
}

fn smooth_kernels(knee: f64) -> [Kernel; 4] {
    [
        Kernel::Gaussian { width: 1.0 / knee },
        Kernel::Exponential { width: 1.0 / knee },
        Kernel::Diffusion { time: 0.5 / (knee * knee) },
        Kernel::Medium { sigma_tr: knee },
    ]
}

/// The field through a kernel at the samples, but for what the modes miss.
fn through(laplacian: &Laplacian, field: &[DVec3], modes: &Modes, kernel: &Kernel) -> Vec<DVec3> {
    let means = laplacian.means(field);
    let low = kernel.at(0.0, OMEGA_M);
    let sum = modes.sum(laplacian.samples(), |lambda| kernel.at(lambda.sqrt(), OMEGA_M));
    sum.iter().zip(&means).map(|(sum, mean)| *sum + low * *mean).collect()
}

fn worst(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, |m, d| if d <= m { m } else { d })
}

fn most_apart(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

/// The normals of a mesh through a kernel, by the Krylov engine, in f64 at the samples.
fn filtered(mesh: &Mesh, kernel: &Kernel, knee: f64) -> (Laplacian, Vec<DVec3>) {
    let laplacian = Laplacian::of(mesh, Areas::VertexArea);
    let field = normals(mesh, &laplacian);
    let edge = laplacian.edge;
    let (modes, _) = krylov::modes(&laplacian, &field, (knee * edge, knee * edge), 1e-5, &still).unwrap();
    let per_edge = Modes { lambda: modes.lambda.iter().map(|l| l / (edge * edge)).collect(), ..modes };
    let found = through(&laplacian, &field, &per_edge, kernel);
    (laplacian, found)
}

#[test]
fn krylov_agrees_with_all_eigenpairs_for_every_smooth_kernel() {
    let cube = shapes::slab(DVec3::new(2.0, 1.0, 0.5), (16, 12));
    for (name, mesh) in [("bumpy", bumpy(3)), ("slivers", slivers()), ("box", cube)] {
        let laplacian = Laplacian::of(&mesh, Areas::VertexArea);
        let field = normals(&mesh, &laplacian);
        let exact = harmonics::all(&laplacian, &field).unwrap();
        for step in [0.03, 0.125, 0.5, 2.0] {
            for ratio in [4.0, 16.0] {
                let band = (step * OMEGA_M, ratio * step * OMEGA_M);
                let (modes, error) = krylov::modes(&laplacian, &field, band, krylov::TOLERANCE, &still).unwrap();
                assert!(modes.lambda.len() <= 81 && error < krylov::TOLERANCE, "{name} {step}: {error}");
                for knee in [band.0, (band.0 * band.1).sqrt(), band.1] {
                    for kernel in smooth_kernels(knee) {
                        let [a, b] = [&modes, &exact].map(|modes| through(&laplacian, &field, modes, &kernel));
                        let apart = worst(&a, &b);
                        assert!(apart < 1e-3, "{name}, band {step} x {ratio}, {kernel:?}: {apart}");
                        // The estimate is a root mean square: a vertex may be farther off, but not by much more.
                        assert!(apart < 1e-4 + 60.0 * error, "{name}, {kernel:?}: {apart}, estimated {error}");
                    }
                }
            }
        }
        let [wide, wider] = [1.0, 1.1].map(|by| Kernel::Gaussian { width: 2.0 * by / OMEGA_M });
        let teeth = worst(&through(&laplacian, &field, &exact, &wide), &through(&laplacian, &field, &exact, &wider));
        assert!(teeth > 5e-3, "a kernel a tenth wider is told from this one: {teeth}");
    }
}

#[test]
fn a_kernel_that_lets_all_pass_is_the_identity_on_any_mesh() {
    let flat = bumpy(2).with_normals(Normals::Flat);
    let back_to_back = {
        let sheet = shapes::slab(DVec3::new(1.0, 1.0, 0.0), (3, 3));
        together(sheet.clone(), &sheet)
    };
    let one = Mesh { triangles: vec![[0, 1, 2], [0, 0, 1]], ..shapes::sphere(1.0, 0) };
    for mesh in [bumpy(2), flat, slivers(), shapes::cuboid(DVec3::ONE), back_to_back, one, shapes::sphere(1.0, 3)] {
        let basis = krylov_normals(&mesh, Areas::VertexArea, Band::PerEdge(0.5, 2.0), &still).unwrap();
        let same = basis.filter(&Kernel::Gaussian { width: 0.0 }, 3.0);
        assert!(same.iter().zip(&mesh.normals).all(|(a, b)| a.distance(*b) < 2e-6));
        let other = basis.filter(&Kernel::Gaussian { width: 3.0 }, 3.0);
        assert!(other.iter().all(|n| n.is_finite()));
    }
}

#[test]
fn the_normals_of_a_sphere_stay_radial_with_the_factor_of_their_frequency() {
    let radius = 2.0;
    for kernel in smooth_kernels(1.0) {
        let factor = kernel.at(2f64.sqrt() / radius, 1.0);
        let error = |level| {
            let mesh = shapes::sphere(radius, level);
            let (laplacian, found) = filtered(&mesh, &kernel, 1.0);
            let expected: Vec<DVec3> = normals(&mesh, &laplacian).iter().map(|n| factor * n).collect();
            worst(&found, &expected)
        };
        assert!(error(4) < 2e-3 && error(3) > 2.5 * error(4), "{kernel:?}: {} {}", error(3), error(4));
    }
}

#[test]
fn size_orientation_and_order_of_a_mesh_change_nothing() {
    let mesh = bumpy(3);
    let kernel = Kernel::Medium { sigma_tr: 2.0 };
    let (laplacian, base) = filtered(&mesh, &kernel, 2.0);
    let quarter = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
    let (_, turned) = filtered(&mesh.transformed(&DAffine3::from_mat3(quarter)), &kernel, 2.0);
    assert!(worst(&turned, &base.iter().map(|n| quarter * n).collect::<Vec<_>>()) < 1e-5);
    for k in [2f64.powi(-60), 2f64.powi(60)] {
        let scaled = mesh.transformed(&DAffine3::from_scale(DVec3::splat(k)));
        let (_, again) = filtered(&scaled, &Kernel::Medium { sigma_tr: 2.0 / k }, 2.0 / k);
        // Normals are made unit again, in f32.
        assert!(worst(&again, &base) < 1e-6);
    }
    let (mixed, to) = shuffled(&mesh);
    let (other, again) = filtered(&mixed, &kernel, 2.0);
    // Both are as near to the truth as the engine comes.
    let here = |v: usize| base[laplacian.sample[v] as usize];
    let there = |v: usize| again[other.sample[to[v]] as usize];
    assert!((0..to.len()).all(|v| here(v).distance(there(v)) < 1e-5));
}

/// On a sphere and on a cube frequencies are repeated, and another order of the vertices may find other waves of the same ones.
/// The squares of a cube could be cut by either diagonal besides.
#[test]
fn any_waves_of_a_repeated_frequency_make_the_same_field() {
    let cube = |cells| shapes::slab(DVec3::splat(1.0), (cells, cells));
    // All by dense algebra, but for the last one, whose pairs are found by bands.
    for (name, mesh) in [("sphere", shapes::sphere(1.0, 3)), ("cube", cube(12)), ("fine cube", cube(20))] {
        let (other, to) = shuffled(&mesh);
        let mut found = [&mesh, &other]
            .map(|mesh| harmonic_normals(mesh, Areas::VertexArea, f64::MAX, &still).expect("it has pairs"));
        let apart = |found: &[Basis; 2], kernel: &Kernel| {
            let [here, there] = found.each_ref().map(|basis| basis.filter(kernel, 1.0));
            (0..to.len()).map(|v| here[v].distance(there[to[v]])).fold(0.0, f32::max)
        };
        let omega = found[0].omega.clone();
        let repeated = (0..omega.len() - 1)
            .find(|k| omega[k + 1] < omega[*k] * (1.0 + 1e-6) && found[0].coefficients[*k].length() > 1e-2)
            .unwrap_or_else(|| panic!("{name} repeats no frequency: {omega:?}"));
        // Kernels that begin to fall there, and one that ends above.
        let at = omega[repeated];
        let kernels = [
            Kernel::Gaussian { width: 0.5 / at },
            Kernel::Medium { sigma_tr: at },
            Kernel::Box { wavelength: TAU / (1.01 * at) },
        ];
        for kernel in &kernels {
            let apart = apart(&found, kernel);
            println!("{name}, {kernel:?}: {apart:.1e}");
            assert!(apart < 1e-6, "{name}, {kernel:?}: {apart}");
        }
        // Those of a cube are equal to the last bits, and half of such a pair is another half in each order. Those of a sphere
        // are told apart by the rounding of its vertices.
        if name != "sphere" {
            found.iter_mut().for_each(|basis| basis.coefficients[repeated] = DVec3::ZERO);
            assert!(apart(&found, &kernels[0]) > 1e-3, "{name}: {}", apart(&found, &kernels[0]));
        }
    }
}

#[test]
fn nothing_is_lost_and_nothing_leaks() {
    let (one, other) = (bumpy(3), shapes::torus(0.5, 0.2, (24, 12)));
    let both = together(one.clone(), &other.transformed(&DAffine3::from_translation(DVec3::X * 4.0)));
    let kernel = Kernel::Gaussian { width: 0.2 };
    let (laplacian, found) = filtered(&both, &kernel, 5.0);
    let field = normals(&both, &laplacian);
    for component in [0, 1] {
        let sum = |field: &[DVec3]| -> DVec3 {
            let parts = laplacian.component.iter().zip(&laplacian.areas).zip(field);
            parts.filter(|((c, _), _)| **c == component).map(|((_, area), value)| *area * *value).sum()
        };
        let area: f64 = laplacian.areas.iter().sum();
        assert!(sum(&found).distance(sum(&field)) < 1e-10 * area, "F(0) = 1: component {component}");
    }
    let (_, alone) = filtered(&one, &kernel, 5.0);
    assert!(worst(&found[..alone.len()], &alone) < 1e-4);
}

#[test]
fn another_triangulation_gives_nearly_the_same_field() {
    // Around the tube, one side has eight times the vertices.
    let coarse = shapes::torus(1.0, 0.4, (48, 24));
    let fine = shapes::torus(1.0, 0.4, (48, 96));
    let kernel = Kernel::Gaussian { width: 0.25 };
    let [(a, coarse_field), (b, fine_field)] = [&coarse, &fine].map(|mesh| filtered(mesh, &kernel, 4.0));
    let mut compared = 0;
    for (v, p) in coarse.positions.iter().enumerate() {
        if let Some(w) = fine.positions.iter().position(|q| q.distance(*p) < 1e-5) {
            let (here, there) = (coarse_field[a.sample[v] as usize], fine_field[b.sample[w] as usize]);
            assert!(here.distance(there) < 0.01, "{}", here.distance(there));
            compared += 1;
        }
    }
    assert!(compared > 1000);
}

#[test]
fn halves_on_the_device_cost_little_and_interruptions_end_a_bake() {
    let mesh = bumpy(4);
    let kernel = Kernel::Medium { sigma_tr: 4.0 };
    let basis = krylov_normals(&mesh, Areas::VertexArea, Band::PerUnit(2.0, 8.0), &still).unwrap();
    let columns = basis.columns.iter().map(|v| f16::from_f32(*v).to_f32()).collect();
    let halves = Basis { columns, ..basis.clone() };
    let apart = most_apart(&basis.filter(&kernel, 1.0), &halves.filter(&kernel, 1.0));
    println!("halves instead of floats: {apart:.1e}");
    assert!(apart < 5e-4, "{apart}");
    let stop: Tick = &|_| Err(Problem::files("enough"));
    assert!(krylov_normals(&mesh, Areas::VertexArea, Band::PerUnit(2.0, 8.0), stop).is_err());
    assert!(harmonic_normals(&mesh, Areas::VertexArea, 1.0, stop).is_err());
}

#[test]
fn both_engines_agree_where_eigenpairs_reach() {
    let mesh = bumpy(4);
    // Wide enough that nothing is left at omega_m.
    let edge = mesh.mean_edge_length();
    let kernel = Kernel::Gaussian { width: 4.0 * edge / OMEGA_M };
    let a = krylov_normals(&mesh, Areas::VertexArea, Band::PerEdge(0.1, 0.4), &still).unwrap();
    let b = harmonic_normals(&mesh, Areas::VertexArea, f64::MAX, &still).unwrap();
    let apart = most_apart(&a.filter(&kernel, 1.0), &b.filter(&kernel, 1.0));
    assert!(apart < 1e-3, "{apart}");
    assert!((b.cut * edge / OMEGA_M - 1.0).abs() < 1e-2 && b.omega.iter().all(|omega| *omega <= b.cut * 1.001));
    // What lies above omega_m is weighted by the mean from there to the finest frequency.
    let narrow = Kernel::Gaussian { width: edge / (2.0 * OMEGA_M) };
    let weights = b.weights(&narrow, 1.0);
    assert!((weights.high - narrow.mean(OMEGA_M / edge, FINEST / edge, 1.0)).abs() < 1e-3);
    assert!(weights.high > 0.2 && weights.high < 0.6, "{}", weights.high);
}

#[test]
fn the_printed_equation_is_the_same_on_an_even_mesh_and_another_on_an_uneven_one() {
    let kernel = Kernel::Gaussian { width: 0.5 };
    let fields = |mesh: &Mesh| {
        [Areas::VertexArea, Areas::MeanArea]
            .map(|by| krylov_normals(mesh, by, Band::PerUnit(2.0, 2.0), &still).unwrap().filter(&kernel, 1.0))
    };
    let [own, mean] = fields(&shapes::sphere(1.0, 0));
    assert!(most_apart(&own, &mean) < 1e-6, "{}", most_apart(&own, &mean));
    // On the inside of a ring triangles are small: waves there count as longer, so that less of them is taken away.
    let torus = shapes::torus(1.0, 0.4, (48, 24));
    let [own, mean] = fields(&torus);
    assert!(most_apart(&own, &mean) > 0.02, "{}", most_apart(&own, &mean));
    let inside = (0..torus.positions.len()).min_by(|a, b| {
        let axis = |v: usize| torus.positions[v].length();
        axis(*a).total_cmp(&axis(*b))
    });
    let v = inside.expect("it has vertices");
    assert!(mean[v].length() > own[v].length(), "{} {}", mean[v], own[v]);
}

#[test]
fn light_on_very_many_parts_is_refused_before_memory_is_taken() {
    let scattered = |parts: u32| {
        let corner = |i: u32| Vec3::new((i / 3) as f32, (i % 3 == 1) as u32 as f32, (i % 3 == 2) as u32 as f32);
        let positions: Vec<Vec3> = (0..3 * parts).map(corner).collect();
        let normals = vec![Vec3::X; positions.len()];
        Mesh {
            positions,
            normals,
            triangles: (0..parts).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..Mesh::default()
        }
    };
    let some = all_harmonics(&scattered(50), f64::MAX, &still).unwrap();
    assert_eq!(some.omega.iter().filter(|omega| **omega == 0.0).count(), 50);
    let problem = all_harmonics(&scattered(4000), f64::MAX, &still).expect_err("4000 times 12000 are too many");
    assert!(problem.to_string().contains("4000 separate parts"), "{problem}");
}
