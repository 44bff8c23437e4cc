//! Fit of offsets, gains, matrix and lever arm to the joint moments of pairs.
//!
//! The data of a fit are the readings of the secondary minus those that the stored error predicts: these are
//! small, so single precision suffices.
//!
//! Along directions that the motion did not excite, the matrix and the lever arm keep their stored values. All
//! systems solved are 3 x 3: the rows of M share the covariance of the motion, and the lever arm remains by
//! Schur complement (docs/theory/redundancy.md, eq. 5 to 11).

pub mod adoption;
mod excitation;
pub mod joint_moments;
pub mod residual;
pub mod rests;
mod row_moments;

use nalgebra::{Matrix3, Vector3};

use crate::products::{
    columns, congruent, diagonal, matrix_product, of_columns, product, squared, squared_matrix,
    transposed_matrix_product, transposed_product, zeros,
};
use crate::real::{Real, count, real};
use crate::redundancy::fit::excitation::ExcitedDirections;
use crate::redundancy::fit::residual::{Layout, PairMoments, RowResidual};
use crate::redundancy::fit::rests::{RowPairs, WeighedRests};
use crate::redundancy::fit::row_moments::{EstimatedRow, RowMoments};
use crate::redundancy::relative_error::{ERROR_NUMBERS, RelativeError};
use crate::redundancy::settings::FitModel;

/// Variance of the noise of the primary in a pair, measured at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimaryNoise<T: Real> {
    /// Covariance of the reading of the primary, in the axes of the secondary, (m/s^2)^2 or (rad/s)^2.
    pub reading: Matrix3<T>,
    /// Variance of each axis of the angular acceleration of the primary, (rad/s^2)^2.
    pub angular_acceleration: Vector3<T>,
}

/// Data and limits of a fit.
pub struct FitProblem<'a, T: Real> {
    /// Pairs in motion.
    pub pairs: &'a dyn PairMoments<T>,
    /// Rests that are fitted beside the pairs; `None` for a fit to pairs alone.
    pub rests: Option<WeighedRests<'a, T>>,
    /// Layout of the channels.
    pub layout: Layout,
    /// Axes of the sensor that correspond to axes of the primary.
    pub axes: [bool; 3],
    /// True if the sensor has all three axes.
    pub complete: bool,
    /// Noise of the primary.
    pub noise: &'a PrimaryNoise<T>,
    /// Stored error, which remains where the data show nothing.
    pub stored: &'a RelativeError<T>,
    /// Largest model that the fit may estimate.
    pub highest: FitModel,
    /// Standard deviation of the motion along a direction above which it is fitted, m/s^2 or rad/s.
    pub excitation: T,
    /// Excitation of the lever arm above which it is fitted, m/s^2 per m; `None` if the lever arm is known.
    pub lever_arm_excitation: Option<T>,
}

/// Result of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit<T: Real> {
    /// Estimated error.
    pub error: RelativeError<T>,
    /// Model that was estimated.
    pub fit_model: FitModel,
    /// Number of directions along which M was fitted.
    pub directions: u8,
    /// Projection onto the directions along which each row of M was fitted.
    pub shown: [Matrix3<T>; 3],
    /// Covariance of each row of M along these directions.
    pub row_covariance: [Matrix3<T>; 3],
    /// 1-sigma of the bias, given the parts of M that kept their stored values.
    pub bias_sigma: Vector3<T>,
    /// Projection onto the directions along which the lever arm was fitted.
    pub lever_arm_shown: Matrix3<T>,
    /// Covariance of the lever arm along these directions, m^2.
    pub lever_arm_covariance: Matrix3<T>,
    /// Number of fitted pairs.
    pub pairs: u32,
}

/// Variances of the [numbers](RelativeError::numbers) of an error; zero for a number that kept its stored
/// value.
pub type ErrorVariances<T> = [T; ERROR_NUMBERS];

/// Mean square difference of two fits to different pairs, over the sum of their variances. It is about one,
/// unless residuals are correlated for longer than a pair, like those of vibration.
pub fn disagreement<T: Real>(errors: [&RelativeError<T>; 2], variances: [&ErrorVariances<T>; 2]) -> T {
    let ([first, second], [of_first, of_second]) = (errors, variances);
    let apart = first
        .numbers()
        .zip(second.numbers())
        .map(|(one, other)| one - other);
    let variances = of_first.iter().zip(of_second).map(|(one, other)| *one + *other);
    let shown = apart.zip(variances).filter(|(_, variance)| *variance > T::zero());
    let (sum, terms) = shown.fold((T::zero(), T::zero()), |(sum, terms), (apart, variance)| {
        (sum + apart * apart / variance, terms + T::one())
    });
    sum / terms.max(T::one())
}

impl<T: Real> Fit<T> {
    /// Creates an empty fit, to be written.
    #[inline(never)]
    pub fn none() -> Self {
        Self {
            error: RelativeError::none(),
            fit_model: FitModel::Offset,
            directions: 0,
            shown: [zeros(); 3],
            row_covariance: [zeros(); 3],
            bias_sigma: zeros(),
            lever_arm_shown: zeros(),
            lever_arm_covariance: zeros(),
            pairs: 0,
        }
    }

    /// Returns the variances of the numbers of the error.
    pub fn variances(&self) -> ErrorVariances<T> {
        let [x, y, z] = self.row_covariance.each_ref().map(Matrix3::diagonal);
        let matrix = Matrix3::from_columns(&[x, y, z]).transpose();
        let bias = self.bias_sigma.component_mul(&self.bias_sigma);
        let lever_arm = self.lever_arm_covariance.diagonal();
        let mut variances = [T::zero(); ERROR_NUMBERS];
        let found = matrix.iter().chain(bias.iter()).chain(lever_arm.iter());
        variances
            .iter_mut()
            .zip(found)
            .for_each(|(variance, found)| *variance = *found);
        variances
    }

    /// Multiplies every variance by a factor.
    pub fn weaken(&mut self, times: T) {
        for covariance in &mut self.row_covariance {
            *covariance *= times;
        }
        self.lever_arm_covariance *= times;
        self.bias_sigma *= times.square_root();
    }
}

/// State of a fit after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitProgress {
    /// Another step would change the result.
    GoesOn,
    /// The fit is complete.
    Found,
    /// The system of equations has no solution.
    Unsolvable,
}

/// Most steps of Gauss and Newton: M and the lever arm appear in products, and each step squares the remaining
/// error.
const STEPS: u8 = 3;

/// Squared step, in sigmas, below which a fit has converged (docs/theory/redundancy.md, eq. 23).
const SETTLED: f64 = 1e-4;

/// Squared part of the current lever arm outside the observed directions, over its squared difference from the
/// stored one, above which another step follows. Single precision alone leaves less.
const STRAYED: f64 = 1e-8;

/// Neighbouring triangles share a window, which makes the variance of means 1 + 2/4 times that of independent ones
/// (docs/theory/redundancy.md, eq. 12).
const SHARED: f64 = 1.5; // eq. 12: kappa

/// Contribution of one row, for the current M and lever arm.
struct RowStep<T: Real> {
    excited: ExcitedDirections<T>,
    /// Part of the unexplained readings that the motion explains.
    explained: Vector3<T>,
    /// Part of the lever that the motion explains.
    carried: Matrix3<T>,
}

/// Rows of a matrix.
fn rows_of<T: Real>(matrix: &Matrix3<T>) -> [Vector3<T>; 3] {
    columns(&matrix.transpose())
}

/// Sums over the rows, which determine the lever arm.
struct LeverSums<T: Real> {
    /// Covariance of the lever that the motion does not explain.
    complement: Matrix3<T>,
    /// Covariance of the lever.
    lever: Matrix3<T>,
    /// Readings that the motion does not explain.
    unexplained: Vector3<T>,
    /// Variance that the motion leaves.
    left: T,
}

/// Means of the quantities that one row relates.
struct RowMeans<T: Real> {
    motion: Vector3<T>,
    /// Mean of the row of M times the lever, reduced by the share of the rests.
    lever: Vector3<T>,
    /// Mean reading of the secondary minus the prediction of the stored error.
    beyond: T,
    /// Variance of that mean, over the variance of the mean of the pairs alone.
    variance: T,
}

/// State of the iteration.
struct FitIteration<T: Real> {
    matrix: Matrix3<T>,
    lever_arm: Vector3<T>,
    rows: [RowStep<T>; 3],
    lever: ExcitedDirections<T>,
    /// True if another step would change nothing.
    settled: bool,
}

impl<T: Real> FitIteration<T> {
    #[inline(never)]
    fn from(error: &RelativeError<T>) -> Self {
        Self {
            matrix: error.matrix,
            lever_arm: error.lever_arm,
            rows: core::array::from_fn(|_| RowStep {
                excited: ExcitedDirections::nothing(),
                explained: zeros(),
                carried: zeros(),
            }),
            lever: ExcitedDirections::nothing(),
            settled: false,
        }
    }
}

impl<T: Real> FitProblem<'_, T> {
    /// Takes one step of Gauss and Newton from `near`, which it updates, over all parameters that the motion
    /// excites. `taken` steps precede it.
    #[inline(never)]
    pub fn go_on(&self, near: &mut RelativeError<T>, taken: u8, found: &mut Fit<T>) -> FitProgress {
        let mut iteration = FitIteration::from(near);
        self.step(&mut iteration);
        (near.matrix, near.lever_arm) = (iteration.matrix, iteration.lever_arm);
        if !iteration.settled && taken.saturating_add(1) < STEPS {
            return FitProgress::GoesOn;
        }
        match self.conclude(&iteration, found) {
            Some(()) => FitProgress::Found,
            None => FitProgress::Unsolvable,
        }
    }

    /// Computes a step of Gauss and Newton.
    #[inline(never)]
    fn step(&self, iteration: &mut FitIteration<T>) {
        let change = iteration.lever_arm - self.stored.lever_arm;
        let v = &self.noise.angular_acceleration;
        let noise = diagonal(v.y + v.z, v.z + v.x, v.x + v.y); // eq. 10
        let mut sums = LeverSums {
            complement: -noise,
            lever: zeros(),
            unexplained: zeros(),
            left: T::zero(),
        };
        let matrices = rows_of(&iteration.matrix)
            .into_iter()
            .zip(rows_of(&self.stored.matrix));
        for ((number, row), (matrix, stored)) in iteration.rows.iter_mut().enumerate().zip(matrices) {
            let estimated = EstimatedRow {
                number,
                matrix,
                stored,
                change,
            };
            let moments = RowMoments::of(self, &estimated);
            row.excited = self.excited(&moments.motion, number);
            row.explained = product(&row.excited.inverse, &moments.motion_beyond);
            row.carried = matrix_product(&row.excited.inverse, &moments.motion_lever);
            if self.axes.get(number) != Some(&true) {
                continue;
            }
            sums.unexplained +=
                moments.lever_beyond - transposed_product(&moments.motion_lever, &row.explained); // eq. 8: g_i - A_i^T Sigma^+ c_i
            sums.lever += moments.lever;
            sums.complement += moments.lever - transposed_matrix_product(&moments.motion_lever, &row.carried); // eq. 8: S
            sums.left += moments.beyond - moments.motion_beyond.dot(&row.explained);
        }
        self.excite_lever(&sums.complement, &mut iteration.lever);
        self.take_step(iteration, &sums);
    }

    /// Applies the step that minimises the unexplained variance.
    #[inline(never)]
    fn take_step(&self, iteration: &mut FitIteration<T>, sums: &LeverSums<T>) {
        let change = iteration.lever_arm - self.stored.lever_arm;
        let step = product(&iteration.lever.inverse, &sums.unexplained); // eq. 8: s
        let changes = iteration.rows.each_ref();
        let changes = changes.map(|row| row.explained - product(&row.carried, &step)); // eq. 9: Delta_i
        let matrix = self.stored.matrix + of_columns(changes).transpose();
        // The product of the step and the change of M is left for the next step.
        let moved = step.dot(&product(&sums.lever, &step));
        let next = squared_matrix(&(matrix - iteration.matrix)) * moved;
        let left = sums.left - step.dot(&sums.unexplained);
        // Along directions that show nothing the stored value remains.
        let shown = product(&iteration.lever.projection, &change);
        let strayed = squared(&(change - shown)) > squared(&change) * real(STRAYED);
        // redundancy.md, eq. 23
        iteration.settled = !strayed && next <= left * self.share(0) * real(SETTLED / 3.0);
        iteration.matrix = matrix;
        iteration.lever_arm = self.stored.lever_arm + shown + step;
    }

    #[inline(always)]
    fn row_pairs(&self, row: usize) -> RowPairs<'_, T> {
        RowPairs::new(self.pairs, self.layout, self.rests.as_ref(), row)
    }

    /// Variance of the mean of the pairs, over that of a pair, for a number of unknowns in a row.
    fn share(&self, unknowns: u32) -> T {
        real::<T>(SHARED) / count(self.pairs.samples().saturating_sub(unknowns).max(1)) // eq. 11: kappa / n
    }

    /// Directions along which row `i` of M may be fitted.
    fn excited(&self, motion: &Matrix3<T>, i: usize) -> ExcitedDirections<T> {
        let least = self.excitation * self.excitation;
        match self.highest {
            _ if self.axes.get(i) != Some(&true) => ExcitedDirections::nothing(),
            FitModel::Offset => ExcitedDirections::nothing(),
            FitModel::Affine | FitModel::AffineAndLeverArm if self.complete => {
                ExcitedDirections::of(*motion, least)
            }
            FitModel::Gain | FitModel::Affine | FitModel::AffineAndLeverArm => {
                ExcitedDirections::along_axis(motion, i, least)
            }
        }
    }

    fn finds_lever_arm(&self) -> bool {
        self.lever_arm_excitation.is_some() && self.highest == FitModel::AffineAndLeverArm
    }

    /// Directions along which the lever arm shows beyond the effects of the motion.
    fn excite_lever(&self, complement: &Matrix3<T>, excited: &mut ExcitedDirections<T>) {
        if let Some(least) = self.lever_arm_excitation.filter(|_| self.finds_lever_arm()) {
            *excited = ExcitedDirections::of(*complement, least * least);
        }
    }

    /// Means of row `i`, with `m` the fitted row of M.
    #[inline(never)]
    fn row_means(&self, i: usize, m: &Vector3<T>) -> RowMeans<T> {
        let pairs = self.row_pairs(i);
        let lever = self.layout.lever.map_or(zeros(), |first| {
            Matrix3::from_fn(|l, k| pairs.mean_of(first + 3 * l + k))
        });
        RowMeans {
            motion: Vector3::from_fn(|j, _| pairs.mean_of(j)),
            lever: transposed_product(&lever, m),
            beyond: pairs.mean_of(self.layout.second + i),
            variance: pairs.variance_of_mean(),
        }
    }

    #[inline(never)]
    fn conclude(&self, iteration: &FitIteration<T>, fit: &mut Fit<T>) -> Option<()> {
        let FitIteration {
            matrix,
            lever_arm,
            rows,
            ..
        } = iteration;
        let stored = self.stored;
        let (more, farther) = (matrix - stored.matrix, lever_arm - stored.lever_arm);
        let [x, y, z] = rows_of(matrix);
        let means = [
            self.row_means(0, &x),
            self.row_means(1, &y),
            self.row_means(2, &z),
        ];
        let mut bias = stored.bias;
        let of_rows = bias.iter_mut().zip(self.axes).zip(&means).zip(rows_of(&more));
        for (((bias, present), mean), more) in of_rows {
            if present {
                *bias += mean.beyond - (more.dot(&mean.motion) + mean.lever.dot(&farther));
            }
        }
        fit.error = RelativeError::new(*matrix, bias, *lever_arm)?;
        fit.directions = rows.iter().fold(0, |most, row| row.excited.directions.max(most));
        fit.fit_model = self.fit_model(fit.directions, iteration.lever.directions);
        fit.pairs = self.pairs.samples();
        let share = self.share(1 + u32::from(fit.directions));
        let variance = [0, 1, 2].map(|i| self.residual_variance(&fit.error, i) * share);
        fit.lever_arm_shown = iteration.lever.projection;
        fit.lever_arm_covariance = iteration.lever.inverse * self.mean_of_rows(&variance); // eq. 11: C_r
        let of_arm = &fit.lever_arm_covariance;
        fit.shown = rows.each_ref().map(|row| row.excited.projection);
        let found = fit.row_covariance.iter_mut().zip(fit.bias_sigma.iter_mut());
        for (((covariance, sigma), row), (mean, variance)) in found.zip(rows).zip(means.iter().zip(variance))
        {
            let by_lever = congruent(&row.carried, of_arm);
            *covariance = row.excited.inverse * variance + by_lever; // eq. 11: cov Delta_i
            let across = -product(&row.carried, &product(of_arm, &mean.lever));
            let spread = mean.motion.dot(&product(covariance, &mean.motion))
                + mean.lever.dot(&product(of_arm, &mean.lever));
            let square = variance * mean.variance + spread + mean.motion.dot(&across) * real(2.0);
            *sigma = square.max(T::zero()).square_root();
        }
        for (sigma, present) in fit.bias_sigma.iter_mut().zip(self.axes) {
            if !present {
                *sigma = T::zero();
            }
        }
        Some(())
    }

    /// Mean over the fitted rows.
    fn mean_of_rows(&self, values: &[T; 3]) -> T {
        let fitted = values.iter().zip(self.axes).filter(|(_, fitted)| *fitted);
        let (sum, rows) = fitted.fold((T::zero(), T::zero()), |(sum, rows), (value, _)| {
            (sum + *value, rows + T::one())
        });
        sum / rows.max(T::one())
    }

    fn fit_model(&self, directions: u8, lever_directions: u8) -> FitModel {
        match (directions, lever_directions) {
            (_, 1..) => FitModel::AffineAndLeverArm,
            (0, 0) => FitModel::Offset,
            _ if self.highest == FitModel::Gain || !self.complete => FitModel::Gain,
            _ => FitModel::Affine,
        }
    }

    fn residual_variance(&self, error: &RelativeError<T>, row: usize) -> T {
        RowResidual::new(error, self.stored, &self.layout, row).variance(self.pairs)
    }
}

#[cfg(test)]
mod tests;
