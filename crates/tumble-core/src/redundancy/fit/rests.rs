//! Means at rest, and their weights beside the pairs in motion (docs/theory/redundancy.md, eq. 16 to 18).

use nalgebra::{Matrix3, Vector3};

use crate::eigen;
use crate::products::{columns, outer, product, zeros};
use crate::real::{Real, count, real};
use crate::redundancy::fit::joint_moments::{JointMoments, packed};
use crate::redundancy::fit::residual::{Layout, PairMoments, RowResidual, covariance_of};
use crate::redundancy::fit::{Fit, FitProblem, SHARED};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::samples::pair::FORCE_CHANNELS;
use crate::redundancy::sensor::Sensor;

/// Channels of a rest: primary 3, in the axes of the secondary, time, and secondary 3, minus the prediction of
/// the stored error.
pub const REST_CHANNELS: usize = 7;

/// Channel of the time.
const TIME: usize = 3;

/// First channel of the secondary.
const SECOND: usize = 4;

/// Number of rests that the prior of the drift between rests counts for.
const DRIFT_RESTS: f64 = 4.0;

/// Share of the square of gravity that rests must have along a direction to show it.
const SEEN: f64 = 0.5;

/// Largest weight of all rests together, in pairs: single precision resolves both.
const MOST: f64 = 1e3;

/// Drift of the difference of two sensors between rests, 1 sigma per axis, m/s^2 or rad/s.
fn drift<T: Real>(sensor: Sensor) -> T {
    match sensor {
        Sensor::Accelerometer => real(0.003),
        Sensor::Gyroscope => real(0.0003),
    }
}

/// Drift of the difference of two sensors over a collection, 1 sigma per axis, m/s^2 or rad/s per s: the
/// fastest drift within specification.
fn slope<T: Real>(sensor: Sensor) -> T {
    match sensor {
        Sensor::Accelerometer => real(1e-4),
        Sensor::Gyroscope => real(3e-5),
    }
}

/// Change of a bias by vibration and warming in motion, 1 sigma per axis, m/s^2 or rad/s.
fn from_motion<T: Real>(sensor: Sensor) -> T {
    match sensor {
        Sensor::Accelerometer => real(0.005),
        Sensor::Gyroscope => real(0.0005),
    }
}

/// Means of primary and secondary at rests, one pair of means for each rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rests<T: Real> {
    moments: JointMoments<T, REST_CHANNELS, { packed(REST_CHANNELS) }>,
    /// Variance of noise in the difference of two means, on average over the rests and axes.
    noise: T,
}

impl<T: Real> Default for Rests<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Rests<T> {
    /// Creates a set without rests.
    pub fn new() -> Self {
        Self {
            moments: JointMoments::new(),
            noise: T::zero(),
        }
    }

    /// Adds a rest: its time, s, the reading of the primary, the reading of the secondary minus the stored
    /// prediction, and the variance of the difference of the two means.
    pub fn push(&mut self, time: T, first: &Vector3<T>, beyond: &Vector3<T>, noise: T) {
        self.moments
            .push(&[first.x, first.y, first.z, time, beyond.x, beyond.y, beyond.z]);
        self.noise += (noise - self.noise) / count(self.moments.samples());
    }

    /// Number of rests.
    pub fn number(&self) -> u32 {
        self.moments.samples()
    }

    /// Mean reading of the primary.
    pub(super) fn first(&self) -> Vector3<T> {
        Vector3::from_fn(|j, _| self.moments.mean_of(j))
    }

    /// Covariance of the readings of the primary.
    pub(super) fn motion(&self) -> Matrix3<T> {
        Matrix3::from_fn(|j, k| self.moments.covariance(j, k))
    }

    /// Mean and variance of the residual of an error on an axis, from data minus the prediction of the stored
    /// error.
    pub(super) fn left(&self, error: &RelativeError<T>, stored: &RelativeError<T>, row: usize) -> [T; 2] {
        let change = |l: usize| {
            let m = |error: &RelativeError<T>| error.matrix.get((row, l)).copied();
            m(stored)
                .zip(m(error))
                .map_or(T::zero(), |(before, now)| before - now)
        };
        let bias = |error: &RelativeError<T>| error.bias.get(row).copied().unwrap_or(T::zero());
        let terms = [
            (0, change(0)),
            (1, change(1)),
            (2, change(2)),
            (SECOND + row, T::one()),
        ];
        let mean = terms.iter().fold(bias(stored) - bias(error), |sum, (i, weight)| {
            sum + *weight * self.moments.mean_of(*i)
        });
        let products = terms.iter().flat_map(|a| terms.iter().map(move |b| (a, b)));
        let variance = products.fold(T::zero(), |sum, ((i, a), (j, b))| {
            sum + *a * *b * self.moments.covariance(*i, *j)
        });
        [mean, variance.max(T::zero())]
    }

    /// Part of a vector in directions along which no rest had gravity; every rest shows all directions of a
    /// gyroscope (docs/theory/redundancy.md, eq. 21).
    pub fn unsupported(&self, sensor: Sensor, vector: &Vector3<T>) -> Vector3<T> {
        let rests = self.number();
        if rests == 0 {
            return *vector;
        }
        if sensor == Sensor::Gyroscope {
            return zeros();
        }
        let mean = self.first();
        let squares = (self.motion() + outer(&mean, &mean)) * count::<T>(rests);
        let (values, vectors) = eigen::symmetric(squares);
        let enough = squares.trace() / count(rests) * real(SEEN);
        let directions = values.iter().zip(columns(&vectors));
        directions
            .filter(|(value, _)| **value >= enough)
            .fold(*vector, |left, (_, v)| {
                left - v * v.dot(vector) // eq. 21
            })
    }
}

/// Weights of rests in a row of a fit, in pairs in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestWeight<T: Real> {
    /// Weight of each rest about the mean of the rests.
    each: T,
    /// Weight of the mean of the rests, compared with the mean of the pairs.
    mean: T,
    /// Weight of the prior of no drift of the bias, as pairs times s^2.
    steady: T,
}

/// Weights of rests in each row.
pub type RestWeights<T> = [RestWeight<T>; 3];

/// Rests with their weights.
#[derive(Clone, Copy)]
pub struct WeighedRests<'a, T: Real> {
    /// Moments of the rests.
    pub rests: &'a Rests<T>,
    /// Weights of the rests.
    pub weights: &'a RestWeights<T>,
}

/// Results of the pairs alone that determine the weights of rests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestWeighing<T: Real> {
    sensor: Sensor,
    times: T,
    /// Variance of a pair in each row, if all were independent.
    of_pair: [T; 3],
    /// Squared difference of the rests from the prediction of the pairs, minus the uncertainty of the pairs;
    /// mean of the axes.
    apart: T,
}

impl<T: Real> RestWeighing<T> {
    /// Creates the weighing from a fit to pairs alone and its data.
    #[inline(never)]
    pub fn new(
        sensor: Sensor,
        problem: &FitProblem<'_, T>,
        alone: &Fit<T>,
        times: T,
        rests: &Rests<T>,
    ) -> Self {
        let pairs = problem.pairs;
        let of_pair: [T; 3] = core::array::from_fn(|row| {
            let residual = RowResidual::new(&alone.error, problem.stored, &problem.layout, row);
            residual.variance(pairs) * times * real(SHARED)
        });
        let away = rests.first() - Vector3::from_fn(|j, _| pairs.mean_of(j));
        let (mut apart, mut axes) = (T::zero(), T::zero());
        for ((i, covariance), of_pair) in alone.row_covariance.iter().enumerate().zip(of_pair) {
            if problem.axes.get(i) != Some(&true) {
                continue;
            }
            let [mean, _] = rests.left(&alone.error, problem.stored, i);
            let left_open =
                away.dot(&product(covariance, &away)) * times + of_pair / count(pairs.samples().max(1));
            apart += mean * mean - left_open;
            axes += T::one();
        }
        Self {
            sensor,
            times,
            of_pair,
            apart: apart / axes.max(T::one()),
        }
    }

    /// Factor on the variance of pairs from the difference of both halves.
    pub fn times(&self) -> T {
        self.times
    }

    /// Weights of the rests with their usual scatter.
    pub fn usual(&self, rests: &Rests<T>) -> RestWeights<T> {
        self.with(rests, self.scatter(rests, T::zero(), T::zero()))
    }

    /// Weights of the rests with the scatter that they show about a fit with the usual weights.
    #[inline(never)]
    pub fn as_shown(&self, problem: &FitProblem<'_, T>, fit: &Fit<T>, rests: &Rests<T>) -> RestWeights<T> {
        let (number, motion) = (count::<T>(rests.number()), rests.motion());
        let before = self.scatter(rests, T::zero(), T::zero());
        let (mut strayed, mut freedom) = (T::zero(), T::zero());
        for (i, covariance) in fit.row_covariance.iter().enumerate() {
            if problem.axes.get(i) != Some(&true) {
                continue;
            }
            let [_, variance] = rests.left(&fit.error, problem.stored, i);
            // Share of the rests that the fit took up.
            let taken = covariance.component_mul(&motion).sum() * self.times / before;
            strayed += number * variance;
            freedom += (number * (T::one() - taken) - T::one()).max(T::zero());
        }
        self.with(rests, self.scatter(rests, strayed, freedom))
    }

    /// Variance of a mean at rest about its usual value, from the squares by which rests strayed from a fit
    /// with a number of degrees of freedom (docs/theory/redundancy.md, eq. 17).
    fn scatter(&self, rests: &Rests<T>, strayed: T, freedom: T) -> T {
        let usual = drift::<T>(self.sensor);
        let before = (usual * usual + rests.noise) * real(DRIFT_RESTS);
        (before + strayed) / (freedom + real(DRIFT_RESTS)) // eq. 17
    }

    fn with(&self, rests: &Rests<T>, scatter: T) -> RestWeights<T> {
        let number = count::<T>(rests.number().max(1));
        let of_mean = scatter / number + self.apart_from_motion(scatter / number);
        let finite = |weight: T| if weight.is_finite() { weight } else { T::zero() };
        let slope = slope::<T>(self.sensor);
        self.of_pair.map(|of_pair| RestWeight {
            each: finite(of_pair / scatter),   // eq. 16: w
            mean: finite(of_pair / of_mean),   // eq. 16: n_0
            steady: of_pair / (slope * slope), // eq. 19: kappa tau sigma_i^2 / sigma_t^2
        })
    }

    /// Variance of the difference of the biases at rest and in motion: the usual one, or the larger one that
    /// the pairs show (docs/theory/redundancy.md, eq. 18).
    fn apart_from_motion(&self, of_mean: T) -> T {
        let usual = from_motion::<T>(self.sensor);
        (self.apart - of_mean).max(usual * usual) // eq. 18
    }
}

/// Moments of pairs and rests together in one row of a fit, per pair: covariances are centred sums over the
/// number of pairs, so that rests add to the motion (docs/theory/redundancy.md, eq. 16).
pub(super) struct RowPairs<'a, T: Real> {
    pairs: &'a dyn PairMoments<T>,
    layout: Layout,
    rests: Option<&'a Rests<T>>,
    /// Weight of all rests about their mean, over the number of pairs.
    within: T,
    /// Share of the rests in the mean.
    share: T,
    /// Prior of no drift, as a variance of time, s^2.
    steady: T,
    /// Difference of the rests from the pairs in each channel; at rest no lever arm shows. It is stored, like
    /// the next, because hundreds of covariances use it.
    apart: [T; FORCE_CHANNELS],
    /// Covariance of each channel with time.
    with_time: [T; FORCE_CHANNELS],
    /// Inverse variance of time, with the prior of the drift; zero until drift is taken off, and for pairs alone.
    per_time: T,
}

impl<'a, T: Real> RowPairs<'a, T> {
    #[inline(always)]
    pub fn new(
        pairs: &'a dyn PairMoments<T>,
        layout: Layout,
        rests: Option<&WeighedRests<'a, T>>,
        row: usize,
    ) -> Self {
        let number: T = count(pairs.samples().max(1));
        let weighed = rests.and_then(|all| Some((all.rests, all.weights.get(row)?)));
        let (within, share, steady) = weighed.map_or([T::zero(); 3].into(), |(rests, weight)| {
            let within = weight.each * count(rests.number()) / number;
            (
                within.min(real(MOST)),
                weight.mean / (weight.mean + number),
                weight.steady / number,
            )
        });
        let mut row = Self {
            pairs,
            layout,
            rests: weighed.map(|(rests, _)| rests),
            within,
            share,
            steady,
            apart: [T::zero(); FORCE_CHANNELS],
            with_time: [T::zero(); FORCE_CHANNELS],
            per_time: T::zero(),
        };
        if let Some((rests, _)) = weighed {
            row.compare(rests);
        }
        row
    }

    // Apart, so that the pairs are made where the caller wants them and not copied there.
    #[inline(never)]
    fn compare(&mut self, rests: &Rests<T>) {
        let (pairs, layout) = (self.pairs, self.layout);
        for (channel, apart) in self.apart.iter_mut().enumerate() {
            let rest = at_rest(layout, channel);
            *apart = rest.map_or(T::zero(), |rest| rests.moments.mean_of(rest)) - pairs.mean_of(channel);
        }
    }

    /// Takes the part that time explains, as far as drift is likely, off the covariances of pairs and rests.
    #[inline(never)]
    pub fn take_off_drift(&mut self) {
        if self.rests.is_none() {
            return;
        }
        // In place, since the stack is deepest here: nothing is taken off yet.
        let at = self.layout.time;
        for channel in 0..FORCE_CHANNELS {
            let with_time = covariance_of(self, channel, at);
            if let Some(place) = self.with_time.get_mut(channel) {
                *place = with_time;
            }
        }
        let time = of_channel(&self.with_time, at) + self.steady;
        if time > T::zero() {
            self.per_time = T::one() / time;
        }
    }

    /// Variance of the mean of pairs and rests, over that of the mean of pairs alone.
    pub fn variance_of_mean(&self) -> T {
        T::one() - self.share // eq. 16
    }
}

/// Channel of the rests that corresponds to a channel of the pairs.
fn at_rest(layout: Layout, channel: usize) -> Option<usize> {
    match channel.checked_sub(layout.second) {
        Some(axis) => Some(SECOND + axis),
        None if channel == layout.time => Some(TIME),
        None => Some(channel).filter(|channel| *channel < TIME),
    }
}

/// Returns the value of a channel; zero for an unknown one.
fn of_channel<T: Real>(values: &[T; FORCE_CHANNELS], channel: usize) -> T {
    values.get(channel).copied().unwrap_or(T::zero())
}

impl<T: Real> PairMoments<T> for RowPairs<'_, T> {
    fn samples(&self) -> u32 {
        self.pairs.samples()
    }

    fn mean_of(&self, channel: usize) -> T {
        self.pairs.mean_of(channel) + of_channel(&self.apart, channel) * self.share // eq. 16
    }

    /// Covariances without the part that was taken off: a linear drift of the bias is no part of M.
    fn covariances_of(&self, channel: usize, from: usize, covariances: &mut [T]) {
        self.pairs.covariances_of(channel, from, covariances);
        let Some(rests) = self.rests else { return };
        if let Some(rest) = at_rest(self.layout, channel) {
            for (other, covariance) in (from..).zip(covariances.iter_mut()) {
                if let Some(other) = at_rest(self.layout, other) {
                    *covariance += rests.moments.covariance(rest, other) * self.within; // eq. 16
                }
            }
        }
        let (apart, with_time) = (
            of_channel(&self.apart, channel),
            of_channel(&self.with_time, channel),
        );
        let others = self.apart.iter().zip(&self.with_time).skip(from);
        for (covariance, (apart_of_other, with_time_of_other)) in covariances.iter_mut().zip(others) {
            let pulled = apart * *apart_of_other * self.share;
            let drift = with_time * *with_time_of_other * self.per_time;
            *covariance = *covariance + pulled - drift; // eq. 16, 19
        }
    }
}
