//! The thresholds, and what they are measured from.

use crate::real::Real;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::ForceAndRate;

/// How a threshold is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold<T: Real> {
    /// Always the same: the error a unit may have from the factory with a margin upon it.
    Fixed(T),
    /// The error from the factory and a margin upon it, which stays the same too.
    FactoryByMargin(T),
    /// The error at the last calibration and a margin upon it.
    VariableByMargin(T),
    /// The error at the last calibration times a ratio.
    VariableByRatio(T),
}

/// Errors of a sensor that are known, from which thresholds are counted, m/s^2 or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownErrors<T: Real> {
    /// At the last calibration.
    pub last: T,
    /// From the factory.
    pub factory: T,
}

impl<T: Real> Threshold<T> {
    /// The threshold where these errors are known.
    pub fn value(&self, known: &KnownErrors<T>) -> T {
        match *self {
            Threshold::Fixed(value) => value,
            Threshold::FactoryByMargin(margin) => known.factory + margin,
            Threshold::VariableByMargin(margin) => known.last + margin,
            Threshold::VariableByRatio(ratio) => known.last * ratio,
        }
    }

    /// What it is at least, whatever errors are known.
    pub fn least(&self) -> T {
        match *self {
            Threshold::Fixed(number)
            | Threshold::FactoryByMargin(number)
            | Threshold::VariableByMargin(number) => number,
            Threshold::VariableByRatio(_) => T::zero(),
        }
    }

    /// The same threshold in other numbers.
    pub fn in_numbers<U: Real>(&self, number: impl Fn(T) -> U) -> Threshold<U> {
        match *self {
            Threshold::Fixed(value) => Threshold::Fixed(number(value)),
            Threshold::FactoryByMargin(margin) => Threshold::FactoryByMargin(number(margin)),
            Threshold::VariableByMargin(margin) => Threshold::VariableByMargin(number(margin)),
            Threshold::VariableByRatio(ratio) => Threshold::VariableByRatio(number(ratio)),
        }
    }

    /// Whether it can ever be met: positive, and a ratio above one.
    pub fn is_possible(&self) -> bool {
        match *self {
            Threshold::Fixed(number)
            | Threshold::FactoryByMargin(number)
            | Threshold::VariableByMargin(number) => number.is_finite() && number > T::zero(),
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
