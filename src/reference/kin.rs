//! Kin: paths of neighbouring pixels, which share what they find [Bekaert2002].
//!
//! Below a surface paths of neighbouring pixels lie close together, and most of their work comes later: each could have gone
//! where another went. A path is cut at its first flight from particle to particle that is neither short nor long: what lies
//! near to one particle is far more likely found from there than from any other, and what lies far from all is not looked
//! at. The particles where that flight could have begun are the path's stems, the one where it ends is its find. Light that
//! comes by a find counts for every stem of the kin that sees it, divided by the density with which all these stems together
//! come upon it (the balance heuristic). What a path brings by other ways is its own. Profiles are shared likewise: where
//! light enters for one exit, it does for the others.
//!
//! Nothing is approximated: a pixel's mean is what it would be alone, whoever its kin are. Only their noise is alike.

use super::bssrdf::Entry;
use super::path::{Parts, Sum, Walk, Weight};
use super::random::Random;
use super::volume::Tracer;
use super::world::{Matter, Medium, Point};
use crate::optics::Rgb;
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::Range;

/// Pixels to a side of the blocks whose paths are kin.
pub const SIDE: u32 = 8;

/// The density of directions by which lamps and paths share light out at finds, 1/sr: it must not depend on who came there.
const EVEN: f64 = 0.25 / PI;

/// Flights of fewer mean free paths are short, of more are long.
const SHORT: f64 = 0.6;
const LONG: f64 = 6.0;

/// Where the mean cosine of scattering is farther from 0, paths that lie side by side go different ways: nothing is shared.
const DIRECTED: f64 = 0.5;

/// A path from the eye, and what it shares.
#[derive(Default)]
pub struct Strand {
    /// What is its own; all that it brings once its kin have [settled](Tracer::settle).
    pub parts: Parts,
    pub is_object: bool,
    pub(super) stems: Vec<Stem>,
    pub(super) find: Option<Find>,
    pub(super) exit: Option<Exit>,
}

/// A particle from which a path flies on.
#[derive(Clone, Copy)]
pub(super) struct Stem {
    pub p: DVec3,
    /// The direction in which the path came.
    pub from: DVec3,
    /// What light is multiplied by that is scattered here.
    pub weight: Rgb,
    /// The thing in which it lies, and how many events led here. Stems are alike that have both in common: a path has one of
    /// each kind at most, so that which stems there are does not depend on what is found from them.
    pub kind: (usize, u32),
}

/// The particle that a path flew to.
pub(super) struct Find {
    p: DVec3,
    /// Of the stem.
    kind: (usize, u32),
    /// Light of lamps: from which direction, and irradiance on a particle over its density.
    joined: Vec<(DVec3, Rgb)>,
    /// The direction in which the path went on, and the light that it brought from there.
    to: DVec3,
    light: Rgb,
}

/// Where light leaves by a profile.
pub(super) struct Exit {
    pub point: Point,
    /// What it is multiplied by there.
    pub weight: Rgb,
    /// A place where it enters, and the light that does.
    pub entry: Option<(Entry, Rgb)>,
}

/// A path's stems and its find, as it goes.
#[derive(Default)]
pub struct Shared {
    stems: Vec<Stem>,
    find: Option<Find>,
    stage: Stage,
    /// What the path brought before its find.
    before: Sum,
}

#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    Coming,
    AtStem,
    AtFind,
    Gone,
}

impl Shared {
    pub fn is_at_find(&self) -> bool {
        self.stage == Stage::AtFind
    }

    pub fn is_at_stem(&self) -> bool {
        self.stage == Stage::AtStem
    }

    /// Whether there is no find yet: most of a path comes after, and need not be asked.
    pub fn is_open(&self) -> bool {
        self.find.is_none()
    }

    /// The path meets a surface.
    pub fn pass_surface(&mut self) {
        if self.stage == Stage::AtStem {
            self.stage = Stage::Coming;
        }
    }
}

impl Strand {
    /// A path has come to its end.
    pub(super) fn end(&mut self, walk: Walk) {
        let mut own = walk.sum;
        if let Some(Shared { stems, mut find, before, .. }) = walk.shared {
            if let Some(find) = &mut find {
                (find.light, own) = (walk.sum.scattered, before);
            }
            (self.stems, self.find) = (stems, find);
        }
        (self.parts.scattered, self.parts.unscattered) = (own.scattered, own.unscattered);
    }
}

impl Walk {
    /// A path meets a particle of a medium that fills all of a thing, the only one in which it lies, if that is told.
    /// `lengths` are those of flights that are shared.
    pub fn share(&mut self, even: Option<usize>, lengths: Range<f64>, random: &mut Random) {
        let Some(shared) = &mut self.shared else { return };
        let p = self.origin;
        if let (Stage::AtStem, Some(stem)) = (shared.stage, shared.stems.last())
            && lengths.contains(&stem.p.distance(p))
        {
            let find = Find { p, kind: stem.kind, joined: Vec::new(), to: DVec3::ZERO, light: Rgb::ZERO };
            shared.before = std::mem::take(&mut self.sum);
            (shared.find, shared.stage) = (Some(find), Stage::AtFind);
            (self.weight, self.color) = (Weight::new(random), Rgb::ONE);
        } else if let (Stage::Coming | Stage::AtStem, Some(thing)) = (shared.stage, even) {
            // From here on other stems may come upon the same: the channel is drawn anew, for all alike.
            self.weight = Weight { value: self.weight.value, ..Weight::new(random) };
            let weight = self.color * self.weight.value;
            shared.stems.push(Stem { p, from: self.direction, weight, kind: (thing, self.depth) });
            shared.stage = Stage::AtStem;
        } else if shared.stage == Stage::AtStem {
            shared.stage = Stage::Coming;
        }
    }

    /// Adds light that reaches a particle from a direction; `phase` of it goes on along the path, 1/sr.
    pub fn gather(&mut self, to: DVec3, phase: Rgb, light: Rgb) {
        match self
            .shared
            .as_mut()
            .filter(|shared| shared.stage == Stage::AtFind)
            .and_then(|shared| shared.find.as_mut())
        {
            Some(find) => find.joined.push((to, self.weight.value * light)),
            None => self.sum.scattered += self.color * self.weight.value * phase * light,
        }
    }

    /// The density of a direction in which a particle scatters by `phase`, as lamps see it, 1/sr.
    pub fn density_of(&self, phase: Rgb) -> f64 {
        let is_find = self.shared.as_ref().is_some_and(|shared| shared.stage == Stage::AtFind);
        if is_find { EVEN } else { self.weight.mixed(phase) }
    }

    /// A particle scatters the path into a direction, drawn by `phase`.
    pub fn go(&mut self, to: DVec3, phase: Rgb) {
        (self.direction, self.density) = (to, Some(self.density_of(phase)));
        match self.shared.as_mut().filter(|shared| shared.stage == Stage::AtFind) {
            Some(shared) => {
                shared.find.as_mut().expect("a path at its find has one").to = to;
                shared.stage = Stage::Gone;
            }
            None => self.weight.event(phase, phase),
        }
    }
}

impl Tracer {
    /// The thing whose stems a particle may be among.
    pub(super) fn shares(&self, walk: &Walk, medium: &Medium) -> Option<usize> {
        let is_even = |thing: &usize| self.world.strata[*thing].is_none();
        walk.inside.only().filter(is_even).filter(|_| is_shared(medium))
    }

    /// Gives every strand its part of what all have found.
    pub fn settle(&self, strands: &mut [Strand]) {
        let mut shares = vec![Rgb::ZERO; strands.len()];
        for (own, strand) in strands.iter().enumerate() {
            if let Some(find) = strand.find.as_ref().filter(|find| find.light != Rgb::ZERO || !find.joined.is_empty()) {
                self.settle_find(strands, own, find, &mut shares);
            }
            if let Some((entry, light)) = strand.exit.as_ref().and_then(|exit| exit.entry.as_ref())
                && *light != Rgb::ZERO
            {
                self.settle_entry(strands, entry, *light, &mut shares);
            }
        }
        strands.iter_mut().zip(shares).for_each(|(strand, share)| strand.parts.scattered += share);
    }

    fn settle_find(&self, strands: &[Strand], own: usize, find: &Find, shares: &mut [Rgb]) {
        let thing = find.kind.0;
        let Matter::Translucent { medium, .. } = &self.world.things[thing].matter else {
            unreachable!("a path is in a medium where it shares")
        };
        let (sigma_t, lengths) = (medium.sigma_t(), lengths(medium));
        let clearance = self.world.clearance(thing, find.p);
        // Channels are drawn evenly: densities are their means.
        let (mut arriving, mut leaving) = (0.0, 0.0);
        let mut ways = Vec::new();
        for (i, strand) in strands.iter().enumerate() {
            for stem in strand.stems.iter().filter(|stem| stem.kind == find.kind) {
                let offset = find.p - stem.p;
                let length = offset.length();
                if !lengths.contains(&length) {
                    continue;
                }
                let to = offset / length;
                let is_seen = i == own
                    || length < clearance.max(self.world.clearance(thing, stem.p))
                    || self.world.is_free(stem.p, to, length * (1.0 - 1e-9), None);
                if !is_seen {
                    continue;
                }
                let spread = (-sigma_t * length).exp() * medium.scattered(stem.from, to) / (length * length);
                let on = medium.scattered(to, find.to);
                arriving += (sigma_t * spread).element_sum() / 3.0;
                leaving += (sigma_t * spread * on).element_sum() / 3.0;
                ways.push((i, to, stem.weight * medium.sigma_s * spread, on));
            }
        }
        for (i, to, weight, on) in ways {
            let joined: Rgb = find.joined.iter().map(|(lamp, light)| medium.scattered(to, *lamp) * *light).sum();
            shares[i] += weight * (joined / arriving + on * find.light / leaving);
        }
    }

    fn settle_entry(&self, strands: &[Strand], entry: &Entry, light: Rgb, shares: &mut [Rgb]) {
        let thing = entry.point.thing();
        let Matter::Bssrdf { bssrdf, .. } = &self.world.things[thing].matter else {
            unreachable!("light leaves by a profile where there is one")
        };
        let exits = || {
            let exits = strands.iter().enumerate().filter_map(|(i, strand)| Some((i, strand.exit.as_ref()?)));
            exits.filter(|(_, exit)| exit.point.thing() == thing)
        };
        let ball = self.world.balls[thing];
        let density: f64 = exits().map(|(_, exit)| bssrdf.density(&exit.point, &entry.point, ball)).sum();
        for (i, exit) in exits() {
            shares[i] += entry.weight / density * exit.weight * bssrdf.r_d(&exit.point, &entry.point) * light;
        }
    }
}

/// Whether paths in a medium share what they find.
pub(super) fn is_shared(medium: &Medium) -> bool {
    let mean = Rgb::from_array(medium.parameter.to_array().map(|k| medium.phase.mean_cosine(k)));
    mean.abs().max_element() <= DIRECTED
}

/// How far flights go that kin share, in scene units.
pub(super) fn lengths(medium: &Medium) -> Range<f64> {
    let sigma_t = medium.sigma_t();
    SHORT / sigma_t.max_element()..LONG / sigma_t.min_element()
}
