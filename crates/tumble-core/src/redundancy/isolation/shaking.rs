//! Vibration that remains in the window means of a unit, estimated from their scatter.

use nalgebra::Vector3;

use crate::products::{squared, zeros};
use crate::real::{Real, real, tabulated};
use crate::redundancy::components::{difference, larger};
use crate::redundancy::sensor::Sensor;

/// Time constants of the scatter of windows, and of its share of the largest possible vibration, s.
const SCATTER_OVER: f64 = 2.0;
const SHARE_OVER: f64 = 4.0;

/// Variance of possible vibration above which its share is learnt, `(m/s^2)^2` and `(rad/s)^2`.
const SHAKES: [f32; 2] = [4e-4, 2e-6];

/// Variance of the second difference of white noise.
const SECOND_DIFFERENCE: f64 = 6.0;

/// Scatter of the deviation of a unit from the set, window to window: docs/theory/isolation.md, eq. 16.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shaking<T: Real> {
    /// Deviations from the set in the latest two windows.
    before: [Vector3<T>; 2],
    /// Recent scatter.
    scatter: T,
    /// The same, and the most that vibration could leave, where there was any.
    left: T,
    most: T,
}

/// Variance that vibration leaves in a window of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftByVibration<T: Real> {
    /// Recent scatter.
    scatter: T,
    /// Share of the largest possible variance.
    share: T,
}

impl<T: Real> LeftByVibration<T> {
    /// All of the largest possible variance.
    pub fn all() -> Self {
        Self {
            scatter: T::zero(),
            share: T::one(),
        }
    }

    /// Variance, given the largest possible one.
    pub fn variance(&self, most: T) -> T {
        larger(self.scatter, self.share * most)
    }
}

impl<T: Real> Shaking<T> {
    pub fn new() -> Self {
        Self {
            before: [zeros(); 2],
            scatter: T::zero(),
            left: T::zero(),
            most: T::zero(),
        }
    }

    /// Updates the scatter with the deviation over the next window of a length, s; `most` is the largest
    /// variance of vibration. The deviation is compared with the previous two only if it `follows` them.
    pub fn push(&mut self, sensor: Sensor, deviation: &Vector3<T>, most: T, window: T, follows: bool) {
        let [latest, earlier] = self.before;
        self.before = [*deviation, latest];
        if !follows {
            return;
        }
        // The second difference removes ramps and smooth motion.
        let bent = difference(&difference(deviation, &latest), &difference(&latest, &earlier));
        let variance = squared(&bent) * real(1.0 / SECOND_DIFFERENCE); // isolation.md, eq. 16
        self.scatter += (variance - self.scatter) * (window / real(SCATTER_OVER));
        if most <= tabulated(*sensor.of(&SHAKES)) {
            return;
        }
        if self.most == T::zero() {
            (self.left, self.most) = (most, most);
        }
        let gain = window / real(SHARE_OVER);
        self.left += (variance - self.left) * gain; // isolation.md, eq. 16
        self.most += (most - self.most) * gain;
    }

    /// Deviation from the set in the window before the latest.
    pub fn before(&self) -> &Vector3<T> {
        let [_, before] = &self.before;
        before
    }

    /// Variance that vibration leaves in a window.
    pub fn left(&self) -> LeftByVibration<T> {
        LeftByVibration {
            scatter: self.scatter,
            share: if self.most > T::zero() {
                self.left / self.most
            } else {
                T::one()
            },
        }
    }
}
