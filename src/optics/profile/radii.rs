//! Radii drawn in proportion to a profile, from a table over the optical radius x = r sigma_t'.
//!
//! The density of radii, f(x) = 2 pi x R(x), stands at knots evenly spaced in ln x and follows a power of x between them,
//! which is integrated and inverted in closed form: what is drawn has exactly the density that [`Radii::pdf`] tells, however
//! coarse the table. Below the first knot f is constant, beyond the last it falls as x^-2, the slowest that any profile does:
//! so no radius is cut off.

use std::f64::consts::PI;

#[derive(Clone, Debug)]
pub(super) struct Radii {
    /// f at [`radius`] of 0, 1, 2, …
    density: Vec<f64>,
    /// ∫ f from 0 to each knot.
    below: Vec<f64>,
    /// ∫ f over all radii, by the table.
    total: f64,
}

/// The optical radius of the first knot. Profiles go as 1/x below it.
const FIRST: f64 = 1e-7;
/// ln of the ratio of two neighbours: 24 knots per decade.
const STEP: f64 = std::f64::consts::LN_10 / 24.0;
/// The table ends when the share beyond it is below this.
const BEYOND: f64 = 1e-10;

fn radius(knot: usize) -> f64 {
    FIRST * (knot as f64 * STEP).exp()
}

/// f from 1 at x = 1 to e^rise at x = e^length along a power of x: the power's (exponent + 1) · length, and ∫ f dx.
fn mass(rise: f64, length: f64) -> (f64, f64) {
    let growth = rise + length;
    (growth, if growth == 0.0 { length } else { length * growth.exp_m1() / growth })
}

impl Radii {
    /// For the profile `value` of the optical radius, per unit of optical area. `None` when it is 0 everywhere.
    pub fn new(value: impl Fn(f64) -> f64) -> Option<Radii> {
        let f = |knot: usize| 2.0 * PI * radius(knot) * value(radius(knot));
        let mut last = f(0);
        if last == 0.0 {
            return None;
        }
        let (mut density, mut below) = (vec![last], vec![last * FIRST]);
        let mut total = last * FIRST;
        // The profile has its bulk near x = 1, and its end beyond.
        for knot in 1.. {
            let next = f(knot);
            let tail = next * radius(knot);
            if next == 0.0 {
                break;
            }
            total += last * radius(knot - 1) * mass((next / last).ln(), STEP).1;
            density.push(next);
            below.push(total);
            last = next;
            if radius(knot) > 1.0 && tail < BEYOND * total {
                break;
            }
        }
        total += last * radius(density.len() - 1);
        Some(Radii { density, below, total })
    }

    /// The optical radius for `u` in [0, 1).
    pub fn sample(&self, u: f64) -> f64 {
        let sought = u * self.total;
        let knot = self.below.partition_point(|below| *below <= sought);
        if knot == 0 {
            return FIRST * sought / self.below[0];
        }
        let x = radius(knot - 1);
        if knot == self.below.len() {
            let tail = self.density[knot - 1] * x;
            return x * tail / (self.total - sought);
        }
        let share = (sought - self.below[knot - 1]) / (self.density[knot - 1] * x);
        let (growth, _) = mass((self.density[knot] / self.density[knot - 1]).ln(), STEP);
        // ∫ f = share, solved for ln of the ratio to x.
        let along = if growth == 0.0 { share } else { STEP / growth * (share * growth / STEP).ln_1p() };
        x * along.exp()
    }

    /// The density of [`Radii::sample`] per unit of optical area.
    pub fn pdf(&self, x: f64) -> f64 {
        let density = match self.place(x) {
            Place::Head => self.density[0],
            Place::Between(knot, along) => {
                self.density[knot] * (self.density[knot + 1] / self.density[knot]).powf(along / STEP)
            }
            Place::Tail(ratio) => self.density[self.density.len() - 1] / ratio / ratio,
        };
        density / (2.0 * PI * x * self.total)
    }

    /// The share of [`Radii::sample`] within `x`.
    pub fn cdf(&self, x: f64) -> f64 {
        let below = match self.place(x) {
            Place::Head => self.density[0] * x,
            Place::Between(knot, along) => {
                let rise = (self.density[knot + 1] / self.density[knot]).ln() * along / STEP;
                self.below[knot] + self.density[knot] * radius(knot) * mass(rise, along).1
            }
            Place::Tail(ratio) => {
                let last = self.density.len() - 1;
                self.total - self.density[last] * radius(last) / ratio
            }
        };
        below / self.total
    }

    /// The profile itself at `x`, by a cubic through the logarithms at four knots; `None` beyond the table.
    pub fn value(&self, x: f64) -> Option<f64> {
        let steps = (x / FIRST).ln() / STEP;
        // The four knots around x: one more on either side of the two that it lies between.
        let first = (steps - 1.0).floor();
        if !(first >= 0.0 && first + 3.0 < self.density.len() as f64) {
            return None;
        }
        let knot = first as usize;
        let [a, b, c, d]: [f64; 4] = std::array::from_fn(|i| self.density[knot + i].ln());
        let t = steps - first;
        let (u, v, w) = (t - 1.0, t - 2.0, t - 3.0);
        let log = (d * t * u * v - a * u * v * w) / 6.0 + (b * t * v * w - c * t * u * w) / 2.0;
        Some(log.exp() / (2.0 * PI * x))
    }

    fn place(&self, x: f64) -> Place {
        let last = self.density.len() - 1;
        let steps = (x / FIRST).ln() / STEP;
        if steps < 0.0 {
            Place::Head
        } else if steps >= last as f64 {
            Place::Tail(x / radius(last))
        } else {
            Place::Between(steps as usize, (x / radius(steps as usize)).ln())
        }
    }
}

/// Where a radius stands in the table.
enum Place {
    Head,
    /// The knot below, and ln of the ratio to it.
    Between(usize, f64),
    /// The ratio to the last knot.
    Tail(f64),
}
