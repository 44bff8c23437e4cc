//! Readings of a magnetometer, and what is known of the unit at each.

use nalgebra::{Matrix3, SMatrix, Vector3};
use tumble_core::model::{ModelCovariance, PARAMETERS};

/// Mean reading over a rest, or a single one.
#[derive(Clone, Copy, Debug)]
pub struct FieldReading {
    /// Reading, uT.
    pub mean: Vector3<f64>,
    /// Variance of each axis, uT^2.
    pub variance: Vector3<f64>,
    /// Current in A, or throttle; zero where there is none.
    pub current: f64,
    /// Up at that reading, where an accelerometer shows it.
    pub up: Option<Upward>,
}

/// Up in the case frame, by a calibrated accelerometer.
#[derive(Clone, Copy, Debug)]
pub struct Upward {
    /// Unit vector.
    pub direction: Vector3<f64>,
    /// Its covariance from noise.
    pub covariance: Matrix3<f64>,
    /// Its derivative by `[M row by row, b]` of the accelerometer.
    pub by_accelerometer: SMatrix<f64, 3, PARAMETERS>,
}

/// All readings that a magnetometer is fitted to, and what they have in common.
#[derive(Clone, Debug)]
pub struct FieldReadings {
    /// Readings, in order of time; all know up, or none.
    pub readings: Vec<FieldReading>,
    /// Covariance of `[M row by row, b]` of the accelerometer.
    pub accelerometer: ModelCovariance<f64>,
}

impl FieldReadings {
    /// Tests whether all readings know up.
    pub fn know_up(&self) -> bool {
        !self.readings.is_empty() && self.readings.iter().all(|reading| reading.up.is_some())
    }

    /// The same without some readings.
    pub(super) fn only(&self, kept: &[usize]) -> Self {
        Self {
            readings: kept.iter().map(|k| self.readings[*k]).collect(),
            accelerometer: self.accelerometer,
        }
    }
}
