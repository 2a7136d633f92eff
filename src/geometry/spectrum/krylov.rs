//! Ritz pairs that are made for one field: a rational Krylov space [Guettel2013].
//!
//! A filter is wanted of one field b only, so that of the whole spectrum nothing matters but what b has of it. The space
//! spanned by b and by what solves of (A + S/xi) make of it, for a few poles xi around the kernel's knee, holds a very
//! good approximation to F(sqrt(L)) b for every smooth F: L is projected into it, and the eigenpairs of that small matrix
//! take the place of the Laplacian's. Slivers, whose eigenvalues are huge, cost nothing: a solve damps them to nothing.
//!
//! Steps are added until three kernels (Gaussian, exponential, that of a medium) with knees at both ends of the band change
//! by no more than [`TOLERANCE`] from one round of the poles to the next. Columns that bring nothing new, as on a sphere,
//! whose normals are nearly modes themselves, are left out.

use faer::{Mat, MatRef, Side};
use glam::DVec3;
use sprs::CsMat;

use super::factor::{Factor, Pattern};
use super::kernel::Kernel;
use super::space::{Space, length};
use super::{MOST, Modes};
use crate::geometry::laplacian::Laplacian;
use crate::problem::{Cause, Problem, Tick};

/// What kernels may change by in one round of the poles, root mean square over the surface, of a field of length 1: for
/// pictures, which see no thousandth.
pub const TOLERANCE: f64 = 2e-4;

/// Blocks of three columns, at most.
const STEPS: usize = 27;

/// The modes of a field at the samples, for kernels whose knees lie in `band`, rad per edge, until they change by no more
/// than `tolerance`; and by how much they still did.
pub fn modes(
    laplacian: &Laplacian,
    field: &[DVec3],
    band: (f64, f64),
    tolerance: f64,
    tick: Tick,
) -> Result<(Modes, f64), Problem> {
    super::on_one_thread();
    let mut space = Projected::new(laplacian, field);
    let lowest = lowest(laplacian);
    let band = within(band, lowest);
    // Nothing, if all is constant; else unknown until two spaces were compared.
    let mut error = (space.size() > 0) as u32 as f64;
    if space.size() > 0 {
        let pattern = Pattern::of(&laplacian.stiffness)?;
        let poles = poles(band, lowest);
        let mut factors = Vec::new();
        for pole in &poles {
            let factor = pattern.factor(&shifted(laplacian, *pole))?;
            factors.push(factor.ok_or_else(|| breakdown("a Laplacian with areas added could not be factorised"))?);
            tick(0.2 * factors.len() as f64 / poles.len() as f64)?;
        }
        let mut last: Option<Vec<Mat<f64>>> = None;
        for step in 1..space.steps() {
            let is_whole = !space.grow(&factors[(step - 1) % factors.len()]);
            if is_whole {
                error = 0.0;
                break;
            }
            tick(0.2 + 0.7 * step as f64 / STEPS as f64)?;
            if step % poles.len() == 0 {
                let fields = space.filtered(band)?;
                if let Some(last) = &last {
                    error = space.most_apart(last, &fields);
                    if error < tolerance {
                        break;
                    }
                }
                last = Some(fields);
            }
        }
    }
    Ok((space.ritz_pairs()?, error))
}

pub(super) fn breakdown(what: &str) -> Problem {
    Problem::new(Cause::Unfinished, what).hint("filter: Neighbours(…) needs no Laplacian")
}

/// About one wavelength around the whole, rad per edge.
fn lowest(laplacian: &Laplacian) -> f64 {
    1.0 / laplacian.areas.iter().sum::<f64>().sqrt().max(1.0)
}

/// A band no wider than the frequencies that there are: from the lowest to beyond the finest.
fn within(band: (f64, f64), lowest: f64) -> (f64, f64) {
    let highest = 2.0 * super::FINEST;
    (band.0.clamp(lowest, highest), band.1.clamp(lowest, highest))
}

/// Poles xi, 1/edge²: to twice the highest knee, which a Gaussian's end needs, and from below the lowest one, since an
/// exponential has a corner at 0: the more of the spectrum lies below its knee, the lower. A factor of 4 in frequency from one
/// to the next, or so.
fn poles((low, high): (f64, f64), lowest: f64) -> Vec<f64> {
    let (first, last) = ((2.0 * (lowest * low).sqrt()).min(0.5 * low), 2.0 * high);
    let count = ((last / first).log(4.0).round() as usize).max(1) + 1;
    let ratio = (last / first).powf(1.0 / (count - 1) as f64);
    (0..count).rev().map(|i| (first * ratio.powi(i as i32)).powi(2)).collect()
}

/// A + S/xi.
fn shifted(laplacian: &Laplacian, pole: f64) -> CsMat<f64> {
    add_areas(laplacian.stiffness.map(|w| w / pole), &laplacian.areas, 1.0)
}

/// A matrix with the areas, times a factor, added to its diagonal. Entries that are 0 keep their places, or a factor's pattern
/// would not be theirs.
pub(super) fn add_areas(mut matrix: CsMat<f64>, areas: &[f64], factor: f64) -> CsMat<f64> {
    for (i, area) in areas.iter().enumerate() {
        *matrix.get_mut(i, i).expect("a Laplacian has a diagonal") += factor * area;
    }
    matrix
}

/// A space with the Laplacian and the field in it.
struct Projected<'a> {
    space: Space<'a>,
    area: f64,
    /// Where the last block begins.
    last: usize,
    laplacian: Mat<f64>,
    /// All of it lies in the first block.
    field: Mat<f64>,
}

impl Projected<'_> {
    fn new<'a>(laplacian: &'a Laplacian, field: &[DVec3]) -> Projected<'a> {
        let n = laplacian.samples();
        let columns = 3 * STEPS.min(MOST / (3 * n.max(1))).max(1);
        let mut space = Space::new(laplacian, columns);
        let means = laplacian.means(field);
        let block = Mat::from_fn(n, 3, |i, c| space.root[i] * (field[i] - means[i])[c]);
        let whole = Mat::from_fn(n, 3, |i, c| space.root[i] * field[i][c]);
        // Of a flat plate's normals nothing but rounding is left.
        let total = (0..3).map(|c| length(whole.col_as_slice(c)).powi(2)).sum::<f64>().sqrt();
        space.extend(block.clone(), Some(total));
        let inside = space.coordinates(block.as_ref());
        let field = Mat::from_fn(columns, 3, |r, c| if r < inside.nrows() { inside[(r, c)] } else { 0.0 });
        let area = laplacian.areas.iter().sum();
        let mut projected = Projected { space, area, last: 0, laplacian: Mat::zeros(columns, columns), field };
        projected.project(0);
        projected
    }

    fn size(&self) -> usize {
        self.space.size
    }

    /// Blocks that there is room for.
    fn steps(&self) -> usize {
        self.laplacian.nrows() / 3
    }

    /// Adds what a solve makes of the last block. False when that is nothing new: the space is whole.
    fn grow(&mut self, factor: &Factor) -> bool {
        let first = self.size();
        let mut block = self.space.columns().subcols(self.last, first - self.last).to_owned();
        self.space.invert(factor, &mut block);
        self.space.extend(block, None);
        self.last = first;
        self.project(first);
        self.size() > first
    }

    /// The rows and columns of the projected Laplacian from `first` on.
    fn project(&mut self, first: usize) {
        let size = self.size();
        let images: Vec<f64> = (first..size).flat_map(|c| self.space.laplacian_of(self.space.column(c))).collect();
        let rows = self.space.root.len();
        let inside = self.space.coordinates(MatRef::from_column_major_slice(&images, rows, size - first));
        for c in first..size {
            for r in 0..size {
                self.laplacian[(r, c)] = inside[(r, c - first)];
                self.laplacian[(c, r)] = inside[(r, c - first)];
            }
        }
    }

    fn eigen(&self) -> Result<(Vec<f64>, Mat<f64>), Problem> {
        eigen(self.laplacian.as_ref().submatrix(0, 0, self.size(), self.size()))
    }

    /// The field through each of the kernels that are tried, in the basis.
    fn filtered(&self, (low, high): (f64, f64)) -> Result<Vec<Mat<f64>>, Problem> {
        let (lambda, vectors) = self.eigen()?;
        let inside = vectors.transpose() * self.field.as_ref().subrows(0, self.size());
        let kernels = [low, high].into_iter().flat_map(|knee| {
            [
                Kernel::Gaussian { width: 1.0 / knee },
                Kernel::Exponential { width: 1.0 / knee },
                Kernel::Medium { sigma_tr: knee },
            ]
        });
        let filter = |kernel: Kernel| {
            let weight = |k: usize| kernel.at(lambda[k].max(0.0).sqrt(), super::OMEGA_M);
            &vectors * Mat::from_fn(self.size(), 3, |k, c| weight(k) * inside[(k, c)])
        };
        Ok(kernels.map(filter).collect())
    }

    /// The largest difference of two such lists, the first of which may be of a smaller space; per root of the area.
    fn most_apart(&self, before: &[Mat<f64>], after: &[Mat<f64>]) -> f64 {
        let apart = |(before, after): (&Mat<f64>, &Mat<f64>)| {
            let at = |m: &Mat<f64>, k: usize, c: usize| if k < m.nrows() { m[(k, c)] } else { 0.0 };
            let entries = (0..after.nrows()).flat_map(|k| (0..3).map(move |c| (k, c)));
            entries.map(|(k, c)| (at(before, k, c) - after[(k, c)]).powi(2)).sum::<f64>()
        };
        (before.iter().zip(after).map(apart).fold(0.0, f64::max) / self.area).sqrt()
    }

    fn ritz_pairs(&self) -> Result<Modes, Problem> {
        let (lambda, vectors) = self.eigen()?;
        let inside = vectors.transpose() * self.field.as_ref().subrows(0, self.size());
        let pairs = self.space.columns() * &vectors;
        let column = |k: usize| pairs.col_as_slice(k).iter().zip(&self.space.root).map(|(v, root)| v / root);
        Ok(Modes {
            columns: (0..self.size()).flat_map(column).collect(),
            lambda: lambda.into_iter().map(|lambda| lambda.max(0.0)).collect(),
            coefficients: (0..self.size()).map(|k| DVec3::from_array([0, 1, 2].map(|c| inside[(k, c)]))).collect(),
        })
    }
}

/// Eigenvalues, ascending, and eigenvectors of a small symmetric matrix.
pub(super) fn eigen(matrix: MatRef<f64>) -> Result<(Vec<f64>, Mat<f64>), Problem> {
    if matrix.nrows() == 0 {
        return Ok((Vec::new(), Mat::zeros(0, 0)));
    }
    let found = matrix.self_adjoint_eigen(Side::Lower);
    let found = found.map_err(|_| breakdown("the eigenvalues of a small matrix could not be found"))?;
    Ok((found.S().column_vector().iter().copied().collect(), found.U().to_owned()))
}
