//! How long pictures take, and how many of their pixels are drawn while things move.

use crate::store::{Finished, Origin};
use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

/// A picture that takes no longer than this feels as if it hung on the mouse.
const FLUENT: f64 = 1.0 / 25.0;
/// After so much quiet the picture is drawn in full.
const QUIET: Duration = Duration::from_millis(200);
/// Shares of a side; few, so that textures come back from the pool.
const SHARES: [f64; 4] = [1.0, 0.7, 0.5, 0.25];

/// Which share of a side's pixels is drawn.
#[derive(Default)]
pub struct Pace {
    /// What a picture takes with all its pixels, seconds.
    full: f64,
    moved: Option<Instant>,
}

impl Pace {
    /// Something moves.
    pub fn moved(&mut self, now: Instant) {
        self.moved = Some(now);
    }

    /// Pictures are made in another way from now on. Until the first one is there, the slow way counts as the slowest.
    pub fn start_anew(&mut self, slow: bool) {
        self.full = if slow { f64::INFINITY } else { 0.0 };
    }

    /// When the picture is to be drawn in full, if it is not by now.
    pub fn rest(&self, now: Instant) -> Option<Instant> {
        self.moved.map(|moved| moved + QUIET).filter(|rest| *rest > now)
    }

    pub fn share(&self, now: Instant) -> f64 {
        if self.rest(now).is_none() {
            return 1.0;
        }
        let fits = |share: &&f64| self.full * *share * *share <= FLUENT;
        *SHARES.iter().find(fits).unwrap_or(&SHARES[SHARES.len() - 1])
    }

    /// What a picture with this share of its pixels took.
    pub fn took(&mut self, time: Duration, share: f64) {
        self.full = time.as_secs_f64() / (share * share);
    }
}

/// How many of the last pictures are counted.
const COUNTED: usize = 64;

/// What each pass took in the last pictures, by its name, milliseconds.
#[derive(Default)]
pub struct Times(BTreeMap<&'static str, VecDeque<f64>>);

impl Times {
    /// Steps of one name in one picture count as one.
    pub fn note(&mut self, finished: &[Finished]) {
        let mut sums: BTreeMap<&'static str, f64> = BTreeMap::new();
        for step in finished.iter().filter(|step| step.origin == Origin::Ran) {
            *sums.entry(step.name).or_default() += 1e3 * step.time.as_secs_f64();
        }
        for (name, sum) in sums {
            let times = self.0.entry(name).or_default();
            times.push_back(sum);
            while times.len() > COUNTED {
                times.pop_front();
            }
        }
    }

    /// Name, median and 95th percentile, by name.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, f64, f64)> {
        self.0.iter().map(|(name, times)| {
            let mut sorted: Vec<f64> = times.iter().copied().collect();
            sorted.sort_by(f64::total_cmp);
            (*name, percentile(&sorted, 0.5), percentile(&sorted, 0.95))
        })
    }
}

/// The smallest value that so large a share of the values does not exceed.
fn percentile(sorted: &[f64], share: f64) -> f64 {
    let place = (share * sorted.len() as f64).ceil() as usize;
    sorted[place.clamp(1, sorted.len()) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::Key;

    #[test]
    fn slow_pictures_shrink_while_something_moves_and_are_whole_at_rest() {
        let now = Instant::now();
        let mut pace = Pace::default();
        pace.took(Duration::from_millis(100), 1.0);
        assert_eq!(pace.share(now), 1.0);
        pace.moved(now);
        assert_eq!((pace.share(now), pace.rest(now)), (0.5, Some(now + QUIET)));
        // What the smaller picture took says the same of the whole one.
        pace.took(Duration::from_millis(25), 0.5);
        assert_eq!(pace.share(now), 0.5);
        assert_eq!((pace.share(now + QUIET), pace.rest(now + QUIET)), (1.0, None));
        pace.took(Duration::from_millis(10), 0.5);
        assert_eq!(pace.share(now), 1.0);
        pace.took(Duration::from_secs(9), 1.0);
        assert_eq!(pace.share(now), 0.25);
        pace.start_anew(false);
        assert_eq!(pace.share(now), 1.0);
        pace.start_anew(true);
        assert_eq!((pace.share(now), pace.share(now + QUIET)), (0.25, 1.0));
    }

    #[test]
    fn steps_of_one_name_are_added_up_and_old_pictures_leave() {
        let step = |name, ms, origin| Finished {
            name,
            about: String::new(),
            key: Key::of(name),
            origin,
            time: Duration::from_millis(ms),
        };
        let mut times = Times::default();
        times.note(&[step("old", 900, Origin::Ran), step("read", 900, Origin::Disk)]);
        for i in 1..=COUNTED as u64 {
            times.note(&[step("a", i, Origin::Ran), step("a", i, Origin::Ran), step("old", 1, Origin::Ran)]);
        }
        let rows: Vec<_> = times.rows().collect();
        assert_eq!(rows, [("a", 64.0, 122.0), ("old", 1.0, 1.0)]);
        assert_eq!(percentile(&[3.0], 0.95), 3.0);
    }
}
