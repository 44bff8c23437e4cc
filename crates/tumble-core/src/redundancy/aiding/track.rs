//! Velocity over the latest second, for aiding measurements that arrive late.

use nalgebra::Vector3;

use crate::real::{Real, count, real};

/// Number of stored velocities, and windows between them.
const KEPT: usize = 11;
const EVERY: u8 = 2;

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

    /// Returns whether no velocity is stored.
    pub fn is_new(&self) -> bool {
        self.seen == 0
    }

    /// Stores the velocity after the next window.
    pub fn push(&mut self, velocity: &Vector3<T>, acceleration: &Vector3<T>) {
        self.acceleration = *acceleration;
        self.seen = self.seen.saturating_add(1);
        self.since = self.since.saturating_add(1);
        if self.since >= EVERY {
            self.since = 0;
            let mut later = *velocity;
            for kept in &mut self.kept {
                core::mem::swap(kept, &mut later);
            }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_velocity_that_grows_steadily_is_known_at_every_time() {
        const H: f64 = 0.05;
        let acceleration = Vector3::new(0.5, -2.0, 1.0);
        let velocity = |windows: f64| Vector3::new(3.0, 1.0, -4.0) + acceleration * (windows * H);
        let mut track = Track::new();
        for windows in 0..50_u32 {
            let now = velocity(f64::from(windows));
            track.push(&now, &acceleration);
            let known = LATE.min(u64::from(windows)) as i32;
            for halves in -2 * EARLY as i32..=2 * known {
                let ago = 0.5 * f64::from(halves);
                let found = track.at(ago, &now, H).expect("no older than what is stored");
                let expected = velocity(f64::from(windows) - ago);
                assert!(
                    (found - expected).norm() < 1e-12,
                    "{ago} of {windows}: {found} {expected}"
                );
            }
            assert_eq!(track.at(f64::from(windows) + 1.5, &now, H), None);
        }
    }
}
