//! Weighted least squares in a handful of unknowns, with a prior: solution, covariance, rank.
//!
//! Rows are taken in one by one and only their triangle is kept: the root of the normal equations rather than the
//! equations themselves, so that single precision can hold what is known a million times better than beforehand beside
//! what is not known at all. Every unknown carries a weak prior, its nominal
//! value with the largest deviation that could be true of such a sensor. Where data speak, the prior weighs
//! nothing; where they are silent the unknown stays at its nominal value, keeps the sigma of the prior, and is
//! reported as not observed. So no direction is ever divided by zero, and none is made up (docs/theory/turntable.md,
//! eq. 13).

use core::cmp::Ordering;

use nalgebra::{SMatrix, SVector};

use crate::eigen;
use crate::products::zeros;
use crate::real::{Real, count, real};

/// Prior of the unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior<T: Real, const N: usize> {
    /// Nominal values.
    pub mean: SVector<T, N>,
    /// Covariance: for a weak prior the squares of the largest plausible deviations, on the diagonal.
    pub covariance: SMatrix<T, N, N>,
}

/// A matrix, column by column: the compiler knows its size wherever an element is taken, inlined or not.
type Columns<T, const N: usize> = [[T; N]; N];

/// The triangle `R` and right-hand side `d` with `R (x - mean) = d`: that of the prior, `R0` with `R0^T R0` the inverse of
/// its covariance, before any data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastSquares<T: Real, const N: usize> {
    mean: SVector<T, N>,
    prior_variance: [T; N],
    /// Diagonal of `R0`.
    prior_diagonal: [T; N],
    /// Row `i` of `R` is column `i` from the diagonal down, and row `i` of `R0` is row `i` beyond the diagonal.
    triangles: Columns<T, N>,
    right: [T; N],
    squares: T,
    rows: u32,
    /// True if the covariance of the prior is valid.
    sound: bool,
}

/// Solution of the rows.
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
    /// Solution of no rows: all is zero.
    #[inline(always)]
    pub fn none() -> Self {
        Self {
            x: zeros(),
            covariance: zeros(),
            ignorance: zeros(),
            chi_square: T::zero(),
            rows: 0,
        }
    }

    /// Tests whether the data showed unknown `i`.
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
        let mut equations = Self::none();
        equations.begin(prior);
        equations
    }

    /// Not even a prior: unsolvable.
    #[inline(always)]
    pub fn none() -> Self {
        Self {
            mean: zeros(),
            prior_variance: [T::zero(); N],
            prior_diagonal: [T::zero(); N],
            triangles: [[T::zero(); N]; N],
            right: [T::zero(); N],
            squares: T::zero(),
            rows: 0,
            sound: false,
        }
    }

    /// Begins anew, with only the prior.
    #[inline(never)]
    pub fn begin(&mut self, prior: &Prior<T, N>) {
        self.mean = prior.mean;
        self.triangles = prior.covariance.data.0;
        for i in 0..N {
            self.prior_variance[i] = self.triangles[i][i];
        }
        let rooted = root(&mut self.triangles);
        self.sound = rooted.and_then(|()| invert(&mut self.triangles)).is_some();
        for i in 0..N {
            self.prior_diagonal[i] = self.triangles[i][i];
        }
        self.restart();
    }

    /// Forgets all rows.
    pub fn restart(&mut self) {
        for i in 0..N {
            self.triangles[i][i] = self.prior_diagonal[i];
            for j in i + 1..N {
                self.triangles[i][j] = self.triangles[j][i];
            }
        }
        self.right = [T::zero(); N];
        self.squares = T::zero();
        self.rows = 0;
    }

    /// Takes in one row `y = a . x + noise`, with the variance of the noise: Givens rotations turn it into the
    /// triangle (Golub and Van Loan, section 6.5.3), and what is left of y is a residual.
    #[inline(never)]
    pub fn push(&mut self, a: &SVector<T, N>, y: T, variance: T) {
        self.rows += 1;
        let weight = T::one() / variance.square_root();
        let [mut row] = (a * weight).data.0;
        let mut right = (y - a.dot(&self.mean)) * weight;
        for i in 0..N {
            // Nothing to turn: roots are dear on small processors.
            if row[i] == T::zero() {
                continue;
            }
            let diagonal = self.triangles[i][i];
            let length = (diagonal * diagonal + row[i] * row[i]).square_root();
            let (cosine, sine) = (diagonal / length, row[i] / length);
            for j in i..N {
                let (above, below) = (self.triangles[i][j], row[j]);
                self.triangles[i][j] = cosine * above + sine * below;
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
    pub fn solve(&self) -> Result<Solution<T, N>, Unsolvable> {
        let mut solution = Solution::none();
        self.solve_into(&mut solution)?;
        Ok(solution)
    }

    /// Solves the triangle, with nothing but the solution for memory.
    ///
    /// # Errors
    /// Those of [`Self::solve`]; the solution is invalid then.
    #[inline(never)]
    pub fn solve_into(&self, solution: &mut Solution<T, N>) -> Result<(), Unsolvable> {
        solution.x = self.unknowns()?;
        let [ignorance] = &mut solution.ignorance.data.0;
        let covariance = &mut solution.covariance.data.0;
        self.invert_into(covariance)?;
        by_its_transpose(covariance); // eq. 13
        for i in 0..N {
            ignorance[i] = covariance[i][i] / self.prior_variance[i];
        }
        // The residuals of data and prior together, less those of the prior.
        solution.chi_square = (self.squares - self.residual_of_prior(&solution.x)).max(T::zero());
        solution.rows = self.rows;
        Ok(())
    }

    /// The unknowns alone, for a round after which there is another: their covariance takes longer than they do.
    ///
    /// # Errors
    /// Those of [`Self::solve`].
    #[inline(never)]
    pub fn unknowns(&self) -> Result<SVector<T, N>, Unsolvable> {
        let mut step = self.right;
        for i in (0..N).rev() {
            for j in i + 1..N {
                step[i] -= self.triangles[i][j] * step[j];
            }
            step[i] /= self.triangles[i][i];
        }
        let solved = self.sound && step.iter().all(|value| value.is_finite());
        solved.then(|| self.mean + SVector::from(step)).ok_or(Unsolvable) // eq. 13
    }

    /// By how much the squared residuals, prior included, are larger at `x` than at the solution: the square of the distance
    /// in sigmas, along the direction in which that is largest.
    pub fn excess(&self, x: &SVector<T, N>) -> T {
        let [step] = (x - self.mean).data.0;
        (0..N).fold(T::zero(), |sum, i| {
            let row = (i..N).fold(-self.right[i], |row, j| row + self.triangles[i][j] * step[j]);
            sum + row * row
        })
    }

    /// Number of directions in which the data are more informative than the prior.
    ///
    /// # Errors
    /// Those of [`Self::solve`].
    pub fn rank(&self) -> Result<usize, Unsolvable> {
        let mut inverse: SMatrix<T, N, N> = zeros();
        self.invert_into(&mut inverse.data.0)?;
        let left = self.prior_triangle() * inverse;
        let (left_standing, _) = eigen::symmetric(left * left.transpose());
        let undecided = real::<T>(0.5);
        Ok(left_standing.iter().filter(|share| **share < undecided).count())
    }

    /// Squared residual of the prior at `x`.
    fn residual_of_prior(&self, x: &SVector<T, N>) -> T {
        let [step] = (x - self.mean).data.0;
        (0..N).fold(T::zero(), |sum, i| {
            let first = self.prior_diagonal[i] * step[i];
            let row = (i + 1..N).fold(first, |row, j| row + self.triangles[j][i] * step[j]);
            sum + row * row
        })
    }

    /// `R0`.
    fn prior_triangle(&self) -> SMatrix<T, N, N> {
        SMatrix::from_fn(|i, j| match i.cmp(&j) {
            Ordering::Less => self.triangles[j][i],
            Ordering::Equal => self.prior_diagonal[i],
            Ordering::Greater => T::zero(),
        })
    }

    /// The inverse of `R`.
    fn invert_into(&self, inverse: &mut Columns<T, N>) -> Result<(), Unsolvable> {
        for i in 0..N {
            for j in 0..N {
                inverse[j][i] = if i <= j { self.triangles[i][j] } else { T::zero() };
            }
        }
        let regular = self.sound && invert(inverse).is_some();
        regular.then_some(()).ok_or(Unsolvable)
    }
}

/// Puts the upper triangle `U` with `U U^T` a covariance in the place of its own, column by column from the last (Golub and
/// Van Loan, section 4.2.5, read backwards); `None` where it is none.
fn root<T: Real, const N: usize>(covariance: &mut Columns<T, N>) -> Option<()> {
    for j in (0..N).rev() {
        let length = Some(covariance[j][j].square_root()).filter(|length| *length > T::zero())?;
        covariance[j][j] = length;
        for i in 0..j {
            covariance[j][i] /= length;
        }
        for k in 0..j {
            if covariance[j][k] == T::zero() {
                continue;
            }
            for i in 0..k + 1 {
                covariance[k][i] -= covariance[j][i] * covariance[j][k];
            }
        }
    }
    Some(())
}

/// Puts the inverse of an upper triangle in its place; `None` where there is none.
fn invert<T: Real, const N: usize>(triangle: &mut Columns<T, N>) -> Option<()> {
    for j in 0..N {
        if triangle[j][j] == T::zero() {
            return None;
        }
        let last = T::one() / triangle[j][j];
        triangle[j][j] = last;
        for i in 0..j {
            // Rows from i on of the columns before j are inverse already, and column j from i on is not.
            let mut sum = T::zero();
            for k in i..j {
                sum += triangle[k][i] * triangle[j][k];
            }
            triangle[j][i] = -sum * last;
        }
    }
    Some(())
}

/// Puts `U U^T` in the place of an upper triangle `U`.
fn by_its_transpose<T: Real, const N: usize>(triangle: &mut Columns<T, N>) {
    for i in 0..N {
        for j in i..N {
            let product = (j..N).fold(T::zero(), |sum, k| sum + triangle[k][i] * triangle[k][j]);
            triangle[j][i] = product;
        }
    }
    for i in 0..N {
        for j in i + 1..N {
            triangle[i][j] = triangle[j][i];
        }
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
