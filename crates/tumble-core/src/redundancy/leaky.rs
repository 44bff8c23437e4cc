//! Leaky counter of the time of a fault, in two bytes: it fills during the fault and drains afterwards.

use crate::real::{Real, count};

/// Microseconds in a tick: a power of two, so that times are converted without a division.
const TICK: u64 = 1 << TICK_BITS;
const TICK_BITS: u32 = 8;

/// Longest limit, microseconds: the counter goes up to twice a limit.
pub(super) const LONGEST: u64 = TICK * (u16::MAX as u64) / 2;

/// Converts a time to ticks.
pub(super) fn ticks(microseconds: u64) -> u16 {
    u16::try_from(microseconds / TICK).unwrap_or(u16::MAX).max(1)
}

/// Time from one sample to the next, in whole ticks, counted so that parts of ticks are not lost over many
/// samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lapse {
    /// Whole time.
    pub whole: u16,
    /// Quarter of the time.
    pub quarter: u16,
}

impl Lapse {
    /// Converts ticks to microseconds.
    pub fn of_ticks(ticks: u16) -> u64 {
        u64::from(ticks) * TICK
    }

    /// Time between two times, microseconds, less than six days apart; zero if it is negative.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss
    )]
    pub fn between(before: u64, now: u64) -> Self {
        // Counts of ticks in 32 bits wrap, their differences do not.
        let crossed = |bits: u32| {
            let ticks = ((now >> bits) as i32).wrapping_sub((before >> bits) as i32);
            ticks.clamp(0, u16::MAX.into()) as u16
        };
        Self {
            whole: crossed(TICK_BITS),
            quarter: crossed(TICK_BITS + 2),
        }
    }
}

/// Leaky counter, in ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Leaky(u16);

impl Leaky {
    /// Adds time of a fault; the counter goes up to twice the limit, so that a long fault does not end at once.
    /// A single step counts for a limited share of the limit: one bad sample excludes no unit, however rare
    /// samples are.
    pub fn fill(&mut self, by: u16, limit: u16, fewest: u16) {
        let most = (limit / fewest.max(1)).max(1);
        self.0 = self.0.saturating_add(by.min(most)).min(limit.saturating_mul(2));
    }

    /// Subtracts time without a fault.
    pub fn drain(&mut self, by: u16) {
        self.0 = self.0.saturating_sub(by);
    }

    /// Returns whether the counter is zero.
    pub fn is_empty(&self) -> bool {
        self.0 == 0
    }

    /// Resets the counter.
    pub fn empty(&mut self) {
        self.0 = 0;
    }

    /// Returns whether the counter has reached its limit.
    pub fn is_over(&self, limit: u16) -> bool {
        self.0 >= limit
    }

    /// Counted time, ticks.
    pub fn count(&self) -> u16 {
        self.0
    }

    /// Counted time, s.
    pub fn seconds<T: Real>(&self) -> T {
        count::<T>(self.0.into()) * crate::real::seconds(TICK)
    }
}
