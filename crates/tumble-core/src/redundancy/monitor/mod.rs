//! Monitor: receives samples of all units, keeps the set calibrated and its output available.

mod adopt;
mod aiding;
pub mod calibration;
mod evaluate;
pub mod event;
mod isolation;
mod majority;
mod physics;
mod process_window;
pub mod rest_state;
mod restore;
pub mod trial;

use nalgebra::Vector3;

use crate::real::{Real, SECOND, whole_spans};
use crate::redundancy::components::{difference, set_all};
use crate::redundancy::evaluation::{StoredCalibration, StoredCalibrations};
use crate::redundancy::health::{Health, HealthFault, Overload};
use crate::redundancy::isolation::FaultIsolator;
use crate::redundancy::model::monitor::SetMonitor;
use crate::redundancy::monitor::aiding::AidingChannel;
use crate::redundancy::monitor::calibration::CalibrationRun;
use crate::redundancy::monitor::event::{Abandoned, Event, EventKind};
use crate::redundancy::monitor::rest_state::RestState;
use crate::redundancy::optional_time::OptionalTime;
use crate::redundancy::output::{Compensated, LeverArmCorrection, Output, compensate, lever_arm};
use crate::redundancy::platform::Platform;
use crate::redundancy::samples::clock::{ClockSettings, CommonClock, TimestampDecision};
use crate::redundancy::samples::history::{RestMean, WindowHistory};
use crate::redundancy::samples::pair::products;
use crate::redundancy::samples::steps::UnitSteps;
use crate::redundancy::selection::{Condition, Selection, SourceCandidate};
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::settings::HealthSettings;
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::redundancy::unit_set::UnitSet;
use crate::sample::{CHANNELS, Sample};

/// Receiver of events.
pub type Report<'a, T> = &'a mut dyn FnMut(Event<T>);

crate::vocabulary! {
    /// Command of a user.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Command {
        /// Evaluate at the next rest, or at the current one.
        Evaluate = "evaluate",
        /// Select the primary as source again, if it is healthy.
        ReturnToPrimary = "return to primary",
    }
}

/// Number of first samples that show the interval of a unit, and the mark of a unit that needs no longer
/// windows.
const FIRST_SAMPLES: u8 = 16;
const QUICK: u8 = u8::MAX;

/// Largest multiple of the window of the settings.
const LONGEST_WINDOW: u8 = 20;

/// Divisor of the time after which a unit is late: a shorter gap of all units is no pause.
const SHORTEST_PAUSE: u64 = 4;

/// Monitor of `UNITS` units, of which number 0 is the primary; it calibrates up to `AT_ONCE` secondaries at a
/// time. All state is inside; the platform is passed with every call, so that it may lie in read-only memory.
/// With `AT_ONCE` 0 it only watches: the code of calibrations and 2.4 kB are saved. `AIDED` is 1 where aiding measurements
/// are received; 0 saves their code, and 2.7 kB for a set of three.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize = 0>
where
    Units<UNITS>: UnitCount,
{
    clock: CommonClock<UNITS>,
    histories: [WindowHistory<T>; UNITS],
    /// Products of the primary for pairs, of which the first is used: without calibrations there is none.
    products: [WindowHistory<T>; AT_ONCE],
    steps: [UnitSteps<T>; UNITS],
    health: [Health<T>; UNITS],
    isolator: FaultIsolator<T, UNITS>,
    /// Model by which three and more units judge one another.
    majority: <Units<UNITS> as UnitCount>::OfMajority<SetMonitor<T, UNITS>>,
    /// Units that the majority named.
    named: UnitSet,
    /// True if the majority decided in the latest window.
    majority_decides: bool,
    /// True if the model knows what is stored and set.
    majority_begun: bool,
    rest_means: [RestMean<T>; UNITS],
    rest: RestState,
    stored: StoredCalibrations<T, UNITS>,
    calibrations: [Option<CalibrationRun<T>>; AT_ONCE],
    latest_window: OptionalTime,
    /// Length of a window in windows of the settings.
    stretch: u8,
    /// First samples of each unit that came too slowly for the windows; [`QUICK`] once one did not.
    slow: [u8; UNITS],
    known_healthy: [bool; UNITS],
    /// True if the fit under way took no step with the latest sample.
    fit_waits: bool,
    /// Time at which all units were at the ends of their ranges last, microseconds.
    overloaded: OptionalTime,
    selection: Selection,
    lever_arm_correction: LeverArmCorrection<T>,
    aiding_channel: [AidingChannel<T, UNITS>; AIDED],
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Default
    for Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Creates a monitor without stored calibrations; [`Self::restore`] adds them.
    pub fn new() -> Self {
        Self {
            clock: CommonClock::new(),
            histories: [WindowHistory::new(); UNITS],
            products: [WindowHistory::of_products(); AT_ONCE],
            steps: [UnitSteps::none(); UNITS],
            health: [Health::new(); UNITS],
            isolator: FaultIsolator::new(),
            majority: Units::filled_majority(|| SetMonitor::new(true)),
            named: UnitSet::default(),
            majority_decides: false,
            majority_begun: false,
            rest_means: [RestMean::new(); UNITS],
            rest: RestState::new(),
            stored: StoredCalibrations::none(),
            calibrations: [None; AT_ONCE],
            latest_window: OptionalTime::NONE,
            stretch: 1,
            slow: [0; UNITS],
            known_healthy: [true; UNITS],
            fit_waits: false,
            overloaded: OptionalTime::NONE,
            selection: Selection::new(),
            lever_arm_correction: LeverArmCorrection::new(),
            aiding_channel: [AidingChannel::none(); AIDED],
        }
    }

    /// Resets all to a new monitor, in place: to write [`Self::new`] there takes as much stack as the monitor.
    #[inline(never)]
    pub fn reset(&mut self) {
        let Self {
            clock,
            histories,
            products,
            steps,
            health,
            isolator,
            majority,
            named,
            majority_decides,
            majority_begun,
            rest_means,
            rest,
            stored,
            calibrations,
            latest_window,
            stretch,
            slow,
            known_healthy,
            fit_waits,
            overloaded,
            selection,
            lever_arm_correction,
            aiding_channel,
        } = self;
        *clock = CommonClock::new();
        set_all(histories, WindowHistory::new());
        set_all(products, WindowHistory::of_products());
        set_all(steps, UnitSteps::none());
        set_all(health, Health::new());
        isolator.reset();
        majority.as_mut().iter_mut().for_each(|model| model.reset(true));
        *named = UnitSet::default();
        *majority_decides = false;
        *majority_begun = false;
        set_all(rest_means, RestMean::new());
        *rest = RestState::new();
        set_all(stored.of_secondaries_mut(), [StoredCalibration::nothing(); 2]);
        calibrations.iter_mut().for_each(|slot| *slot = None);
        *latest_window = OptionalTime::NONE;
        *stretch = 1;
        slow.fill(0);
        known_healthy.fill(true);
        *fit_waits = false;
        *overloaded = OptionalTime::NONE;
        *selection = Selection::new();
        *lever_arm_correction = LeverArmCorrection::new();
        aiding_channel.iter_mut().for_each(AidingChannel::reset);
    }

    /// Executes a command as soon as possible.
    pub fn command(&mut self, command: Command) {
        match command {
            Command::Evaluate => self.rest.command(),
            Command::ReturnToPrimary => self.selection.command_primary(),
        }
    }

    /// Stores the temperature of a unit, degC, from its next sample on; NaN if unknown. Units that are warmer
    /// or colder than at their calibration may differ by more.
    pub fn set_temperature(&mut self, unit: usize, value: T) {
        self.isolator.set_temperature(unit, value);
    }

    /// Stored calibrations of the two sensors of a secondary, accelerometer first; `None` of the primary, which has none.
    pub fn stored(&self, unit: usize) -> Option<&[StoredCalibration<T>; 2]> {
        self.stored.get(unit)
    }

    /// Unit that is the source of the output.
    pub fn source(&self) -> Option<usize> {
        self.selection.source()
    }

    /// Returns whether any sample was received.
    pub fn has_begun(&self) -> bool {
        self.clock.now().is_some()
    }

    /// Number of the latest processed window on the common clock.
    pub fn window(&self) -> Option<u64> {
        self.latest_window.get()
    }

    /// Raw means of a unit over that window, m/s^2 and rad/s.
    pub fn means(&self, unit: usize) -> Option<&[T; CHANNELS]> {
        self.histories
            .get(unit)?
            .window(self.window()?)
            .map(|means| &means.mean)
    }

    /// Processes the next sample of a unit and returns the output, if the unit is the source. Samples of
    /// different units may come in any order as long as none is more than a window behind the others. A
    /// calibration whose pairs are complete is fitted in steps, one with each sample that completes no window.
    pub fn push(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        sample: &Sample<T>,
        report: Report<'_, T>,
    ) -> Option<Output<T>> {
        let before = self.latest_window;
        let output = self.take(platform, number, sample, report);
        // A window is enough work for a sample, unless each sample completes one.
        self.fit_waits = self.latest_window != before && !self.fit_waits;
        if !self.fit_waits {
            self.fit_on(platform, report);
        }
        output
    }

    #[inline(never)]
    fn take(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        sample: &Sample<T>,
        report: Report<'_, T>,
    ) -> Option<Output<T>> {
        let unit = platform.units().get(number)?;
        let settings = &platform.settings().health;
        let time = unit.common_time(sample.time);
        let mut sample = Sample { time, ..*sample };
        unit.axes.blank(&mut sample);
        let before = self.clock.now().unwrap_or(time);
        let verdict = self.clock.push(number, time, &ClockSettings::DEFAULT);
        let accepted = match verdict {
            TimestampDecision::Accept => true,
            TimestampDecision::Drop => false,
            TimestampDecision::Astray => {
                self.health
                    .get_mut(number)?
                    .clock_jumped(self.clock.now().unwrap_or(time));
                false
            }
            TimestampDecision::Jumped { by } => {
                self.restart(time, by, report);
                true
            }
        };
        let now = self.clock.now().unwrap_or(time);
        if verdict == TimestampDecision::Accept {
            self.excuse_pause(number, now, before, settings, report)?;
        }
        let (mut usable, mut is_live) = ([false; 2], false);
        if accepted {
            let health = self.health.get_mut(number)?;
            health.expect_every(match self.clock.interval(number) {
                // The interval is unknown after the first sample: the unit may be a slow one.
                0 => u32::try_from(settings.late).unwrap_or(u32::MAX),
                interval => interval,
            });
            usable = health.push(&sample, &unit.axes, &unit.range, settings);
            is_live = health.is_live();
            self.excuse_overload(platform, number, now, report);
            self.lengthen_windows(platform, number, now, report);
            self.find_copy(platform, number, &sample.channels());
            self.integrate(platform, number, &sample, usable, report);
            self.judge(platform, number, &sample, usable, report);
        }
        self.watch_health(now, settings, report);
        self.select(platform, now, report);
        if !is_live || self.source() != Some(number) {
            return None;
        }
        let mut output = self.output(platform, number, &sample)?;
        output.degraded |= !unit.axes.covered_by(usable) || !platform.replaces_primary(unit);
        if unit.axes != Axes::ALL {
            let axes = platform.output_axes(unit);
            output.specific_force = axes.shown(Sensor::Accelerometer, &output.specific_force);
            output.angular_rate = axes.shown(Sensor::Gyroscope, &output.angular_rate);
        }
        Some(output)
    }

    /// Length of the windows, microseconds: that of the settings, or a multiple of it for slow units.
    pub fn window_length(&self, platform: &Platform<T, UNITS>) -> u64 {
        platform.settings().window.saturating_mul(self.stretch.into())
    }

    /// Returns the number of whole windows in a span of microseconds.
    fn windows(&self, platform: &Platform<T, UNITS>, span: u64) -> u64 {
        whole_spans(span, self.window_length(platform)).0
    }

    /// Lengthens windows if the first samples of a unit are too far apart to complete them.
    fn lengthen_windows(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        now: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        let slow = self.slow.get_mut(number)?;
        if *slow == QUICK {
            return None;
        }
        let wanted = u64::from(self.clock.interval(number)).saturating_mul(5) / 4;
        if wanted == 0 {
            return None;
        }
        let length = platform.settings().window.saturating_mul(self.stretch.into());
        if wanted <= length {
            *slow = QUICK;
            return None;
        }
        *slow += 1;
        if *slow < FIRST_SAMPLES {
            return None;
        }
        *slow = QUICK;
        // Fits hold out every other second, so a second must be a whole number of windows.
        let window = platform.settings().window;
        let fits = |times: &u8| {
            let length = window.saturating_mul((*times).into());
            length >= wanted && length <= SECOND && whole_spans(SECOND, length).1 == 0
        };
        self.stretch = (self.stretch..=LONGEST_WINDOW).find(fits)?;
        if self.rest.is_resting() {
            report(Event {
                time: now,
                unit: 0,
                kind: EventKind::RestEnded,
            });
        }
        self.begin_windows(now, report);
        self.rest.lengthen();
        Some(())
    }

    /// Detects a unit whose changing readings all equal those of another: noise of two units is never equal.
    #[inline]
    fn find_copy(&mut self, platform: &Platform<T, UNITS>, number: usize, channels: &[T; CHANNELS]) {
        let latest = |unit: usize| self.histories.get(unit).and_then(WindowHistory::latest);
        let axes = |unit: usize| platform.units().get(unit).map(|unit| unit.axes);
        let changed = latest(number).is_some_and(|latest| latest != channels);
        let mut others = (0..UNITS).filter(|other| *other != number && axes(*other) == axes(number));
        let same = others.find(|other| latest(*other) == Some(channels));
        let copy = match same {
            _ if !changed => return,
            Some(other) => other.max(number),
            None => number,
        };
        let of = same.map(|other| other.min(number));
        if let Some(health) = self.health.get_mut(copy) {
            health.compare(of);
        }
    }

    #[inline(never)]
    fn integrate(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        sample: &Sample<T>,
        usable: [bool; 2],
        report: Report<'_, T>,
    ) {
        let length = self.window_length(platform);
        // Only pairs need the products.
        if number == 0
            && self.calibrations.iter().any(Option::is_some)
            && let Some(history) = self.products.first_mut()
        {
            let products = products(platform.calibration(), &sample.angular_rate);
            history.push(sample.time, &products, usable, length, None);
        }
        let Some(history) = self.histories.get_mut(number) else {
            return;
        };
        let steps = self.steps.get_mut(number);
        if history.push(sample.time, &sample.channels(), usable, length, steps) {
            self.catch_up(platform, report);
        }
    }

    /// Processes windows in turn, each when all units that keep up have completed it, or when one is more than
    /// a window ahead.
    fn catch_up(&mut self, platform: &Platform<T, UNITS>, report: Report<'_, T>) {
        let Some(newest) = self.histories.iter().filter_map(WindowHistory::newest).max() else {
            return;
        };
        // Units store three windows; older ones are lost.
        for next in newest.saturating_sub(1)..=newest {
            let done = self.window().is_some_and(|step| step >= next);
            if !done && (next < newest || self.all_have(newest)) {
                self.latest_window.replace(next);
                self.process_window(platform, next, report);
            }
        }
    }

    /// Returns whether all units have completed a window, except those that did not complete the one before.
    fn all_have(&self, window: u64) -> bool {
        let mut newest = self.histories.iter().filter_map(WindowHistory::newest);
        newest.all(|newest| newest >= window || newest.saturating_add(1) < window)
    }

    /// Detects a pause of all units beyond the interval of one: no unit is late for it.
    #[inline]
    fn excuse_pause(
        &mut self,
        number: usize,
        now: u64,
        before: u64,
        settings: &HealthSettings<T>,
        report: Report<'_, T>,
    ) -> Option<()> {
        let pause = now.saturating_sub(before);
        if pause < settings.late / SHORTEST_PAUSE {
            return Some(());
        }
        if pause > self.health.get(number)?.patience(settings) {
            self.stalled(now, pause, report);
            return Some(());
        }
        // The sample of this unit is not processed yet: the time since its previous sample counts.
        let others = self
            .health
            .iter_mut()
            .enumerate()
            .filter(|(unit, _)| *unit != number);
        for (unit, health) in others {
            if let Some(time) = self.clock.latest(unit) {
                health.held_back(time);
            }
        }
        let usual = u64::from(self.clock.interval(number));
        if usual > 0 && pause > usual.saturating_mul(3) / 2 {
            self.health.iter_mut().for_each(|health| health.excuse(pause));
        }
        Some(())
    }

    /// Reports a stall of all units, microseconds, as one of the platform, so that no unit becomes faulty for
    /// it.
    #[cold]
    #[inline(never)]
    fn stalled(&mut self, time: u64, pause: u64, report: Report<'_, T>) {
        for health in &mut self.health {
            health.platform_stalled(time);
        }
        let by = i64::try_from(pause).unwrap_or(i64::MAX);
        report(Event {
            time,
            unit: 0,
            kind: EventKind::TimeJumped { by },
        });
    }

    /// Detects that the other units are at the ends of their ranges as well: no unit is faulty for it.
    #[inline]
    fn excuse_overload(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        now: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        let health = self.health.get(number)?;
        if health.was_saturated() {
            self.compare_overload(platform, number, now, report)?;
        }
        Some(())
    }

    #[cold]
    #[inline(never)]
    fn compare_overload(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        now: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        let settings = &platform.settings().health;
        let health = self.health.get(number)?;
        let (mut excused, mut met) = ([false; 2], None);
        for sensor in SENSORS {
            let lasts = health.saturated_for(sensor);
            if lasts == 0 {
                continue;
            }
            let (mut shared, mut awaited, mut absent) = (false, false, false);
            for (other, unit) in platform.units().iter().enumerate() {
                if other == number || !unit.axes.any(sensor) {
                    continue;
                }
                match self.health.get(other)?.beside_saturated(sensor, now, lasts) {
                    Overload::Unknown => {}
                    Overload::Awaited => awaited = true,
                    Overload::Shared => shared = true,
                    Overload::Absent => absent = true,
                }
            }
            *sensor.of_mut(&mut excused) = !absent && (shared || awaited);
            if !absent && shared && !awaited && health.is_saturated(sensor, settings) {
                met = Some(sensor);
            }
        }
        self.health.get_mut(number)?.set_overloaded(excused);
        let sensor = met?;
        let latest = self.overloaded.replace(now);
        if latest.is_none_or(|latest| now.saturating_sub(latest) > settings.recovery) {
            report(Event {
                time: now,
                unit: 0,
                kind: EventKind::AllSaturated { sensor },
            });
        }
        Some(())
    }

    /// Restarts the windows.
    #[cold]
    #[inline(never)]
    fn begin_windows(&mut self, time: u64, report: Report<'_, T>) {
        self.histories = [WindowHistory::new(); UNITS];
        self.products = [WindowHistory::of_products(); AT_ONCE];
        self.rest_means = [RestMean::new(); UNITS];
        self.latest_window = OptionalTime::NONE;
        self.lever_arm_correction = LeverArmCorrection::new();
        self.rest.restart_time(time);
        self.isolator.restart_time();
        self.majority
            .as_mut()
            .iter_mut()
            .for_each(SetMonitor::restart_time);
        for slot in &mut self.calibrations {
            abandon(slot, time, Abandoned::TimeJumped, report);
        }
    }

    fn restart(&mut self, time: u64, by: i64, report: Report<'_, T>) {
        self.begin_windows(time, report);
        self.selection.restart_time();
        self.overloaded = OptionalTime::NONE;
        for health in &mut self.health {
            health.restart_time(time);
        }
        report(Event {
            time,
            unit: 0,
            kind: EventKind::TimeJumped { by },
        });
    }

    /// Detects late units, and reports changes of health.
    fn watch_health(&mut self, now: u64, settings: &HealthSettings<T>, report: Report<'_, T>) {
        for unit in 0..UNITS {
            let known = self.health.get_mut(unit).zip(self.known_healthy.get_mut(unit));
            let Some((health, known)) = known else { continue };
            health.tick(now, settings);
            let sound = health.is_sound();
            if sound != *known {
                *known = sound;
                self.health_changed(unit, now, report);
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn health_changed(&mut self, unit: usize, time: u64, report: Report<'_, T>) -> Option<()> {
        let health = self.health.get(unit)?;
        let fault = health.fault();
        let kind = fault.map_or(EventKind::Healthy, |fault| EventKind::Unhealthy { fault });
        report(Event { time, unit, kind });
        // Saturated and missing samples are left out of pairs; the pairs collected before stay valid.
        if matches!(
            fault,
            None | Some(HealthFault::Saturated { .. } | HealthFault::Late { .. })
        ) {
            return None;
        }
        // A fault that a calibration may correct does not end it.
        if unit != 0 && health.may_be_calibrated() {
            return None;
        }
        for slot in &mut self.calibrations {
            let concerns = slot.as_ref().map(CalibrationRun::secondary);
            match concerns {
                Some(_) if unit == 0 => abandon(slot, time, Abandoned::PrimaryUnhealthy, report),
                Some(secondary) if secondary == unit => {
                    abandon(slot, time, Abandoned::SecondaryUnhealthy, report);
                }
                _ => {}
            }
        }
        Some(())
    }

    #[inline(never)]
    fn select(&mut self, platform: &Platform<T, UNITS>, now: u64, report: Report<'_, T>) {
        let (units, health, all_stored, isolator) =
            (platform.units(), &self.health, &self.stored, &self.isolator);
        let is_complete = |unit: usize| {
            units
                .get(unit)
                .is_some_and(|unit| platform.replaces_primary(unit))
        };
        let is_implausible = |unit: usize| isolation::is_implausible(isolator, all_stored, unit);
        let is_fit = |unit: usize| {
            let healthy = health
                .get(unit)
                .is_some_and(|unit| unit.healthy_since().is_some());
            healthy && is_complete(unit) && !is_implausible(unit) && !is_stale(all_stored, unit)
        };
        let condition = |unit: usize, health: &Health<T>| {
            let condition = health.condition(now, &platform.settings().health);
            let most = if !is_complete(unit) {
                Condition::Lacking
            } else if is_implausible(unit) {
                Condition::Refuted
            } else {
                Condition::Doubtful
            };
            condition.min(most)
        };
        if self.selection.source() == Some(0) && is_fit(0) {
            self.selection.keep_primary();
            return;
        }
        let settings = &platform.settings().health;
        let is_silent = |unit: &Health<T>| unit.condition(now, settings) == Condition::Silent;
        // The interval of a unit that has sent nothing is unknown: its first sample may be late by as much.
        if health.first().is_some_and(is_silent) && self.selection.awaits_the_first(now, settings.late) {
            return;
        }
        let candidate = |unit: usize| {
            let health = health.get(unit)?;
            let healthy_since = health.healthy_since();
            let (calibrated, residual) = match all_stored.get(unit) {
                None => (true, T::zero()),
                Some(stored) => (
                    is_calibrated(&platform.comparable(units.get(unit)?), stored),
                    Sensor::Accelerometer.of(stored).error_left(),
                ),
            };
            Some(SourceCandidate {
                healthy: is_fit(unit),
                condition: condition(unit, health),
                healthy_for: healthy_since.map_or(0, |since| now.saturating_sub(since)),
                calibrated,
                residual,
            })
        };
        let Some(change) = self
            .selection
            .update(now, &candidate, &platform.settings().selection)
        else {
            return;
        };
        self.lever_arm_correction = LeverArmCorrection::new();
        let (unit, kind) = match change.source {
            Some(unit) => (
                unit,
                EventKind::Selected {
                    reason: change.reason,
                },
            ),
            None => (0, EventKind::NoneSelected),
        };
        report(Event {
            time: now,
            unit,
            kind,
        });
    }

    /// Compensated reading of a sensor, in the axes of the primary.
    fn compensated(
        &self,
        platform: &Platform<T, UNITS>,
        number: usize,
        sensor: Sensor,
        y: &Vector3<T>,
    ) -> Option<Vector3<T>> {
        let mut measured = [*y];
        self.compensate(platform, number, sensor, &mut measured)?;
        let [compensated] = measured;
        Some(compensated)
    }

    /// Compensates several readings in place.
    fn compensate(
        &self,
        platform: &Platform<T, UNITS>,
        number: usize,
        sensor: Sensor,
        readings: &mut [Vector3<T>],
    ) -> Option<()> {
        let calibration = platform.calibration();
        if number == 0 {
            for reading in readings {
                *reading = calibration.correct(sensor, reading);
            }
            return Some(());
        }
        let (unit, stored) = (platform.units().get(number)?, self.stored.get(number)?);
        compensate(sensor, unit, stored, calibration, readings);
        for reading in readings {
            *reading = difference(reading, &sensor.of(stored).trimmed);
        }
        Some(())
    }

    /// Returns whether a unit is faulty or in an unresolved dispute.
    fn is_degraded(&self, number: usize) -> bool {
        let sound = self.health.get(number).is_some_and(Health::is_sound) && !is_stale(&self.stored, number);
        !sound || SENSORS.into_iter().any(|sensor| self.is_disputed(sensor))
    }

    #[inline(never)]
    fn output(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        sample: &Sample<T>,
    ) -> Option<Output<T>> {
        let unit = platform.units().get(number)?;
        let (f, w) = (&sample.specific_force, &sample.angular_rate);
        let reading = Compensated {
            specific_force: self.compensated(platform, number, Sensor::Accelerometer, f)?,
            angular_rate: self.compensated(platform, number, Sensor::Gyroscope, w)?,
        };
        let stored = self.stored.get(number);
        let arm = lever_arm(unit, stored);
        let is_unknown = stored.is_some_and(|stored| !is_calibrated(&platform.comparable(unit), stored));
        let output = Output {
            time: sample.time,
            specific_force: self.lever_arm_correction.apply(sample.time, &reading, &arm),
            angular_rate: reading.angular_rate,
            source: number,
            degraded: is_unknown || self.is_degraded(number),
        };
        if !output.is_finite() {
            // The squares of finite readings may overflow; they must not remain in the filter.
            self.lever_arm_correction = LeverArmCorrection::new();
            return None;
        }
        Some(output)
    }
}

/// Returns whether a sensor of a unit is stale.
fn is_stale<T: Real, const UNITS: usize>(stored: &StoredCalibrations<T, UNITS>, unit: usize) -> bool
where
    Units<UNITS>: UnitCount,
{
    let stored = stored.get(unit);
    stored.is_some_and(|stored| stored.iter().any(|stored| stored.stale))
}

/// Returns whether a unit was calibrated against the primary, or agreed with it, on all sensors that correspond
/// to those of the primary.
fn is_calibrated<T: Real>(comparable: &Axes, stored: &[StoredCalibration<T>; 2]) -> bool {
    let both = SENSORS.into_iter().zip(stored);
    both.into_iter()
        .all(|(sensor, stored)| stored.calibrated || stored.agrees || !comparable.any(sensor))
}

/// Abandons a calibration, if one is under way.
#[inline(never)]
fn abandon<T: Real>(slot: &mut Option<CalibrationRun<T>>, time: u64, why: Abandoned, report: Report<'_, T>) {
    if let Some(calibration) = slot.take() {
        report(Event {
            time,
            unit: calibration.secondary(),
            kind: EventKind::Abandoned { why },
        });
    }
}
