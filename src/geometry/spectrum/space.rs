//! An orthonormal basis that grows by blocks, in variables that are multiplied by the root of the area.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::factor::Factor;
use crate::geometry::laplacian::Laplacian;

/// A column with less than this share of new direction brings none.
const NEW: f64 = 1e-9;

pub(super) struct Space<'a> {
    laplacian: &'a Laplacian,
    /// The root of each sample's area.
    pub root: Vec<f64>,
    basis: Mat<f64>,
    /// How many columns of it are there.
    pub size: usize,
}

/// What became of one column of a block: what of it lay in the space before, and the new column with its length there.
pub(super) struct Split {
    pub inside: Vec<f64>,
    pub new: Option<(usize, f64)>,
    /// The length of what found no room, or was too short to be new.
    pub lost: f64,
}

impl<'a> Space<'a> {
    /// With room for so many columns.
    pub fn new(laplacian: &'a Laplacian, columns: usize) -> Space<'a> {
        let root = laplacian.areas.iter().map(|area| area.sqrt()).collect();
        Space { laplacian, root, basis: Mat::zeros(laplacian.samples(), columns), size: 0 }
    }

    pub fn columns(&self) -> MatRef<'_, f64> {
        self.basis.as_ref().subcols(0, self.size)
    }

    pub fn column(&self, c: usize) -> &[f64] {
        self.basis.col_as_slice(c)
    }

    pub fn is_full(&self) -> bool {
        self.size == self.basis.ncols()
    }

    /// The coordinates of columns in the basis.
    pub fn coordinates(&self, of: MatRef<f64>) -> Mat<f64> {
        let mut inside = Mat::zeros(self.size, of.ncols());
        matmul(inside.as_mut(), Accum::Replace, self.columns().transpose(), of, 1.0, Par::Seq);
        inside
    }

    /// Adds the new directions of a block. A column is compared with its own length, or with a given one.
    pub fn extend(&mut self, mut block: Mat<f64>, measure: Option<f64>) -> Vec<Split> {
        let lengths: Vec<f64> = (0..block.ncols()).map(|c| measure.unwrap_or(length(block.col_as_slice(c)))).collect();
        let before = self.size;
        let mut inside = Mat::<f64>::zeros(before, block.ncols());
        // Twice is enough.
        for _ in 0..2 {
            for c in 0..block.ncols() {
                self.without_means(block.col_as_slice_mut(c));
            }
            let more = self.coordinates(block.as_ref());
            matmul(block.as_mut(), Accum::Add, self.columns(), more.as_ref(), -1.0, Par::Seq);
            inside += more;
        }
        let mut splits = Vec::new();
        for (c, length_before) in lengths.into_iter().enumerate() {
            let mut coordinates: Vec<f64> = inside.col_as_slice(c).to_vec();
            coordinates.resize(self.size, 0.0);
            let column = block.col_as_slice_mut(c);
            for _ in 0..2 {
                for (k, coordinate) in coordinates.iter_mut().enumerate().skip(before) {
                    let other = self.basis.col_as_slice(k);
                    let along: f64 = other.iter().zip(column.iter()).map(|(a, b)| a * b).sum();
                    column.iter_mut().zip(other).for_each(|(v, o)| *v -= along * o);
                    *coordinate += along;
                }
            }
            let after = length(column);
            let new = (after > NEW * length_before && !self.is_full()).then(|| {
                let to = self.basis.col_as_slice_mut(self.size);
                to.iter_mut().zip(column.iter()).for_each(|(to, v)| *to = v / after);
                self.size += 1;
                (self.size - 1, after)
            });
            let lost = if new.is_none() { after } else { 0.0 };
            splits.push(Split { inside: coordinates, new, lost });
        }
        splits
    }

    /// Takes out of a column what is constant on each component: rounding brings it in, and solves favour it.
    pub fn without_means(&self, column: &mut [f64]) {
        let component = &self.laplacian.component;
        let mut sums = vec![(0.0, 0.0); self.laplacian.components()];
        for ((&c, root), v) in component.iter().zip(&self.root).zip(column.iter()) {
            sums[c as usize].0 += root * v;
            sums[c as usize].1 += root * root;
        }
        for ((&c, root), v) in component.iter().zip(&self.root).zip(column) {
            *v -= root * sums[c as usize].0 / sums[c as usize].1;
        }
    }

    /// What the inverse of S - shift A, of which this is the factor, makes of columns.
    pub fn invert(&self, factor: &Factor, columns: &mut Mat<f64>) {
        self.times_root(columns);
        factor.solve(columns.as_mut());
        self.times_root(columns);
    }

    fn times_root(&self, columns: &mut Mat<f64>) {
        for c in 0..columns.ncols() {
            columns.col_as_slice_mut(c).iter_mut().zip(&self.root).for_each(|(v, root)| *v *= root);
        }
    }

    /// The Laplacian of a column.
    pub fn laplacian_of(&self, column: &[f64]) -> Vec<f64> {
        let scaled: Vec<f64> = column.iter().zip(&self.root).map(|(v, root)| v / root).collect();
        let rows = self.laplacian.stiffness.outer_iterator().zip(&self.root);
        rows.map(|(row, root)| row.iter().map(|(j, w)| w * scaled[j]).sum::<f64>() / root).collect()
    }
}

pub(super) fn length(column: &[f64]) -> f64 {
    column.iter().map(|v| v * v).sum::<f64>().sqrt()
}
