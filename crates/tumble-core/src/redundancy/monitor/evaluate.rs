//! Evaluation of deviations while the platform rests, and triggers of calibrations.

use nalgebra::Vector3;

use crate::products::{Length, product, squared, unit_beyond, zeros};
use crate::real::{Real, real};
use crate::redundancy::evaluation::{Deviation, PrimaryAtRest, SecondaryAtRest, across};
use crate::redundancy::gate::{Decision, Findings, Withheld};
use crate::redundancy::health::Health;
use crate::redundancy::monitor::calibration::{CalibrationRun, RestBefore, RestPair};
use crate::redundancy::monitor::event::{Abandoned, Check, Event, EventKind};
use crate::redundancy::monitor::rest_state::Purpose;
use crate::redundancy::monitor::{Monitor, Report, abandon};
use crate::redundancy::platform::Platform;
use crate::redundancy::samples::history::RestMean;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::{Data, Scope};
use crate::redundancy::unit_count::{UnitCount, Units};

/// Share of the deviation of the primary above which a secondary shares it.
const AS_WELL: f64 = 0.5;

/// Trust in the sensors of the primary, accelerometer first.
#[derive(Clone, Copy)]
struct PrimaryTrust {
    /// True if the sensor agrees with physics.
    proven: [bool; 2],
    /// True if others may be calibrated against the sensor.
    valid: [bool; 2],
}

impl PrimaryTrust {
    /// Returns whether secondaries are calibrated relative to a sensor that deviates itself.
    fn is_relative(&self, sensor: Sensor) -> bool {
        *sensor.of(&self.valid) && !*sensor.of(&self.proven)
    }
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Adds a window at rest, and evaluates once enough of them are complete.
    pub(super) fn rest_on(
        &mut self,
        platform: &Platform<T, UNITS>,
        window: u64,
        time: u64,
        report: Report<'_, T>,
    ) {
        let histories = self.histories.iter().zip(&mut self.rest_means);
        for ((history, at_rest), unit) in histories.zip(platform.units()) {
            let means = history.window(window);
            if let Some(means) = means.filter(|means| unit.axes.covered_by(means.usable)) {
                at_rest.push(&means.mean);
            }
        }
        let settings = platform.settings();
        let needed = self.windows(platform, settings.evaluation.rest_duration);
        let most = self.rest_means.iter().map(RestMean::windows).max().unwrap_or(0);
        if u64::from(most) < needed {
            return;
        }
        self.evaluate(platform, needed / 2, time, report);
        self.rest_means.iter_mut().for_each(RestMean::restart);
    }

    /// Evaluates all units with means of at least `fewest` windows: at every rest for health, and when due in
    /// order to report and calibrate.
    #[inline(never)]
    fn evaluate(&mut self, platform: &Platform<T, UNITS>, fewest: u64, time: u64, report: Report<'_, T>) {
        let purpose = self.purpose(platform, time);
        let calibrating = self.calibrations.iter().any(Option::is_some);
        let reports = calibrating || purpose > Purpose::Health;
        let deviations = self.evaluate_primary(platform, fewest, time, reports, report);
        self.hold_rest_against_primary(platform, &deviations);
        let reopened = self.apply_physics(platform, fewest, &deviations);
        let proven = deviations.map(|deviation| deviation.is_some_and(|deviation| !deviation.exceeds()));
        let trust = PrimaryTrust {
            proven,
            valid: self.trusted(platform, fewest, &deviations, proven),
        };
        let valid = trust.valid;
        self.abandon_if_primary_invalid(platform, valid, time, report);
        // Secondaries that became stale here are calibrated from this rest on, unless the primary has to be
        // proven again.
        let purpose = if reopened {
            Purpose::Health
        } else {
            self.purpose(platform, time).max(purpose)
        };
        if purpose > Purpose::Health {
            self.rest.evaluated(time);
        }
        for number in 1..UNITS {
            self.evaluate_secondary(platform, number, fewest, (trust, purpose), time, report);
        }
        self.prove(platform, proven);
        self.take_rest(platform, fewest, trust, time);
        self.rest.end_evaluation();
    }

    fn purpose(&mut self, platform: &Platform<T, UNITS>, time: u64) -> Purpose {
        let under_way = self.calibrations.iter().flatten().map(CalibrationRun::secondary);
        self.rest
            .purpose(time, under_way, &platform.settings().evaluation)
    }

    /// Adds the means of this rest to the calibrations under way.
    #[inline(never)]
    fn take_rest(
        &mut self,
        platform: &Platform<T, UNITS>,
        fewest: u64,
        trust: PrimaryTrust,
        time: u64,
    ) -> Option<()> {
        if self.calibrations.iter().all(Option::is_none) {
            return None;
        }
        let apart = SENSORS.map(|sensor| self.apart_at_rest(platform, sensor, fewest, trust.proven));
        let primary = self.rest_means.first()?;
        for calibration in self.calibrations.iter_mut().flatten() {
            let number = calibration.secondary();
            let (secondary, stored) = (self.rest_means.get(number)?, self.stored.get(number)?);
            if u64::from(primary.windows().min(secondary.windows())) >= fewest.max(1) {
                let rest = RestPair {
                    primary,
                    secondary,
                    valid: trust.valid,
                    shared: apart.map(|apart| shared(&apart, number)),
                };
                calibration.take_rest(time, platform.units().get(number)?, &rest, stored);
            }
        }
        Some(())
    }

    /// Differences of calibrated secondaries from the primary at this rest, in its axes, where physics does not
    /// confirm the primary.
    fn apart_at_rest(
        &self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        fewest: u64,
        valid: [bool; 2],
    ) -> [Option<Vector3<T>>; UNITS] {
        let measured = |number: usize| {
            let at_rest = self.rest_means.get(number)?;
            let rested = u64::from(at_rest.windows()) >= fewest.max(1);
            let mean = sensor.triad(at_rest.mean());
            self.compensated(platform, number, sensor, &mean)
                .filter(|_| rested)
        };
        let primary = measured(0);
        core::array::from_fn(|number| {
            let stored = sensor.of(self.stored.get(number)?);
            let complete = platform.units().get(number)?.axes.complete(sensor);
            let sound = self.health.get(number).is_some_and(Health::is_sound);
            let known = stored.calibrated && !stored.stale;
            let primary = primary.filter(|_| number != 0 && known && complete && sound)?;
            let of_primary = platform.primary_axes();
            let apart = of_primary.present(sensor, &(measured(number)? - primary));
            // A sensor with a missing axis cannot prove the others.
            let proven = *sensor.of(&valid) && of_primary.complete(sensor);
            Some(match (proven, sensor) {
                (false, _) => apart,
                (true, Sensor::Accelerometer) => across(&apart, &primary),
                (true, Sensor::Gyroscope) => zeros(),
            })
        })
    }

    /// Confirms corrections that a valid primary proves at rest: along gravity, and of gyroscopes about all
    /// axes.
    fn prove(&mut self, platform: &Platform<T, UNITS>, valid: [bool; 2]) -> Option<()> {
        let primary = self.rest_means.first()?.mean();
        let secondaries = platform.units().iter().skip(1);
        for (unit, stored) in secondaries.zip(self.stored.of_secondaries_mut()) {
            let both = SENSORS.into_iter().zip(stored).zip(valid);
            let complete = |sensor: Sensor| platform.primary_axes().complete(sensor);
            for ((sensor, stored), _) in both.filter(|((sensor, _), valid)| *valid && complete(*sensor)) {
                stored.prove(
                    sensor,
                    &product(&unit.sensor_from_primary, &sensor.triad(primary)),
                );
            }
        }
        Some(())
    }

    fn evaluate_primary(
        &mut self,
        platform: &Platform<T, UNITS>,
        fewest: u64,
        time: u64,
        reports: bool,
        report: Report<'_, T>,
    ) -> [Option<Deviation<T>>; 2] {
        let settings = platform.settings();
        let units = platform.units().first().zip(self.rest_means.first());
        let (Some((unit, at_rest)), Some(health)) = (units, self.health.first_mut()) else {
            return [None; 2];
        };
        if u64::from(at_rest.windows()) < fewest.max(1) {
            return [None; 2];
        }
        let rest = &mut self.rest;
        SENSORS.map(|sensor| {
            let primary = PrimaryAtRest {
                sensor,
                unit,
                mean: sensor.triad(at_rest.mean()),
                calibration: platform.calibration(),
            };
            let deviation = primary.deviation(&settings.evaluation);
            let off = primary.off_physics(Data::Compensated, settings.evaluation.gravity);
            health.at_rest(sensor, off, settings.health.rest.of(sensor));
            // A rest shows the source as it is, whether or not an evaluation was due.
            let is_news = rest.shows(sensor, deviation.exceeds());
            if reports || is_news {
                report(Event {
                    time,
                    unit: 0,
                    kind: evaluated(sensor, Check::Norm, &deviation),
                });
            }
            Some(deviation)
        })
    }

    /// Sensors of the primary that others may be calibrated against: those that agree with physics, and
    /// uncalibrated ones whose deviation is within their grade and shared by other units.
    #[inline(never)]
    fn trusted(
        &self,
        platform: &Platform<T, UNITS>,
        fewest: u64,
        deviations: &[Option<Deviation<T>>; 2],
        proven: [bool; 2],
    ) -> [bool; 2] {
        let mut trusted = proven;
        for ((sensor, trusted), deviation) in SENSORS.into_iter().zip(&mut trusted).zip(deviations) {
            let settings = &platform.settings().evaluation;
            let unknown = settings.vector_check && !platform.calibration().is_known(sensor);
            if let Some(deviation) = deviation.filter(|_| unknown && !*trusted) {
                *trusted = deviation.value <= settings.uncalibrated.of(sensor)
                    && self.shares_deviation(platform, sensor, fewest, deviation.value);
            }
        }
        trusted
    }

    /// Returns whether other units share the deviation of the primary at this rest: most calibrated secondaries
    /// agree with it, or, if none is calibrated and there are several, one deviates at least half as much.
    fn shares_deviation(
        &self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        fewest: u64,
        deviation: T,
    ) -> bool {
        let settings = &platform.settings().evaluation;
        let most = settings.thresholds.secondary.of(sensor).least();
        let (mut alike, mut not, mut off) = (0_u32, 0_u32, false);
        for number in 1..UNITS {
            let at_rest = self.rest_means.get(number).map_or(0, RestMean::windows);
            let sound = self.health.get(number).is_some_and(Health::is_sound);
            let stored = self.stored.get(number).map(|stored| sensor.of(stored));
            let Some(stored) = stored.filter(|_| sound && u64::from(at_rest) >= fewest.max(1)) else {
                continue;
            };
            if stored.calibrated && !stored.stale {
                let apart = self.apart_from_primary(platform, sensor, number);
                let agrees = apart.is_some_and(|apart| apart.length() <= most);
                alike += u32::from(agrees);
                not += u32::from(!agrees);
            } else if UNITS > 2 {
                let own = self
                    .at_rest_measured(platform, number)
                    .map(|own| sensor.of(&own).abs());
                off |= own.is_some_and(|own| own >= deviation * real(AS_WELL));
            }
        }
        if alike + not > 0 {
            alike > 0 && alike >= not
        } else {
            off
        }
    }

    /// Abandons calibrations whose primary turned out invalid.
    fn abandon_if_primary_invalid(
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

    #[inline(never)]
    fn evaluate_secondary(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        fewest: u64,
        (trust, purpose): (PrimaryTrust, Purpose),
        time: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        let settings = platform.settings();
        let primary_healthy = self.health.first()?.healthy_since().is_some();
        let primary = *self.rest_means.first()?.mean();
        let (unit, at_rest) = (platform.units().get(number)?, self.rest_means.get(number)?);
        if u64::from(at_rest.windows()) < fewest.max(1) {
            return None;
        }
        let (primary_valid, [force_proven, _]) = (trust.valid, trust.proven);
        let force = Sensor::Accelerometer;
        let up = platform.calibration().correct(force, &force.triad(&primary));
        let points = force_proven && primary_healthy && platform.primary_axes().complete(force);
        let up = unit_beyond(&up, T::default_epsilon()).filter(|_| points);
        let comparable = platform.comparable(unit);
        // A deviation that several independently calibrated units share is that of the primary.
        let shared = SENSORS.map(|sensor| self.is_shared(platform, sensor, number));
        let disputed = SENSORS.map(|sensor| self.is_contested(sensor));
        let (stored, health) = (self.stored.get(number)?, self.health.get_mut(number)?);
        let (mut exceeded, mut apart) = ([false; 2], [None; 2]);
        for ((sensor, exceeded), valid) in SENSORS.into_iter().zip(&mut exceeded).zip(primary_valid) {
            if !unit.axes.any(sensor) {
                continue;
            }
            let secondary = SecondaryAtRest {
                sensor,
                unit,
                mean: sensor.triad(at_rest.mean()),
                stored: sensor.of(stored),
                calibration: platform.calibration(),
                comparable: &comparable,
                up,
            };
            // Axes that the primary lacks cannot be calibrated against it.
            let shown = unit.axes.within(&comparable, sensor) || !settings.evaluation.vector_check;
            let shown = shown && comparable.any(sensor);
            let mut emit = |check, deviation: &Deviation<T>| {
                // Beside a primary that deviates itself, only the difference from it counts.
                let counts = match check {
                    Check::Norm => shown && !trust.is_relative(sensor),
                    Check::Vector => true,
                };
                *exceeded |= deviation.exceeds() && counts;
                if purpose == Purpose::Health {
                    return;
                }
                let kind = evaluated(sensor, check, deviation);
                report(Event {
                    time,
                    unit: number,
                    kind,
                });
            };
            // Independently of the data that trigger, an error that is known and corrected is no fault.
            if let Some(off) = secondary.off_physics(Data::Compensated, settings.evaluation.gravity) {
                let limit = settings.plausible_at_rest(sensor, secondary.stored.calibrated);
                health.at_rest(sensor, off, limit);
            }
            if let Some(deviation) = secondary.norm(&settings.evaluation) {
                emit(Check::Norm, &deviation);
            }
            if settings.evaluation.vector_check && valid && primary_healthy && comparable.any(sensor) {
                let deviation = secondary.vector(&sensor.triad(&primary), &settings.evaluation);
                emit(Check::Vector, &deviation);
                *sensor.of_mut(&mut apart) = Some(deviation).filter(|_| !*sensor.of(&shared));
            }
        }
        let findings = Findings {
            exceeded,
            primary_valid,
            primary_healthy,
            secondary_healthy: health.may_be_calibrated(),
            disputed,
        };
        for (stored, deviation) in self.stored.get_mut(number)?.iter_mut().zip(apart) {
            deviation.iter().for_each(|deviation| stored.compare(deviation));
        }
        if purpose == Purpose::Health {
            return None;
        }
        let asked = purpose == Purpose::Calibration;
        self.trigger(platform, number, &findings, asked, time, report)
    }

    fn trigger(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        findings: &Findings,
        asked: bool,
        time: u64,
        report: Report<'_, T>,
    ) -> Option<()> {
        let evaluation = &platform.settings().evaluation;
        let mut decisions = evaluation.gate.decide(findings);
        let active = self.calibrations.iter().flatten();
        let already = active
            .map(CalibrationRun::secondary)
            .any(|secondary| secondary == number);
        let full = self.calibrations.iter().all(Option::is_some);
        for (sensor, decision) in SENSORS.into_iter().zip(&mut decisions) {
            if *decision == Decision::Trigger {
                *decision = match (asked, already || full) {
                    (false, _) => Decision::Withheld(Withheld::OnCommandOnly),
                    (true, true) => Decision::Withheld(Withheld::AlreadyCalibrating),
                    (true, false) => Decision::Trigger,
                };
            }
            if let Decision::Withheld(why) = *decision {
                let kind = EventKind::Withheld { sensor, why };
                report(Event {
                    time,
                    unit: number,
                    kind,
                });
            }
        }
        let triggers = decisions.map(|decision| decision == Decision::Trigger);
        if triggers == [false; 2] {
            if decisions == [Decision::Quiet; 2] {
                self.rest.settled(number);
            }
            return None;
        }
        let unit = platform.units().get(number)?;
        let sensors = match platform.settings().collection.scope {
            Scope::TriggeringSensor => triggers,
            Scope::AllSensors => SENSORS.map(|sensor| {
                platform.comparable(unit).any(sensor)
                    && evaluation.gate.trusts(findings.primary_valid, sensor)
            }),
        };
        let (primary, secondary) = (self.rest_means.first()?, self.rest_means.get(number)?);
        let rest = RestBefore {
            primary: *primary.mean(),
            variance: primary.variance(),
            secondary: *secondary.mean(),
        };
        let slot = self.calibrations.iter_mut().find(|slot| slot.is_none())?;
        *slot = Some(CalibrationRun::new(number, sensors, time, rest));
        self.rest.triggered(number);
        let kind = EventKind::Triggered { sensors };
        report(Event {
            time,
            unit: number,
            kind,
        });
        Some(())
    }
}

/// Difference from the primary that siblings share with this secondary: at least as many of them are nearer to
/// it than to the primary as not (docs/theory/redundancy.md, eq. 22).
fn shared<T: Real, const UNITS: usize>(apart: &[Option<Vector3<T>>; UNITS], number: usize) -> T {
    let Some(own) = apart.get(number).copied().flatten() else {
        return T::zero();
    };
    let siblings = apart.iter().enumerate().filter(|(other, _)| *other != number);
    let (mut shared, mut not) = (0_u32, 0_u32);
    for apart in siblings.filter_map(|(_, apart)| *apart) {
        let alike = squared(&(apart - own)) < squared(&apart); // eq. 22
        shared += u32::from(alike);
        not += u32::from(!alike);
    }
    if shared > 0 && shared >= not {
        own.length()
    } else {
        T::zero()
    }
}

/// Event of an evaluated deviation.
fn evaluated<T: Real>(sensor: Sensor, check: Check, deviation: &Deviation<T>) -> EventKind<T> {
    EventKind::Evaluated {
        sensor,
        check,
        deviation: deviation.value,
        threshold: deviation.threshold,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_shared_where_siblings_have_it_too() {
        let own = Vector3::new(0.1, 0.0, -0.2);
        let at = |apart: [Option<f64>; 3]| {
            let apart = apart.map(|share| share.map(|share| own * share));
            shared::<f64, 4>(&[Some(own), apart[0], apart[1], apart[2]], 0)
        };
        assert_eq!(at([None; 3]), 0.0);
        assert_eq!(at([Some(0.0); 3]), 0.0);
        assert_eq!(at([Some(0.0), Some(1.0), Some(0.0)]), 0.0);
        for alike in [
            [Some(1.0), None, None],
            [Some(0.9), Some(1.2), Some(0.0)],
            [None, Some(0.0), Some(1.0)],
        ] {
            assert_eq!(at(alike), own.length());
        }
        assert_eq!(shared::<f64, 2>(&[None, Some(own)], 0), 0.0);
    }
}
