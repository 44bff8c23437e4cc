//! One time for the whole set, from the time stamps of its units, none of which is trusted alone.
//!
//! A unit's samples have to get later, and stay near those of the others. One time stamp far away is dropped: it is
//! more likely corrupted than true, and would make the others look late. When the units that agree on another time
//! outnumber those that keep the old one, or when nobody keeps it any more, the time of the set jumps there.

/// Extends 32-bit counters of microseconds, which wrap after 71.6 minutes, to 64 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unwrapper {
    latest: Option<u64>,
}

impl Unwrapper {
    /// No counter seen yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The counter in full: that time nearest to the latest seen so far which has these low 32 bits. Counters may come
    /// out of order, also about the wrap.
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

/// When a time stamp is believed, and when the set follows one that is far away; lengths of time in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockSettings {
    /// A time stamp further from the time of the set is not believed at once, and when it is, the set has jumped.
    pub largest_jump: u64,
    /// A time stamp further ahead of the set, and by more than twice the interval of the unit's samples, is not believed
    /// at once, or the others would look late; when it is, there was a pause.
    pub largest_step: u64,
    /// How long a unit has to keep to another time, while no unit keeps to the old one, until it is believed alone.
    pub lone_proof: u64,
    /// How many successive samples make a unit persistent.
    pub persistent: u8,
}

impl ClockSettings {
    /// What holds where nobody says otherwise.
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

/// What is to be done with a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Use it.
    Accept,
    /// Do not: it is not later than the one before, or too far away to be believed.
    Drop,
    /// Do not, and the clock of this unit is at fault: it keeps leaving that of the others, or stands.
    Astray,
    /// Use it, and begin anew: the time of the whole set has jumped.
    Jumped {
        /// Microseconds, negative if back.
        by: i64,
    },
}

/// What is kept of the time stamps of one unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct UnitTimestamps {
    /// Latest that was accepted; zero before any.
    accepted: u64,
    /// Latest of those that agree with each other but not with the set.
    suspect: u64,
    /// From one accepted sample to the next, microseconds.
    interval: u32,
    /// Time over which these agreed while no other unit was accepted.
    undisputed: u32,
    /// How many of these agree in succession; zero if the last sample was no suspect.
    agreeing: u8,
    /// Samples dropped in succession.
    dropped: u8,
    /// Whether another unit was accepted while these were dropped.
    disputed: bool,
    /// Whether another unit was accepted since the latest sample.
    heard_others: bool,
    /// Whether any was accepted.
    is_known: bool,
}

impl UnitTimestamps {
    /// With this one accepted.
    fn since(accepted: u64, interval: u32) -> Self {
        Self {
            accepted,
            interval,
            is_known: true,
            ..Self::default()
        }
    }

    /// Latest that was accepted.
    fn latest(&self) -> Option<u64> {
        self.is_known.then_some(self.accepted)
    }

    fn suspect(&mut self, time: u64, settings: &ClockSettings) {
        let step = time.saturating_sub(self.suspect);
        let agrees = self.agreeing > 0 && time > self.suspect && step <= settings.largest_jump;
        let step = u32::try_from(step).unwrap_or(u32::MAX);
        // What was heard of others since the suspect before disputes the time up to now.
        let undisputed = if core::mem::take(&mut self.heard_others) {
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

    /// Whether a time is so far after that of the set that samples seem to be missing.
    fn leaps(&self, time: u64, now: u64, settings: &ClockSettings) -> bool {
        time > now && {
            let interval = u64::from(self.shown_interval(time));
            time - now > settings.largest_step.max(2 * interval)
        }
    }

    /// Interval of its samples; of one of which none is known yet, from the suspect before to this one: a slow unit whose samples
    /// fall between those of others would else be in time by chance only.
    fn shown_interval(&self, time: u64) -> u32 {
        if self.interval > 0 || self.agreeing == 0 {
            return self.interval;
        }
        u32::try_from(time.saturating_sub(self.suspect)).unwrap_or(u32::MAX)
    }

    /// A sample is used. Its interval is at most twice the one before, or a single pause would allow any leap.
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

    /// Interval of its samples once its suspects are believed. Where these do not show it, it is what it was before a pause;
    /// a slow unit whose first interval looked like one would else have none for ever, and lose every other sample.
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

    /// Whether it keeps to the time of the set.
    fn keeps(&self, now: u64, settings: &ClockSettings) -> bool {
        let is_near = |latest: u64| latest.abs_diff(now) <= settings.largest_jump;
        self.agreeing == 0 && self.latest().is_some_and(is_near)
    }

    /// Another unit keeps to the time of the set.
    fn dispute(&mut self) {
        self.undisputed = 0;
        self.heard_others = true;
        self.disputed |= self.dropped > 0;
    }
}

/// The common clock of a set of units.
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
    /// Not set: the first sample sets it.
    pub fn new() -> Self {
        Self {
            now: None,
            tracks: [UnitTimestamps::default(); UNITS],
        }
    }

    /// Latest time believed, microseconds; `None` before the first sample.
    pub fn now(&self) -> Option<u64> {
        self.now
    }

    /// From one sample of a unit to the next, microseconds; zero before the second.
    pub fn interval(&self, unit: usize) -> u32 {
        self.tracks.get(unit).map_or(0, |track| track.interval)
    }

    /// Time of the latest sample of a unit that was believed, microseconds.
    pub fn latest(&self, unit: usize) -> Option<u64> {
        self.tracks.get(unit)?.latest()
    }

    /// Judges the time stamp of a unit's next sample, microseconds of the common clock.
    #[inline(never)]
    pub fn push(&mut self, unit: usize, time: u64, settings: &ClockSettings) -> Verdict {
        let Some(track) = self.tracks.get_mut(unit) else {
            return Verdict::Drop;
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
            if self.is_believed(unit, time, settings) {
                return self.follow(time, settings);
            }
        }
        self.drop(unit, settings)
    }

    fn accept(&mut self, unit: usize, time: u64) -> Verdict {
        for (other, track) in self.tracks.iter_mut().enumerate() {
            if other == unit {
                track.accept(time);
            } else {
                track.dispute();
            }
        }
        self.now = self.now.max(Some(time));
        Verdict::Accept
    }

    fn drop(&mut self, unit: usize, settings: &ClockSettings) -> Verdict {
        let Some(track) = self.tracks.get_mut(unit) else {
            return Verdict::Drop;
        };
        track.dropped = track.dropped.saturating_add(1);
        let stands = track.agreeing == 0;
        if track.dropped >= settings.persistent && (stands || track.disputed) {
            Verdict::Astray
        } else {
            Verdict::Drop
        }
    }

    /// Whether the set follows the suspect time of a unit: after a pause its next samples will do if no other unit was heard
    /// in between, for longer than samples that come in bursts are apart, or much longer if others did once keep to the
    /// old time. Old samples may arrive late, and several units' at once, so that a time further back takes persistent
    /// agreement; that two units err ahead alike is too much of a chance.
    fn is_believed(&self, unit: usize, time: u64, settings: &ClockSettings) -> bool {
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

    /// Whether a time is ahead of the set, but by no jump.
    fn is_pause(&self, time: u64, settings: &ClockSettings) -> bool {
        self.now
            .is_some_and(|now| time > now && time - now <= settings.largest_jump)
    }

    /// Difference from a suspect time within which other units agree with it.
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

    /// Those that agree keep the new time from now on: those that do not would else take the set back.
    fn follow(&mut self, time: u64, settings: &ClockSettings) -> Verdict {
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
            return Verdict::Accept;
        }
        let by = i64::try_from(time.abs_diff(before)).unwrap_or(i64::MAX);
        Verdict::Jumped {
            by: if time < before { -by } else { by },
        }
    }
}

#[cfg(test)]
#[path = "clock_tests.rs"]
mod tests;
