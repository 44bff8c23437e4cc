//! What the monitor does with each window: the vote, rest and its evaluation, calibration mode.

use crate::real::{Real, real, seconds};
use crate::redundancy::calibrating::{Calibration, Phase, Progress, RestBefore, of_sensor};
use crate::redundancy::conclusion::conclude;
use crate::redundancy::evaluation::{Deviation, PrimaryAtRest, SecondaryAtRest};
use crate::redundancy::event::{Abandoned, Check, Event, What};
use crate::redundancy::family::{Member, vote};
use crate::redundancy::gate::{Decision, Findings, Withheld};
use crate::redundancy::monitor::{Monitor, Report, abandon, sensor_of};
use crate::redundancy::output::{Compensated, compensate, lever_arm};
use crate::redundancy::pairing::{Pair, PrimaryMeans};
use crate::redundancy::platform::Platform;
use crate::redundancy::rest::Turn;
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::settings::Scope;
use crate::redundancy::unit::AtRest;
use crate::redundancy::window::Means;
use crate::sample::CHANNELS;

impl<T: Real, const UNITS: usize, const AT_ONCE: usize> Monitor<T, UNITS, AT_ONCE> {
    /// Looks at one window of all units.
    pub(super) fn look_at(&mut self, platform: &Platform<T, UNITS>, window: u64, report: Report<'_, T>) {
        let settings = platform.settings();
        let time = window.saturating_add(1).saturating_mul(settings.window);
        self.compare(platform, window);
        let still = self.is_still(platform, window);
        match self
            .rest
            .push(still, settings.evaluation.settle / settings.window)
        {
            Turn::Moving if still => {}
            Turn::Moving => self.at_rest = [AtRest::new(); UNITS],
            Turn::Began => {
                report(of_all(time, What::RestBegan));
                self.at_rest.iter_mut().for_each(AtRest::restart);
            }
            Turn::Resting => self.rest_on(platform, window, time, report),
            Turn::Ended => {
                report(of_all(time, What::RestEnded));
                self.at_rest = [AtRest::new(); UNITS];
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
        let members: [Option<Member<T>>; UNITS] = core::array::from_fn(|i| {
            let means = self.streams[i].window(window)?;
            let said = self.at_primary(platform, i, window)?;
            let (f, w) = (&said.specific_force, &said.angular_rate);
            let [accelerometer, gyroscope] = &self.stored[i];
            let knows = [i == 0 || accelerometer.calibrated, i == 0 || gyroscope.calibrated];
            Some(Member {
                mean: known([f.x, f.y, f.z, w.x, w.y, w.z], knows),
                scatter: means.scatter.map(|variance| variance.sqrt()),
                axes: comparable(&platform.units()[i].axes, means.usable),
            })
        });
        for (health, compared) in self.health.iter_mut().zip(vote(&members)) {
            for (sensor, comparison) in SENSORS.into_iter().zip(compared) {
                if let Some(comparison) = comparison {
                    health.family(sensor, &comparison, settings.window, &settings.health);
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
        let (before, means) = self.streams.get(number)?.pair(window)?;
        let (unit, stored) = (platform.units().get(number)?, self.stored.get(number)?);
        let said = |means: &Means<T, CHANNELS>| {
            let force = of_sensor(&means.mean, Sensor::Accelerometer);
            let rate = of_sensor(&means.mean, Sensor::Gyroscope);
            compensate(unit, stored, platform.calibration(), &force, &rate)
        };
        let (earlier, now) = (said(before), said(means));
        let (w, arm) = (now.angular_rate, lever_arm(unit, stored));
        let change = (w - earlier.angular_rate) / seconds::<T>(platform.settings().window);
        Some(Compensated {
            specific_force: now.specific_force - change.cross(&arm) - w.cross(&w.cross(&arm)),
            angular_rate: w,
        })
    }

    /// At rest if at least half of the units in health are: a unit cannot look still while it is moved, but it can look
    /// moved while it is still.
    fn is_still(&mut self, platform: &Platform<T, UNITS>, window: u64) -> bool {
        let thresholds = &platform.settings().evaluation.thresholds;
        let units = self.streams.iter().zip(&mut self.at_rest).zip(&self.health);
        let (mut still, mut voters) = (0_usize, 0_usize);
        for ((stream, at_rest), health) in units {
            let Some(means) = stream.window(window).filter(|_| health.healthy_since().is_some()) else {
                continue;
            };
            voters += 1;
            let whole = means.usable == [true; 2];
            let quiet = at_rest.is_still(&means.mean, means.scatter, thresholds.first, thresholds.second);
            still += usize::from(whole && quiet);
        }
        voters > 0 && 2 * still >= voters
    }

    fn rest_on(&mut self, platform: &Platform<T, UNITS>, window: u64, time: u64, report: Report<'_, T>) {
        for (stream, at_rest) in self.streams.iter().zip(&mut self.at_rest) {
            if let Some(means) = stream.window(window).filter(|means| means.usable == [true; 2]) {
                at_rest.push(&means.mean);
            }
        }
        let settings = platform.settings();
        let needed = settings.evaluation.duration / settings.window;
        let most = self.at_rest.iter().map(AtRest::windows).max().unwrap_or(0);
        if u64::from(most) < needed {
            return;
        }
        self.evaluate(platform, needed / 2, time, report);
        self.at_rest.iter_mut().for_each(AtRest::restart);
    }

    /// Deviations of all units whose means are of at least so many windows.
    fn evaluate(&mut self, platform: &Platform<T, UNITS>, fewest: u64, time: u64, report: Report<'_, T>) {
        let due = self.rest.is_due(time, &platform.settings().evaluation);
        if !due && self.calibrations.iter().all(Option::is_none) {
            return;
        }
        let valid = self.evaluate_primary(platform, fewest, time, report);
        self.distrust(platform, valid, time, report);
        if !due {
            return;
        }
        self.rest.evaluated(time);
        for number in 1..UNITS {
            self.evaluate_secondary(platform, number, fewest, valid, time, report);
        }
    }

    fn evaluate_primary(
        &mut self,
        platform: &Platform<T, UNITS>,
        fewest: u64,
        time: u64,
        report: Report<'_, T>,
    ) -> [bool; 2] {
        let settings = platform.settings();
        let (Some(at_rest), Some(health)) = (self.at_rest.first(), self.health.first_mut()) else {
            return [false; 2];
        };
        if u64::from(at_rest.windows()) < fewest.max(1) {
            return [false; 2];
        }
        SENSORS.map(|sensor| {
            let last_valid = self.rest.primary_deviation(sensor);
            let primary = PrimaryAtRest {
                sensor,
                mean: of_sensor(at_rest.mean(), sensor),
                calibration: platform.calibration(),
                last_valid: *last_valid,
            };
            let deviation = primary.deviation(&settings.evaluation);
            if !deviation.exceeds() {
                *last_valid = deviation.value;
            }
            health.at_rest(sensor, deviation.value, settings.health.rest.of(sensor));
            report(Event {
                time,
                unit: 0,
                what: evaluated(sensor, Check::Norm, &deviation),
            });
            !deviation.exceeds()
        })
    }

    /// Pairs with a primary that turned out invalid are worth nothing.
    fn distrust(
        &mut self,
        platform: &Platform<T, UNITS>,
        valid: [bool; 2],
        time: u64,
        report: Report<'_, T>,
    ) {
        let gate = platform.settings().evaluation.gate;
        for slot in &mut self.calibrations {
            let distrusted = slot.as_ref().is_some_and(|calibration| {
                let sensors = SENSORS.into_iter().zip(calibration.sensors());
                sensors
                    .into_iter()
                    .any(|(sensor, wanted)| wanted && !gate.trusts(valid, sensor))
            });
            if distrusted {
                abandon(slot, time, Abandoned::PrimaryInvalid, report);
            }
        }
    }

    fn evaluate_secondary(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        fewest: u64,
        primary_valid: [bool; 2],
        time: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        let settings = platform.settings();
        let primary_healthy = self.health.first()?.healthy_since().is_some();
        let primary = *self.at_rest.first()?.mean();
        let (unit, at_rest) = (platform.units().get(number)?, self.at_rest.get(number)?);
        if u64::from(at_rest.windows()) < fewest.max(1) {
            return None;
        }
        let (stored, health) = (self.stored.get(number)?, self.health.get_mut(number)?);
        let mut exceeded = [false; 2];
        for ((sensor, exceeded), valid) in SENSORS.into_iter().zip(&mut exceeded).zip(primary_valid) {
            if !unit.axes.any(sensor) {
                continue;
            }
            let secondary = SecondaryAtRest {
                sensor,
                unit,
                mean: of_sensor(at_rest.mean(), sensor),
                stored: sensor_of(stored, sensor),
                calibration: platform.calibration(),
            };
            let mut tell = |check, deviation: &Deviation<T>| {
                *exceeded |= deviation.exceeds();
                let what = evaluated(sensor, check, deviation);
                report(Event {
                    time,
                    unit: number,
                    what,
                });
            };
            if let Some(deviation) = secondary.norm(&settings.evaluation) {
                health.at_rest(
                    sensor,
                    deviation.value,
                    settings.plausible_at_rest(sensor, secondary.stored.calibrated),
                );
                tell(Check::Norm, &deviation);
            }
            if settings.evaluation.vector_check && valid && primary_healthy {
                tell(
                    Check::Vector,
                    &secondary.vector(&of_sensor(&primary, sensor), &settings.evaluation),
                );
            }
        }
        let findings = Findings {
            exceeded,
            primary_valid,
            primary_healthy,
            secondary_healthy: health.healthy_since().is_some(),
        };
        self.trigger(platform, number, &findings, time, report)
    }

    fn trigger(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        findings: &Findings,
        time: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        let evaluation = &platform.settings().evaluation;
        let mut decisions = evaluation.gate.decide(findings);
        let active = self.calibrations.iter().flatten();
        let already = active
            .map(Calibration::secondary)
            .any(|secondary| secondary == number);
        let full = self.calibrations.iter().all(Option::is_some);
        for (sensor, decision) in SENSORS.into_iter().zip(&mut decisions) {
            if *decision == Decision::Trigger && (already || full) {
                *decision = Decision::Withheld(Withheld::AlreadyCalibrating);
            }
            if let Decision::Withheld(why) = *decision {
                let what = What::Withheld { sensor, why };
                report(Event {
                    time,
                    unit: number,
                    what,
                });
            }
        }
        let triggers = decisions.map(|decision| decision == Decision::Trigger);
        if triggers == [false; 2] {
            return None;
        }
        let unit = platform.units().get(number)?;
        let sensors = match platform.settings().collection.scope {
            Scope::TriggeringSensor => triggers,
            Scope::AllSensors => SENSORS.map(|sensor| {
                unit.axes.any(sensor) && evaluation.gate.trusts(findings.primary_valid, sensor)
            }),
        };
        let (primary, secondary) = (self.at_rest.first()?, self.at_rest.get(number)?);
        let rest = RestBefore {
            primary: *primary.mean(),
            variance: primary.variance(),
            secondary: *secondary.mean(),
        };
        let slot = self.calibrations.iter_mut().find(|slot| slot.is_none())?;
        *slot = Some(Calibration::new(number, sensors, time, rest));
        let what = What::Triggered { sensors };
        report(Event {
            time,
            unit: number,
            what,
        });
        Some(())
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
        let readings = self.streams.first()?.pair(window)?;
        let products = self.products.pair(window)?;
        let primary = PrimaryMeans::of(platform.calibration(), readings, products, settings.window);
        let usable = both(readings.0.usable, readings.1.usable);
        // The later window may lie in the next second, of which the pair would then be a part as well.
        let second = |window: u64| window * settings.window / 1_000_000;
        let within = second(window.checked_sub(1)?) == second(window);
        for slot in &mut self.calibrations {
            let Some(calibration) = slot else { continue };
            let number = calibration.secondary();
            if calibration.phase() == Phase::WaitingForMotion {
                let mean = &readings.1.mean;
                if usable == [true; 2] && calibration.watch(time, mean, &settings.collection) {
                    report(Event {
                        time,
                        unit: number,
                        what: What::MotionBegan,
                    });
                }
                continue;
            }
            let units = platform
                .units()
                .get(number)
                .zip(self.streams.get(number))
                .zip(self.stored.get(number));
            let Some(((unit, stream), stored)) = units else {
                continue;
            };
            if let Some((before, now)) = stream.pair(window).filter(|_| within) {
                let pair = Pair::of(unit, &primary, &before.triangle(now));
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
                Progress::GoesOn => {}
                Progress::Abandoned(why) => abandon(slot, time, why, report),
                Progress::Complete => {
                    let number = calibration.secondary();
                    let unit = platform.units().get(number).zip(self.stored.get_mut(number));
                    let replaced = unit.is_some_and(|(unit, stored)| {
                        conclude(settings, calibration, unit, stored, time, report)
                    });
                    // The next rest shows whether it was right.
                    if replaced {
                        self.rest.command();
                    }
                    *slot = None;
                }
            }
        }
    }
}

/// What was found at rest.
fn evaluated<T: Real>(sensor: Sensor, check: Check, deviation: &Deviation<T>) -> What<T> {
    What::Evaluated {
        sensor,
        check,
        deviation: deviation.value,
        threshold: deviation.threshold,
    }
}

/// An event that concerns the whole platform.
fn of_all<T: Real>(time: u64, what: What<T>) -> Event<T> {
    Event { time, unit: 0, what }
}

/// What both allow.
fn both(a: [bool; 2], b: [bool; 2]) -> [bool; 2] {
    let ([a0, a1], [b0, b1]) = (a, b);
    [a0 && b0, a1 && b1]
}

/// The channels of sensors of which something is known; not a number for others.
fn known<T: Real>(mut mean: [T; CHANNELS], [accelerometer, gyroscope]: [bool; 2]) -> [T; CHANNELS] {
    for (channel, x) in mean.iter_mut().enumerate() {
        let knows = match Sensor::of_channel(channel) {
            Sensor::Accelerometer => accelerometer,
            Sensor::Gyroscope => gyroscope,
        };
        if !knows {
            *x = real(f64::NAN);
        }
    }
    mean
}

/// The axes there are, of the sensors that may be used.
fn comparable(axes: &Axes, [accelerometer, gyroscope]: [bool; 2]) -> Axes {
    let mut comparable = *axes;
    for (channel, has) in comparable.0.iter_mut().enumerate() {
        *has &= match Sensor::of_channel(channel) {
            Sensor::Accelerometer => accelerometer,
            Sensor::Gyroscope => gyroscope,
        };
    }
    comparable
}
