//! Time that may be unknown, in the eight bytes of one that is known.

use core::num::NonZeroU64;

/// Time, microseconds, or number of a window, or none. The largest 64-bit number counts as the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OptionalTime(Option<NonZeroU64>);

impl OptionalTime {
    /// No time.
    pub const NONE: Self = Self(None);

    /// Time, if there is one.
    #[inline]
    pub fn get(self) -> Option<u64> {
        self.0.map(|inverse| !inverse.get())
    }

    /// Stores a time and returns the one before.
    #[inline]
    pub fn replace(&mut self, time: u64) -> Option<u64> {
        let before = self.get();
        self.0 = Some(NonZeroU64::new(!time).unwrap_or(NonZeroU64::MIN));
        before
    }

    /// Returns the time; stores this one first if there is none.
    #[inline]
    pub fn get_or_insert(&mut self, time: u64) -> u64 {
        self.get().unwrap_or_else(|| {
            self.replace(time);
            time
        })
    }
}

#[cfg(test)]
mod tests {
    use super::OptionalTime;

    #[test]
    fn a_time_is_kept_and_the_largest_is_cut_by_one() {
        let mut kept = OptionalTime::NONE;
        assert_eq!(kept.get(), None);
        for time in [0, 1, u64::MAX - 1] {
            kept.replace(time);
            assert_eq!(kept.get(), Some(time));
        }
        assert_eq!(kept.replace(u64::MAX), Some(u64::MAX - 1));
        assert_eq!(kept.get(), Some(u64::MAX - 1));
    }
}
