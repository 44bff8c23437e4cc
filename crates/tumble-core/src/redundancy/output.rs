//! Output of the set, in the axes and at the place of the primary.

use nalgebra::Vector3;

use crate::products::{cross, transposed_product, zeros};
use crate::real::{Real, real, seconds};
use crate::redundancy::components::{difference, dot, follow, larger, scaled};
use crate::redundancy::evaluation::StoredCalibration;
use crate::redundancy::optional_time::OptionalTime;
use crate::redundancy::platform::{MountedUnit, PrimaryCalibration};
use crate::redundancy::sensor::Sensor;

/// Output of the set, whatever its source: at the place of the primary, in its case frame, with its calibration
/// applied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output<T: Real> {
    /// Microseconds of the common clock.
    pub time: u64,
    /// Specific force, m/s^2; NaN along axes that the source does not measure.
    pub specific_force: Vector3<T>,
    /// Angular rate, rad/s; NaN about axes that the source does not measure.
    pub angular_rate: Vector3<T>,
    /// Unit that is the source, 0 for the primary.
    pub source: usize,
    /// True if the source is faulty without a replacement, if it lacks an axis of the primary, or if a dispute
    /// of two units is unresolved.
    pub degraded: bool,
}

impl<T: Real> Output<T> {
    pub(super) fn is_finite(&self) -> bool {
        let (f, w) = (&self.specific_force, &self.angular_rate);
        // A finite number times zero is zero.
        (dot(f, &zeros()) + dot(w, &zeros())) == T::zero()
    }
}

/// Compensated readings of a secondary, still at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensated<T: Real> {
    /// m/s^2.
    pub specific_force: Vector3<T>,
    /// rad/s.
    pub angular_rate: Vector3<T>,
}

/// Corrects readings of a sensor of a secondary by the stored error and then by the calibration of the primary,
/// in place; the primary itself has no stored error (docs/theory/redundancy.md, eq. 14).
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

/// Lever arm from the primary to a unit, m: the given one, or else the estimated one; zero of the primary, which has no
/// stored calibration.
pub fn lever_arm<T: Real>(unit: &MountedUnit<T>, stored: Option<&[StoredCalibration<T>; 2]>) -> Vector3<T> {
    let estimated = |[accelerometer, _]: &[StoredCalibration<T>; 2]| accelerometer.error.lever_arm;
    unit.lever_arm.unwrap_or(stored.map_or(zeros(), estimated))
}

/// Time constant with which the angular acceleration of the source is smoothed, s: noise decreases with it, the
/// delay of the correction increases.
const SMOOTHING: f64 = 0.01;

/// Correction of specific force from the place of the source to that of the primary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeverArmCorrection<T: Real> {
    latest: OptionalTime,
    /// Angular rate then, rad/s.
    rate: Vector3<T>,
    angular_acceleration: Vector3<T>,
}

impl<T: Real> Default for LeverArmCorrection<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> LeverArmCorrection<T> {
    /// Creates a correction without an angular acceleration.
    pub fn new() -> Self {
        Self {
            latest: OptionalTime::NONE,
            rate: zeros(),
            angular_acceleration: zeros(),
        }
    }

    /// Specific force at the place of the primary; `arm` is the vector from there to the source.
    pub fn apply(&mut self, time: u64, reading: &Compensated<T>, arm: &Vector3<T>) -> Vector3<T> {
        let w = reading.angular_rate;
        let rate = core::mem::replace(&mut self.rate, w);
        if let Some(before) = self.latest.replace(time) {
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
