//! End of a calibration: one step of a fit with each sample, then adoption or refusal.

use nalgebra::{Matrix3, Vector3};

use crate::products::{Length, congruent, zeros};
use crate::real::{Real, real};
use crate::redundancy::evaluation::{StoredCalibration, factory_error};
use crate::redundancy::fit::Fit;
use crate::redundancy::fit::adoption::{AdoptionRefusal, Excess, RefusalReason};
use crate::redundancy::health::RefutedBy;
use crate::redundancy::monitor::calibration::CalibrationRun;
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::trial::{FitOutcome, TrialEnd};
use crate::redundancy::monitor::{Monitor, Report};
use crate::redundancy::platform::{MountedUnit, Platform};
use crate::redundancy::record::Record;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::RedundancySettings;
use crate::redundancy::unit_count::{UnitCount, Units};

/// Share of an axis in the observed directions above which its figures are reported.
const SHOWN: f64 = 0.75;

/// Conclusion of the trial of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Conclusion<T: Real> {
    /// The stored calibration stays.
    NothingNew,
    /// The stored calibration was replaced.
    Replaced,
    /// The error exceeds the limits of any calibration.
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

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Returns whether the pairs of a calibration are complete, so that the next sample also advances its fits.
    pub fn is_fitting(&self) -> bool {
        self.calibrations.iter().flatten().any(CalibrationRun::is_fitting)
    }

    /// Takes the next step of a calibration whose pairs are complete.
    pub(super) fn fit_on(&mut self, platform: &Platform<T, UNITS>, report: Report<'_, T>) {
        if self.is_fitting() {
            let now = self.clock.now().unwrap_or(0);
            self.take_step(platform, now, report);
        }
    }

    /// Takes a step, and adopts or refuses the result of the last step of a sensor.
    #[inline(never)]
    fn take_step(&mut self, platform: &Platform<T, UNITS>, time: u64, report: Report<'_, T>) -> Option<()> {
        let (settings, window) = (platform.settings(), self.window_length(platform));
        let fits =
            |slot: &&mut Option<CalibrationRun<T>>| slot.as_ref().is_some_and(CalibrationRun::is_fitting);
        let mut under_way = self.calibrations.iter().flatten();
        let number = under_way.find(|run| run.is_fitting())?.secondary();
        let may_be_refuted = SENSORS.map(|sensor| self.may_be_refuted(sensor, number));
        let slot = self.calibrations.iter_mut().find(fits)?;
        let calibration = slot.as_mut()?;
        let unit = platform.units().get(number)?;
        let (stored, health) = (self.stored.get_mut(number)?, self.health.get_mut(number)?);
        let [accelerometer, gyroscope] = &*stored;
        let found_wrong = [accelerometer.freed, gyroscope.freed];
        let mut found = Fit::none();
        let (sensor, outcome) = calibration.fit_on(
            (platform.primary_axes(), unit),
            stored,
            found_wrong,
            settings,
            window,
            &mut found,
        )?;
        let mut emit = |kind| {
            report(Event {
                time,
                unit: number,
                kind,
            });
        };
        // The next rest checks an adopted calibration.
        let mounted = (unit, *platform.comparable(unit).of(sensor));
        match conclude(
            sensor,
            &outcome,
            mounted,
            sensor.of_mut(stored),
            settings,
            &mut emit,
        ) {
            Conclusion::NothingNew => {}
            Conclusion::Replaced => {
                self.rest.adopted();
                self.isolator.recalibrated(sensor, number);
                health.calibrated(sensor);
            }
            Conclusion::Refuted(excess) => {
                if *sensor.of(&may_be_refuted) {
                    health.refute(sensor, RefutedBy::Fit, excess.value, excess.limit);
                }
            }
        }
        if !calibration.fit_next(stored) {
            *slot = None;
        }
        if self.named.contains(number) {
            self.state_errors(platform, number);
            self.readmit(number);
        }
        Some(())
    }
}

/// Replaces the stored calibration if the fit is better.
#[inline(never)]
fn conclude<T: Real>(
    sensor: Sensor,
    outcome: &TrialEnd<'_, T>,
    (unit, axes): (&MountedUnit<T>, [bool; 3]),
    stored: &mut StoredCalibration<T>,
    settings: &RedundancySettings<T>,
    emit: &mut dyn FnMut(EventKind<T>),
) -> Conclusion<T> {
    let adopted = outcome.as_ref().map_err(|why| *why).and_then(|outcome| {
        emit(EventKind::Fitted {
            sensor,
            fit_model: outcome.fit.fit_model,
            directions: outcome.fit.directions,
            pairs: outcome.fit.pairs,
            residual: outcome.residuals.after,
            residual_before: outcome.residuals.before,
        });
        outcome.verdict.map(|()| outcome)
    });
    match adopted {
        Err(why) => {
            emit(EventKind::Refused { sensor, why });
            Conclusion::refused(&why)
        }
        Ok(outcome) => {
            let sequence = stored.sequence.saturating_add(1);
            let record = record(sensor, unit, axes, outcome, sequence);
            let (error, residual) = (outcome.fit.error, outcome.residuals.after);
            let factory = factory_error(sensor, &unit.axes, &error, residual, &settings.evaluation);
            stored.replace(error, residual, sequence, factory);
            stored.matrix_shown = record.shows_matrix();
            stored.place_sigma = record.lever_arm_sigma.length();
            stored.followed = record.followed;
            emit(EventKind::Adopted { record });
            Conclusion::Replaced
        }
    }
}

/// Record to be stored, in the frames of records, where M includes the nominal rotation.
fn record<T: Real>(
    sensor: Sensor,
    unit: &MountedUnit<T>,
    axes: [bool; 3],
    outcome: &FitOutcome<'_, T>,
    sequence: u32,
) -> Record<T> {
    let fit = outcome.fit;
    let arm_known = sensor == Sensor::Accelerometer && unit.lever_arm.is_some();
    Record {
        identity: unit.identity,
        sensor,
        model: fit.error.model(&unit.sensor_from_primary),
        matrix_sigma: matrix_sigma(fit, &unit.sensor_from_primary),
        bias_sigma: fit.bias_sigma.zip_map(&Vector3::from(axes), |sigma, fitted| {
            if fitted { sigma } else { real(f64::INFINITY) }
        }),
        lever_arm: unit
            .lever_arm
            .filter(|_| arm_known)
            .unwrap_or(fit.error.lever_arm),
        lever_arm_sigma: if arm_known {
            zeros()
        } else {
            sigma(&fit.lever_arm_covariance, &fit.lever_arm_shown)
        },
        fit_model: fit.fit_model,
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

/// 1-sigma of each axis; infinite for an axis outside the observed directions.
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
