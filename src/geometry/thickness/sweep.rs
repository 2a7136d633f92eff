//! Which triangles the lines of one direction meet: a plane, points and triangles in it, and cells that sort them.

use super::Crossing;
use glam::{DVec2, DVec3};

/// All points and triangles, projected along a line.
pub(super) struct Sweep<'a> {
    /// Across the line, then along it.
    points: Vec<(DVec2, f64)>,
    triangles: &'a [[u32; 3]],
    cells: Cells,
    /// The triangles that touch each cell, cell after cell.
    listed: Vec<u32>,
    /// Where each cell's triangles begin.
    begins: Vec<u32>,
}

/// Squares over the plane.
struct Cells {
    corner: DVec2,
    per_length: f64,
    across: usize,
    down: usize,
}

impl Cells {
    fn of(&self, p: DVec2) -> (usize, usize) {
        let at = (p - self.corner) * self.per_length;
        // The outermost points lie on the edge of the last cell.
        ((at.x as usize).min(self.across - 1), (at.y as usize).min(self.down - 1))
    }

    fn number(&self, (x, y): (usize, usize)) -> usize {
        y * self.across + x
    }
}

/// Triangles that may be looked at per point, in the mean, before a hierarchy is the better way.
const MOST: usize = 1024;
/// Cells along a side.
const FINEST: f64 = 4096.0;

impl<'a> Sweep<'a> {
    /// None where too many triangles would share a cell. `used` are the points that are asked for.
    pub fn new(points: &[DVec3], triangles: &'a [[u32; 3]], used: &[u32], line: DVec3) -> Option<Sweep<'a>> {
        let (a, b) = line.any_orthonormal_pair();
        // Seen along the line, what turns counter-clockwise looks ahead.
        let (a, b) = if a.cross(b).dot(line) > 0.0 { (a, b) } else { (b, a) };
        let points: Vec<(DVec2, f64)> = points.iter().map(|p| (DVec2::new(p.dot(a), p.dot(b)), p.dot(line))).collect();
        let place = |v: u32| points[v as usize].0;
        let bounds = |t: &[u32; 3]| {
            let [a, b, c] = t.map(place);
            (a.min(b).min(c), a.max(b).max(c))
        };
        let (mut min, mut max) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (mut area, mut length) = (0.0, 0.0);
        for triangle in triangles {
            let (low, high) = bounds(triangle);
            let size = high - low;
            (min, max) = (min.min(low), max.max(high));
            area += size.x * size.y;
            length += size.x + size.y;
        }
        // As wide as a triangle, so that each touches few cells: no more than seven in the mean, whatever their shapes.
        let (count, extent) = (triangles.len() as f64, (max - min).max_element());
        let side = (area / (2.0 * count)).sqrt().max(length / (4.0 * count)).max(extent / FINEST);
        let cells = match side > 0.0 {
            true => {
                let size = ((max - min) / side).floor();
                Cells { corner: min, per_length: 1.0 / side, across: size.x as usize + 1, down: size.y as usize + 1 }
            }
            // Nothing, or all at one place.
            false => Cells { corner: DVec2::ZERO, per_length: 0.0, across: 1, down: 1 },
        };
        let touched = |t: &[u32; 3]| {
            let (low, high) = bounds(t);
            let ((x0, y0), (x1, y1)) = (cells.of(low), cells.of(high));
            (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| (x, y)))
        };
        let mut begins = vec![0u32; cells.across * cells.down + 1];
        for triangle in triangles {
            touched(triangle).for_each(|cell| begins[cells.number(cell) + 1] += 1);
        }
        let in_cell = |v: &u32| begins[cells.number(cells.of(place(*v))) + 1] as usize;
        if used.iter().map(in_cell).sum::<usize>() > MOST * used.len() {
            return None;
        }
        for cell in 1..begins.len() {
            begins[cell] += begins[cell - 1];
        }
        let mut next = begins.clone();
        let mut listed = vec![0; begins[begins.len() - 1] as usize];
        for (i, triangle) in triangles.iter().enumerate() {
            touched(triangle).for_each(|cell| {
                let place = &mut next[cells.number(cell)];
                listed[*place as usize] = i as u32;
                *place += 1;
            });
        }
        Some(Sweep { points, triangles, cells, listed, begins })
    }

    /// Adds where the line through point `v` crosses triangles, and tells where on the line the point is.
    pub fn crossings(&self, v: u32, crossings: &mut Vec<Crossing>) -> f64 {
        let (q, t) = self.points[v as usize];
        let cell = self.cells.number(self.cells.of(q));
        for &i in &self.listed[self.begins[cell] as usize..self.begins[cell + 1] as usize] {
            let [a, b, c] = self.triangles[i as usize];
            let (ab, left_of_ab) = self.side(a, b, q);
            let (bc, left_of_bc) = self.side(b, c, q);
            if left_of_ab != left_of_bc {
                continue;
            }
            let (ca, left_of_ca) = self.side(c, a, q);
            if left_of_ca != left_of_ab {
                continue;
            }
            let [ta, tb, tc] = [a, b, c].map(|v| self.points[v as usize].1);
            let total = ab + bc + ca;
            // Seen exactly edge-on, a triangle has no one place on the line.
            let t = if total != 0.0 { (bc * ta + ca * tb + ab * tc) / total } else { (ta + tb + tc) / 3.0 };
            crossings.push(Crossing { t, leaves: if left_of_ab { 1 } else { -1 } });
        }
        t
    }

    /// Twice the area of (a, b, q), and whether q lies left of the edge. Both triangles at an edge ask the same question, so
    /// they get one answer; a point on the line counts as moved by (e, e²), e infinitely small.
    fn side(&self, a: u32, b: u32, q: DVec2) -> (f64, bool) {
        let (low, high, turned) = if a < b { (a, b, false) } else { (b, a, true) };
        let from = self.points[low as usize].0;
        let edge = self.points[high as usize].0 - from;
        let area = edge.perp_dot(q - from);
        let left = area > 0.0 || area == 0.0 && (edge.y < 0.0 || edge.y == 0.0 && edge.x > 0.0);
        if turned { (-area, !left) } else { (area, left) }
    }
}
