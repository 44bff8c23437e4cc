//! One timestamped sample of an inertial measurement unit.

use nalgebra::Vector3;

use crate::real::Real;

/// The six channels of a unit in the order used everywhere: specific force x y z, angular rate x y z.
pub const CHANNELS: usize = 6;

/// Readings of the unit at one instant, in its case frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T: Real> {
    /// Microseconds of the unit's own clock.
    pub time: u64,
    /// Specific force, m/s^2: at rest and upright it reads +g up.
    pub specific_force: Vector3<T>,
    /// Angular rate, rad/s.
    pub angular_rate: Vector3<T>,
}

impl<T: Real> Sample<T> {
    /// All six channels, specific force first.
    pub fn channels(&self) -> [T; CHANNELS] {
        let (f, w) = (&self.specific_force, &self.angular_rate);
        [f.x, f.y, f.z, w.x, w.y, w.z]
    }

    /// Checks that every channel is a finite number.
    pub fn is_finite(&self) -> bool {
        self.channels().iter().all(|value| value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_with_any_channel_not_a_number_is_not_finite() {
        for bad in 0..CHANNELS {
            let mut y = [1.0_f32; CHANNELS];
            y[bad] = f32::NAN;
            let sample = Sample {
                time: 0,
                specific_force: Vector3::new(y[0], y[1], y[2]),
                angular_rate: Vector3::new(y[3], y[4], y[5]),
            };
            assert!(!sample.is_finite(), "channel {bad}");
        }
    }
}
