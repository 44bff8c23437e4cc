//! Errors that the reference itself adds to the truth: its biases, and the rotation of the Earth it senses.

use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use crate::gravity::EARTH_RATE;
use crate::products::Length;
use crate::real::{Real, real};
use crate::regression::{LeastSquares, Prior, Unsolvable, degrees_of_freedom, reduced};

/// Bias of the reference accelerometer, and how well a sphere of radius g fits its rests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereFit<T: Real> {
    /// m/s^2.
    pub bias: Vector3<T>,
    /// (m/s^2)^2.
    pub covariance: Matrix3<T>,
    /// True for each axis whose bias the rests show.
    pub observed: [bool; 3],
    /// Sum of squared normalised residuals.
    pub chi_square: T,
    /// Rests less observed unknowns.
    pub degrees_of_freedom: u32,
    /// Root mean square of `|r - b| - g`, m/s^2.
    pub norm_residual: T,
}

impl<T: Real> SphereFit<T> {
    /// By how much the residuals exceed the noise, as a factor on variance, never below one.
    pub fn excess(&self) -> T {
        let reduced = reduced(self.chi_square, self.degrees_of_freedom);
        // Below three the excess is what noise alone does to a handful of rests.
        if reduced > real(3.0) { reduced } else { T::one() }
    }

    /// Variance, (m/s^2)^2, by which the reference misses the sphere for reasons other than noise: errors of scale and
    /// non-orthogonality of its own. Zero for a reference that deserves the name.
    pub fn model_variance(&self) -> T {
        if self.excess() > T::one() {
            self.norm_residual * self.norm_residual
        } else {
            T::zero()
        }
    }
}

/// Largest plausible bias of a reference accelerometer, m/s^2.
pub const LARGEST_REFERENCE_BIAS: f64 = 2.0;

/// Solves `|r_k - b| = g` for b by Gauss-Newton (docs/theory/turntable.md, eq. 6). Errors of the table do not
/// enter: the length of gravity does not depend on where the table points.
///
/// `rests` are means of specific force with their covariance.
///
/// # Errors
/// [`Unsolvable`] if a rest is not finite.
pub fn fit_sphere<T: Real>(
    rests: &[(Vector3<T>, Matrix3<T>)],
    gravity: T,
) -> Result<SphereFit<T>, Unsolvable> {
    const STEPS: u32 = 6;
    let largest = real::<T>(LARGEST_REFERENCE_BIAS);
    let prior = Prior {
        mean: Vector3::zeros(),
        covariance: Matrix3::identity() * (largest * largest),
    };
    let mut bias = Vector3::zeros();
    let mut solution = LeastSquares::<T, 3>::new(&prior).solve()?;
    for _ in 0..STEPS {
        let mut equations = LeastSquares::<T, 3>::new(&prior);
        for (mean, covariance) in rests {
            let u = mean - bias;
            let direction = u / u.length();
            // |r - b| = g linearised about the bias of the step before: d . b = d . b_0 + |r - b_0| - g.
            let row = direction.dot(&bias) + u.length() - gravity; // eq. 6
            equations.push(&direction, row, direction.dot(&(covariance * direction))); // eq. 7
        }
        solution = equations.solve()?;
        bias = solution.x;
    }
    let squares = rests.iter().fold(T::zero(), |sum, (mean, _)| {
        let residual = (mean - bias).length() - gravity; // eq. 6
        sum + residual * residual
    });
    let observed = [solution.observed(0), solution.observed(1), solution.observed(2)];
    let unknowns = observed.iter().filter(|seen| **seen).count();
    Ok(SphereFit {
        bias,
        covariance: solution.covariance,
        observed,
        chi_square: solution.chi_square,
        degrees_of_freedom: degrees_of_freedom(solution.rows, unknowns),
        norm_residual: (squares / real::<T>(1.0).max(crate::real::count(solution.rows))).square_root(),
    })
}

/// A rest as the reference gyroscope saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroscopeRest<T: Real> {
    /// Mean angular rate, rad/s.
    pub mean: Vector3<T>,
    /// Covariance of the mean, (rad/s)^2.
    pub covariance: Matrix3<T>,
    /// Attitude at the first rest from attitude at this; `None` if the turns between were not seen whole.
    pub start_from_here: Option<UnitQuaternion<T>>,
}

/// Bias of the reference gyroscope together with the Earth's rotation in the case frame of the first rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EarthFit<T: Real> {
    /// rad/s.
    pub bias: Vector3<T>,
    /// rad/s, case frame of the first rest.
    pub earth_rate: Vector3<T>,
    /// Covariance of `[bias, earth_rate]`, (rad/s)^2.
    pub covariance: Matrix6<T>,
}

/// Largest plausible bias of a reference gyroscope, rad/s.
const LARGEST_REFERENCE_RATE_BIAS: f64 = 0.5;

/// Solves `r_k = b + R_k^T e` (docs/theory/turntable.md, eq. 15) for the bias b and the Earth's rotation e. A turning
/// unit sees e from all sides, which separates it from b; one that does not turn keeps the prior, `|e| = 7.29e-5 rad/s`
/// in any direction, as uncertainty. With `vertical`, the up direction at the first rest and the upward part of e
/// there, latitude helps.
///
/// # Errors
/// [`Unsolvable`] if a rest is not finite.
pub fn fit_earth<T: Real>(
    rests: &[GyroscopeRest<T>],
    vertical: Option<(Vector3<T>, T)>,
) -> Result<EarthFit<T>, Unsolvable> {
    let mut equations = LeastSquares::<T, 6>::new(&earth_prior());
    for rest in rests {
        push_rest(&mut equations, rest);
    }
    if let Some((up, rate)) = vertical {
        let mut row = Vector6::zeros();
        row.fixed_rows_mut::<3>(3).copy_from(&up);
        // The measured vertical is good to a degree at the very worst.
        equations.push(&row, rate, earth_variance::<T>() * real(1e-3));
    }
    let solution = equations.solve()?;
    Ok(EarthFit {
        bias: solution.x.fixed_rows::<3>(0).into_owned(),
        earth_rate: solution.x.fixed_rows::<3>(3).into_owned(),
        covariance: solution.covariance,
    })
}

/// Prior of `[b, e]`.
fn earth_prior<T: Real>() -> Prior<T, 6> {
    let largest = real::<T>(LARGEST_REFERENCE_RATE_BIAS);
    let (b, e) = (largest * largest, earth_variance());
    Prior {
        mean: Vector6::zeros(),
        covariance: Matrix6::from_diagonal(&Vector6::new(b, b, b, e, e, e)),
    }
}

/// The three axes of a rest; where its attitude is not known, the Earth's rotation is one more source of noise.
fn push_rest<T: Real>(equations: &mut LeastSquares<T, 6>, rest: &GyroscopeRest<T>) {
    let here = rest
        .start_from_here
        .map(|q| q.inverse().to_rotation_matrix().into_inner());
    for axis in 0..3 {
        let mut row = Vector6::zeros();
        row[axis] = T::one();
        let mut variance = rest.covariance[(axis, axis)];
        match &here {
            Some(rotation) => row
                .fixed_rows_mut::<3>(3)
                .copy_from(&rotation.row(axis).transpose()), // eq. 15: R_k^T
            None => variance += earth_variance(),
        }
        equations.push(&row, rest.mean[axis], variance); // eq. 15
    }
}

/// Variance of one component of the Earth's rotation whose direction is not known, (rad/s)^2.
pub fn earth_variance<T: Real>() -> T {
    real(EARTH_RATE * EARTH_RATE / 3.0)
}
