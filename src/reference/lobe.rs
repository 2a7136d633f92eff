//! Light of a lamp without extent at points inside a medium, through its rough refracting boundary.
//!
//! Such a boundary shows the lamp from inside as a bright lobe. From where the boundary most likely shows it, guessed by
//! two rays, a microfacet there is drawn that refracts the lamp's light, and the direction that it gives is followed:
//! whatever the guess, the lamp's light along it is exact. Paths that are scattered into the lobe find the lamp too, where
//! they leave; the two ways share the light out by the balance heuristic.

use super::boundary::Facing;
use super::light::{Lamp, Ray};
use super::path::Walk;
use super::random::Random;
use super::volume::Tracer;
use super::world::{Boundary, Matter, Thing};
use crate::optics::Rgb;
use crate::scene::Varying;
use glam::DVec3;

/// Which directions from a point show a lamp, as far as one can guess.
pub struct Lobe {
    /// The boundary where it is guessed, seen from outside.
    facing: Facing,
    /// The way the lamp's light travels there.
    travels: DVec3,
    /// How often this lobe is used: the more rarely the deeper the point lies.
    pub chance: f64,
}

/// Points within so many mean free paths of the boundary always use their lobe.
const SURE: f64 = 3.0;

impl Lobe {
    /// Of a lamp without extent, from `p` inside `thing`; none where the guess finds nothing.
    pub fn new(tracer: &Tracer, lamp: &Lamp, thing: usize, p: DVec3) -> Option<Lobe> {
        let body = &tracer.world.things[thing];
        let surface = rough(body)?;
        let mut to = lamp.ray(p)?.direction;
        let mut guess = None;
        for _ in 0..2 {
            let point = tracer.world.meet(p, to, f64::INFINITY, None).filter(|point| point.thing() == thing)?;
            let travels = -lamp.ray(point.p)?.direction;
            let facing = body.outside(surface, &point);
            // The second time from nearer by.
            to = -facing.split(travels).refracted?;
            guess = Some((facing, travels, point.t));
        }
        let (facing, travels, t) = guess?;
        let chance = (SURE - tracer.world.fill(thing).thinnest() * t).min(0.0).exp();
        (travels.dot(facing.normal) < 0.0 && !facing.is_smooth()).then_some(Lobe { facing, travels, chance })
    }

    /// A direction from the point, by chance.
    pub fn sample(&self, random: &mut Random) -> Option<DVec3> {
        if random.unit() >= self.chance {
            return None;
        }
        let h = self.facing.microfacet(self.travels, random.pair());
        Some(-self.facing.split_at(self.travels, h).refracted?)
    }

    /// Of [`Lobe::sample`], 1/sr.
    pub fn density(&self, to: DVec3) -> f64 {
        match to.dot(self.facing.normal) > 0.0 {
            true => self.chance * self.facing.value(self.travels, -to).1,
            false => 0.0,
        }
    }
}

/// The boundary of a thing that may show lamps as lobes: none that is smooth all over.
fn rough(thing: &Thing) -> Option<&Boundary> {
    let Matter::Translucent { surface, .. } = &thing.matter else { return None };
    let is_smooth = match surface.roughness {
        Varying::Constant(roughness) => {
            Facing { flat: DVec3::Z, normal: DVec3::Z, eta: surface.ior, roughness }.is_smooth()
        }
        Varying::Texture(_) => surface.ior == 1.0,
    };
    (!is_smooth).then_some(surface)
}

impl Tracer {
    /// A lamp without extent, through the rough boundary of the thing in which a path lies: a direction from there, and
    /// irradiance on a particle, over its density. `own` is the density with which the path would have gone there itself.
    pub(super) fn through_rough(
        &self,
        walk: &Walk,
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
        let body = &self.world.things[thing];
        let out = body.outside(rough(body)?, &point);
        let inside = Facing { flat: -out.flat, normal: -out.normal, eta: 1.0 / out.eta, ..out };
        let ray: Ray = lamp.ray(point.p)?;
        if inside.is_smooth() || ray.direction.dot(point.flat) <= 0.0 {
            return None;
        }
        let value = inside.value(to, ray.direction).0;
        if value == 0.0 || lamp.shadow && !self.reaches(point.p, &ray, Some(point.place)) {
            return None;
        }
        let through = self.world.fill(thing).transmittance(p, walk.below, to, point.t, random);
        Some((to, value * through * ray.irradiance / (density + own(to))))
    }
}
