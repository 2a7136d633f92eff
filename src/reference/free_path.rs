//! How far paths get in what fills a thing, and how much light gets how far.
//!
//! In a homogeneous medium both follow an exponential. In layers free paths are drawn by null collisions: to the layers'
//! extinction one adds as much of what does nothing as makes it even, and to a collision with that the path's weight owes
//! the share that was added, in every channel as in the one that the path is drawn for [Miller2019]. So the balance
//! heuristic over the channels holds for these paths too, and no channel's weight exceeds 3. How much light gets through is
//! estimated by residual ratio tracking [Novak2014]: an exponential of the least extinction, and for what exceeds it a
//! factor at each place of a random series; unbiased, and never outside [0, 1]. Both go on in stretches over which the
//! extinction has known bounds, and where these agree there is neither a null collision nor any noise.

use super::layers::{Around, Strata};
use super::path::{Inside, Walk, Weight};
use super::random::Random;
use super::volume::Tracer;
use super::world::{Matter, Medium, Point, Thing, World};
use crate::optics::Rgb;
use glam::DVec3;

/// The share of light below which it is a matter of chance whether more of its way is looked at.
const FAINT: f64 = 0.01;

/// What is in the space that a path goes through.
#[derive(Clone, Copy)]
pub enum Fill<'a> {
    Nothing,
    Even(&'a Medium),
    Layered(&'a Strata, &'a Thing),
}

/// A path's way along its ray.
pub struct Flight<'a> {
    pub end: End<'a>,
    /// The path's there.
    pub weight: Weight,
}

pub enum End<'a> {
    Surface(Point),
    /// A particle of the medium, and how deep it lies in its thing where that matters.
    Particle(DVec3, &'a Medium, Option<f64>),
    /// Or out of a mesh that is not closed, where nobody can tell what light would come.
    Away,
}

impl End<'_> {
    pub fn surface(&self) -> Option<&Point> {
        match self {
            End::Surface(point) => Some(point),
            _ => None,
        }
    }
}

impl World {
    pub fn fill(&self, thing: usize) -> Fill<'_> {
        let body = &self.things[thing];
        match (&body.matter, &self.strata[thing]) {
            (_, Some(strata)) => Fill::Layered(strata, body),
            (Matter::Translucent { medium, .. }, None) => Fill::Even(medium),
            _ => unreachable!("paths enter only what is translucent"),
        }
    }
}

impl Fill<'_> {
    /// The least extinction of any channel anywhere.
    pub fn thinnest(&self) -> f64 {
        match self {
            Fill::Nothing => 0.0,
            Fill::Even(medium) => medium.sigma_t().min_element(),
            Fill::Layered(strata, _) => strata.thinnest(),
        }
    }

    /// The share of light, or an unbiased estimate of it, that gets along `direction` for `length` from `origin`, whose depth
    /// is `below` where it is known.
    pub fn transmittance(
        &self,
        origin: DVec3,
        below: Option<f64>,
        direction: DVec3,
        length: f64,
        random: &mut Random,
    ) -> Rgb {
        let (strata, thing) = match self {
            Fill::Nothing => return Rgb::ONE,
            Fill::Even(medium) => return (-medium.sigma_t() * length).exp(),
            Fill::Layered(strata, thing) => (strata, thing),
        };
        if length == f64::INFINITY {
            // Out of a mesh that is not closed.
            return Rgb::ZERO;
        }
        let mut depth = below.unwrap_or_else(|| strata.at(thing, origin).0);
        let (mut through, mut t) = (Rgb::ONE, 0.0);
        loop {
            let Around { radius, least, most } = strata.around(depth);
            let rate = (most - least).max_element();
            let stretch = radius.min(length - t);
            let step = if rate > 0.0 { random.exponential() / rate } else { f64::INFINITY };
            through *= (-least * step.min(stretch)).exp();
            if step >= stretch && stretch == length - t {
                break;
            }
            t += step.min(stretch);
            let (deep, medium) = strata.at(thing, origin + t * direction);
            depth = deep;
            if step < stretch {
                through *= 1.0 - (medium.sigma_t() - least) / rate;
            }
            // Roulette: of what hardly counts most is let go, and the rest stands for it.
            let left = through.max_element();
            if left < FAINT {
                if random.unit() >= left / FAINT {
                    return Rgb::ZERO;
                }
                through *= FAINT / left;
            }
        }
        through
    }
}

impl Tracer {
    pub(super) fn fill(&self, inside: Inside) -> Fill<'_> {
        inside.innermost().map_or(Fill::Nothing, |thing| self.world.fill(thing))
    }

    /// Draws how far a path gets. `met` is what its ray meets first, if that is known already.
    pub(super) fn flight(&self, walk: &Walk, met: Option<Point>, random: &mut Random) -> Flight<'_> {
        let (strata, thing) = match self.fill(walk.inside) {
            Fill::Nothing => return self.flight_through(None, walk, met, random),
            Fill::Even(medium) => return self.flight_through(Some(medium), walk, met, random),
            Fill::Layered(strata, thing) => (strata, thing),
        };
        let mut weight = walk.weight;
        let Some(point) = met.or_else(|| self.world.meet(walk.origin, walk.direction, f64::INFINITY, walk.on)) else {
            return Flight { end: End::Away, weight };
        };
        let mut depth = walk.below.unwrap_or_else(|| strata.at(thing, walk.origin).0);
        let mut t = 0.0;
        loop {
            let Around { radius, most, .. } = strata.around(depth);
            let stretch = radius.min(point.t - t);
            let step = free_path(most[weight.hero], random);
            let through = (-most * step.min(stretch)).exp();
            if step >= stretch && stretch == point.t - t {
                weight.event(through, through);
                return Flight { end: End::Surface(point), weight };
            }
            t += step.min(stretch);
            let p = walk.origin + t * walk.direction;
            let (deep, medium) = strata.at(thing, p);
            depth = deep;
            if step >= stretch {
                weight.event(through, through);
                continue;
            }
            let sigma_t = medium.sigma_t();
            if random.unit() * most[weight.hero] < sigma_t[weight.hero] {
                weight.event(medium.sigma_s * through, sigma_t * through);
                return Flight { end: End::Particle(p, medium, Some(depth)), weight };
            }
            let null = (most - sigma_t) * through;
            weight.event(null, null);
        }
    }

    /// Through the same medium everywhere, or through nothing.
    fn flight_through<'a>(
        &self,
        medium: Option<&'a Medium>,
        walk: &Walk,
        met: Option<Point>,
        random: &mut Random,
    ) -> Flight<'a> {
        let mut weight = walk.weight;
        let sigma_t = medium.map_or(Rgb::ZERO, Medium::sigma_t);
        let free = free_path(sigma_t[weight.hero], random);
        // Where no surface is near none need be looked for; most of what lies deep is spared the search.
        let clear = walk.inside.innermost().map_or(0.0, |thing| self.world.clearance(thing, walk.origin));
        let point = met.or_else(|| match free < clear {
            true => None,
            false => self.world.meet(walk.origin, walk.direction, free, walk.on),
        });
        let end = match (point, medium) {
            (Some(point), _) => {
                let through = (-sigma_t * point.t).exp();
                weight.event(through, through);
                End::Surface(point)
            }
            (None, Some(medium)) if free.is_finite() => {
                let through = (-sigma_t * free).exp();
                weight.event(medium.sigma_s * through, sigma_t * through);
                End::Particle(walk.origin + free * walk.direction, medium, None)
            }
            (None, _) => End::Away,
        };
        Flight { end, weight }
    }

    /// The way to the next surface of a path that meets no particle any more.
    pub(super) fn passage(&self, walk: &Walk, random: &mut Random) -> Flight<'_> {
        let mut weight = walk.weight;
        let end = match self.world.meet(walk.origin, walk.direction, f64::INFINITY, walk.on) {
            Some(point) => {
                let fill = self.fill(walk.inside);
                let through = fill.transmittance(walk.origin, walk.below, walk.direction, point.t, random);
                weight.event(through, Rgb::ONE);
                End::Surface(point)
            }
            None => End::Away,
        };
        Flight { end, weight }
    }
}

/// Exponential, and without end where nothing is met.
fn free_path(sigma_t: f64, random: &mut Random) -> f64 {
    match sigma_t {
        0.0 => f64::INFINITY,
        sigma_t => random.exponential() / sigma_t,
    }
}
