//! The volumetric truth: unbiased random walks through the media inside any closed mesh, in f64.
//!
//! A path starts at the eye. Free paths are as the medium has them ([`super::free_path`]), directions follow the phase
//! function, boundaries reflect and refract by Fresnel or by GGX microfacets; nothing is approximated. One path serves three
//! channels: its free paths are drawn for one of them, and its weight is the balance heuristic over all three (spectral
//! multiple importance sampling [Wilkie2014]), so that no channel's weight exceeds 3. Lamps are joined to each vertex that
//! can see them, and through refracting boundaries too ([`super::refracted`], [`super::lobe`]), where few paths or none
//! would find them.
//!
//! Radiance is counted per squared index of the medium that it travels in. Lengths are scene units.

use super::free_path::End;
use super::kin::{self, Exit, Shared, Strand};
use super::light::{Kind, Lamp, Ray, Sky};
use super::light_paths::Field;
use super::path::{Inside, Sum, Walk, Weight};
use super::random::Random;
use super::refracted::Refracted;
use super::surfaces::Bounce;
use super::world::{Matter, Medium, Place, Point, World};
use crate::optics::Rgb;
use glam::DVec3;
use std::f64::consts::PI;

/// Which light counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Light {
    /// Light source, object, eye: what real-time methods make.
    Direct,
    /// Also what leaves one place and enters another.
    #[default]
    Full,
}

/// All that a path needs to know.
pub struct Tracer {
    pub world: World,
    pub lamps: Vec<Lamp>,
    pub sky: Option<Sky>,
    pub refracted: Vec<Refracted>,
    pub light: Light,
    pub max_depth: u32,
    /// Whether light scatters only once in what it enters.
    pub single: bool,
    /// Whether lamps with extent and the sky are joined to vertices. Without, paths must find them by themselves: the same
    /// picture, with more noise.
    pub joins: bool,
    /// Whether paths leave their finds to their kin. Without, likewise.
    pub kin: bool,
    /// Where paths leave their finds to light paths. Without, likewise.
    pub field: Option<Field>,
}

impl Tracer {
    /// One path from the eye, which lies inside the things `inside`; to be [settled](Tracer::settle) with its kin, if only
    /// with itself.
    pub fn trace(&self, eye: DVec3, direction: DVec3, inside: Inside, random: &mut Random) -> Strand {
        let mut strand = Strand { is_object: true, ..Strand::default() };
        if !inside.is_nothing() {
            // From within a medium there is no boundary to split at.
            let mut walk = self.start(eye, direction, None, inside, random);
            walk.shared = self.kin.then(Shared::default);
            strand.end(self.walk_from(walk, None, random));
            return strand;
        }
        match self.world.meet(eye, direction, f64::INFINITY, None) {
            Some(point) => self.see(&mut strand, &point, direction, random),
            None => {
                strand.is_object = false;
                strand.parts.unscattered = self.sky.as_ref().map_or(Rgb::ZERO, |sky| sky.radiance(direction));
            }
        }
        strand
    }

    /// What a surface sends to the eye.
    fn see(&self, strand: &mut Strand, point: &Point, direction: DVec3, random: &mut Random) {
        let thing = &self.world.things[point.thing()];
        match &thing.matter {
            Matter::Emitter(_) => {
                strand.is_object = false;
                strand.parts.unscattered =
                    self.emitted(point, point.t * direction).map_or(Rgb::ZERO, |(light, _)| light)
            }
            Matter::Translucent { .. } | Matter::Bssrdf { .. } if direction.dot(point.flat) > 0.0 => {
                // The back of a mesh that is not closed: nothing is entered.
                strand.parts.unscattered = self.radiance(point.p, direction, point.place, None, 1, random);
            }
            Matter::Bssrdf { surface, bssrdf } if self.kin => {
                strand.parts.glossy = self.follow(self.gloss(thing, surface, point, direction, random), random);
                let entry = bssrdf.entry(&self.world, point, 0.5, random).map(|entry| {
                    let light = self.entering(&entry.point, 1.0, surface.ior, Rgb::ONE, random);
                    (entry, self.follow(Some(light), random))
                });
                strand.exit = Some(Exit { point: *point, weight: thing.leaving(surface, point, direction), entry });
            }
            Matter::Opaque { surface, .. } | Matter::Bssrdf { surface, .. } => {
                strand.parts.glossy = self.follow(self.gloss(thing, surface, point, direction, random), random);
                strand.parts.scattered = self.follow(self.scattered(thing, point, direction, random), random);
            }
            Matter::Translucent { surface, .. } => {
                strand.parts.glossy = self.follow(self.gloss(thing, surface, point, direction, random), random);
                let facing = self.facing(thing, surface, point, direction, Inside::default());
                let (into, share) = match facing.is_smooth() {
                    true => {
                        let split = facing.split(direction);
                        (split.refracted, 1.0 - split.reflectance)
                    }
                    false => {
                        let h = facing.microfacet(direction, random.pair());
                        let split = facing.split_at(direction, h);
                        let unhidden = split.refracted.map_or(0.0, |to| facing.unhidden(direction, to, false));
                        (split.refracted, (1.0 - split.reflectance) * unhidden)
                    }
                };
                let Some(into) = into.filter(|_| share > 0.0) else { return };
                let inside = Inside::default().with(point.thing());
                let mut walk = self.start(point.p, into, Some(point.place), inside, random);
                walk.color = thing.color(surface, point);
                walk.depth = 1;
                walk.weight.value *= share;
                walk.shared = self.kin.then(Shared::default);
                strand.end(self.walk_from(walk, None, random));
            }
        }
    }

    pub(super) fn start(
        &self,
        origin: DVec3,
        direction: DVec3,
        on: Option<Place>,
        inside: Inside,
        random: &mut Random,
    ) -> Walk {
        Walk {
            origin,
            direction,
            on,
            inside,
            below: None,
            passed: 0.0,
            weight: Weight::new(random),
            density: None,
            joined_through: false,
            counted: false,
            lobes: None,
            color: Rgb::ONE,
            scattered: false,
            struck: false,
            depth: 0,
            sum: Sum::default(),
            left: 1.0,
            shared: None,
        }
    }

    /// What a surface sends back along the eye's ray by one of its ways.
    fn follow(&self, bounce: Option<Bounce>, random: &mut Random) -> Rgb {
        bounce.map_or(Rgb::ZERO, |bounce| {
            let Bounce { joined, p, place, direction, weight, density } = bounce;
            match weight == Rgb::ZERO {
                true => joined,
                false => joined + weight * self.radiance(p, direction, place, density, 1, random),
            }
        })
    }

    /// All light along a ray through nothing, from a surface on: of everything for full light, of lamps and sky for direct.
    fn radiance(&self, p: DVec3, d: DVec3, on: Place, density: Option<f64>, depth: u32, random: &mut Random) -> Rgb {
        let met = self.world.meet(p, d, f64::INFINITY, Some(on));
        let light = self.shining(p, d, met.as_ref(), density, 0.0);
        if self.light == Light::Direct || met.is_none() {
            return light;
        }
        let mut walk = self.start(p, d, Some(on), Inside::default(), random);
        (walk.density, walk.depth, walk.counted) = (density, depth, true);
        let sum = self.walk_from(walk, met, random).sum;
        light + sum.scattered + sum.unscattered
    }

    /// What lamps with extent and the sky send along a ray in empty space, of which a vertex with that density of
    /// directions takes its share; `met` is what the ray meets first, and `passed` how far behind `p` the vertex lies.
    pub(super) fn shining(&self, p: DVec3, d: DVec3, met: Option<&Point>, density: Option<f64>, passed: f64) -> Rgb {
        self.shining_but(p, d, met, density, passed, |_| 1.0)
    }

    /// Likewise; of each lamp only the share that `left` says.
    pub(super) fn shining_but(
        &self,
        p: DVec3,
        d: DVec3,
        met: Option<&Point>,
        density: Option<f64>,
        passed: f64,
        left: impl Fn(&Lamp) -> f64,
    ) -> Rgb {
        let density = density.filter(|_| self.joins);
        let share = |own: f64| density.map_or(1.0, |density| density / (density + own));
        let mut sum = Rgb::ZERO;
        if let Some(sky) = &self.sky
            && (met.is_none() || !sky.shadow)
        {
            sum += share(sky.density(d)) * sky.radiance(d);
        }
        for (i, lamp) in self.lamps.iter().enumerate().filter(|(_, lamp)| lamp.has_extent()) {
            if let Some((radiance, own)) = self.shown(i, p, d, met, passed) {
                sum += share(own) * left(lamp) * radiance;
            }
        }
        sum
    }

    /// The radiance of an area light along a ray, if that meets it, and the density of its direction in [`Lamp::sample`].
    pub(super) fn shown(
        &self,
        lamp: usize,
        p: DVec3,
        d: DVec3,
        met: Option<&Point>,
        passed: f64,
    ) -> Option<(Rgb, f64)> {
        let to = match self.lamps[lamp].shadow {
            true => met.filter(|point| self.world.things[point.thing()].lamp() == Some(lamp))?.t * d,
            false => self.lamps[lamp].meet(p, d)?,
        };
        self.lamps[lamp].radiance(to + passed * d)
    }

    pub(super) fn is_emitter(&self, point: &Point) -> bool {
        self.world.things[point.thing()].lamp().is_some()
    }

    pub(super) fn emitted(&self, point: &Point, to: DVec3) -> Option<(Rgb, f64)> {
        let lamp = self.world.things[point.thing()].lamp()?;
        self.lamps[lamp].radiance(to)
    }

    /// Follows a path to its end. `met` is what its ray meets first, if that is known already.
    fn walk_from(&self, mut walk: Walk, mut met: Option<Point>, random: &mut Random) -> Walk {
        loop {
            let flight = match self.single && walk.struck {
                true => self.passage(&walk, random),
                false => self.flight(&walk, met.take(), random),
            };
            if walk.inside.is_nothing() && !std::mem::replace(&mut walk.counted, false) {
                let met = flight.end.surface();
                walk.add(walk.left * self.shining(walk.origin, walk.direction, met, walk.density, walk.passed));
            }
            if walk.depth >= self.max_depth {
                return walk;
            }
            walk.depth += 1;
            walk.weight = flight.weight;
            match flight.end {
                End::Surface(point) => {
                    walk.below = None;
                    if !self.field.as_ref().is_some_and(|field| field.is_passed(point.thing())) {
                        walk.left = 1.0;
                    }
                    if let Some(shared) = &mut walk.shared {
                        shared.pass_surface();
                    }
                    if !self.cross(&mut walk, point, random) {
                        return walk;
                    }
                    walk.struck &= !walk.inside.is_nothing();
                }
                End::Particle(p, medium, below) => {
                    (walk.origin, walk.on, walk.below) = (p, None, below);
                    if !self.scatter(&mut walk, medium, random) {
                        return walk;
                    }
                }
                End::Away => return walk,
            }
            // Roulette by weight: what is left of the light decides, so that high albedos live long.
            let left = walk.weight.value.max_element();
            if left < 0.1 && !walk.shared.as_ref().is_some_and(Shared::is_at_stem) {
                if random.unit() >= left / 0.1 {
                    return walk;
                }
                walk.weight.value *= 0.1 / left;
            }
        }
    }

    /// A path meets a medium's particle: light that is scattered there, and the way on; whether it goes on.
    fn scatter(&self, walk: &mut Walk, medium: &Medium, random: &mut Random) -> bool {
        (walk.scattered, walk.struck) = (true, true);
        if walk.shared.as_ref().is_some_and(Shared::is_open) {
            walk.share(self.shares(walk, medium), kin::lengths(medium), random);
            if walk.shared.as_ref().is_some_and(Shared::is_at_find) && !self.leave(walk, random) {
                return false;
            }
        }
        let from = walk.direction;
        // Channels may scatter differently: the direction is drawn for the hero, and weighs like a free path.
        let phase = |to: DVec3| medium.scattered(from, to);
        self.join_lamps(walk, |lamp| self.is_joined(lamp), phase, random);
        let refracts = walk.inside.only().is_some_and(|thing| self.world.things[thing].refracts());
        if let Some((ray, shadow)) = self.sky_sample(random).filter(|_| !refracts) {
            self.join(walk, &ray, shadow, phase(ray.direction), random);
        }
        walk.lobes = None;
        if let Some(thing) = walk.inside.only() {
            self.join_lobes(walk, thing, phase, random);
        }
        let parameter = medium.parameter[walk.weight.hero];
        let to = around(from, -medium.phase.sample(random.unit(), parameter), random.unit());
        (walk.joined_through, walk.passed) = (true, 0.0);
        walk.go(to, phase(to));
        true
    }

    /// Adds the light of lamps at a vertex in a medium, `phase` being the share that goes on along the path, 1/sr.
    pub(super) fn join_lamps(
        &self,
        walk: &mut Walk,
        wanted: impl Fn(&Lamp) -> bool,
        phase: impl Fn(DVec3) -> Rgb,
        random: &mut Random,
    ) {
        let innermost = walk.inside.innermost();
        let (p, below, fill) = (walk.origin, walk.below, self.fill(walk.inside));
        for (i, lamp) in self.lamps.iter().enumerate().filter(|(_, lamp)| wanted(lamp)) {
            for refracted in self.refracted.iter().filter(|r| r.lamp == i && Some(r.thing) == innermost) {
                let luck = random.exponential();
                let through = |to, length| fill.transmittance(p, below, to, length, random);
                refracted.each(&self.world, p, lamp.shadow, (fill.thinnest(), luck), through, |to, light| {
                    walk.gather(to, phase(to), walk.left * light);
                });
            }
            if walk.inside.only().is_some_and(|thing| self.is_behind_glass(lamp, thing)) {
                continue;
            }
            if let Some(ray) = lamp.sample(p, random) {
                self.join(walk, &ray, lamp.shadow, phase(ray.direction), random);
            }
        }
    }

    /// Whether no straight line joins a lamp to a point inside a thing.
    fn is_behind_glass(&self, lamp: &Lamp, thing: usize) -> bool {
        let ball = self.world.balls[thing];
        let nearest = match lamp.kind {
            Kind::Directional { .. } => f64::INFINITY,
            Kind::Point { position, .. } => position.distance(ball.center),
            Kind::Rect { center, u, v, .. } => {
                let to = ball.center - center;
                let along = |edge: DVec3| (to.dot(edge) / edge.length_squared()).clamp(-1.0, 1.0) * edge;
                to.distance(along(u) + along(v))
            }
        };
        nearest > ball.radius && self.world.things[thing].refracts()
    }

    /// Adds a lamp's light at a vertex in a medium, straight through boundaries that do not refract.
    fn join(&self, walk: &mut Walk, ray: &Ray, shadow: bool, phase: Rgb, random: &mut Random) {
        let (mut p, mut on, mut inside, mut left) = (walk.origin, walk.on, walk.inside, ray.distance);
        let (mut through, mut below) = (Rgb::ONE, walk.below);
        let mut is_out = false;
        loop {
            let met = self.world.meet(p, ray.direction, left * (1.0 - 1e-9), on);
            if is_out && (met.is_none() || !shadow) {
                break;
            }
            if let Some(point) = &met {
                let Matter::Translucent { surface, .. } = &self.world.things[point.thing()].matter else { return };
                // Direct light is let in by the thing that it is scattered in, and by no other.
                let is_elsewhere = self.light == Light::Direct && (is_out || ray.direction.dot(point.flat) <= 0.0);
                if surface.ior != 1.0 || is_elsewhere {
                    return;
                }
            }
            let length = met.as_ref().map_or(left, |point| point.t);
            through *= self.fill(inside).transmittance(p, below.take(), ray.direction, length, random);
            let Some(point) = met else { break };
            let leaves = ray.direction.dot(point.flat) > 0.0;
            inside = if leaves { inside.without(point.thing()) } else { inside.with(point.thing()) };
            is_out = inside.innermost().is_none();
            (p, on, left) = (point.p, Some(point.place), left - point.t);
        }
        let share = ray.density.map_or(1.0, |own| own / (own + walk.density_of(phase)));
        walk.gather(ray.direction, phase, share * through * ray.irradiance);
    }
}

/// The direction at a cosine from `axis`, turned about it by a share of the circle.
pub(super) fn around(axis: DVec3, cos: f64, turn: f64) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
    let (s, c) = (2.0 * PI * turn).sin_cos();
    (sin * c * x + sin * s * y + cos * axis).normalize()
}
