//! The separable BSSRDF: light that enters at x_i leaves at x_o by
//! S = (1 - F(cos_o)) R_d(|x_o - x_i|) (1 - F(cos_i)) / (c pi), whatever lies between the two [Jensen2001, eq. 5], with the
//! c of [`diffuse_transmittance`](crate::optics::fresnel::diffuse_transmittance) and any [`profile`](crate::optics::profile).
//! What is told here is x_i; Fresnel's factors are those of [`super::surfaces`]. No light passes unscattered.
//!
//! x_i is sought by a line along the normal at x_o or along one of two tangents, at a radius drawn from one channel's
//! profile [King2013]. Each place where the line meets the thing has a density, that of all axes and channels together
//! (the balance heuristic), and of all exits that share it ([`super::kin`]). Of these places one is drawn in proportion to
//! R_d over its density, where [Pharr2016, 15.4.2] draws evenly; and evenly half the time where exits share, since what is
//! nothing to one may be much to another. More differs from there: neither radii nor lines end, so nothing is cut off; the
//! line meets the same thing, not the same material, so that things which touch do not bleed into one another; and some lines
//! are laid anywhere through the thing, since a profile's own radii seldom lead to its far side, from which a lamp behind it
//! shines.

use super::random::Random;
use super::world::{Ball, Point, World};
use crate::optics::Rgb;
use crate::optics::medium::Medium;
use crate::optics::phase::Phase;
use crate::optics::profile::{Model, Profile};
use glam::DVec3;
use serde::Serialize;
use std::f64::consts::PI;

/// How far light goes in a material.
#[derive(Clone, Debug, Serialize)]
pub struct Bssrdf {
    model: Model,
    medium: Medium,
    phase: Phase,
    ior: f64,
    /// Made from the above, and lengths are scene units.
    #[serde(skip)]
    profiles: [Profile; 3],
}

/// A place where light enters.
pub struct Entry {
    pub point: Point,
    /// One over the chance with which it was drawn among the places on its line.
    pub weight: f64,
}

/// The chance of each axis: the normal and two tangents.
const CHANCES: [f64; 3] = [0.5, 0.25, 0.25];
/// The share of lines that are laid anywhere through the thing.
const ANYWHERE: f64 = 0.125;

impl Bssrdf {
    /// With coefficients per scene unit, under a boundary of relative index `ior`, 1 or more.
    pub fn new(model: Model, medium: Medium, phase: Phase, ior: f64) -> Bssrdf {
        Bssrdf { model, medium, phase, ior, profiles: Profile::of_medium(model, &medium, phase, ior) }
    }

    /// A place of the same thing from which light comes to `exit`; `None` when the line met nothing that sends any.
    /// Of the places on a line one is drawn evenly with the chance `evenly`, else by what it counts here.
    pub fn entry(&self, world: &World, exit: &Point, evenly: f64, random: &mut Random) -> Option<Entry> {
        let axes = axes(exit);
        let axis = [0, 0, 1, 2][random.choice(4)];
        let ball = world.balls[exit.thing()];
        let (center, radius) = match random.unit() < ANYWHERE {
            true => (ball.center, ball.radius * random.unit().sqrt()),
            false => (exit.p, self.profiles[random.choice(3)].sample(random.unit())?),
        };
        let (sin, cos) = (2.0 * PI * random.unit()).sin_cos();
        let through = center + radius * (cos * axes[(axis + 1) % 3] + sin * axes[(axis + 2) % 3]);
        let places: Vec<(Point, f64)> = world
            .along(exit.thing(), through, axes[axis])
            .into_iter()
            .filter_map(|point| {
                let density = self.density(exit, &point, ball);
                // At no distance R_d is infinite, and no line comes upon a triangle from its edge: both have no chance.
                (point.p != exit.p && density > 0.0).then(|| (point, self.r_d(exit, &point).element_sum() / density))
            })
            .filter(|(_, weight)| *weight > 0.0 || evenly > 0.0)
            .collect();
        let last = places.len().checked_sub(1)?;
        let total: f64 = places.iter().map(|(_, weight)| weight).sum();
        let each = 1.0 / places.len() as f64;
        let chance = |weight: f64| if total > 0.0 { evenly * each + (1.0 - evenly) * weight / total } else { each };
        let mut sought = random.unit();
        let drawn = places.iter().position(|(_, weight)| {
            sought -= chance(*weight);
            sought < 0.0
        });
        let (point, weight) = places[drawn.unwrap_or(last)];
        Some(Entry { point, weight: 1.0 / chance(weight) })
    }

    /// R_d between two places, per squared scene unit.
    pub fn r_d(&self, exit: &Point, entry: &Point) -> Rgb {
        let r = exit.p.distance(entry.p);
        Rgb::from_array(self.profiles.each_ref().map(|profile| profile.r_d_tabulated(r)))
    }

    /// The density per area with which lines from an exit, along all axes and at radii of all channels, find an entry on a
    /// thing within that ball.
    pub fn density(&self, exit: &Point, entry: &Point, ball: Ball) -> f64 {
        let offset = entry.p - exit.p;
        let anywhere = ANYWHERE / (PI * ball.radius * ball.radius);
        let by_axis = |(axis, chance): (DVec3, f64)| {
            let facing = chance * axis.dot(entry.flat).abs();
            if facing == 0.0 {
                // Even where the density of radii is infinite.
                return 0.0;
            }
            let radius = offset.cross(axis).length();
            let own = self.profiles.iter().map(|profile| profile.pdf(radius)).sum::<f64>() / 3.0;
            facing * ((1.0 - ANYWHERE) * own + anywhere)
        };
        axes(exit).into_iter().zip(CHANCES).map(by_axis).sum()
    }
}

/// Along which lines are laid at a place where light leaves.
fn axes(exit: &Point) -> [DVec3; 3] {
    let (x, y) = exit.normal.any_orthonormal_pair();
    [exit.normal, x, y]
}
