use super::*;
use crate::geometry::normals::Normals;
use crate::geometry::shapes;
use crate::optics::sh::sh_basis;
use glam::{DMat3, DQuat, Vec3, vec3};

const N: usize = 256;

fn run(mesh: &Mesh) -> Lengths {
    lengths(mesh, N, &|_| Ok(())).unwrap()
}

fn thickness(lengths: &Lengths, bands: usize) -> Harmonics {
    let diagonal = lengths.diagonal;
    project(lengths, None, bands, |span| [span.share * diagonal], &|_| Ok(())).unwrap()
}

/// One step of what is kept, as a length.
fn step(lengths: &Lengths) -> f64 {
    lengths.diagonal / f64::from(STEPS)
}

/// The sphere that an icosphere stands for: of the same volume.
fn ball(subdivisions: u32) -> (Mesh, f64) {
    let mesh = shapes::sphere(1.0, subdivisions);
    let radius = (mesh.signed_volume() * 0.75 / PI).cbrt();
    (mesh, radius)
}

#[test]
fn a_sphere_is_as_thick_as_its_chords() {
    let (mesh, radius) = ball(5);
    let (lengths, mut sum) = (run(&mesh), 0.0);
    for (v, p) in mesh.positions.iter().enumerate() {
        for (k, d) in antipodal_directions(N).iter().enumerate() {
            let expected = 2.0 * radius * (-p.as_dvec3().dot(*d)).max(0.0);
            let error = (lengths.at(v, k).share * lengths.diagonal - expected).abs();
            // A ray that grazes a facet is longer or shorter by the facet.
            assert!(error < 0.06, "{v} {k}: {error}");
            sum += error;
        }
    }
    assert!(sum < 2e-3 * (N * mesh.positions.len()) as f64, "{sum}");
}

/// h_l of c_lm = h_l Y_lm(-n), for radius 1; 0 for odd l from 3 on.
const CLOSED: [f64; 8] = [2.0 * PI, 4.0 * PI / 3.0, PI / 2.0, 0.0, -PI / 12.0, 0.0, PI / 32.0, 0.0];

/// The rms error of the first 25 coefficients of a sphere, and the largest error in each band.
fn error_on_a_sphere(directions: usize) -> (f64, [f64; 8]) {
    let (mesh, radius) = ball(5);
    let found = thickness(&lengths(&mesh, directions, &|_| Ok(())).unwrap(), 8);
    let (mut sum, mut count, mut worst) = (0.0, 0, [0.0f64; 8]);
    for (v, n) in mesh.normals.iter().enumerate() {
        let y = sh_basis(-n.as_dvec3(), 8);
        for (l, worst) in worst.iter_mut().enumerate() {
            let band = l * l..(l + 1) * (l + 1);
            for (found, y) in found.at(v, 0)[band.clone()].iter().zip(&y[band]) {
                let error = (f64::from(*found) - radius * CLOSED[l] * y).abs();
                *worst = worst.max(error);
                if l < 5 {
                    sum += error * error;
                    count += 1;
                }
            }
        }
    }
    ((sum / f64::from(count)).sqrt(), worst)
}

#[test]
fn a_spheres_coefficients_have_their_closed_form_and_odd_bands_vanish() {
    let largest = CLOSED[0] * (0.25 / PI).sqrt();
    for (directions, bound, by_band) in [(N, 0.006, 0.025), (1024, 0.003, 0.01)] {
        let (rms, worst) = error_on_a_sphere(directions);
        println!(
            "{directions} directions: rms {:.4}, the largest by band {:.4?}",
            rms / largest,
            worst.map(|w| w / largest)
        );
        assert!(rms < bound * largest, "{directions}: {rms}");
        assert!(worst[..5].iter().all(|error| *error < by_band * largest), "{directions}: {worst:?}");
    }
}

#[test]
fn a_box_and_a_slab_are_exactly_as_thick_as_they_are() {
    let size = DVec3::new(2.0, 1.0, 0.5);
    for mesh in [shapes::cuboid(size), shapes::slab(size, (7, 5))] {
        let lengths = run(&mesh);
        for (v, p) in mesh.positions.iter().enumerate() {
            for (k, d) in antipodal_directions(N).iter().enumerate() {
                // To the nearest of the three planes that the ray runs towards.
                let to_plane = |axis: usize| (0.5 * size[axis] * d[axis].signum() - f64::from(p[axis])) / d[axis];
                let expected = (0..3).map(to_plane).fold(f64::INFINITY, f64::min).max(0.0);
                let found = lengths.at(v, k);
                assert!((found.share * lengths.diagonal - expected).abs() < step(&lengths), "{p} {d}: {found:?}");
                assert_eq!(found.inwards, expected > 1e-6, "{p} {d}");
            }
        }
    }
}

#[test]
fn lines_meet_what_rays_meet() {
    let knot = shapes::torus_knot(2, 3, 1.0, 0.3, (90, 12));
    let solid = Solid::new(&knot);
    let mut pieces = [0; 6];
    for line in &antipodal_directions(64)[..32] {
        let sweep = Sweep::new(&solid.points, &solid.triangles, &solid.used, *line).unwrap();
        for &v in &solid.used {
            let (mut swept, mut traced) = (Vec::new(), Vec::new());
            let t = sweep.crossings(v, &mut swept);
            solid.traced(v, *line, &mut traced);
            pieces[(swept.len() / 2).min(5)] += 1;
            assert!(swept.len().is_multiple_of(2) && swept.iter().map(|c| c.leaves).sum::<i32>() == 0);
            for (one, other) in solid.both_ways(t, &mut swept).iter().zip(solid.both_ways(0.0, &mut traced)) {
                // The hierarchy knows corners to f32.
                assert!((one.share - other.share).abs() < 1e-4, "{v} {line}: {one:?} {other:?}");
            }
        }
    }
    assert!(pieces[3..].iter().sum::<usize>() > 1000, "lines cross the knot once and again: {pieces:?}");
}

#[test]
fn it_turns_and_grows_with_the_mesh() {
    let mesh = shapes::torus(1.0, 0.45, (40, 20));
    let still = thickness(&run(&mesh), 5);
    for scale in [1.0, 2f64.powi(-60), 2f64.powi(60)] {
        let grown = mesh.transformed(&DAffine3::from_scale(DVec3::splat(scale)));
        let found = thickness(&run(&grown), 5);
        let same = |(a, b): (&f32, &f32)| (f64::from(*a) / scale - f64::from(*b)).abs() < 1e-6;
        assert!(found.values.iter().zip(&still.values).all(same), "{scale}");
    }
    // Turned, the directions are others: what differs is the noise of the quadrature, and falls with their number.
    let turn = DMat3::from_quat(DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(1.9));
    let turned = mesh.transformed(&DAffine3::from_mat3(turn));
    let apart = |directions: usize| {
        let [still, turned] =
            [&mesh, &turned].map(|mesh| thickness(&lengths(mesh, directions, &|_| Ok(())).unwrap(), 5));
        let value = |c: &[f32], d: DVec3| -> f64 { sh_basis(d, 5).iter().zip(c).map(|(y, c)| y * f64::from(*c)).sum() };
        let (mut apart, mut whole) = (0.0f64, 0.0f64);
        for v in 0..mesh.positions.len() {
            for d in antipodal_directions(40) {
                let (a, b) = (value(still.at(v, 0), d), value(turned.at(v, 0), turn * d));
                (apart, whole) = (apart + (a - b).powi(2), whole + a * a);
            }
        }
        (apart / whole).sqrt()
    };
    let (few, many) = (apart(N), apart(2048));
    println!("turned: {few:.4} apart, with 2048 directions {many:.4}");
    assert!(few < 0.08 && many < 0.4 * few, "{few} {many}");
}

#[test]
fn a_concave_thing_counts_what_is_inside_and_overlaps_once() {
    // Two boxes a gap apart, seen from the outer face of one: both count, the gap does not.
    let one = shapes::cuboid(DVec3::ONE);
    let place = |x: f64| one.transformed(&DAffine3::from_translation(DVec3::X * x));
    let both = |x: f64| {
        let (mut both, other) = (one.clone(), place(x));
        let first = both.positions.len() as u32;
        both.positions.extend(other.positions);
        both.normals.extend(other.normals);
        both.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
        both
    };
    let along = |mesh: &Mesh, line: DVec3| Solid::new(mesh).spans(line.normalize());
    let line = DVec3::new(1.0, 1e-3, 1e-3);
    for (x, expected) in [(3.0, 2.0), (0.5, 1.5), (1.0, 2.0)] {
        let mesh = both(x);
        let spans = along(&mesh, line);
        let v = mesh.positions.iter().position(|p| *p == Vec3::splat(-0.5)).unwrap();
        let length = spans[v][0].share * Solid::new(&mesh).diagonal;
        assert!((length - expected).abs() < 1e-3 && spans[v][0].inwards, "{x}: {length}");
    }
    // From the face that looks at the other box the ray starts outwards, and what it meets counts.
    let mesh = both(3.0);
    let v = mesh.positions.iter().position(|p| *p == vec3(0.5, -0.5, -0.5)).unwrap();
    let span = along(&mesh, line)[v][0];
    assert!((span.share * Solid::new(&mesh).diagonal - 1.0).abs() < 1e-3 && !span.inwards);
    // A mesh that is inside out is as thick as it would be.
    let turned = Mesh { triangles: one.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect(), ..one.clone() };
    assert_eq!(run(&turned).packed, run(&one).packed);
}

#[test]
fn whatever_the_mesh_lengths_are_lengths() {
    let sphere = shapes::sphere(1.0, 2);
    let mut open = sphere.clone();
    open.triangles.retain(|t| t.iter().all(|v| sphere.positions[*v as usize].x < 0.5));
    let mut soup = sphere.clone();
    soup.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    soup.triangles.extend([[0, 0, 1], [3, 3, 3], [4, 5, 4]]);
    soup.positions.push(vec3(1e9, -1e9, 1e9));
    soup.normals.push(Vec3::Y);
    let flat = |s: DVec3| sphere.transformed(&DAffine3::from_scale(s));
    let one = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z; 3],
        uvs: vec![],
        triangles: vec![[0, 1, 2]],
    };
    let point = Mesh { positions: vec![Vec3::ONE; 3], ..one.clone() };
    let hard =
        [open, soup, flat(DVec3::new(1e-6, 1.0, 1e-6)), flat(DVec3::new(1.0, 1.0, 0.0)), one, point, Mesh::default()];
    for mesh in hard {
        let lengths = run(&mesh);
        for v in 0..mesh.positions.len() {
            for k in 0..N {
                let share = lengths.at(v, k).share;
                assert!((0.0..=1.0).contains(&share));
            }
        }
        let found = thickness(&lengths, 3);
        assert!(found.values.iter().all(|c| c.is_finite()));
    }
}

#[test]
fn many_small_triangles_beside_large_ones_are_found_by_another_way() {
    // A fine ball beside a plate a hundred thousand times larger.
    let mut mesh = shapes::sphere(1e-5, 4);
    let plate = shapes::cuboid(DVec3::new(1.0, 1.0, 1e-3)).transformed(&DAffine3::from_translation(DVec3::Z * 0.01));
    let first = mesh.positions.len() as u32;
    mesh.triangles.extend(plate.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh.positions.extend(plate.positions);
    let mesh = mesh.with_normals(Normals::Flat);
    let solid = Solid::new(&mesh);
    assert!(Sweep::new(&solid.points, &solid.triangles, &solid.used, DVec3::Z).is_none());
    let v = mesh.positions.iter().position(|p| p.z <= -0.99e-5).unwrap();
    let line = DVec3::new(0.05, 0.03, 1.0).normalize();
    let spans = solid.spans(line);
    let share = spans[solid.weld[v] as usize][0].share * solid.diagonal;
    assert!((share / (2e-5 + 1e-3) - 1.0).abs() < 0.02, "{share}");
}

#[test]
fn threads_do_not_matter_and_interruptions_do() {
    let knot = shapes::torus_knot(2, 3, 1.0, 0.2, (60, 10));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| run(&knot)), run(&knot));
    let stop: Tick = &|_| Err(Problem::files("enough"));
    assert!(lengths(&knot, N, stop).is_err());
    assert!(project(&run(&knot), None, 3, |_| [1.0], stop).is_err());
}
