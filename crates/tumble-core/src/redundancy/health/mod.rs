//! The health of one unit, at all times: late, frozen, at the end of its range, not finite, with spikes, contradicted
//! by the others, implausible at rest, with a clock of its own.
//!
//! * One bad reading excludes nobody. Time with bad readings is counted, and drains slowly while readings are good.
//! * A sensor is frozen when all its axes repeat their readings bit by bit for a time. One axis may repeat by chance:
//!   quantised and at rest, an axis says the same for as long as its noise stays within a count. It is stuck when it
//!   repeats over 32 readings at which another axis of the sensor moved by more than counts and noise at rest. The
//!   eight-unit recording of our data (16 bits, 62.5 Hz) repeats up to seven times on an axis at rest.
//! * Where readings change by less than a count, all axes may repeat for long: what repeats has to outlast chance, at the resolution
//!   and the usual change that the sensor has shown. While the platform rests, as other readings show, nobody is frozen.
//! * A range ends where readings repeat at their largest ever, whatever the data sheet states.
//! * A unit gives its readings twice if it did not always do so: many are read oftener than they measure.
//! * A spike leaves by more than a limit, and by more than five times what readings usually change, and is back with
//!   the next reading. What does not come back was no spike but motion.
//! * A unit is healthy again when nothing has been wrong for a while. Only a later rest clears what a rest has shown.

mod fault;
mod watch;

pub use fault::{FaultFigures, HealthFault};
pub use watch::Surroundings;

use crate::real::{Real, seconds};
use crate::redundancy::health::watch::{Followed, Reading, SensorWatch};
use crate::redundancy::leaky::Lapse;
use crate::redundancy::platform::Range;
use crate::redundancy::selection::Condition;
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::settings::HealthSettings;
use crate::sample::Sample;

/// Whether accelerometer and gyroscope of a sample may be used in a mean.
pub type Usable = [bool; 2];

/// Time without a sample, as a multiple of the usual one, that a slow unit may take whatever the setting says.
const INTERVALS: u64 = 3;

/// Readings in a row, but for few, that show that a unit gives each once.
const SHOWN_ONCE: u8 = 128;

/// A reading that was given twice among these takes back so many.
const TAKEN_BACK: u8 = 4;

/// Readings given twice, beyond those given once, that are too many for a unit that gave each once.
const TOO_MANY: u8 = 32;

/// Twice the readings that have to be those of another unit until one is its copy.
const COPIED: u8 = 64;

/// What refutes a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefutedBy {
    /// A rest beside a valid primary; a later one may clear it.
    Rest,
    /// A fit beyond anything that a calibration may be; only one that is adopted clears it.
    Fit,
}

/// What is known of a unit's presence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Presence {
    /// Nothing.
    Unknown,
    /// It is waited for.
    Awaited,
    /// It sends samples.
    Seen,
}

/// Windows of a rest until it shows as one.
const WINDOWS_OF_REST: u32 = 4;

/// Health of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health<T: Real> {
    /// Of the latest sample, or when waiting for the first began.
    time: u64,
    /// Usual time from one sample to the next, microseconds.
    interval: u32,
    /// Time over which samples were worse than nothing, up to the latest, 256 microseconds.
    mute: u16,
    /// When it became healthy, or when something was wrong last.
    since: u64,
    watches: [SensorWatch<T>; 2],
    fault: Option<HealthFault<T>>,
    implausible: [bool; 2],
    contradicted: [bool; 2],
    refuted: [[bool; 2]; 2],
    presence: Presence,
    surroundings: Surroundings,
    /// Time by which a rest shows later than over windows of the settings, microseconds.
    shown_late: u32,
    /// Readings given once, up to [`SHOWN_ONCE`]; then it is known that each is.
    once: u8,
    /// Of a unit of which that is known, readings given twice.
    twice: u8,
    /// Readings that were those of another unit, less those that were not.
    copied: u8,
}

impl<T: Real> Default for Health<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Health<T> {
    /// Nothing known of the unit: it is neither healthy nor at fault until a sample comes, or is late.
    pub fn new() -> Self {
        Self {
            time: 0,
            interval: 0,
            mute: 1,
            since: 0,
            watches: [SensorWatch::new(); 2],
            fault: None,
            implausible: [false; 2],
            contradicted: [false; 2],
            refuted: [[false; 2]; 2],
            presence: Presence::Unknown,
            surroundings: Surroundings::Unknown,
            shown_late: 0,
            once: 0,
            twice: 0,
            copied: 0,
        }
    }

    /// What is wrong with the unit, or was until lately.
    pub fn fault(&self) -> Option<HealthFault<T>> {
        self.fault
    }

    /// Whether nothing is wrong with it, as far as is known.
    pub fn is_sound(&self) -> bool {
        self.fault.is_none()
    }

    /// What could still be used of it at the time `now`, microseconds, where it is not healthy.
    pub fn condition(&self, now: u64, settings: &HealthSettings<T>) -> Condition {
        let spoke = self.time.saturating_sub(Lapse::of_ticks(self.mute));
        if self.presence != Presence::Seen || now > spoke.saturating_add(self.patience(settings)) {
            return Condition::Silent;
        }
        if !self.speaks() {
            return Condition::Useless;
        }
        if self.refuted != [[false; 2]; 2] {
            return Condition::Refuted;
        }
        self.fault.map_or(Condition::Doubtful, |fault| fault.condition())
    }

    /// Whether the latest sample is better than nothing: numbers, of which not all repeat.
    pub fn speaks(&self) -> bool {
        self.mute == 0
    }

    /// No unit said anything up to this time, microseconds: the platform's samples stalled, and no unit is late for it.
    pub fn platform_stalled(&mut self, now: u64) {
        if self.presence == Presence::Seen && self.is_sound() {
            self.time = now;
            self.watches.iter_mut().for_each(SensorWatch::forget);
        }
    }

    /// No unit said anything for so long, microseconds, beyond what is usual: no unit is the later for it.
    pub fn excuse(&mut self, pause: u64) {
        self.time = self.time.saturating_add(pause);
    }

    /// Takes in of which other unit a reading is too, if of any, as both change.
    #[inline]
    pub fn compare(&mut self, of: Option<usize>) {
        match of {
            None => self.copied = self.copied.saturating_sub(1),
            Some(other) => self.is_copied(other),
        }
    }

    #[cold]
    fn is_copied(&mut self, other: usize) {
        self.copied = self.copied.saturating_add(2).min(2 * COPIED);
        if self.copied >= COPIED {
            let of = u32::try_from(other)
                .ok()
                .and_then(|other| 1_u8.checked_shl(other));
            self.exclude(HealthFault::Copy { of: of.unwrap_or(0) }, self.time);
        }
    }

    /// A sample of it was held back that is of this time, microseconds, and believed only now.
    pub fn held_back(&mut self, time: u64) {
        if self.presence == Presence::Seen {
            self.time = self.time.max(time);
        }
    }

    /// Takes in what the latest window showed of the platform, and by how much windows are longer than those of the settings,
    /// microseconds: a rest shows as much later, over each window that it takes.
    pub fn set_surroundings(&mut self, surroundings: Surroundings, longer: u32) {
        self.surroundings = surroundings;
        self.shown_late = longer.saturating_mul(WINDOWS_OF_REST);
    }

    /// Longest time without a sample, microseconds. One that was never heard may be a slow one.
    pub fn patience(&self, settings: &HealthSettings<T>) -> u64 {
        let interval = match self.presence {
            Presence::Seen => u64::from(self.interval),
            Presence::Unknown | Presence::Awaited => settings.late,
        };
        settings.late.max(interval.saturating_mul(INTERVALS))
    }

    /// Takes in how far its samples are apart, microseconds.
    pub fn expect_every(&mut self, interval: u32) {
        self.interval = interval;
    }

    /// Since when the unit has been healthy, microseconds; `None` while it is not.
    pub fn healthy_since(&self) -> Option<u64> {
        let healthy = self.is_sound() && self.presence == Presence::Seen;
        healthy.then_some(self.since)
    }

    /// Takes in the next sample, later than the one before and zero on axes that the unit does not have, and says what of it
    /// may be used.
    pub fn push(
        &mut self,
        sample: &Sample<T>,
        axes: &Axes,
        range: &Range<T>,
        settings: &HealthSettings<T>,
    ) -> Usable {
        let now = sample.time;
        self.arrive(now, settings);
        let lapse = Lapse::between(self.time, now);
        self.time = now;
        let (mut usable, mut speaks) = ([false; 2], true);
        let mut followed = [None; 2];
        let surroundings = self.surroundings();
        for sensor in SENSORS {
            let (triad, stated) = match sensor {
                Sensor::Accelerometer => (&sample.specific_force, range.specific_force),
                Sensor::Gyroscope => (&sample.angular_rate, range.angular_rate),
            };
            let watch = sensor.of_mut(&mut self.watches);
            let judgement = watch.push(&Reading {
                sensor,
                values: (*triad).into(),
                axes: axes.of(sensor),
                end: watch.end(stated),
                lapse,
                surroundings,
                shown_late: self.shown_late,
                settings,
            });
            *sensor.of_mut(&mut followed) = judgement.followed;
            *sensor.of_mut(&mut usable) = judgement.usable;
            speaks &= judgement.speaks;
            match &judgement.fault {
                Some(fault) => self.exclude(*fault, now),
                None if judgement.lasts && self.fault.is_some() => self.since = now,
                None => {}
            }
        }
        self.mute = if speaks {
            0
        } else {
            self.mute.saturating_add(lapse.whole.max(1))
        };
        self.count_given(followed, now);
        self.settle(now, settings);
        usable
    }

    /// Says what time it is, microseconds, whether samples came or not.
    pub fn tick(&mut self, now: u64, settings: &HealthSettings<T>) {
        if self.presence == Presence::Unknown {
            self.presence = Presence::Awaited;
            self.time = now;
        }
        self.find_late(now, settings);
    }

    /// Takes in that a sensor was found wrong beside the other units; it stays so until it is cleared.
    pub fn contradict(&mut self, sensor: Sensor, fault: HealthFault<T>) {
        *sensor.of_mut(&mut self.contradicted) = true;
        self.exclude(fault, self.time);
    }

    /// What it was found wrong for is gone.
    pub fn clear(&mut self, sensor: Sensor) {
        if core::mem::replace(sensor.of_mut(&mut self.contradicted), false) {
            self.since = self.since.max(self.time);
        }
    }

    /// A calibration against the primary was adopted: nothing of what was found before holds.
    pub fn calibrated(&mut self, sensor: Sensor) {
        self.clear(sensor);
        for refuted in &mut self.refuted {
            *sensor.of_mut(refuted) = false;
        }
    }

    /// Takes in how far a sensor is from a valid primary at rest, m/s^2 or rad/s, and how far anything that calibration can
    /// find could bring it.
    pub fn refute(&mut self, sensor: Sensor, by: RefutedBy, deviation: T, limit: T) {
        let possible = deviation <= limit;
        let [at_rest, by_fit] = &mut self.refuted;
        let refuted = match by {
            RefutedBy::Rest => at_rest,
            RefutedBy::Fit => by_fit,
        };
        let refuted = core::mem::replace(sensor.of_mut(refuted), !possible);
        // That physics contradicts it says more.
        let known = refuted || *sensor.of(&self.implausible);
        if !possible && !known {
            self.exclude(
                HealthFault::Refuted {
                    sensor,
                    deviation,
                    limit,
                },
                self.time,
            );
        }
    }

    /// Whether a calibration may mend what is wrong with it, if anything is.
    pub fn may_be_calibrated(&self) -> bool {
        let mendable = self.fault.as_ref().is_none_or(HealthFault::may_be_mended);
        mendable && self.presence == Presence::Seen
    }

    /// Takes in how far a sensor at rest deviates from gravity, m/s^2, or from zero, rad/s, and how far it may: one that
    /// was never calibrated farther than others.
    pub fn at_rest(&mut self, sensor: Sensor, deviation: T, limit: T) {
        // What is no number is no plausible one.
        let plausible = deviation <= limit;
        *sensor.of_mut(&mut self.implausible) = !plausible;
        if !plausible {
            self.exclude(
                HealthFault::ImplausibleAtRest {
                    sensor,
                    deviation,
                    limit,
                },
                self.time,
            );
        }
    }

    /// Says that the unit's clock has left that of the others, at the time `now` of these, microseconds.
    pub fn clock_jumped(&mut self, now: u64) {
        self.mute = self.mute.max(1);
        self.exclude(HealthFault::ClockJumped, now);
    }

    /// The time of the whole set has jumped: what was counted goes on from the next sample.
    pub fn restart_time(&mut self, now: u64) {
        self.time = now;
        self.since = now;
        self.watches.iter_mut().for_each(SensorWatch::forget);
    }

    /// What is known of the platform. A unit of which nothing ever changed, where nobody says more, is not at rest but frozen.
    fn surroundings(&self) -> Surroundings {
        let never = self.watches.iter().all(SensorWatch::never_changed);
        match self.surroundings {
            Surroundings::Unknown if never => Surroundings::Motion,
            known => known,
        }
    }

    /// Counts readings that were given once and twice. A sensor that cannot tell says nothing of it.
    fn count_given(&mut self, followed: [Option<Followed>; 2], now: u64) {
        let twice = match followed {
            [None, None] => return,
            both => !both.contains(&Some(Followed::Once)),
        };
        if self.once < SHOWN_ONCE {
            self.once = if twice {
                self.once.saturating_sub(TAKEN_BACK)
            } else {
                self.once + 1
            };
            return;
        }
        self.twice = if twice {
            self.twice.saturating_add(1).min(2 * TOO_MANY)
        } else {
            self.twice.saturating_sub(1)
        };
        if self.twice >= TOO_MANY {
            self.exclude(HealthFault::Duplicated, now);
        }
    }

    fn arrive(&mut self, now: u64, settings: &HealthSettings<T>) {
        if self.presence == Presence::Seen {
            self.find_late(now, settings);
        } else {
            self.presence = Presence::Seen;
            self.time = now;
            self.since = now;
        }
    }

    #[inline]
    fn find_late(&mut self, now: u64, settings: &HealthSettings<T>) {
        if now > self.time.saturating_add(self.patience(settings)) {
            self.is_late(now - self.time, now);
        }
    }

    #[cold]
    #[inline(never)]
    fn is_late(&mut self, pause: u64, now: u64) {
        let pause = seconds(pause);
        self.exclude(HealthFault::Late { pause }, now);
        self.watches.iter_mut().for_each(SensorWatch::forget);
    }

    /// The latest finding is shown, except that what a rest has shown stays.
    fn exclude(&mut self, fault: HealthFault<T>, now: u64) {
        let at_rest = |fault: &HealthFault<T>| {
            matches!(
                fault,
                HealthFault::ImplausibleAtRest { .. } | HealthFault::Refuted { .. }
            )
        };
        self.since = if self.fault.is_some() {
            self.since.max(now)
        } else {
            now
        };
        let shown = self.implausible != [false; 2] || self.refuted != [[false; 2]; 2];
        let stays = shown && self.fault.as_ref().is_some_and(at_rest);
        if !stays || at_rest(&fault) {
            self.fault = Some(fault);
        }
    }

    /// Nothing was wrong for long enough.
    fn settle(&mut self, now: u64, settings: &HealthSettings<T>) {
        if self.is_sound() {
            return;
        }
        let gone = now.saturating_sub(self.since) >= settings.recovery;
        let stands =
            [self.implausible, self.contradicted] != [[false; 2]; 2] || self.refuted != [[false; 2]; 2];
        if gone && !stands {
            self.fault = None;
            self.since = now;
        }
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
