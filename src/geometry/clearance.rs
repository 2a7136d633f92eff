//! How far any point of a box is from all triangles, at least: a grid of lower bounds, looked up in no time.
//!
//! Cells that a triangle may cross are found by its box and its plane; every other cell's bound is its distance to the
//! nearest of those, cell to cell, by exact distance transforms along the three axes [Felzenszwalb2012].

use glam::{DVec3, UVec3};

/// Cells along the longest side.
const CELLS: f64 = 48.0;

pub struct Clearance {
    min: DVec3,
    /// A cell's side.
    cell: f64,
    counts: UVec3,
    /// In cells, x first.
    bounds: Vec<f32>,
}

impl Clearance {
    /// Of the box from `min` to `max` among `triangles`.
    pub fn new(min: DVec3, max: DVec3, triangles: impl Iterator<Item = [DVec3; 3]>) -> Clearance {
        let size = max - min;
        let cell = size.max_element().max(f64::MIN_POSITIVE) / CELLS;
        let counts = (size / cell).ceil().as_uvec3().max(UVec3::ONE);
        let mut grid = Clearance { min, cell, counts, bounds: Vec::new() };
        grid.bounds = vec![f32::INFINITY; (counts.x * counts.y * counts.z) as usize];
        triangles.for_each(|corners| grid.mark(corners.map(|p| (p - min) / cell)));
        for axis in 0..3 {
            grid.spread(axis);
        }
        grid.bounds.iter_mut().for_each(|squared| *squared = squared.sqrt());
        grid
    }

    /// No triangle lies nearer to `p` than this; 0 outside of the box.
    pub fn at(&self, p: DVec3) -> f64 {
        let at = (p - self.min) / self.cell;
        if at.min_element() < 0.0 || at.cmpge(self.counts.as_dvec3()).any() {
            return 0.0;
        }
        let UVec3 { x, y, z } = at.as_uvec3();
        self.bounds[((z * self.counts.y + y) * self.counts.x + x) as usize] as f64 * self.cell
    }

    /// A guess of how far it is from `p` along the unit vector `direction` to a surface, `enough` at most: it takes what is
    /// near a surface for one.
    pub fn guess(&self, p: DVec3, direction: DVec3, enough: f64) -> f64 {
        // Bounds vanish up to three cells from a surface: that of `p` itself is left behind first.
        let mut t = self.at(p).max(3.0 * self.cell);
        while t < enough {
            match self.at(p + t * direction) {
                0.0 => return t,
                clear => t += clear,
            }
        }
        enough
    }

    /// Cells that the triangle, in cells, may cross. Those around them are marked too: so a distance from cell to cell is one
    /// from box to box.
    fn mark(&mut self, [a, b, c]: [DVec3; 3]) {
        const ROOM: f64 = 1e-6;
        let (low, high) = (a.min(b).min(c) - (1.0 + ROOM), a.max(b).max(c) + (1.0 + ROOM));
        let last = self.counts.as_dvec3() - 1.0;
        if high.min_element() < 0.0 || low.cmpgt(last + 1.0).any() {
            return;
        }
        let (low, high) = (low.max(DVec3::ZERO).as_uvec3(), high.min(last).as_uvec3());
        let normal = (b - a).cross(c - a);
        // A cell and its neighbours reach one and a half cells from its middle.
        let reach = (1.5 + ROOM) * normal.abs().element_sum();
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let middle = DVec3::new(x as f64, y as f64, z as f64) + 0.5;
                    if (middle - a).dot(normal).abs() <= reach {
                        self.bounds[((z * self.counts.y + y) * self.counts.x + x) as usize] = 0.0;
                    }
                }
            }
        }
    }

    /// Squared distances along one axis more: of every cell the least, over its line, of squared distance plus bound.
    fn spread(&mut self, axis: usize) {
        let UVec3 { x, y, z } = self.counts;
        let (n, stride) = [(x, 1), (y, x), (z, x * y)][axis];
        let starts = (0..self.bounds.len()).filter(|i| (*i as u32 / stride).is_multiple_of(n));
        let mut line = vec![0.0; n as usize];
        // The parabolas of which the least is made: their places, and from where each is the least.
        let (mut places, mut from) = (Vec::with_capacity(n as usize), Vec::with_capacity(n as usize));
        for start in starts {
            let at = |i: usize| start + i * stride as usize;
            (0..n as usize).for_each(|i| line[i] = self.bounds[at(i)]);
            places.clear();
            from.clear();
            for i in (0..n as usize).filter(|&i| line[i].is_finite()) {
                let meets = |j: usize| {
                    let square = |k: usize| line[k] + (k * k) as f32;
                    (square(i) - square(j)) / (2.0 * (i as f32 - j as f32))
                };
                while places.last().is_some_and(|&j| meets(j) <= *from.last().expect("as many as places")) {
                    places.pop();
                    from.pop();
                }
                from.push(places.last().map_or(f32::NEG_INFINITY, |&j| meets(j)));
                places.push(i);
            }
            if places.is_empty() {
                continue;
            }
            let mut k = 0;
            for i in 0..n as usize {
                while k + 1 < places.len() && from[k + 1] < i as f32 {
                    k += 1;
                }
                self.bounds[at(i)] = line[places[k]] + (i as f32 - places[k] as f32).powi(2);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::nearest::Nearest;
    use crate::geometry::shapes;
    use crate::geometry::visibility::directions;

    #[test]
    fn bounds_are_below_the_distance_and_not_far_below() {
        for mesh in [shapes::torus_knot(2, 3, 1.0, 0.25, (80, 12)), shapes::cuboid(DVec3::new(1.0, 0.2, 3.0))] {
            for scale in [1.0, 1e-20, 1e20] {
                let bounds = mesh.bounds();
                let triangles = (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| scale * p));
                let (min, max) = (scale * bounds.min.as_dvec3(), scale * bounds.max.as_dvec3());
                let grid = Clearance::new(min, max, triangles);
                let nearest = Nearest::new(&mesh);
                for (i, d) in directions(4000).into_iter().enumerate() {
                    let p = 0.5 * (min + max) + 0.5 * (max - min) * d * ((i * 61 % 4000) as f64 / 4000.0);
                    let exact = scale * nearest.find(p / scale, f64::INFINITY).unwrap().distance;
                    let bound = grid.at(p);
                    assert!(bound <= exact * (1.0 + 1e-6), "{p}: {bound} > {exact}");
                    assert!(bound >= exact - 4.0 * grid.cell, "{p}: {bound} for {exact}");
                }
                assert_eq!(grid.at(max * 2.0), 0.0);
            }
        }
    }
}
