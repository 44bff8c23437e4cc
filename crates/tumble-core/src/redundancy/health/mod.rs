//! Health of one unit at all times: late, frozen, saturated, not finite, with spikes, contradicted by the
//! others, implausible at rest, with a clock that left that of the others.
//!
//! * One bad reading excludes no unit. Time with bad readings is counted, and drains slowly while readings are
//!   good.
//! * A sensor is frozen when all its axes repeat their readings bit by bit for a time. One axis may repeat by
//!   chance: quantised and at rest, it repeats while its noise stays within a count. It is stuck when it
//!   repeats over 32 readings at which another axis of the sensor moved by more than counts and noise at rest.
//!   The eight-unit recording of our data (16 bits, 62.5 Hz) repeats up to seven times on an axis at rest.
//! * Where readings change by less than a count, all axes may repeat for long. A repetition must then outlast
//!   chance, given the resolution and the usual change of the sensor. No sensor is frozen while the readings of
//!   other units show a rest.
//! * A range ends where readings repeat at their largest ever, whatever the data sheet states.
//! * A unit that repeats every reading is reported only if it did not do so from the start: many units are read
//!   faster than they measure.
//! * A spike exceeds a limit and five times the usual change, and ends with the next reading. A change that
//!   stays is motion.
//! * A unit is healthy again after a time without a fault. Only a later rest clears a fault that a rest has
//!   shown.

mod fault;
mod loss;
mod watch;

pub use fault::{FaultFigures, HealthFault};
pub use watch::Surroundings;

use crate::real::{Real, seconds};
use crate::redundancy::health::loss::SampleLoss;
use crate::redundancy::health::watch::{Context, Reading, SensorWatch};
use crate::redundancy::leaky::{Lapse, ticks};
use crate::redundancy::platform::Range;
use crate::redundancy::selection::Condition;
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::settings::HealthSettings;
use crate::sample::Sample;

/// Usability of accelerometer and gyroscope of a sample in a mean.
pub type Usable = [bool; 2];

/// Multiple of its usual interval for which a slow unit may send no sample, whatever the setting.
const INTERVALS: u64 = 3;

/// Successive readings, with few exceptions, that show that a unit sends each reading once.
const SHOWN_ONCE: u8 = 128;

/// Readings by which a repeated one among them reduces that count.
const TAKEN_BACK: u8 = 4;

/// Excess of repeated readings over new ones that is a fault of a unit that sent each reading once.
const TOO_MANY: u8 = 32;

/// Repetitions of one reading that count: one stall is none of a driver that goes on to repeat.
const ONE_STALL: u8 = 8;

/// Twice the number of readings equal to those of another unit that show a copy.
const COPIED: u8 = 64;

/// Origin of the evidence that refutes a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefutedBy {
    /// A rest beside a valid primary; a later rest may clear it.
    Rest,
    /// A fit beyond the errors that a calibration may have; only an adopted calibration clears it.
    Fit,
}

/// Presence of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Presence {
    /// No sample was received or expected.
    Unknown,
    /// A sample is expected.
    Awaited,
    /// Samples are received.
    Seen,
}

/// Windows of rest until a rest is detected.
const WINDOWS_OF_REST: u32 = 4;

/// Health of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health<T: Real> {
    /// Time of the latest sample, or of the beginning of the wait for the first.
    time: u64,
    /// Usual sample interval, microseconds.
    interval: u32,
    loss: SampleLoss<T>,
    /// Time over which samples were useless, up to the latest, 256 microseconds.
    mute: u16,
    /// Time at which the unit became healthy, or of the latest fault.
    since: u64,
    watches: [SensorWatch<T>; 2],
    fault: Option<HealthFault<T>>,
    implausible: [bool; 2],
    contradicted: [bool; 2],
    refuted: [[bool; 2]; 2],
    presence: Presence,
    surroundings: Surroundings,
    /// Additional delay of the detection of a rest if windows are longer than those of the settings,
    /// microseconds.
    shown_late: u32,
    /// Readings received once, up to [`SHOWN_ONCE`], which shows that each is sent once.
    once: u8,
    /// Excess of repetitions over new readings from such a unit.
    again: u8,
    /// Readings equal to those of another unit, minus those that were not.
    copied: u8,
}

/// Readings of a sensor of a unit beside those of a sensor at the end of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overload {
    /// The sensor gives no evidence: its unit is faulty, or none was received.
    Unknown,
    /// No reading was received since the other sensor reached its end.
    Awaited,
    /// The sensor is at the end of its range too.
    Shared,
    /// The sensor is within its range.
    Absent,
}

impl<T: Real> Default for Health<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Health<T> {
    /// Creates an unknown health: the unit is neither healthy nor faulty before a sample arrives or is late.
    pub fn new() -> Self {
        Self {
            time: 0,
            interval: 0,
            loss: SampleLoss::unknown(),
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
            again: 0,
            copied: 0,
        }
    }

    /// Current fault of the unit, or one of which it has not yet recovered.
    pub fn fault(&self) -> Option<HealthFault<T>> {
        self.fault
    }

    /// Returns whether no fault is known.
    pub fn is_sound(&self) -> bool {
        self.fault.is_none()
    }

    /// Remaining use of an unhealthy unit at the time `now`, microseconds.
    pub fn condition(&self, now: u64, settings: &HealthSettings<T>) -> Condition {
        let spoke = self.time.saturating_sub(Lapse::of_ticks(self.mute));
        if self.presence != Presence::Seen || now > spoke.saturating_add(self.patience(settings)) {
            return Condition::Silent;
        }
        if !self.is_live() {
            return Condition::Useless;
        }
        if self.refuted != [[false; 2]; 2] {
            return Condition::Refuted;
        }
        self.fault.map_or(Condition::Doubtful, |fault| fault.condition())
    }

    /// Returns whether the latest sample has finite values that do not all repeat.
    pub fn is_live(&self) -> bool {
        self.mute == 0
    }

    /// Marks that no unit sent a sample up to this time, microseconds: the samples of the platform stalled, and
    /// no unit is late for it.
    pub fn platform_stalled(&mut self, now: u64) {
        if self.presence == Presence::Seen && self.is_sound() {
            self.time = now;
            self.watches.iter_mut().for_each(SensorWatch::forget);
        }
    }

    /// Excludes a pause of all units beyond the usual interval, microseconds, from the lateness of the unit.
    pub fn excuse(&mut self, pause: u64) {
        self.time = self.time.saturating_add(pause);
    }

    /// Records the other unit, if any, that sent the same reading while both change.
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

    /// Time over which a sensor was at the end of its range, microseconds, lessened by the time since; zero if its
    /// readings are no numbers.
    #[inline]
    pub fn saturated_for(&self, sensor: Sensor) -> u64 {
        match self.fault {
            Some(HealthFault::NotFinite { .. }) => 0,
            _ => Lapse::of_ticks(sensor.of(&self.watches).useless_for()),
        }
    }

    /// Returns whether a sensor was at the end of its range for too long.
    pub fn is_saturated(&self, sensor: Sensor, settings: &HealthSettings<T>) -> bool {
        sensor.of(&self.watches).useless_for() >= ticks(settings.saturated)
    }

    /// Returns whether any sensor was at the end of its range lately, or is excused for it.
    #[inline]
    pub fn was_saturated(&self) -> bool {
        let was = |watch: &SensorWatch<T>| watch.is_overloaded() || watch.useless_for() > 0;
        self.watches.iter().any(was)
    }

    /// Compares the readings of a sensor with one that has been at the end of its range for a time up to `now`,
    /// microseconds.
    pub fn beside_saturated(&self, sensor: Sensor, now: u64, lasts: u64) -> Overload {
        if self.saturated_for(sensor) > 0 {
            Overload::Shared
        } else if self.presence != Presence::Seen || !self.is_sound() {
            Overload::Unknown
        } else if self.time.saturating_add(lasts / 4 * 3) < now {
            // The first reading at the end counts the time since the one before.
            Overload::Awaited
        } else {
            Overload::Absent
        }
    }

    /// Stores for which sensors saturation is no fault, because all units saturate.
    pub fn set_overloaded(&mut self, overloaded: [bool; 2]) {
        for (watch, overloaded) in self.watches.iter_mut().zip(overloaded) {
            watch.set_overloaded(overloaded);
        }
    }

    /// Records that a sample of this time, microseconds, was held back and is used only now.
    pub fn held_back(&mut self, time: u64) {
        if self.presence == Presence::Seen {
            self.time = self.time.max(time);
        }
    }

    /// Stores the state of the platform over the latest window, and the length of windows beyond that of the
    /// settings, microseconds; a rest is detected later by that, over each window that it takes.
    pub fn set_surroundings(&mut self, surroundings: Surroundings, longer: u32) {
        self.surroundings = surroundings;
        self.shown_late = longer.saturating_mul(WINDOWS_OF_REST);
    }

    /// Longest time without a sample, microseconds. A unit without any sample may be a slow one.
    pub fn patience(&self, settings: &HealthSettings<T>) -> u64 {
        let interval = match self.presence {
            Presence::Seen => u64::from(self.interval),
            Presence::Unknown | Presence::Awaited => settings.late,
        };
        settings.late.max(interval.saturating_mul(INTERVALS))
    }

    /// Stores the sample interval, microseconds.
    pub fn expect_every(&mut self, interval: u32) {
        self.interval = interval;
    }

    /// Time since which the unit has been healthy, microseconds; `None` while it is not.
    pub fn healthy_since(&self) -> Option<u64> {
        let healthy = self.is_sound() && self.presence == Presence::Seen;
        healthy.then_some(self.since)
    }

    /// Processes the next sample, later than the one before and zero on missing axes; returns the usability of
    /// each sensor.
    pub fn push(
        &mut self,
        sample: &Sample<T>,
        axes: &Axes,
        range: &Range<T>,
        settings: &HealthSettings<T>,
    ) -> Usable {
        let now = sample.time;
        self.arrive(now, settings);
        self.count_lost(now, settings);
        let lapse = Lapse::between(self.time, now);
        self.time = now;
        let (mut usable, mut is_live) = ([false; 2], true);
        let mut again = [None; 2];
        let context = Context {
            lapse,
            surroundings: self.surroundings(),
            shown_late: self.shown_late,
            settings,
        };
        for sensor in SENSORS {
            let (triad, stated) = match sensor {
                Sensor::Accelerometer => (&sample.specific_force, range.specific_force),
                Sensor::Gyroscope => (&sample.angular_rate, range.angular_rate),
            };
            let watch = sensor.of_mut(&mut self.watches);
            let check = watch.push(&Reading {
                sensor,
                values: (*triad).into(),
                axes: axes.of(sensor),
                end: watch.end(stated),
                context: &context,
            });
            *sensor.of_mut(&mut again) = check.again;
            *sensor.of_mut(&mut usable) = check.usable;
            is_live &= check.is_live;
            match &check.fault {
                Some(fault) => self.exclude(*fault, now),
                None if check.lasts && self.fault.is_some() => self.since = now,
                None => {}
            }
        }
        self.mute = if is_live {
            0
        } else {
            self.mute.saturating_add(lapse.whole.max(1))
        };
        self.count_given(again, now);
        self.settle(now, settings);
        usable
    }

    /// Advances the time, microseconds, whether samples arrived or not.
    pub fn tick(&mut self, now: u64, settings: &HealthSettings<T>) {
        if self.presence == Presence::Unknown {
            self.presence = Presence::Awaited;
            self.time = now;
        }
        self.find_late(now, settings);
    }

    /// Records that comparison with the other units found a sensor faulty, until it is cleared.
    pub fn contradict(&mut self, sensor: Sensor, fault: HealthFault<T>) {
        *sensor.of_mut(&mut self.contradicted) = true;
        self.exclude(fault, self.time);
    }

    /// Returns whether comparison with the other units found a sensor faulty.
    pub fn is_contradicted(&self, sensor: Sensor) -> bool {
        *sensor.of(&self.contradicted)
    }

    /// Clears a fault found by comparison with the other units.
    pub fn clear(&mut self, sensor: Sensor) {
        if core::mem::replace(sensor.of_mut(&mut self.contradicted), false) {
            self.since = self.since.max(self.time);
        }
    }

    /// Clears all faults of a sensor whose new calibration against the primary was adopted.
    pub fn calibrated(&mut self, sensor: Sensor) {
        self.clear(sensor);
        for refuted in &mut self.refuted {
            *sensor.of_mut(refuted) = false;
        }
    }

    /// Records the deviation of a sensor from a valid primary at rest, m/s^2 or rad/s, with the largest
    /// deviation that a calibration may explain.
    pub fn refute(&mut self, sensor: Sensor, by: RefutedBy, deviation: T, limit: T) {
        let possible = deviation <= limit;
        let [at_rest, by_fit] = &mut self.refuted;
        let refuted = match by {
            RefutedBy::Rest => at_rest,
            RefutedBy::Fit => by_fit,
        };
        let refuted = core::mem::replace(sensor.of_mut(refuted), !possible);
        // A contradiction to physics is the stronger fault and is kept.
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

    /// Returns whether a calibration may correct the fault, if there is one.
    pub fn may_be_calibrated(&self) -> bool {
        let correctable = self.fault.as_ref().is_none_or(HealthFault::may_be_corrected);
        correctable && self.presence == Presence::Seen
    }

    /// Records the deviation of a sensor at rest from gravity, m/s^2, or from zero, rad/s, with its limit,
    /// which is larger for an uncalibrated sensor.
    pub fn at_rest(&mut self, sensor: Sensor, deviation: T, limit: T) {
        // NaN is not plausible.
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

    /// Records that the clock of the unit left that of the others, at the time `now` of these, microseconds.
    pub fn clock_jumped(&mut self, now: u64) {
        self.mute = self.mute.max(1);
        self.exclude(HealthFault::ClockJumped, now);
    }

    /// Restarts the time of the unit after a jump of the time of the whole set.
    pub fn restart_time(&mut self, now: u64) {
        self.time = now;
        self.since = now;
        self.loss = SampleLoss::unknown();
        self.watches.iter_mut().for_each(SensorWatch::forget);
    }

    /// State of the platform. A unit whose readings never changed is frozen, not at rest, unless other units
    /// show a rest.
    fn surroundings(&self) -> Surroundings {
        let never = self.watches.iter().all(SensorWatch::never_changed);
        match self.surroundings {
            Surroundings::Unknown if never => Surroundings::Motion,
            known => known,
        }
    }

    /// Counts readings received once and more often. A sensor that cannot distinguish them counts neither.
    fn count_given(&mut self, again: [Option<u8>; 2], now: u64) {
        let repeated = match again {
            [None, None] => return,
            [Some(0), _] | [_, Some(0)] => 0,
            [one, other] => one.max(other).unwrap_or(0),
        };
        match repeated {
            0 if self.once < SHOWN_ONCE => self.once += 1,
            _ if self.once < SHOWN_ONCE => self.once = self.once.saturating_sub(TAKEN_BACK),
            0 => self.again = self.again.saturating_sub(1),
            _ => {
                self.again = self
                    .again
                    .saturating_add(repeated.min(ONE_STALL))
                    .min(2 * TOO_MANY)
            }
        }
        if self.again >= TOO_MANY {
            self.exclude(HealthFault::Duplicated, now);
        }
    }

    /// Counts samples that are missing since the one before; a pause in which the unit is late is none of these.
    #[inline(never)]
    fn count_lost(&mut self, now: u64, settings: &HealthSettings<T>) {
        let interval = now.saturating_sub(self.time);
        if interval == 0 || interval > self.patience(settings) {
            return;
        }
        if let Some((share, limit)) = self.loss.push(seconds(interval), self.is_sound()) {
            self.exclude(HealthFault::Lossy { share, limit }, now);
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
        let pause = now.saturating_sub(self.time);
        // Most samples end here: no unit is late earlier.
        if pause > settings.late && pause > self.patience(settings) {
            self.is_late(pause, now);
        }
    }

    #[cold]
    #[inline(never)]
    fn is_late(&mut self, pause: u64, now: u64) {
        let pause = seconds(pause);
        self.exclude(HealthFault::Late { pause }, now);
        self.watches.iter_mut().for_each(SensorWatch::forget);
    }

    /// Records the latest fault; a fault shown at rest stays.
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

    /// Ends the fault after a sufficient time without one.
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
