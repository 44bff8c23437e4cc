//! Thresholds, and the errors that they refer to.

use crate::real::Real;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::ForceAndRate;

/// Kind of a threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold<T: Real> {
    /// Constant: largest error from the factory plus a margin.
    Fixed(T),
    /// Error from the factory plus a margin, which is constant too.
    FactoryByMargin(T),
    /// Error at the last calibration plus a margin.
    VariableByMargin(T),
    /// Error at the last calibration times a ratio.
    VariableByRatio(T),
}

/// Known errors of a sensor, which thresholds refer to, m/s^2 or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownErrors<T: Real> {
    /// Error at the last calibration.
    pub last: T,
    /// Error from the factory.
    pub factory: T,
}

impl<T: Real> Threshold<T> {
    /// Threshold for known errors.
    pub fn value(&self, known: &KnownErrors<T>) -> T {
        match *self {
            Threshold::Fixed(value) => value,
            Threshold::FactoryByMargin(margin) => known.factory + margin,
            Threshold::VariableByMargin(margin) => known.last + margin,
            Threshold::VariableByRatio(ratio) => known.last * ratio,
        }
    }

    /// Least value of the threshold, whatever the known errors.
    pub fn least(&self) -> T {
        match *self {
            Threshold::Fixed(number)
            | Threshold::FactoryByMargin(number)
            | Threshold::VariableByMargin(number) => number,
            Threshold::VariableByRatio(_) => T::zero(),
        }
    }

    /// Converts the threshold to another type of numbers.
    pub fn in_numbers<U: Real>(&self, number: impl Fn(T) -> U) -> Threshold<U> {
        match *self {
            Threshold::Fixed(value) => Threshold::Fixed(number(value)),
            Threshold::FactoryByMargin(margin) => Threshold::FactoryByMargin(number(margin)),
            Threshold::VariableByMargin(margin) => Threshold::VariableByMargin(number(margin)),
            Threshold::VariableByRatio(ratio) => Threshold::VariableByRatio(number(ratio)),
        }
    }

    /// Returns whether the threshold can be met: positive, and a ratio above one.
    pub fn is_possible(&self) -> bool {
        match *self {
            Threshold::Fixed(number)
            | Threshold::FactoryByMargin(number)
            | Threshold::VariableByMargin(number) => number.is_finite() && number > T::zero(),
            Threshold::VariableByRatio(ratio) => ratio.is_finite() && ratio > T::one(),
        }
    }
}

/// Threshold for each sensor of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorThresholds<T: Real> {
    /// m/s^2.
    pub accelerometer: Threshold<T>,
    /// rad/s.
    pub gyroscope: Threshold<T>,
}

impl<T: Real> SensorThresholds<T> {
    /// Threshold of a sensor.
    pub fn of(&self, sensor: Sensor) -> &Threshold<T> {
        match sensor {
            Sensor::Accelerometer => &self.accelerometer,
            Sensor::Gyroscope => &self.gyroscope,
        }
    }
}

/// Thresholds of readings at rest.
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
    fn only_variable_thresholds_follow_the_last_error() {
        let known = KnownErrors {
            last: 5.0,
            factory: 3.0,
        };
        assert_eq!(Threshold::Fixed(0.1).value(&known), 0.1);
        assert_eq!(Threshold::FactoryByMargin(0.1).value(&known), 3.1);
        assert_eq!(Threshold::VariableByMargin(0.1).value(&known), 5.1);
        assert_eq!(Threshold::VariableByRatio(1.5).value(&known), 7.5);
    }

    #[test]
    fn a_threshold_that_everything_exceeds_is_not_possible() {
        assert!(Threshold::Fixed(0.1).is_possible());
        assert!(!Threshold::Fixed(0.0).is_possible());
        assert!(!Threshold::VariableByMargin(-0.1).is_possible());
        assert!(!Threshold::FactoryByMargin(0.0).is_possible());
        assert!(!Threshold::VariableByRatio(1.0).is_possible());
        assert!(!Threshold::VariableByRatio(f64::NAN).is_possible());
    }
}
