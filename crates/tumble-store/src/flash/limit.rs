//! Limit on the rate of writes to flash.

/// Limit on the wear of flash, by a token bucket. Writes are counted from when a store is made, so each reset allows
/// `at_once` more.
///
/// A bank of n entries, k of which stay when it is full, is erased once in n - k records, so that two banks good for E
/// erasures take 2 E (n - k) of them. With the defaults, two banks of 4 KiB (n = 21) good for 10 000 erasures last 5.7
/// years of nothing but writing for three sensors with two records each (k = 6), and 3.4 years for four with the
/// factory's beside them (k = 12).
///
/// The first record after a start takes a second slot (`docs/record-format.md`). With one record a start a bank is erased
/// once in (n - k + 1) / 2 starts, rounded up: with the same two banks, 160 000 starts for three sensors, 100 000 for four.
/// A start that writes nothing costs nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WriteLimit {
    /// Between two writes in the long run, in the microseconds of the caller's clock; 0 sets no limit.
    pub shortest_between: u64,
    /// Writes that may follow each other at once, since calibrations of several sensors end together; 0 counts as 1.
    pub at_once: u32,
}

impl Default for WriteLimit {
    fn default() -> Self {
        Self {
            shortest_between: 600_000_000,
            at_once: 16,
        }
    }
}

/// Recent writes: state of the token bucket, as the time at which it is full.
#[derive(Clone, Copy, Debug, Default)]
pub struct Writes {
    /// When as many as are allowed at once are allowed again.
    full_at: u64,
}

impl Writes {
    /// Counts a write, or returns the microseconds to wait for it.
    pub fn count(&mut self, limit: &WriteLimit, now: u64) -> Result<(), u64> {
        let between = limit.shortest_between;
        let longest = between.saturating_mul(u64::from(limit.at_once.max(1)));
        // A clock that was set back must not forbid writing for as long as it was set back.
        self.full_at = self.full_at.min(now.saturating_add(longest));
        let owed = self.full_at.saturating_sub(now);
        let wait = owed.saturating_sub(longest - between.min(longest));
        if wait > 0 {
            return Err(wait);
        }
        self.full_at = now.saturating_add(owed).saturating_add(between);
        Ok(())
    }
}
