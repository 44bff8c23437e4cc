//! What the monitor does with each window: the vote, rest and its evaluation, calibration mode.

use crate::real::{Real, SECOND, real, seconds};
use crate::redundancy::health::median_vote::{UnitMean, vote};
use crate::redundancy::monitor::adopt::conclude;
use crate::redundancy::monitor::calibration::{CalibrationPhase, CalibrationProgress};
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::rest_state::RestTransition;
use crate::redundancy::monitor::{Monitor, Report, abandon};
use crate::redundancy::output::{Compensated, lever_arm};
use crate::redundancy::platform::Platform;
use crate::redundancy::samples::history::RestMean;
use crate::redundancy::samples::pair::{MotionPair, PrimaryMeans};
use crate::redundancy::samples::window::Means;
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::sample::CHANNELS;

impl<T: Real, const UNITS: usize, const AT_ONCE: usize> Monitor<T, UNITS, AT_ONCE> {
    /// Looks at one window of all units.
    pub(super) fn process_window(
        &mut self,
        platform: &Platform<T, UNITS>,
        window: u64,
        report: Report<'_, T>,
    ) {
        let settings = platform.settings();
        let time = window.saturating_add(1).saturating_mul(settings.window);
        self.compare(platform, window);
        let still = self.is_still(platform, window);
        match self
            .rest
            .push(still, settings.windows(settings.evaluation.rest_settle))
        {
            RestTransition::Moving if still => {}
            RestTransition::Moving => self.rest_means = [RestMean::new(); UNITS],
            RestTransition::Began => {
                report(of_all(time, EventKind::RestBegan));
                self.rest_means.iter_mut().for_each(RestMean::restart);
            }
            RestTransition::Resting => self.rest_on(platform, window, time, report),
            RestTransition::Ended => {
                report(of_all(time, EventKind::RestEnded));
                self.rest_means = [RestMean::new(); UNITS];
            }
        }
        if !self.rest.is_resting() {
            self.follow(platform, window, time, report);
        }
        self.give_up_in_time(platform, time, report);
    }

    /// The vote of three or more units, each compensated and brought to the primary's place. What was never calibrated
    /// has no say in what the set measures, and is not blamed for it.
    fn compare(&mut self, platform: &Platform<T, UNITS>, window: u64) {
        let settings = platform.settings();
        let members: [Option<UnitMean<T>>; UNITS] = core::array::from_fn(|i| {
            let means = self.histories[i].window(window)?;
            let here = self.at_primary(platform, i, window)?;
            let (f, w) = (&here.specific_force, &here.angular_rate);
            let [accelerometer, gyroscope] = &self.stored[i];
            let knows = [i == 0 || accelerometer.calibrated, i == 0 || gyroscope.calibrated];
            Some(UnitMean {
                mean: known([f.x, f.y, f.z, w.x, w.y, w.z], knows),
                scatter: means.scatter.map(|variance| variance.sqrt()),
                axes: comparable(&platform.units()[i].axes, means.usable),
            })
        });
        for (health, compared) in self.health.iter_mut().zip(vote(&members)) {
            for (sensor, comparison) in SENSORS.into_iter().zip(compared) {
                if let Some(comparison) = comparison {
                    health.compare(sensor, &comparison, settings.window, &settings.health);
                }
            }
        }
    }

    /// What a unit said over a window, compensated and brought to the primary's place by its own change of rate.
    pub fn at_primary(
        &self,
        platform: &Platform<T, UNITS>,
        number: usize,
        window: u64,
    ) -> Option<Compensated<T>> {
        let (before, means) = self.histories.get(number)?.pair(window)?;
        let (unit, stored) = (platform.units().get(number)?, self.stored.get(number)?);
        let said = |sensor: Sensor, means: &Means<T, CHANNELS>| {
            self.compensated(platform, number, sensor, &sensor.triad(&means.mean))
        };
        let (earlier, w) = (said(Sensor::Gyroscope, before)?, said(Sensor::Gyroscope, means)?);
        let change = (w - earlier) / seconds::<T>(platform.settings().window);
        let arm = lever_arm(unit, stored);
        Some(Compensated {
            specific_force: said(Sensor::Accelerometer, means)?
                - change.cross(&arm)
                - w.cross(&w.cross(&arm)),
            angular_rate: w,
        })
    }

    /// At rest if at least half of the units are whose readings live: a unit cannot look still while it is moved, but it
    /// can look moved while it is still. A unit that is wrong at rest has its say too, or no rest would ever clear it.
    fn is_still(&mut self, platform: &Platform<T, UNITS>, window: u64) -> bool {
        let thresholds = &platform.settings().evaluation.thresholds;
        let units = self.histories.iter().zip(&mut self.rest_means).zip(&self.health);
        let (mut still, mut voters) = (0_usize, 0_usize);
        for (((history, at_rest), health), unit) in units.zip(platform.units()) {
            let lives = health.fault().is_none_or(|fault| fault.leaves_stillness());
            let Some(means) = history.window(window).filter(|_| lives) else {
                continue;
            };
            voters += 1;
            let whole = unit.axes.covered_by(means.usable);
            let quiet = at_rest.is_still(&means.mean, means.scatter, &thresholds.rest_scatter);
            still += usize::from(whole && quiet);
        }
        voters > 0 && 2 * still >= voters
    }

    /// Takes the window, in motion, to the calibrations under way.
    fn follow(
        &mut self,
        platform: &Platform<T, UNITS>,
        window: u64,
        time: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        let settings = platform.settings();
        let readings = self.histories.first()?.pair(window)?;
        let products = self.products.pair(window)?;
        let primary = PrimaryMeans::of(platform.calibration(), readings, products, settings.window);
        let usable = both(readings.0.usable, readings.1.usable);
        // The later window may lie in the next second, of which the pair would then be a part as well.
        let second = |window: u64| window * settings.window / SECOND;
        let within = second(window.checked_sub(1)?) == second(window);
        for slot in &mut self.calibrations {
            let Some(calibration) = slot else { continue };
            let number = calibration.secondary();
            if calibration.phase() == CalibrationPhase::WaitingForMotion {
                let mean = &readings.1.mean;
                if usable == [true; 2] && calibration.watch(time, mean, &settings.collection) {
                    report(Event {
                        time,
                        unit: number,
                        kind: EventKind::MotionBegan,
                    });
                }
                continue;
            }
            let units = platform
                .units()
                .get(number)
                .zip(self.histories.get(number))
                .zip(self.stored.get(number));
            let Some(((unit, history), stored)) = units else {
                continue;
            };
            if let Some((before, now)) = history.pair(window).filter(|_| within) {
                let pair = MotionPair::of(unit, &primary, &before.triangle(now));
                let usable = both(usable, both(before.usable, now.usable));
                calibration.take(window * settings.window, &pair, usable, stored);
            }
        }
        Some(())
    }

    /// Ends calibrations that have all they need, or no time left.
    fn give_up_in_time(&mut self, platform: &Platform<T, UNITS>, time: u64, report: Report<'_, T>) {
        let settings = platform.settings();
        for slot in &mut self.calibrations {
            let Some(calibration) = slot else { continue };
            match calibration.check(time, &settings.collection, settings.window) {
                CalibrationProgress::GoesOn => {}
                CalibrationProgress::Abandoned(why) => {
                    abandon(slot, time, why, report);
                    self.rest.retry();
                }
                CalibrationProgress::Complete => {
                    let number = calibration.secondary();
                    self.rest.settled(number);
                    let unit = platform.units().get(number).zip(self.stored.get_mut(number));
                    let replaced = unit.is_some_and(|(unit, stored)| {
                        conclude(settings, calibration, unit, stored, time, report)
                    });
                    if replaced {
                        self.rest.adopted();
                    }
                    *slot = None;
                }
            }
        }
    }
}

/// An event that concerns the whole platform.
fn of_all<T: Real>(time: u64, kind: EventKind<T>) -> Event<T> {
    Event { time, unit: 0, kind }
}

/// What both allow.
fn both(a: [bool; 2], b: [bool; 2]) -> [bool; 2] {
    let ([a0, a1], [b0, b1]) = (a, b);
    [a0 && b0, a1 && b1]
}

/// The channels of sensors of which something is known; not a number for others.
fn known<T: Real>(mut mean: [T; CHANNELS], usable: [bool; 2]) -> [T; CHANNELS] {
    for (channel, x) in mean.iter_mut().enumerate() {
        if !Sensor::of_channel(channel).of(&usable) {
            *x = real(f64::NAN);
        }
    }
    mean
}

/// The axes there are, of the sensors that may be used.
fn comparable(axes: &Axes, usable: [bool; 2]) -> Axes {
    let mut comparable = *axes;
    for (channel, has) in comparable.0.iter_mut().enumerate() {
        *has &= Sensor::of_channel(channel).of(&usable);
    }
    comparable
}
