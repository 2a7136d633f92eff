//! A path on its way: where it is, what it lies in, and what its light weighs.

use super::kin::Shared;
use super::random::Random;
use super::world::Place;
use crate::optics::Rgb;
use glam::DVec3;

/// What one path brings, by part.
#[derive(Clone, Copy, Debug, Default)]
pub struct Parts {
    pub scattered: Rgb,
    pub glossy: Rgb,
    pub unscattered: Rgb,
}

/// The things in which a point lies, innermost last.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inside {
    things: [u32; 4],
    count: usize,
}

impl Inside {
    pub fn innermost(&self) -> Option<usize> {
        self.count.checked_sub(1).map(|last| self.things[last] as usize)
    }

    /// The thing, if there is one alone.
    pub fn only(&self) -> Option<usize> {
        self.innermost().filter(|_| self.count == 1)
    }

    pub fn is_nothing(&self) -> bool {
        self.count == 0
    }

    /// Things that lie in one another more than four deep count as four.
    pub fn with(mut self, thing: usize) -> Inside {
        if self.count < self.things.len() {
            self.things[self.count] = thing as u32;
            self.count += 1;
        }
        self
    }

    pub fn without(mut self, thing: usize) -> Inside {
        if let Some(place) = self.things[..self.count].iter().rposition(|t| *t as usize == thing) {
            self.things.copy_within(place + 1..self.count, place);
            self.count -= 1;
        }
        self
    }
}

/// Weights of a path whose free paths are drawn for one channel.
#[derive(Clone, Copy)]
pub struct Weight {
    /// What a path's light is multiplied by.
    pub value: Rgb,
    /// The density with which each channel would have drawn this path, over their mean.
    pub density: Rgb,
    pub hero: usize,
}

impl Weight {
    pub fn new(random: &mut Random) -> Weight {
        Weight { value: Rgb::ONE, density: Rgb::ONE, hero: random.choice(3) }
    }

    /// The density of all channels together of a choice that each would make with these densities.
    pub fn mixed(&self, density: Rgb) -> f64 {
        (self.density * density).element_sum() / self.density.element_sum()
    }

    /// After an event that has these values and, if drawn for each channel, these densities.
    pub fn event(&mut self, value: Rgb, density: Rgb) {
        let density = self.density * density;
        let mean = density.element_sum() / 3.0;
        self.value *= value / mean;
        self.density = density / mean;
    }
}

/// A path on its way.
pub struct Walk {
    pub origin: DVec3,
    pub direction: DVec3,
    pub on: Option<Place>,
    pub inside: Inside,
    /// How deep `origin` lies in the innermost thing, where that is known.
    pub below: Option<f64>,
    pub weight: Weight,
    /// Of `direction`, where a lamp could have been joined to the path's last vertex instead.
    pub density: Option<f64>,
    /// How far `origin` lies from that vertex, beyond boundaries that do nothing to the path.
    pub passed: f64,
    /// Whether lamps were joined there through index-matched boundaries, too: to particles they are, to surfaces not.
    pub joined_through: bool,
    /// Whether what shines along this ray, in the open, was added already.
    pub counted: bool,
    /// The thing in which the path was scattered last and where, as long as it has not met a surface since: there lamps
    /// without extent were joined to it.
    pub lobes: Option<(usize, DVec3)>,
    /// Multiplies the light once it has scattered.
    pub color: Rgb,
    pub scattered: bool,
    /// Whether it has scattered since it came from the open.
    pub struck: bool,
    pub depth: u32,
    pub sum: Sum,
    /// Of the light that comes from lamps by ways that [light paths](super::light_paths) take too, the share that this path brings.
    pub left: f64,
    /// What kin may share of it.
    pub shared: Option<Shared>,
}

/// Light by whether it was scattered.
#[derive(Clone, Copy, Default)]
pub struct Sum {
    pub scattered: Rgb,
    pub unscattered: Rgb,
}

impl Walk {
    pub fn add(&mut self, light: Rgb) {
        let light = self.weight.value * light;
        match self.scattered {
            true => self.sum.scattered += self.color * light,
            false => self.sum.unscattered += light,
        }
    }
}
