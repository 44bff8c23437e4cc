//! What is kept of each unit: how far it is from the set, and what it says against itself.

use nalgebra::Vector3;

use crate::products::{Length, cross, squared, zeros};
use crate::real::{Real, real, tabulated};
use crate::redundancy::components::{difference, follow, scaled, sum};
use crate::redundancy::judgement::scales::{LatestShares, SCALES, filled};
use crate::redundancy::judgement::shaking::Shaking;
use crate::redundancy::sensor::Sensor;

/// Fastest that a slow offset follows, and the most it may become: m/s^2 and rad/s, per second and in all. Consumer units
/// warm no faster (docs/theory/judgement.md, table 1); what is left beyond it is held against them.
const SLEW: [f32; 2] = [2e-4, 7e-5];
pub(crate) const SLOW_OFFSET: [f32; 2] = [0.1, 0.01];

/// One sensor of a unit against the set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorDeviation<T: Real> {
    /// Of what it says from what the set says, over each scale, less the slow offset, m/s^2 or rad/s.
    means: [Vector3<T>; SCALES],
    /// Slow offset: drift within specification, which is no calibration.
    offset: Vector3<T>,
    shaking: Shaking<T>,
    /// Windows taken in.
    windows: u16,
    /// Scales that they fill, the shortest first.
    filled: u8,
}

impl<T: Real> SensorDeviation<T> {
    /// Nothing seen.
    pub fn new() -> Self {
        Self {
            means: [zeros(); SCALES],
            offset: zeros(),
            shaking: Shaking::new(),
            windows: 0,
            filled: 0,
        }
    }

    /// Takes in how far it is from the set over the next window, and the most that vibration leaves in it.
    pub fn push(
        &mut self,
        sensor: Sensor,
        deviation: &Vector3<T>,
        vibration: T,
        shares: &mut LatestShares<T>,
    ) {
        self.shaking.push(sensor, deviation, vibration, shares.window());
        self.windows = self.windows.saturating_add(1);
        self.filled = filled(self.filled, shares.window(), self.windows);
        let value = difference(deviation, &self.offset);
        for (mean, share) in self.means.iter_mut().zip(shares.after(self.windows)) {
            follow(mean, &value, *share); // judgement.md, eq. 2
        }
    }

    /// It says nothing over the next window.
    pub fn skip(&mut self) {
        self.shaking.interrupt();
    }

    /// What vibration leaves in a window where it leaves so much at most.
    pub fn shaken(&self, most: T) -> T {
        self.shaking.variance(most)
    }

    /// Lets the offset follow, as it may while nothing is wrong.
    pub fn follow(&mut self, sensor: Sensor, window: T) {
        let [_, _, mean, _] = &self.means;
        let (slew, square) = (tabulated::<T>(*sensor.of(&SLEW)) * window, squared(mean));
        if square <= slew * slew {
            self.offset += mean;
        } else {
            self.offset += scaled(mean, slew / square.square_root());
        }
        let (most, square) = (tabulated::<T>(*sensor.of(&SLOW_OFFSET)), squared(&self.offset));
        if square > most * most {
            self.offset = scaled(&self.offset, most / square.square_root());
        }
    }

    /// Forgets means; the slow offset stays.
    pub fn restart(&mut self) {
        self.shaking.interrupt();
        *self = Self {
            offset: self.offset,
            shaking: self.shaking,
            ..Self::new()
        };
    }

    /// Begins anew, with what it is off by over a second for its slow offset: a unit that needs no calibration.
    pub fn accept(&mut self, sensor: Sensor) {
        let [_, second, ..] = self.means;
        let offset = self.offset + second;
        self.begin_with(sensor, &offset);
    }

    /// So much more is taken off what it says from now on: of the slow offset no more is left.
    pub fn trimmed(&mut self, change: &Vector3<T>) {
        self.offset = difference(&self.offset, change);
    }

    /// Begins anew with a slow offset, or as much of it as there may be.
    pub fn begin_with(&mut self, sensor: Sensor, offset: &Vector3<T>) {
        let most = tabulated::<T>(*sensor.of(&SLOW_OFFSET));
        let size = offset.length();
        *self = Self {
            offset: if size > most {
                offset * (most / size)
            } else {
                *offset
            },
            shaking: self.shaking,
            ..Self::new()
        };
    }

    /// How far it has drifted from the set since it was calibrated, over ten seconds; `None` until they have passed.
    pub fn drifted(&self) -> Option<Vector3<T>> {
        Some(sum(&self.offset, self.mean(2)?))
    }

    /// Over each scale that is filled, the shortest first.
    pub fn means(&self) -> &[Vector3<T>] {
        self.means.get(..self.filled.into()).unwrap_or(&self.means)
    }

    /// Over one scale; `None` until it is filled.
    pub fn mean(&self, scale: usize) -> Option<&Vector3<T>> {
        self.means().get(scale)
    }
}

/// Gravity as a unit's own gyroscope carries it, against what its accelerometer says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriedGravity<T: Real> {
    /// Zero until it is known.
    gravity: Vector3<T>,
    error: Vector3<T>,
}

/// Time over which gravity is brought back to what the accelerometer says, and its error is averaged, s.
pub(super) const CARRIED_OVER: f64 = 20.0;
const ERROR_OVER: f64 = 3.0;

impl<T: Real> CarriedGravity<T> {
    /// Not known.
    pub fn new() -> Self {
        Self {
            gravity: zeros(),
            error: zeros(),
        }
    }

    /// Takes in a window of compensated readings; `g` is the magnitude of gravity, m/s^2 (docs/theory/judgement.md, eq. 14).
    pub fn push(&mut self, f: &Vector3<T>, w: &Vector3<T>, g: T, window: T) {
        if squared(&self.gravity) == T::zero() {
            self.gravity = *f;
        }
        let carried = &mut self.gravity;
        // A rotation by -w h, to second order.
        let turn = scaled(w, -window);
        let first = cross(&turn, carried);
        let second = scaled(&cross(&turn, &first), real(0.5));
        let turned = sum(&sum(carried, &first), &second);
        let error = difference(f, &turned); // judgement.md, eq. 14
        let mut next = turned;
        follow(&mut next, f, window / real::<T>(CARRIED_OVER));
        let size = squared(&next).square_root();
        *carried = if size > T::zero() {
            scaled(&next, g / size)
        } else {
            *f
        };
        follow(&mut self.error, &error, window / real::<T>(ERROR_OVER));
    }

    /// What the accelerometer says beyond it, mean over the latest seconds, m/s^2.
    pub fn error(&self) -> &Vector3<T> {
        &self.error
    }
}
