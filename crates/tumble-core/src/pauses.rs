//! Samples that are missing: how many, what stands for them, and how uncertain that leaves an integral.
//!
//! Loggers and radio links drop samples. The mean of those that are left, times the time they were taken in, is the integral
//! of a channel only where it does not change; on a turn it does. Between the neighbours of a pause the channels are taken to
//! run straight (docs/theory/turntable.md, eq. 28 to 30). Stamps that merely come early or late are no pauses: what counts
//! is how many samples a block lacks.

use crate::moments::RunningSums;
use crate::real::{Real, count, real, seconds};
use crate::sample::CHANNELS;

/// Time from one sample to the next, as the blocks of a recording show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SampleInterval {
    /// Microseconds; zero before the first block.
    interval: u64,
    /// Microseconds by which the last block was too long for its samples.
    carried: i64,
}

impl SampleInterval {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self {
            interval: 0,
            carried: 0,
        }
    }

    /// Microseconds; zero before the first block.
    pub const fn microseconds(&self) -> u64 {
        self.interval
    }

    /// A time from one sample to the next above this hides a sample.
    pub const fn longest(&self) -> u64 {
        if self.interval == 0 {
            u64::MAX
        } else {
            self.interval + self.interval / 2
        }
    }

    /// Number of samples that a pause hides.
    fn hidden(&self, pause: u64) -> u64 {
        (pause + self.interval / 2)
            .checked_div(self.interval)
            .map_or(0, |steps| steps.saturating_sub(1))
    }

    /// Takes in a block of so many samples, in whose pauses so many seem to be hidden, and returns whether it lacks
    /// any.
    ///
    /// Late stamps make up for each other; missing samples do not. The interval comes from the samples that are there and
    /// those that both the pauses and the length of the block show to be missing. Where nearly every step is a pause, the
    /// rate is another.
    fn lacks_samples(&mut self, duration: u64, samples: u32, pauses: u32, hidden: u64) -> bool {
        let another_rate = pauses > samples / 4 * 3;
        let samples = i64::from(samples);
        let (known, duration) = (signed(self.interval), signed(duration));
        if known == 0 {
            self.interval = (duration / samples.max(1)).cast_unsigned();
            return false;
        }
        let owed = duration
            .saturating_sub(samples.saturating_mul(known))
            .saturating_add(self.carried);
        let lacking = owed.saturating_add(known / 2).div_euclid(known);
        self.carried = owed.saturating_sub(lacking.saturating_mul(known));
        let missing = if another_rate {
            0
        } else {
            lacking.clamp(0, signed(hidden))
        };
        self.interval = (duration / (samples + missing).max(1)).cast_unsigned();
        missing > 0
    }
}

/// A span of microseconds that differences can be taken of.
fn signed(span: u64) -> i64 {
    i64::try_from(span).unwrap_or(i64::MAX)
}

/// Missing samples of a segment, and the uncertainty of their interpolation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interpolation<T: Real> {
    /// Samples missing.
    pub missing: u32,
    /// The white noise of the integrals is that of a time longer by this, s.
    pub longer: T,
    /// Variance of the angle because the angular rate did not run straight, rad^2.
    pub variance: [T; 3],
}

impl<T: Real> Interpolation<T> {
    /// Nothing is missing.
    pub fn none() -> Self {
        Self {
            missing: 0,
            longer: T::zero(),
            variance: [T::zero(); 3],
        }
    }

    /// Adds that of the segment that follows.
    pub(crate) fn append(&mut self, next: &Self) {
        self.missing = self.missing.saturating_add(next.missing);
        self.longer += next.longer;
        for (sum, more) in self.variance.iter_mut().zip(next.variance) {
            *sum += more;
        }
    }
}

/// The pauses within one block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pauses<T: Real> {
    /// Pauses that were bridged.
    number: u32,
    /// Samples hidden in them.
    hidden: u64,
    /// Samples hidden in a pause too long for that.
    lost: u64,
    /// Hidden samples and half the squares of their numbers, pause by pause.
    weight: T,
    /// Fifth powers of the pauses, s^5.
    fifth_powers: T,
    bridged: Option<RunningSums<T, CHANNELS>>,
}

/// One end of a pause: s after the first sample of the block, and the sample there.
pub(crate) type PauseEnd<'a, T> = (T, &'a [T; CHANNELS]);

impl<T: Real> Pauses<T> {
    /// A block without any.
    pub fn none() -> Self {
        Self {
            number: 0,
            hidden: 0,
            lost: 0,
            weight: T::zero(),
            fifth_powers: T::zero(),
            bridged: None,
        }
    }

    /// Takes in a pause that is too long to interpolate.
    pub fn leave_open(&mut self, pause: u64, interval: &SampleInterval) {
        self.lost += interval.hidden(pause);
    }

    /// Takes in a pause between two samples; `sums` are those of the block so far.
    pub fn bridge(
        &mut self,
        pause: u64,
        interval: &SampleInterval,
        sums: &RunningSums<T, CHANNELS>,
        ends: (PauseEnd<'_, T>, PauseEnd<'_, T>),
    ) {
        let hidden = interval.hidden(pause);
        #[allow(clippy::cast_possible_truncation)]
        let samples = hidden.min(u64::from(u32::MAX)) as u32;
        self.number += 1;
        self.hidden += hidden;
        let m = count::<T>(samples);
        self.weight += m + m * m * real(0.5); // eq. 29
        let length = seconds::<T>(pause);
        self.fifth_powers += length * length * length * length * length; // eq. 30
        self.bridged
            .get_or_insert_with(|| sums.emptied())
            .push_line(samples, ends.0, ends.1);
    }

    /// Sums of the block with what stands for its missing samples, and the interpolation, but for the variance, which
    /// the next block shows. `duration` is that of the samples, without a pause after them that is left open.
    pub fn close(
        &self,
        sums: &RunningSums<T, CHANNELS>,
        duration: u64,
        interval: &mut SampleInterval,
    ) -> (RunningSums<T, CHANNELS>, Interpolation<T>) {
        let lacks = interval.lacks_samples(duration, sums.samples(), self.number, self.hidden);
        let bridged = self.bridged.filter(|_| lacks);
        let missing = self.lost + if lacks { self.hidden } else { 0 };
        let interpolation = Interpolation {
            missing: u32::try_from(missing).unwrap_or(u32::MAX),
            longer: bridged.map_or(T::zero(), |_| self.weight * seconds(interval.microseconds())), // eq. 29
            variance: [T::zero(); 3],
        };
        (
            bridged.map_or(*sums, |bridged| sums.with(&bridged)),
            interpolation,
        )
    }

    /// Fifth powers of the pauses, s^5.
    pub fn fifth_powers(&self) -> T {
        self.fifth_powers
    }
}

/// Curvature of the angular rate from block to block: the second difference of their means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bends<T: Real> {
    before: Option<[T; 3]>,
    last: Option<[T; 3]>,
    /// Share of the last block: fifth powers of its pauses over 54 times the cube of its length, s^2.
    share: T,
}

/// Mean square of the error that a corner in the rate leaves in a pause, over what it shows in the second difference.
const CORNER: f64 = 1.0 / 54.0;

impl<T: Real> Bends<T> {
    /// Nothing seen yet.
    pub fn new() -> Self {
        Self {
            before: None,
            last: None,
            share: T::zero(),
        }
    }

    /// Takes in the next block: its mean angular rate, its length and the fifth powers of its pauses. Gives the variance
    /// that the pauses of the block before leave on the angle.
    pub fn push(&mut self, rate: [T; 3], duration: T, fifth_powers: T) -> [T; 3] {
        let variance = match (self.before, self.last) {
            (Some(before), Some(last)) => core::array::from_fn(|i| {
                let bend = rate[i] - last[i] * real(2.0) + before[i];
                self.share * bend * bend // eq. 30
            }),
            _ => [T::zero(); 3],
        };
        *self = Self {
            before: self.last,
            last: Some(rate),
            share: fifth_powers * real(CORNER) / (duration * duration * duration), // eq. 30
        };
        variance
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn blocks_show_their_interval_and_the_samples_that_they_lack(
            interval in 500_u64..50_000,
            samples in 20_u32..400,
            lacking in 1_u64..10,
        ) {
            let mut shown = SampleInterval::new();
            let whole = u64::from(samples) * interval;
            for _ in 0..3 {
                prop_assert!(!shown.lacks_samples(whole, samples, 0, 0));
                prop_assert_eq!(shown.microseconds(), interval);
            }
            prop_assert_eq!(shown.hidden((lacking + 1) * interval), lacking);
            prop_assert!(shown.longest() > interval && shown.longest() < 2 * interval);
            prop_assert!(shown.lacks_samples(whole + lacking * interval, samples, 1, lacking));
            prop_assert_eq!(shown.microseconds(), interval);
            // A late stamp is made up for by the next block.
            let late = interval / 4;
            prop_assert!(!shown.lacks_samples(whole + late, samples, 0, 0));
            prop_assert!(!shown.lacks_samples(whole - late, samples, 0, 0));
        }
    }
}
