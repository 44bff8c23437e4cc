//! Readings of a triad that stay within a step while a robot turns (docs/theory/spin.md, eq. 22).

use nalgebra::Vector3;

use crate::real::{Real, count};

/// Axes of a triad.
const AXES: usize = 3;

/// Stretches of the turn over which the readings of an axis stay within a step: rounding is the same all along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvenReadings<T: Real> {
    levels: [T; AXES],
    blocks: [u32; AXES],
    squares: [T; AXES],
    total: u32,
}

impl<T: Real> EvenReadings<T> {
    /// Nothing seen yet.
    pub fn new() -> Self {
        Self {
            levels: [T::zero(); AXES],
            blocks: [0; AXES],
            squares: [T::zero(); AXES],
            total: 0,
        }
    }

    /// Takes in the means over a block of the turn.
    pub fn push(&mut self, means: &Vector3<T>, smallest_change: T) {
        self.total = self.total.saturating_add(1);
        for axis in 0..AXES {
            let level = means[axis];
            if self.blocks[axis] > 0 && (level - self.levels[axis]).abs() < smallest_change {
                self.blocks[axis] += 1;
            } else {
                self.squares[axis] = self.sum_of_squares(axis);
                (self.levels[axis], self.blocks[axis]) = (level, 1);
            }
        }
    }

    fn sum_of_squares(&self, axis: usize) -> T {
        let blocks = count::<T>(self.blocks[axis]);
        self.squares[axis] + blocks * blocks
    }

    /// Variance of the mean over the turn over that of one reading, each axis.
    pub fn share(&self) -> [T; AXES] {
        let total = count::<T>(self.total.max(1));
        core::array::from_fn(|axis| self.sum_of_squares(axis) / (total * total)) // eq. 22
    }

    /// Variance of the mean over the turn that the variance `rounding` leaves on each axis: that of the worst axis.
    pub fn variance_of_mean(&self, rounding: [T; AXES]) -> T {
        let shares = self.share();
        (0..AXES).fold(T::zero(), |worst, axis| worst.max(rounding[axis] * shares[axis]))
    }
}

impl<T: Real> Default for EvenReadings<T> {
    fn default() -> Self {
        Self::new()
    }
}
