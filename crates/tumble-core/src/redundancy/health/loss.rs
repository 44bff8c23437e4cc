//! Loss of samples of one unit: its mean interval beside its usual one.

use crate::real::{Real, count, real};
use crate::redundancy::components::{larger, smaller};

/// Time over which lost samples are averaged, s: that of one model of a set (docs/theory/set.md, section 7).
const OVER: f64 = 2.0;

/// Time over which the usual interval is learnt in health, s.
const USUAL_OVER: f64 = 60.0;

/// Largest share of samples that may be missing.
const MOST: f64 = 0.4;

/// Means of the sample interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SampleLoss<T: Real> {
    /// Mean interval of late, and the usual one, s.
    recent: T,
    usual: T,
    samples: u16,
}

impl<T: Real> SampleLoss<T> {
    /// Creates means without any interval.
    pub fn unknown() -> Self {
        Self {
            recent: T::zero(),
            usual: T::zero(),
            samples: 0,
        }
    }

    /// Adds an interval, s; the usual one is learnt while the unit `is_sound`. Returns the share of samples that are
    /// missing and its limit, if it is too large.
    pub fn push(&mut self, interval: T, is_sound: bool) -> Option<(T, T)> {
        self.samples = self.samples.saturating_add(1);
        let samples = count::<T>(self.samples.into());
        // Each sample counts alike: some units send their samples in bursts.
        let share = |mean: T, over: f64| larger(T::one() / samples, smaller(T::one(), mean / real(over)));
        self.recent += (interval - self.recent) * share(self.recent, OVER);
        if is_sound {
            self.usual += (interval - self.usual) * share(self.usual, USUAL_OVER);
        }
        let most = real::<T>(MOST);
        let lasts = self.usual * samples > real(OVER + OVER);
        let is_lossy = lasts && self.usual < self.recent * (T::one() - most);
        is_lossy.then(|| (T::one() - self.usual / self.recent, most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::redundancy::draws::Draw;

    /// Time from 60 s on after which samples are missing, s, where each is lost with a probability from then on.
    fn lossy_after(
        draw: &mut Draw,
        lost: f64,
        mut until_next: impl FnMut(&mut Draw, u32) -> f64,
    ) -> Option<f64> {
        let (mut loss, mut now, mut before) = (SampleLoss::unknown(), 0.0, 0.0);
        for k in 0.. {
            now += until_next(draw, k);
            if now > 120.0 {
                break;
            }
            if now > 60.0 && draw.uniform() < lost {
                continue;
            }
            if loss.push(now - before, true).is_some() {
                return Some(now - 60.0);
            }
            before = now;
        }
        None
    }

    #[test]
    fn a_unit_that_loses_most_samples_is_lossy_and_no_other() {
        for seed in 0..40 {
            let mut draw = Draw(seed);
            let interval = 0.001 + 0.02 * draw.uniform();
            let after = lossy_after(&mut draw, 0.6, |_, _| interval);
            assert!(
                after.is_some_and(|after| (0.5..10.0).contains(&after)),
                "seed {seed}: {after:?}"
            );
            assert_eq!(lossy_after(&mut draw, 0.1, |_, _| interval), None, "seed {seed}");
            let jittered = lossy_after(&mut draw, 0.0, |draw, _| interval * (0.2 + 1.6 * draw.uniform()));
            assert_eq!(jittered, None, "seed {seed}");
            let in_bursts = |_: &mut Draw, k: u32| {
                if k % 10 == 9 {
                    interval * 9.1
                } else {
                    interval * 0.1
                }
            };
            assert_eq!(lossy_after(&mut draw, 0.0, in_bursts), None, "seed {seed}");
        }
    }
}
