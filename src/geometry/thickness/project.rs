//! Functions of the thickness as spherical harmonics: c_i = ∫ f(w) Y_i(w) dw [Tomaszewska2012, eq. 1].

use super::{Lengths, Span, antipodal_directions};
use crate::optics::sh::sh_basis;
use crate::problem::{Problem, Tick};
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Coefficients of real spherical harmonics at each vertex, in the object's space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Harmonics {
    pub bands: usize,
    pub channels: usize,
    /// bands² of the first channel, then of the next; vertex after vertex.
    pub values: Vec<f32>,
}

impl Harmonics {
    /// The coefficients of a vertex and channel.
    pub fn at(&self, vertex: usize, channel: usize) -> &[f32] {
        let count = self.bands * self.bands;
        &self.values[(vertex * self.channels + channel) * count..][..count]
    }
}

/// A vertex normal for each vertex, and a function of the cosine between it and a direction.
pub type Facing<'a> = (&'a [Vec3], &'a (dyn Fn(f64) -> f64 + Sync));

/// Projects `CHANNELS` functions of what a ray crosses, each times a weight of how the surface faces the ray, if there is
/// one. `response` is asked once for each length that is kept apart.
pub fn project<const CHANNELS: usize>(
    lengths: &Lengths,
    facing: Option<Facing>,
    bands: usize,
    response: impl Fn(Span) -> [f64; CHANNELS],
    tick: Tick,
) -> Result<Harmonics, Problem> {
    let directions = antipodal_directions(lengths.directions);
    let solid_angle = 4.0 * PI / lengths.directions as f64;
    let bases: Vec<Vec<f32>> = directions
        .iter()
        .map(|d| sh_basis(*d, bands).into_iter().map(|y| (solid_angle * y) as f32).collect())
        .collect();
    let responses: Vec<[f32; CHANNELS]> =
        (0..=u16::MAX).map(|packed| response(Span::unpack(packed)).map(|r| r as f32)).collect();
    let count = bands * bands;
    let mut values = vec![0.0f32; lengths.vertices * CHANNELS * count];
    const VERTICES: usize = 64;
    let done = AtomicUsize::new(0);
    values.par_chunks_mut(VERTICES * CHANNELS * count).enumerate().try_for_each(|(chunk, values)| {
        for (i, sums) in values.chunks_exact_mut(CHANNELS * count).enumerate() {
            let vertex = chunk * VERTICES + i;
            for (k, basis) in bases.iter().enumerate() {
                let response = responses[lengths.packed[k * lengths.vertices + vertex] as usize];
                if response == [0.0; CHANNELS] {
                    continue;
                }
                let weight =
                    facing.map_or(1.0, |(normals, weight)| weight(normals[vertex].as_dvec3().dot(directions[k])));
                for (sums, response) in sums.chunks_exact_mut(count).zip(response) {
                    let value = weight as f32 * response;
                    sums.iter_mut().zip(basis).for_each(|(sum, y)| *sum += value * y);
                }
            }
        }
        tick(done.fetch_add(values.len(), Relaxed) as f64 / (lengths.vertices * CHANNELS * count) as f64)
    })?;
    Ok(Harmonics { bands, channels: CHANNELS, values })
}
