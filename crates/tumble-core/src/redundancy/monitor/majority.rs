//! Decisions of three and more units, by one model of their errors (docs/theory/set.md).
//!
//! The model judges sets of three units and more, and of two beside an aiding measurement, each with all axes and fast enough, from
//! when clocks may be known. Comparison of pairs judges slow sets, single axes, and two units without an aiding measurement.

use nalgebra::Vector3;

use crate::products::{Length, matrix_product, transposed_product, zeros};
use crate::real::{Real, real, seconds};
use crate::redundancy::aiding::{AidedReading, AidingWindow};
use crate::redundancy::components::{difference, larger};
use crate::redundancy::evaluation::{StoredCalibration, StoredCalibrations};
use crate::redundancy::health::{Health, HealthFault};
use crate::redundancy::isolation::attribution::Ground;
use crate::redundancy::model::error::{Parameters, SecondaryErrors};
use crate::redundancy::model::monitor::{CorrectedWindow, SetEvent, SetEventKind, SetMonitor};
use crate::redundancy::model::own::Reason;
use crate::redundancy::model::table::{HOP, STORED, UNCALIBRATED};
use crate::redundancy::model::test::Exceedance;
use crate::redundancy::monitor::aiding::AidingChannel;
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::{Monitor, Report};
use crate::redundancy::output::lever_arm;
use crate::redundancy::platform::{MountedUnit, Platform};
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::settings::AdoptionSettings;
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::redundancy::unit_set::{UnitSet, pairs};
use crate::sample::{CHANNELS, Sample};

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Gives a usable sample to the model, and acts on what its windows show.
    #[inline(never)]
    pub(super) fn judge(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        sample: &Sample<T>,
        usable: [bool; 2],
        report: Report<'_, T>,
    ) -> Option<()> {
        if usable != [true; 2] || !self.is_of_majority(platform) {
            return None;
        }
        if !self.majority_begun {
            self.begin_majority(platform);
        }
        let unit = platform.units().get(number)?;
        let turned = |reading| transposed_product(&unit.sensor_from_primary, reading);
        let sample = Sample {
            time: sample.time,
            specific_force: turned(&sample.specific_force),
            angular_rate: turned(&sample.angular_rate),
        };
        let absent = UnitSet::of::<UNITS>(|number| !self.lives(number));
        let decides = self.majority_decides;
        let gravity = platform.settings().evaluation.gravity;
        let (health, stored, named) = (&mut self.health, &mut self.stored, &mut self.named);
        let model = self.majority.as_mut().first_mut()?;
        let (windows, sound) = (model.windows(), model.sound());
        model.leave_out(absent);
        let mut evidence = self
            .aiding_channel
            .first_mut()
            .and_then(|channel| channel.aiding_evidence.as_mut())
            .filter(|_| decides);
        let mut see = |window: &CorrectedWindow<'_, T, UNITS>| {
            if let Some(evidence) = &mut evidence {
                evidence.advance(&aiding_window(window, gravity));
            }
        };
        let mut tell = |event: &SetEvent<T>| {
            if !decides {
                return;
            }
            let time = event.time;
            let kind = |unit, kind| Event { time, unit, kind };
            match event.kind {
                SetEventKind::Unhealthy {
                    reason,
                    finding,
                    together,
                } => {
                    if let Some((unit, finding)) = event.unit.zip(finding) {
                        named.insert(unit);
                        let fault = fault_of(&finding, reason, sound.without(together));
                        contradict_sensors(stored, health, unit, &fault);
                    }
                }
                SetEventKind::Disagree { other, finding } => {
                    let told = EventKind::Disagree {
                        sensor: finding.sensor,
                        other,
                        apart: finding.apart,
                        limit: finding.limit(),
                        scale: finding.seconds,
                    };
                    event.unit.into_iter().for_each(|unit| report(kind(unit, told)));
                }
                SetEventKind::Agree { other, sensor } => {
                    let told = EventKind::Agree { sensor, other };
                    event.unit.into_iter().for_each(|unit| report(kind(unit, told)));
                }
                SetEventKind::Healthy | SetEventKind::Selected { .. } => {}
            }
        };
        model.push_seen(number, &sample, &mut tell, &mut see);
        if model.windows() != windows {
            self.decide_by_aiding();
            self.clear_sound();
        }
        Some(())
    }

    /// Names one of the last two units, where they disagree and an aiding measurement contradicts it.
    #[inline(never)]
    fn decide_by_aiding(&mut self) -> Option<()> {
        let model = self.majority.as_ref().first().filter(|_| self.majority_decides)?;
        let (pair, sensor) = model.two_disputed()?;
        let evidence = self.aiding_channel.first()?.aiding_evidence.as_ref()?;
        let (unit, proof) = evidence.decides(pair, true)?;
        self.mark_wrong(
            unit,
            &HealthFault::Isolated {
                sensor,
                ground: proof.ground,
                value: proof.value,
                limit: proof.limit,
            },
        );
        Some(())
    }

    /// Returns whether an aiding measurement was received.
    fn is_aided(&self) -> bool {
        let is_aided = |channel: &AidingChannel<T, UNITS>| channel.aiding_evidence.is_some();
        self.aiding_channel.iter().any(is_aided)
    }

    /// Returns whether the model takes samples of the set: all units have all axes, and two an aiding measurement beside them.
    fn is_of_majority(&self, platform: &Platform<T, UNITS>) -> bool {
        !self.majority.as_ref().is_empty()
            && (UNITS > 2 || self.is_aided())
            && platform.units().iter().all(|unit| unit.axes == Axes::ALL)
    }

    /// Clears units that count again.
    fn clear_sound(&mut self) -> Option<()> {
        let sound = self.majority.as_ref().first()?.sound();
        for number in self.named.and(sound).units() {
            self.clear(number);
        }
        Some(())
    }

    /// Returns whether the model decides in this window; hands decisions over where that changes.
    pub(super) fn decides(&mut self, platform: &Platform<T, UNITS>) -> bool {
        let decides =
            self.is_of_majority(platform) && !self.majority.as_ref().iter().any(SetMonitor::is_slow);
        if decides != self.majority_decides {
            self.hand_over(decides);
        }
        self.majority_decides = decides;
        decides
    }

    /// Hands units that were named over to the model, or to the comparison of pairs.
    #[cold]
    fn hand_over(&mut self, to_model: bool) {
        for number in self.named.units() {
            for sensor in SENSORS {
                let health = self.health.get(number);
                if to_model {
                    self.isolator.begin_anew(sensor, number);
                } else if health.is_some_and(|health| health.is_contradicted(sensor)) {
                    self.isolator.exclude(sensor, number);
                }
            }
        }
        self.isolator.leave();
    }

    /// Returns whether the last two units disagree.
    pub(super) fn is_disputed(&self, sensor: Sensor) -> bool {
        let is_open = |model: &SetMonitor<T, UNITS>| model.is_disputed();
        self.isolator.is_disputed(sensor)
            || (self.majority_decides && self.majority.as_ref().iter().any(is_open))
    }

    /// Returns whether two calibrated siblings of a secondary moved from the primary alike since their calibrations: it is
    /// the primary that moved, and nothing is learnt from it.
    #[inline(never)]
    pub(super) fn is_primary_moved(
        &self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        number: usize,
    ) -> bool {
        if self.majority.as_ref().is_empty() {
            return false;
        }
        let most = platform
            .settings()
            .evaluation
            .thresholds
            .secondary
            .of(sensor)
            .least();
        let shifts: [_; UNITS] = core::array::from_fn(|other| {
            let shift = self.shift(platform, sensor, other).filter(|_| other != number);
            shift.filter(|shift| shift.length() > most)
        });
        let alike = |first: &Vector3<T>, second: &Vector3<T>| {
            difference(first, second).length() < first.length() * real(ALIKE)
        };
        pairs::<UNITS>().any(|[i, j]| {
            let both = shifts
                .get(i)
                .copied()
                .flatten()
                .zip(shifts.get(j).copied().flatten());
            both.is_some_and(|(first, second)| alike(&first, &second))
        })
    }

    /// Change of the error of a calibrated secondary from the stored one to the model's, along the specific force of the primary or at
    /// rest, m/s^2 or rad/s.
    fn shift(&self, platform: &Platform<T, UNITS>, sensor: Sensor, number: usize) -> Option<Vector3<T>> {
        let model = self.majority.as_ref().first()?;
        let stored = self.stored.get(number)?;
        let is_sound = self.health.get(number).is_some_and(Health::is_sound);
        if !is_sound || !sensor.of(stored).calibrated || sensor.of(stored).stale {
            return None;
        }
        let unit = platform.units().get(number)?;
        let (now, then) = (model.errors(number)?.mean(), stored_mean(unit, stored));
        let felt = match sensor {
            Sensor::Accelerometer => sensor.triad(self.means(0)?),
            Sensor::Gyroscope => zeros(),
        };
        let mut shift: Vector3<T> = zeros();
        let rows = sensor.of(&now.rows).iter().zip(sensor.of(&then.rows));
        for (place, ([a, b, c, now], [x, y, z, then])) in shift.iter_mut().zip(rows) {
            *place = (*a - *x) * felt.x + (*b - *y) * felt.y + (*c - *z) * felt.z + *now - *then;
        }
        Some(shift)
    }

    /// Marks a unit as wrong that physics contradicts.
    pub(super) fn mark_wrong(&mut self, number: usize, fault: &HealthFault<T>) {
        self.named.insert(number);
        contradict_sensors(&mut self.stored, &mut self.health, number, fault);
        for model in self.majority.as_mut() {
            model.exclude(number);
        }
    }

    /// Clears both sensors of a unit that comparison found wrong.
    fn clear(&mut self, number: usize) {
        self.named.remove(number);
        for sensor in SENSORS {
            self.clear_sensor(sensor, number);
        }
    }

    /// Clears a sensor of a unit that comparison found wrong.
    pub(super) fn clear_sensor(&mut self, sensor: Sensor, number: usize) {
        if let Some(health) = self.health.get_mut(number) {
            health.clear(sensor);
        }
        if let Some(stored) = self.stored.get_mut(number) {
            sensor.of_mut(stored).freed = false;
        }
    }

    /// Lets the majority count a unit again whose sensors are cleared.
    pub(super) fn readmit(&mut self, number: usize) {
        let is_contradicted =
            |health: &Health<T>| SENSORS.iter().any(|sensor| health.is_contradicted(*sensor));
        if self.named.contains(number) && !self.health.get(number).is_some_and(is_contradicted) {
            self.named.remove(number);
            for model in self.majority.as_mut() {
                model.readmit(number);
            }
        }
    }

    /// Returns whether comparison found a sensor of a unit faulty.
    pub(super) fn is_named(&self, sensor: Sensor, number: usize) -> bool {
        let is_contradicted = |health: &Health<T>| health.is_contradicted(sensor);
        self.isolator.is_faulty(sensor, number)
            || (self.named.contains(number) && self.health.get(number).is_some_and(is_contradicted))
    }

    /// Gives the model the stored errors of all secondaries, and the largest errors of a sound unit.
    #[cold]
    fn begin_majority(&mut self, platform: &Platform<T, UNITS>) {
        self.majority_begun = true;
        let settings = platform.settings();
        let primary = SENSORS.map(|sensor| settings.evaluation.uncalibrated.of(sensor));
        let any = SENSORS.map(|sensor| settings.plausible_at_rest(sensor, false));
        for model in self.majority.as_mut() {
            model.set_limits([primary, any]);
        }
        for number in 1..UNITS {
            self.state_errors(platform, number);
        }
    }

    /// Gives the model the stored errors of a secondary.
    pub(super) fn state_errors(&mut self, platform: &Platform<T, UNITS>, number: usize) -> Option<()> {
        let model = self.majority.as_mut().first_mut()?;
        let (unit, adoption) = (platform.units().get(number)?, &platform.settings().adoption);
        let stored = self.stored.get(number)?;
        let errors = SecondaryErrors::new(&stored_mean(unit, stored), &stored_sigmas(unit, stored, adoption));
        model.set_errors(number, &errors);
        Some(())
    }
}

/// Marks the sensors of a unit as faulty that a fault concerns.
fn contradict_sensors<T: Real, const UNITS: usize>(
    stored: &mut StoredCalibrations<T, UNITS>,
    health: &mut [Health<T>; UNITS],
    unit: usize,
    fault: &HealthFault<T>,
) where
    Units<UNITS>: UnitCount,
{
    // Samples that are missing are those of both sensors.
    let concerned = fault.figures().sensor;
    for sensor in SENSORS
        .into_iter()
        .filter(|sensor| concerned.is_none_or(|own| own == *sensor))
    {
        contradict(stored, health, sensor, unit, fault);
    }
}

/// Marks a sensor of a unit as faulty.
pub(super) fn contradict<T: Real, const UNITS: usize>(
    stored: &mut StoredCalibrations<T, UNITS>,
    health: &mut [Health<T>; UNITS],
    sensor: Sensor,
    unit: usize,
    fault: &HealthFault<T>,
) where
    Units<UNITS>: UnitCount,
{
    if let Some(stored) = stored.get_mut(unit) {
        sensor.of_mut(stored).freed = fault.frees();
    }
    if let Some(health) = health.get_mut(unit) {
        health.contradict(sensor, *fault);
    }
}

/// Window of the model, for the comparison with aiding measurements.
fn aiding_window<T: Real, const UNITS: usize>(
    window: &CorrectedWindow<'_, T, UNITS>,
    gravity: T,
) -> AidingWindow<T, UNITS> {
    let mut readings = [None; UNITS];
    for (place, (channels, noise)) in readings.iter_mut().zip(window.readings.iter().zip(window.noise)) {
        let reading = |channels: &[T; CHANNELS]| AidedReading {
            reading: SENSORS.map(|sensor| sensor.triad(channels)),
            noise,
        };
        *place = channels.as_ref().map(reading);
    }
    AidingWindow {
        readings,
        faulty: UnitSet::of::<UNITS>(|unit| !window.active.contains(unit)),
        departing: window.disputed,
        is_calm: window.disputed.count() == 0,
        rests: window.is_rest,
        number: window.number,
        span: HOP,
        length: seconds(HOP),
        gravity,
    }
}

/// The fault of a unit that a finding shows beside units that agree.
fn fault_of<T: Real>(finding: &Exceedance<T>, reason: Reason, agreeing: UnitSet) -> HealthFault<T> {
    let (sensor, limit) = (finding.sensor, finding.limit());
    match reason {
        Reason::Rest => HealthFault::Isolated {
            sensor,
            ground: Ground::Rest,
            value: finding.apart,
            limit,
        },
        Reason::Noisy => HealthFault::Noisy {
            sensor,
            scatter: finding.apart,
            limit,
        },
        Reason::Lossy => HealthFault::Lossy {
            share: finding.apart,
            limit,
        },
        _ => HealthFault::OutOfFamily {
            sensor,
            apart: finding.apart,
            limit,
            scale: finding.seconds,
            agreeing: agreeing.bits(),
        },
    }
}

/// Share of a shift by which two that are alike differ at most.
const ALIKE: f64 = 0.5;

/// Sigmas of the largest error that a calibration may have, inverted.
const THIRD: f64 = 1.0 / 3.0;

/// Errors of a secondary in the axes of the primary, as far as they are stored.
fn stored_mean<T: Real>(unit: &MountedUnit<T>, stored: &[StoredCalibration<T>; 2]) -> Parameters<T> {
    let mut mean = Parameters::zero();
    let turn = &unit.sensor_from_primary;
    for (rows, stored) in mean.rows.iter_mut().zip(stored) {
        if !stored.calibrated {
            continue;
        }
        let matrix = matrix_product(&turn.transpose(), &matrix_product(&stored.error.matrix, turn));
        let bias = transposed_product(turn, &stored.error.bias);
        let of_matrix = matrix.row_iter().zip(bias.iter()).enumerate();
        for ((axis, (row, bias)), place) in of_matrix.zip(rows) {
            let values = row.iter().copied().enumerate();
            let relative =
                values.map(|(column, value)| if column == axis { value - T::one() } else { value });
            for (to, from) in place.iter_mut().zip(relative.chain([*bias])) {
                *to = from;
            }
        }
    }
    let arm = lever_arm(unit, Some(stored));
    for (to, from) in mean.arm.iter_mut().zip(arm.iter()) {
        *to = *from;
    }
    mean
}

/// Standard deviations of stored errors. The largest errors that a calibration may have are three sigmas of all others.
fn stored_sigmas<T: Real>(
    unit: &MountedUnit<T>,
    stored: &[StoredCalibration<T>; 2],
    adoption: &AdoptionSettings<T>,
) -> Parameters<T> {
    let mut sigmas = Parameters::of_grade(&UNCALIBRATED);
    let known = Parameters::of_grade(&STORED);
    let m = larger(adoption.largest_scale_error, adoption.largest_misalignment) * real(THIRD);
    let sensors = SENSORS.into_iter().zip(stored);
    for ((rows, known), (sensor, stored)) in sigmas.rows.iter_mut().zip(&known.rows).zip(sensors) {
        *rows = [[m, m, m, adoption.bias.of(sensor) * real(THIRD)]; 3];
        for (sigmas, [a, b, c, bias]) in rows.iter_mut().zip(known).filter(|_| stored.calibrated) {
            let [x, y, z, _] = *sigmas;
            *sigmas = if stored.matrix_shown {
                [*a, *b, *c, *bias]
            } else {
                [x, y, z, *bias]
            };
        }
    }
    let [accelerometer, _] = stored;
    let place = if unit.lever_arm.is_some() {
        T::zero()
    } else {
        accelerometer.place_sigma
    };
    if place < real(UNCALIBRATED.arm) {
        sigmas.arm = [larger(place, real(STORED.arm)); 3];
    }
    sigmas
}
