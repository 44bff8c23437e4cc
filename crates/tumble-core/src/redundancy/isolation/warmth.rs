//! Temperatures of units now and at their calibration, from which the possible drift of biases follows.

use crate::real::{Real, real};
use crate::redundancy::components::{larger, smaller};

/// Largest change of temperature that counts, K: a faulty thermometer must not hide a fault.
const MOST: f64 = 60.0;

/// Axes, whose drifts are independent.
const AXES: f64 = 3.0;

/// Temperatures of a unit, degC; NaN where unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Warmth<T: Real> {
    now: T,
    /// Temperature at the calibration, or the first one measured.
    calibrated: T,
    /// Temperature of the primary then.
    primary: T,
}

/// Temperatures of all units of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Temperatures<T: Real, const UNITS: usize>([Warmth<T>; UNITS]);

impl<T: Real, const UNITS: usize> Temperatures<T, UNITS> {
    /// Creates temperatures that are all unknown.
    pub fn unknown() -> Self {
        let unknown = real(f64::NAN);
        let warmth = Warmth {
            now: unknown,
            calibrated: unknown,
            primary: unknown,
        };
        Self([warmth; UNITS])
    }

    /// Stores the temperature of a unit, degC. If its temperature at the calibration is unknown, this one is
    /// taken.
    pub fn set(&mut self, unit: usize, value: T) {
        if let Some(warmth) = self.0.get_mut(unit) {
            warmth.now = value;
            if !warmth.calibrated.is_finite() {
                warmth.calibrated = value;
            }
        }
        if unit == 0 {
            for warmth in &mut self.0 {
                if !warmth.primary.is_finite() {
                    warmth.primary = value;
                }
            }
        }
    }

    /// Stores the temperatures at a calibration against the primary, or at an agreement with it.
    pub fn calibrated(&mut self, unit: usize) {
        let primary = self.0.first().map(|primary| primary.now);
        if let Some((warmth, primary)) = self.0.get_mut(unit).zip(primary) {
            (warmth.calibrated, warmth.primary) = (warmth.now, primary);
        }
    }

    /// Variance of the difference that two units may have drifted since they were calibrated, for a coefficient
    /// per kelvin and axis (docs/theory/isolation.md, eq. 21).
    pub fn drifted(&self, i: usize, j: usize, coefficient: T) -> T {
        let change = |unit: usize| {
            let warmth = self.0.get(unit).filter(|_| unit != 0);
            warmth.map_or(T::zero(), |warmth| apart(warmth.now, warmth.calibrated))
        };
        let primary = |unit: usize| {
            let warmth = self.0.get(unit)?;
            Some(if unit == 0 { warmth.now } else { warmth.primary })
        };
        let of_primary = primary(i).zip(primary(j)).map_or(T::zero(), |(a, b)| apart(a, b));
        let (own, other) = (change(i), change(j));
        let together = own * own + other * other + of_primary * of_primary;
        if together == T::zero() {
            return T::zero();
        }
        coefficient * coefficient * together * real(AXES) // isolation.md, eq. 21
    }
}

/// Difference of two temperatures, K; zero where one is unknown.
fn apart<T: Real>(a: T, b: T) -> T {
    let apart = a - b;
    if apart.is_finite() {
        smaller(larger(apart, -apart), real(MOST))
    } else {
        T::zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Possible drift of two units, expressed as a change of temperature of one of them, K.
    fn kelvins(temperatures: &Temperatures<f64, 3>, i: usize, j: usize) -> f64 {
        (temperatures.drifted(i, j, 0.002) / AXES).sqrt() / 0.002
    }

    #[test]
    fn nothing_drifts_where_no_temperature_is_known() {
        let mut temperatures = Temperatures::<f64, 3>::unknown();
        temperatures.calibrated(1);
        assert_eq!(temperatures.drifted(0, 1, 0.002), 0.0);
        temperatures.set(1, f64::NAN);
        assert_eq!(temperatures.drifted(1, 2, 0.002), 0.0);
    }

    #[test]
    fn pairs_drift_by_the_change_since_their_calibration() {
        let mut temperatures = Temperatures::<f64, 3>::unknown();
        for unit in 0..3 {
            temperatures.set(unit, 20.0);
        }
        temperatures.set(0, 24.0);
        temperatures.set(1, 23.0);
        assert!((kelvins(&temperatures, 0, 1) - 5.0).abs() < 1e-9);
        assert!((kelvins(&temperatures, 1, 2) - 3.0).abs() < 1e-9);
        temperatures.calibrated(1);
        assert_eq!(kelvins(&temperatures, 0, 1), 0.0);
        // The other was calibrated against a colder primary.
        assert!((kelvins(&temperatures, 1, 2) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn a_thermometer_that_is_wrong_hides_no_more_than_sixty_kelvins() {
        let mut temperatures = Temperatures::<f64, 3>::unknown();
        temperatures.set(1, 20.0);
        temperatures.set(1, 1e9);
        assert!((kelvins(&temperatures, 1, 2) - 60.0).abs() < 1e-9);
        temperatures.set(1, f64::INFINITY);
        assert_eq!(kelvins(&temperatures, 1, 2), 0.0);
    }
}
