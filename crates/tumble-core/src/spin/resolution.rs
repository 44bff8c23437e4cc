//! Resolution of a gyroscope, found in its readings, and what rounding leaves on a mean (docs/theory/spin.md, eq. 21 to 23).
//!
//! Noise larger than a step makes rounding average out. Where it is smaller, a reading repeats for as long as the rate stays
//! within one step, and so does the error of rounding.

use crate::real::{Real, count, real};
use crate::sample::CHANNELS;
use crate::spin::block::Block;

/// Axes of a triad.
const AXES: usize = 3;

/// The smallest change from one reading to the next, and whether the other changes are multiples of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution<T: Real> {
    last: Option<[T; AXES]>,
    step: T,
    multiples: u32,
    others: u32,
}

/// Share of the step below which a change is a smaller step.
const SMALLER: f64 = 0.75;
/// Largest multiple that is distinguished from values between: roundings of single precision add up.
const LARGEST_MULTIPLE: f64 = 8.5;
/// Largest distance from a multiple, steps.
const OFF_GRID: f64 = 0.15;
/// So many multiples are no chance; each of these hides at most one other.
const ENOUGH: u32 = 16;

impl<T: Real> Resolution<T> {
    /// Nothing seen yet.
    pub fn new() -> Self {
        Self {
            last: None,
            step: T::zero(),
            multiples: 0,
            others: 0,
        }
    }

    /// Takes in the next reading, rad/s.
    pub fn push(&mut self, reading: [T; AXES]) {
        let Some(last) = self.last.replace(reading) else {
            return;
        };
        for (now, before) in reading.into_iter().zip(last) {
            let change = (now - before).abs();
            if change > T::zero() {
                self.compare(change);
            }
        }
    }

    fn compare(&mut self, change: T) {
        if self.step == T::zero() || change < self.step * real(SMALLER) {
            if !is_whole(self.step / change) {
                (self.multiples, self.others) = (0, 0);
            }
            self.step = change;
        }
        let steps = change / self.step;
        if steps > real(LARGEST_MULTIPLE) {
            return;
        }
        if is_whole(steps) {
            self.multiples = self.multiples.saturating_add(1);
        } else {
            self.others = self.others.saturating_add(1);
        }
    }

    /// Step that the readings are multiples of, rad/s; `None` where nothing shows one.
    pub fn step(&self) -> Option<T> {
        let shown = self.multiples >= ENOUGH && self.others <= self.multiples / ENOUGH;
        shown.then_some(self.step)
    }
}

impl<T: Real> Default for Resolution<T> {
    fn default() -> Self {
        Self::new()
    }
}

fn is_whole<T: Real>(steps: T) -> bool {
    (steps - steps.round()).abs() < real(OFF_GRID)
}

/// Scatter of the readings at rest, as a share of the squared step, from which on rounding averages out.
const DITHERED: f64 = 0.3;

/// Variance that rounding leaves on each axis however long the rate stays the same, (rad/s)^2, given the scatter at rest.
pub(super) fn rounding<T: Real>(step: Option<T>, scatter: [T; AXES]) -> [T; AXES] {
    const UNIFORM: f64 = 1.0 / 12.0;
    let square = step.map_or(T::zero(), |step| step * step);
    scatter.map(|scatter| {
        if scatter < square * real(DITHERED) {
            square * real(UNIFORM) // eq. 21
        } else {
            T::zero()
        }
    })
}

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

    /// Takes in a block of the turn.
    pub fn push(&mut self, block: &Block<T>, resolution: &Resolution<T>) {
        let means = block.moments.mean();
        self.total = self.total.saturating_add(1);
        for axis in 0..AXES {
            let level = means[CHANNELS / 2 + axis];
            if self.blocks[axis] > 0 && (level - self.levels[axis]).abs() < resolution.step {
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

    /// Variance of the mean over the turn, rad/s, that the variance `rounding` leaves on each axis: that of the worst axis.
    pub fn variance_of_mean(&self, rounding: [T; AXES]) -> T {
        let total = count::<T>(self.total.max(1));
        (0..AXES).fold(T::zero(), |worst, axis| {
            worst.max(rounding[axis] * self.sum_of_squares(axis) / (total * total)) // eq. 22
        })
    }
}

impl<T: Real> Default for EvenReadings<T> {
    fn default() -> Self {
        Self::new()
    }
}
