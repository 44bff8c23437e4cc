//! Step 4: `y = M u + b` over intervals of which truth and reading are known.
//!
//! Accelerometer and gyroscope are the same problem. An interval is a rest or a turn, `u` the mean truth over it, `y`
//! the mean reading. The truth has errors of its own: some belong to one interval (noise of the reference), some
//! are shared by all (bias of the reference, its mounting angle). The first widen the variance, the second are
//! unknowns beside M and b, with the covariance their own estimate gave them.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::model::{ErrorModel, ModelCovariance, PARAMETERS};
use crate::real::{Real, real};
use crate::regression::{LeastSquares, Prior, Solution, Unsolvable};
use crate::turntable::observation::{FitInputs, Observation};
use crate::turntable::whitening::{IntervalRows, Whitener};

/// Largest plausible deviation of an element of M from its nominal value.
const LARGEST_MATRIX_ERROR: f64 = 0.3;

/// Largest plausible g-sensitivity of a gyroscope, rad/s per m/s^2.
pub const LARGEST_G_SENSITIVITY: f64 = 0.01;

/// Regressors of an axis whose bias drifts.
const DRIFTING: usize = 5;

/// Calibration of one triad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriadFit<T: Real, const Q: usize> {
    /// M and b.
    pub model: ErrorModel<T>,
    /// Covariance of `[M row by row, b]`.
    pub covariance: ModelCovariance<T>,
    /// True for each of `[M row by row, b]` that the data showed.
    pub observed: [bool; PARAMETERS],
    /// g-sensitivity, rad/s per m/s^2, and its 1-sigma, where asked for.
    pub g_sensitivity: Option<(Matrix3<T>, Matrix3<T>)>,
    /// Change of the bias over the session and its 1-sigma, where asked for.
    pub drift: Option<(Vector3<T>, Vector3<T>)>,
    /// Correction found for the shared errors.
    pub shared: SVector<T, Q>,
    /// Its covariance.
    pub shared_covariance: SMatrix<T, Q, Q>,
    /// Directions of M, b and the shared errors that the data decided.
    pub rank: usize,
    /// Sum of squared normalised residuals.
    pub chi_square: T,
    /// Rows less observed unknowns.
    pub degrees_of_freedom: u32,
}

impl<T: Real, const Q: usize> TriadFit<T, Q> {
    /// Reading minus model.
    pub fn residual<const P: usize>(&self, observation: &Observation<T, P, Q>) -> Vector3<T> {
        let u = truth(observation) + observation.sensitivity * self.shared;
        let coupled = match &self.g_sensitivity {
            Some((g, _)) if P >= 7 => g * Vector3::from_fn(|j, _| observation.regressor[4 + j]),
            _ => Vector3::zeros(),
        };
        let drifted = match &self.drift {
            Some((drift, _)) if P == DRIFTING => drift * observation.regressor[4],
            _ => Vector3::zeros(),
        };
        observation.reading - self.model.measure(&u) - coupled - drifted // eq. 11
    }
}

/// The truth u of an observation.
fn truth<T: Real, const P: usize, const Q: usize>(observation: &Observation<T, P, Q>) -> Vector3<T> {
    observation.regressor.fixed_rows::<3>(0).into_owned()
}

/// Weighted least squares over all intervals; N must be `3 P + Q`. Elements of M that the data do not show keep their
/// nominal values.
///
/// M appears in the weights (noise of the truth passes through it), so the solution is repeated with the M of the
/// round before; the second round is exact to the order of the noise (docs/theory/turntable.md, eq. 12).
///
/// # Errors
/// [`Unsolvable`] if an observation is not finite or the noise is zero.
pub fn fit<T: Real, const P: usize, const Q: usize, const N: usize>(
    observations: &[Observation<T, P, Q>],
    inputs: &FitInputs<T, Q>,
) -> Result<TriadFit<T, Q>, Unsolvable> {
    const { assert!(N == 3 * P + Q) };
    let prior = prior::<T, P, Q, N>(inputs);
    let (solution, rank) = solve::<T, P, Q, N>(observations, inputs, &prior)?;
    let found = unpack::<T, P, Q, N>(&solution, rank);
    let unseen = |i: usize| i < 3 * P && i % P < 3 && !solution.observed(i);
    if !(0..3 * P).any(unseen) {
        return Ok(found);
    }
    // An element of M that the data hardly show would follow their noise. It stands at its nominal value instead,
    // and the others are as uncertain as not knowing it makes them.
    let mut held = prior;
    for i in (0..3 * P).filter(|&i| unseen(i)) {
        held.covariance[(i, i)] = real(HELD * HELD);
    }
    let (solution, _) = solve(observations, inputs, &held)?;
    let with_held = unpack::<T, P, Q, N>(&solution, rank);
    Ok(TriadFit {
        covariance: found.covariance,
        observed: found.observed,
        degrees_of_freedom: found.degrees_of_freedom,
        g_sensitivity: match (with_held.g_sensitivity, found.g_sensitivity) {
            (Some((g, _)), Some((_, sigma))) => Some((g, sigma)),
            _ => None,
        },
        ..with_held
    })
}

/// Sigma by which an element of M that is held may deviate from its nominal value.
const HELD: f64 = 1e-9;

/// The solution and its rank.
fn solve<T: Real, const P: usize, const Q: usize, const N: usize>(
    observations: &[Observation<T, P, Q>],
    inputs: &FitInputs<T, Q>,
    prior: &Prior<T, N>,
) -> Result<(Solution<T, N>, usize), Unsolvable> {
    const ROUNDS: u32 = 3;
    let about = |matrix: &Matrix3<T>| {
        let mut equations = LeastSquares::<T, N>::new(prior);
        push(&mut equations, observations, inputs, matrix);
        equations
    };
    let mut equations = about(&inputs.nominal);
    for _ in 1..ROUNDS {
        let round = equations.solve()?;
        equations = about(&Matrix3::from_fn(|i, j| round.x[i * P + j]));
    }
    Ok((equations.solve()?, equations.rank()?))
}

fn prior<T: Real, const P: usize, const Q: usize, const N: usize>(inputs: &FitInputs<T, Q>) -> Prior<T, N> {
    let mut prior = Prior {
        mean: SVector::zeros(),
        covariance: SMatrix::zeros(),
    };
    for axis in 0..3 {
        for column in 0..P {
            let i = axis * P + column;
            let largest: T = match column {
                0..3 => real(LARGEST_MATRIX_ERROR),
                3 => inputs.largest_bias,
                4 if P == DRIFTING => inputs.largest_bias,
                _ => real(LARGEST_G_SENSITIVITY),
            };
            prior.covariance[(i, i)] = largest * largest;
            if column < 3 {
                prior.mean[i] = inputs.nominal[(axis, column)];
            }
        }
    }
    for i in 0..Q {
        for j in 0..Q {
            prior.covariance[(3 * P + i, 3 * P + j)] = inputs.shared[(i, j)];
        }
    }
    prior
}

/// Rows of the three axes, made independent of those before.
fn push<T: Real, const P: usize, const Q: usize, const N: usize>(
    equations: &mut LeastSquares<T, N>,
    observations: &[Observation<T, P, Q>],
    inputs: &FitInputs<T, Q>,
    matrix: &Matrix3<T>,
) {
    let mut whitener = Whitener::<T, P, Q, N>::new(observations, inputs);
    for observation in observations {
        let of_truth = |axis| through(matrix, &observation.truth_covariance, axis);
        for white in whitener.next(IntervalRows {
            interval: observation.interval,
            rows: core::array::from_fn(|axis| row::<T, P, Q, N>(observation, matrix, axis)),
            reading: observation.reading,
            besides_noise: Vector3::from_fn(|axis, _| of_truth(axis)) + observation.reading_variance,
        }) {
            equations.push(&white.row, white.reading, white.variance);
        }
    }
}

/// Variance that the truth's own error leaves on one axis of the reading: `(M S M^T)_ii`.
fn through<T: Real>(matrix: &Matrix3<T>, covariance: &Matrix3<T>, axis: usize) -> T {
    let row = matrix.row(axis).transpose();
    row.dot(&(covariance * row)) // eq. 12
}

/// Coefficients of one axis of the reading: `[.. u, 1 .., M D]`.
fn row<T: Real, const P: usize, const Q: usize, const N: usize>(
    observation: &Observation<T, P, Q>,
    matrix: &Matrix3<T>,
    axis: usize,
) -> SVector<T, N> {
    let mut row = SVector::<T, N>::zeros();
    row.rows_mut(axis * P, P).copy_from(&observation.regressor); // eq. 11
    let by_shared = matrix.row(axis) * observation.sensitivity; // eq. 11: D^T m
    row.rows_mut(3 * P, Q).copy_from(&by_shared.transpose());
    row
}

fn unpack<T: Real, const P: usize, const Q: usize, const N: usize>(
    solution: &Solution<T, N>,
    rank: usize,
) -> TriadFit<T, Q> {
    let place = |parameter: usize| match parameter {
        0..9 => (parameter / 3) * P + parameter % 3,
        _ => (parameter - 9) * P + 3,
    };
    let x = |parameter: usize| solution.x[place(parameter)];
    let unknowns = (0..3 * P).filter(|i| solution.observed(*i)).count();
    let g_at = |i: usize, j: usize| i * P + 4 + j;
    TriadFit {
        model: ErrorModel {
            matrix: Matrix3::from_fn(|i, j| x(3 * i + j)),
            bias: Vector3::from_fn(|i, _| x(9 + i)),
        },
        covariance: ModelCovariance::from_fn(|i, j| solution.covariance[(place(i), place(j))]),
        observed: core::array::from_fn(|i| solution.observed(place(i))),
        g_sensitivity: (P >= 7).then(|| {
            (
                Matrix3::from_fn(|i, j| solution.x[g_at(i, j)]),
                Matrix3::from_fn(|i, j| solution.covariance[(g_at(i, j), g_at(i, j))].square_root()),
            )
        }),
        drift: (P == DRIFTING).then(|| {
            let at = |i: usize| i * P + 4;
            (
                Vector3::from_fn(|i, _| solution.x[at(i)]),
                Vector3::from_fn(|i, _| solution.covariance[(at(i), at(i))].square_root()),
            )
        }),
        shared: solution.x.fixed_rows::<Q>(3 * P).into_owned(),
        shared_covariance: solution.covariance.fixed_view::<Q, Q>(3 * P, 3 * P).into_owned(),
        rank,
        chi_square: solution.chi_square,
        degrees_of_freedom: crate::regression::degrees_of_freedom(solution.rows, unknowns),
    }
}
