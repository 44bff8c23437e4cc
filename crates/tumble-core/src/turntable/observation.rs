//! Inputs of step 4: intervals with truth and reading, and the prior.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::noise::{Interval, Noise};
use crate::real::Real;

/// An interval with its truth and its reading. P regressors an axis, Q shared errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<T: Real, const P: usize, const Q: usize> {
    /// When, s.
    pub interval: Interval<T>,
    /// Mean truth and what goes with it: `[u, 1]`, `[u, 1, f]` where g-sensitivity is asked for, or `[u, 1, s]` where the bias
    /// drifts, s the share of its change over the session that it is above its mean then.
    pub regressor: SVector<T, P>,
    /// Mean reading, sensor frame.
    pub reading: Vector3<T>,
    /// Variance of the reading besides the noise of its sensor.
    pub reading_variance: Vector3<T>,
    /// Covariance of the truth u that belongs to this interval alone.
    pub truth_covariance: Matrix3<T>,
    /// Derivative of the truth u by the shared errors.
    pub sensitivity: SMatrix<T, 3, Q>,
}

/// Prior knowledge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitInputs<T: Real, const Q: usize> {
    /// Noise of the three axes of the target.
    pub noise: [Noise<T>; 3],
    /// From the first interval to the last: b is the mean bias over it.
    pub session: Interval<T>,
    /// M as it would be without any error: the rotation sensor_from_case.
    pub nominal: Matrix3<T>,
    /// Largest plausible bias, unit of the sensor.
    pub largest_bias: T,
    /// Covariance of the shared errors.
    pub shared: SMatrix<T, Q, Q>,
}
