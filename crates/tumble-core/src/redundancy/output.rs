//! Third data, made to agree with what the primary gave.

use nalgebra::Vector3;

use crate::products::{cross, transposed_product, zeros};
use crate::real::{Real, real, seconds};
use crate::redundancy::components::{difference, dot, follow, larger, scaled};
use crate::redundancy::evaluation::StoredCalibration;
use crate::redundancy::platform::{MountedUnit, PrimaryCalibration};
use crate::redundancy::sensor::Sensor;

/// What the set says, whoever says it: at the primary's place, in its case frame, with its own calibration applied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output<T: Real> {
    /// Microseconds of the common clock.
    pub time: u64,
    /// m/s^2; not a number along axes of which the source says nothing.
    pub specific_force: Vector3<T>,
    /// rad/s; not a number about axes of which the source says nothing.
    pub angular_rate: Vector3<T>,
    /// The unit it comes from, 0 the primary.
    pub source: usize,
    /// Whether the source is known to be wrong and nobody is there in its place, or says nothing of an axis of the primary, or
    /// two units contradict each other and nobody knows which is right.
    pub degraded: bool,
}

impl<T: Real> Output<T> {
    pub(super) fn is_finite(&self) -> bool {
        let (f, w) = (&self.specific_force, &self.angular_rate);
        // Nothing of what is finite is zero.
        (dot(f, &zeros()) + dot(w, &zeros())) == T::zero()
    }
}

/// What the secondary says, compensated, but still at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensated<T: Real> {
    /// m/s^2.
    pub specific_force: Vector3<T>,
    /// rad/s.
    pub angular_rate: Vector3<T>,
}

/// Takes the stored error and then the primary's own calibration off what a sensor of a secondary reads, in place; of the
/// primary itself nothing is stored (docs/theory/redundancy.md, eq. 14).
pub fn compensate<T: Real>(
    sensor: Sensor,
    unit: &MountedUnit<T>,
    stored: &[StoredCalibration<T>; 2],
    calibration: &PrimaryCalibration<T>,
    readings: &mut [Vector3<T>],
) {
    sensor.of(stored).error.correct_all(readings);
    for reading in readings {
        let as_primary = transposed_product(&unit.sensor_from_primary, reading);
        *reading = calibration.correct(sensor, &as_primary); // eq. 14: C_p
    }
}

/// From the primary to a unit, m: as given, or else as found.
pub fn lever_arm<T: Real>(unit: &MountedUnit<T>, stored: &[StoredCalibration<T>; 2]) -> Vector3<T> {
    let [accelerometer, _] = stored;
    unit.lever_arm.unwrap_or(accelerometer.error.lever_arm)
}

/// Time over which the angular acceleration of the source is smoothed, s: noise of the rate weighs with its inverse, the
/// delay of what is taken off with it.
const SMOOTHING: f64 = 0.01;

/// Takes specific force from where the source is to where the primary is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeverArmCorrection<T: Real> {
    latest: Option<(u64, Vector3<T>)>,
    angular_acceleration: Vector3<T>,
}

impl<T: Real> Default for LeverArmCorrection<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> LeverArmCorrection<T> {
    /// Knows no angular acceleration yet.
    pub fn new() -> Self {
        Self {
            latest: None,
            angular_acceleration: zeros(),
        }
    }

    /// The specific force at the primary's place; `arm` is from there to the source.
    pub fn apply(&mut self, time: u64, reading: &Compensated<T>, arm: &Vector3<T>) -> Vector3<T> {
        let w = reading.angular_rate;
        if let Some((before, rate)) = self.latest.replace((time, w)) {
            let step = seconds::<T>(time.saturating_sub(before));
            // The filter that forgets by exp(-step / smoothing), to first order, and holds for any step.
            let share = step / (step + real(SMOOTHING));
            let inverse = T::one() / larger(real(1e-6), step);
            let change = scaled(&difference(&w, &rate), inverse);
            follow(&mut self.angular_acceleration, &change, share);
        }
        let tangential = cross(&self.angular_acceleration, arm);
        let centripetal = cross(&w, &cross(&w, arm));
        difference(&difference(&reading.specific_force, &tangential), &centripetal) // eq. 14
    }
}
