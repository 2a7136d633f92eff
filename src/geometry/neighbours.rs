//! A field on the vertices, smoothed by the neighbour kernel of [Patro2007, eq. 3]:
//!
//! ```text
//! f'_i = (alpha f_i + sum_j w_ij f_j) / (alpha + sum_j w_ij),   over all j with |x_i - x_j| < radius
//! ```
//!
//! The paper filters normals (f = n) and leaves the sum as it is; here it is divided by its weights, so that a constant
//! field stays what it is. Distances are millimetres through space, not along the surface, as in the paper.
//!
//! - [`Weights::Uniform`] is the paper's: w_ij = exp(-sigma_tr r). Where vertices crowd they count more: its Fig. 2.
//! - [`Weights::Area`] gives each neighbour the area A_j around it, so that the sum is an integral over the surface and
//!   does not depend on the triangulation: w_ij = A_j exp(-sigma_tr r) / sum_k A_k exp(-sigma_tr r_ik). These weights
//!   sum to 1, which makes them commensurable with alpha at every resolution and scale: the vertex itself has the share
//!   alpha / (1 + alpha) of the result.
//!
//! Equal positions (vertices split along uv seams or creases) are one neighbour: its area is the sum of theirs, its
//! value their mean by area. So splitting vertices changes nothing but the alpha term, which is each vertex's own.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::geometry::mesh::{Mesh, weld};
use crate::problem::{Problem, Tick};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kernel {
    /// Effective transport coefficient, 1/mm.
    pub sigma_tr: f64,
    /// How far neighbours are looked for, mm.
    pub radius: f64,
    /// The weight of the vertex's own value.
    pub alpha: f64,
    pub weights: Weights,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Weights {
    Uniform,
    Area,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Length {
    /// A normal that was shortened by averaging dims the light, as diffusion does.
    Keep,
    /// Normals are made unit again, as the paper's renderer did. Where they cancelled to zero there is no direction to
    /// keep, and the vertex has its unfiltered one.
    Unit,
}

/// The mesh's normals, filtered; one per vertex.
pub fn filter_normals(
    mesh: &Mesh,
    mm_per_unit: f64,
    kernel: &Kernel,
    length: Length,
    tick: Tick,
) -> Result<Vec<DVec3>, Problem> {
    let normals: Vec<DVec3> = mesh.normals.iter().map(|n| n.as_dvec3()).collect();
    let filtered = Samples::of(mesh, mm_per_unit).filter(&normals, kernel, tick)?;
    Ok(match length {
        Length::Keep => filtered,
        Length::Unit => filtered.iter().zip(&normals).map(|(f, n)| f.normalize_or(*n)).collect(),
    })
}

/// The places that a field is known at, welded: made once per mesh, for any number of kernels and fields.
pub struct Samples {
    /// mm, sorted by x, then y, then z, so that sums run in an order that does not depend on the mesh's.
    points: Vec<DVec3>,
    /// mm², or square units of any length: weights are relative.
    areas: Vec<f64>,
    /// The sample that each vertex belongs to.
    sample: Vec<u32>,
    /// The share of each vertex in its sample's value.
    share: Vec<f64>,
}

impl Samples {
    pub fn of(mesh: &Mesh, mm_per_unit: f64) -> Samples {
        Samples::new(&mesh.positions, &mesh.vertex_areas(), mm_per_unit)
    }

    /// One position (scene units) and one area (any unit) per vertex.
    pub fn new(positions: &[Vec3], areas: &[f64], mm_per_unit: f64) -> Samples {
        let weld = weld(positions);
        let mut order: Vec<u32> = (0..weld.len() as u32).filter(|&v| weld[v as usize] == v).collect();
        order.sort_unstable_by(|&a, &b| {
            let [a, b] = [a, b].map(|v| positions[v as usize].to_array());
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
        });
        let mut rank = vec![0; weld.len()];
        for (i, &v) in order.iter().enumerate() {
            rank[v as usize] = i as u32;
        }
        let sample: Vec<u32> = weld.iter().map(|&v| rank[v as usize]).collect();

        let (mut area, mut copies) = (vec![0.0; order.len()], vec![0.0; order.len()]);
        for (&s, a) in sample.iter().zip(areas) {
            area[s as usize] += a;
            copies[s as usize] += 1.0;
        }
        let share = sample.iter().zip(areas).map(|(&s, a)| match area[s as usize] {
            0.0 => 1.0 / copies[s as usize],
            total => a / total,
        });
        Samples {
            points: order.iter().map(|&v| mm_per_unit * positions[v as usize].as_dvec3()).collect(),
            share: share.collect(),
            areas: area,
            sample,
        }
    }

    /// The field `values` (one per vertex) filtered. Up to rounding it depends neither on the order of the vertices nor
    /// on how many of them share a position.
    pub fn filter(&self, values: &[DVec3], kernel: &Kernel, tick: Tick) -> Result<Vec<DVec3>, Problem> {
        let mut field = vec![DVec3::ZERO; self.points.len()];
        for ((&s, share), value) in self.sample.iter().zip(&self.share).zip(values) {
            field[s as usize] += share * value;
        }
        let sums = self.sums(&field, kernel, tick)?;
        let filtered = |(v, &value): (usize, &DVec3)| {
            let (sum, weight) = sums[self.sample[v] as usize];
            // Area weights sum to 1 by definition; where all areas around are zero there is no integral.
            let (sum, weight) = match kernel.weights {
                Weights::Uniform => (sum, weight),
                Weights::Area if weight > 0.0 => (sum / weight, 1.0),
                Weights::Area => (DVec3::ZERO, 0.0),
            };
            match kernel.alpha + weight {
                0.0 => value,
                total => (kernel.alpha * value + sum) / total,
            }
        };
        Ok(values.iter().enumerate().map(filtered).collect())
    }

    /// For each sample sum_j w_j f_j and sum_j w_j, before normalisation.
    fn sums(&self, field: &[DVec3], kernel: &Kernel, tick: Tick) -> Result<Vec<(DVec3, f64)>, Problem> {
        let grid = Grid::new(&self.points, kernel.radius);
        // What the inner loop reads, in the order in which it is read.
        let sorted: Vec<(DVec3, DVec3, f64)> = grid
            .order
            .iter()
            .map(|&s| {
                let s = s as usize;
                let weight = if kernel.weights == Weights::Area { self.areas[s] } else { 1.0 };
                (self.points[s], field[s], weight)
            })
            .collect();
        let radius_squared = kernel.radius * kernel.radius;
        let done = AtomicUsize::new(0);
        let gathered = grid.cells.par_iter().map(|cell| {
            let rows = grid.rows_around(cell.key);
            let sums = sorted[cell.start..cell.end].iter().map(|&(x, ..)| {
                let (mut sum, mut total) = (DVec3::ZERO, 0.0);
                for row in &rows {
                    for &(y, value, weight) in &sorted[row.clone()] {
                        let d2 = x.distance_squared(y);
                        if d2 < radius_squared {
                            let w = weight * (-kernel.sigma_tr * d2.sqrt()).exp();
                            sum += w * value;
                            total += w;
                        }
                    }
                }
                (sum, total)
            });
            let sums: Vec<_> = sums.collect();
            tick(done.fetch_add(sums.len(), Relaxed) as f64 / sorted.len() as f64)?;
            Ok(sums)
        });
        let gathered: Vec<Vec<(DVec3, f64)>> = gathered.collect::<Result<_, Problem>>()?;
        let mut sums = vec![(DVec3::ZERO, 0.0); self.points.len()];
        for (&s, sum) in grid.order.iter().zip(gathered.into_iter().flatten()) {
            sums[s as usize] = sum;
        }
        Ok(sums)
    }
}

/// Points sorted by the cubic cell that holds them, x fastest, so that three neighbouring cells in x are one range.
pub(super) struct Grid {
    pub(super) order: Vec<u32>,
    pub(super) cells: Vec<Cell>,
}

pub(super) struct Cell {
    pub(super) key: [u64; 3],
    pub(super) start: usize,
    pub(super) end: usize,
}

impl Grid {
    pub(super) fn new(points: &[DVec3], radius: f64) -> Grid {
        let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (min, max) = points.iter().fold(nothing, |(min, max), p| (min.min(*p), max.max(*p)));
        // A radius far below the spacing of the points must not need more cells than integers can count.
        let side = radius.max((max - min).max_element() / (1u64 << 40) as f64);
        let key = |p: &DVec3| {
            let cell = ((p - min) / side).to_array().map(|c| if side > 0.0 { c.floor() as u64 } else { 0 });
            [cell[2], cell[1], cell[0]]
        };
        let keys: Vec<[u64; 3]> = points.iter().map(key).collect();
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.sort_by_key(|&i| keys[i as usize]);
        let mut cells = Vec::new();
        let mut start = 0;
        for run in order.chunk_by(|&a, &b| keys[a as usize] == keys[b as usize]) {
            cells.push(Cell { key: keys[run[0] as usize], start, end: start + run.len() });
            start += run.len();
        }
        Grid { order, cells }
    }

    /// The ranges of the order that hold the 27 cells around `key`.
    pub(super) fn rows_around(&self, [z, y, x]: [u64; 3]) -> Vec<std::ops::Range<usize>> {
        let mut rows = Vec::with_capacity(9);
        for z in z.saturating_sub(1)..=z + 1 {
            for y in y.saturating_sub(1)..=y + 1 {
                let first = self.cells.partition_point(|cell| cell.key < [z, y, x.saturating_sub(1)]);
                let last = self.cells[first..].partition_point(|cell| cell.key <= [z, y, x + 1]);
                if last > 0 {
                    rows.push(self.cells[first].start..self.cells[first + last - 1].end);
                }
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use glam::{DAffine3, DMat3, DQuat};
    use std::f64::consts::TAU;

    const KERNEL: Kernel = Kernel { sigma_tr: 1.5, radius: 0.4, alpha: 0.3, weights: Weights::Area };

    fn run(mesh: &Mesh, kernel: &Kernel) -> Vec<DVec3> {
        filter_normals(mesh, 1.0, kernel, Length::Keep, &|_| Ok(())).unwrap()
    }

    fn kernels() -> [Kernel; 2] {
        [Weights::Area, Weights::Uniform].map(|weights| Kernel { weights, ..KERNEL })
    }

    fn worst(a: &[DVec3], b: &[DVec3]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, |m, d| if d <= m { m } else { d })
    }

    /// The equation as it stands in the module's header, all pairs.
    fn brute_force(mesh: &Mesh, kernel: &Kernel) -> Vec<DVec3> {
        let (weld, areas) = (weld(&mesh.positions), mesh.vertex_areas());
        let at = |v: usize| mesh.positions[v].as_dvec3();
        let normal = |v: usize| mesh.normals[v].as_dvec3();
        let mut groups = std::collections::BTreeMap::<u32, (f64, DVec3)>::new();
        for v in 0..weld.len() {
            let group = groups.entry(weld[v]).or_default();
            group.0 += areas[v];
            group.1 += areas[v] * normal(v);
        }
        let one = |i: usize| {
            let (mut sum, mut total) = (DVec3::ZERO, 0.0);
            for (&j, &(area, weighted)) in &groups {
                let r = at(i).distance(at(j as usize));
                if r < kernel.radius {
                    let w = (-kernel.sigma_tr * r).exp() * if kernel.weights == Weights::Area { area } else { 1.0 };
                    sum += w * weighted / area;
                    total += w;
                }
            }
            let scale = if kernel.weights == Weights::Area { total } else { 1.0 };
            (kernel.alpha * normal(i) + sum / scale) / (kernel.alpha + total / scale)
        };
        (0..weld.len()).map(one).collect()
    }

    #[test]
    fn agrees_with_all_pairs_on_split_meshes_and_at_any_radius() {
        for mesh in [shapes::torus(1.0, 0.4, (24, 12)), shapes::slab(DVec3::new(2.0, 1.0, 0.2), (9, 5))] {
            for kernel in kernels() {
                // Below the shortest edge, below and above the cell of a few edges, beyond the object.
                for radius in [1e-9, 0.02, 0.3, 0.7, 10.0] {
                    let kernel = Kernel { radius, ..kernel };
                    let difference = worst(&run(&mesh, &kernel), &brute_force(&mesh, &kernel));
                    assert!(difference < 1e-12, "{kernel:?}: {difference}");
                    let wrong = Kernel { sigma_tr: 1.1 * kernel.sigma_tr, ..kernel };
                    assert!(radius < 0.2 || worst(&run(&mesh, &wrong), &brute_force(&mesh, &kernel)) > 1e-4);
                }
            }
        }
    }

    #[test]
    fn constants_stay_and_radius_zero_changes_nothing() {
        let mesh = shapes::torus(1.0, 0.4, (24, 12));
        let constant = vec![DVec3::new(0.1, -7.0, 3e5); mesh.positions.len()];
        for kernel in kernels() {
            for radius in [0.0, 1e-300, 0.5, 1e300] {
                for alpha in [0.0, 0.3] {
                    let kernel = Kernel { radius, alpha, ..kernel };
                    let filtered = Samples::of(&mesh, 1.0).filter(&constant, &kernel, &|_| Ok(())).unwrap();
                    assert!(worst(&filtered, &constant) < 1e-10 * 3e5, "{kernel:?}");
                }
            }
        }
        let still = run(&mesh, &Kernel { radius: 0.0, ..KERNEL });
        assert!(still.iter().zip(&mesh.normals).all(|(a, b)| a.distance(b.as_dvec3()) < 1e-12));
    }

    #[test]
    fn turns_with_the_mesh() {
        let mesh = shapes::torus_knot(2, 3, 1.0, 0.17, (64, 8));
        // A turn that f32 represents exactly, so that only the sums can differ, and any other one.
        let quarter = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
        let any = DMat3::from_quat(DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(2.0));
        for kernel in kernels() {
            for (turn, tolerance) in [(quarter, 1e-10), (any, 1e-5)] {
                let turned = run(&mesh.transformed(&DAffine3::from_mat3(turn)), &kernel);
                let expected: Vec<_> = run(&mesh, &kernel).iter().map(|n| turn * n).collect();
                let difference = worst(&turned, &expected);
                assert!(difference < tolerance, "{kernel:?} {turn}: {difference}");
            }
        }
    }

    #[test]
    fn scales_with_the_mesh() {
        let mesh = shapes::torus(1.0, 0.4, (24, 12));
        for kernel in kernels() {
            for k in [2f64.powi(-90), 2f64.powi(90)] {
                let scaled = Kernel { sigma_tr: kernel.sigma_tr / k, radius: kernel.radius * k, ..kernel };
                let big = mesh.transformed(&DAffine3::from_scale(DVec3::splat(k)));
                assert!(worst(&run(&big, &scaled), &run(&mesh, &kernel)) < 1e-10);
                let by_unit = filter_normals(&mesh, k, &scaled, Length::Keep, &|_| Ok(())).unwrap();
                assert!(worst(&by_unit, &run(&mesh, &kernel)) < 1e-10);
            }
        }
    }

    #[test]
    fn neither_order_nor_splitting_nor_threads_matter() {
        let mesh = shapes::sphere(1.0, 3);
        let n = mesh.positions.len() as u32;
        let mut shuffled = Mesh { triangles: vec![], ..mesh.clone() };
        // 7 and n have no common divisor: a permutation.
        assert!(!n.is_multiple_of(7));
        let to = |v: u32| (7 * v + 3) % n;
        for v in 0..n as usize {
            shuffled.positions[to(v as u32) as usize] = mesh.positions[v];
            shuffled.normals[to(v as u32) as usize] = mesh.normals[v];
        }
        shuffled.triangles = mesh.triangles.iter().rev().map(|t| t.map(to)).collect();
        let split = mesh.clone().with_normals(crate::geometry::normals::Normals::Flat);
        let mut split = Mesh { normals: split.positions.clone(), ..split };
        split.triangles.reverse();
        for kernel in kernels() {
            let field = run(&mesh, &kernel);
            let again = run(&shuffled, &kernel);
            assert!((0..n).all(|v| field[v as usize].distance(again[to(v) as usize]) < 1e-12));
            let parts = run(&split, &kernel);
            let count = mesh.triangles.len();
            for (t, triangle) in mesh.triangles.iter().enumerate() {
                let from = split.triangles[count - 1 - t];
                assert!((0..3).all(|c| parts[from[c] as usize].distance(field[triangle[c] as usize]) < 1e-6));
            }
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            assert_eq!(pool.install(|| run(&mesh, &kernel)), field);
        }
    }

    /// On a sphere of radius R the sum is an integral: rho 2 pi ∫_0^d r exp(-s r) (1 - r²/(2R²)) dr along n, where r is
    /// the chord, and the weights integrate without the bracket.
    fn exact_on_sphere(sphere: f64, sigma: f64, d: f64) -> f64 {
        let moment = |n: i32| {
            let slices = 2000;
            let f = |r: f64| r.powi(n) * (-sigma * r).exp();
            (0..slices).map(|i| f((i as f64 + 0.5) * d / slices as f64)).sum::<f64>() * d / slices as f64
        };
        TAU * (moment(1) - moment(3) / (2.0 * sphere * sphere)) / (TAU * moment(1))
    }

    #[test]
    fn exact_on_a_sphere() {
        let mesh = shapes::sphere(2.0, 5);
        for (sigma_tr, radius) in [(1.5, 1.0), (0.3, 2.5), (1e-4, 1.0), (5.0, 10.0)] {
            let kernel = Kernel { sigma_tr, radius, alpha: 0.0, weights: Weights::Area };
            // Chords end at the diameter.
            let exact = exact_on_sphere(2.0, sigma_tr, radius.min(4.0));
            let field = run(&mesh, &kernel);
            let mean = field.iter().map(|f| f.length()).sum::<f64>() / field.len() as f64;
            assert!((mean - exact).abs() < 2e-3, "{sigma_tr} {radius}: {mean} {exact}");
            for (f, n) in field.iter().zip(&mesh.normals) {
                assert!(f.distance(exact * n.as_dvec3()) < 0.01);
            }
        }
    }

    /// A sphere whose lower half has sixteen times the triangles of its upper half.
    fn uneven_sphere() -> (Mesh, Mesh) {
        let even = shapes::sphere(1.0, 4);
        let fine = shapes::sphere(1.0, 6);
        // Which half a triangle belongs to is told by its middle.
        let low = |mesh: &Mesh, t: &[u32; 3]| t.iter().map(|&v| mesh.positions[v as usize].y).sum::<f32>() < 0.0;
        let mut uneven = Mesh { triangles: vec![], uvs: vec![], ..even.clone() };
        uneven.triangles.extend(even.triangles.iter().filter(|t| !low(&even, t)));
        let mut moved = std::collections::HashMap::new();
        for triangle in fine.triangles.iter().filter(|t| low(&fine, t)) {
            uneven.triangles.push(triangle.map(|v| {
                *moved.entry(v).or_insert_with(|| {
                    uneven.positions.push(fine.positions[v as usize]);
                    uneven.normals.push(fine.normals[v as usize]);
                    uneven.positions.len() as u32 - 1
                })
            }));
        }
        (even, uneven)
    }

    #[test]
    fn area_weights_do_not_see_the_triangulation_and_uniform_ones_do() {
        let (even, uneven) = uneven_sphere();
        let difference = |weights| {
            let kernel = Kernel { weights, radius: 0.6, ..KERNEL };
            let (a, b) = (run(&even, &kernel), run(&uneven, &kernel));
            // The vertices of the coarse sphere are the first ones of both.
            let near = |v: &usize| even.positions[*v].y.abs() < 0.5 && even.positions[*v].y > 0.1;
            (0..even.positions.len()).filter(near).map(|v| a[v].distance(b[v])).fold(0.0, f64::max)
        };
        let (area, uniform) = (difference(Weights::Area), difference(Weights::Uniform));
        assert!(area < 0.02 && uniform > 0.15, "{area} {uniform}");
    }

    #[test]
    fn unit_length_and_interruption() {
        let mesh = shapes::sphere(1.0, 2);
        let kernel = Kernel { radius: 0.8, ..KERNEL };
        let unit = filter_normals(&mesh, 1.0, &kernel, Length::Unit, &|_| Ok(())).unwrap();
        assert!(unit.iter().all(|n| (n.length() - 1.0).abs() < 1e-12));
        assert!(run(&mesh, &kernel).iter().all(|n| n.length() < 0.97));
        let stop: Tick = &|_| Err(Problem::files("enough"));
        assert!(filter_normals(&mesh, 1.0, &kernel, Length::Keep, stop).is_err());
    }
}
