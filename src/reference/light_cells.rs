//! The inside of a thing in cells: where [light paths](super::light_paths) are likely, and the particles that they met.

use super::kin;
use super::random::Random;
use super::volume::Tracer;
use super::world::Medium;
use crate::optics::Rgb;
use glam::{DVec3, IVec3};

/// Where so many light paths of a sample come near they bring half of the light.
const ENOUGH: f64 = 0.5;

/// A cell's side, in mean free paths.
const WIDE: f64 = 1.5;

/// Cells along the longest side of a thing, at most.
const CELLS: f64 = 64.0;

/// The inside of a thing, in cells.
pub(super) struct Region {
    min: DVec3,
    mean_free_path: f64,
    cell: f64,
    counts: IVec3,
    /// The share of the light that light paths bring.
    share: Vec<f64>,
    /// To cells within reach, and how much of the light from there arrives, about.
    pub around: Vec<(IVec3, f64)>,
}

/// A particle that a light path met.
#[derive(Clone, Copy)]
pub(super) struct Met {
    pub thing: usize,
    pub p: DVec3,
    pub travels: DVec3,
    pub flux: Rgb,
    /// How many events of its path count when it is seen from the eye.
    pub depth: u32,
}

/// Particles by cell.
pub(super) struct Cells {
    pub met: Vec<Met>,
    /// Of each cell's first, and one more.
    starts: Vec<usize>,
    /// The running sum of what they are worth, with 0 before the first.
    worth: Vec<f64>,
    /// What all in a cell are worth.
    pub all: Vec<f64>,
    /// Of how many paths they are.
    pub paths: f64,
}

impl Region {
    /// None for a thing whose paths share nothing.
    pub fn new(tracer: &Tracer, thing: usize, medium: &Medium) -> Option<Region> {
        if !kin::is_shared(medium) {
            return None;
        }
        let ball = tracer.world.balls[thing];
        let size = 2.0 * ball.radius;
        let mean_free_path = 3.0 / medium.sigma_t().element_sum();
        let cell = (WIDE * mean_free_path).max(size / CELLS);
        let counts = IVec3::splat((size / cell).ceil().max(1.0) as i32);
        let lengths = kin::lengths(medium);
        let reach = (lengths.end / cell).ceil() as i32 + 1;
        let along = || -reach..=reach;
        let offsets = along().flat_map(|x| along().flat_map(move |y| along().map(move |z| IVec3::new(x, y, z))));
        let least = |offset: &IVec3| (offset.abs() - 1).max(IVec3::ZERO).as_dvec3().length() * cell;
        let sigma = medium.sigma_t().min_element();
        let attenuated = |length: f64| (-sigma * length).exp() / (length * length);
        // The mean over places in both cells.
        let places: Vec<DVec3> = (0..64)
            .map(|i| {
                let mut random = Random::new(0, i, 0);
                let mut place = || DVec3::new(random.unit(), random.unit(), random.unit());
                place() - place()
            })
            .collect();
        let light = |offset: IVec3| {
            let length = |place: &DVec3| cell * (offset.as_dvec3() + place).length();
            let lengths_there = places.iter().map(length).filter(|length| lengths.contains(length));
            // Whatever may be is possible.
            lengths_there.map(attenuated).sum::<f64>() / places.len() as f64 + 0.1 * attenuated(lengths.end)
        };
        let around = offsets.filter(|o| least(o) < lengths.end).map(|o| (o, light(o))).collect();
        let share = vec![0.0; (counts.x * counts.y * counts.z) as usize];
        Some(Region { min: ball.center - ball.radius, mean_free_path, cell, counts, share, around })
    }

    pub fn cell(&self, p: DVec3) -> IVec3 {
        ((p - self.min) / self.cell).floor().as_ivec3().clamp(IVec3::ZERO, self.counts - 1)
    }

    pub fn index(&self, cell: IVec3) -> Option<usize> {
        let is_there = cell.cmpge(IVec3::ZERO).all() && cell.cmplt(self.counts).all();
        is_there.then(|| ((cell.z * self.counts.y + cell.y) * self.counts.x + cell.x) as usize)
    }

    pub fn share_at(&self, p: DVec3) -> f64 {
        self.share[self.index(self.cell(p)).expect("cells hold all of a thing")]
    }

    /// From where the paths of a trial met particles here; each sample has so many paths.
    pub fn learn(&mut self, trial: &[Vec<DVec3>], paths: u64) {
        let mut last = vec![usize::MAX; self.share.len()];
        let mut counts = vec![0.0; self.share.len()];
        for (path, met) in trial.iter().enumerate() {
            for p in met {
                let i = self.index(self.cell(*p)).expect("cells hold all of a thing");
                if last[i] != path {
                    (last[i], counts[i]) = (path, counts[i] + 1.0);
                }
            }
        }
        let near = || (-1..=1).flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| IVec3::new(x, y, z))));
        // A path that comes near is in a few of the cells around; those that are large hold many that do not.
        let scale = (self.mean_free_path / self.cell).powi(3) * paths as f64 / trial.len() as f64;
        for z in 0..self.counts.z {
            for y in 0..self.counts.y {
                for x in 0..self.counts.x {
                    let at = IVec3::new(x, y, z);
                    let count: f64 = near().filter_map(|o| self.index(at + o)).map(|i| counts[i]).sum();
                    let paths = scale * count;
                    let i = self.index(at).expect("it is within its counts");
                    self.share[i] = paths / (paths + ENOUGH);
                }
            }
        }
    }
}

impl Cells {
    pub fn new(region: &Region, all: Vec<Met>, paths: u64) -> Cells {
        let cells: Vec<usize> = all.iter().map(|met| region.index(region.cell(met.p)).expect("as above")).collect();
        let mut starts = vec![0; region.share.len() + 1];
        cells.iter().for_each(|cell| starts[cell + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut next = starts.clone();
        let mut met = all.clone();
        for (cell, one) in cells.iter().zip(all) {
            met[next[*cell]] = one;
            next[*cell] += 1;
        }
        let mut sum = 0.0;
        let mut worth = vec![0.0];
        for one in &met {
            sum += region.share_at(one.p) * one.flux.element_sum();
            worth.push(sum);
        }
        let all = starts.windows(2).map(|cell| worth[cell[1]] - worth[cell[0]]).collect();
        Cells { met, starts, worth, all, paths: paths as f64 }
    }

    /// One of a cell, by its worth, at this share of all.
    pub fn at(&self, cell: usize, share: f64) -> usize {
        let (start, end) = (self.starts[cell], self.starts[cell + 1]);
        let at = self.worth[start] + share * self.all[cell];
        start + self.worth[start + 1..end].partition_point(|sum| *sum <= at).min(end - start - 1)
    }
}
