//! The Laplace-Beltrami operator of a mesh: S phi = lambda A phi, with the cotangent stiffness S and the areas A around the
//! vertices, by which [Patro2007, eq. 4] is to be read.
//!
//! The equation as printed has the sign of -S and divides by a mean area, which is no Laplacian on an uneven mesh. Here S
//! is the sum over triangles of their Dirichlet energies, so that it is positive semi-definite whatever the triangles are;
//! they are those of the intrinsic Delaunay triangulation after mollification [Sharp2020], so that slivers neither turn
//! weights negative nor make them huge. A is the area of what lies nearest to each vertex. Both are the surface's and its
//! vertices' own [Bobenko2007]: where a cell of a grid could be cut by either diagonal, neither choice and no order of the
//! triangles is seen. No length here is absolute: all are divided by the mean edge.
//!
//! Vertices at one position are one *sample*: a surface that was split along uv seams or creases hangs together, and its
//! doubled vertices share one value. A sample's normal is the mean of its vertices' by area, and what tells these from each
//! other lies above every frequency of the mesh. A vertex without a triangle of its own (or only with triangles whose
//! corners coincide) has no sample.

use super::intrinsic::Intrinsic;
use super::mesh::{Mesh, weld};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use sprs::CsMat;

/// No sample.
pub const NOWHERE: u32 = u32::MAX;

/// What lies nearest to a vertex is at least this share of a third of the triangles around it.
const LEAST: f64 = 1e-3;

/// By what the stiffness is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Areas {
    /// By the area of what lies nearest to each vertex.
    #[default]
    VertexArea,
    /// By the mean of all, as [Patro2007, eq. 4] is printed: where triangles are small, frequencies count as lower than they
    /// are.
    MeanArea,
}

/// The operator, and the samples that it works on.
pub struct Laplacian {
    /// Symmetric, positive semi-definite; constants of each component are mapped to 0. It has no unit.
    pub stiffness: CsMat<f64>,
    /// The area that each sample stands for, in units of `edge`². All are positive.
    pub areas: Vec<f64>,
    /// Which connected part each sample belongs to, from 0.
    pub component: Vec<u32>,
    /// The sample of each vertex, or [`NOWHERE`].
    pub sample: Vec<u32>,
    /// The share of each vertex in its sample's value.
    share: Vec<f64>,
    /// The mean length of an edge, in the mesh's unit; 1 if there is none.
    pub edge: f64,
}

impl Laplacian {
    pub fn of(mesh: &Mesh, by: Areas) -> Laplacian {
        let weld = weld(&mesh.positions);
        let faces: Vec<[u32; 3]> = mesh
            .triangles
            .iter()
            .map(|t| t.map(|v| weld[v as usize]))
            .filter(|&[a, b, c]| a != b && b != c && c != a)
            .collect();
        let mut place = vec![NOWHERE; weld.len()];
        faces.iter().flatten().for_each(|&v| place[v as usize] = 0);
        let mut count = 0;
        for place in place.iter_mut().filter(|place| **place == 0) {
            *place = count;
            count += 1;
        }
        let sample: Vec<u32> = weld.iter().map(|&v| place[v as usize]).collect();
        let edge = match mesh.mean_edge_length() {
            0.0 => 1.0,
            edge => edge,
        };
        let length = |a: u32, b: u32| {
            mesh.positions[a as usize].as_dvec3().distance(mesh.positions[b as usize].as_dvec3()) / edge
        };
        let lengths = faces.iter().map(|&[a, b, c]| [length(a, b), length(b, c), length(c, a)]).collect();
        let corners: Vec<[u32; 3]> = faces.iter().map(|face| face.map(|v| place[v as usize])).collect();
        let component = components(&corners, count as usize);
        let triangles = Intrinsic::new(corners, lengths, &component);
        let (stiffness, mut areas) = assemble(&triangles, count as usize);
        if by == Areas::MeanArea {
            let mean = areas.iter().sum::<f64>() / areas.len() as f64;
            areas.fill(mean);
        }
        Laplacian { stiffness, areas, component, share: shares(mesh, &sample, count as usize), sample, edge }
    }

    pub fn samples(&self) -> usize {
        self.areas.len()
    }

    /// How many parts there are that share no sample.
    pub fn components(&self) -> usize {
        self.component.iter().max().map_or(0, |last| *last as usize + 1)
    }

    /// A field on the vertices as one on the samples.
    pub fn at_samples(&self, field: impl IntoIterator<Item = DVec3>) -> Vec<DVec3> {
        let mut values = vec![DVec3::ZERO; self.samples()];
        for ((&s, share), value) in self.sample.iter().zip(&self.share).zip(field) {
            if s != NOWHERE {
                values[s as usize] += share * value;
            }
        }
        values
    }

    /// The mean by area of a field over each component, for each sample: what no filter of frequencies above 0 touches.
    pub fn means(&self, field: &[DVec3]) -> Vec<DVec3> {
        let (mut sums, mut areas) = (vec![DVec3::ZERO; self.components()], vec![0.0; self.components()]);
        for ((&c, area), value) in self.component.iter().zip(&self.areas).zip(field) {
            sums[c as usize] += *area * *value;
            areas[c as usize] += area;
        }
        self.component.iter().map(|&c| sums[c as usize] / areas[c as usize]).collect()
    }
}

/// The share of each vertex in its sample, by area.
fn shares(mesh: &Mesh, sample: &[u32], count: usize) -> Vec<f64> {
    let areas = mesh.vertex_areas();
    let (mut total, mut copies) = (vec![0.0; count], vec![0.0; count]);
    for (&s, area) in sample.iter().zip(&areas).filter(|(s, _)| **s != NOWHERE) {
        total[s as usize] += area;
        copies[s as usize] += 1.0;
    }
    let share = |(&s, area): (&u32, &f64)| match s {
        NOWHERE => 0.0,
        s if total[s as usize] > 0.0 => area / total[s as usize],
        s => 1.0 / copies[s as usize],
    };
    sample.iter().zip(&areas).map(share).collect()
}

/// Which connected part each sample belongs to, numbered by their first samples.
fn components(corners: &[[u32; 3]], count: usize) -> Vec<u32> {
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    let mut parent: Vec<u32> = (0..count as u32).collect();
    for &[a, b, c] in corners {
        for (from, to) in [(a, b), (b, c)] {
            let (from, to) = (root(&mut parent, from), root(&mut parent, to));
            parent[from.max(to) as usize] = from.min(to);
        }
    }
    let mut number = vec![0; count];
    let mut parts = 0;
    for v in 0..count as u32 {
        let first = root(&mut parent, v);
        if first == v {
            number[v as usize] = parts;
            parts += 1;
        } else {
            number[v as usize] = number[first as usize];
        }
    }
    number
}

fn assemble(triangles: &Intrinsic, count: usize) -> (CsMat<f64>, Vec<f64>) {
    let (mut areas, mut thirds, mut diagonal) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
    let mut sides: Vec<(u32, u32, f64)> = Vec::with_capacity(6 * triangles.corners.len());
    for (t, corners) in triangles.corners.iter().enumerate() {
        let nearest = triangles.nearest(t);
        for i in 0..3 {
            areas[corners[i] as usize] += nearest[i] / triangles.sheets;
            thirds[corners[i] as usize] += triangles.area(t) / (3.0 * triangles.sheets);
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            let weight = 0.5 * triangles.cotangent(3 * t + i) / triangles.sheets;
            // An edge that returns to where it began costs nothing.
            if a != b {
                diagonal[a as usize] += weight;
                diagonal[b as usize] += weight;
                sides.extend([(a, b, -weight), (b, a, -weight)]);
            }
        }
    }
    // Parts of slivers cancel, and what is left may be less than their rounding: no cell is that small beside its triangles.
    areas.iter_mut().zip(thirds).for_each(|(area, third)| *area = area.max(LEAST * third));
    (symmetric(&diagonal, &sides), areas)
}

/// A matrix of a diagonal, all of which is there, and the sums of entries off it, of which each is given with its mirror
/// image. Sorted by rows in one sweep, then within each: a fifth of the time of sorting them all.
fn symmetric(diagonal: &[f64], entries: &[(u32, u32, f64)]) -> CsMat<f64> {
    let mut ends = vec![0; diagonal.len() + 1];
    entries.iter().for_each(|entry| ends[entry.0 as usize + 1] += 1);
    (0..diagonal.len()).for_each(|row| ends[row + 1] += ends[row]);
    let mut rows = vec![(0, 0.0); entries.len()];
    let mut next = ends.clone();
    for &(row, column, value) in entries {
        rows[next[row as usize]] = (column as usize, value);
        next[row as usize] += 1;
    }
    let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for (row, own) in diagonal.iter().enumerate() {
        let row_entries = &mut rows[ends[row]..ends[row + 1]];
        // Stable, so that mirror images are summed in one order.
        row_entries.sort_by_key(|(column, _)| *column);
        let mut has_own = false;
        for same in row_entries.chunk_by(|one, other| one.0 == other.0) {
            if !has_own && same[0].0 > row {
                columns.push(row);
                values.push(*own);
                has_own = true;
            }
            columns.push(same[0].0);
            values.push(same.iter().map(|(_, value)| value).sum());
        }
        if !has_own {
            columns.push(row);
            values.push(*own);
        }
        starts.push(columns.len());
    }
    CsMat::new_csc((diagonal.len(), diagonal.len()), starts, columns, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::normals::Normals;
    use crate::geometry::shapes;
    use glam::{DAffine3, Vec3};

    fn energy(laplacian: &Laplacian, f: &[f64]) -> f64 {
        laplacian.stiffness.iter().map(|(w, (i, j))| w * f[i] * f[j]).sum()
    }

    #[test]
    fn constants_cost_nothing_and_a_linear_function_its_gradient_squared() {
        let mesh = shapes::slab(DVec3::new(3.0, 2.0, 1.0), (7, 5));
        let laplacian = Laplacian::of(&mesh, Areas::VertexArea);
        assert!(energy(&laplacian, &vec![3.0; laplacian.samples()]).abs() < 1e-9);
        // x over the box: 1 on all faces but the two that look along x.
        let mut x = vec![0.0; laplacian.samples()];
        laplacian.sample.iter().zip(&mesh.positions).for_each(|(&s, p)| x[s as usize] = p.x as f64);
        let expected = 2.0 * (3.0 * 2.0 + 3.0 * 1.0);
        assert!((energy(&laplacian, &x) / expected - 1.0).abs() < 1e-5, "{}", energy(&laplacian, &x));
        let area: f64 = laplacian.areas.iter().sum::<f64>() * laplacian.edge * laplacian.edge;
        assert!((area / 22.0 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn coordinates_of_a_sphere_have_the_energy_of_their_frequency() {
        // -div grad x = 2/R² x; the integral of x² over the sphere is 4 pi R^4 / 3. The error falls with the edges squared.
        let error = |level| {
            let mesh = shapes::sphere(2.0, level);
            let laplacian = Laplacian::of(&mesh, Areas::VertexArea);
            let x: Vec<f64> = mesh.positions.iter().map(|p| p.x as f64).collect();
            (energy(&laplacian, &x) / (2.0 * 4.0 * std::f64::consts::PI * 4.0 / 3.0) - 1.0).abs()
        };
        assert!(error(4) < 4e-3 && error(3) / error(4) > 3.5, "{} {}", error(3), error(4));
    }

    #[test]
    fn splitting_and_stray_vertices_and_scale_change_nothing() {
        let mesh = shapes::torus(1.0, 0.4, (24, 12));
        let base = Laplacian::of(&mesh, Areas::VertexArea);
        let mut split = mesh.clone().with_normals(Normals::Flat);
        split.positions.push(Vec3::splat(1e9));
        split.normals.push(Vec3::Y);
        split.uvs.clear();
        split.triangles.extend([[0, 0, 1], [2, 2, 2]]);
        let other = Laplacian::of(&split, Areas::VertexArea);
        assert_eq!(other.samples(), base.samples());
        assert_eq!(*other.sample.last().unwrap(), NOWHERE);
        let sorted = |l: &Laplacian| {
            let mut weights: Vec<f64> = l.stiffness.data().to_vec();
            weights.sort_by(f64::total_cmp);
            weights
        };
        let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + a.abs()));
        assert!(close(&sorted(&base), &sorted(&other)));
        // No coordinate is so small that it would lose bits.
        for k in [2f64.powi(-60), 2f64.powi(60)] {
            let scaled = Laplacian::of(&mesh.transformed(&DAffine3::from_scale(DVec3::splat(k))), Areas::VertexArea);
            assert_eq!(scaled.stiffness, base.stiffness);
            assert_eq!(scaled.areas, base.areas);
        }
    }

    #[test]
    fn neither_diagonals_nor_orders_are_seen_where_cells_could_be_cut_by_either() {
        let closed = shapes::slab(DVec3::splat(1.0), (12, 12));
        // Its front alone is a sheet: bent to a fan of low trapezoids, it has obtuse angles at its border.
        let mut sheet = Mesh { triangles: closed.triangles[..288].to_vec(), ..closed.clone() };
        sheet
            .positions
            .iter_mut()
            .for_each(|p| *p = (2.0 + p.y) * Vec3::new((4.0 * p.x).cos(), (4.0 * p.x).sin(), 0.0));
        for (name, mesh) in [("cube", &closed), ("sheet", &sheet)] {
            let base = Laplacian::of(mesh, Areas::VertexArea);
            // Every second cell cut by its other diagonal, and all in reverse.
            let mut other = mesh.clone();
            for pair in other.triangles.chunks_exact_mut(2).step_by(2) {
                let [one, two] = [pair[0], pair[1]];
                let far = *two.iter().find(|v| !one.contains(v)).expect("a cell has four corners");
                let k = one.iter().position(|v| !two.contains(v)).expect("one of each is its own");
                let [near, next, last] = [0, 1, 2].map(|i| one[(k + i) % 3]);
                pair.copy_from_slice(&[[near, next, far], [near, far, last]]);
            }
            other.triangles.reverse();
            let thirds =
                mesh.vertex_areas().iter().zip(other.vertex_areas()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let laplacian = Laplacian::of(&other, Areas::VertexArea);
            assert_eq!(laplacian.sample, base.sample);
            // The mean edge has another length with other diagonals.
            let scale = (laplacian.edge / base.edge).powi(2);
            let apart = laplacian.areas.iter().zip(&base.areas).map(|(a, b)| (a * scale - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-6 && thirds / base.edge.powi(2) > 0.01, "{name}: {apart}, thirds {thirds}");
            let edges = laplacian.stiffness.iter().chain(base.stiffness.iter()).map(|(_, at)| at);
            let weight = |of: &Laplacian, (i, j)| of.stiffness.get(i, j).copied().unwrap_or(0.0);
            let apart = edges.map(|at| (weight(&laplacian, at) - weight(&base, at)).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-6, "{name}: {apart}");
            assert!(base.stiffness.iter().all(|(w, (i, j))| i == j || *w < 1e-6), "{name}: no weight is negative");
        }
    }

    #[test]
    fn slivers_and_faces_without_area_keep_weights_in_bounds() {
        let mut mesh = shapes::sphere(1.0, 2);
        for step in [1e-3, 1e-5, 1e-7] {
            // Every vertex of the upper half is drawn towards the pole until the triangles there are needles.
            for p in mesh.positions.iter_mut().filter(|p| p.y > 0.3) {
                p.x *= step as f32;
            }
            let n = mesh.positions.len() as u32;
            mesh.triangles.extend([[0, 1, n - 1], [0, 1, 0]]);
            let laplacian = Laplacian::of(&mesh, Areas::VertexArea);
            assert!(laplacian.areas.iter().all(|a| *a > 0.0));
            let largest = laplacian.stiffness.data().iter().fold(0.0f64, |m, w| m.max(w.abs()));
            assert!(largest.is_finite() && largest < 1e5, "{largest}");
            let f: Vec<f64> = (0..laplacian.samples()).map(|i| (7.3 * i as f64).sin()).collect();
            assert!(energy(&laplacian, &f) > 0.0);
        }
    }

    #[test]
    fn components_are_told_apart_and_each_keeps_its_mean() {
        let mut mesh = shapes::sphere(1.0, 1);
        let n = mesh.positions.len() as u32;
        let far = mesh.transformed(&DAffine3::from_translation(DVec3::X * 5.0));
        mesh.positions.extend(far.positions);
        mesh.normals.extend(far.normals);
        mesh.triangles.extend(far.triangles.iter().map(|t| t.map(|v| v + n)));
        let laplacian = Laplacian::of(&mesh, Areas::VertexArea);
        let side = |v: u32| laplacian.component[laplacian.sample[v as usize] as usize];
        assert_eq!((side(0), side(n), laplacian.components()), (0, 1, 2));
        let field: Vec<DVec3> = (0..2 * n).map(|i| DVec3::splat(if i < n { 1.0 } else { -3.0 })).collect();
        let means = laplacian.means(&laplacian.at_samples(field.iter().copied()));
        let mean = |v: u32| means[laplacian.sample[v as usize] as usize];
        assert!((0..2 * n).all(|v| mean(v).distance(field[v as usize]) < 1e-12));
    }
}
