//! Procedural shapes: closed, counter-clockwise seen from outside, centred at the origin, lengths in scene units.
//!
//! Smooth shapes carry the exact normals of the surface that their vertices lie on. Vertices are repeated along uv
//! seams and hard edges, with bitwise equal positions.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec2, dvec2, dvec3};

use crate::geometry::mesh::Mesh;

/// An icosphere of 20 · 4^subdivisions triangles. Its uvs are longitude (from +x towards -z) and latitude (south to
/// north), and its poles lie on the y axis.
pub fn sphere(radius: f64, subdivisions: u32) -> Mesh {
    let (mut directions, mut triangles) = icosahedron();
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                directions.push((directions[a as usize] + directions[b as usize]).normalize());
                directions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let mut mesh = Mesh { triangles, ..Mesh::default() };
    for d in &directions {
        mesh.positions.push((radius * d).as_vec3());
        mesh.normals.push(d.as_vec3());
        mesh.uvs.push(dvec2((-d.z).atan2(d.x).rem_euclid(TAU) / TAU, d.y.clamp(-1.0, 1.0).asin() / PI + 0.5).as_vec2());
    }
    part_at_seam(&mut mesh);
    mesh
}

fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    // Standing on a vertex: poles, and two rings of five at latitude ± atan(1/2).
    let (height, ring) = (0.2f64.sqrt(), 0.8f64.sqrt());
    let mut directions = vec![DVec3::Y, DVec3::NEG_Y];
    for i in 0..5 {
        let (a, b) = (TAU * i as f64 / 5.0, TAU * (i as f64 + 0.5) / 5.0);
        directions.push(dvec3(ring * a.cos(), height, -ring * a.sin()));
        directions.push(dvec3(ring * b.cos(), -height, -ring * b.sin()));
    }
    let mut triangles = Vec::new();
    for i in 0..5 {
        let (upper, lower) = (2 + 2 * i, 3 + 2 * i);
        let (next_upper, next_lower) = (2 + 2 * ((i + 1) % 5), 3 + 2 * ((i + 1) % 5));
        triangles.push([0, upper, next_upper]);
        triangles.push([1, next_lower, lower]);
        triangles.push([upper, lower, next_upper]);
        triangles.push([next_upper, lower, next_lower]);
    }
    (directions, triangles)
}

/// Gives triangles across longitude 0 vertices of their own at u + 1, and each triangle at a pole a pole vertex at the
/// middle of its side, so that no triangle spans the whole texture.
fn part_at_seam(mesh: &mut Mesh) {
    let mut copies: HashMap<(u32, u32), u32> = HashMap::new();
    let mut poles = Vec::new();
    for t in 0..mesh.triangles.len() {
        let triangle = mesh.triangles[t];
        let is_pole = |v: u32| mesh.normals[v as usize].y.abs() == 1.0;
        let mut u = triangle.map(|v| mesh.uvs[v as usize].x);
        let pole = triangle.iter().position(|&v| is_pole(v));
        let round = (0..3).filter(|&i| Some(i) != pole).map(|i| u[i]);
        let (low, high) = round.fold((1f32, 0f32), |(low, high), u| (low.min(u), high.max(u)));
        if high - low > 0.5 {
            u.iter_mut().filter(|u| **u < 0.5).for_each(|u| *u += 1.0);
        }
        if let Some(pole) = pole {
            u[pole] = 0.5 * (u[(pole + 1) % 3] + u[(pole + 2) % 3]);
            // The first triangle at a pole takes the pole's own vertex.
            if !poles.contains(&triangle[pole]) {
                poles.push(triangle[pole]);
                mesh.uvs[triangle[pole] as usize].x = u[pole];
            }
        }
        for i in 0..3 {
            let v = triangle[i];
            if u[i] != mesh.uvs[v as usize].x {
                mesh.triangles[t][i] = *copies.entry((v, u[i].to_bits())).or_insert_with(|| {
                    mesh.positions.push(mesh.positions[v as usize]);
                    mesh.normals.push(mesh.normals[v as usize]);
                    mesh.uvs.push(Vec2::new(u[i], mesh.uvs[v as usize].y));
                    mesh.positions.len() as u32 - 1
                });
            }
        }
    }
}

/// A box of 12 triangles with hard edges.
pub fn cuboid(size: DVec3) -> Mesh {
    slab(size, (1, 1))
}

/// A box whose two faces across z are grids of `segments` cells along (x, y); its rims have as many cells along and one
/// across. Hard edges. The uvs run over each of the six faces.
pub fn slab(size: DVec3, segments: (u32, u32)) -> Mesh {
    let mut mesh = Mesh::default();
    let half = 0.5 * size;
    let (nx, ny) = segments;
    // Each face by its right, up and outward directions, and its cells along the first two.
    for (right, up, cells) in [
        (DVec3::X, DVec3::Y, (nx, ny)),
        (DVec3::NEG_X, DVec3::Y, (nx, ny)),
        (DVec3::NEG_Z, DVec3::Y, (1, ny)),
        (DVec3::Z, DVec3::Y, (1, ny)),
        (DVec3::X, DVec3::NEG_Z, (nx, 1)),
        (DVec3::X, DVec3::Z, (nx, 1)),
    ] {
        let out = right.cross(up);
        let along = |axis: DVec3, i: u32, n: u32| {
            // Counted from the nearer end, so that faces that run opposite ways meet bit by bit.
            axis * if 2 * i <= n { i as f64 / n as f64 * 2.0 - 1.0 } else { 1.0 - (n - i) as f64 / n as f64 * 2.0 }
        };
        grid(&mut mesh, cells, |i, j| (half * (along(right, i, cells.0) + along(up, j, cells.1) + out), out));
    }
    mesh
}

/// A torus about the y axis: `radius` to the middle of the tube, `tube` its own radius, `segments` (along, around).
pub fn torus(radius: f64, tube: f64, segments: (u32, u32)) -> Mesh {
    tube_along(segments, tube, |t| {
        let (sin, cos) = (TAU * t).sin_cos();
        let outward = dvec3(cos, 0.0, -sin);
        (radius * outward, outward, DVec3::Y)
    })
}

/// A tube along the curve that winds `p` times about the y axis and `q` times about the middle circle of a torus of
/// radii `radius` and `radius / 2`. A knot when p and q have no common divisor; with one, it covers itself.
pub fn torus_knot(p: u32, q: u32, radius: f64, tube: f64, segments: (u32, u32)) -> Mesh {
    tube_along(segments, tube, |t| {
        let (p, q) = (p as f64, q as f64);
        let (sin, cos) = (TAU * t * p).sin_cos();
        let (outward, forward) = (dvec3(cos, 0.0, -sin), dvec3(-sin, 0.0, -cos));
        let (sin, cos) = (TAU * t * q).sin_cos();
        // The curve lies on the torus, so the torus's normal is perpendicular to it and turns smoothly along it.
        let normal = cos * outward + sin * DVec3::Y;
        let center = radius * (outward + 0.5 * normal);
        let tangent = p * (1.0 + 0.5 * cos) * forward + 0.5 * q * (cos * DVec3::Y - sin * outward);
        (center, normal, normal.cross(tangent).normalize())
    })
}

/// A closed tube. `frame` maps a share of the length to the middle and to two perpendicular directions n, b across the
/// tube, with the tube running along b × n.
fn tube_along(segments: (u32, u32), tube: f64, frame: impl Fn(f64) -> (DVec3, DVec3, DVec3)) -> Mesh {
    let mut mesh = Mesh::default();
    grid(&mut mesh, segments, |i, j| {
        // The last row and column repeat the first ones bit by bit.
        let (center, n, b) = frame((i % segments.0) as f64 / segments.0 as f64);
        let (sin, cos) = (TAU * (j % segments.1) as f64 / segments.1 as f64).sin_cos();
        let normal = cos * n + sin * b;
        (center + tube * normal, normal)
    });
    mesh
}

/// Appends a sheet of `cells` quads with `at(i, j) = (position, normal)`; i runs to the right and j up, seen from where
/// it looks. The diagonals alternate, so that the sheet has no grain.
fn grid(mesh: &mut Mesh, cells: (u32, u32), at: impl Fn(u32, u32) -> (DVec3, DVec3)) {
    let (n, m) = cells;
    let first = mesh.positions.len() as u32;
    for j in 0..=m {
        for i in 0..=n {
            let (position, normal) = at(i, j);
            mesh.positions.push(position.as_vec3());
            mesh.normals.push(normal.as_vec3());
            mesh.uvs.push(DVec2::new(i as f64 / n as f64, j as f64 / m as f64).as_vec2());
        }
    }
    for j in 0..m {
        for i in 0..n {
            let a = first + j * (n + 1) + i;
            let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
            mesh.triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outward(mesh: &Mesh, least: f64) {
        for (triangle, face) in mesh.triangles.iter().zip(mesh.face_normals()) {
            for &v in triangle {
                let n = mesh.normals[v as usize].as_dvec3();
                assert!((n.length() - 1.0).abs() < 1e-6);
                assert!(n.dot(face) > least, "{}", n.dot(face));
            }
        }
        assert_eq!(mesh.uvs.len(), mesh.positions.len());
        assert!(mesh.uvs.iter().all(|uv| uv.min_element() >= 0.0 && uv.x <= 2.0 && uv.y <= 1.0));
    }

    /// The volume must tend to `exact`, its error falling as the square of the cell.
    fn converges(exact: f64, mesh: impl Fn(u32) -> Mesh) {
        let [coarse, fine] = [1, 2].map(|n| (mesh(n).signed_volume() - exact).abs() / exact);
        assert!(fine < 0.02 && (coarse / fine - 4.0).abs() < 0.4, "{coarse} {fine}");
    }

    #[test]
    fn spheres() {
        for n in 0..5 {
            let mesh = sphere(2.0, n);
            assert_eq!(mesh.triangles.len(), 20 * 4usize.pow(n));
            assert!(mesh.is_closed());
            assert_eq!(mesh.topology().euler(), 2);
            outward(&mesh, if n == 0 { 0.7 } else { 0.85 });
            assert!(mesh.positions.iter().all(|p| (p.length() - 2.0).abs() < 1e-6));
            let spans = mesh.triangles.iter().map(|t| {
                let u = t.map(|v| mesh.uvs[v as usize].x);
                u.iter().fold(0f32, |m, &x| m.max(x)) - u.iter().fold(9f32, |m, &x| m.min(x))
            });
            assert!(spans.fold(0f32, f32::max) < 0.51);
        }
        converges(4.0 / 3.0 * PI * 8.0, |n| sphere(2.0, n + 2));
    }

    #[test]
    fn boxes_and_slabs() {
        let mesh = slab(dvec3(3.0, 2.0, 0.3), (7, 5));
        assert!(mesh.is_closed());
        assert_eq!(mesh.topology().euler(), 2);
        assert_eq!(mesh.triangles.len(), 2 * (2 * 35 + 2 * 7 + 2 * 5));
        assert!((mesh.signed_volume() - 1.8).abs() < 1e-6);
        outward(&mesh, 1.0 - 1e-6);
        let mesh = cuboid(dvec3(1.0, 2.0, 3.0));
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (24, 12));
        assert!((mesh.area() - 22.0).abs() < 1e-5 && mesh.is_closed());
        assert_eq!(mesh.bounds().size(), dvec3(1.0, 2.0, 3.0));
    }

    #[test]
    fn tori_and_knots() {
        let mesh = torus(2.0, 0.5, (48, 16));
        assert!(mesh.is_closed());
        assert_eq!((mesh.topology().euler(), mesh.topology().components), (0, 1));
        outward(&mesh, 0.9);
        converges(2.0 * PI * PI * 2.0 * 0.25, |n| torus(2.0, 0.5, (24 * n, 16 * n)));

        let mesh = torus_knot(2, 3, 1.0, 0.15, (200, 16));
        assert!(mesh.is_closed());
        assert_eq!((mesh.topology().euler(), mesh.topology().components), (0, 1));
        outward(&mesh, 0.85);
        // A tube that does not overlap itself has the volume of its section times its length (Pappus).
        let mut length = 0.0;
        for i in 0..10_000 {
            let at = |i: f64| {
                let (a, b) = (2.0 * TAU * i / 1e4, 3.0 * TAU * i / 1e4);
                let r = 1.0 + 0.5 * b.cos();
                dvec3(r * a.cos(), 0.5 * b.sin(), -r * a.sin())
            };
            length += at(i as f64).distance(at(i as f64 + 1.0));
        }
        converges(PI * 0.15 * 0.15 * length, |n| torus_knot(2, 3, 1.0, 0.15, (100 * n, 16 * n)));
    }
}
