//! Means of diffuse reflectance profiles over disks: what a piece of surface of some area sends to a point, whatever the
//! area [Maisch2020, eqs. 5, 10, 11].
//!
//! A disk of radius a, whose middle lies at the distance r from where light leaves, contains of each circle of radius x
//! around that place an arc of the angle 2 theta. With lo = |r - a| and hi = r + a,
//!
//! ```text
//! pi a² mean(r, a) = ∫_lo^hi 2 x theta(x) R_d(x) dx  (+ 2 pi ∫_0^lo x R_d(x) dx where the disk holds the place itself)
//! ```
//!
//! x R_d is finite at 0, where R_d is not, so the mean is finite for every area.
//!
//! The table's axes are rho = sqrt(r² + a²) and s = (r - a)/rho. Along rho a profile is nearly a power times an exponential,
//! which a straight line between the logarithms at knots even in ln rho follows, if it is straight in rho. All that is
//! singular lies at r = a, which is s = 0 on every row, where knots crowd; and far away the mean falls as e^(-sigma_tr s
//! rho), which is straight in s. With [`STEP`] and [`COLUMNS`] that keeps the error below 1e-3 of the mean up to the radius
//! that holds all but a millionth of a channel's light; over r and a themselves it takes ten times the knots. An arc's angle
//! depends on r/rho and a/rho only, and knots of rho are powers: one quadrature rule serves a whole column, and one list of
//! x² R_d all of them.

use super::Profile;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Means over disks of three profiles, lengths in their unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiskMeans {
    /// ln rho of the first row.
    pub first: f64,
    /// Rows of 2 [`COLUMNS`] + 1 values: ln of the mean per channel; the fourth number is 0.
    pub logs: Vec<[f32; 4]>,
    /// Per channel the radius that holds all but [`BEYOND`] of the light.
    pub reach: [f64; 3],
}

/// ln of the ratio of neighbouring rho.
pub const STEP: f64 = 0.04;
/// Columns on either side of s = 0.
pub const COLUMNS: usize = 144;
/// Column c of them stands at s = sin(pi c / (2 COLUMNS)) to this power.
pub const CROWDING: f64 = 2.5;
/// The share of a profile's light that its reach leaves out.
pub const BEYOND: f64 = 0.002;

/// Nodes of the rule along an arc: good to 2e-5.
const NODES: usize = 24;
/// Knots of the profiles per row.
const FINE: usize = 4;
/// Below this share of rho x R_d is taken to be constant.
const SMALLEST: f64 = 1e-4;
/// Fine knots below the first row.
const BELOW: usize = 930;
/// What stands for the logarithm of nothing.
const NOTHING: f64 = -200.0;

/// One column: a mean is the sum of weight · list[row + place …] over its terms.
struct Column {
    /// Of x² R_d.
    arcs: Vec<Term>,
    /// Of the light within x, where the disk holds the place itself.
    whole: Option<Term>,
}

/// Four neighbours in a list of fine knots.
struct Term {
    place: isize,
    weights: [f64; 4],
}

impl Term {
    /// `weight` times a list at `x`, for the row at rho = 1: a cubic through four knots.
    fn new(x: f64, weight: f64) -> Term {
        let steps = x.max(SMALLEST).ln() / (STEP / FINE as f64);
        let (low, t) = (steps.floor(), steps - steps.floor());
        let cubic = [
            -t * (t - 1.0) * (t - 2.0) / 6.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * t * (t - 1.0) / 6.0,
        ];
        Term { place: low as isize - 1, weights: cubic.map(|c| c * weight * (x / SMALLEST).min(1.0)) }
    }

    fn of(&self, list: &[f64], row: usize) -> f64 {
        let first = (BELOW + row * FINE).wrapping_add_signed(self.place);
        list[first..first + 4].iter().zip(self.weights).map(|(value, weight)| value * weight).sum()
    }
}

/// s of a column from -COLUMNS to COLUMNS.
fn ratio(column: isize) -> f64 {
    let s = (0.5 * PI * column.unsigned_abs() as f64 / COLUMNS as f64).sin().powf(CROWDING);
    s.copysign(column as f64)
}

impl Column {
    fn new(s: f64) -> Column {
        // r² + a² = 1 and r - a = s.
        let sum = (2.0 - s * s).sqrt();
        let (r, a) = (0.5 * (sum + s), 0.5 * (sum - s));
        if s >= 1.0 {
            // A point: R_d itself.
            return Column { arcs: vec![Term::new(1.0, 1.0)], whole: None };
        }
        let area = PI * a * a;
        let lo = s.abs();
        let width = if s < 0.0 { 2.0 * r } else { 2.0 * a };
        let arcs = (0..NODES)
            .map(|i| {
                // Nodes crowd as the fourth power at the inner end, where arcs open within |r - a|.
                let v = (i as f64 + 0.5) / NODES as f64;
                let (w, slope) = (v.powi(4) * (5.0 - 4.0 * v), 20.0 * v.powi(3) * (1.0 - v));
                let x = lo + width * w;
                // x - r without the cancellation of a small disk.
                let beyond = if s < 0.0 { lo - r + width * w } else { width * w - a };
                let squared = (a - beyond) * (a + beyond) / ((x + r - a) * (x + r + a));
                let theta = 2.0 * squared.max(0.0).sqrt().atan();
                Term::new(x, 2.0 * theta / x * width * slope / NODES as f64 / area)
            })
            .collect();
        Column { arcs, whole: (s < 0.0).then(|| Term::new(lo, 1.0 / area)) }
    }
}

impl DiskMeans {
    /// Of three profiles. Their unit should be about a mean free path: rows begin at 2e-4 of it. Below and beyond the rows a
    /// mean goes on as the power of rho that it has there.
    pub fn new(profiles: &[Profile; 3]) -> DiskMeans {
        let first = 2e-4f64.ln();
        let radius = |share: f64| profiles.each_ref().map(|profile| profile.sample(1.0 - share).unwrap_or(0.0));
        let last = radius(1e-7).into_iter().fold(10.0, f64::max).min(1e14).ln();
        let rows = ((last - first) / STEP).ceil() as usize + 1;
        let step = STEP / FINE as f64;
        let lists: Vec<(Vec<f64>, Vec<f64>)> = profiles
            .par_iter()
            .map(|profile| {
                let x = |knot: usize| (first + (knot as f64 - BELOW as f64) * step).exp();
                // hi is at most sqrt(2) rho.
                let density: Vec<f64> = (0..BELOW + rows * FINE + 40)
                    .map(|knot| x(knot) * x(knot) * profile.r_d_tabulated(x(knot)))
                    .collect();
                let mut sum = 2.0 * PI * density[0];
                let mut within = vec![sum];
                for pair in density.windows(2) {
                    sum += PI * (pair[0] + pair[1]) * step;
                    within.push(sum);
                }
                (density, within)
            })
            .collect();
        let columns: Vec<Column> = (-(COLUMNS as isize)..=COLUMNS as isize).map(|c| Column::new(ratio(c))).collect();
        let row = |row: usize| {
            let squared = (2.0 * (first + row as f64 * STEP)).exp();
            let lists = &lists;
            columns.iter().map(move |column| {
                let log = |c: usize| {
                    let (density, within) = &lists[c];
                    let arcs: f64 = column.arcs.iter().map(|term| term.of(density, row)).sum();
                    let whole = column.whole.as_ref().map_or(0.0, |term| term.of(within, row));
                    ((arcs + whole) / squared).max(0.0).ln().max(NOTHING) as f32
                };
                [log(0), log(1), log(2), 0.0]
            })
        };
        let logs = (0..rows).into_par_iter().flat_map_iter(row).collect();
        DiskMeans { first, logs, reach: radius(BEYOND) }
    }

    pub fn rows(&self) -> usize {
        self.logs.len() / (2 * COLUMNS + 1)
    }

    /// The mean per channel, as `shaders/techniques/kernel.wgsl` reads it.
    pub fn mean(&self, r: f64, a: f64) -> [f64; 3] {
        let rho = r.hypot(a);
        let s = (r - a) / rho;
        let column = (COLUMNS as f64) * (1.0 + (s.abs().powf(1.0 / CROWDING).min(1.0).asin() / (0.5 * PI)).copysign(s));
        let left = (column.floor() as usize).min(2 * COLUMNS - 1);
        let across = column - left as f64;
        let steps = (rho.ln() - self.first) / STEP;
        let below = steps.floor().clamp(0.0, self.rows() as f64 - 2.0);
        let t = steps - below;
        let along = if (0.0..=1.0).contains(&t) { (t * STEP).exp_m1() / STEP.exp_m1() } else { t };
        std::array::from_fn(|c| {
            let at = |row: usize, column: usize| self.logs[row * (2 * COLUMNS + 1) + column][c] as f64;
            let row = |row: usize| at(row, left) + across * (at(row, left + 1) - at(row, left));
            let (low, high) = (row(below as usize), row(below as usize + 1));
            (low + along * (high - low)).exp()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::phase::Phase;
    use crate::optics::profile::{Channel, Model};
    use crate::optics::quadrature::{gauss_legendre, integrate};

    fn profiles(model: Model, albedos: [f64; 3]) -> [Profile; 3] {
        albedos.map(|albedo| {
            let channel = Channel { sigma_a: 1.0 - albedo, sigma_s: albedo, g: 0.0, phase: Phase::HenyeyGreenstein };
            Profile::new(model, channel, 1.33)
        })
    }

    /// The mean by polar coordinates around the place where light leaves: exact R_d, rings and arcs.
    fn brute(profile: &Profile, r: f64, a: f64) -> f64 {
        let rule = gauss_legendre(48, 0.0, 1.0);
        // Rings between two radii, in pieces that double from either end.
        let rings = |lo: f64, hi: f64, share: &dyn Fn(f64) -> f64| -> f64 {
            let pieces = 30;
            let cut = |k: i32| if k == 0 { 0.0 } else { 0.5f64.powi(pieces - k) };
            (0..pieces)
                .map(|k| {
                    let (from, to) = (0.5 * cut(k), 0.5 * cut(k + 1));
                    integrate(&rule, |u| {
                        let w = from + u * (to - from);
                        let x = |w: f64| lo + (hi - lo) * w;
                        let ring = |x: f64| 2.0 * x * share(x) * profile.r_d_tabulated(x);
                        (to - from) * (hi - lo) * (ring(x(w)) + ring(x(1.0 - w)))
                    })
                })
                .sum()
        };
        let theta = |x: f64| ((x * x + r * r - a * a) / (2.0 * r * x)).clamp(-1.0, 1.0).acos();
        let arcs = rings((r - a).abs(), r + a, &theta);
        let whole = if a > r { rings(0.0, a - r, &|_| PI) } else { 0.0 };
        (arcs + whole) / (PI * a * a)
    }

    #[test]
    fn means_are_those_of_brute_force_everywhere_in_the_table() {
        for model in Model::ALL {
            let profiles = profiles(model, [0.5, 0.9, 0.999]);
            let means = DiskMeans::new(&profiles);
            let ends: Vec<f64> = profiles.iter().map(|profile| profile.sample(1.0 - 1e-6).unwrap()).collect();
            let mut worst: f64 = 0.0;
            for i in 0..400 {
                let spread = |k: f64| (i as f64 * k).fract();
                let rho = (3e-4f64.ln() + spread(0.618034) * (ends[2] / 3e-4).ln()).exp();
                let s = (spread(0.754878) * PI).cos();
                let sum = (2.0 - s * s).sqrt();
                let (r, a) = (rho * 0.5 * (sum + s), rho * 0.5 * (sum - s));
                let found = means.mean(r, a);
                for c in 0..3 {
                    if rho < ends[c] && a > 1e-3 * rho {
                        let error = (found[c] / brute(&profiles[c], r, a) - 1.0).abs();
                        assert!(error < 1e-3, "{model:?}, channel {c}, r {r}, a {a}: off by {error:.2e}");
                        worst = worst.max(error);
                    }
                }
            }
            assert!(worst > 1e-5, "nothing was compared");
        }
    }

    #[test]
    fn limits_are_right_and_a_far_disk_is_a_point() {
        let profiles = profiles(Model::PhotonBeamDiffusion, [0.5, 0.9, 0.99]);
        let means = DiskMeans::new(&profiles);
        for (c, profile) in profiles.iter().enumerate() {
            // A disk much wider than light goes gets all of it, a narrow one at a distance the profile there.
            for a in [200.0, 2000.0] {
                let all = means.mean(0.1, a)[c] * PI * a * a;
                assert!((all / profile.albedo() - 1.0).abs() < 5e-3, "channel {c}: {all}");
            }
            for r in [0.01, 0.7, 3.0] {
                assert!((means.mean(r, 1e-4 * r)[c] / profile.r_d(r) - 1.0).abs() < 1e-3);
            }
            // Below the table the mean grows as 1/rho.
            let fine = means.mean(0.0, 1e-6)[c] / means.mean(0.0, 1e-5)[c];
            assert!((fine / 10.0 - 1.0).abs() < 0.02, "{fine}");
            assert!((profile.cdf(means.reach[c]) - 0.998).abs() < 1e-4);
        }
        let black = Channel { sigma_a: 1.0, sigma_s: 0.0, g: 0.0, phase: Phase::HenyeyGreenstein };
        let [a, b, _] = profiles;
        let means = DiskMeans::new(&[a, b, Profile::new(Model::Dipole, black, 1.33)]);
        assert_eq!(means.mean(0.3, 0.2)[2] as f32, 0.0);
    }
}
