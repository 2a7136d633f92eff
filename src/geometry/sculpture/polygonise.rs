//! The zero set of a field as triangles: marching tetrahedra [Doi1991].
//!
//! Each cell of a cubic lattice is parted into the six tetrahedra along its diagonal, which fit those of its neighbours.
//! A linear function on a tetrahedron has one sheet at most, so the result is closed and manifold whatever the field.

use std::collections::HashMap;

use glam::{DVec3, IVec3, ivec3};
use rayon::prelude::*;

use super::Field;
use super::remesh::Surface;

/// Cells along a block's side. The field is asked at the middle of each block whether the surface can pass through it.
const BLOCK: i32 = 8;

/// A lattice edge: its lower end and the steps (a bit per axis) to its upper end.
type Edge = (IVec3, u8);

/// Triangles of about the size of `cell`, counter-clockwise seen from outside.
pub fn polygonise(field: &impl Field, cell: f64) -> Surface {
    let (min, max) = field.bounds();
    let min = min - 2.0 * cell;
    let blocks = ((max + 2.0 * cell - min) / (BLOCK as f64 * cell)).ceil().as_ivec3();
    let at = |i: IVec3| min + cell * i.as_dvec3();
    let order = (0..blocks.element_product())
        .map(|i| BLOCK * ivec3(i % blocks.x, i / blocks.x % blocks.y, i / (blocks.x * blocks.y)));
    let parts: Vec<Vec<[(Edge, DVec3); 3]>> =
        order.collect::<Vec<_>>().into_par_iter().map(|block| polygonise_block(field, block, cell, &at)).collect();

    let mut surface = Surface::default();
    let mut vertices: HashMap<Edge, u32> = HashMap::new();
    for triangle in parts.into_iter().flatten() {
        surface.triangles.push(triangle.map(|(edge, p)| {
            *vertices.entry(edge).or_insert_with(|| {
                surface.positions.push(p);
                surface.positions.len() as u32 - 1
            })
        }));
    }
    surface
}

fn polygonise_block(
    field: &impl Field,
    block: IVec3,
    cell: f64,
    at: &impl Fn(IVec3) -> DVec3,
) -> Vec<[(Edge, DVec3); 3]> {
    // Fields may overstate distances by two.
    let reach = 3f64.sqrt() * 0.5 * BLOCK as f64 * cell;
    if field.distance(0.5 * (at(block) + at(block + BLOCK))).abs() > 2.0 * reach {
        return vec![];
    }
    const SIDE: i32 = BLOCK + 1;
    let offsets = (0..SIDE * SIDE * SIDE).map(|i| ivec3(i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)));
    let values: Vec<f64> = offsets.map(|o| field.distance(at(block + o))).collect();
    let value = |i: IVec3| {
        let o = i - block;
        values[(o.x + SIDE * (o.y + SIDE * o.z)) as usize]
    };
    let crossing = |a: IVec3, b: IVec3| {
        // Along an edge no coordinate falls.
        let (lower, upper) = (a.min(b), a.max(b));
        let (below, above) = (value(lower), value(upper));
        // Kept from the ends, where several vertices would fall together.
        let t = (below / (below - above)).clamp(0.05, 0.95);
        let steps = (upper - lower).dot(ivec3(1, 2, 4)) as u8;
        ((lower, steps), at(lower).lerp(at(upper), t))
    };
    let mut triangles = Vec::new();
    for i in 0..BLOCK * BLOCK * BLOCK {
        let base = block + ivec3(i % BLOCK, i / BLOCK % BLOCK, i / (BLOCK * BLOCK));
        for corners in TETRAHEDRA {
            let corners = corners.map(|c| base + ivec3(c & 1, c >> 1 & 1, c >> 2));
            march(corners, corners.map(|c| value(c) < 0.0), &crossing, &mut triangles);
        }
    }
    triangles
}

/// Corners of the cube as bits x, y, z; each tetrahedron turns positively.
const TETRAHEDRA: [[i32; 4]; 6] = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

fn march<V>(
    corners: [IVec3; 4],
    inside: [bool; 4],
    crossing: &impl Fn(IVec3, IVec3) -> V,
    triangles: &mut Vec<[V; 3]>,
) {
    // The corners with those inside first, as an even permutation of the positive tetrahedron.
    let mut order = [0, 1, 2, 3];
    order.sort_by_key(|&i| !inside[i]);
    let swaps = (0..4).map(|i| (0..i).filter(|&j| order[j] > order[i]).count()).sum::<usize>();
    let count = inside.iter().filter(|&&inside| inside).count();
    if swaps % 2 == 1 {
        // Two corners on the same side may change places.
        if count < 3 { order.swap(2, 3) } else { order.swap(0, 1) }
    }
    let [i, j, k, l] = order.map(|i| corners[i]);
    let x = crossing;
    match count {
        1 => triangles.push([x(i, j), x(i, k), x(i, l)]),
        2 => {
            triangles.push([x(i, k), x(i, l), x(j, l)]);
            triangles.push([x(i, k), x(j, l), x(j, k)]);
        }
        3 => triangles.push([x(l, i), x(l, j), x(l, k)]),
        _ => (),
    }
}
