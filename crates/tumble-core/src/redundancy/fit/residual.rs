//! Moments of pairs as a fit sees them, and what a relation leaves unexplained of them.

use crate::real::Real;
use crate::redundancy::fit::joint_moments::{JointMoments, packed};
use crate::redundancy::relative_error::Relation;
use crate::redundancy::samples::pair::{FORCE_CHANNELS, RATE_CHANNELS};

/// Different covariances of the channels of a pair of accelerometers.
pub const FORCE_PACKED: usize = packed(FORCE_CHANNELS);

/// Different covariances of the channels of a pair of gyroscopes.
pub const RATE_PACKED: usize = packed(RATE_CHANNELS);

/// Moments of pairs of either sensor.
pub trait Pairs<T: Real> {
    /// How many pairs.
    fn samples(&self) -> u32;
    /// Mean of a channel.
    fn mean_of(&self, channel: usize) -> T;
    /// Covariance of two channels.
    fn covariance_of(&self, i: usize, j: usize) -> T;
}

impl<T: Real, const N: usize, const PACKED: usize> Pairs<T> for JointMoments<T, N, PACKED> {
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

/// Where in the channels of a pair what is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// First of the nine of the lever, row by row; `None` for gyroscopes.
    pub lever: Option<usize>,
    /// The time.
    pub time: usize,
    /// First of the three of the secondary, beyond what is stored.
    pub second: usize,
}

/// Of a pair of accelerometers.
pub const FORCE_LAYOUT: Layout = Layout {
    lever: Some(3),
    time: 12,
    second: 13,
};

/// Of a pair of gyroscopes.
pub const RATE_LAYOUT: Layout = Layout {
    lever: None,
    time: 3,
    second: 4,
};

/// Row `i` of `y - M (u + W r) - b` as a sum over the channels of a pair, in which what is stored was taken off already.
pub struct Residual<T: Real> {
    weights: [T; FORCE_CHANNELS],
    channels: usize,
    offset: T,
}

impl<T: Real> Residual<T> {
    /// Of a relation.
    pub fn new(relation: &Relation<T>, stored: &Relation<T>, layout: &Layout, row: usize) -> Self {
        let mut weights = [T::zero(); FORCE_CHANNELS];
        let change = relation.lever_arm - stored.lever_arm;
        let m = |relation: &Relation<T>, l: usize| relation.matrix.get((row, l)).copied();
        for (channel, weight) in weights.iter_mut().enumerate() {
            let lever = layout
                .lever
                .and_then(|first| channel.checked_sub(first))
                .filter(|k| *k < 9);
            let of_channel = match (channel, lever) {
                (0..3, _) => m(stored, channel)
                    .zip(m(relation, channel))
                    .map(|(before, now)| before - now),
                (_, Some(at)) => m(relation, at / 3)
                    .zip(change.get(at % 3))
                    .map(|(m, arm)| -m * *arm),
                _ => (channel == layout.second + row).then(T::one),
            };
            *weight = of_channel.unwrap_or(T::zero());
        }
        let bias = |relation: &Relation<T>| relation.bias.get(row).copied().unwrap_or(T::zero());
        Self {
            weights,
            channels: layout.second + 3,
            offset: bias(stored) - bias(relation),
        }
    }

    /// Its mean.
    pub fn mean(&self, pairs: &dyn Pairs<T>) -> T {
        let terms = self.weights.iter().take(self.channels).enumerate();
        terms.fold(self.offset, |sum, (i, w)| sum + *w * pairs.mean_of(i))
    }

    /// Its covariance with a channel.
    pub fn covariance_with(&self, pairs: &dyn Pairs<T>, channel: usize) -> T {
        let terms = self.weights.iter().take(self.channels).enumerate();
        terms.fold(T::zero(), |sum, (i, w)| {
            sum + *w * pairs.covariance_of(i, channel)
        })
    }

    /// Its variance.
    pub fn variance(&self, pairs: &dyn Pairs<T>) -> T {
        let terms = self.weights.iter().take(self.channels).enumerate();
        let sum = terms.fold(T::zero(), |sum, (i, w)| sum + *w * self.covariance_with(pairs, i));
        sum.max(T::zero())
    }

    /// Its mean square.
    pub fn mean_square(&self, pairs: &dyn Pairs<T>) -> T {
        let mean = self.mean(pairs);
        mean * mean + self.variance(pairs)
    }
}
