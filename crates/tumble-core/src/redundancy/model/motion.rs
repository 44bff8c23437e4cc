//! Motion of the set: the median over its units, and what a place off the primary's feels of it.

use super::window::UnitWindow;
use crate::real::{Real, real};
use crate::redundancy::components::larger;
use crate::sample::CHANNELS;

/// Channels of the motion: readings, their derivatives, and products of angular rates.
pub const MOTION: usize = 18;

/// Readings of the set, m/s^2 and rad/s, their derivatives, and products xx, yy, zz, xy, xz, yz of angular rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionOfSet<T: Real> {
    force: [T; 3],
    rate: [T; 3],
    force_change: [T; 3],
    rate_change: [T; 3],
    product: [T; CHANNELS],
}

/// `W = [w']x + [w]x[w]x`, 1/s^2, by rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lever<T: Real>(pub [[T; 3]; 3]);

impl<T: Real> MotionOfSet<T> {
    /// Median over the windows that are whole (eq. 12); zero where none is.
    pub fn of_set<const UNITS: usize>(windows: &[UnitWindow<T>; UNITS]) -> Self {
        let mut joined = [T::zero(); MOTION];
        for (channel, place) in joined.iter_mut().enumerate() {
            let mut sorted = [T::zero(); UNITS];
            let mut known = 0;
            for window in windows.iter().filter(|window| window.is_whole) {
                let mut all = window.reading.iter().chain(&window.change).chain(&window.product);
                let value = all.nth(channel).copied().unwrap_or(T::zero());
                insert(&mut sorted, known, value);
                known += 1;
            }
            let at = |index: usize| sorted.get(index).copied().unwrap_or(T::zero());
            if known > 0 {
                *place = (at((known - 1) / 2) + at(known / 2)) * real(0.5);
            }
        }
        Self::of_channels(&joined)
    }

    /// Motion of its channels.
    pub fn of_channels(channels: &[T; MOTION]) -> Self {
        let [
            fx,
            fy,
            fz,
            wx,
            wy,
            wz,
            f1,
            f2,
            f3,
            w1,
            w2,
            w3,
            xx,
            yy,
            zz,
            xy,
            xz,
            yz,
        ] = *channels;
        Self {
            force: [fx, fy, fz],
            rate: [wx, wy, wz],
            force_change: [f1, f2, f3],
            rate_change: [w1, w2, w3],
            product: [xx, yy, zz, xy, xz, yz],
        }
    }

    /// Its channels.
    pub fn channels(&self) -> [T; MOTION] {
        let parts = self.force.iter().chain(&self.rate).chain(&self.force_change);
        let parts = parts.chain(&self.rate_change).chain(&self.product);
        let mut channels = [T::zero(); MOTION];
        channels.iter_mut().zip(parts).for_each(|(to, from)| *to = *from);
        channels
    }

    /// Specific force, m/s^2.
    pub fn force(&self) -> &[T; 3] {
        &self.force
    }

    /// Angular rate, rad/s.
    pub fn rate(&self) -> &[T; 3] {
        &self.rate
    }

    /// Readings of both sensors.
    pub fn readings(&self) -> [[T; 3]; 2] {
        [self.force, self.rate]
    }

    /// Derivatives of both sensors.
    pub fn changes(&self) -> [[T; 3]; 2] {
        [self.force_change, self.rate_change]
    }

    /// Lever of a place off the primary's.
    pub fn lever(&self) -> Lever<T> {
        let [x, y, z] = self.rate_change;
        let [xx, yy, zz, xy, xz, yz] = self.product;
        Lever([
            [-(yy + zz), xy - z, xz + y],
            [xy + z, -(xx + zz), yz - x],
            [xz - y, yz + x, -(xx + yy)],
        ])
    }
}

impl<T: Real> Lever<T> {
    /// `W r`, m/s^2.
    pub fn carried(&self, [x, y, z]: &[T; 3]) -> [T; 3] {
        self.0.map(|[a, b, c]| a * *x + b * *y + c * *z)
    }
}

/// Inserts a value into the first `known` ones, which are sorted.
fn insert<T: Real>(sorted: &mut [T], known: usize, value: T) {
    let mut moved = value;
    for place in sorted.iter_mut().take(known) {
        let larger = larger(*place, moved);
        *place = if moved < *place { moved } else { *place };
        moved = larger;
    }
    if let Some(place) = sorted.get_mut(known) {
        *place = moved;
    }
}
