//! Restoring of stored calibrations after a reset.

use crate::products::Length;
use crate::real::Real;
use crate::redundancy::evaluation::factory_error;
use crate::redundancy::monitor::event::{Abandoned, Event, EventKind, RecordRejection};
use crate::redundancy::monitor::{Monitor, Report, abandon};
use crate::redundancy::platform::{MountedUnit, Platform};
use crate::redundancy::record::{Record, Storage};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::sensor::SENSORS;
use crate::redundancy::unit_count::{UnitCount, Units};

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Restores all stored records of the secondaries after a reset. The caller saves later adopted records,
    /// reported by events, in the same storage.
    ///
    /// # Errors
    /// First error of the storage; the other records are restored all the same.
    pub fn restore_from<S: Storage<T>>(
        &mut self,
        platform: &Platform<T, UNITS>,
        storage: &mut S,
        report: Report<'_, T>,
    ) -> Result<(), S::Error> {
        let mut outcome = Ok(());
        for unit in platform.units().iter().skip(1) {
            for sensor in SENSORS.into_iter().filter(|sensor| unit.axes.any(*sensor)) {
                match storage.load(unit.identity, sensor) {
                    Ok(Some(record)) => self.restore(platform, &record, report),
                    Ok(None) => {}
                    Err(error) => outcome = outcome.and(Err(error)),
                }
                match storage.load_factory(unit.identity, sensor) {
                    Ok(record) => record
                        .iter()
                        .for_each(|record| self.restore_factory(platform, record)),
                    Err(error) => outcome = outcome.and(Err(error)),
                }
            }
        }
        outcome
    }

    /// Restores the error that a sensor had from the factory, from which thresholds may be counted; skips a
    /// record of another set. The calibration in use stays.
    pub fn restore_factory(&mut self, platform: &Platform<T, UNITS>, record: &Record<T>) {
        let (sensor, settings) = (record.sensor, &platform.settings().evaluation);
        let mut secondaries = platform
            .units()
            .iter()
            .skip(1)
            .zip(self.stored.of_secondaries_mut());
        if let Some((unit, stored)) = secondaries.find(|(unit, _)| unit.identity == record.identity)
            && let Ok(error) = accepted(platform, unit, record)
        {
            sensor.of_mut(stored).factory =
                factory_error(sensor, &unit.axes, &error, record.residual, settings);
        }
    }

    /// Restores a stored record of a sensor; reports the result in an event.
    pub fn restore(&mut self, platform: &Platform<T, UNITS>, record: &Record<T>, report: Report<'_, T>) {
        let sensor = record.sensor;
        let units = platform.units().iter().enumerate().skip(1);
        let mut secondaries = units.zip(self.stored.of_secondaries_mut());
        let found =
            secondaries.find(|((_, unit), _)| unit.identity == record.identity && unit.axes.any(sensor));
        let (unit, why) = match found {
            None => (0, Some(RecordRejection::OfAnotherUnit)),
            Some(((number, unit), stored)) => match accepted(platform, unit, record) {
                Err(why) => (number, Some(why)),
                Ok(error) => {
                    let (residual, settings) = (record.residual, &platform.settings().evaluation);
                    let factory = factory_error(sensor, &unit.axes, &error, residual, settings);
                    let stored = sensor.of_mut(stored);
                    stored.replace(error, residual, record.sequence, factory);
                    stored.age(sensor);
                    stored.matrix_shown = record.shows_matrix();
                    stored.place_sigma = record.lever_arm_sigma.length();
                    stored.followed = record.followed;
                    (number, None)
                }
            },
        };
        if why.is_none() {
            self.state_errors(platform, unit);
        }
        let time = self.clock.now().unwrap_or(0);
        if why.is_none() {
            self.rest.settled(unit);
        }
        for slot in &mut self.calibrations {
            let concerned = slot.as_ref().is_some_and(|slot| slot.secondary() == unit);
            if concerned && why.is_none() {
                abandon(slot, time, Abandoned::RecordReplaced, report);
            }
        }
        let sequence = record.sequence;
        let restored = EventKind::Restored { sensor, sequence };
        report(Event {
            time,
            unit,
            kind: why.map_or(restored, |why| EventKind::RecordRejected { sensor, why }),
        });
    }
}

/// Error in a record, if it is plausible for this unit.
fn accepted<T: Real, const UNITS: usize>(
    platform: &Platform<T, UNITS>,
    unit: &MountedUnit<T>,
    record: &Record<T>,
) -> Result<RelativeError<T>, RecordRejection> {
    if !record.is_finite() {
        return Err(RecordRejection::NotFinite);
    }
    let error = RelativeError::of(record, &unit.sensor_from_primary).ok_or(RecordRejection::Implausible)?;
    let allowed = platform.settings().adoption.allows(record.sensor, &error);
    allowed.map(|()| error).map_err(|_| RecordRejection::Implausible)
}
