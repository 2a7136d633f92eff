//! Fields on a mesh taken apart by frequency, so that any filter of them is a sum.
//!
//! ```text
//! n'_v = F(0) low_v + sum_k F(omega_k) c_k y_k(v) + F_high high_v
//! ```
//!
//! `low` is the mean over each component, the `y_k` are modes of the Laplacian between 0 and `cut`, and `high` is all that
//! they miss, weighted by the mean of F between `cut` and the mesh's finest frequency [Patro2007, eq. 11]. Two engines make
//! such a [`Basis`]: eigenpairs ([`harmonics`]), good for every kernel and field up to `cut`; and Ritz pairs of a space that
//! is made for one field ([`krylov`]), good for smooth kernels over the whole spectrum, in a hundredth of the time.
//!
//! What tells the vertices of one sample from each other (a crease) lies above every frequency: it is part of `high`. So a
//! kernel that is 1 everywhere is the identity, on any mesh.

mod factor;
pub mod harmonics;
pub mod kernel;
pub mod krylov;
mod space;
#[cfg(test)]
mod tests;

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::laplacian::{Areas, Laplacian, NOWHERE};
use super::mesh::Mesh;
use crate::problem::{Cause, Problem, Tick};
use kernel::Kernel;

/// Modes of the Laplacian, orthonormal by area, and what a field without its means has of each.
pub struct Modes {
    /// Ascending, all above 0; in 1/edge².
    pub lambda: Vec<f64>,
    /// One value per sample, mode after mode.
    pub columns: Vec<f64>,
    pub coefficients: Vec<DVec3>,
}

impl Modes {
    pub fn column(&self, k: usize) -> &[f64] {
        let samples = self.columns.len() / self.lambda.len();
        &self.columns[k * samples..(k + 1) * samples]
    }

    /// The sum over the modes, each with its weight, per sample.
    pub fn sum(&self, samples: usize, weight: impl Fn(f64) -> f64) -> Vec<DVec3> {
        let mut sum = vec![DVec3::ZERO; samples];
        for (k, lambda) in self.lambda.iter().enumerate() {
            let coefficient = weight(*lambda) * self.coefficients[k];
            sum.iter_mut().zip(self.column(k)).for_each(|(sum, y)| *sum += *y * coefficient);
        }
        sum
    }

    /// What the modes hold of a field: sum_j A_j f_j y_k(j) [Patro2007, eqs. 5-7].
    fn project(columns: &[f64], areas: &[f64], field: &[DVec3]) -> Vec<DVec3> {
        let samples = areas.len().max(1);
        let weighted: Vec<DVec3> = areas.iter().zip(field).map(|(area, value)| *area * *value).collect();
        let project = |column: &[f64]| column.iter().zip(&weighted).map(|(y, value)| *y * *value).sum();
        columns.par_chunks_exact(samples).map(project).collect()
    }
}

/// A field on the vertices of a mesh, ready to be filtered.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Basis {
    /// The frequency of each mode, rad per unit of the mesh.
    pub omega: Vec<f64>,
    /// What the field has of each mode.
    pub coefficients: Vec<DVec3>,
    /// One value per sample, mode after mode; the largest of each mode is 1 or -1.
    pub columns: Vec<f32>,
    pub samples: usize,
    /// The sample of each vertex, or [`NOWHERE`].
    pub sample: Vec<u32>,
    /// The part of frequency 0 at each vertex.
    pub low: Vec<Vec3>,
    /// The part above all modes at each vertex.
    pub high: Vec<Vec3>,
    /// Where the modes end, and the finest frequency of the mesh (two edges are one wavelength); rad per unit.
    pub cut: f64,
    pub finest: f64,
    /// How far filtered fields are expected to be off, root mean square over the surface.
    pub error: f64,
}

/// Samples that are summed together: their sums stay in a core's first cache.
const CHUNK: usize = 1024;

/// Modes that have no more than this of a field of length 1 are left out of sums: a float does not tell, and numbers near its
/// smallest take a processor ten times as long.
const NOTHING: f32 = 1e-10;

/// The weights of a kernel for the parts of a basis.
pub struct Weights {
    pub low: f64,
    pub modes: Vec<f64>,
    pub high: f64,
}

impl Basis {
    /// Of a field per vertex, whose modes are known and whose values at the samples are `at_samples`.
    fn new(laplacian: &Laplacian, field: &[Vec3], at_samples: &[DVec3], modes: &Modes, cut: f64, error: f64) -> Basis {
        let samples = laplacian.samples();
        let means = laplacian.means(at_samples);
        let sums = modes.sum(samples, |_| 1.0);
        let low = |(&s, value): (&u32, &Vec3)| if s == NOWHERE { *value } else { means[s as usize].as_vec3() };
        let high = |(&s, value): (&u32, &Vec3)| match s {
            NOWHERE => Vec3::ZERO,
            s => (value.as_dvec3() - means[s as usize] - sums[s as usize]).as_vec3(),
        };
        let largest: Vec<f64> =
            (0..modes.lambda.len()).map(|k| modes.column(k).iter().fold(0.0f64, |most, y| most.max(y.abs()))).collect();
        let columns = (0..modes.lambda.len())
            .flat_map(|k| modes.column(k).iter().map(|y| (y / largest[k]) as f32).collect::<Vec<_>>())
            .collect();
        let per_unit = |per_edge: f64| per_edge / laplacian.edge;
        Basis {
            omega: modes.lambda.iter().map(|lambda| per_unit(lambda.sqrt())).collect(),
            coefficients: modes.coefficients.iter().zip(&largest).map(|(c, most)| *most * *c).collect(),
            columns,
            samples,
            low: laplacian.sample.iter().zip(field).map(low).collect(),
            high: laplacian.sample.iter().zip(field).map(high).collect(),
            sample: laplacian.sample.clone(),
            cut: per_unit(cut),
            finest: per_unit(FINEST),
            error,
        }
    }

    /// The weights of a kernel whose lengths are in mm.
    pub fn weights(&self, kernel: &Kernel, mm_per_unit: f64) -> Weights {
        let [cut, finest] = [self.cut, self.finest].map(|omega| omega / mm_per_unit);
        // Ten edges are one wavelength of omega_m, and two one of the finest.
        let omega_m = 0.2 * finest;
        Weights {
            low: kernel.at(0.0, omega_m),
            modes: self.omega.iter().map(|omega| kernel.at(omega / mm_per_unit, omega_m)).collect(),
            high: kernel.mean(cut, finest, omega_m),
        }
    }

    /// The filtered field, per vertex.
    pub fn filter(&self, kernel: &Kernel, mm_per_unit: f64) -> Vec<Vec3> {
        let weights = self.weights(kernel, mm_per_unit);
        let coefficients = weights.modes.iter().zip(&self.coefficients).map(|(w, c)| (*w * *c).as_vec3());
        let modes: Vec<(usize, Vec3)> =
            coefficients.enumerate().filter(|(_, c)| c.abs().max_element() > NOTHING).collect();
        let mut sums = vec![Vec3::ZERO; self.samples];
        sums.par_chunks_mut(CHUNK).enumerate().for_each(|(c, sums)| self.sum_chunk(c * CHUNK, &modes, sums));
        let sum = |s: u32| if s == NOWHERE { Vec3::ZERO } else { sums[s as usize] };
        let (low, high) = (weights.low as f32, weights.high as f32);
        (0..self.sample.len()).map(|v| low * self.low[v] + sum(self.sample[v]) + high * self.high[v]).collect()
    }

    /// The sum over the modes, each with its weight, at the samples from `first` on. Four modes at a time and an axis at a
    /// time: vectors of a processor are filled, and sums are written a quarter as often.
    fn sum_chunk(&self, first: usize, modes: &[(usize, Vec3)], sums: &mut [Vec3]) {
        let mut axes = [[0.0f32; CHUNK]; 3];
        let column = |k: usize| &self.columns[k * self.samples + first..][..sums.len()];
        for four in modes.chunks(4) {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| column(four[i.min(four.len() - 1)].0));
            for (axis, axis_sums) in axes.iter_mut().enumerate() {
                let [wa, wb, wc, wd] = [0, 1, 2, 3].map(|i| four.get(i).map_or(0.0, |(_, weight)| weight[axis]));
                let values = a.iter().zip(b).zip(c.iter().zip(d));
                for (sum, ((a, b), (c, d))) in axis_sums.iter_mut().zip(values) {
                    *sum += (wa * a + wb * b) + (wc * c + wd * d);
                }
            }
        }
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum = Vec3::new(axes[0][i], axes[1][i], axes[2][i]);
        }
    }
}

/// Modes of a mesh for any field at its samples, those of frequency 0 among them, one for each component.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Harmonics {
    /// The frequency of each mode, rad per unit of the mesh.
    pub omega: Vec<f64>,
    /// One value per sample, mode after mode; the largest of each mode is 1 or -1.
    pub columns: Vec<f32>,
    /// The square of what each mode's values are to be multiplied by to be orthonormal.
    pub squares: Vec<f64>,
    /// Of each sample, unit².
    pub areas: Vec<f32>,
    /// The sample of each vertex, or [`NOWHERE`].
    pub sample: Vec<u32>,
    /// Where the modes end, and the finest frequency of the mesh; rad per unit.
    pub cut: f64,
    pub finest: f64,
}

impl Harmonics {
    /// The weight of each mode, and that of all which they miss.
    pub fn weights(&self, kernel: &Kernel, mm_per_unit: f64) -> (Vec<f64>, f64) {
        let [cut, finest] = [self.cut, self.finest].map(|omega| omega / mm_per_unit);
        let omega_m = 0.2 * finest;
        let modes = self.omega.iter().map(|omega| kernel.at(omega / mm_per_unit, omega_m)).collect();
        (modes, kernel.mean(cut, finest, omega_m))
    }

    pub fn samples(&self) -> usize {
        self.areas.len()
    }
}

/// The eigenpairs of a mesh up to `highest` (rad per unit), or to its finest frequency if that is lower. Light has edges
/// that normals do not have: what a kernel does beyond omega_m is not for a mean to say.
pub fn all_harmonics(mesh: &Mesh, highest: f64, tick: Tick) -> Result<Harmonics, Problem> {
    let laplacian = Laplacian::of(mesh, Areas::VertexArea);
    let (samples, parts) = (laplacian.samples(), laplacian.components());
    // One mode of frequency 0 each.
    if parts * samples > MOST {
        let what = format!("light on a mesh of {parts} separate parts does not fit into memory");
        return Err(Problem::new(Cause::Unfinished, what).hint("signal: Normals, or a mesh of fewer parts"));
    }
    let cut = FINEST.min(highest * laplacian.edge);
    let nothing = vec![DVec3::ZERO; samples];
    let (modes, reached) = harmonics::modes(&laplacian, &nothing, cut, tick)?;
    let per_unit = |per_edge: f64| per_edge / laplacian.edge;
    let area = laplacian.edge * laplacian.edge;
    let mut squares = vec![0.0; parts];
    let mut columns = vec![0.0f32; parts * samples];
    for (s, &c) in laplacian.component.iter().enumerate() {
        squares[c as usize] += area * laplacian.areas[s];
        columns[c as usize * samples + s] = 1.0;
    }
    squares.iter_mut().for_each(|square| *square = 1.0 / *square);
    for k in 0..modes.lambda.len() {
        let largest = modes.column(k).iter().fold(0.0f64, |most, y| most.max(y.abs()));
        columns.extend(modes.column(k).iter().map(|y| (y / largest) as f32));
        squares.push(largest * largest / area);
    }
    Ok(Harmonics {
        omega: vec![0.0; parts].into_iter().chain(modes.lambda.iter().map(|l| per_unit(l.sqrt()))).collect(),
        columns,
        squares,
        areas: laplacian.areas.iter().map(|a| (area * a) as f32).collect(),
        sample: laplacian.sample,
        cut: per_unit(reached),
        finest: per_unit(FINEST),
    })
}

/// Sums in an order that no number of threads changes; and threads that wait for each other in a loop would take the time
/// of whatever else is baked.
fn on_one_thread() {
    faer::set_global_parallelism(faer::Par::Seq);
}

/// Numbers in all modes together, at most: 64 MiB as halves on a device, four times that while they are made.
const MOST: usize = 1 << 25;

/// The finest frequency of a mesh, rad per mean edge: two edges are one wavelength.
const FINEST: f64 = PI;

/// omega_m, rad per mean edge: ten edges are one wavelength [Patro2007, section 3.2].
const OMEGA_M: f64 = TAU / 10.0;

/// Frequencies between which kernels have their knees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Band {
    /// rad per unit of the mesh
    PerUnit(f64, f64),
    /// rad per mean edge
    PerEdge(f64, f64),
}

impl std::fmt::Display for Band {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Band::PerUnit(low, high) => write!(f, "{low:.3} to {high:.3} rad a unit"),
            Band::PerEdge(low, high) => write!(f, "{low:.3} to {high:.3} rad an edge"),
        }
    }
}

/// The normals of a mesh by a Krylov space that is good for smooth kernels with knees in a band.
pub fn krylov_normals(mesh: &Mesh, by: Areas, band: Band, tick: Tick) -> Result<Basis, Problem> {
    let laplacian = Laplacian::of(mesh, by);
    let field = laplacian.at_samples(mesh.normals.iter().map(|n| n.as_dvec3()));
    let band = match band {
        Band::PerUnit(low, high) => (low * laplacian.edge, high * laplacian.edge),
        Band::PerEdge(low, high) => (low, high),
    };
    let (modes, error) = krylov::modes(&laplacian, &field, band, krylov::TOLERANCE, tick)?;
    Ok(Basis::new(&laplacian, &mesh.normals, &field, &modes, FINEST, error))
}

/// The normals of a mesh by its eigenpairs up to `highest` (rad per unit), or to omega_m if that is lower.
pub fn harmonic_normals(mesh: &Mesh, by: Areas, highest: f64, tick: Tick) -> Result<Basis, Problem> {
    let laplacian = Laplacian::of(mesh, by);
    let field = laplacian.at_samples(mesh.normals.iter().map(|n| n.as_dvec3()));
    let cut = OMEGA_M.min(highest * laplacian.edge);
    let (modes, reached) = harmonics::modes(&laplacian, &field, cut, tick)?;
    Ok(Basis::new(&laplacian, &mesh.normals, &field, &modes, reached, 0.0))
}
