//! What is kept of each unit: how far it is from the set, and what it says against itself.

use nalgebra::Vector3;

use crate::real::{Real, real, tabulated};
use crate::redundancy::judgement::scales::{SCALES, filled, follow_vector, shares};
use crate::redundancy::sensor::Sensor;

/// Fastest that a slow offset follows, and the most it may become: m/s^2 and rad/s, per second and in all.
const SLEW: [f32; 2] = [1e-4, 3e-5];
const SLOW_OFFSET: [f32; 2] = [0.1, 0.01];

/// One sensor of a unit against the set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorDeviation<T: Real> {
    /// Of what it says from what the set says, over each scale, less the slow offset, m/s^2 or rad/s.
    means: [Vector3<T>; SCALES],
    /// Slow offset: drift within specification, which is no calibration.
    offset: Vector3<T>,
    /// Windows taken in.
    windows: u16,
}

impl<T: Real> SensorDeviation<T> {
    /// Nothing seen.
    pub fn new() -> Self {
        Self {
            means: [Vector3::zeros(); SCALES],
            offset: Vector3::zeros(),
            windows: 0,
        }
    }

    /// Takes in how far it is from the set over the next window. `window` is its length, s.
    pub fn push(&mut self, deviation: &Vector3<T>, window: T) {
        self.windows = self.windows.saturating_add(1);
        let shares = shares(window, self.windows.into());
        follow_vector(&mut self.means, &(deviation - self.offset), &shares);
    }

    /// Lets the offset follow, as it may while nothing is wrong.
    pub fn follow(&mut self, sensor: Sensor, window: T) {
        let [_, _, mean, _] = self.means;
        let size = mean.norm();
        if size <= T::zero() {
            return;
        }
        let step = mean * ((tabulated::<T>(*sensor.of(&SLEW)) * window).min(size) / size);
        let moved = self.offset + step;
        let most = tabulated::<T>(*sensor.of(&SLOW_OFFSET));
        let size = moved.norm();
        self.offset = if size > most { moved * (most / size) } else { moved };
    }

    /// Forgets means; the slow offset stays.
    pub fn restart(&mut self) {
        *self = Self {
            offset: self.offset,
            ..Self::new()
        };
    }

    /// Begins anew, with what it is off by over a second for its slow offset: a unit that needs no calibration.
    pub fn accept(&mut self, sensor: Sensor) {
        let [_, second, ..] = self.means;
        let offset = self.offset + second;
        let most = tabulated::<T>(*sensor.of(&SLOW_OFFSET));
        let size = offset.norm();
        *self = Self {
            offset: if size > most {
                offset * (most / size)
            } else {
                offset
            },
            ..Self::new()
        };
    }

    /// Over one scale; `None` until it is filled.
    pub fn mean(&self, scale: usize, window: T) -> Option<&Vector3<T>> {
        let filled = filled(window, self.windows.into());
        filled.get(scale).filter(|filled| **filled)?;
        self.means.get(scale)
    }
}

/// Largest changes from sample to sample of one sensor, over the latest spans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps<T: Real> {
    spans: [Vector3<T>; SPANS],
    usual: Option<T>,
    windows: u8,
}

/// Spans that are kept, and windows in each: 1.2 s at 50 ms.
const SPANS: usize = 4;
const WINDOWS_A_SPAN: u8 = 6;

/// Share by which the usual largest change moves, a span.
const USUAL_SHARE: f64 = 0.1;

impl<T: Real> Steps<T> {
    /// None.
    pub fn new() -> Self {
        Self {
            spans: [Vector3::zeros(); SPANS],
            usual: None,
            windows: 0,
        }
    }

    /// Takes in the largest change from sample to sample over the next window.
    pub fn push(&mut self, largest: &Vector3<T>) {
        if self.windows >= WINDOWS_A_SPAN {
            self.windows = 0;
            let [a, b, c, d] = self.spans;
            let left = d.norm();
            if left > T::zero() {
                let usual = self.usual.get_or_insert(left);
                *usual += (left - *usual) * real(USUAL_SHARE);
            }
            self.spans = [Vector3::zeros(), a, b, c];
        }
        self.windows = self.windows.saturating_add(1);
        if let Some(span) = self.spans.first_mut()
            && largest.norm_squared() > span.norm_squared()
        {
            *span = *largest;
        }
    }

    /// The largest change along a direction over the latest spans, and the largest against it.
    pub fn along(&self, direction: &Vector3<T>) -> (T, T) {
        let changes = self.spans.iter().map(|step| step.dot(direction));
        changes.fold((T::zero(), T::zero()), |(along, against), change| {
            (along.max(change), against.max(-change))
        })
    }

    /// The largest change of a usual span, once it is known, m/s^2 or rad/s.
    pub fn usual(&self) -> Option<T> {
        self.usual
    }
}

/// Gravity as a unit's own gyroscope carries it, against what its accelerometer says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriedGravity<T: Real> {
    gravity: Option<Vector3<T>>,
    error: Vector3<T>,
}

/// Time over which gravity is brought back to what the accelerometer says, and its error is averaged, s.
const CARRIED_OVER: f64 = 20.0;
const ERROR_OVER: f64 = 3.0;

impl<T: Real> CarriedGravity<T> {
    /// Not known.
    pub fn new() -> Self {
        Self {
            gravity: None,
            error: Vector3::zeros(),
        }
    }

    /// Takes in a window of compensated readings; `g` is the magnitude of gravity, m/s^2 (docs/theory/judgement.md, eq. 14).
    pub fn push(&mut self, f: &Vector3<T>, w: &Vector3<T>, g: T, window: T) {
        let carried: &mut Vector3<T> = self.gravity.get_or_insert(*f);
        // A rotation by -w h, to second order.
        let turn: Vector3<T> = w * -window;
        let turned: Vector3<T> =
            *carried + turn.cross(carried) + turn.cross(&turn.cross(carried)) * real::<T>(0.5);
        let error: Vector3<T> = f - turned; // judgement.md, eq. 14
        let next: Vector3<T> = turned + error * (window / real::<T>(CARRIED_OVER));
        let size = next.norm();
        *carried = if size > T::zero() { next * (g / size) } else { *f };
        self.error += (error - self.error) * (window / real::<T>(ERROR_OVER));
    }

    /// What the accelerometer says beyond it, mean over the latest seconds, m/s^2.
    pub fn error(&self) -> &Vector3<T> {
        &self.error
    }
}
