//! The end of a calibration: fits are made, judged, and adopted or refused.

use nalgebra::{Matrix3, Vector3};

use crate::products::{Length, congruent, zeros};
use crate::real::{Real, real};
use crate::redundancy::evaluation::{StoredCalibration, factory_error};
use crate::redundancy::fit::Fit;
use crate::redundancy::fit::adoption::{AdoptionRefusal, Excess, RefusalReason};
use crate::redundancy::health::Health;
use crate::redundancy::monitor::Report;
use crate::redundancy::monitor::calibration::{CalibrationRun, FitOutcome};
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::record::Record;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::RedundancySettings;

/// Share of an axis that has to lie in the directions shown for its figures to count as shown.
const SHOWN: f64 = 0.75;

/// What became of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Conclusion<T: Real> {
    /// What is stored stays.
    NothingNew,
    /// What is stored was replaced.
    Replaced,
    /// It is beyond what any calibration may be.
    Refuted(Excess<T>),
}

impl<T: Real> Conclusion<T> {
    fn refused(why: &AdoptionRefusal<T>) -> Self {
        match why {
            AdoptionRefusal::Exceeds(
                RefusalReason::ImplausibleBias
                | RefusalReason::ImplausibleScale
                | RefusalReason::ImplausibleMisalignment,
                excess,
            ) => Self::Refuted(*excess),
            _ => Self::NothingNew,
        }
    }
}

/// Fits what was collected, replaces what is stored where that is better, and says what became of each
/// sensor.
pub(super) fn conclude<T: Real>(
    settings: &RedundancySettings<T>,
    calibration: &CalibrationRun<T>,
    unit: &MountedUnit<T>,
    stored: &mut [StoredCalibration<T>; 2],
    health: &Health<T>,
    time: u64,
    report: Report<'_, T>,
) -> [Conclusion<T>; 2] {
    let mut conclusions = [Conclusion::NothingNew; 2];
    let number = calibration.secondary();
    let wanted = SENSORS.into_iter().zip(calibration.sensors());
    for (sensor, _) in wanted.filter(|(_, wanted)| *wanted) {
        let stored = sensor.of_mut(stored);
        let mut tell = |kind| {
            report(Event {
                time,
                unit: number,
                kind,
            })
        };
        let outcome =
            match calibration.conclude(sensor, unit, stored, health.is_contradicted(sensor), settings) {
                Ok(outcome) => outcome,
                Err(why) => {
                    tell(EventKind::Refused { sensor, why });
                    *sensor.of_mut(&mut conclusions) = Conclusion::refused(&why);
                    continue;
                }
            };
        tell(EventKind::Fitted {
            sensor,
            rung: outcome.fit.rung,
            directions: outcome.fit.directions,
            pairs: outcome.fit.pairs,
            residual: outcome.residuals.after,
            residual_before: outcome.residuals.before,
        });
        match outcome.verdict {
            Err(why) => {
                *sensor.of_mut(&mut conclusions) = Conclusion::refused(&why);
                tell(EventKind::Refused { sensor, why });
            }
            Ok(()) => {
                let sequence = stored.sequence.saturating_add(1);
                let record = record(sensor, unit, &outcome, sequence);
                let (error, residual) = (outcome.fit.error, outcome.residuals.after);
                let factory = factory_error(sensor, &unit.axes, &error, residual, &settings.evaluation);
                stored.replace(error, residual, sequence, factory);
                stored.matrix_shown = record.shows_matrix();
                stored.place_sigma = record.lever_arm_sigma.length();
                stored.followed = record.followed;
                *sensor.of_mut(&mut conclusions) = Conclusion::Replaced;
                tell(EventKind::Adopted { record });
            }
        }
    }
    conclusions
}

/// What is to be stored, in the frames of records: the nominal rotation is part of M there.
fn record<T: Real>(
    sensor: Sensor,
    unit: &MountedUnit<T>,
    outcome: &FitOutcome<T>,
    sequence: u32,
) -> Record<T> {
    let fit = &outcome.fit;
    let arm_known = sensor == Sensor::Accelerometer && unit.lever_arm.is_some();
    Record {
        identity: unit.identity,
        sensor,
        model: fit.error.model(&unit.sensor_from_primary),
        matrix_sigma: matrix_sigma(fit, &unit.sensor_from_primary),
        bias_sigma: fit.bias_sigma,
        lever_arm: unit
            .lever_arm
            .filter(|_| arm_known)
            .unwrap_or(fit.error.lever_arm),
        lever_arm_sigma: if arm_known {
            zeros()
        } else {
            sigma(&fit.lever_arm_covariance, &fit.lever_arm_shown)
        },
        rung: fit.rung,
        directions: fit.directions,
        residual: outcome.residuals.after,
        residual_before: outcome.residuals.before,
        pairs: fit.pairs,
        sequence,
        followed: outcome.following.followed,
    }
}

fn matrix_sigma<T: Real>(fit: &Fit<T>, turn: &Matrix3<T>) -> Matrix3<T> {
    let mut sigmas: Matrix3<T> = zeros();
    for (i, (covariance, shown)) in fit.row_covariance.iter().zip(&fit.shown).enumerate() {
        let turned = |matrix: &Matrix3<T>| congruent(&turn.transpose(), matrix);
        sigmas.set_row(i, &sigma(&turned(covariance), &turned(shown)).transpose());
    }
    sigmas
}

/// 1-sigma of each axis; infinite where it does not lie in the directions shown.
fn sigma<T: Real>(covariance: &Matrix3<T>, shown: &Matrix3<T>) -> Vector3<T> {
    covariance
        .diagonal()
        .zip_map(&shown.diagonal(), |variance, shown| {
            if shown > real(SHOWN) {
                variance.max(T::zero()).square_root()
            } else {
                T::one() / T::zero()
            }
        })
}
