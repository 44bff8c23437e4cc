//! The online form of the result: `w = w~ - b_g`, `a = a~ - b_a`.

use nalgebra::Vector3;

use crate::products::zeros;
use crate::real::Real;
use crate::sample::Sample;
use crate::spin::estimate::SpinEstimate;

/// Biases to take off every sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensation<T: Real> {
    /// Accelerometer bias, m/s^2, case frame.
    pub specific_force: Vector3<T>,
    /// Gyroscope bias, rad/s, case frame.
    pub angular_rate: Vector3<T>,
}

impl<T: Real> Compensation<T> {
    /// Takes nothing off.
    pub fn none() -> Self {
        Self {
            specific_force: zeros(),
            angular_rate: zeros(),
        }
    }

    /// Compensation by the estimates of a spin, in place of `before`: a bias that it did not show stays as it was.
    pub fn updated(before: &Self, spin: &SpinEstimate<T>) -> Self {
        let accelerometer = spin.accelerometer_bias();
        Self {
            specific_force: if accelerometer.observed {
                accelerometer.value
            } else {
                before.specific_force
            },
            angular_rate: spin.gyroscope_bias.value,
        }
    }

    /// A sample without the biases.
    pub fn apply(&self, sample: &Sample<T>) -> Sample<T> {
        Sample {
            time: sample.time,
            specific_force: sample.specific_force - self.specific_force,
            angular_rate: sample.angular_rate - self.angular_rate,
        }
    }
}
