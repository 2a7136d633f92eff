//! How deep one mesh lies below another, painted into the other's texture coordinates: what an artist who has a mesh for
//! each layer would have to paint by hand [Francois2006, section 2.1].
//!
//! From every texel's place on the outer surface a ray goes inwards against the normal to the first face of the inner mesh.
//! Lengths are those of the meshes, which share one space.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;

use super::bvh::Bvh;
use super::mesh::Mesh;
use crate::problem::{Problem, Tick};

/// Row 0 at the top. `outer` has texture coordinates; its map repeats beyond [0, 1].
///
/// Gives for each texel how deep the inner mesh lies below it, infinity where no ray meets it. Texels that no face covers,
/// between the islands of a map, have the depth of a neighbour that one does cover, so that filtering finds no edge there;
/// None: no face covers any.
pub fn depth_map(
    outer: &Mesh,
    inner: &Mesh,
    (width, height): (u32, u32),
    tick: Tick,
) -> Result<Option<Vec<f64>>, Problem> {
    let bvh = Bvh::new(&[(inner, DAffine3::IDENTITY)]);
    let places = places(outer, width, height);
    let done = AtomicUsize::new(0);
    let rows: Vec<Vec<Option<f64>>> = places
        .par_chunks(width as usize)
        .map(|row| {
            tick(done.fetch_add(1, Relaxed) as f64 / f64::from(height))?;
            let depth = |(p, inwards): (DVec3, DVec3)| {
                let hit = bvh.closest_hit(p, inwards, 0.0, f64::INFINITY);
                hit.map_or(f64::INFINITY, |hit| hit.t)
            };
            Ok(row.iter().map(|place| place.map(depth)).collect())
        })
        .collect::<Result<_, Problem>>()?;
    Ok(spread(rows.concat(), width as usize))
}

/// For each texel a point of the surface and the direction inwards.
fn places(mesh: &Mesh, width: u32, height: u32) -> Vec<Option<(DVec3, DVec3)>> {
    let mut places = vec![None; (width * height) as usize];
    let size = DVec2::new(f64::from(width), f64::from(height));
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        // v runs upwards, rows run downwards.
        let [a, b, c] = triangle.map(|v| {
            let uv = mesh.uvs[v as usize].as_dvec2();
            DVec2::new(uv.x, 1.0 - uv.y) * size - 0.5
        });
        let corners = mesh.corners(t);
        let normals = triangle.map(|v| mesh.normals[v as usize].as_dvec3());
        let area = (b - a).perp_dot(c - a);
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        let (low, high) = (a.min(b).min(c).ceil(), a.max(b).max(c).floor());
        // A face that covers the map many times says nothing new each time.
        let rows = low.y as i64..=(high.y as i64).min(low.y as i64 + i64::from(height) - 1);
        for y in rows {
            for x in low.x as i64..=(high.x as i64).min(low.x as i64 + i64::from(width) - 1) {
                let p = DVec2::new(x as f64, y as f64);
                let (u, v) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
                if u < 0.0 || v < 0.0 || u + v > 1.0 {
                    continue;
                }
                let weights = [1.0 - u - v, u, v];
                let mean = |of: [DVec3; 3]| of.iter().zip(weights).map(|(p, w)| w * p).sum::<DVec3>();
                if let Some(normal) = mean(normals).try_normalize() {
                    let (x, y) = (x.rem_euclid(i64::from(width)), y.rem_euclid(i64::from(height)));
                    places[(y * i64::from(width) + x) as usize] = Some((mean(corners), -normal));
                }
            }
        }
    }
    places
}

/// Fills what is not covered from its neighbours, ring by ring; the map repeats.
fn spread(mut texels: Vec<Option<f64>>, width: usize) -> Option<Vec<f64>> {
    if texels.iter().all(Option::is_none) {
        return None;
    }
    let height = texels.len() / width;
    let mut rim: Vec<usize> = (0..texels.len()).filter(|&i| texels[i].is_some()).collect();
    while !rim.is_empty() {
        let mut next = Vec::new();
        for i in rim {
            let (x, y) = (i % width, i / width);
            let around = [
                y * width + (x + 1) % width,
                y * width + (x + width - 1) % width,
                (y + 1) % height * width + x,
                (y + height - 1) % height * width + x,
            ];
            for j in around {
                if texels[j].is_none() {
                    texels[j] = texels[i];
                    next.push(j);
                }
            }
        }
        rim = next;
    }
    texels.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use glam::Vec2;

    fn map(outer: &Mesh, inner: &Mesh, size: (u32, u32)) -> Vec<f64> {
        depth_map(outer, inner, size, &|_| Ok(())).unwrap().unwrap()
    }

    #[test]
    fn spheres_within_each_other_are_as_far_apart_everywhere() {
        let (outer, inner) = (shapes::torus(2.0, 0.8, (96, 48)), shapes::torus(2.0, 0.5, (96, 48)));
        for depth in map(&outer, &inner, (64, 32)) {
            assert!((depth - 0.3).abs() < 5e-3, "{depth}");
        }
        // What lies outside is no layer below, and neither is what is beside.
        let far = inner.transformed(&DAffine3::from_translation(DVec3::new(0.0, 9.0, 0.0)));
        assert!(map(&outer, &far, (8, 8)).iter().any(|depth| depth.is_infinite()));
    }

    #[test]
    fn a_slope_is_painted_upright_and_gaps_have_their_neighbours_depths() {
        // A square whose map fills the upper left quarter, over a plane that falls towards +x.
        let positions = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| glam::Vec3::new(x, y, 0.0));
        let sheet = Mesh {
            positions: positions.to_vec(),
            normals: vec![glam::Vec3::Z; 4],
            uvs: positions.map(|p| Vec2::new(0.5 * p.x, 0.5 + 0.5 * p.y)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let mut below = sheet.clone();
        below.positions =
            positions.map(|p| glam::Vec3::new(4.0 * p.x - 1.0, 4.0 * p.y - 1.0, -1.0 - (4.0 * p.x - 1.0))).to_vec();
        let depths = map(&sheet, &below, (16, 16));
        for (i, depth) in depths.iter().enumerate() {
            let (x, y) = (i % 16, i / 16);
            if x < 8 && y < 8 {
                assert!((depth - (1.0 + (x as f64 + 0.5) / 8.0)).abs() < 1e-5, "{x} {y} {depth}");
            }
            assert!((1.0..=2.0).contains(depth));
        }
        let bare = Mesh { uvs: vec![Vec2::ZERO; 4], ..sheet };
        assert!(depth_map(&bare, &below, (4, 4), &|_| Ok(())).unwrap().is_none());
    }
}
