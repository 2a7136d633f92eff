//! Which directions a point of a surface sees the environment in.
//!
//! Every point asks the same N directions, a spherical Fibonacci lattice [Keinert2015]: equal weights 4 pi / N integrate
//! smooth functions over the sphere as well as any other set of that size, and a bit per direction is all that is kept.
//! With N = 256 the cosine over a hemisphere comes out as pi within 0.5 % for any normal.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::geometry::bvh::Bvh;
use crate::problem::{Problem, Tick};

/// `n` unit vectors spread evenly over the sphere, north pole (z) first; each stands for the solid angle 4 pi / n.
pub fn directions(n: usize) -> Vec<DVec3> {
    let golden_angle = PI * (3.0 - 5f64.sqrt());
    let direction = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / n as f64;
        let (sin, cos) = (i as f64 * golden_angle).rem_euclid(TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    };
    (0..n).map(direction).collect()
}

/// For each point n / 32 words: bit k of word w tells whether the point sees out along `directions(n)[32 w + k]`, that
/// is leaves the scene without meeting a triangle of `occluders`. Points and unit normals are in world space; what lies
/// below a point's horizon is hidden by the surface itself and not asked. `n` is a multiple of 32.
pub fn visibility(
    points: &[Vec3],
    normals: &[Vec3],
    occluders: &Bvh,
    n: usize,
    tick: Tick,
) -> Result<Vec<u32>, Problem> {
    assert!(n > 0 && n.is_multiple_of(32), "{n} directions do not fill 32-bit words");
    assert_eq!(points.len(), normals.len());
    let directions = directions(n);
    let mut bits = vec![0; points.len() * n / 32];
    // Large enough that a tick costs nothing, small enough for an interruption to be prompt.
    const POINTS: usize = 64;
    let done = AtomicUsize::new(0);
    bits.par_chunks_mut(POINTS * n / 32).enumerate().try_for_each(|(chunk, bits)| {
        for (i, words) in bits.chunks_exact_mut(n / 32).enumerate() {
            let (point, normal) = (points[chunk * POINTS + i].as_dvec3(), normals[chunk * POINTS + i].as_dvec3());
            let origin = point + occluders.offset() * normal;
            for (word, directions) in words.iter_mut().zip(directions.chunks_exact(32)) {
                for (bit, direction) in directions.iter().enumerate() {
                    let above = normal.dot(*direction) > 0.0;
                    let free = above && !occluders.any_hit(origin, *direction, 0.0, f64::INFINITY);
                    *word |= (free as u32) << bit;
                }
            }
        }
        tick(done.fetch_add(bits.len(), Relaxed) as f64 / (points.len() * n / 32) as f64)
    })?;
    Ok(bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::Mesh;
    use crate::geometry::shapes;
    use glam::{DAffine3, vec3};

    const N: usize = 256;

    fn run(mesh: &Mesh, occluders: &[(&Mesh, DAffine3)]) -> Vec<u32> {
        visibility(&mesh.positions, &mesh.normals, &Bvh::new(occluders), N, &|_| Ok(())).unwrap()
    }

    fn sees(words: &[u32], direction: usize) -> bool {
        words[direction / 32] >> (direction % 32) & 1 == 1
    }

    #[test]
    fn a_convex_object_sees_all_above_its_horizon() {
        for scale in [1e-20, 1.0, 1e20] {
            let sphere = shapes::sphere(1.0, 4).transformed(&DAffine3::from_scale(DVec3::splat(scale)));
            let bits = run(&sphere, &[(&sphere, DAffine3::IDENTITY)]);
            for (words, n) in bits.chunks(N / 32).zip(&sphere.normals) {
                for (k, d) in directions(N).into_iter().enumerate() {
                    assert_eq!(sees(words, k), d.dot(n.as_dvec3()) > 0.0);
                }
            }
        }
    }

    #[test]
    fn what_is_seen_adds_up_to_the_energy_of_the_sky() {
        let sphere = shapes::sphere(1.0, 4);
        let bits = run(&sphere, &[(&sphere, DAffine3::IDENTITY)]);
        for (words, n) in bits.chunks(N / 32).zip(&sphere.normals) {
            let cosine = |(k, d): (usize, DVec3)| if sees(words, k) { d.dot(n.as_dvec3()) } else { 0.0 };
            let irradiance = 2.0 * TAU / N as f64 * directions(N).into_iter().enumerate().map(cosine).sum::<f64>();
            assert!((irradiance / PI - 1.0).abs() < 5e-3, "{irradiance}");
        }
        let mean: DVec3 = directions(N).into_iter().sum::<DVec3>() / N as f64;
        assert!(mean.length() < 1e-3 && directions(N).iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn a_lid_darkens_and_a_wall_takes_half() {
        let ground = Mesh { positions: vec![Vec3::ZERO], normals: vec![Vec3::Y], ..Mesh::default() };
        let lid = shapes::cuboid(DVec3::new(2000.0, 0.1, 2000.0));
        let place = DAffine3::from_translation(DVec3::Y);
        assert!(run(&ground, &[(&lid, place)]).iter().all(|&word| word == 0));
        assert!(run(&ground, &[]).iter().map(|word| word.count_ones()).sum::<u32>() == N as u32 / 2);

        let wall = shapes::cuboid(DVec3::new(0.1, 2000.0, 2000.0));
        let bits = run(&ground, &[(&wall, DAffine3::from_translation(DVec3::X))]);
        for (k, d) in directions(N).into_iter().enumerate() {
            assert!(d.x.abs() < 1e-2 || d.y.abs() < 1e-2 || sees(&bits, k) == (d.y > 0.0 && d.x < 0.0));
        }
    }

    #[test]
    fn threads_do_not_matter_and_interruptions_do() {
        let knot = shapes::torus_knot(2, 3, 1.0, 0.2, (60, 10));
        let bvh = Bvh::new(&[(&knot, DAffine3::IDENTITY)]);
        let run = || visibility(&knot.positions, &knot.normals, &bvh, N, &|_| Ok(()));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(pool.install(run), run());
        let seen = run().unwrap().iter().map(|word| word.count_ones() as usize).sum::<usize>();
        assert!(seen < knot.positions.len() * N / 2 * 9 / 10, "the knot hides nothing of itself");
        let stop: Tick = &|_| Err(Problem::files("enough"));
        assert!(visibility(&[vec3(0.0, 0.0, 0.0)], &[Vec3::Y], &bvh, N, stop).is_err());
    }
}
