//! Decisions of three and more units, by one model of their errors (docs/theory/set.md).
//!
//! The model judges while three units count or more, each with all axes and fast enough. Comparison of pairs judges otherwise:
//! before the model knows the clocks, between the last two units, and in slow sets.

use crate::products::{matrix_product, transposed_product};
use crate::real::{Real, real};
use crate::redundancy::components::{larger, sum};
use crate::redundancy::evaluation::StoredCalibration;
use crate::redundancy::health::{Health, HealthFault};
use crate::redundancy::model::error::{Parameters, SecondaryErrors};
use crate::redundancy::model::monitor::{SetEvent, SetEventKind};
use crate::redundancy::model::own::Reason;
use crate::redundancy::model::table::{SLOWEST, STORED, UNCALIBRATED};
use crate::redundancy::model::test::Finding;
use crate::redundancy::monitor::Monitor;
use crate::redundancy::output::lever_arm;
use crate::redundancy::platform::{MountedUnit, Platform};
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::redundancy::unit_set::UnitSet;
use crate::sample::Sample;

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Gives a usable sample to the model, and takes over what its windows show.
    #[inline(never)]
    pub(super) fn judge(
        &mut self,
        platform: &Platform<T, UNITS>,
        number: usize,
        sample: &Sample<T>,
        usable: [bool; 2],
    ) -> Option<()> {
        if usable != [true; 2] || !self.is_of_majority(platform) {
            return None;
        }
        let unit = platform.units().get(number)?;
        let turned = |reading| transposed_product(&unit.sensor_from_primary, reading);
        let sample = Sample {
            time: sample.time,
            specific_force: turned(&sample.specific_force),
            angular_rate: turned(&sample.angular_rate),
        };
        let absent = UnitSet::of::<UNITS>(|number| !self.lives(number));
        let (health, stored, named) = (&mut self.health, &mut self.stored, &mut self.named);
        let model = self.majority.as_mut().first_mut()?;
        let windows = model.windows();
        model.leave_out(absent);
        let mut found = None;
        model.push(number, &sample, &mut |event| found = named_unit(event).or(found));
        if let Some((unit, finding, reason)) = found {
            let fault = fault_of(&finding, reason, model.sound());
            let sensor = finding.sensor;
            if let Some(stored) = stored.get_mut(unit) {
                sensor.of_mut(stored).freed = fault.frees();
            }
            health.get_mut(unit)?.contradict(sensor, fault);
            named.insert(unit);
        }
        if model.windows() != windows {
            self.take_over();
        }
        Some(())
    }

    /// Returns whether a majority of the set can be judged by the model: all units have all axes, and none is slow.
    fn is_of_majority(&self, platform: &Platform<T, UNITS>) -> bool {
        let units = platform.units().iter().enumerate();
        !self.majority.as_ref().is_empty()
            && units
                .into_iter()
                .all(|(number, unit)| unit.axes == Axes::ALL && self.clock.interval(number) <= SLOWEST)
    }

    /// Clears units that count again, and hands decisions over where the majority begins or ends.
    fn take_over(&mut self) -> Option<()> {
        let sound = self.majority.as_ref().first()?.sound();
        let decides = sound.count() > 2;
        if decides {
            for number in self.named.and(sound).units() {
                self.clear(number);
            }
        }
        if decides != self.majority_decides {
            for number in self.named.units() {
                for sensor in SENSORS {
                    if decides {
                        self.isolator.begin_anew(sensor, number);
                    } else if self
                        .health
                        .get(number)
                        .is_some_and(|health| health.is_contradicted(sensor))
                    {
                        self.isolator.exclude(sensor, number);
                    }
                }
            }
            self.isolator.leave();
        }
        self.majority_decides = decides;
        Some(())
    }

    /// Clears both sensors of a unit that comparison found wrong.
    fn clear(&mut self, number: usize) {
        self.named.remove(number);
        for sensor in SENSORS {
            if let Some(health) = self.health.get_mut(number) {
                health.clear(sensor);
            }
            if let Some(stored) = self.stored.get_mut(number) {
                sensor.of_mut(stored).freed = false;
            }
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

    /// Tells the model what is stored of a secondary.
    pub(super) fn state_errors(&mut self, platform: &Platform<T, UNITS>, number: usize) -> Option<()> {
        let errors = stored_errors(platform.units().get(number)?, self.stored.get(number)?);
        self.majority.as_mut().first_mut()?.set_errors(number, &errors);
        Some(())
    }
}

/// Unit that others or its own noise show wrong; what else its samples show is found as they come.
fn named_unit<T: Real>(event: &SetEvent<T>) -> Option<(usize, Finding<T>, Reason)> {
    match event.kind {
        SetEventKind::Unhealthy { reason, finding } => Some((event.unit?, finding?, reason)),
        _ => None,
    }
}

/// The fault that a finding shows, while some units agree.
fn fault_of<T: Real>(finding: &Finding<T>, reason: Reason, agreeing: UnitSet) -> HealthFault<T> {
    let (sensor, limit) = (finding.sensor, finding.apart / finding.ratio);
    match reason {
        Reason::Noisy => HealthFault::Noisy {
            sensor,
            scatter: finding.apart,
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

/// Errors of a secondary in the axes of the primary, as far as they are stored.
fn stored_errors<T: Real>(unit: &MountedUnit<T>, stored: &[StoredCalibration<T>; 2]) -> SecondaryErrors<T> {
    let mut mean = Parameters::zero();
    let mut sigmas = Parameters::of_grade(&UNCALIBRATED);
    let known = Parameters::of_grade(&STORED);
    let turn = &unit.sensor_from_primary;
    for (which, sensor) in SENSORS.into_iter().enumerate() {
        let stored = sensor.of(stored);
        let (Some(rows), Some(sigmas), Some(known)) = (
            mean.rows.get_mut(which),
            sigmas.rows.get_mut(which),
            known.rows.get(which),
        ) else {
            continue;
        };
        if !stored.calibrated {
            continue;
        }
        let matrix = matrix_product(&turn.transpose(), &matrix_product(&stored.error.matrix, turn));
        let bias = sum(&transposed_product(turn, &stored.error.bias), &stored.trimmed);
        let of_matrix = matrix.row_iter().zip(bias.iter()).enumerate();
        for ((axis, (row, bias)), place) in of_matrix.zip(rows) {
            let values = row.iter().copied().enumerate();
            let relative =
                values.map(|(column, value)| if column == axis { value - T::one() } else { value });
            for (to, from) in place.iter_mut().zip(relative.chain([*bias])) {
                *to = from;
            }
        }
        for (sigmas, [a, b, c, bias]) in sigmas.iter_mut().zip(known) {
            let [x, y, z, _] = *sigmas;
            *sigmas = if stored.matrix_shown {
                [*a, *b, *c, *bias]
            } else {
                [x, y, z, *bias]
            };
        }
    }
    let arm = lever_arm(unit, Some(stored));
    for (to, from) in mean.arm.iter_mut().zip(arm.iter()) {
        *to = *from;
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
    SecondaryErrors::new(&mean, &sigmas)
}
