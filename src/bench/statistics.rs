//! Medians, quartiles, and which of many is worth its time.

use serde::Serialize;

/// The middle of some values and how far they lie apart: half of them lie between the quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quartiles {
    pub low: f64,
    pub median: f64,
    pub high: f64,
    pub count: usize,
}

impl Quartiles {
    /// Between two values lies what is proportionate. None of no values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Quartiles> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |share: f64| {
            let place = share * last as f64;
            let (below, above) = (values[place.floor() as usize], values[place.ceil() as usize]);
            // Equal ones as they are, so that infinities stay.
            if below == above { below } else { below + (above - below) * place.fract() }
        };
        Some(Quartiles { low: at(0.25), median: at(0.5), high: at(0.75), count: values.len() })
    }

    /// The distance of the quartiles.
    pub fn spread(&self) -> f64 {
        self.high - self.low
    }
}

/// The places of those points (time, error) of which no other is at least as good in both and better in one; from the
/// fastest to the most exact. Of equal points the first stands for all.
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let better = points[i].1 < least;
        least = least.min(points[i].1);
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_lie_where_they_should() {
        let of = |values: &[f64]| Quartiles::of(values.iter().copied()).map(|q| (q.low, q.median, q.high));
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[3.0]), Some((3.0, 3.0, 3.0)));
        assert_eq!(of(&[4.0, 1.0, 3.0, 2.0, 5.0]), Some((2.0, 3.0, 4.0)));
        assert_eq!(of(&[1.0, 2.0, 3.0, 4.0]), Some((1.75, 2.5, 3.25)));
        assert_eq!(of(&[f64::INFINITY; 2]).unwrap().1, f64::INFINITY);
        // One wild value moves neither.
        assert_eq!(of(&[1.0, 2.0, 3.0, 4.0, 1e9]), Some((2.0, 3.0, 4.0)));
        assert_eq!(Quartiles::of([1.0, 2.0, 3.0, 4.0, 5.0]).unwrap().spread(), 2.0);
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        assert_eq!(pareto_front(&[]), [0; 0]);
        // Fast and wrong, slow and right, beaten by the first, between them, as slow as the last and worse.
        let points = [(1.0, 9.0), (8.0, 1.0), (2.0, 9.5), (4.0, 3.0), (8.0, 2.0)];
        assert_eq!(pareto_front(&points), [0, 3, 1]);
        assert_eq!(pareto_front(&[(1.0, 1.0), (1.0, 1.0)]), [0]);
        // Equal error for more time is not worth it.
        assert_eq!(pareto_front(&[(2.0, 1.0), (1.0, 1.0)]), [1]);
    }
}
