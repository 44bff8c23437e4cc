//! What vibration leaves in the means of a unit's windows, as its windows show it.

use nalgebra::Vector3;

use crate::products::{squared, zeros};
use crate::real::{Real, real, tabulated};
use crate::redundancy::components::{difference, larger};
use crate::redundancy::sensor::Sensor;

/// Times over which the scatter of windows, and its share of what vibration may leave, are taken, s.
const SCATTER_OVER: f64 = 2.0;
const SHARE_OVER: f64 = 4.0;

/// Variance that vibration may leave from which on its share is learnt, `(m/s^2)^2` and `(rad/s)^2`.
const SHAKES: [f32; 2] = [4e-4, 2e-6];

/// Variance of the second difference of white noise.
const SECOND_DIFFERENCE: f64 = 6.0;

/// Scatter of what a unit says beyond the set from window to window: docs/theory/judgement.md, eq. 23.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shaking<T: Real> {
    /// How far it was from the set over the latest two windows.
    before: [Vector3<T>; 2],
    /// How many of them there are.
    windows: u8,
    /// Of late.
    scatter: T,
    /// The same, and the most that vibration could leave, where there was any.
    left: T,
    most: T,
}

impl<T: Real> Shaking<T> {
    pub fn new() -> Self {
        Self {
            before: [zeros(); 2],
            windows: 0,
            scatter: T::zero(),
            left: T::zero(),
            most: T::zero(),
        }
    }

    /// Takes in how far it is from the set over the next window of a length, s, and the most that vibration leaves in it.
    pub fn push(&mut self, sensor: Sensor, deviation: &Vector3<T>, most: T, window: T) {
        let [latest, earlier] = self.before;
        self.before = [*deviation, latest];
        if self.windows < 2 {
            self.windows += 1;
            return;
        }
        // Of a ramp, and of what goes with smooth motion, nothing is left.
        let bent = difference(&difference(deviation, &latest), &difference(&latest, &earlier));
        let variance = squared(&bent) * real(1.0 / SECOND_DIFFERENCE); // judgement.md, eq. 23
        self.scatter += (variance - self.scatter) * (window / real(SCATTER_OVER));
        if most <= tabulated(*sensor.of(&SHAKES)) {
            return;
        }
        if self.most == T::zero() {
            (self.left, self.most) = (most, most);
        }
        let gain = window / real(SHARE_OVER);
        self.left += (variance - self.left) * gain; // judgement.md, eq. 23
        self.most += (most - self.most) * gain;
    }

    /// The next window does not follow the latest.
    pub fn interrupt(&mut self) {
        self.windows = 0;
    }

    /// What vibration leaves in a window where it leaves so much at most.
    pub fn variance(&self, most: T) -> T {
        let share = if self.most > T::zero() {
            self.left / self.most
        } else {
            T::one()
        };
        larger(self.scatter, share * most)
    }
}
