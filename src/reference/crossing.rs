//! What a path does where it meets a surface: it is reflected, refracted or scattered, goes straight on through an
//! index-matched boundary, or ends at a lamp.

use super::boundary::Facing;
use super::light::Lamp;
use super::path::{Inside, Walk};
use super::random::Random;
use super::volume::{Light, Tracer, around};
use super::world::{Boundary, Matter, Point, Thing};
use crate::optics::Rgb;
use crate::optics::fresnel::fresnel_dielectric;
use glam::DVec3;
use std::f64::consts::PI;

impl Tracer {
    /// A boundary as a path inside the things `inside` meets it.
    pub(super) fn facing(&self, thing: &Thing, surface: &Boundary, point: &Point, d: DVec3, inside: Inside) -> Facing {
        let enters = d.dot(point.flat) < 0.0;
        let index = |inside: Inside| {
            inside.innermost().map_or(1.0, |i| match &self.world.things[i].matter {
                Matter::Translucent { surface, .. } => surface.ior,
                _ => 1.0,
            })
        };
        let beyond = if enters { surface.ior } else { index(inside.without(point.thing())) };
        let side = if enters { 1.0 } else { -1.0 };
        Facing {
            flat: side * point.flat,
            normal: side * point.normal,
            eta: beyond / index(inside),
            roughness: thing.roughness(surface, point),
        }
    }

    /// A path meets a surface; whether it goes on.
    pub(super) fn cross(&self, walk: &mut Walk, point: Point, random: &mut Random) -> bool {
        let thing = &self.world.things[point.thing()];
        let d = walk.direction;
        let surface = match &thing.matter {
            // In the open it was counted where the ray was cast.
            Matter::Emitter(_) => {
                if !walk.inside.is_nothing()
                    && let Some((radiance, own)) = self.emitted(&point, (walk.passed + point.t) * d)
                {
                    let share = walk.density.filter(|_| self.joins).map_or(1.0, |density| density / (density + own));
                    walk.add(share * radiance);
                }
                return false;
            }
            Matter::Bssrdf { surface, .. } => return self.turn(walk, thing, surface, &point, random),
            Matter::Opaque { surface, .. } if walk.inside.is_nothing() => {
                return self.turn(walk, thing, surface, &point, random);
            }
            Matter::Opaque { surface, albedo } => {
                // An opaque thing within a medium: white paint whose boundary the medium wets.
                if self.single && walk.struck {
                    return false;
                }
                (walk.scattered, walk.struck) = (true, true);
                let normal = if d.dot(point.normal) < 0.0 { point.normal } else { -point.normal };
                let (u, v) = random.pair();
                walk.weight.value *= *albedo * thing.color(surface, &point);
                (walk.origin, walk.on) = (point.p, Some(point.place));
                // Lamps with extent are found by the path itself.
                self.join_lamps(walk, |lamp| !lamp.has_extent(), |to| Rgb::splat(to.dot(normal).max(0.0) / PI), random);
                (walk.direction, walk.density) = (around(normal, u.sqrt(), v), None);
                return true;
            }
            Matter::Translucent { surface, .. } => surface,
        };
        let enters = d.dot(point.flat) < 0.0;
        let beyond = if enters { walk.inside.with(point.thing()) } else { walk.inside.without(point.thing()) };
        let facing = self.facing(thing, surface, &point, d, walk.inside);
        (walk.origin, walk.on) = (point.p, Some(point.place));
        if facing.eta == 1.0 {
            walk.lobes = None;
            walk.density = walk.density.filter(|_| walk.joined_through);
            // Nothing happens to the path, and lamps could be joined through here.
            walk.inside = beyond;
            walk.passed += point.t;
            if beyond.innermost().is_some() || self.light == Light::Full {
                return true;
            }
            // Direct light is let in by one thing only.
            let met = self.world.meet(point.p, d, f64::INFINITY, Some(point.place));
            walk.add(self.shining(point.p, d, met.as_ref(), walk.density, walk.passed));
            return false;
        }
        walk.passed = 0.0;
        let (split, reflected_share, refracted_share) = if facing.is_smooth() {
            let split = facing.split(d);
            (split, split.reflectance, 1.0 - split.reflectance)
        } else {
            if beyond.innermost().is_none() {
                self.join_at(walk, &facing, &point, random);
            }
            let h = facing.microfacet(d, random.pair());
            let split = facing.split_at(d, h);
            let refracted = split.refracted.map_or(0.0, |to| facing.unhidden(d, to, false));
            let reflected = facing.unhidden(d, split.reflected, true);
            (split, split.reflectance * reflected, (1.0 - split.reflectance) * refracted)
        };
        let density = |to: DVec3| (!facing.is_smooth()).then(|| facing.value(d, to).1);
        let out = split.refracted.filter(|_| refracted_share > 0.0);
        if let (Some(to), None) = (out, beyond.innermost()) {
            // Both ways: the light outside is looked up, and the path goes on inside.
            let own = density(to);
            let met = self.world.meet(point.p, to, f64::INFINITY, Some(point.place));
            let left = |lamp: &Lamp| if facing.is_smooth() { self.left_by_lobe(walk, &point, lamp) } else { 1.0 };
            walk.add(walk.left * refracted_share * self.shining_but(point.p, to, met.as_ref(), own, 0.0, left));
            walk.lobes = None;
            let is_lit = met.is_some_and(|met| !self.is_emitter(&met));
            if is_lit && self.light == Light::Full && random.unit() < 1.0 - split.reflectance {
                walk.weight.value *= refracted_share / (1.0 - split.reflectance);
                (walk.inside, walk.direction, walk.counted) = (beyond, to, true);
                (walk.density, walk.joined_through) = (own, false);
                return true;
            }
            // The share that went out does not stay; only for full light it was chosen between.
            let chosen = is_lit && self.light == Light::Full;
            walk.weight.value *= if chosen { reflected_share / split.reflectance } else { reflected_share };
            (walk.direction, walk.density) = (split.reflected, None);
            return reflected_share > 0.0 && !self.single;
        }
        walk.lobes = None;
        let goes_in = out.is_some() && random.unit() >= split.reflectance;
        if goes_in {
            walk.weight.value *= refracted_share / (1.0 - split.reflectance);
            (walk.direction, walk.inside) = (out.expect("it goes in"), beyond);
        } else {
            if self.single && !walk.inside.is_nothing() {
                return false;
            }
            // Where nothing can be refracted this is certain, and else chosen with the reflectance.
            let chance = if out.is_some() { split.reflectance } else { 1.0 };
            walk.weight.value *= reflected_share / chance;
            walk.direction = split.reflected;
        }
        walk.density = None;
        walk.weight.value.max_element() > 0.0
    }

    /// A path in the open meets a surface that it does not enter: it is reflected or scattered; whether it goes on.
    fn turn(&self, walk: &mut Walk, thing: &Thing, surface: &Boundary, point: &Point, random: &mut Random) -> bool {
        let d = walk.direction;
        // By chance, with the share of a smooth boundary: were both followed, paths in a corner would never end.
        let shine = fresnel_dielectric(d.dot(point.normal).abs().min(1.0), surface.ior);
        let (bounce, chance) = match random.unit() < shine {
            true => (self.gloss(thing, surface, point, d, random), shine),
            false => (self.scattered(thing, point, d, random), 1.0 - shine),
        };
        let Some(bounce) = bounce else { return false };
        walk.weight.value /= chance;
        walk.add(bounce.joined);
        walk.weight.value *= bounce.weight;
        (walk.origin, walk.on) = (bounce.p, Some(bounce.place));
        (walk.direction, walk.density, walk.passed) = (bounce.direction, bounce.density, 0.0);
        walk.joined_through = false;
        walk.weight.value.max_element() > 0.0
    }

    /// Adds the light of lamps outside at a rough boundary that a path meets from inside.
    fn join_at(&self, walk: &mut Walk, facing: &Facing, point: &Point, random: &mut Random) {
        let d = walk.direction;
        let light = self.joined(point, random, |lamp, ray| match ray.direction.dot(point.flat) > 0.0 {
            true => {
                let (value, density) = facing.value(d, ray.direction);
                let left = lamp.filter(|_| value > 0.0).map_or(1.0, |lamp| self.left_by_lobe(walk, point, lamp));
                (left * value, density)
            }
            false => (0.0, 0.0),
        });
        walk.add(light);
    }
}
