//! The thresholds, and what they are measured from.

use crate::real::Real;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::ForceAndRate;

/// How a threshold is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold<T: Real> {
    /// Always the same: the error a unit may have from the factory with a margin upon it.
    Fixed(T),
    /// The last error and a margin upon it.
    VariableByMargin(T),
    /// The last error times a ratio.
    VariableByRatio(T),
}

impl<T: Real> Threshold<T> {
    /// The threshold where the last error is `last`.
    pub fn value(&self, last: T) -> T {
        match *self {
            Threshold::Fixed(value) => value,
            Threshold::VariableByMargin(margin) => last + margin,
            Threshold::VariableByRatio(ratio) => last * ratio,
        }
    }

    /// Whether it can ever be met: positive, and a ratio above one.
    pub fn is_possible(&self) -> bool {
        match *self {
            Threshold::Fixed(number) | Threshold::VariableByMargin(number) => {
                number.is_finite() && number > T::zero()
            }
            Threshold::VariableByRatio(ratio) => ratio.is_finite() && ratio > T::one(),
        }
    }
}

/// A threshold for each sensor of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorThresholds<T: Real> {
    /// m/s^2.
    pub accelerometer: Threshold<T>,
    /// rad/s.
    pub gyroscope: Threshold<T>,
}

impl<T: Real> SensorThresholds<T> {
    /// The one of a sensor.
    pub fn of(&self, sensor: Sensor) -> &Threshold<T> {
        match sensor {
            Sensor::Accelerometer => &self.accelerometer,
            Sensor::Gyroscope => &self.gyroscope,
        }
    }
}

/// What readings at rest are compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds<T: Real> {
    /// Scatter, and change of the mean, below which a unit is at rest.
    pub rest_scatter: ForceAndRate<T>,
    /// Deviations of a secondary above which its calibration is triggered.
    pub secondary: SensorThresholds<T>,
    /// Deviations of the primary above which it is invalid.
    pub primary: SensorThresholds<T>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fixed_threshold_forgets_the_last_error_and_variable_ones_follow_it() {
        assert_eq!(Threshold::Fixed(0.1).value(5.0), 0.1);
        assert_eq!(Threshold::VariableByMargin(0.1).value(5.0), 5.1);
        assert_eq!(Threshold::VariableByRatio(1.5).value(5.0), 7.5);
    }

    #[test]
    fn a_threshold_that_everything_exceeds_is_not_possible() {
        assert!(Threshold::Fixed(0.1).is_possible());
        assert!(!Threshold::Fixed(0.0).is_possible());
        assert!(!Threshold::VariableByMargin(-0.1).is_possible());
        assert!(!Threshold::VariableByRatio(1.0).is_possible());
        assert!(!Threshold::VariableByRatio(f64::NAN).is_possible());
    }
}
