//! Common time of the set, from the time stamps of its units, none of which is trusted alone.
//!
//! The samples of a unit must get later, and stay near those of the others. A single distant time stamp is
//! dropped: it is more likely corrupted than true, and would make the others look late. When the units that
//! agree on another time outnumber those that keep the old one, or when no unit keeps it any more, the time of
//! the set jumps there.

/// Extends 32-bit counters of microseconds, which wrap after 71.6 minutes, to 64 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unwrapper {
    latest: Option<u64>,
}

impl Unwrapper {
    /// Creates an unwrapper without a counter.
    pub fn new() -> Self {
        Self::default()
    }

    /// Extends a counter: returns the time nearest to the latest one that has these low 32 bits. Counters may
    /// come out of order, also about the wrap.
    pub fn extend(&mut self, counter: u32) -> u64 {
        let Some(latest) = self.latest else {
            self.latest = Some(counter.into());
            return counter.into();
        };
        #[allow(clippy::cast_possible_truncation)]
        let low = latest as u32;
        let ahead = counter.wrapping_sub(low).cast_signed();
        let time = latest.saturating_add_signed(ahead.into());
        self.latest = Some(latest.max(time));
        time
    }
}

/// Limits of accepting time stamps and of following a distant one; times in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockSettings {
    /// Distance from the time of the set above which a time stamp is not accepted at once; if it is later, the
    /// set has jumped.
    pub largest_jump: u64,
    /// Lead over the set above which a time stamp is not accepted at once, unless it is below twice the sample
    /// interval: the others would look late. If it is accepted later, there was a pause.
    pub largest_step: u64,
    /// Time for which a unit must keep to another time, while no unit keeps to the old one, to be followed
    /// alone.
    pub lone_proof: u64,
    /// Number of successive samples that make a unit persistent.
    pub persistent: u8,
}

impl ClockSettings {
    /// Default settings.
    pub const DEFAULT: Self = Self {
        largest_jump: 1_000_000,
        largest_step: 50_000,
        lone_proof: 250_000,
        persistent: 5,
    };
}

impl Default for ClockSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Decision on a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimestampDecision {
    /// The sample is used.
    Accept,
    /// The sample is dropped: it is not later than the one before, or too far away.
    Drop,
    /// The sample is dropped, and the clock of the unit is faulty: it keeps leaving that of the others, or
    /// stands.
    Astray,
    /// The sample is used, and means restart: the time of the whole set has jumped.
    Jumped {
        /// Jump, microseconds, negative if back.
        by: i64,
    },
}

/// State of the time stamps of one unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct UnitTimestamps {
    /// Latest accepted time; zero before any.
    accepted: u64,
    /// Latest of the times that agree with each other but not with the set.
    suspect: u64,
    /// Interval of accepted samples, microseconds.
    interval: u32,
    /// Time over which the suspects agreed while no other unit was accepted.
    undisputed: u32,
    /// Number of successive suspects that agree; zero if the last sample was no suspect.
    agreeing: u8,
    /// Successive dropped samples.
    dropped: u8,
    /// True if another unit was accepted while these were dropped.
    disputed: bool,
    /// True if another unit was accepted since the latest sample.
    received_others: bool,
    /// True if any sample was accepted.
    is_known: bool,
}

impl UnitTimestamps {
    /// Creates the state after an accepted sample.
    fn since(accepted: u64, interval: u32) -> Self {
        Self {
            accepted,
            interval,
            is_known: true,
            ..Self::default()
        }
    }

    /// Latest accepted time.
    fn latest(&self) -> Option<u64> {
        self.is_known.then_some(self.accepted)
    }

    fn suspect(&mut self, time: u64, settings: &ClockSettings) {
        let step = time.saturating_sub(self.suspect);
        let agrees = self.agreeing > 0 && time > self.suspect && step <= settings.largest_jump;
        let step = u32::try_from(step).unwrap_or(u32::MAX);
        // Samples of other units since the previous suspect dispute the time up to now.
        let undisputed = if core::mem::take(&mut self.received_others) {
            0
        } else {
            step
        };
        if agrees {
            self.agreeing = self.agreeing.saturating_add(1);
            self.undisputed = self.undisputed.saturating_add(undisputed);
        } else {
            (self.agreeing, self.undisputed) = (1, 0);
        }
        self.suspect = time;
    }

    /// Returns whether a time is so far after that of the set that samples seem to be missing.
    fn leaps(&self, time: u64, now: u64, settings: &ClockSettings) -> bool {
        time > now && {
            let interval = u64::from(self.shown_interval(time));
            time - now > settings.largest_step.max(2 * interval)
        }
    }

    /// Sample interval; before the first one is known, the time from the previous suspect to this sample.
    /// Otherwise a slow unit whose samples fall between those of others would be accepted by chance only.
    fn shown_interval(&self, time: u64) -> u32 {
        if self.interval > 0 || self.agreeing == 0 {
            return self.interval;
        }
        u32::try_from(time.saturating_sub(self.suspect)).unwrap_or(u32::MAX)
    }

    /// Accepts a sample. The interval at most doubles, or a single pause would allow any leap.
    fn accept(&mut self, time: u64) {
        let passed = self.latest().map_or(0, |latest| time.saturating_sub(latest));
        let passed = u32::try_from(passed).unwrap_or(u32::MAX);
        let interval = match (self.interval, self.dropped) {
            (0, 0) => passed,
            (before, 0) => passed.min(before.saturating_mul(2)),
            (0, _) => self.shown_interval(time),
            (before, _) => before,
        };
        *self = Self::since(time, interval);
    }

    /// Sample interval after suspects are accepted. If they do not show it, the interval before the pause
    /// remains. A slow unit whose first interval looked like a pause would otherwise never get one, and lose
    /// every other sample.
    fn followed_interval(&self, pause: bool) -> u32 {
        let steps = u32::from(self.agreeing).saturating_sub(1);
        let shown = self.undisputed / steps.max(1);
        if shown > 0 || !pause {
            return shown;
        }
        if self.interval > 0 {
            return self.interval;
        }
        let passed = self
            .latest()
            .map_or(0, |latest| self.suspect.saturating_sub(latest));
        u32::try_from(passed).unwrap_or(u32::MAX)
    }

    /// Returns whether the unit keeps to the time of the set.
    fn keeps(&self, now: u64, settings: &ClockSettings) -> bool {
        let is_near = |latest: u64| latest.abs_diff(now) <= settings.largest_jump;
        self.agreeing == 0 && self.latest().is_some_and(is_near)
    }

    /// Records that another unit keeps to the time of the set.
    fn dispute(&mut self) {
        self.undisputed = 0;
        self.received_others = true;
        self.disputed |= self.dropped > 0;
    }
}

/// Common clock of a set of units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommonClock<const UNITS: usize> {
    now: Option<u64>,
    tracks: [UnitTimestamps; UNITS],
}

impl<const UNITS: usize> Default for CommonClock<UNITS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const UNITS: usize> CommonClock<UNITS> {
    /// Creates a clock that the first sample sets.
    pub fn new() -> Self {
        Self {
            now: None,
            tracks: [UnitTimestamps::default(); UNITS],
        }
    }

    /// Latest accepted time, microseconds; `None` before the first sample.
    pub fn now(&self) -> Option<u64> {
        self.now
    }

    /// Sample interval of a unit, microseconds; zero before the second sample.
    pub fn interval(&self, unit: usize) -> u32 {
        self.tracks.get(unit).map_or(0, |track| track.interval)
    }

    /// Time of the latest accepted sample of a unit, microseconds.
    pub fn latest(&self, unit: usize) -> Option<u64> {
        self.tracks.get(unit)?.latest()
    }

    /// Decides on the time stamp of the next sample of a unit, microseconds of the common clock.
    #[inline(never)]
    pub fn push(&mut self, unit: usize, time: u64, settings: &ClockSettings) -> TimestampDecision {
        let Some(track) = self.tracks.get_mut(unit) else {
            return TimestampDecision::Drop;
        };
        let now = *self.now.get_or_insert(time);
        let near = time.abs_diff(now) <= settings.largest_jump;
        let later = track.latest().is_none_or(|latest| time > latest);
        if near && later && !track.leaps(time, now, settings) {
            return self.accept(unit, time);
        }
        if near && track.latest() == Some(time) {
            track.agreeing = 0;
        } else {
            track.suspect(time, settings);
            if self.is_accepted(unit, time, settings) {
                return self.follow(time, settings);
            }
        }
        self.drop(unit, settings)
    }

    fn accept(&mut self, unit: usize, time: u64) -> TimestampDecision {
        for (other, track) in self.tracks.iter_mut().enumerate() {
            if other == unit {
                track.accept(time);
            } else {
                track.dispute();
            }
        }
        self.now = self.now.max(Some(time));
        TimestampDecision::Accept
    }

    fn drop(&mut self, unit: usize, settings: &ClockSettings) -> TimestampDecision {
        let Some(track) = self.tracks.get_mut(unit) else {
            return TimestampDecision::Drop;
        };
        track.dropped = track.dropped.saturating_add(1);
        let stands = track.agreeing == 0;
        if track.dropped >= settings.persistent && (stands || track.disputed) {
            TimestampDecision::Astray
        } else {
            TimestampDecision::Drop
        }
    }

    /// Returns whether the set follows the suspect time of a unit. After a pause a few samples suffice if no
    /// other unit was accepted in between, for longer than the gaps within a burst; much more time is needed if
    /// others kept to the old time. Old samples may arrive late, also of several units at once, so a jump back
    /// needs persistent agreement; two units that err ahead in the same way are too unlikely.
    fn is_accepted(&self, unit: usize, time: u64, settings: &ClockSettings) -> bool {
        let now = self.now.unwrap_or(time);
        let undisputed = self.tracks.get(unit).is_some_and(|track| !track.disputed);
        let alone = self.count(|track| track.is_known) <= 1;
        let (times, proof) = if undisputed && self.is_pause(time, settings) {
            (2, if alone { 1 } else { settings.largest_step })
        } else {
            (settings.persistent, settings.lone_proof)
        };
        let least = if time > now { 1 } else { settings.persistent.max(1) };
        let tolerance = self.tolerance(time, settings);
        let agreeing =
            self.count(|track| track.agreeing >= least && track.suspect.abs_diff(time) <= tolerance);
        let keepers = self.count(|track| track.keeps(now, settings));
        let proven = self
            .tracks
            .get(unit)
            .is_some_and(|track| track.agreeing >= times && u64::from(track.undisputed) >= proof);
        proven || (agreeing > 1 && agreeing > keepers)
    }

    /// Returns whether a time is ahead of the set by a pause, not a jump.
    fn is_pause(&self, time: u64, settings: &ClockSettings) -> bool {
        self.now
            .is_some_and(|now| time > now && time - now <= settings.largest_jump)
    }

    /// Largest difference from a suspect time at which other units agree with it.
    fn tolerance(&self, time: u64, settings: &ClockSettings) -> u64 {
        if self.is_pause(time, settings) {
            settings.largest_step
        } else {
            settings.largest_jump
        }
    }

    fn count(&self, is_one: impl Fn(&UnitTimestamps) -> bool) -> usize {
        self.tracks.iter().filter(|track| is_one(track)).count()
    }

    /// Moves the set to a new time. Units that agree keep it; the others restart, or they would take the set
    /// back.
    fn follow(&mut self, time: u64, settings: &ClockSettings) -> TimestampDecision {
        let (pause, tolerance) = (self.is_pause(time, settings), self.tolerance(time, settings));
        let before = self.now.replace(time).unwrap_or(time);
        for track in &mut self.tracks {
            if track.agreeing > 0 && track.suspect.abs_diff(time) <= tolerance {
                *track = UnitTimestamps::since(track.suspect, track.followed_interval(pause));
            } else if !pause {
                *track = UnitTimestamps::default();
            }
        }
        if pause {
            return TimestampDecision::Accept;
        }
        let by = i64::try_from(time.abs_diff(before)).unwrap_or(i64::MAX);
        TimestampDecision::Jumped {
            by: if time < before { -by } else { by },
        }
    }
}

#[cfg(test)]
#[path = "clock_tests.rs"]
mod tests;
