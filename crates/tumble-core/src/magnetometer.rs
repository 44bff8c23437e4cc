//! Magnetometers: the error model of a triad, and what currents nearby add to it.
//!
//! `y = M u + b + c I`: M holds soft iron, scale, non-orthogonality and mounting, b hard iron, and I is the current
//! through the motors, or the throttle that it follows (docs/conventions.md).

use nalgebra::Vector3;

use crate::model::{Correction, ErrorModel, ModelError};
use crate::real::Real;

/// Forward model of a magnetometer, `y = M u + b + c I`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetometerModel<T: Real> {
    /// M, and b in uT.
    pub model: ErrorModel<T>,
    /// c, uT per A, or uT at full throttle; zero where nobody knows it.
    pub current: Vector3<T>,
}

/// Inverse model of a magnetometer, `u = C (y - b - c I)` with `C = M^-1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetometerCorrection<T: Real> {
    /// C, and b in uT.
    pub correction: Correction<T>,
    /// c, uT per A, or uT at full throttle.
    pub current: Vector3<T>,
}

impl<T: Real> MagnetometerModel<T> {
    /// The correction that undoes this model.
    ///
    /// # Errors
    /// [`ModelError::Singular`] if `M` has no inverse.
    pub fn correction(&self) -> Result<MagnetometerCorrection<T>, ModelError> {
        Ok(MagnetometerCorrection {
            correction: self.model.correction()?,
            current: self.current,
        })
    }
}

impl<T: Real> MagnetometerCorrection<T> {
    /// The field, uT, behind the reading `y` at a current, A, or a throttle from 0 to 1. A current that is no number is
    /// not known, and its effect stays.
    pub fn apply(&self, y: &Vector3<T>, current: T) -> Vector3<T> {
        let c = &self.current;
        let i = if current.is_finite() { current } else { T::zero() };
        self.correction
            .apply(&Vector3::new(y.x - c.x * i, y.y - c.y * i, y.z - c.z * i))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    fn magnetometer() -> MagnetometerModel<f64> {
        MagnetometerModel {
            model: ErrorModel {
                matrix: Matrix3::new(1.1, 0.02, -0.03, 0.01, 0.9, 0.04, -0.02, 0.05, 1.2),
                bias: Vector3::new(12.0, -35.0, 4.5),
            },
            current: Vector3::new(0.8, -0.3, 2.0),
        }
    }

    #[test]
    fn correction_undoes_hard_iron_soft_iron_and_current() {
        let (unit, truth) = (magnetometer(), Vector3::new(20.0, -5.0, 43.0));
        let reading = unit.model.measure(&truth) + unit.current * 7.5;
        let found = unit.correction().unwrap().apply(&reading, 7.5);
        assert!((found - truth).norm() < 1e-12, "{found}");
    }

    #[test]
    fn effect_of_an_unknown_current_stays() {
        let unit = magnetometer();
        let correction = unit.correction().unwrap();
        let reading = Vector3::new(20.0, -5.0, 43.0);
        assert_eq!(
            correction.apply(&reading, f64::NAN),
            correction.apply(&reading, 0.0)
        );
        assert_ne!(correction.apply(&reading, 1.0), correction.apply(&reading, 0.0));
    }

    #[test]
    fn matrix_without_an_inverse_has_no_correction() {
        let mut unit = magnetometer();
        unit.model.matrix = Matrix3::zeros();
        assert_eq!(unit.correction(), Err(ModelError::Singular));
    }
}
