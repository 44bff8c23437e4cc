//! Velocity over the latest second, for aiding measurements that arrive late.

use nalgebra::Vector3;

use crate::real::{Real, count, real};

/// Number of stored velocities, and windows between them.
const KEPT: usize = 6;
const EVERY: u8 = 4;

/// Largest delay of an aiding measurement, windows, and largest lead, for which the latest velocity is
/// extrapolated.
pub(super) const LATE: u64 = 20;
pub(super) const EARLY: u64 = 4;

/// Velocity, level frame, m/s, newest first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Track<T: Real> {
    kept: [Vector3<T>; KEPT],
    /// Windows since the newest velocity, and windows in all.
    since: u8,
    seen: u8,
    /// Acceleration over the latest window, m/s^2.
    acceleration: Vector3<T>,
}

impl<T: Real> Track<T> {
    pub fn new() -> Self {
        Self {
            kept: [Vector3::zeros(); KEPT],
            since: EVERY,
            seen: 0,
            acceleration: Vector3::zeros(),
        }
    }

    /// Stores the velocity after the next window.
    pub fn push(&mut self, velocity: &Vector3<T>, acceleration: &Vector3<T>) {
        self.acceleration = *acceleration;
        self.seen = self.seen.saturating_add(1);
        self.since = self.since.saturating_add(1);
        if self.since >= EVERY {
            self.since = 0;
            let [a, b, c, d, e, _] = self.kept;
            self.kept = [*velocity, a, b, c, d, e];
        }
    }

    /// Velocity a number of windows ago, negative in the future; `now` is the velocity after the latest window
    /// of `length` s.
    pub fn at(&self, windows: T, now: &Vector3<T>, length: T) -> Option<Vector3<T>> {
        if windows <= T::zero() {
            return Some(now - self.acceleration * (windows * length));
        }
        if windows > count(self.seen.into()) {
            return None;
        }
        let (mut later, mut later_age) = (now, T::zero());
        for (number, velocity) in (0_u32..).zip(&self.kept) {
            let age = count::<T>(u32::from(self.since).saturating_add(number.saturating_mul(EVERY.into())));
            if age >= windows {
                let span = (age - later_age).max(real(1e-3));
                return Some(later + (velocity - later) * ((windows - later_age) / span));
            }
            (later, later_age) = (velocity, age);
        }
        None
    }

    /// Applies a correction to all stored velocities.
    pub fn change(&mut self, change: impl Fn(&Vector3<T>) -> Vector3<T>) {
        for velocity in &mut self.kept {
            *velocity = change(velocity);
        }
    }
}
