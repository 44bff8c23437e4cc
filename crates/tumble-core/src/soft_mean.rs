//! Means with soft edges: what vibrates averages out of them long before white noise does.
//!
//! The mean over a rest that begins and ends abruptly keeps a tone of amplitude A at frequency f down to `A / (pi f
//! T)`, which falls no faster than the rest gets longer. Windows that rise and fall smoothly, each overlapping the next
//! by half, add up to a mean over the whole rest with soft edges; the scatter of their own means gives its uncertainty,
//! for any noise that is white below their bandwidth (docs/theory/noise.md, eq. 14 to 16).

use crate::noise::AllanLadder;
use crate::real::{Real, count, real};
use crate::sample::CHANNELS;

/// Half the length of a window, s: it lets through what is slower than a hertz or two.
const HALF: f64 = 0.4;

/// Sum of the means over the windows of a rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftSum<T: Real> {
    sum: [T; CHANNELS],
    windows: u32,
    half: T,
}

impl<T: Real> SoftSum<T> {
    /// No window.
    pub fn none() -> Self {
        Self {
            sum: [T::zero(); CHANNELS],
            windows: 0,
            half: T::zero(),
        }
    }

    /// Mean of each channel; `None` where the rest is too short for a window.
    pub fn mean(&self) -> Option<[T; CHANNELS]> {
        (self.windows > 0).then(|| self.sum.map(|sum| sum / count(self.windows)))
    }

    /// The white noise of the mean is that of an abrupt mean over so many seconds.
    pub fn effective_duration(&self) -> T {
        let n = count::<T>(self.windows);
        n * n * self.half / (n - real(EDGES)) // eq. 15
    }

    /// Adds the windows of the rest that follows.
    pub(crate) fn append(&mut self, next: &Self) {
        for (sum, more) in self.sum.iter_mut().zip(next.sum) {
            *sum += more;
        }
        self.windows = self.windows.saturating_add(next.windows);
        self.half = self.half.max(next.half);
    }
}

/// Rises from 0 to 1 with an even slope at both ends, `x` from 0 to 1: a soft edge.
pub fn rise<T: Real>(x: T) -> T {
    x * x * (real::<T>(3.0) - x - x) // eq. 14
}

/// Derivative of [`rise`] by `x`.
pub fn slope_of_rise<T: Real>(x: T) -> T {
    x * (T::one() - x) * real(6.0) // eq. 14
}

/// One less twice the mean square of the rise `x^2 (3 - 2 x)`, which is 13/35.
const EDGES: f64 = 1.0 - 2.0 * 13.0 / 35.0;

/// Reduction of the Allan variance of neighbours by their overlap, as a share of the variance of one window: that, and
/// the mean of the rise times the fall, 9/70.
const OVERLAP: f64 = EDGES + 9.0 / 70.0;

/// Takes in the blocks of a rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftMeans<T: Real> {
    /// Blocks in half a window; zero before the first.
    blocks: u32,
    place: u32,
    rising: [T; CHANNELS],
    falling: [T; CHANNELS],
    elapsed: T,
    begun: bool,
    total: SoftSum<T>,
    ladder: AllanLadder<T>,
}

impl<T: Real> Default for SoftMeans<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> SoftMeans<T> {
    /// Before the first block of a rest.
    pub fn new() -> Self {
        Self {
            blocks: 0,
            place: 0,
            rising: [T::zero(); CHANNELS],
            falling: [T::zero(); CHANNELS],
            elapsed: T::zero(),
            begun: false,
            total: SoftSum::none(),
            ladder: AllanLadder::overlapping(real(OVERLAP)),
        }
    }

    /// Takes in the next block: its means, its length, s, and its integrals of `t y dt`, t from its start.
    pub fn push(&mut self, mean: &[T; CHANNELS], duration: T, lever: &[T; CHANNELS]) {
        while self.blocks == 0
            || (self.place == 0 && !self.begun && duration * count(self.blocks) < real(HALF))
        {
            self.blocks += 1;
        }
        let x = (count::<T>(self.place) + real(0.5)) / count(self.blocks);
        let weight = rise(x);
        // Steps from block to block would let through what the blocks alias.
        let slope = slope_of_rise(x) / (duration * count(self.blocks));
        for (i, (&mean, &lever)) in mean.iter().zip(lever).enumerate() {
            let within = slope * (lever / duration - mean * duration * real(0.5));
            self.rising[i] += weight * mean + within;
            self.falling[i] += (T::one() - weight) * mean - within;
        }
        self.elapsed += duration;
        self.place += 1;
        if self.place == self.blocks {
            self.turn_over();
        }
    }

    /// The falling window is complete, the rising one falls from now on.
    fn turn_over(&mut self) {
        if self.begun {
            let mean = self.falling.map(|sum| sum / count(self.blocks));
            self.ladder.push(&mean, self.elapsed);
            self.total.append(&SoftSum {
                sum: mean,
                windows: 1,
                half: self.elapsed,
            });
        }
        self.begun = true;
        self.falling = self.rising;
        self.rising = [T::zero(); CHANNELS];
        self.elapsed = T::zero();
        self.place = 0;
    }

    /// All windows so far.
    pub fn total(&self) -> SoftSum<T> {
        self.total
    }

    /// Scatter of the windows.
    pub const fn into_ladder(self) -> AllanLadder<T> {
        self.ladder
    }

    /// Scatter of the windows.
    pub fn ladder(&self) -> &AllanLadder<T> {
        &self.ladder
    }
}
