//! Interface to the moments of pairs, and the residual of a relation on them.

use crate::real::Real;
use crate::redundancy::fit::joint_moments::{JointMoments, Merged, packed};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::samples::pair::{FORCE_CHANNELS, RATE_CHANNELS};

/// Number of different covariances of the channels of a pair of accelerometers.
pub const FORCE_PACKED: usize = packed(FORCE_CHANNELS);

/// Number of different covariances of the channels of a pair of gyroscopes.
pub const RATE_PACKED: usize = packed(RATE_CHANNELS);

/// Moments of pairs of either sensor.
pub trait PairMoments<T: Real> {
    /// Number of pairs.
    fn samples(&self) -> u32;
    /// Mean of a channel.
    fn mean_of(&self, channel: usize) -> T;
    /// Covariance of two channels.
    fn covariance_of(&self, i: usize, j: usize) -> T;
}

impl<T: Real, const N: usize, const PACKED: usize> PairMoments<T> for JointMoments<T, N, PACKED> {
    fn samples(&self) -> u32 {
        JointMoments::samples(self)
    }

    fn mean_of(&self, channel: usize) -> T {
        self.mean().get(channel).copied().unwrap_or(T::zero())
    }

    fn covariance_of(&self, i: usize, j: usize) -> T {
        self.covariance(i, j)
    }
}

impl<T: Real, const N: usize, const PACKED: usize> PairMoments<T> for Merged<'_, T, N, PACKED> {
    fn samples(&self) -> u32 {
        Merged::samples(self)
    }

    fn mean_of(&self, channel: usize) -> T {
        self.mean(channel)
    }

    fn covariance_of(&self, i: usize, j: usize) -> T {
        self.covariance(i, j)
    }
}

/// Layout of the channels of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// First of the nine channels of the lever, row by row; `None` for gyroscopes.
    pub lever: Option<usize>,
    /// Channel of the time.
    pub time: usize,
    /// First of the three channels of the secondary, minus the prediction of the stored error.
    pub second: usize,
}

/// Layout of a pair of accelerometers.
pub const FORCE_LAYOUT: Layout = Layout {
    lever: Some(3),
    time: 12,
    second: 13,
};

/// Layout of a pair of gyroscopes.
pub const RATE_LAYOUT: Layout = Layout {
    lever: None,
    time: 3,
    second: 4,
};

/// Row `i` of `y - M (u + W r) - b` as a sum over the channels of a pair, from which the stored prediction was
/// subtracted.
pub struct RowResidual<T: Real> {
    weights: [T; FORCE_CHANNELS],
    channels: usize,
    offset: T,
}

impl<T: Real> RowResidual<T> {
    /// Creates the residual of a relation in one row.
    pub fn new(error: &RelativeError<T>, stored: &RelativeError<T>, layout: &Layout, row: usize) -> Self {
        let mut weights = [T::zero(); FORCE_CHANNELS];
        let change = error.lever_arm - stored.lever_arm;
        let m = |error: &RelativeError<T>, l: usize| error.matrix.get((row, l)).copied();
        for (channel, weight) in weights.iter_mut().enumerate() {
            let lever = layout
                .lever
                .and_then(|first| channel.checked_sub(first))
                .filter(|k| *k < 9);
            let of_channel = match (channel, lever) {
                (0..3, _) => m(stored, channel)
                    .zip(m(error, channel))
                    .map(|(before, now)| before - now),
                (_, Some(at)) => m(error, at / 3).zip(change.get(at % 3)).map(|(m, arm)| -m * *arm),
                _ => (channel == layout.second + row).then(T::one),
            };
            *weight = of_channel.unwrap_or(T::zero());
        }
        let bias = |error: &RelativeError<T>| error.bias.get(row).copied().unwrap_or(T::zero());
        Self {
            weights,
            channels: layout.second + 3,
            offset: bias(stored) - bias(error),
        }
    }

    /// Mean of the residual.
    pub fn mean(&self, pairs: &dyn PairMoments<T>) -> T {
        let terms = self.weights.iter().take(self.channels).enumerate();
        terms.fold(self.offset, |sum, (i, w)| sum + *w * pairs.mean_of(i))
    }

    /// Covariance of the residual with a channel.
    pub fn covariance_with(&self, pairs: &dyn PairMoments<T>, channel: usize) -> T {
        let terms = self.weights.iter().take(self.channels).enumerate();
        terms.fold(T::zero(), |sum, (i, w)| {
            sum + *w * pairs.covariance_of(i, channel)
        })
    }

    /// Variance of the residual.
    pub fn variance(&self, pairs: &dyn PairMoments<T>) -> T {
        // Most weights are zero without an estimated lever arm.
        let counts = |(_, w): &(usize, &T)| **w != T::zero();
        let terms = || self.weights.iter().take(self.channels).enumerate().filter(counts);
        let sum = terms().fold(T::zero(), |sum, (i, a)| {
            let after = terms().filter(|(j, _)| *j > i);
            let twice = after.fold(T::zero(), |sum, (j, b)| sum + *b * pairs.covariance_of(i, j));
            sum + *a * (*a * pairs.covariance_of(i, i) + twice + twice)
        });
        sum.max(T::zero())
    }

    /// Mean square of the residual.
    pub fn mean_square(&self, pairs: &dyn PairMoments<T>) -> T {
        let mean = self.mean(pairs);
        mean * mean + self.variance(pairs)
    }
}
