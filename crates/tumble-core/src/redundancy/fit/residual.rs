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
    /// Covariances of a channel with successive ones, the first of which is `from`, not before it. Those of unknown
    /// channels are left as they are.
    fn covariances_of(&self, channel: usize, from: usize, covariances: &mut [T]);
}

/// Covariance of two channels; zero for an unknown channel.
pub fn covariance_of<T: Real, P: PairMoments<T> + ?Sized>(pairs: &P, i: usize, j: usize) -> T {
    let mut covariance = [T::zero()];
    pairs.covariances_of(i.min(j), i.max(j), &mut covariance);
    let [covariance] = covariance;
    covariance
}

impl<T: Real, const N: usize, const PACKED: usize> PairMoments<T> for JointMoments<T, N, PACKED> {
    fn samples(&self) -> u32 {
        JointMoments::samples(self)
    }

    fn mean_of(&self, channel: usize) -> T {
        self.mean().get(channel).copied().unwrap_or(T::zero())
    }

    fn covariances_of(&self, channel: usize, from: usize, covariances: &mut [T]) {
        self.covariances(channel, from, covariances);
    }
}

impl<T: Real, const N: usize, const PACKED: usize> PairMoments<T> for Merged<'_, T, N, PACKED> {
    fn samples(&self) -> u32 {
        Merged::samples(self)
    }

    fn mean_of(&self, channel: usize) -> T {
        self.mean(channel)
    }

    fn covariances_of(&self, channel: usize, from: usize, covariances: &mut [T]) {
        self.covariances(channel, from, covariances);
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
        let m = |error: &RelativeError<T>, l: usize| error.matrix.get((row, l)).copied().unwrap_or(T::zero());
        for (l, weight) in weights.iter_mut().enumerate().take(3) {
            *weight = m(stored, l) - m(error, l);
        }
        if let Some(first) = layout.lever {
            let mut weights = weights.iter_mut().skip(first);
            for l in 0..3 {
                for (arm, weight) in change.iter().zip(weights.by_ref()) {
                    *weight = -m(error, l) * *arm;
                }
            }
        }
        if let Some(weight) = weights.get_mut(layout.second + row) {
            *weight = T::one();
        }
        let bias = |error: &RelativeError<T>| error.bias.get(row).copied().unwrap_or(T::zero());
        Self {
            weights,
            channels: layout.second + row + 1,
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
            sum + *w * covariance_of(pairs, i, channel)
        })
    }

    /// Variance of the residual.
    pub fn variance(&self, pairs: &dyn PairMoments<T>) -> T {
        let mut sum = T::zero();
        let mut covariances = [T::zero(); FORCE_CHANNELS];
        for (i, a) in self.weights.iter().enumerate().take(self.channels) {
            // Most weights are zero without an estimated lever arm.
            if *a == T::zero() {
                continue;
            }
            let (row, weights) = (covariances.get_mut(i..self.channels), self.weights.get(i + 1..));
            let Some((row, weights)) = row.zip(weights) else {
                continue;
            };
            pairs.covariances_of(i, i, row);
            let Some((own, others)) = row.split_first() else {
                continue;
            };
            let terms = weights.iter().zip(others);
            let twice = terms.fold(T::zero(), |sum, (b, covariance)| sum + *b * *covariance);
            sum += *a * (*a * *own + twice + twice);
        }
        sum.max(T::zero())
    }

    /// Mean square of the residual.
    pub fn mean_square(&self, pairs: &dyn PairMoments<T>) -> T {
        let mean = self.mean(pairs);
        mean * mean + self.variance(pairs)
    }
}
