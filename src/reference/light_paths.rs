//! Paths that begin at lamps, and meet those from the eye inside [Lafortune1996].
//!
//! Where little light comes through a thing, hardly any path from the eye finds its way back to a lamp; paths from lamps
//! come in by the thousand, and one set of them serves all pixels. They are followed through all media that have smooth
//! refracting boundaries, and every particle that they meet is noted. A path from the eye leaves its find ([`super::kin`])
//! where they are likely: its stems are joined to their particles instead. Where they are rare it goes on as ever. Which of
//! the two brings how much of the light is a function of the place alone, from paths of a trial: each ends up with its own
//! share, whatever is found.
//!
//! Light that meets anything else on its way, as paint or a rough boundary, is left to paths from the eye.
//!
//! Flux is counted as radiance is, per squared index.

use super::free_path::End;
use super::kin::{self, Stem, Strand};
use super::light::{Kind, Ray};
use super::light_cells::{Cells, Met, Region};
use super::path::{Inside, Walk};
use super::random::Random;
use super::volume::{Light, Tracer, around};
use super::world::{Matter, Place, Point, Thing};
use crate::optics::Rgb;
use glam::{DVec2, DVec3, IVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Light paths of one sample of all pixels: as many take little of the time that the pixels of a small picture do.
pub const PATHS: u64 = 4096;

/// Those of the trial.
const TRIAL: u64 = 4096;

/// The least chance with which a path from the eye goes on where light may take ways that light paths do not.
const LEAST: f64 = 0.3;

/// Particles of light paths among which a stem looks for light.
const CANDIDATES: usize = 6;

/// Where light paths go.
pub struct Field {
    /// The things that they pass through.
    is_passed: Vec<bool>,
    /// Whether there is nothing else on light's way.
    is_all: bool,
    /// Of those things, and their areas' running sum.
    triangles: Vec<Place>,
    areas: Vec<f64>,
    /// The running sum of the chances of lamps, and of the sky at last.
    sources: Vec<f64>,
    /// Where paths leave their finds, by thing.
    regions: Vec<Option<Region>>,
    /// How many of them each sample has.
    paths: u64,
}

/// The light paths of a sample.
pub struct Lit {
    regions: Vec<Option<Cells>>,
}

impl Field {
    /// With so many paths for each sample; none where they are no help.
    pub fn new(tracer: &Tracer, paths: u64) -> Option<Field> {
        let things = &tracer.world.things;
        let shine = tracer.lamps.iter().map(|lamp| lamp.shadow).chain(tracer.sky.as_ref().map(|sky| sky.shadow));
        // Lamps that shine through things light them from places that no light path sees.
        if tracer.single || !tracer.joins || !tracer.kin || shine.clone().count() == 0 || !shine.clone().all(|s| s) {
            return None;
        }
        let is_passed: Vec<bool> = (0..things.len()).map(|thing| is_passed(tracer, thing)).collect();
        let mut sum = 0.0;
        let (mut triangles, mut areas) = (Vec::new(), Vec::new());
        for thing in (0..things.len()).filter(|thing| is_passed[*thing]) {
            let mesh = &things[thing].mesh;
            for t in 0..mesh.triangles.len() {
                let [p, q, r] = mesh.corners(t);
                sum += 0.5 * (q - p).cross(r - p).length();
                triangles.push((thing as u32, t as u32));
                areas.push(sum);
            }
        }
        let regions: Vec<Option<Region>> = (0..things.len())
            .map(|thing| match &things[thing].matter {
                Matter::Translucent { medium, .. } if is_passed[thing] => Region::new(tracer, thing, medium),
                _ => None,
            })
            .collect();
        if sum == 0.0 || regions.iter().all(Option::is_none) {
            return None;
        }
        let is_all = (0..things.len()).all(|thing| is_passed[thing] || things[thing].lamp().is_some());
        let sources = vec![0.0; shine.count()];
        let mut field = Field { is_passed, is_all, triangles, areas, sources, regions, paths };
        field.weigh(tracer);
        field.try_out(tracer);
        Some(field)
    }

    /// Lamps are chosen by about how much light they send in.
    fn weigh(&mut self, tracer: &Tracer) {
        const TRIES: u64 = 256;
        let light = |source: usize| {
            let arrives = |i: u64| {
                let mut random = Random::new(i, source as u64, u64::MAX);
                let arrival = self.arrive(tracer, source, &mut random);
                arrival.map_or(0.0, |(_, _, light)| light.element_sum())
            };
            (0..TRIES).map(arrives).sum::<f64>()
        };
        let count = self.sources.len();
        let all: Vec<f64> = (0..count).map(light).collect();
        let sum: f64 = all.iter().sum();
        let mut chance = 0.0;
        for (source, light) in self.sources.iter_mut().zip(all) {
            // What shines through a crack is not forgotten.
            chance += if sum > 0.0 { 0.9 * light / sum } else { 0.9 / count as f64 } + 0.1 / count as f64;
            *source = chance;
        }
    }

    /// Finds where light paths are likely.
    fn try_out(&mut self, tracer: &Tracer) {
        let paths: Vec<Vec<Met>> = (0..TRIAL)
            .into_par_iter()
            .map(|path| {
                let mut met = Vec::new();
                self.follow(tracer, &mut Random::new(u64::MAX, path, u64::MAX), &mut met);
                met
            })
            .collect();
        for (thing, region) in self.regions.iter_mut().enumerate() {
            if let Some(region) = region {
                let met = |path: &Vec<Met>| path.iter().filter(|met| met.thing == thing).map(|met| met.p).collect();
                region.learn(&paths.iter().map(met).collect::<Vec<_>>(), self.paths);
            }
        }
    }

    pub fn is_passed(&self, thing: usize) -> bool {
        self.is_passed[thing]
    }

    /// A point of a boundary, what comes there from a lamp, and irradiance on a plane that faces it over the density of the
    /// point.
    fn arrive(&self, tracer: &Tracer, source: usize, random: &mut Random) -> Option<(Point, Ray, Rgb)> {
        let area = *self.areas.last()?;
        let i = pick(&self.areas, random.unit() * area);
        let place = self.triangles[i];
        let thing = &tracer.world.things[place.0 as usize];
        let (a, b) = random.pair();
        let at = if a + b > 1.0 { DVec2::new(1.0 - a, 1.0 - b) } else { DVec2::new(a, b) };
        let [p, q, r] = thing.mesh.corners(place.1 as usize);
        let p = thing.world_from_object.transform_point3(p + at.x * (q - p) + at.y * (r - p));
        let (flat, normal) = thing.normals(place.1 as usize, at);
        let ray = match (tracer.lamps.get(source), &tracer.sky) {
            (Some(lamp), _) => lamp.sample(p, random)?,
            (None, Some(sky)) if sky.image.is_some() => sky.sample(random)?,
            (None, sky) => {
                let direction = around(flat, random.unit().sqrt(), random.unit());
                let density = direction.dot(flat).max(0.0) / PI;
                let radiance = sky.as_ref().map_or(Rgb::ZERO, |sky| sky.radiance(direction));
                Ray { direction, distance: f64::INFINITY, irradiance: radiance / density, density: Some(density) }
            }
        };
        let is_lit = ray.direction.dot(flat) > 0.0 && tracer.reaches(p, &ray, Some(place));
        let light = area * ray.irradiance;
        is_lit.then_some((Point { p, t: 0.0, place, barycentrics: at, flat, normal }, ray, light))
    }

    /// Follows a light path to its end.
    fn follow(&self, tracer: &Tracer, random: &mut Random, met: &mut Vec<Met>) -> Option<()> {
        let source = pick(&self.sources, random.unit() * self.sources.last()?);
        let chance = self.sources[source] - if source > 0 { self.sources[source - 1] } else { 0.0 };
        let (point, ray, light) = self.arrive(tracer, source, random)?;
        let cos = ray.direction.dot(point.flat);
        let flux = light * (cos / chance * self.sources.last()?);
        let lamp = tracer.lamps.get(source);
        // Of a lamp without extent the eye sees what is refracted and then scattered.
        let is_narrow = lamp.is_some_and(|lamp| !matches!(lamp.kind, Kind::Rect { .. }));
        let mut walk = tracer.start(point.p, -ray.direction, Some(point.place), Inside::default(), random);
        walk.depth = 1;
        self.cross(tracer, &mut walk, &point, is_narrow, random)?;
        loop {
            let flight = tracer.flight(&walk, None, random);
            walk.weight = flight.weight;
            walk.depth += 1;
            match flight.end {
                End::Away => return None,
                End::Surface(point) => {
                    if is_narrow && !walk.struck || !self.is_passed[point.thing()] {
                        return None;
                    }
                    (walk.origin, walk.on) = (point.p, Some(point.place));
                    self.cross(tracer, &mut walk, &point, false, random)?;
                }
                End::Particle(p, medium, _) => {
                    walk.struck = true;
                    let depth = walk.depth - is_narrow as u32;
                    let flux = flux * walk.weight.value;
                    if let Some(thing) = walk.inside.only().filter(|_| flux.max_element() > 0.0) {
                        met.push(Met { thing, p, travels: walk.direction, flux, depth });
                    }
                    let from = walk.direction;
                    let parameter = medium.parameter[walk.weight.hero];
                    let to = around(from, -medium.phase.sample(random.unit(), parameter), random.unit());
                    let phase = medium.scattered(from, to);
                    walk.weight.event(phase, phase);
                    (walk.origin, walk.on, walk.direction) = (p, None, to);
                }
            }
            if walk.depth >= tracer.max_depth {
                return None;
            }
            let left = walk.weight.value.max_element();
            if left < 0.1 {
                if random.unit() >= left / 0.1 {
                    return None;
                }
                walk.weight.value *= 0.1 / left;
            }
        }
    }

    /// A light path meets a boundary; none where it ends.
    fn cross(
        &self,
        tracer: &Tracer,
        walk: &mut Walk,
        point: &Point,
        is_refracted: bool,
        random: &mut Random,
    ) -> Option<()> {
        let thing = &tracer.world.things[point.thing()];
        let Matter::Translucent { surface, .. } = &thing.matter else { return None };
        let light = walk.direction;
        let enters = light.dot(point.flat) < 0.0;
        let beyond = if enters { walk.inside.with(point.thing()) } else { walk.inside.without(point.thing()) };
        let facing = tracer.facing(thing, surface, point, light, walk.inside);
        if facing.eta == 1.0 {
            walk.inside = beyond;
            return Some(());
        }
        // Where normals are interpolated there may be more ways than one, or none; direct light comes straight in, and does
        // not come back.
        let is_followed = |inside: Inside| tracer.light == Light::Full || inside.innermost().is_some();
        let (reflected, refracted) = (facing.reversed(light, true), facing.reversed(light, false));
        let ways = [
            reflected[0].filter(|_| !is_refracted && is_followed(walk.inside)),
            reflected[1].filter(|_| !is_refracted && is_followed(walk.inside)),
            refracted[0].filter(|_| is_followed(beyond)),
            // Beams are those of the interpolated normals.
            refracted[1].filter(|_| !is_refracted && is_followed(beyond)),
        ];
        let sum: f64 = ways.iter().flatten().map(|(_, share)| share).sum();
        let mut at = random.unit() * sum;
        let taken = ways.iter().position(|way| {
            at -= way.map_or(0.0, |(_, share)| share);
            at < 0.0
        })?;
        walk.weight.value *= sum;
        walk.direction = ways[taken]?.0;
        if taken >= 2 {
            walk.inside = beyond;
        }
        Some(())
    }
}

/// The first place in a running sum that goes beyond `at`.
fn pick(sums: &[f64], at: f64) -> usize {
    sums.partition_point(|sum| *sum <= at).min(sums.len() - 1)
}

/// Whether a thing is one that light paths pass through.
fn is_passed(tracer: &Tracer, thing: usize) -> bool {
    let Thing { matter: Matter::Translucent { surface, .. }, .. } = &tracer.world.things[thing] else { return false };
    surface.ior != 1.0 && surface.is_smooth() && tracer.world.strata[thing].is_none()
}

impl Tracer {
    /// A path from the eye is at its find: whether it goes on from there.
    pub(super) fn leave(&self, walk: &mut Walk, random: &mut Random) -> bool {
        let Some(field) = &self.field else { return true };
        let Some(region) = walk.inside.only().and_then(|thing| field.regions[thing].as_ref()) else { return true };
        walk.left = 1.0 - region.share_at(walk.origin);
        let chance = if field.is_all { walk.left } else { walk.left.max(LEAST) };
        let goes_on = random.unit() < chance;
        walk.weight.value /= chance;
        goes_on
    }

    /// The light paths of a sample, none where they are no help.
    pub fn light_paths(&self, seed: u64, sample: u64) -> Option<Lit> {
        let field = self.field.as_ref()?;
        let paths: Vec<Vec<Met>> = (0..field.paths)
            .into_par_iter()
            .map(|path| {
                let mut met = Vec::new();
                // Streams that no pixel has.
                field.follow(self, &mut Random::new(seed, u64::MAX - path, sample), &mut met);
                met
            })
            .collect();
        let of = |thing: usize, region: &Region| {
            let all = paths.iter().flatten().filter(|met| met.thing == thing).copied().collect();
            Cells::new(region, all, field.paths)
        };
        let regions = field.regions.iter().enumerate();
        Some(Lit { regions: regions.map(|(thing, region)| Some(of(thing, region.as_ref()?))).collect() })
    }

    /// Joins the stems of all strands to light paths.
    pub fn meet_light(&self, strands: &mut [Strand], lit: &Lit, random: &mut Random) {
        let Some(field) = &self.field else { return };
        for (thing, (region, cells)) in field.regions.iter().zip(&lit.regions).enumerate() {
            let (Some(region), Some(cells)) = (region, cells) else { continue };
            // Cells within reach of a stem's, and the running sum of the light that they send there.
            let mut tables: HashMap<IVec3, Vec<(f64, usize, f64)>> = HashMap::new();
            for strand in strands.iter_mut() {
                for stem in strand.stems.iter().filter(|stem| stem.kind.0 == thing) {
                    let table = tables.entry(region.cell(stem.p)).or_insert_with_key(|at| {
                        let mut sum = 0.0;
                        let there = region.around.iter().filter_map(|(offset, light)| {
                            let cell = region.index(*at + *offset)?;
                            let worth = cells.all[cell];
                            sum += light * worth;
                            (worth > 0.0).then_some((sum, cell, *light))
                        });
                        there.collect()
                    });
                    strand.parts.scattered += self.join_light(cells, table, stem, random);
                }
            }
        }
    }

    /// Light of some particles, over the chance that it is these, at a stem. Most that might be hidden are not looked for: of
    /// them one stands for all, the brighter the more likely.
    fn join_light(&self, cells: &Cells, table: &[(f64, usize, f64)], stem: &Stem, random: &mut Random) -> Rgb {
        let mut sum = Rgb::ZERO;
        let mut unsure = [(Rgb::ZERO, DVec3::ZERO); CANDIDATES];
        let mut brightness = 0.0;
        for (i, unsure) in unsure.iter_mut().enumerate() {
            let share = (i as f64 + random.unit()) / CANDIDATES as f64;
            match self.candidate(cells, table, stem, share) {
                Some((light, _, true)) => sum += light,
                Some((light, offset, false)) => {
                    *unsure = (light, offset);
                    brightness += light.element_sum();
                }
                None => {}
            }
        }
        let mut at = random.unit() * brightness;
        let chosen = unsure.iter().find(|(light, _)| {
            at -= light.element_sum();
            at < 0.0
        });
        if let Some((light, offset)) = chosen {
            let length = offset.length();
            if self.world.is_free(stem.p, *offset / length, length * (1.0 - 1e-9), None) {
                sum += *light * (brightness / light.element_sum());
            }
        }
        sum / CANDIDATES as f64
    }

    /// A particle, chosen at a `share` of all light that the table knows of: the light that it sends to a stem if nothing hides
    /// it, over the chance that it is this one; the way there; and whether that is known to be free.
    fn candidate(
        &self,
        cells: &Cells,
        table: &[(f64, usize, f64)],
        stem: &Stem,
        share: f64,
    ) -> Option<(Rgb, DVec3, bool)> {
        let thing = stem.kind.0;
        let Matter::Translucent { medium, .. } = &self.world.things[thing].matter else {
            unreachable!("a stem lies in a medium")
        };
        let total = table.last()?.0;
        let i = table.partition_point(|(sum, ..)| *sum <= share * total).min(table.len() - 1);
        let (sum, cell, light) = table[i];
        let met = &cells.met[cells.at(cell, 1.0 - (sum - share * total) / (light * cells.all[cell]))];
        let offset = met.p - stem.p;
        let length = offset.length();
        if !kin::lengths(medium).contains(&length) || stem.kind.1 + met.depth > self.max_depth {
            return None;
        }
        let to = offset / length;
        let is_clear = length < self.world.clearance(thing, stem.p).max(self.world.clearance(thing, met.p));
        let spread = (-medium.sigma_t() * length).exp() * medium.scattered(stem.from, to) / (length * length);
        // The share of its place is in its worth: of that its chance is made, and of that its light.
        let chance = light * met.flux.element_sum() / total;
        let light = stem.weight * spread * medium.scattered(to, -met.travels) * met.flux / (chance * cells.paths);
        Some((light, offset, is_clear))
    }
}
