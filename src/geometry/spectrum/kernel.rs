//! Filters as functions of the angular frequency omega on a surface.

use serde::{Deserialize, Serialize};

/// A weight for every frequency. Lengths are in the unit that omega is the inverse of: mm and rad/mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Kernel {
    /// exp(-(omega width)² / 2)
    Gaussian { width: f64 },
    /// exp(-omega width)
    Exponential { width: f64 },
    /// exp(-omega² time)
    Diffusion { time: f64 },
    /// 1 below 2 pi / wavelength, else 0.
    Box { wavelength: f64 },
    /// (1 + (omega / sigma_tr)²)^(-3/2): on a plane, the transform of exp(-sigma_tr r) [Patro2007, eq. 3].
    Medium { sigma_tr: f64 },
    /// Straight lines between (omega, weight); constant before the first and after the last.
    Curve { points: Vec<(f64, f64)> },
    /// A Gaussian in omega / omega_m of standard deviation `std`, omega_m being the mesh's: ten of its mean edges are one
    /// wavelength [Patro2007, section 3.2].
    Normalized { std: f64 },
}

/// A curve that falls faster than this by a factor e in omega is no smooth one: a Gaussian's most is 0.74.
const STEEPEST: f64 = 1.0;

impl Kernel {
    /// The weight of `omega` on a mesh whose omega_m is known.
    pub fn at(&self, omega: f64, omega_m: f64) -> f64 {
        match self {
            Kernel::Gaussian { width } => (-0.5 * (omega * width).powi(2)).exp(),
            Kernel::Exponential { width } => (-omega * width).exp(),
            Kernel::Diffusion { time } => (-omega * omega * time).exp(),
            Kernel::Box { wavelength } => (omega * wavelength < std::f64::consts::TAU) as u32 as f64,
            Kernel::Medium { sigma_tr } => (1.0 + (omega / sigma_tr).powi(2)).powf(-1.5),
            Kernel::Curve { points } => line(points, omega),
            Kernel::Normalized { std } => (-0.5 * (omega / (std * omega_m)).powi(2)).exp(),
        }
    }

    /// Its mean over a range of frequencies [Patro2007, eq. 11].
    pub fn mean(&self, from: f64, to: f64, omega_m: f64) -> f64 {
        const SLICES: usize = 1024;
        if to <= from {
            return self.at(to, omega_m);
        }
        let at = |i: usize| self.at(from + (to - from) * (i as f64 + 0.5) / SLICES as f64, omega_m);
        (0..SLICES).map(at).sum::<f64>() / SLICES as f64
    }

    /// The frequency around which it falls, of the same unit as omega. None: it is a share of the mesh's omega_m.
    pub fn knee(&self) -> Option<f64> {
        Some(match self {
            Kernel::Gaussian { width } | Kernel::Exponential { width } => 1.0 / width,
            Kernel::Diffusion { time } => (2.0 * time).sqrt().recip(),
            Kernel::Box { wavelength } => std::f64::consts::TAU / wavelength,
            Kernel::Medium { sigma_tr } => *sigma_tr,
            Kernel::Curve { points } => curve_knee(points),
            Kernel::Normalized { .. } => return None,
        })
    }

    /// The same per mean edge, for a share of omega_m.
    pub fn knee_per_edge(&self) -> f64 {
        match self {
            Kernel::Normalized { std } => std * super::OMEGA_M,
            _ => super::OMEGA_M,
        }
    }

    /// Where it has ended: frequencies beyond have less than a thousandth of the first one's weight. None: nowhere, or
    /// where the mesh says.
    pub fn end(&self) -> Option<f64> {
        const LITTLE: f64 = 1e-3;
        match self {
            Kernel::Box { wavelength } => Some(std::f64::consts::TAU / wavelength),
            Kernel::Curve { points } => {
                let (last, weight) = *points.last()?;
                (weight == 0.0).then_some(last)
            }
            kernel => {
                let knee = kernel.knee()?;
                (0..5).map(|i| knee * 2f64.powi(i)).find(|omega| kernel.at(*omega, 1.0) < LITTLE)
            }
        }
    }

    /// Whether every frequency keeps its whole weight.
    pub fn is_identity(&self) -> bool {
        match self {
            Kernel::Gaussian { width } | Kernel::Exponential { width } => *width == 0.0,
            Kernel::Diffusion { time } => *time == 0.0,
            Kernel::Curve { points } => points.iter().all(|(_, weight)| *weight == 1.0),
            _ => false,
        }
    }

    /// Whether it changes so slowly with the frequency that few rational functions are as good as it.
    pub fn is_smooth(&self) -> bool {
        match self {
            Kernel::Box { .. } => false,
            Kernel::Curve { points } => points.windows(2).all(|pair| {
                let ((from, a), (to, b)) = (pair[0], pair[1]);
                // The change per factor of e is largest where the line ends.
                (b - a).abs() * to <= STEEPEST * (to - from)
            }),
            _ => true,
        }
    }
}

fn line(points: &[(f64, f64)], omega: f64) -> f64 {
    let after = points.partition_point(|(at, _)| *at <= omega);
    match (after.checked_sub(1).map(|before| points[before]), points.get(after)) {
        (Some((from, a)), Some(&(to, b))) => a + (b - a) * (omega - from) / (to - from),
        (Some((_, last)), None) => last,
        (None, Some(&(_, first))) => first,
        (None, None) => 1.0,
    }
}

/// Where a curve has half of its farthest way from its first weight behind it.
fn curve_knee(points: &[(f64, f64)]) -> f64 {
    let first = points.first().map_or(1.0, |(_, weight)| *weight);
    let far = points.iter().map(|(_, weight)| (weight - first).abs()).fold(0.0, f64::max);
    for pair in points.windows(2) {
        let ((from, a), (to, b)) = (pair[0], pair[1]);
        let (a, b) = ((a - first).abs(), (b - first).abs());
        if b >= 0.5 * far && far > 0.0 {
            return from + (to - from) * ((0.5 * far - a) / (b - a)).clamp(0.0, 1.0);
        }
    }
    points.last().map_or(1.0, |(omega, _)| *omega).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_lines_and_their_knees_and_means_what_they_should() {
        let curve = Kernel::Curve { points: vec![(1.0, 1.0), (3.0, 0.0), (4.0, 0.5)] };
        for (omega, weight) in [(0.0, 1.0), (1.0, 1.0), (2.0, 0.5), (3.5, 0.25), (9.0, 0.5)] {
            assert!((curve.at(omega, 1.0) - weight).abs() < 1e-15);
        }
        assert!((curve.knee().unwrap() - 2.0).abs() < 1e-12);
        assert!((curve.mean(1.0, 3.0, 1.0) - 0.5).abs() < 1e-9);
        assert_eq!(Kernel::Box { wavelength: 2.0 }.at(3.2, 1.0), 0.0);
        assert_eq!(Kernel::Box { wavelength: 2.0 }.at(3.1, 1.0), 1.0);
    }

    #[test]
    fn what_is_smooth_is_told_from_what_is_not() {
        let falls = |from: f64, to: f64| Kernel::Curve { points: vec![(from, 1.0), (to, 0.0)] };
        assert!(falls(0.0, 4.0).is_smooth() && !falls(3.0, 4.0).is_smooth());
        assert!(!Kernel::Box { wavelength: 1.0 }.is_smooth() && Kernel::Gaussian { width: 1.0 }.is_smooth());
    }
}
