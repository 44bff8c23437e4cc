//! Weighted least squares in a handful of unknowns, with a prior: solution, covariance, rank.
//!
//! Rows are taken in one by one and only their sums are kept. Every unknown carries a weak prior, its nominal
//! value with the largest deviation that could be true of such a sensor. Where data speak, the prior weighs
//! nothing; where they are silent the unknown stays at its nominal value, keeps the sigma of the prior, and is
//! reported as not observed. So no direction is ever divided by zero, and none is made up.

use nalgebra::{SMatrix, SVector};

use crate::real::{Real, count, real};

/// What is believed of an unknown before any data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior<T: Real, const N: usize> {
    /// Nominal values.
    pub mean: SVector<T, N>,
    /// Covariance: for a weak prior the squares of the largest plausible deviations, on the diagonal.
    pub covariance: SMatrix<T, N, N>,
}

/// Normal equations `A^T W A x = A^T W y`, accumulated about the mean of the prior.
#[derive(Clone, Copy, Debug)]
pub struct LeastSquares<T: Real, const N: usize> {
    mean: SVector<T, N>,
    prior_covariance: SMatrix<T, N, N>,
    information: SMatrix<T, N, N>,
    vector: SVector<T, N>,
    squares: T,
    rows: u32,
}

/// What the rows say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<T: Real, const N: usize> {
    /// The unknowns.
    pub x: SVector<T, N>,
    /// Their covariance, prior included.
    pub covariance: SMatrix<T, N, N>,
    /// Share of the prior's variance that the data left standing, for each unknown: 1 is untouched, 0 is known.
    pub ignorance: SVector<T, N>,
    /// Number of directions in which the data say more than the prior.
    pub rank: usize,
    /// Sum of the squared weighted residuals, without the prior.
    pub chi_square: T,
    /// Rows taken in.
    pub rows: u32,
}

/// An unknown counts as observed when the data took away at least three quarters of its prior variance.
const OBSERVED: f64 = 0.25;

impl<T: Real, const N: usize> Solution<T, N> {
    /// Whether the data showed unknown `i`.
    pub fn observed(&self, i: usize) -> bool {
        self.ignorance.get(i).is_some_and(|share| *share < real(OBSERVED))
    }
}

/// The normal equations have no solution: a row was not finite, or a weight not positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unsolvable;

impl<T: Real, const N: usize> LeastSquares<T, N> {
    /// Only the prior.
    pub fn new(prior: &Prior<T, N>) -> Self {
        Self {
            mean: prior.mean,
            prior_covariance: prior.covariance,
            information: SMatrix::zeros(),
            vector: SVector::zeros(),
            squares: T::zero(),
            rows: 0,
        }
    }

    /// Takes in one row `y = a . x + noise`, with the variance of the noise.
    pub fn push(&mut self, a: &SVector<T, N>, y: T, variance: T) {
        let innovation = y - a.dot(&self.mean);
        let weight = T::one() / variance;
        self.information.ger(weight, a, a, T::one());
        self.vector.axpy(weight * innovation, a, T::one());
        self.squares += weight * innovation * innovation;
        self.rows += 1;
    }

    /// Solves by Cholesky in the units of the prior, `z = S^-1 (x - mean)` with `P = S S^T`: the information of the
    /// prior is then the identity, and an eigenvalue of the data's above one is a direction the data decide.
    ///
    /// # Errors
    /// [`Unsolvable`] if something was not finite.
    pub fn solve(&self) -> Result<Solution<T, N>, Unsolvable> {
        let root = self.prior_covariance.cholesky().ok_or(Unsolvable)?.unpack();
        let data = root.transpose() * self.information * root;
        let total = (data + SMatrix::identity()).cholesky().ok_or(Unsolvable)?;
        let z_covariance = total.inverse();
        let z = total.solve(&(root.transpose() * self.vector));
        let covariance = root * z_covariance * root.transpose();
        let step = root * z;
        let ignorance = SVector::from_fn(|i, _| covariance[(i, i)] / self.prior_covariance[(i, i)]);
        let chi_square =
            self.squares - self.vector.dot(&step) * real(2.0) + step.dot(&(self.information * step));
        if !step.iter().all(|value| value.is_finite()) {
            return Err(Unsolvable);
        }
        Ok(Solution {
            x: self.mean + step,
            covariance,
            ignorance,
            rank: eigenvalues(data)
                .iter()
                .filter(|value| **value > T::one())
                .count(),
            chi_square: chi_square.max(T::zero()),
            rows: self.rows,
        })
    }
}

/// Eigenvalues of a symmetric matrix by cyclic Jacobi rotations (Golub and Van Loan, section 8.5): sums, products
/// and roots alone, a bounded number of sweeps, hence the same bits everywhere.
pub fn eigenvalues<T: Real, const N: usize>(mut a: SMatrix<T, N, N>) -> SVector<T, N> {
    const SWEEPS: u32 = 16;
    for _ in 0..SWEEPS {
        for p in 0..N {
            for q in p + 1..N {
                rotate(&mut a, p, q);
            }
        }
    }
    a.diagonal()
}

/// One Jacobi rotation that makes `a[p, q]` vanish.
fn rotate<T: Real, const N: usize>(a: &mut SMatrix<T, N, N>, p: usize, q: usize) {
    let off = a[(p, q)];
    if off.abs() <= T::default_epsilon() * real::<T>(0.01) * (a[(p, p)].abs() * a[(q, q)].abs()).sqrt() {
        return;
    }
    let theta = (a[(q, q)] - a[(p, p)]) / (off * real(2.0));
    let sign = if theta < T::zero() { -T::one() } else { T::one() };
    let tangent = sign / (theta.abs() + (theta * theta + T::one()).sqrt());
    let cosine = T::one() / (tangent * tangent + T::one()).sqrt();
    let sine = tangent * cosine;
    for k in 0..N {
        let (akp, akq) = (a[(k, p)], a[(k, q)]);
        a[(k, p)] = cosine * akp - sine * akq;
        a[(k, q)] = sine * akp + cosine * akq;
    }
    for k in 0..N {
        let (apk, aqk) = (a[(p, k)], a[(q, k)]);
        a[(p, k)] = cosine * apk - sine * aqk;
        a[(q, k)] = sine * apk + cosine * aqk;
    }
}

/// Degrees of freedom that `rows` leave to `unknowns`.
pub fn degrees_of_freedom(rows: u32, unknowns: usize) -> u32 {
    rows.saturating_sub(u32::try_from(unknowns).unwrap_or(u32::MAX))
}

/// Chi-square per degree of freedom; one where there is no freedom left.
pub fn reduced<T: Real>(chi_square: T, freedom: u32) -> T {
    if freedom == 0 {
        T::one()
    } else {
        chi_square / count(freedom)
    }
}
