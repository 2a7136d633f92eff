//! What a surface seen from outside does with light, without a look at the inside: it is reflected at the boundary, or
//! scattered where it entered (paint) or elsewhere ([`super::bssrdf`]).
//!
//! A way is drawn at random, and lamps and the sky's image are joined where it begins: the two share out what both find, by
//! the balance heuristic.

use super::bssrdf::Entry;
use super::light::{Lamp, Ray};
use super::random::Random;
use super::volume::Tracer;
use super::world::{Boundary, Matter, Place, Point, Thing};
use crate::optics::Rgb;
use crate::optics::fresnel::{diffuse_transmittance, fresnel_dielectric};
use glam::DVec3;
use std::f64::consts::PI;

/// A way on from a surface, through the open.
pub struct Bounce {
    /// What lamps send by other ways.
    pub joined: Rgb,
    /// Where it begins, and on what.
    pub p: DVec3,
    pub place: Place,
    pub direction: DVec3,
    /// What the light that comes along it is multiplied by; 0 where it leads below the surface.
    pub weight: Rgb,
    /// Of `direction`, 1/sr; none where no lamp could be joined instead.
    pub density: Option<f64>,
}

impl Tracer {
    /// Reflection at the outside of a boundary.
    pub(super) fn gloss(
        &self,
        thing: &Thing,
        surface: &Boundary,
        point: &Point,
        d: DVec3,
        random: &mut Random,
    ) -> Option<Bounce> {
        if surface.ior == 1.0 || d.dot(point.flat) >= 0.0 {
            return None;
        }
        let facing = thing.outside(surface, point);
        let bounce = |joined: Rgb, direction: DVec3, weight: f64, density: Option<f64>| {
            Some(Bounce { joined, p: point.p, place: point.place, direction, weight: Rgb::splat(weight), density })
        };
        if facing.is_smooth() {
            let split = facing.split(d);
            return bounce(Rgb::ZERO, split.reflected, split.reflectance, None);
        }
        let joined = self.joined(point, random, |_, ray| {
            let (value, density) = facing.value(d, ray.direction);
            if ray.direction.dot(point.flat) > 0.0 { (value, density) } else { (0.0, 0.0) }
        });
        let h = facing.microfacet(d, random.pair());
        let split = facing.split_at(d, h);
        let unhidden = facing.unhidden(d, split.reflected, true);
        let density = facing.value(d, split.reflected).1;
        bounce(joined, split.reflected, split.reflectance * unhidden, Some(density))
    }

    /// Light that was scattered below the boundary of what paths do not enter.
    pub(super) fn scattered(&self, thing: &Thing, point: &Point, d: DVec3, random: &mut Random) -> Option<Bounce> {
        // A sheet of paint is seen from behind too: its normal turns to the eye.
        let side = if d.dot(point.flat) < 0.0 { 1.0 } else { -1.0 };
        match &thing.matter {
            // Lambertian: what leaves, leaves where it entered.
            Matter::Opaque { surface, albedo } => {
                Some(self.entering(point, side, surface.ior, *albedo * thing.leaving(surface, point, d), random))
            }
            Matter::Bssrdf { surface, bssrdf } if side > 0.0 => {
                let Entry { point: entry, weight } = bssrdf.entry(&self.world, point, 0.0, random)?;
                let density = bssrdf.density(point, &entry, self.world.balls[point.thing()]);
                let scale = weight / density * bssrdf.r_d(point, &entry) * thing.leaving(surface, point, d);
                Some(self.entering(&entry, 1.0, surface.ior, scale, random))
            }
            _ => None,
        }
    }

    /// Light that comes from outside, on the normal's `side`, and enters: (1 - F(cos)) cos / (c pi) of its radiance, which
    /// is 1 for an even sky.
    pub(super) fn entering(&self, point: &Point, side: f64, ior: f64, scale: Rgb, random: &mut Random) -> Bounce {
        let (flat, normal) = (side * point.flat, side * point.normal);
        let enters =
            |cos: f64| (1.0 - fresnel_dielectric(cos.clamp(0.0, 1.0), ior)) / (PI * diffuse_transmittance(ior));
        let joined = self.joined(point, random, |_, ray| {
            let cos = ray.direction.dot(normal);
            if cos > 0.0 && ray.direction.dot(flat) > 0.0 { (enters(cos) * cos, cos / PI) } else { (0.0, 0.0) }
        });
        let (u, v) = random.pair();
        let (x, y) = normal.any_orthonormal_pair();
        let (sin, cos) = (2.0 * PI * v).sin_cos();
        let direction = u.sqrt() * (cos * x + sin * y) + (1.0 - u).sqrt() * normal;
        let cos = direction.dot(normal);
        let weight = if direction.dot(flat) > 0.0 { PI * enters(cos) * scale } else { Rgb::ZERO };
        Bounce { joined: scale * joined, p: point.p, place: point.place, direction, weight, density: Some(cos / PI) }
    }

    /// Light of all lamps and of the sky's image at a point outside, each from one direction: `value` gives a surface's
    /// value times cosine for a ray to a lamp or the sky, and the density with which the surface itself would have chosen it.
    pub(super) fn joined(
        &self,
        point: &Point,
        random: &mut Random,
        value: impl Fn(Option<&Lamp>, &Ray) -> (f64, f64),
    ) -> Rgb {
        let mut sum = Rgb::ZERO;
        let mut add = |lamp: Option<&Lamp>, ray: Ray, shadow: bool| {
            let (value, density) = value(lamp, &ray);
            if value > 0.0 && (!shadow || self.reaches(point.p, &ray, Some(point.place))) {
                let share = ray.density.map_or(1.0, |own| own / (own + density));
                sum += share * value * ray.irradiance;
            }
        };
        for lamp in self.lamps.iter().filter(|lamp| self.is_joined(lamp)) {
            if let Some(ray) = lamp.sample(point.p, random) {
                add(Some(lamp), ray, lamp.shadow);
            }
        }
        if let Some((ray, shadow)) = self.sky_sample(random) {
            add(None, ray, shadow);
        }
        sum
    }

    pub(super) fn is_joined(&self, lamp: &Lamp) -> bool {
        self.joins || !lamp.has_extent()
    }

    pub(super) fn sky_sample(&self, random: &mut Random) -> Option<(Ray, bool)> {
        let sky = self.sky.as_ref().filter(|_| self.joins)?;
        Some((sky.sample(random)?, sky.shadow))
    }

    /// Whether nothing is between a point and a lamp.
    pub(super) fn reaches(&self, p: DVec3, ray: &Ray, on: Option<Place>) -> bool {
        // The lamp itself stands at the end.
        self.world.is_free(p, ray.direction, ray.distance * (1.0 - 1e-9), on)
    }
}

impl Thing {
    /// The share of light scattered below a boundary that leaves against `d`, on the side from which that comes.
    pub(super) fn leaving(&self, surface: &Boundary, point: &Point, d: DVec3) -> Rgb {
        // A sheet of paint is seen from behind too: its normal turns to the eye.
        let cos = d.dot(point.normal) * d.dot(point.flat).signum();
        self.color(surface, point) * (1.0 - fresnel_dielectric(cos.clamp(0.0, 1.0), surface.ior))
    }
}
