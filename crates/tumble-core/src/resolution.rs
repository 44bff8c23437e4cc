//! Resolution of a sensor, found in its readings, and what rounding leaves on a mean (docs/theory/rounding.md).
//!
//! Noise larger than a step makes rounding average out. Where it is smaller, a reading repeats for as long as the truth stays
//! within one step, and so does the error of rounding.

use crate::real::{Real, count, real};

/// The smallest change from one reading to the next, and whether the other changes are multiples of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution<T: Real, const N: usize> {
    last: Option<[T; N]>,
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

impl<T: Real, const N: usize> Resolution<T, N> {
    /// Nothing seen yet.
    pub fn new() -> Self {
        Self {
            last: None,
            step: T::zero(),
            multiples: 0,
            others: 0,
        }
    }

    /// Takes in the next reading of axes that share their resolution.
    #[inline]
    pub fn push(&mut self, reading: [T; N]) {
        let Some(last) = self.last.replace(reading) else {
            return;
        };
        for (now, before) in reading.into_iter().zip(last) {
            let change = (now - before).abs();
            let counts = self.step == T::zero() || change <= self.step * real(LARGEST_MULTIPLE);
            if change > T::zero() && counts {
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
        if is_whole(change / self.step) {
            self.multiples = self.multiples.saturating_add(1);
        } else {
            self.others = self.others.saturating_add(1);
        }
    }

    /// The smallest change so far; zero where there was none.
    pub fn smallest_change(&self) -> T {
        self.step
    }

    /// Step that the readings are multiples of; `None` where nothing shows one.
    pub fn step(&self) -> Option<T> {
        let shown = self.multiples >= ENOUGH && self.others <= self.multiples / ENOUGH;
        shown.then_some(self.step)
    }
}

impl<T: Real, const N: usize> Default for Resolution<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

fn is_whole<T: Real>(steps: T) -> bool {
    (steps - steps.round()).abs() < real(OFF_GRID)
}

/// Scatter of the readings at rest, as a share of the squared step, from which on rounding averages out: readings of two
/// values alone scatter by a quarter at most.
const DITHERED: f64 = 0.3;

/// Variance that rounding leaves on a mean however long the truth stays the same, given the scatter of the readings at rest.
pub fn variance_of_rounding<T: Real>(step: Option<T>, scatter: T) -> T {
    const UNIFORM: f64 = 1.0 / 12.0;
    let square = step.map_or(T::zero(), |step| step * step);
    if scatter < square * real(DITHERED) {
        square * real(UNIFORM) // eq. 1
    } else {
        T::zero()
    }
}

/// Readings of exactly zero, and the smallest others: firmware that shows rest as zero leaves a gap between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadBand<T: Real, const N: usize> {
    zeros: [u32; N],
    least: [Option<T>; N],
}

/// So many zeros are no chance.
const ZEROS: u32 = 16;
/// A gap of fewer steps is the resolution itself.
const STEPS: f64 = 3.0;

impl<T: Real, const N: usize> DeadBand<T, N> {
    /// Nothing seen yet.
    pub fn new() -> Self {
        Self {
            zeros: [0; N],
            least: [None; N],
        }
    }

    /// Takes in the next reading.
    #[inline]
    pub fn push(&mut self, reading: [T; N]) {
        for (axis, reading) in reading.into_iter().enumerate() {
            let size = reading.abs();
            if size == T::zero() {
                self.zeros[axis] = self.zeros[axis].saturating_add(1);
            } else if self.least[axis].is_none_or(|least| size < least) {
                self.least[axis] = Some(size);
            }
        }
    }

    /// Half the width of the band of each axis; zero where there is none.
    pub fn half_width(&self, steps: [Option<T>; N]) -> [T; N] {
        core::array::from_fn(|axis| {
            let resolved = steps[axis].unwrap_or(T::zero()) * real(STEPS);
            match self.least[axis] {
                Some(least) if self.zeros[axis] >= ZEROS && least > resolved => least,
                _ => T::zero(),
            }
        })
    }

    /// Variance that the band leaves on a mean at rest, of so many samples at rest in all: what it hides lies anywhere within.
    pub fn variance(&self, steps: [Option<T>; N], at_rest: u32) -> [T; N] {
        const UNIFORM: f64 = 1.0 / 3.0;
        let widths = self.half_width(steps);
        core::array::from_fn(|axis| {
            let hidden = widths[axis] * self.share(axis, at_rest);
            hidden * hidden * real(UNIFORM) // eq. 4
        })
    }

    /// Share of the samples at rest that read zero, at most.
    pub fn share(&self, axis: usize, at_rest: u32) -> T {
        let share: T = count::<T>(self.zeros.get(axis).copied().unwrap_or(0)) / count(at_rest.max(1));
        share.min(T::one())
    }
}

impl<T: Real, const N: usize> Default for DeadBand<T, N> {
    fn default() -> Self {
        Self::new()
    }
}
