//! Manifold harmonics: the eigenpairs of the Laplacian below a frequency [Vallet2008], all of them and none twice.
//!
//! Band by band, so that memory stays bounded: of each band the middle is the shift of a shift-inverted block Lanczos run
//! [Grimes1994], in the complement of the band before. How many eigenvalues a band has is told by the signs of the pivots
//! at its two ends (Sylvester's law of inertia): nothing else notices a pair that was skipped or found twice. Every pair's
//! residual is measured. A band never ends within a repeated eigenvalue.

use faer::{Mat, MatMut};
use glam::DVec3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use sprs::CsMat;
use std::ops::Range;

use super::factor::{Factor, Pattern};
use super::krylov::{add_areas, breakdown, eigen};
use super::space::{Space, length};
use super::{MOST, Modes};
use crate::geometry::laplacian::Laplacian;
use crate::problem::{Problem, Tick};

/// Meshes with fewer samples are taken apart as a whole.
const SMALL: usize = 700;

/// Pairs that a band is meant to have, and columns of a block: an eigenvalue repeated more often is found all the same,
/// with more steps.
const BAND: f64 = 80.0;
const BLOCK: usize = 8;

/// Eigenvalues nearer to each other than this, relative to themselves, count as one repeated.
const REPEATED: f64 = 1e-5;

/// A solve's residual, of the terms that it sums.
const SOUND: f64 = 1e-11;

/// A pair's residual |L y - lambda y|, of the band's upper end.
const RESIDUAL: f64 = 1e-6;

/// The modes of a field at the samples up to the frequency `cut` (rad per edge), and where they end: a little above, so
/// that no repeated eigenvalue is cut, or far below if there is no room for more.
pub fn modes(laplacian: &Laplacian, field: &[DVec3], cut: f64, tick: Tick) -> Result<(Modes, f64), Problem> {
    super::on_one_thread();
    let n = laplacian.samples();
    let (lambda, columns, reached) = match n <= SMALL {
        true => whole(laplacian, cut * cut)?,
        false => bands(laplacian, cut * cut, tick)?,
    };
    let coefficients = Modes::project(&columns, &laplacian.areas, field);
    tick(1.0)?;
    Ok((Modes { lambda, columns, coefficients }, reached.sqrt()))
}

/// Eigenvalues, columns, and the eigenvalue up to which they are all there.
type Pairs = (Vec<f64>, Vec<f64>, f64);

/// Ends between which `count` eigenvalues lie.
#[derive(Clone, Copy)]
struct Band {
    from: f64,
    to: f64,
    count: usize,
}

/// Eigenvalues and columns of one band; None: they did not converge.
type Found = Option<(Vec<f64>, Vec<f64>)>;

/// All pairs of a small mesh by dense algebra, up to the first gap above `end`.
fn whole(laplacian: &Laplacian, end: f64) -> Result<Pairs, Problem> {
    let n = laplacian.samples();
    let root: Vec<f64> = laplacian.areas.iter().map(|area| area.sqrt()).collect();
    let mut dense = Mat::<f64>::zeros(n, n);
    for (w, (i, j)) in laplacian.stiffness.iter() {
        dense[(i, j)] = w / (root[i] * root[j]);
    }
    let (lambda, vectors) = eigen(dense.as_ref())?;
    let first = laplacian.components();
    let mut last = lambda.partition_point(|lambda| *lambda <= end).max(first);
    while last > first && last < n && lambda[last] <= lambda[last - 1] * (1.0 + REPEATED) {
        last += 1;
    }
    let column = |k: usize| vectors.col_as_slice(k).iter().zip(&root).map(|(v, root)| v / root);
    let columns = (first..last).flat_map(column).collect();
    let reached = if last > first { end.max(lambda[last - 1]) } else { end };
    Ok((lambda[first..last].to_vec(), columns, reached))
}

fn bands(laplacian: &Laplacian, end: f64, tick: Tick) -> Result<Pairs, Problem> {
    let slicer = Slicer { laplacian, pattern: Pattern::of(&laplacian.stiffness)? };
    let area: f64 = laplacian.areas.iter().sum();
    // Weyl's law: lambda area / (4 pi) eigenvalues lie below lambda.
    let width = BAND * 4.0 * std::f64::consts::PI / area;
    let (mut lambda, mut columns): (Vec<f64>, Vec<f64>) = Default::default();
    let (mut from, mut below) = (0.0, laplacian.components());
    let mut previous = 0;
    while from < end {
        let mut aim = (from + width).min(end);
        let (to, count, found) = loop {
            let (to, negative) = slicer.end_of_band(aim)?;
            let count = negative.checked_sub(below).ok_or_else(|| breakdown("eigenvalues were counted twice"))?;
            // A crowd of eigenvalues, as many small components have it, or a run that did not converge: half of the band.
            let is_narrow = aim - from < 1e-3 * width;
            let found = match count > 2 * BAND as usize && !is_narrow {
                true => None,
                false => {
                    let known = &columns[columns.len() - previous * laplacian.samples()..];
                    slicer.pairs(Band { from, to, count }, known, &|share| tick((from + share * (to - from)) / end))?
                }
            };
            match found {
                Some(found) => break (to, count, found),
                None if is_narrow => return Err(breakdown("eigenpairs of a band did not converge")),
                None => aim = from + 0.5 * (aim - from),
            }
        };
        if columns.len() + found.1.len() > MOST {
            break;
        }
        lambda.extend(found.0);
        columns.extend(found.1);
        (from, below, previous) = (to, below + count, count);
        tick((from / end).min(1.0))?;
    }
    Ok((lambda, columns, from))
}

struct Slicer<'a> {
    laplacian: &'a Laplacian,
    pattern: Pattern,
}

/// Whether a factor solves what it was made of: by the residual of one solve, beside what it cancels.
fn is_sound(factor: &Factor, matrix: &CsMat<f64>) -> bool {
    let right: Vec<f64> = (0..matrix.rows()).map(|i| (1.7 * i as f64 + 0.4).sin()).collect();
    let mut solved = right.clone();
    factor.solve(MatMut::from_column_major_slice_mut(&mut solved, right.len(), 1));
    let (mut residual, mut scale) = (0.0f64, 0.0f64);
    for (row, right) in matrix.outer_iterator().zip(&right) {
        let terms = row.iter().map(|(j, w)| w * solved[j]);
        residual += (terms.clone().sum::<f64>() - right).powi(2);
        scale += (terms.map(f64::abs).sum::<f64>() + right.abs()).powi(2);
    }
    residual.sqrt() < SOUND * scale.sqrt()
}

impl Slicer<'_> {
    /// S - shift A. Its pivots are not sought, so that one near 0 can spoil all that follows: a solve tells, and then the
    /// shift is moved a little, which is enough to keep most digits.
    fn factor(&self, shift: f64) -> Result<Factor<'_>, Problem> {
        for moved in [0.0, 1e-8, 1e-7, 1e-6].map(|by| shift * (1.0 + by)) {
            let matrix = add_areas(self.laplacian.stiffness.clone(), &self.laplacian.areas, -moved);
            if let Some(factor) = self.pattern.factor(&matrix)?
                && is_sound(&factor, &matrix)
            {
                return Ok(factor);
            }
        }
        Err(breakdown("a shifted Laplacian could not be factorised"))
    }

    /// A place at or above `aim` where no eigenvalue is near, and how many lie below it.
    fn end_of_band(&self, aim: f64) -> Result<(f64, usize), Problem> {
        let mut at = aim;
        loop {
            let below = self.factor(at * (1.0 - REPEATED))?.negative();
            if below == self.factor(at * (1.0 + REPEATED))?.negative() {
                return Ok((at, below));
            }
            at *= 1.0 + 3.0 * REPEATED;
        }
    }

    /// All pairs of a band, orthogonal to the known columns.
    fn pairs(&self, band: Band, known: &[f64], tick: Tick) -> Result<Found, Problem> {
        let Band { from, to, count } = band;
        if count == 0 {
            return Ok(Some((Vec::new(), Vec::new())));
        }
        let n = self.laplacian.samples();
        // Not on an eigenvalue, whose inverse would drown all others.
        let (shift, _) = self.end_of_band(0.5 * (from + to))?;
        let factor = self.factor(shift)?;
        let known_count = known.len() / n;
        // The pairs at a band's ends are hard to tell from those beyond: some fifty steps, whatever their number.
        let most = (4 * count + 48 * BLOCK).min(n - self.laplacian.components());
        let mut space = Space::new(self.laplacian, known_count + most);
        let scaled = Mat::from_fn(n, known_count, |i, k| known[k * n + i] * self.laplacian.areas[i].sqrt());
        space.extend(scaled, Some(1.0));
        let first = space.size;
        // Seeded, so that a mesh always has the same basis.
        let mut random = Pcg64Mcg::new(0x5eed + count as u128);
        let mut block = Mat::from_fn(n, BLOCK, |_, _| random.next_u64() as f64 / u64::MAX as f64 - 0.5);
        let mut projected = Mat::<f64>::zeros(first + most, first + most);
        let mut last = first;
        space.extend(block.clone(), None);
        loop {
            // What the inverse makes of the last block, and what of that is new.
            let range = last..space.size;
            block = space.columns().subcols(range.start, range.len()).to_owned();
            space.invert(&factor, &mut block);
            let splits = space.extend(block, None);
            for (c, split) in range.clone().zip(&splits) {
                for (r, value) in split.inside.iter().enumerate().skip(first).filter(|(r, _)| *r <= c) {
                    projected[(r, c)] = *value;
                    projected[(c, r)] = *value;
                }
            }
            // Nothing new, or no room for it.
            let is_whole = space.size == range.end;
            let size = range.end - first;
            if size * 2 >= 3 * count || is_whole {
                tick((size as f64 / most as f64).min(1.0))?;
                let (inverse, vectors) = eigen(projected.as_ref().submatrix(first, first, size, size))?;
                // A Ritz vector's residual is what its last block leaves behind.
                let left = |k: usize| {
                    let tail = splits.iter().enumerate().map(|(c, split)| {
                        let outside: f64 = split.inside.iter().skip(range.end).map(|v| v * v).sum::<f64>()
                            + split.new.map_or(0.0, |(_, length)| length * length)
                            + split.lost * split.lost;
                        vectors[(range.start - first + c, k)].abs() * outside.sqrt()
                    });
                    tail.sum::<f64>()
                };
                let inside: Vec<usize> = (0..size)
                    .filter(|&k| inverse[k] != 0.0 && (from..to).contains(&(shift + 1.0 / inverse[k])))
                    .collect();
                let largest = inverse.iter().fold(0.0f64, |most, v| most.max(v.abs()));
                let converged = inside.iter().all(|&k| left(k) < 1e-9 * inverse[k].abs() + 1e-13 * largest);
                if inside.len() == count && converged {
                    let ritz = inside.into_iter().map(|k| (shift + 1.0 / inverse[k], vectors.col_as_slice(k)));
                    return Ok(accept(&space, (&factor, shift), first..range.end, ritz.collect(), RESIDUAL * to));
                }
                if is_whole {
                    return Ok(None);
                }
            }
            last = range.end;
        }
    }
}

/// Ritz values and vectors in a range of a space's columns as pairs with ascending eigenvalues, if every residual is small.
///
/// A Ritz vector is a sum of columns that cancel where a wave of the band is nothing. Last digits stay there, and where
/// samples are tiny, on specks and slivers, the Laplacian makes any size of them. One solve more, with the factor of that
/// shift, damps what lies far above the band [Ericsson1980].
fn accept(
    space: &Space,
    (factor, shift): (&Factor, f64),
    range: Range<usize>,
    mut ritz: Vec<(f64, &[f64])>,
    residual: f64,
) -> Found {
    ritz.sort_by(|a, b| a.0.total_cmp(&b.0));
    let chosen = Mat::from_fn(range.len(), ritz.len(), |r, c| ritz[c].1[r]);
    let mut vectors = space.columns().subcols(range.start, range.len()) * chosen;
    space.invert(factor, &mut vectors);
    let (mut lambda, mut columns) = (Vec::new(), Vec::new());
    for (c, &(value, _)) in ritz.iter().enumerate() {
        let column = vectors.col_as_slice_mut(c);
        column.iter_mut().for_each(|v| *v *= value - shift);
        space.without_means(column);
        let image = space.laplacian_of(column);
        let left: Vec<f64> = image.iter().zip(&*column).map(|(image, v)| image - value * v).collect();
        if length(&left) > residual {
            return None;
        }
        lambda.push(value);
        columns.extend(column.iter().zip(&space.root).map(|(v, root)| v / root));
    }
    Some((lambda, columns))
}

/// Every pair of a small mesh, for tests of what does without.
#[cfg(test)]
pub(super) fn all(laplacian: &Laplacian, field: &[DVec3]) -> Result<Modes, Problem> {
    let (lambda, columns, _) = whole(laplacian, f64::INFINITY)?;
    let coefficients = Modes::project(&columns, &laplacian.areas, field);
    Ok(Modes { lambda, columns, coefficients })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::laplacian::Areas;
    use crate::geometry::shapes;

    fn worst_apart(a: &[DVec3], b: &[DVec3]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, |m, d| if d <= m { m } else { d })
    }

    /// Both have repeated eigenvalues: whatever basis of their spaces is found, the field is the same.
    #[test]
    fn bands_find_what_dense_algebra_finds_and_no_pair_twice() {
        let cube = shapes::slab(DVec3::splat(1.0), (10, 10));
        for (name, mesh) in [("sphere", shapes::sphere(1.0, 3)), ("cube", cube)] {
            let laplacian = Laplacian::of(&mesh, Areas::VertexArea);
            let field: Vec<DVec3> =
                (0..laplacian.samples()).map(|i| DVec3::new(1.0, 0.3, -0.2) * (1.7 * i as f64).sin()).collect();
            // Three bands or so.
            let area: f64 = laplacian.areas.iter().sum();
            let end = 200.0 * 4.0 * std::f64::consts::PI / area;
            let found = bands(&laplacian, end, &|_| Ok(())).unwrap();
            let (lambda, columns, reached) = whole(&laplacian, found.2).unwrap();
            assert!(found.2 >= end && reached >= end);
            assert!(lambda.len() > 140, "{name}: {}", lambda.len());
            assert_eq!(found.0.len(), lambda.len(), "{name}");
            for (a, b) in found.0.iter().zip(&lambda) {
                assert!((a - b).abs() < 1e-6 * end, "{name}: {a} {b}");
            }
            let modes = |(lambda, columns): (Vec<f64>, Vec<f64>)| {
                let coefficients = Modes::project(&columns, &laplacian.areas, &field);
                Modes { lambda, columns, coefficients }
            };
            let [a, b] = [(found.0, found.1), (lambda, columns)].map(modes);
            let [at, bt] = [&a, &b].map(|modes| modes.sum(laplacian.samples(), |_| 1.0));
            assert!(worst_apart(&at, &bt) < 1e-5, "{name}: {}", worst_apart(&at, &bt));
            // Orthonormal by area.
            for k in [0, 1, 40, 81, 120] {
                for j in 0..a.lambda.len() {
                    let pairs = a.column(k).iter().zip(a.column(j)).zip(&laplacian.areas);
                    let product: f64 = pairs.map(|((x, y), area)| area * x * y).sum();
                    assert!((product - (k == j) as u32 as f64).abs() < 1e-6, "{name}: {k} {j} {product}");
                }
            }
        }
    }

    /// A speck's samples have a millionth of a millionth of the others' area, and its waves as many times their eigenvalues.
    #[test]
    fn a_speck_beside_a_sphere_leaves_its_pairs_as_they_are() {
        let mesh = shapes::sphere(1.0, 3);
        let speck = shapes::sphere(1e-6, 1);
        let mut both = mesh.clone();
        both.positions.extend(&speck.positions);
        both.normals.extend(&speck.normals);
        both.uvs.clear();
        both.triangles.extend(speck.triangles.iter().map(|t| t.map(|v| v + mesh.positions.len() as u32)));
        let [alone, found] = [&mesh, &both].map(|mesh| {
            let laplacian = Laplacian::of(mesh, Areas::VertexArea);
            let end = 60.0 * laplacian.edge * laplacian.edge;
            let (lambda, columns, _) = bands(&laplacian, end, &|_| Ok(())).unwrap();
            let per_unit: Vec<f64> = lambda.iter().map(|l| l / (laplacian.edge * laplacian.edge)).collect();
            (per_unit, columns, laplacian)
        });
        assert!(alone.0.len() > 50 && found.0.len() == alone.0.len(), "{} {}", alone.0.len(), found.0.len());
        for (a, b) in alone.0.iter().zip(&found.0) {
            assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        }
        let (_, columns, laplacian) = found;
        let largest = |component: u32| {
            let parts = columns.iter().zip(laplacian.component.iter().cycle());
            parts.filter(|(_, c)| **c == component).fold(0.0f64, |most, (v, _)| most.max(v.abs()))
        };
        assert!(largest(1) < 1e-9 * largest(0), "{} {}", largest(1), largest(0));
    }

    #[test]
    fn a_sphere_has_its_frequencies_as_often_as_it_should() {
        let mesh = shapes::sphere(1.0, 3);
        let laplacian = Laplacian::of(&mesh, Areas::VertexArea);
        let field = vec![DVec3::ONE; laplacian.samples()];
        // l (l + 1) with 2 l + 1 modes each; between those of 3 and of 4.
        let cut = (16.0f64).sqrt() * laplacian.edge;
        let (modes, reached) = modes(&laplacian, &field, cut, &|_| Ok(())).unwrap();
        let expected: Vec<f64> = (1..4).flat_map(|l| vec![(l * (l + 1)) as f64; 2 * l + 1]).collect();
        assert_eq!(modes.lambda.len(), expected.len());
        assert!(reached >= cut);
        for (found, expected) in modes.lambda.iter().zip(&expected) {
            let found = found / (laplacian.edge * laplacian.edge);
            assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
        }
        // A constant has nothing of any.
        assert!(modes.coefficients.iter().all(|c| c.length() < 1e-9));
        // A cut within the five of l = 2 takes them all, or none: they are not repeated here, but nearly.
        let within = modes.lambda[5].sqrt();
        let (cut, _) = super::modes(&laplacian, &field, within, &|_| Ok(())).unwrap();
        assert!(cut.lambda.last().unwrap() * (1.0 + REPEATED) < modes.lambda[cut.lambda.len()]);
    }
}
