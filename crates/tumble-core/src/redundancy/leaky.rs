//! A count of time that fills while something is wrong and drains while it is not, in two bytes.

use crate::real::{Real, count};

/// Microseconds in a tick: a power of two, so that times are counted in it without a division.
const TICK: u64 = 1 << TICK_BITS;
const TICK_BITS: u32 = 8;

/// Longest time that can be a limit, microseconds: what is kept goes to twice a limit.
pub(super) const LONGEST: u64 = TICK * (u16::MAX as u64) / 2;

/// A length of time in ticks.
pub(super) fn ticks(microseconds: u64) -> u16 {
    u16::try_from(microseconds / TICK).unwrap_or(u16::MAX).max(1)
}

/// The time from one sample to the next, in ticks of its own, so that parts of ticks are not lost over many samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lapse {
    /// All of it.
    pub whole: u16,
    /// A quarter of it.
    pub quarter: u16,
}

impl Lapse {
    /// So many ticks, microseconds.
    pub fn of_ticks(ticks: u16) -> u64 {
        u64::from(ticks) * TICK
    }

    /// Between two times, microseconds, less than six days apart; none back.
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

/// Time, in ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Leaky(u16);

impl Leaky {
    /// Goes on being wrong; up to twice the limit is kept, so that what went wrong for long is not well at once. A
    /// single step counts as no more than a share of the limit: one bad sample excludes nobody, however rare samples
    /// are.
    pub fn fill(&mut self, by: u16, limit: u16, fewest: u16) {
        let most = (limit / fewest.max(1)).max(1);
        self.0 = self.0.saturating_add(by.min(most)).min(limit.saturating_mul(2));
    }

    /// Was well for a time.
    pub fn drain(&mut self, by: u16) {
        self.0 = self.0.saturating_sub(by);
    }

    /// Whether nothing is counted.
    pub fn is_empty(&self) -> bool {
        self.0 == 0
    }

    /// Begins anew.
    pub fn empty(&mut self) {
        self.0 = 0;
    }

    /// Whether it has been wrong for too long.
    pub fn is_over(&self, limit: u16) -> bool {
        self.0 >= limit
    }

    /// Length of time, s.
    pub fn seconds<T: Real>(&self) -> T {
        count::<T>(self.0.into()) * crate::real::seconds(TICK)
    }
}
