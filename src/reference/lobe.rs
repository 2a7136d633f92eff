//! Lamps as they show through a refracting boundary at points inside a medium.
//!
//! From where the boundary most likely shows a lamp, guessed by a ray or two, a direction is drawn: at a rough boundary
//! a microfacet that refracts a lamp without extent, at a smooth one a point of an area light, refracted as the boundary
//! would were it flat. The direction is followed: whatever the guess, the lamp's light along it is exact. Paths that are scattered
//! into the lobe find the lamp too, where they leave; the two ways share the light out by the balance heuristic.

use super::boundary::Facing;
use super::light::Lamp;
use super::path::Walk;
use super::random::Random;
use super::volume::Tracer;
use super::world::{Boundary, Matter, Point, Thing};
use crate::optics::Rgb;
use glam::DVec3;

/// Which directions from a point show a lamp, as far as one can guess.
pub struct Lobe<'a> {
    /// The boundary where it is guessed, seen from outside.
    facing: Facing,
    lamp: &'a Lamp,
    /// The place there, and how the middle of the lamp's light travels to it.
    at: DVec3,
    travels: DVec3,
    /// How often this lobe is used.
    chance: f64,
}

/// Light that has to come so many mean free paths is as rare as any from farther away.
const RARE: f64 = 10.0;

impl Lobe<'_> {
    /// Of a lamp, from `p` inside `thing`; none where another way finds it, and where the guess finds nothing.
    fn new<'a>(tracer: &Tracer, lamp: &'a Lamp, thing: usize, p: DVec3) -> Option<Lobe<'a>> {
        let body = &tracer.world.things[thing];
        let surface = shows(body, lamp)?;
        let mut to = lamp.middle(p);
        let mut guess = None;
        // A second look from nearer by pays where the lobe is narrow.
        for _ in 0..if lamp.has_extent() { 1 } else { 2 } {
            let point = tracer.world.meet(p, to, f64::INFINITY, None).filter(|point| point.thing() == thing)?;
            let travels = -lamp.middle(point.p);
            let facing = body.outside(surface, &point);
            to = -facing.split(travels).refracted?;
            guess = Some((facing, point.p, travels));
        }
        let (facing, at, travels) = guess?;
        // A boundary whose roughness varies may be smooth here.
        let is_shown = travels.dot(facing.normal) < 0.0 && facing.is_smooth() == lamp.has_extent();
        is_shown.then(|| Lobe { facing, lamp, at, travels, chance: chance(tracer, lamp, thing, p) })
    }

    /// A direction from the point.
    fn sample(&self, random: &mut Random) -> Option<DVec3> {
        let (travels, normal) = match self.lamp.has_extent() {
            true => (-self.lamp.sample(self.at, random)?.direction, self.facing.normal),
            false => (self.travels, self.facing.microfacet(self.travels, random.pair())),
        };
        let enters = travels.dot(normal) < 0.0;
        self.facing.split_at(travels, normal).refracted.filter(|_| enters).map(|into| -into)
    }

    /// Of [`Lobe::sample`], 1/sr, times the chance that it is asked.
    fn density(&self, to: DVec3) -> f64 {
        let cos_inside = to.dot(self.facing.normal);
        if cos_inside <= 0.0 {
            return 0.0;
        }
        if !self.lamp.has_extent() {
            return self.chance * self.facing.value(self.travels, -to).1;
        }
        let Facing { flat, normal, eta, roughness } = self.facing;
        let inside = Facing { flat: -flat, normal: -normal, eta: 1.0 / eta, roughness };
        let outside = inside.split_at(to, inside.normal).refracted;
        let density = outside.and_then(|out| {
            let (_, density) = self.lamp.radiance(self.lamp.meet(self.at, out)?)?;
            // Solid angles outside per inside.
            Some(density * eta * eta * cos_inside / out.dot(normal))
        });
        self.chance * density.unwrap_or(0.0)
    }
}

/// How often the lobe of a lamp is used at a point: about as often as its light gets there.
fn chance(tracer: &Tracer, lamp: &Lamp, thing: usize, p: DVec3) -> f64 {
    let sigma = tracer.world.fill(thing).thinnest();
    if sigma == 0.0 {
        return 1.0;
    }
    (-sigma * tracer.world.guess(thing, p, lamp.middle(p), RARE / sigma)).exp()
}

/// The boundary of a thing if it may show the lamp as a lobe. At a rough one area lights are joined to the path where it
/// leaves; beams of lamps without extent through a smooth one are found by [`super::refracted`].
fn shows<'a>(thing: &'a Thing, lamp: &Lamp) -> Option<&'a Boundary> {
    let Matter::Translucent { surface, .. } = &thing.matter else { return None };
    (surface.ior != 1.0 && surface.is_smooth() == lamp.has_extent()).then_some(surface)
}

impl Tracer {
    /// Adds the light of lamps that show through the boundary at a vertex in the medium of `thing`, `phase` being the share
    /// that goes on along the path, 1/sr.
    pub(super) fn join_lobes(&self, walk: &mut Walk, thing: usize, phase: impl Fn(DVec3) -> Rgb, random: &mut Random) {
        // A path that finds the lamp by itself needs one event more.
        walk.lobes = (walk.depth < self.max_depth).then_some((thing, walk.origin));
        if walk.lobes.is_none() {
            return;
        }
        for (i, lamp) in self.lamps.iter().enumerate().filter(|(_, lamp)| self.is_joined(lamp)) {
            if shows(&self.world.things[thing], lamp).is_none()
                || random.unit() >= chance(self, lamp, thing, walk.origin)
            {
                continue;
            }
            let own = |to| walk.density_of(phase(to));
            if let Some((to, light)) = self.through_lobe(walk, i, lamp, thing, own, random) {
                walk.gather(to, phase(to), walk.left * light);
            }
        }
    }

    /// A lamp through the boundary of the thing in which a path lies: a direction from there, and irradiance on a particle,
    /// over its density. `own` is the density with which the path would have gone there itself.
    fn through_lobe(
        &self,
        walk: &Walk,
        i: usize,
        lamp: &Lamp,
        thing: usize,
        own: impl Fn(DVec3) -> f64,
        random: &mut Random,
    ) -> Option<(DVec3, Rgb)> {
        let p = walk.origin;
        let lobe = Lobe::new(self, lamp, thing, p)?;
        let to = lobe.sample(random)?;
        let density = lobe.density(to);
        let point = self.world.meet(p, to, f64::INFINITY, None).filter(|point| point.thing() == thing)?;
        if density == 0.0 || to.dot(point.flat) <= 0.0 {
            return None;
        }
        let out = self.world.things[thing].outside(shows(&self.world.things[thing], lamp)?, &point);
        let inside = Facing { flat: -out.flat, normal: -out.normal, eta: 1.0 / out.eta, ..out };
        if inside.is_smooth() != lamp.has_extent() {
            return None;
        }
        let light = match lamp.has_extent() {
            true => {
                let split = inside.split(to);
                let out = split.refracted?;
                let met = self.world.meet(point.p, out, f64::INFINITY, Some(point.place));
                (1.0 - split.reflectance) * self.shown(i, point.p, out, met.as_ref(), 0.0)?.0
            }
            false => {
                let ray = lamp.ray(point.p).filter(|ray| ray.direction.dot(point.flat) > 0.0)?;
                let value = inside.value(to, ray.direction).0;
                if value == 0.0 || lamp.shadow && !self.reaches(point.p, &ray, Some(point.place)) {
                    return None;
                }
                value * ray.irradiance
            }
        };
        let through = self.world.fill(thing).transmittance(p, walk.below, to, point.t, random);
        Some((to, through * light / (density + own(to))))
    }

    /// The share of a lamp's light that is left to a path which meets the boundary at `point` from inside and finds the lamp
    /// outside: all, but for lamps that were joined to its last vertex.
    pub(super) fn left_by_lobe(&self, walk: &Walk, point: &Point, lamp: &Lamp) -> f64 {
        let lobes = walk.lobes.filter(|(thing, _)| *thing == point.thing() && self.is_joined(lamp));
        let joined = lobes.and_then(|(thing, p)| {
            let own = walk.density?;
            Some(Lobe::new(self, lamp, thing, p)?.density(walk.direction) / own)
        });
        1.0 / (1.0 + joined.unwrap_or(0.0))
    }
}
