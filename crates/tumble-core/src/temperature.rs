//! Change of bias and scale with temperature: polynomials, held constant beyond the range of their fit.
//!
//! `y = (1 + s(t)) M u + b + d(t)`, `t` being the temperature, within the range, less a reference in its middle
//! (docs/theory/thermal.md, eq. 1). At the reference nothing changes, so that a calibration without temperature is one
//! at the reference.

use nalgebra::Vector3;

use crate::real::Real;

/// Highest power of temperature.
pub const HIGHEST_ORDER: usize = 3;

/// Coefficients of `t`, `t^2`, ... for the three axes of a triad: 1/K, 1/K^2, ... times the unit of what changes.
pub type Coefficients<T> = [Vector3<T>; HIGHEST_ORDER];

/// Temperature drift of one triad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureDrift<T: Real> {
    /// Temperature at which nothing changes, degC.
    pub reference: T,
    /// Lowest and highest temperature at which it was seen, degC.
    pub range: [T; 2],
    /// Drift of the bias, in the unit of the triad.
    pub bias: Coefficients<T>,
    /// Drift of the scale factors of the sensing axes, a ratio.
    pub scale: Coefficients<T>,
}

impl<T: Real> TemperatureDrift<T> {
    /// Tests whether a temperature, degC, is within the range; not-a-number is not.
    pub fn knows(&self, temperature: T) -> bool {
        let [low, high] = self.range;
        (low..=high).contains(&temperature)
    }

    /// Change of the bias at a temperature, degC, in the unit of the triad.
    pub fn bias_at(&self, temperature: T) -> Vector3<T> {
        polynomial(&self.bias, self.difference(temperature))
    }

    /// Relative change of the scale factors at a temperature, degC.
    pub fn scale_at(&self, temperature: T) -> Vector3<T> {
        polynomial(&self.scale, self.difference(temperature))
    }

    /// Corrects the reading `y` of a triad of bias `b` at a temperature, degC, to the reference temperature.
    pub fn at_reference(&self, y: &Vector3<T>, b: &Vector3<T>, temperature: T) -> Vector3<T> {
        let (d, s) = (self.bias_at(temperature), self.scale_at(temperature));
        let one = T::one();
        Vector3::new(
            (y.x - b.x - d.x) / (one + s.x) + b.x, // eq. 1
            (y.y - b.y - d.y) / (one + s.y) + b.y,
            (y.z - b.z - d.z) / (one + s.z) + b.z,
        )
    }

    /// From the reference, K. Nobody knows the temperature of a thermometer that failed: then the reference is the
    /// best guess.
    fn difference(&self, temperature: T) -> T {
        let [low, high] = self.range;
        if temperature.is_finite() {
            temperature.max(low).min(high) - self.reference // eq. 2
        } else {
            T::zero()
        }
    }
}

fn polynomial<T: Real>(coefficients: &Coefficients<T>, t: T) -> Vector3<T> {
    let [first, second, third] = coefficients;
    (((third * t) + second) * t + first) * t // eq. 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drift() -> TemperatureDrift<f64> {
        TemperatureDrift {
            reference: 25.0,
            range: [-20.0, 70.0],
            bias: [
                Vector3::new(1e-3, 0.0, -2e-3),
                Vector3::new(0.0, 1e-5, 0.0),
                Vector3::new(0.0, 0.0, 1e-7),
            ],
            scale: [Vector3::new(1e-5, -2e-5, 0.0), Vector3::zeros(), Vector3::zeros()],
        }
    }

    const BIAS: Vector3<f64> = Vector3::new(0.1, -0.2, 0.05);

    #[test]
    fn readings_at_any_temperature_are_corrected_to_the_reference() {
        let (at_reference, drift) = (Vector3::new(3.0, -5.0, 8.0), drift());
        for temperature in [-20.0, 0.0, 25.0, 69.0] {
            let scale = drift.scale_at(temperature).add_scalar(1.0);
            let y = (at_reference - BIAS).component_mul(&scale) + BIAS + drift.bias_at(temperature);
            let found = drift.at_reference(&y, &BIAS, temperature);
            assert!((found - at_reference).norm() < 1e-14, "{temperature}: {found}");
        }
    }

    #[test]
    fn each_power_of_temperature_has_its_coefficient() {
        let change = drift().bias_at(35.0);
        assert!((change - Vector3::new(1e-2, 1e-3, -2e-2 + 1e-4)).norm() < 1e-16);
    }

    #[test]
    fn at_the_reference_nothing_changes() {
        assert_eq!(drift().bias_at(25.0), Vector3::zeros());
        assert_eq!(drift().scale_at(25.0), Vector3::zeros());
    }

    #[test]
    fn beyond_the_range_the_value_of_its_edge_is_held() {
        let drift = drift();
        assert_eq!(drift.bias_at(90.0), drift.bias_at(70.0));
        assert_eq!(drift.bias_at(-60.0), drift.bias_at(-20.0));
        assert!(!drift.knows(70.5) && drift.knows(70.0));
    }

    #[test]
    fn where_the_thermometer_failed_the_reference_is_assumed() {
        for temperature in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(drift().bias_at(temperature), Vector3::zeros());
            assert!(!drift().knows(temperature));
        }
    }
}
