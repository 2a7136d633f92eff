//! Roughly how much light there is inside a thing, so that paths go where it is.
//!
//! What a path may still bring is its weight times the fluence where it stands. Paths that promise much more than they did
//! at first are split, and of those that promise much less only some go on, with more weight [Vorba2016]: no path walks
//! long in the dark, and those that reach the light are many. That changes no mean, whatever the fluence is; so it need
//! not be more than what diffusion makes of the lamps on a coarse grid: -D ∇²phi + sigma_a phi = q, with light entering a
//! mean free path below the surface and leaving through it as [Jensen2001] has it, solved by conjugate gradients.

use super::random::Random;
use super::volume::Tracer;
use super::world::{Matter, Medium, Point};
use crate::optics::Rgb;
use crate::optics::fresnel::{diffuse_transmittance, fresnel_dielectric};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Of one thing.
pub struct Guide {
    /// Where the first cell begins, and the side of each.
    corner: DVec3,
    cell: f64,
    size: [usize; 3],
    fluence: Vec<Vec3>,
}

/// Cells along the longest side.
const CELLS: f64 = 40.0;

/// Thinner things, in reduced mean free paths, are as bright all over as paths need to know.
const THIN: f64 = 3.0;

/// Points of the surface at which light enters.
const ENTRIES: usize = 8192;

/// What a path promises may grow and shrink by this factor before something is done about it.
const ROOM: f64 = 2.5;

/// At most so many paths of one.
const MOST: f64 = 8.0;

impl Guide {
    /// None for things that are not entered, too thin, or dark.
    pub fn new(tracer: &Tracer, thing: usize) -> Option<Guide> {
        let body = &tracer.world.things[thing];
        let Matter::Translucent { surface, medium } = &body.matter else { return None };
        let corners = body.mesh.positions.iter().map(|p| body.world_from_object.transform_point3(p.as_dvec3()));
        let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (min, max) = corners.fold(nothing, |(min, max), p| (min.min(p), max.max(p)));
        let longest = (max - min).max_element();
        let sigma_t = reduced(medium);
        if longest.is_nan() || longest * sigma_t.max_element() < THIN {
            return None;
        }
        let cell = longest / CELLS;
        // A border of one cell, where what lies on the surface finds its neighbours' light.
        let size = ((max - min) / cell).to_array().map(|n| n.ceil() as usize + 2);
        let corner = min - cell;
        let mut guide = Guide { corner, cell, size, fluence: vec![Vec3::ZERO; size.iter().product()] };
        let inside = guide.inside(tracer, thing);
        let source = guide.source(tracer, thing, surface.ior, 1.0 / sigma_t.max_element(), &inside);
        for channel in 0..3 {
            let (sigma_t, sigma_a) = (sigma_t[channel], medium.sigma_a[channel]);
            if sigma_t > 0.0 {
                let source: Vec<f64> = source.iter().map(|q| q[channel]).collect();
                let fluence = guide.diffuse(&inside, &source, sigma_t, sigma_a, surface.ior);
                guide.fluence.iter_mut().zip(fluence).for_each(|(to, phi)| to[channel] = phi as f32);
            }
        }
        guide.spread(&inside);
        let brightest = guide.fluence.iter().map(|phi| phi.element_sum()).fold(0.0, f32::max);
        if brightest == 0.0 || !brightest.is_finite() {
            return None;
        }
        // What diffusion does not see is not quite dark.
        let least = Vec3::splat(1e-3 * brightest);
        guide.fluence.iter_mut().for_each(|phi| *phi = phi.max(least));
        Some(guide)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    fn cell_of(&self, p: DVec3) -> usize {
        let at = ((p - self.corner) / self.cell).to_array();
        self.index(std::array::from_fn(|axis| (at[axis].max(0.0) as usize).min(self.size[axis] - 1)))
    }

    /// Which cells' middles lie inside the thing.
    fn inside(&self, tracer: &Tracer, thing: usize) -> Vec<bool> {
        let mut inside = vec![false; self.fluence.len()];
        for z in 0..self.size[2] {
            for y in 0..self.size[1] {
                // Off the middle by a little, so that a row meets no vertex of a mesh that is aligned with the grid.
                let start = self.corner + self.cell * DVec3::new(0.0, y as f64 + 0.5137, z as f64 + 0.5211);
                let hits = tracer.world.along(thing, start, DVec3::X);
                let turn = |hit: &Point| if hit.flat.x < 0.0 { 1 } else { -1 };
                // Where a mesh is open nobody knows.
                if hits.iter().map(turn).sum::<i32>() != 0 {
                    continue;
                }
                let (mut next, mut depth) = (0, 0);
                for x in 0..self.size[0] {
                    let at = self.cell * (x as f64 + 0.5);
                    while next < hits.len() && hits[next].t < at {
                        depth += turn(&hits[next]);
                        next += 1;
                    }
                    inside[self.index([x, y, z])] = depth > 0;
                }
            }
        }
        inside
    }

    /// Light that enters, per volume.
    fn source(&self, tracer: &Tracer, thing: usize, ior: f64, depth: f64, inside: &[bool]) -> Vec<Rgb> {
        let body = &tracer.world.things[thing];
        let areas: Vec<f64> = (0..body.mesh.triangles.len())
            .scan(0.0, |sum, t| {
                let [a, b, c] = body.mesh.corners(t);
                *sum += 0.5 * (b - a).cross(c - a).length();
                Some(*sum)
            })
            .collect();
        let area = areas.last().copied().unwrap_or(0.0);
        let mut random = Random::new(0, thing as u64, 0);
        let mut source = vec![Rgb::ZERO; inside.len()];
        for i in 0..ENTRIES {
            let at = area * (i as f64 + random.unit()) / ENTRIES as f64;
            let triangle = areas.partition_point(|sum| *sum <= at).min(areas.len() - 1);
            let (u, v) = random.pair();
            let (u, v) = (1.0 - u.sqrt(), v * u.sqrt());
            let [a, b, c] = body.mesh.corners(triangle).map(|p| body.world_from_object.transform_point3(p));
            let p = a + u * (b - a) + v * (c - a);
            let (flat, normal) = body.normals(triangle, glam::DVec2::new(u, v));
            let place = (thing as u32, triangle as u32);
            let entered = tracer.entered(p, place, flat, normal, ior, &mut random);
            // Below the surface, in the first cell there that is inside.
            let below = [depth.min(self.cell), 0.5 * self.cell, self.cell, 2.0 * self.cell];
            let cell = below.into_iter().map(|depth| self.cell_of(p - depth * flat)).find(|cell| inside[*cell]);
            if let Some(cell) = cell {
                source[cell] += entered * area / (ENTRIES as f64 * self.cell.powi(3));
            }
        }
        source
    }

    /// Fluence in every cell.
    fn diffuse(&self, inside: &[bool], source: &[f64], sigma_t: f64, sigma_a: f64, ior: f64) -> Vec<f64> {
        let h = self.cell;
        let d = 1.0 / (3.0 * sigma_t);
        // Of diffuse light from inside, what the boundary lets out.
        let out = diffuse_transmittance(ior) / (ior * ior);
        let extrapolated = 2.0 * (2.0 - out) / out;
        let (between, leaving) = (d / (h * h), 1.0 / (extrapolated + 0.5 * h / d) / h);
        let strides = [1, self.size[0], self.size[0] * self.size[1]];
        let cells: Vec<usize> = (0..inside.len()).filter(|cell| inside[*cell]).collect();
        // The border is outside, so every cell inside has all its neighbours.
        let neighbours = |cell: usize| strides.into_iter().flat_map(move |stride| [cell - stride, cell + stride]);
        let diagonal = |cell: usize| {
            let sides = neighbours(cell).map(|other| if inside[other] { between } else { leaving });
            sigma_a + sides.sum::<f64>()
        };
        let apply = |x: &[f64], y: &mut [f64]| {
            for &cell in &cells {
                let flow: f64 = neighbours(cell).filter(|other| inside[*other]).map(|other| x[other]).sum();
                y[cell] = diagonal(cell) * x[cell] - between * flow;
            }
        };
        let dot = |a: &[f64], b: &[f64]| cells.iter().map(|cell| a[*cell] * b[*cell]).sum::<f64>();
        let mut phi = vec![0.0; inside.len()];
        let mut residual = source.to_vec();
        let mut z: Vec<f64> = vec![0.0; inside.len()];
        cells.iter().for_each(|cell| z[*cell] = residual[*cell] / diagonal(*cell));
        let (mut way, mut next) = (z.clone(), vec![0.0; inside.len()]);
        let mut now = dot(&residual, &z);
        let goal = 1e-6 * now;
        // A few hundred steps are enough for light to cross the grid.
        for _ in 0..400 {
            if now <= goal {
                break;
            }
            apply(&way, &mut next);
            let step = now / dot(&way, &next);
            for &cell in &cells {
                phi[cell] += step * way[cell];
                residual[cell] -= step * next[cell];
                z[cell] = residual[cell] / diagonal(cell);
            }
            let before = std::mem::replace(&mut now, dot(&residual, &z));
            cells.iter().for_each(|cell| way[*cell] = z[*cell] + now / before * way[*cell]);
        }
        phi
    }

    /// Cells that the surface cuts get their neighbours' light.
    fn spread(&mut self, inside: &[bool]) {
        let mut known = inside.to_vec();
        for _ in 0..2 {
            let before = (self.fluence.clone(), known.clone());
            for z in 0..self.size[2] {
                for y in 0..self.size[1] {
                    for x in 0..self.size[0] {
                        let cell = self.index([x, y, z]);
                        if before.1[cell] {
                            continue;
                        }
                        let range = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
                        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
                        for z in range(z, self.size[2]) {
                            for y in range(y, self.size[1]) {
                                for x in range(x, self.size[0]) {
                                    let other = self.index([x, y, z]);
                                    if before.1[other] {
                                        sum += before.0[other];
                                        count += 1.0;
                                    }
                                }
                            }
                        }
                        if count > 0.0 {
                            (self.fluence[cell], known[cell]) = (sum / count, true);
                        }
                    }
                }
            }
        }
    }

    /// What a path of that weight may bring from `p`.
    pub fn promise(&self, p: DVec3, weight: Rgb) -> f64 {
        weight.dot(self.fluence[self.cell_of(p)].as_dvec3())
    }
}

/// How many paths to make of one that promises `now` and promised `first`, and what to multiply their weight by.
pub fn paths(now: f64, first: f64, random: &mut Random) -> (usize, f64) {
    let share = now / first;
    if (1.0 / ROOM..=ROOM).contains(&share) || !share.is_finite() {
        return (1, 1.0);
    }
    let wanted = share.min(MOST);
    let count = wanted.floor() + if random.unit() < wanted.fract() { 1.0 } else { 0.0 };
    (count as usize, 1.0 / wanted)
}

fn reduced(medium: &Medium) -> Rgb {
    let g = Rgb::from_array(medium.parameter.to_array().map(|k| medium.phase.mean_cosine(k)));
    medium.sigma_a + medium.sigma_s * (1.0 - g)
}

impl Tracer {
    /// An estimate of the flux that enters a thing at a point of its surface, per area.
    fn entered(&self, p: DVec3, place: (u32, u32), flat: DVec3, normal: DVec3, ior: f64, random: &mut Random) -> Rgb {
        let enters = |to: DVec3| match to.dot(flat) > 0.0 {
            true => 1.0 - fresnel_dielectric(to.dot(normal).clamp(0.0, 1.0), ior),
            false => 0.0,
        };
        let mut sum = Rgb::ZERO;
        for lamp in &self.lamps {
            let Some(ray) = lamp.sample(p, random) else { continue };
            let share = enters(ray.direction) * ray.direction.dot(normal).max(0.0);
            if share > 0.0 && (!lamp.shadow || self.reaches(p, &ray, Some(place))) {
                sum += share * ray.irradiance;
            }
        }
        if let Some(sky) = &self.sky {
            let (u, v) = random.pair();
            let (x, y) = normal.any_orthonormal_pair();
            let (sin, cos) = (2.0 * PI * v).sin_cos();
            let to = u.sqrt() * (cos * x + sin * y) + (1.0 - u).sqrt() * normal;
            let share = PI * enters(to);
            if share > 0.0 && (!sky.shadow || self.world.is_free(p, to, f64::INFINITY, Some(place))) {
                sum += share * sky.radiance(to);
            }
        }
        sum
    }
}
