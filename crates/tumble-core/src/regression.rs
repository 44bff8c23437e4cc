//! Weighted least squares in a handful of unknowns, with a prior: solution, covariance, rank.
//!
//! Rows are taken in one by one and only their triangle is kept: the root of the normal equations rather than the
//! equations themselves, so that single precision can hold what is known a million times better than beforehand beside
//! what is not known at all. Every unknown carries a weak prior, its nominal
//! value with the largest deviation that could be true of such a sensor. Where data speak, the prior weighs
//! nothing; where they are silent the unknown stays at its nominal value, keeps the sigma of the prior, and is
//! reported as not observed. So no direction is ever divided by zero, and none is made up (docs/theory/turntable.md,
//! eq. 13).

use nalgebra::{SMatrix, SVector};

use crate::eigen;
use crate::real::{Real, count, real};

/// What is known of the unknowns before any data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior<T: Real, const N: usize> {
    /// Nominal values.
    pub mean: SVector<T, N>,
    /// Covariance: for a weak prior the squares of the largest plausible deviations, on the diagonal.
    pub covariance: SMatrix<T, N, N>,
}

/// The triangle `R` and right-hand side `d` with `R z = d`, in the units of the prior: `z = S^-1 (x - mean)` where
/// `S S^T` is the covariance of the prior, of which the triangle is the identity before any data.
#[derive(Clone, Copy, Debug)]
pub struct LeastSquares<T: Real, const N: usize> {
    mean: SVector<T, N>,
    prior_variance: SVector<T, N>,
    root: Option<SMatrix<T, N, N>>,
    triangle: SMatrix<T, N, N>,
    right: SVector<T, N>,
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

/// The unknowns, also in the units of the prior, with the inverse of the triangle, the root of their covariance.
struct Scaled<T: Real, const N: usize> {
    inverse: SMatrix<T, N, N>,
    z: SVector<T, N>,
    x: SVector<T, N>,
}

impl<T: Real, const N: usize> LeastSquares<T, N> {
    /// Only the prior.
    pub fn new(prior: &Prior<T, N>) -> Self {
        Self {
            mean: prior.mean,
            prior_variance: prior.covariance.diagonal(),
            root: lower_root(&prior.covariance),
            triangle: SMatrix::identity(),
            right: SVector::zeros(),
            squares: T::zero(),
            rows: 0,
        }
    }

    /// Takes in one row `y = a . x + noise`, with the variance of the noise: Givens rotations turn it into the
    /// triangle (Golub and Van Loan, section 6.5.3), and what is left of y is a residual.
    pub fn push(&mut self, a: &SVector<T, N>, y: T, variance: T) {
        self.rows += 1;
        let Some(root) = &self.root else { return };
        let sigma = variance.square_root();
        let mut row = root.tr_mul(a) / sigma;
        let mut right = (y - a.dot(&self.mean)) / sigma;
        for i in 0..N {
            // Nothing to turn: roots are dear on small processors.
            if row[i] == T::zero() {
                continue;
            }
            let length = (self.triangle[(i, i)] * self.triangle[(i, i)] + row[i] * row[i]).square_root();
            let (cosine, sine) = (self.triangle[(i, i)] / length, row[i] / length);
            for j in i..N {
                let (above, below) = (self.triangle[(i, j)], row[j]);
                self.triangle[(i, j)] = cosine * above + sine * below;
                row[j] = cosine * below - sine * above;
            }
            let above = self.right[i];
            self.right[i] = cosine * above + sine * right;
            right = cosine * right - sine * above;
        }
        self.squares += right * right;
    }

    /// Solves the triangle.
    ///
    /// # Errors
    /// [`Unsolvable`] if something was not finite, or the covariance of the prior is none.
    // What is inlined keeps its stack while its caller goes on: three matrices here.
    #[inline(never)]
    pub fn solve(&self) -> Result<Solution<T, N>, Unsolvable> {
        let root = self.root.as_ref().ok_or(Unsolvable)?;
        let Scaled { inverse, z, x } = self.scaled()?;
        let spread = root * inverse;
        let covariance = spread * spread.transpose(); // eq. 13
        Ok(Solution {
            x,
            covariance,
            ignorance: covariance.diagonal().component_div(&self.prior_variance),
            // The residuals of data and prior together, less those of the prior.
            chi_square: (self.squares - z.norm_squared()).max(T::zero()),
            rows: self.rows,
        })
    }

    /// The unknowns alone, for a round after which there is another: their covariance takes longer than they do.
    ///
    /// # Errors
    /// As of [`Self::solve`].
    pub fn unknowns(&self) -> Result<SVector<T, N>, Unsolvable> {
        self.scaled().map(|scaled| scaled.x)
    }

    #[inline(never)]
    fn scaled(&self) -> Result<Scaled<T, N>, Unsolvable> {
        let root = self.root.as_ref().ok_or(Unsolvable)?;
        let inverse = self.inverse()?;
        let z = inverse * self.right;
        let step = root * z;
        if !step.iter().all(|value| value.is_finite()) {
            return Err(Unsolvable);
        }
        let x = self.mean + step; // eq. 13
        Ok(Scaled { inverse, z, x })
    }

    /// Number of directions in which the data say more than the prior.
    ///
    /// # Errors
    /// As of [`Self::solve`].
    pub fn rank(&self) -> Result<usize, Unsolvable> {
        let inverse = self.inverse()?;
        let (left_standing, _) = eigen::symmetric(inverse * inverse.transpose());
        let undecided = real::<T>(0.5);
        Ok(left_standing.iter().filter(|share| **share < undecided).count())
    }

    fn inverse(&self) -> Result<SMatrix<T, N, N>, Unsolvable> {
        let mut inverse = SMatrix::identity();
        let regular = self.triangle.solve_upper_triangular_mut(&mut inverse);
        regular.then_some(inverse).ok_or(Unsolvable)
    }
}

/// The lower triangle `S` with `S S^T` a covariance, column by column (Golub and Van Loan, section 4.2.5); `None` where it is
/// none.
#[inline(never)]
fn lower_root<T: Real, const N: usize>(covariance: &SMatrix<T, N, N>) -> Option<SMatrix<T, N, N>> {
    let mut root = SMatrix::zeros();
    for j in 0..N {
        for i in j..N {
            let mut left = covariance[(i, j)];
            for k in 0..j {
                left -= root[(j, k)] * root[(i, k)];
            }
            root[(i, j)] = left;
        }
        let length = Some(root[(j, j)].square_root()).filter(|length| *length > T::zero())?;
        root[(j, j)] = length;
        for i in j + 1..N {
            root[(i, j)] /= length;
        }
    }
    Some(root)
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
