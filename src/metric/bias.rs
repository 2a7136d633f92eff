//! Signed relative error of the mean: mean(x - ref) / mean(ref). Noise averages out of it; light that a method loses or
//! invents does not.

use super::{Pair, ratio};
use serde::Serialize;

/// Relative: 0.02 is 2 % too bright. Infinite where the reference is black and the image is not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bias {
    /// Of all channels together.
    pub all: f64,
    pub channels: [f64; 3],
}

impl Bias {
    /// The largest of a channel, without its sign.
    pub fn largest(&self) -> f64 {
        self.channels.iter().fold(0.0, |most, bias| bias.abs().max(most))
    }
}

pub fn bias(pair: &Pair) -> Bias {
    // Sums of difference and reference, per channel.
    let sums: [[f64; 2]; 3] = std::array::from_fn(|c| {
        pair.counted().fold([0.0; 2], |[difference, light], i| {
            let (x, reference) = pair.values(i, c);
            [difference + (x - reference), light + reference]
        })
    });
    let all = [0, 1].map(|term| sums.iter().map(|sum| sum[term]).sum::<f64>());
    Bias { all: ratio(all[0], all[1]), channels: sums.map(|[difference, light]| ratio(difference, light)) }
}
