//! Settings of a redundant set: health, evaluation, calibration and selection.

mod bounds;
pub mod thresholds;
pub mod validate;

use crate::gravity;
use crate::real::{Real, SECOND, real, whole_spans};
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::thresholds::{SensorThresholds, Threshold, Thresholds};

crate::vocabulary! {
    /// Data from which deviations at rest are computed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Data {
        /// Readings compensated by the stored error and by the calibration of the primary.
        Compensated = "compensated",
        /// Raw readings: thresholds must include the known error.
        Raw = "raw",
    }
}

crate::vocabulary! {
    /// Condition on deviations for triggering a calibration.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Gate {
        /// The secondary deviates; the primary is not checked.
        SecondaryAlone = "secondary alone",
        /// The secondary deviates, and both sensors of the primary are valid.
        WholePrimary = "whole primary",
        /// A sensor of the secondary deviates, and that of the primary of its kind is valid.
        SensorBySensor = "sensor by sensor",
    }
}

crate::vocabulary! {
    /// Sensors that a trigger calibrates.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Scope {
        /// Accelerometer and gyroscope of the secondary.
        AllSensors = "all sensors",
        /// Only the sensor that deviates.
        TriggeringSensor = "triggering sensor",
    }
}

crate::vocabulary! {
    /// Fits that replace the stored calibration.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Adoption {
        /// A fit that is plausible and explains held-out pairs better than the stored calibration.
        IfBetter = "if better",
        /// Every fit, like in the literature.
        Always = "always",
    }
}

crate::vocabulary! {
    /// Model that a fit estimates; each includes those before.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum FitModel {
        /// Three offsets.
        Offset = "offset",
        /// An offset and a gain for each axis.
        Gain = "gain",
        /// Offset and matrix.
        Affine = "affine",
        /// Offset, matrix and lever arm.
        AffineAndLeverArm = "affine and lever arm",
    }
}

/// Figure for specific force, m/s^2, and one for angular rate, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceAndRate<T: Real> {
    /// m/s^2.
    pub specific_force: T,
    /// rad/s.
    pub angular_rate: T,
}

impl<T: Real> ForceAndRate<T> {
    /// Figure for a sensor.
    pub fn of(&self, sensor: Sensor) -> T {
        match sensor {
            Sensor::Accelerometer => self.specific_force,
            Sensor::Gyroscope => self.angular_rate,
        }
    }
}

/// Settings of the evaluation at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluationSettings<T: Real> {
    /// Thresholds of readings at rest.
    pub thresholds: Thresholds<T>,
    /// Magnitude of gravity, m/s^2.
    pub gravity: T,
    /// Rest before readings count, microseconds.
    pub rest_settle: u64,
    /// Rest over which readings are averaged, microseconds.
    pub rest_duration: u64,
    /// True if the first rest is evaluated.
    pub evaluate_after_start: bool,
    /// Time after which a rest is evaluated again, microseconds; `None`: on command only.
    pub evaluate_every: Option<u64>,
    /// Data from which deviations are computed.
    pub data: Data,
    /// True if secondaries are also compared with a valid primary, axis by axis.
    pub vector_check: bool,
    /// Condition on deviations for triggering a calibration.
    pub gate: Gate,
    /// Deviation of an uncalibrated primary at rest up to which secondaries are calibrated relative to it.
    pub uncalibrated: ForceAndRate<T>,
}

/// Settings of the collection of pairs in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollectionSettings<T: Real> {
    /// Sensors that a trigger calibrates.
    pub scope: Scope,
    /// Change of the primary's means from those at rest that counts as motion; vibration moves no mean.
    pub motion: ForceAndRate<T>,
    /// Longest wait for motion, microseconds.
    pub motion_timeout: u64,
    /// Time of motion to collect, microseconds.
    pub collect: u64,
    /// Longest time of the collection, microseconds.
    pub collect_timeout: u64,
    /// Least number of pairs for a fit at the end of that time.
    pub fewest_pairs: u32,
}

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings<T: Real> {
    /// Largest model that a fit may estimate.
    pub largest_fit_model: FitModel,
    /// True if means at rest are fitted beside the pairs in motion.
    pub fit_rests: bool,
    /// Standard deviation of the motion along a direction above which the matrix is fitted along it.
    pub excitation: ForceAndRate<T>,
    /// Root mean square of the specific force that a lever arm of one metre would cause along a direction,
    /// above which the lever arm is fitted along it, m/s^2 per m.
    pub excitation_lever_arm: T,
}

/// Conditions on a new calibration that replaces the stored one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdoptionSettings<T: Real> {
    /// Fits that replace the stored calibration.
    pub adoption: Adoption,
    /// Least relative reduction of the root mean square residual on held-out pairs.
    pub improvement: T,
    /// Largest bias.
    pub bias: ForceAndRate<T>,
    /// Largest deviation of a scale factor from one.
    pub largest_scale_error: T,
    /// Largest angle between an axis and its nominal direction, rad.
    pub largest_misalignment: T,
    /// Longest lever arm, m.
    pub largest_lever_arm: T,
    /// Largest drift of the residual over the collection, and largest residual at the rest before.
    pub drift: ForceAndRate<T>,
    /// Largest root mean square residual.
    pub residual: ForceAndRate<T>,
    /// Largest correction by which calibrations together may follow the primary without proof.
    pub followed: ForceAndRate<T>,
}

/// Limits of a healthy unit; times in microseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HealthSettings<T: Real> {
    /// Longest time without a sample.
    pub late: u64,
    /// Longest time over which all axes of a sensor may repeat their readings, and 16 readings at least; three
    /// times that for a sensor of one axis.
    pub frozen: u64,
    /// Longest time at the end of the range or with readings that are not finite; a quarter of the good time
    /// afterwards is subtracted.
    pub saturated: u64,
    /// Change above which a reading that returns at once is a spike, m/s^2 or rad/s.
    pub spike: ForceAndRate<T>,
    /// Drift of a calibrated unit within its specification, up to which two units agree.
    pub tolerated: ForceAndRate<T>,
    /// Drift of the bias of an axis, m/s^2 and rad/s per kelvin, for units that measure their temperature.
    pub per_kelvin: ForceAndRate<T>,
    /// Largest scatter of a unit as a multiple of the scatter expected from the others.
    pub noise_ratio: T,
    /// Largest deviation at rest from gravity, m/s^2, and from zero, rad/s.
    pub rest: ForceAndRate<T>,
    /// Time without a fault after which a unit is healthy again.
    pub recovery: u64,
}

impl<T: Real> Default for HealthSettings<T> {
    fn default() -> Self {
        let both = |specific_force, angular_rate| ForceAndRate {
            specific_force: real(specific_force),
            angular_rate: real(angular_rate),
        };
        Self {
            late: 100_000,
            frozen: 100_000,
            saturated: 50_000,
            spike: both(40.0, 10.0),
            tolerated: both(0.05, 0.0075),
            // 0.2 mg and 0.015 deg/s: data sheets of consumer parts.
            per_kelvin: both(1.96e-3, 2.6e-4),
            noise_ratio: real(9.0),
            rest: both(1.5, 0.2),
            recovery: 500_000,
        }
    }
}

/// Settings of the selection of the source; times in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SelectionSettings {
    /// Time for which the source must be unhealthy to be replaced.
    pub hold: u64,
    /// Time for which the primary must be healthy to become the source again; `None`: on command only.
    pub return_after: Option<u64>,
    /// True if secondaries that were never calibrated against the primary are not selected.
    pub calibrated_only: bool,
}

impl Default for SelectionSettings {
    fn default() -> Self {
        Self {
            hold: 20_000,
            return_after: None,
            calibrated_only: false,
        }
    }
}

/// All settings of the monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RedundancySettings<T: Real> {
    /// Length of a window, over which samples are averaged, microseconds.
    pub window: u64,
    /// Evaluation at rest.
    pub evaluation: EvaluationSettings<T>,
    /// Collection in motion.
    pub collection: CollectionSettings<T>,
    /// Fit.
    pub fit: FitSettings<T>,
    /// Adoption.
    pub adoption: AdoptionSettings<T>,
    /// Health at all times.
    pub health: HealthSettings<T>,
    /// Selection of the source.
    pub selection: SelectionSettings,
}

impl<T: Real> Default for RedundancySettings<T> {
    fn default() -> Self {
        let both = |specific_force, angular_rate| ForceAndRate {
            specific_force: real(specific_force),
            angular_rate: real(angular_rate),
        };
        let off = SensorThresholds {
            accelerometer: Threshold::Fixed(real(0.1)),
            gyroscope: Threshold::Fixed(real(0.01)),
        };
        Self {
            window: SECOND / 20,
            evaluation: EvaluationSettings {
                thresholds: Thresholds {
                    rest_scatter: both(0.1, 0.02),
                    secondary: off,
                    primary: off,
                },
                gravity: real(gravity::STANDARD),
                rest_settle: SECOND / 2,
                rest_duration: 2 * SECOND,
                evaluate_after_start: true,
                evaluate_every: Some(600 * SECOND),
                data: Data::Compensated,
                vector_check: true,
                gate: Gate::WholePrimary,
                uncalibrated: both(0.8, 0.1),
            },
            collection: CollectionSettings {
                scope: Scope::AllSensors,
                motion: both(0.5, 0.2),
                motion_timeout: 300 * SECOND,
                collect: 30 * SECOND,
                collect_timeout: 300 * SECOND,
                fewest_pairs: 200,
            },
            fit: FitSettings {
                largest_fit_model: FitModel::AffineAndLeverArm,
                fit_rests: true,
                excitation: both(0.5, 0.2),
                excitation_lever_arm: real(2.0),
            },
            adoption: AdoptionSettings {
                adoption: Adoption::IfBetter,
                improvement: real(0.02),
                bias: both(3.0, 1.0),
                largest_scale_error: real(0.1),
                largest_misalignment: real(0.1),
                largest_lever_arm: real(1.0),
                drift: both(0.1, 0.01),
                residual: both(0.5, 0.05),
                followed: both(0.15, 0.015),
            },
            health: HealthSettings::default(),
            selection: SelectionSettings::default(),
        }
    }
}

impl<T: Real> RedundancySettings<T> {
    /// Number of whole windows in a span, microseconds.
    pub fn windows(&self, span: u64) -> u64 {
        whole_spans(span, self.window).0
    }

    /// Least number of pairs of a fit over windows of a length, microseconds, that cover the time of those of
    /// the settings.
    pub fn fewest_pairs(&self, window: u64) -> u32 {
        let pairs = u64::from(self.collection.fewest_pairs);
        let fewest = whole_spans(pairs.saturating_mul(self.window), window.max(1)).0;
        u32::try_from(fewest).unwrap_or(u32::MAX)
    }

    /// Returns whether a secondary can exceed a threshold before it is refuted; otherwise no secondary would be
    /// calibrated.
    #[inline(never)]
    pub fn may_be_exceeded(&self, sensor: Sensor, threshold: &Threshold<T>) -> bool {
        threshold.least() < self.plausible_at_rest(sensor, false)
    }

    /// Largest deviation at rest, m/s^2 or rad/s, of a plausible sensor of a secondary: that of an uncalibrated
    /// one may be as large as the errors that a calibration can find.
    pub fn plausible_at_rest(&self, sensor: Sensor, calibrated: bool) -> T {
        let limit = self.health.rest.of(sensor);
        if calibrated {
            return limit;
        }
        let scale = match sensor {
            Sensor::Accelerometer => self.adoption.largest_scale_error * self.evaluation.gravity,
            Sensor::Gyroscope => T::zero(),
        };
        limit.max(self.adoption.bias.of(sensor) + scale)
    }
}
