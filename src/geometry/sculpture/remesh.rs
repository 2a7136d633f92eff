//! Even triangles: incremental isotropic remeshing [Botsch2004] of a closed surface that lies on a field's
//! zero set. Short edges are collapsed, edges flipped until the triangles are Delaunay, and vertices drawn to the middle
//! of their neighbours along the surface and projected back onto it.
//!
//! The lattice's triangles are at most as large as wanted, so nothing has to be split. Every step keeps a closed
//! manifold one.

use glam::DVec3;
use rayon::prelude::*;

use super::Field;

#[derive(Clone, Debug, Default)]
pub struct Surface {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// How often all three steps are done: after this many the share of bad triangles does not fall any more.
const ROUNDS: usize = 7;

/// An edge whose ends look this far apart, radians, is short enough.
const BEND: f64 = 0.3;

/// `surface` with edges of about `length`.
pub fn remesh(surface: Surface, field: &impl Field, length: f64) -> Surface {
    let mut work = Work::new(surface);
    for round in 0..ROUNDS {
        work.collapse(0.8 * length, 1.4 * length);
        work.flip();
        work.relax(field, length, if round + 1 < ROUNDS { 0.7 } else { 0.4 });
    }
    work.flip();
    work.finish()
}

struct Work {
    positions: Vec<DVec3>,
    /// Dead ones have three equal corners.
    triangles: Vec<[u32; 3]>,
    /// The living triangles around each vertex, in no order that matters but a fixed one.
    fans: Vec<Vec<u32>>,
}

impl Work {
    fn new(Surface { positions, triangles }: Surface) -> Work {
        let mut fans = vec![Vec::with_capacity(8); positions.len()];
        for (t, triangle) in triangles.iter().enumerate() {
            for &v in triangle {
                fans[v as usize].push(t as u32);
            }
        }
        Work { positions, triangles, fans }
    }

    fn at(&self, v: u32) -> DVec3 {
        self.positions[v as usize]
    }

    /// Twice the area along the normal.
    fn area(&self, [a, b, c]: [u32; 3]) -> DVec3 {
        (self.at(b) - self.at(a)).cross(self.at(c) - self.at(a))
    }

    /// The mean normal around a vertex; zero where none is left.
    fn normal(&self, v: usize) -> DVec3 {
        self.fans[v].iter().map(|&t| self.area(self.triangles[t as usize])).sum::<DVec3>().normalize_or_zero()
    }

    fn edge_length(&self, (a, b): (u32, u32)) -> f64 {
        self.at(a).distance(self.at(b))
    }

    /// Every edge once, from its smaller to its larger vertex.
    fn edges(&self) -> impl Iterator<Item = (u32, u32)> {
        let edges = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
        self.triangles.iter().flat_map(edges).filter(|(a, b)| a < b)
    }

    /// The triangle that runs from a to b, and its third vertex.
    fn beside(&self, a: u32, b: u32) -> Option<(u32, u32)> {
        self.fans[a as usize].iter().find_map(|&t| {
            let triangle = self.triangles[t as usize];
            (0..3).find(|&i| triangle[i] == a && triangle[(i + 1) % 3] == b).map(|i| (t, triangle[(i + 2) % 3]))
        })
    }

    fn are_neighbours(&self, a: u32, b: u32) -> bool {
        self.fans[a as usize].iter().any(|&t| self.triangles[t as usize].contains(&b))
    }

    /// Collapses edges below `short`, shortest first, unless that would make one above `long`.
    fn collapse(&mut self, short: f64, long: f64) {
        let normals: Vec<DVec3> = (0..self.fans.len()).into_par_iter().map(|v| self.normal(v)).collect();
        // Where the surface bends, finer triangles stay.
        let short = |(a, b): (u32, u32)| {
            let bend = normals[a as usize].angle_between(normals[b as usize]);
            short * (BEND / bend).clamp(0.45, 1.0)
        };
        let mut edges: Vec<(f64, (u32, u32))> = self
            .edges()
            .map(|edge| (self.edge_length(edge), edge))
            .filter(|&(length, edge)| length < short(edge))
            .collect();
        edges.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, (a, b)) in edges {
            // Earlier collapses may have taken an end away or moved one.
            if self.fans[b as usize].is_empty()
                || !self.are_neighbours(a, b)
                || self.edge_length((a, b)) >= short((a, b))
                || !self.may_collapse(a, b, long)
            {
                continue;
            }
            self.positions[a as usize] = 0.5 * (self.at(a) + self.at(b));
            for t in std::mem::take(&mut self.fans[b as usize]) {
                let triangle = self.triangles[t as usize];
                if triangle.contains(&a) {
                    for v in triangle {
                        self.fans[v as usize].retain(|&other| other != t);
                    }
                    self.triangles[t as usize] = [0; 3];
                } else {
                    self.triangles[t as usize] = triangle.map(|v| if v == b { a } else { v });
                    self.fans[a as usize].push(t);
                }
            }
        }
    }

    fn may_collapse(&self, a: u32, b: u32, long: f64) -> bool {
        // The surface stays a manifold if the ends share just the two vertices opposite to the edge, and if these keep
        // at least three triangles.
        let shared: Vec<u32> = self.ring(a).into_iter().filter(|&v| v != b && self.are_neighbours(v, b)).collect();
        if shared.len() != 2 || shared.iter().any(|&v| self.fans[v as usize].len() <= 3) {
            return false;
        }
        let middle = 0.5 * (self.at(a) + self.at(b));
        [(a, b), (b, a)].into_iter().all(|(end, other)| {
            self.fans[end as usize].iter().map(|&t| self.triangles[t as usize]).filter(|t| !t.contains(&other)).all(
                |triangle| {
                    let moved = triangle.map(|v| if v == end { middle } else { self.at(v) });
                    let (before, after) = (self.area(triangle), (moved[1] - moved[0]).cross(moved[2] - moved[0]));
                    let rim = triangle.into_iter().filter(|&v| v != end);
                    let longest = rim.map(|v| self.at(v).distance(middle)).fold(0.0, f64::max);
                    before.dot(after) > 0.5 * before.length() * after.length() && longest < long
                },
            )
        })
    }

    /// The neighbours of a vertex.
    fn ring(&self, v: u32) -> Vec<u32> {
        // Each triangle names the one that follows v in it: together all.
        let next = |&t: &u32| {
            let triangle = self.triangles[t as usize];
            (0..3).find(|&i| triangle[i] == v).map(|i| triangle[(i + 1) % 3])
        };
        self.fans[v as usize].iter().filter_map(next).collect()
    }

    /// Flips edges whose opposite angles add up to more than half a turn: the smallest angle of each pair grows.
    fn flip(&mut self) {
        // Flips wake their neighbours; on a nearly flat surface a few sweeps settle all.
        const SWEEPS: usize = 6;
        for _ in 0..SWEEPS {
            let edges: Vec<(u32, u32)> = self.edges().collect();
            let mut flips = 0;
            for (a, b) in edges {
                let (Some((left, c)), Some((right, d))) = (self.beside(a, b), self.beside(b, a)) else { continue };
                if self.cot(c, a, b) + self.cot(d, b, a) >= -1e-9 || self.are_neighbours(c, d) {
                    continue;
                }
                if self.fans[a as usize].len() <= 3 || self.fans[b as usize].len() <= 3 {
                    continue;
                }
                let (upper, lower) = ([a, d, c], [d, b, c]);
                let normal = self.area(self.triangles[left as usize]).normalize_or_zero()
                    + self.area(self.triangles[right as usize]).normalize_or_zero();
                let agrees = |t| self.area(t).normalize_or_zero().dot(normal) > 0.5 * normal.length();
                if !agrees(upper) || !agrees(lower) {
                    continue;
                }
                self.triangles[left as usize] = upper;
                self.triangles[right as usize] = lower;
                self.fans[a as usize].retain(|&t| t != right);
                self.fans[b as usize].retain(|&t| t != left);
                self.fans[c as usize].push(right);
                self.fans[d as usize].push(left);
                flips += 1;
            }
            if flips == 0 {
                break;
            }
        }
    }

    /// The cotangent of the angle at `v` of the triangle (v, a, b).
    fn cot(&self, v: u32, a: u32, b: u32) -> f64 {
        let (a, b) = (self.at(a) - self.at(v), self.at(b) - self.at(v));
        a.dot(b) / a.cross(b).length()
    }

    /// Moves each vertex by `share` of the way to the middle of the triangles around it, along the surface.
    fn relax(&mut self, field: &impl Field, length: f64, share: f64) {
        let moved = |(v, fan): (usize, &Vec<u32>)| {
            let p = self.positions[v];
            if fan.is_empty() {
                return p;
            }
            // Not weighted by area, which would even out what is finer for a reason.
            let (mut middle, mut normal) = (DVec3::ZERO, DVec3::ZERO);
            for &t in fan {
                let triangle = self.triangles[t as usize];
                middle += triangle.iter().map(|&v| self.at(v)).sum::<DVec3>() / (3.0 * fan.len() as f64);
                normal += self.area(triangle);
            }
            field.project(p + share * (middle - p).reject_from(normal), 0.02 * length)
        };
        self.positions = self.fans.par_iter().enumerate().map(moved).collect();
    }

    /// What lives, numbered anew.
    fn finish(self) -> Surface {
        let mut surface = Surface::default();
        let mut number = vec![0; self.positions.len()];
        for (v, fan) in self.fans.iter().enumerate().filter(|(_, fan)| !fan.is_empty()) {
            debug_assert!(fan.len() >= 3);
            number[v] = surface.positions.len() as u32;
            surface.positions.push(self.positions[v]);
        }
        let living = self.triangles.iter().filter(|t| t[0] != t[1]);
        surface.triangles.extend(living.map(|t| t.map(|v| number[v as usize])));
        surface
    }
}
