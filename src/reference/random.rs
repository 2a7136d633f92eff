//! Random numbers that depend on seed, pixel and sample alone: the same picture on any number of threads.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

pub struct Random(Pcg64Mcg);

impl Random {
    /// A stream of its own for every sample of every pixel.
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Random {
        let words = [seed, pixel, sample].map(u64::to_le_bytes).concat();
        let hash = blake3::hash(&words);
        let state: [u8; 16] = hash.as_bytes()[..16].try_into().expect("a hash has 32 bytes");
        Random(Pcg64Mcg::from_seed(state))
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn pair(&mut self) -> (f64, f64) {
        (self.unit(), self.unit())
    }

    /// Exponentially distributed with mean 1.
    pub fn exponential(&mut self) -> f64 {
        -(1.0 - self.unit()).ln()
    }

    /// One of `count`.
    pub fn choice(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count - 1)
    }
}
