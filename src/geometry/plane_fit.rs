//! The plane that stands for the surface around each vertex, where light enters that was scattered below it
//! [Francois2006, eqs. 7-8, 14].
//!
//! The paper fits a plane to the vertices within a sphere of radius -ln(epsilon)/sigma_t, and keeps the length of its
//! normal as the distance from the vertex, which can be neither negative nor zero. Here a plane is a unit normal and a
//! signed offset along it, and the fit is one that a mesh cannot spoil:
//!
//! - a neighbour counts by the area that it stands for, so that another triangulation gives the same plane, and less the
//!   farther away it is, so that nothing jumps where one comes within the radius;
//! - what looks the other way is another side of the thing, and no place through which light comes in here;
//! - the plane looks to the side of the vertex's own normal. Where there are too few neighbours, where they lie on a line
//!   or fill space, or where the plane is far from tangential, it is the tangent plane.
//!
//! Lengths are the mesh's. Sums are taken in units of the radius, so that no size of a mesh is special.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use glam::{DMat3, DVec3, Vec4};
use rayon::prelude::*;

use super::mesh::{Mesh, weld};
use super::neighbours::Grid;
use crate::problem::{Problem, Tick};

/// Fewer neighbours than this make no plane.
const FEWEST: usize = 4;
/// The plane's own two directions: the shorter spread is at least this share of the longer one, squared.
const LINE: f64 = 1e-3;
/// Across the plane: the spread is at most this share of the shorter one within it, squared.
const BLOB: f64 = 0.5;
/// The least cosine between the plane's normal and the vertex's.
const TURNED: f64 = 0.5;

/// A place of the mesh: all vertices there together.
struct Place {
    p: DVec3,
    normal: DVec3,
    area: f64,
}

/// One plane per vertex: its unit normal, and its signed distance from the vertex along that normal, negative where the
/// surface is convex. `radius` is in the mesh's unit; more than a quarter of the mesh's diagonal is no neighbourhood any
/// more, and counts as that much.
pub fn fit(mesh: &Mesh, radius: f64, tick: Tick) -> Result<Vec<Vec4>, Problem> {
    let radius = radius.min(0.25 * mesh.bounds().diagonal());
    let (places, place_of) = places(mesh);
    let points: Vec<DVec3> = places.iter().map(|place| place.p).collect();
    let grid = Grid::new(&points, radius);
    let mut cell_of = vec![0; places.len()];
    for (c, cell) in grid.cells.iter().enumerate() {
        grid.order[cell.start..cell.end].iter().for_each(|&i| cell_of[i as usize] = c);
    }
    let done = AtomicUsize::new(0);
    let plane = |v: usize| {
        let normal = mesh.normals[v].as_dvec3();
        let middle = &places[place_of[v] as usize];
        let rows = grid.rows_around(grid.cells[cell_of[place_of[v] as usize]].key);
        let near = rows.into_iter().flatten().filter_map(|i| {
            let other = &places[grid.order[i] as usize];
            let q = (other.p - middle.p) / radius;
            let weight = other.area * (1.0 - q.length_squared());
            (weight > 0.0 && other.normal.dot(normal) > 0.0).then_some((q, weight))
        });
        if done.fetch_add(1, Relaxed).is_multiple_of(4096) {
            tick(v as f64 / mesh.positions.len() as f64)?;
        }
        let (plane, offset) = through(near, normal).unwrap_or((normal, 0.0));
        Ok(plane.extend(offset * radius).as_vec4())
    };
    (0..mesh.positions.len()).into_par_iter().map(plane).collect()
}

/// Equal positions are one place; and the place of each vertex.
fn places(mesh: &Mesh) -> (Vec<Place>, Vec<u32>) {
    let weld = weld(&mesh.positions);
    let mut number = vec![0; weld.len()];
    let mut places: Vec<Place> = Vec::new();
    for (v, (&first, area)) in weld.iter().zip(mesh.vertex_areas()).enumerate() {
        if first as usize == v {
            number[v] = places.len() as u32;
            places.push(Place { p: mesh.positions[v].as_dvec3(), normal: DVec3::ZERO, area: 0.0 });
        }
        number[v] = number[first as usize];
        let place = &mut places[number[v] as usize];
        place.area += area;
        place.normal += area * mesh.normals[v].as_dvec3();
    }
    (places, number)
}

/// The plane through weighted points, and its distance from the origin along its normal. None where they make none.
fn through(points: impl Iterator<Item = (DVec3, f64)>, side: DVec3) -> Option<(DVec3, f64)> {
    let (mut count, mut total, mut sum, mut squares) = (0, 0.0, DVec3::ZERO, DMat3::ZERO);
    for (q, weight) in points {
        count += 1;
        total += weight;
        sum += weight * q;
        squares += weight * DMat3::from_cols(q.x * q, q.y * q, q.z * q);
    }
    if count < FEWEST || total == 0.0 {
        return None;
    }
    let middle = sum / total;
    let spread = squares * (1.0 / total) - DMat3::from_cols(middle.x * middle, middle.y * middle, middle.z * middle);
    let (values, vectors) = principal(spread);
    let normal = vectors.x_axis * vectors.x_axis.dot(side).signum();
    let is_plane = values.y > LINE * values.z && values.x < BLOB * values.y && normal.dot(side) > TURNED;
    is_plane.then(|| (normal, middle.dot(normal)))
}

/// Eigenvalues of a symmetric matrix, ascending, and their unit vectors as columns: Jacobi's rotations.
fn principal(matrix: DMat3) -> (DVec3, DMat3) {
    // Each sweep squares what is left beside the diagonal.
    const SWEEPS: usize = 6;
    let (mut a, mut v) = (matrix.to_cols_array_2d(), DMat3::IDENTITY.to_cols_array_2d());
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            let turn = |m: &mut [[f64; 3]; 3]| {
                let (x, y) = (m[p], m[q]);
                m[p] = std::array::from_fn(|i| c * x[i] - s * y[i]);
                m[q] = std::array::from_fn(|i| s * x[i] + c * y[i]);
            };
            turn(&mut a);
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            turn(&mut v);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    let columns = order.map(|i| DVec3::from_array(v[i]).normalize());
    (DVec3::from_array(order.map(|i| a[i][i])), DMat3::from_cols(columns[0], columns[1], columns[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use glam::{DAffine3, DQuat, Vec3};

    fn planes(mesh: &Mesh, radius: f64) -> Vec<Vec4> {
        fit(mesh, radius, &|_| Ok(())).unwrap()
    }

    #[test]
    fn a_symmetric_matrix_is_taken_apart() {
        for turn in [DQuat::IDENTITY, DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(2.1)] {
            for values in [DVec3::new(1e-9, 2.0, 3.0), DVec3::new(0.0, 0.0, 5.0), DVec3::ONE] {
                let r = DMat3::from_quat(turn);
                let (found, vectors) = principal(r * DMat3::from_diagonal(values) * r.transpose());
                assert!((found - values).abs().max_element() < 1e-14, "{found}");
                let back = vectors * DMat3::from_diagonal(found) * vectors.transpose();
                assert!((back * r - r * DMat3::from_diagonal(values)).to_cols_array().iter().all(|x| x.abs() < 1e-13));
            }
        }
    }

    #[test]
    fn a_spheres_planes_lie_below_it_by_half_the_mean_sag() {
        let (radius, reach) = (2.0, 0.4);
        let mesh = shapes::sphere(radius, 5);
        // With the weight 1 - q² the mean of q² over a disk is a third.
        let sag = reach * reach / (6.0 * radius);
        for (v, plane) in planes(&mesh, reach).into_iter().enumerate() {
            assert!(plane.truncate().dot(mesh.normals[v]) > 0.9999, "{v}");
            assert!((f64::from(plane.w) / -sag - 1.0).abs() < 0.05, "{} {sag}", plane.w);
        }
        // A wider sphere lies deeper; a smaller one than the edges holds no plane but the tangent one.
        assert!(planes(&mesh, 2.0 * reach)[0].w < -3.5 * sag as f32);
        for (v, plane) in planes(&mesh, 1e-6).into_iter().enumerate() {
            assert_eq!(plane, mesh.normals[v].extend(0.0));
        }
    }

    #[test]
    fn bumps_are_smoothed_and_pits_lie_below_their_planes() {
        // A flat grid with every other vertex pulled out: normals sway, planes do not.
        let mut mesh = shapes::slab(DVec3::new(4.0, 4.0, 1.0), (32, 32));
        let top = |p: &Vec3| p.z > 0.4;
        let bumpy: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|p| {
                let odd = ((p.x * 8.0).round() as i32 + (p.y * 8.0).round() as i32).rem_euclid(2) as f32;
                if top(p) { *p + 0.03 * odd * Vec3::Z } else { *p }
            })
            .collect();
        mesh.positions = bumpy;
        mesh.normals = mesh.smooth_normals();
        let planes = planes(&mesh, 0.6);
        let inner = |v: &usize| top(&mesh.positions[*v]) && mesh.positions[*v].truncate().abs().max_element() < 1.3;
        for v in (0..mesh.positions.len()).filter(inner) {
            assert!(planes[v].truncate().dot(Vec3::Z) > 0.9999);
            // All lie at one height: half of the vertices are pulled out, and a third of the area belongs to them.
            let height = mesh.positions[v].z + planes[v].w - 0.5;
            assert!((height - 0.01).abs() < 0.003, "{height} at {v}");
            assert_eq!(planes[v].w < 0.0, mesh.positions[v].z > 0.515);
        }
    }

    #[test]
    fn size_place_and_the_order_of_vertices_change_nothing() {
        let mesh = shapes::torus(1.0, 0.4, (40, 20));
        let usual = planes(&mesh, 0.3);
        for scale in [1e-25, 1e-6, 1e20] {
            let scaled = mesh.transformed(&DAffine3::from_scale(DVec3::splat(scale)));
            for (a, b) in planes(&scaled, 0.3 * scale).iter().zip(&usual) {
                let w = (f64::from(a.w) / scale) as f32;
                assert!(a.truncate().distance(b.truncate()) < 1e-5 && (w - b.w).abs() < 1e-6, "{a} {b}");
            }
        }
        let mut turned = mesh.clone();
        turned.positions.reverse();
        turned.normals.reverse();
        turned.uvs.clear();
        let last = mesh.positions.len() as u32 - 1;
        turned.triangles.iter_mut().flatten().for_each(|v| *v = last - *v);
        for (a, b) in planes(&turned, 0.3).iter().rev().zip(&usual) {
            assert!(a.distance(*b) < 1e-5);
        }
    }

    #[test]
    fn no_mesh_makes_something_that_is_no_number() {
        let line: Vec<Vec3> = (0..9).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect();
        let needle = Mesh {
            normals: vec![Vec3::Z; line.len()],
            uvs: vec![],
            triangles: (0..7).map(|i| [i, i + 1, i + 2]).collect(),
            positions: line,
        };
        let point =
            Mesh { positions: vec![Vec3::ONE; 5], normals: vec![Vec3::Y; 5], uvs: vec![], triangles: vec![[0, 1, 2]] };
        let thin = shapes::slab(DVec3::new(1.0, 1.0, 1e-5), (6, 6));
        for (mesh, radius) in [(&needle, 3.0), (&point, 1.0), (&thin, 0.3), (&thin, f64::INFINITY), (&thin, 0.0)] {
            for (plane, normal) in planes(mesh, radius).iter().zip(&mesh.normals) {
                assert!(plane.is_finite() && (plane.truncate().length() - 1.0).abs() < 1e-5);
                assert!(plane.truncate().dot(*normal) >= TURNED as f32);
            }
        }
        // The other side of a thin thing does not draw the plane into its middle.
        let side = |v: &usize| thin.normals[*v].z.abs() > 0.9;
        let planes = planes(&thin, 0.3);
        assert!((0..thin.positions.len()).filter(side).all(|v| planes[v].w.abs() < 1e-6));
        assert!(fit(&Mesh::default(), 1.0, &|_| Ok(())).unwrap().is_empty());
    }
}
