//! Processing of a window: comparison of units, rest and its evaluation, calibration.

use crate::products::cross;
use crate::real::{Real, SECOND, seconds, whole_spans};
use crate::redundancy::health::Surroundings;
use crate::redundancy::model::monitor::SetMonitor;
use crate::redundancy::monitor::calibration::{CalibrationProgress, CalibrationRun};
use crate::redundancy::monitor::event::{Abandoned, Event, EventKind};
use crate::redundancy::monitor::rest_state::RestTransition;
use crate::redundancy::monitor::{Monitor, Report, abandon};
use crate::redundancy::output::{Compensated, lever_arm};
use crate::redundancy::platform::Platform;
use crate::redundancy::samples::history::RestMean;
use crate::redundancy::samples::pair::{MotionPair, PrimaryMeans};
use crate::redundancy::samples::window::Means;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::sample::CHANNELS;

/// Still windows that precede one of a rest: smooth motion has single still windows only.
const QUIET: u64 = 1;

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Processes one window of all units.
    pub(super) fn process_window(
        &mut self,
        platform: &Platform<T, UNITS>,
        window: u64,
        report: Report<'_, T>,
    ) {
        let settings = platform.settings();
        let length = self.window_length(platform);
        let time = window.saturating_add(1).saturating_mul(length);
        self.isolate(platform, window, time, report);
        let still = self.is_still(platform, window);
        match self
            .rest
            .push(still, whole_spans(settings.evaluation.rest_settle, length).0)
        {
            RestTransition::Moving if still => {}
            RestTransition::Moving => self.rest_means.iter_mut().for_each(RestMean::end),
            RestTransition::Began => {
                report(of_all(time, EventKind::RestBegan));
                self.rest_means.iter_mut().for_each(RestMean::restart);
            }
            RestTransition::Resting => {
                self.rest_on(platform, window, time, report);
                self.accept_or_refute(platform);
            }
            RestTransition::Ended => {
                report(of_all(time, EventKind::RestEnded));
                self.rest_means.iter_mut().for_each(RestMean::end);
            }
        }
        if self.rest.never_rested() {
            self.accept_in_motion(platform);
        }
        if !self.rest.is_resting() {
            self.follow(platform, window, time, report);
        }
        self.give_up_in_time(platform, time, report);
    }

    /// Reading of a unit over a window, compensated and converted to the place of the primary by its own change
    /// of rate.
    pub fn at_primary(
        &self,
        platform: &Platform<T, UNITS>,
        number: usize,
        window: u64,
    ) -> Option<Compensated<T>> {
        let (before, means) = self.histories.get(number)?.pair(window)?;
        let unit = platform.units().get(number)?;
        let measured = |sensor: Sensor, means: &Means<T, CHANNELS>| {
            self.compensated(platform, number, sensor, &sensor.triad(&means.mean))
        };
        let (earlier, w) = (
            measured(Sensor::Gyroscope, before)?,
            measured(Sensor::Gyroscope, means)?,
        );
        let change = (w - earlier) / seconds::<T>(self.window_length(platform));
        let arm = lever_arm(unit, self.stored.get(number));
        Some(Compensated {
            specific_force: measured(Sensor::Accelerometer, means)?
                - cross(&change, &arm)
                - cross(&w, &cross(&w, &arm)),
            angular_rate: w,
        })
    }

    /// Returns whether the platform rests: at least half of the units with live readings are still. A moved
    /// unit cannot look still, but a still one can look moved. Units that are faulty at rest count too, or no
    /// rest would ever clear them.
    fn is_still(&mut self, platform: &Platform<T, UNITS>, window: u64) -> bool {
        let thresholds = &platform.settings().evaluation.thresholds;
        let units = self.histories.iter().zip(&mut self.rest_means).zip(&self.health);
        let (mut still, mut voters) = (0_usize, 0_usize);
        let (mut changing, mut moved) = (0_usize, 0_usize);
        for (((history, at_rest), health), unit) in units.zip(platform.units()) {
            let lives = health.fault().is_none_or(|fault| fault.leaves_stillness());
            let Some(means) = history.window(window).filter(|_| lives) else {
                continue;
            };
            voters += 1;
            let whole = unit.axes.covered_by(means.usable);
            let quiet = at_rest.is_still(&means.mean, means.scatter, &thresholds.rest_scatter);
            still += usize::from(whole && quiet);
            // Readings that repeat cannot distinguish rest from motion.
            let changes = means.scatter.iter().any(|scatter| *scatter > T::zero());
            changing += usize::from(changes);
            moved += usize::from(changes && !quiet);
        }
        let surroundings = match 2 * moved <= changing {
            _ if changing == 0 => Surroundings::Unknown,
            false => Surroundings::Motion,
            true if self.rest.is_still_for(QUIET) => Surroundings::Rest,
            true => Surroundings::Quiet,
        };
        let longer = self
            .window_length(platform)
            .saturating_sub(platform.settings().window);
        let longer = u32::try_from(longer).unwrap_or(u32::MAX);
        for health in &mut self.health {
            health.set_surroundings(surroundings, longer);
        }
        voters > 0 && 2 * still >= voters
    }

    /// Adds the window, in motion, to the calibrations under way.
    #[inline(never)]
    fn follow(
        &mut self,
        platform: &Platform<T, UNITS>,
        window: u64,
        time: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        if self.calibrations.iter().all(Option::is_none) {
            return None;
        }
        let (settings, length) = (platform.settings(), self.window_length(platform));
        let readings = self.histories.first()?.pair(window)?;
        let products = self.products.first().and_then(|history| history.pair(window));
        let axes = platform.primary_axes();
        let primary = products
            .map(|products| PrimaryMeans::of(&axes, platform.calibration(), readings, products, length));
        let usable = both(readings.0.usable, readings.1.usable);
        // The later window may lie in the next second, to which the pair would then belong as well.
        let second = |window: u64| whole_spans(window * length, SECOND).0;
        let within = second(window.checked_sub(1)?) == second(window);
        for slot in &mut self.calibrations {
            let Some(calibration) = slot else { continue };
            let number = calibration.secondary();
            if calibration.waits_for_motion() {
                let mean = &readings.1.mean;
                if axes.covered_by(usable) && calibration.watch(time, mean, &settings.collection) {
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
            let Some((((unit, history), stored), primary)) = units.zip(primary.as_ref()) else {
                continue;
            };
            if let Some((before, now)) = history.pair(window).filter(|_| within) {
                let pair = MotionPair::of(unit, primary, &before.triangle(now));
                let usable = both(usable, both(before.usable, now.usable));
                calibration.take(window * length, &pair, usable, stored);
            }
        }
        Some(())
    }

    /// Ends the collection of calibrations that are complete, contested or out of time.
    #[inline(never)]
    fn give_up_in_time(&mut self, platform: &Platform<T, UNITS>, time: u64, report: Report<'_, T>) {
        let (settings, length) = (platform.settings(), self.window_length(platform));
        let fewest = settings.fewest_pairs(length);
        let is_disputed = |model: &SetMonitor<T, UNITS>| model.disputed().contains(0);
        let disputed = self.majority_decides && self.majority.as_ref().iter().any(is_disputed);
        let contested = SENSORS.map(|sensor| disputed || self.is_contested(sensor));
        let moved = self.calibrations.each_ref().map(|slot| {
            let number = slot.as_ref().map_or(0, CalibrationRun::secondary);
            SENSORS.map(|sensor| number > 0 && self.is_primary_moved(platform, sensor, number))
        });
        for (slot, moved) in self.calibrations.iter_mut().zip(moved) {
            let Some(calibration) = slot else { continue };
            let wanted = SENSORS.into_iter().zip(calibration.sensors());
            let doubted = wanted.filter(|(_, wanted)| *wanted).any(|(sensor, _)| {
                *sensor.of(&contested) || *sensor.of(&moved) || self.isolator.is_doubted(sensor, 0)
            });
            if doubted {
                abandon(slot, time, Abandoned::Disputed, report);
                continue;
            }
            match calibration.check(time, &settings.collection, (length, fewest)) {
                CalibrationProgress::GoesOn => {}
                CalibrationProgress::Abandoned(why) => {
                    abandon(slot, time, why, report);
                    self.rest.retry();
                }
                CalibrationProgress::Complete => {
                    let number = calibration.secondary();
                    self.rest.settled(number);
                    let stored = self.stored.get(number);
                    if !stored.is_some_and(|stored| calibration.fit_next(stored)) {
                        *slot = None;
                    }
                }
            }
        }
    }
}

/// Event that concerns the whole platform.
fn of_all<T: Real>(time: u64, kind: EventKind<T>) -> Event<T> {
    Event { time, unit: 0, kind }
}

/// Combines two usabilities.
fn both(a: [bool; 2], b: [bool; 2]) -> [bool; 2] {
    let ([a0, a1], [b0, b1]) = (a, b);
    [a0 && b0, a1 && b1]
}
