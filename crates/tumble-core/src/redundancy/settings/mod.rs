//! How a redundant set watches, calibrates and replaces its units.

mod bounds;
pub mod thresholds;
pub mod validate;

use crate::gravity;
use crate::real::{Real, SECOND, real, whole_spans};
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::thresholds::{SensorThresholds, Threshold, Thresholds};

crate::vocabulary! {
    /// Which data deviations at rest are taken from.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Data {
        /// After the stored error, and the primary's own calibration, were taken off.
        Compensated = "compensated",
        /// As read: thresholds have to allow for the error that is known.
        Raw = "raw",
    }
}

crate::vocabulary! {
    /// Whose deviations let a calibration be triggered.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Gate {
        /// The secondary's alone.
        SecondaryAlone = "secondary alone",
        /// The secondary's, with both sensors of the primary valid.
        WholePrimary = "whole primary",
        /// The secondary's, sensor by sensor, each with the primary's sensor of its kind valid.
        SensorBySensor = "sensor by sensor",
    }
}

crate::vocabulary! {
    /// What a trigger has calibrated.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Scope {
        /// Accelerometer and gyroscope of the secondary.
        AllSensors = "all sensors",
        /// Only the sensor that deviates.
        TriggeringSensor = "triggering sensor",
    }
}

crate::vocabulary! {
    /// Which fits replace what is stored.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Adoption {
        /// One that is plausible and explains held-out pairs better than what is stored.
        IfBetter = "if better",
        /// Each, as in the literature: what is stored is that of the last calibration.
        Always = "always",
    }
}

crate::vocabulary! {
    /// How much a fit may find; each includes those before.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Rung {
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

/// A figure for specific force, m/s^2, and one for angular rate, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceAndRate<T: Real> {
    /// m/s^2.
    pub specific_force: T,
    /// rad/s.
    pub angular_rate: T,
}

impl<T: Real> ForceAndRate<T> {
    /// The one of a sensor.
    pub fn of(&self, sensor: Sensor) -> T {
        match sensor {
            Sensor::Accelerometer => self.specific_force,
            Sensor::Gyroscope => self.angular_rate,
        }
    }
}

/// When and how units are looked at while they rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluationSettings<T: Real> {
    /// What readings are compared with.
    pub thresholds: Thresholds<T>,
    /// Magnitude of gravity, m/s^2.
    pub gravity: T,
    /// Rest that is let pass before readings count, microseconds.
    pub rest_settle: u64,
    /// Rest over which readings are averaged, microseconds.
    pub rest_duration: u64,
    /// Whether the first rest is evaluated.
    pub evaluate_after_start: bool,
    /// Time after which a rest is evaluated again, microseconds; `None`: never by itself.
    pub evaluate_every: Option<u64>,
    /// Which data deviations are taken from.
    pub data: Data,
    /// Whether secondaries are also compared with a valid primary, axis by axis.
    pub vector_check: bool,
    /// Whose deviations count.
    pub gate: Gate,
    /// Deviation at rest up to which secondaries are calibrated relative to a primary without a calibration of its own.
    pub uncalibrated: ForceAndRate<T>,
}

/// How pairs are collected in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollectionSettings<T: Real> {
    /// What is calibrated.
    pub scope: Scope,
    /// Change of the primary's means from those at rest that counts as motion; vibration moves no mean.
    pub motion: ForceAndRate<T>,
    /// Longest wait for motion, microseconds.
    pub motion_timeout: u64,
    /// Motion to be collected, microseconds.
    pub collect: u64,
    /// Longest time for it, microseconds.
    pub collect_timeout: u64,
    /// Fewest pairs with which a fit is tried when time is up.
    pub fewest_pairs: u32,
}

/// What a fit may find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings<T: Real> {
    /// Top of the ladder.
    pub highest_rung: Rung,
    /// Whether means at rest count beside the pairs in motion.
    pub fit_rests: bool,
    /// Standard deviation of the motion along a direction from which on the matrix is fitted along it.
    pub excitation: ForceAndRate<T>,
    /// Root mean square of the specific force that a lever arm of one metre would cause along a direction from which on
    /// the lever arm is fitted along it, m/s^2 per m.
    pub excitation_lever_arm: T,
}

/// What a new calibration has to be to replace the stored one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdoptionSettings<T: Real> {
    /// Whether it has to be anything.
    pub adoption: Adoption,
    /// Share by which its root mean square residual on held-out pairs has to be smaller than the stored one's.
    pub improvement: T,
    /// Largest bias.
    pub bias: ForceAndRate<T>,
    /// Largest deviation of a scale factor from one.
    pub largest_scale_error: T,
    /// Largest angle between an axis and where it is nominally, rad.
    pub largest_misalignment: T,
    /// Longest lever arm, m.
    pub largest_lever_arm: T,
    /// Largest drift of the residual over the collection, and largest residual at the rest before.
    pub drift: ForceAndRate<T>,
    /// Largest root mean square residual.
    pub residual: ForceAndRate<T>,
    /// Farthest that calibrations together may follow the primary without proof that it is right.
    pub followed: ForceAndRate<T>,
}

/// Limits of what a healthy unit does; lengths of time in microseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HealthSettings<T: Real> {
    /// Longest time without a sample.
    pub late: u64,
    /// Longest time over which all axes of a sensor may repeat their readings, and 16 readings at least; three times that
    /// for a sensor of one axis.
    pub frozen: u64,
    /// Longest time that may be spent at the end of the range or with readings that are not numbers; a quarter of the
    /// good time after that is counted against it.
    pub saturated: u64,
    /// A reading that leaves by more, m/s^2 or rad/s, and comes back at once, is a spike.
    pub spike: ForceAndRate<T>,
    /// Drift of a calibrated unit that is within its specification: a difference of two units that is none.
    pub tolerated: ForceAndRate<T>,
    /// Drift of the bias of an axis, m/s^2 and rad/s a kelvin, of units that tell how warm they are.
    pub per_kelvin: ForceAndRate<T>,
    /// Largest scatter of a unit as a multiple of what the others, by its usual ratio to them, make one expect.
    pub noise_ratio: T,
    /// Largest deviation at rest from gravity, m/s^2, and from zero, rad/s.
    pub rest: ForceAndRate<T>,
    /// How long nothing may have been wrong until a unit is healthy again.
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

/// When the source changes; lengths of time in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SelectionSettings {
    /// How long the source has to be unhealthy to be replaced.
    pub hold: u64,
    /// How long the primary has to be healthy to become the source again; `None`: on command only.
    pub return_after: Option<u64>,
    /// Whether secondaries that were never calibrated against the primary are passed over.
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
    /// While units rest.
    pub evaluation: EvaluationSettings<T>,
    /// In motion.
    pub collection: CollectionSettings<T>,
    /// The ladder.
    pub fit: FitSettings<T>,
    /// What is adopted.
    pub adoption: AdoptionSettings<T>,
    /// At all times.
    pub health: HealthSettings<T>,
    /// Who is the source.
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
                highest_rung: Rung::AffineAndLeverArm,
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
    /// Whole windows in a span of microseconds.
    pub fn windows(&self, span: u64) -> u64 {
        whole_spans(span, self.window).0
    }

    /// Fewest pairs of a fit over windows of a length, microseconds, that cover as much time as those of the settings do.
    pub fn fewest_pairs(&self, window: u64) -> u32 {
        let pairs = u64::from(self.collection.fewest_pairs);
        let fewest = whole_spans(pairs.saturating_mul(self.window), window.max(1)).0;
        u32::try_from(fewest).unwrap_or(u32::MAX)
    }

    /// Whether a secondary can exceed a threshold of deviation before it is refuted: else nothing would ever be calibrated.
    #[inline(never)]
    pub fn may_be_exceeded(&self, sensor: Sensor, threshold: &Threshold<T>) -> bool {
        threshold.least() < self.plausible_at_rest(sensor, false)
    }

    /// Largest deviation at rest, m/s^2 or rad/s, with which a secondary's sensor is still in order: what is wrong with one
    /// that was never calibrated may be as large as calibration can find.
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
