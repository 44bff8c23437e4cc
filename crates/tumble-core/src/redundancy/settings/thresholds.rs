//! The six thresholds, and what they are measured from.

use crate::real::Real;

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

/// The thresholds by their names. Those of specific force are in m/s^2, those of angular rate in rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds<T: Real> {
    /// Scatter of specific force, and change of its mean, below which a unit is at rest.
    pub first: T,
    /// Scatter of angular rate, and change of its mean, below which a unit is at rest.
    pub second: T,
    /// Deviation of the secondary's accelerometer above which its calibration is triggered.
    pub third: Threshold<T>,
    /// Deviation of the secondary's gyroscope above which its calibration is triggered.
    pub fourth: Threshold<T>,
    /// Deviation of the primary's accelerometer above which it is invalid.
    pub fifth: Threshold<T>,
    /// Deviation of the primary's gyroscope above which it is invalid.
    pub sixth: Threshold<T>,
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
