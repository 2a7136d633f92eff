//! L D L^T of a sparse symmetric matrix by faer, on one thread, so that every machine's bits are its own and no number of
//! threads changes them.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{
    LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, factorize_symbolic_cholesky, supernodal::SupernodalLdltRef,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use sprs::CsMat;

use crate::problem::{Cause, Problem};

/// The order of elimination and the places of the factor's entries: the same for every matrix of one pattern.
pub(super) struct Pattern(SymbolicCholesky<usize>);

/// A factor with its pattern.
pub(super) struct Factor<'a> {
    pattern: &'a Pattern,
    values: Vec<f64>,
}

fn too_large(_: impl std::fmt::Debug) -> Problem {
    Problem::new(Cause::Unfinished, "this mesh's Laplacian does not fit into memory")
        .hint("a mesh with fewer vertices, or filter: Neighbours(…)")
}

fn view(matrix: &CsMat<f64>) -> SparseColMatRef<'_, usize, f64> {
    let starts = matrix.indptr().into_raw_storage();
    let symbolic = SymbolicSparseColMatRef::new_checked(matrix.rows(), matrix.cols(), starts, None, matrix.indices());
    SparseColMatRef::new(symbolic, matrix.data())
}

impl Pattern {
    pub fn of(matrix: &CsMat<f64>) -> Result<Pattern, Problem> {
        let symbolic = view(matrix).symbolic();
        let found = factorize_symbolic_cholesky(symbolic, Side::Lower, Default::default(), Default::default());
        found.map(Pattern).map_err(too_large)
    }

    /// None where a pivot is 0.
    pub fn factor(&self, matrix: &CsMat<f64>) -> Result<Option<Factor<'_>>, Problem> {
        let mut values = vec![0.0; self.0.len_val()];
        let scratch = self.0.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(too_large)?;
        let done = self.0.factorize_numeric_ldlt(
            &mut values,
            view(matrix),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        );
        let exists = done.is_ok() && values.iter().all(|v| v.is_finite());
        Ok(exists.then_some(Factor { pattern: self, values }))
    }
}

impl Factor<'_> {
    /// Solves for all columns in place: of three at once the factor is read as often as of one.
    pub fn solve(&self, right: MatMut<f64>) {
        let mut memory = MemBuffer::new(self.pattern.0.solve_in_place_scratch::<f64>(right.ncols(), Par::Seq));
        let factor = LdltRef::new(&self.pattern.0, &self.values);
        factor.solve_in_place_with_conj(Conj::No, right, Par::Seq, MemStack::new(&mut memory));
    }

    /// How many eigenvalues of the matrix are negative, by Sylvester's law of inertia.
    pub fn negative(&self) -> usize {
        match self.pattern.0.raw() {
            SymbolicCholeskyRaw::Simplicial(symbolic) => {
                let diagonal = &symbolic.col_ptr()[..symbolic.ncols()];
                diagonal.iter().filter(|at| self.values[**at] < 0.0).count()
            }
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                let factor = SupernodalLdltRef::new(symbolic, &self.values);
                let nodes = (0..symbolic.n_supernodes()).map(|s| factor.supernode(s).val());
                nodes.map(|block| (0..block.ncols()).filter(|i| block[(*i, *i)] < 0.0).count()).sum()
            }
        }
    }
}
