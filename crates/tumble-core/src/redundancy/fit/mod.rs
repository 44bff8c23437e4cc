//! The ladder: offsets, gains, matrix, lever arm, from the joint moments of pairs and nothing else.
//!
//! What is fitted is what the secondary says beyond the stored error: small numbers, of which single precision keeps
//! enough digits.
//!
//! Along directions that the motion did not excite, the matrix and the lever arm stay what they were. All systems
//! solved are 3 x 3: the rows of M share the covariance of the motion, and the lever arm remains by Schur complement
//! (docs/theory/redundancy.md, eq. 5 to 11).

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
use crate::redundancy::fit::row_moments::{BelievedRow, RowMoments};
use crate::redundancy::relative_error::{ERROR_NUMBERS, RelativeError};
use crate::redundancy::settings::Rung;

/// Variance of the primary's noise in a pair, measured at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimaryNoise<T: Real> {
    /// Covariance of its reading, in the axes of the secondary, (m/s^2)^2 or (rad/s)^2.
    pub reading: Matrix3<T>,
    /// Variance of each axis of its angular acceleration, (rad/s^2)^2.
    pub angular_acceleration: Vector3<T>,
}

/// What is to be fitted to what.
pub struct FitProblem<'a, T: Real> {
    /// The pairs.
    pub pairs: &'a dyn PairMoments<T>,
    /// Rests that count beside them; `None` where the pairs are to stand alone.
    pub rests: Option<WeighedRests<'a, T>>,
    /// Their channels.
    pub layout: Layout,
    /// Axes of the sensor that can be told from those of the primary.
    pub axes: [bool; 3],
    /// Whether the sensor has all three.
    pub complete: bool,
    /// Noise of the primary.
    pub noise: &'a PrimaryNoise<T>,
    /// What is stored, and stays where nothing is shown.
    pub stored: &'a RelativeError<T>,
    /// Top of the ladder.
    pub highest: Rung,
    /// Standard deviation of the motion along a direction from which on it counts, m/s^2 or rad/s.
    pub excitation: T,
    /// The same for the lever arm, m/s^2 per m; `None` where the lever arm is known.
    pub lever_arm_excitation: Option<T>,
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit<T: Real> {
    /// The error.
    pub error: RelativeError<T>,
    /// How far up the ladder.
    pub rung: Rung,
    /// Directions along which M was fitted.
    pub directions: u8,
    /// For each row of M, the projection onto the directions along which it was fitted.
    pub shown: [Matrix3<T>; 3],
    /// Covariance of each row of M along these.
    pub row_covariance: [Matrix3<T>; 3],
    /// 1-sigma of the bias, given the parts of M that were left as they were.
    pub bias_sigma: Vector3<T>,
    /// The projection onto the directions along which the lever arm was fitted.
    pub lever_arm_shown: Matrix3<T>,
    /// Covariance of the lever arm along these, m^2.
    pub lever_arm_covariance: Matrix3<T>,
    /// Pairs fitted to.
    pub pairs: u32,
}

/// Variances of the [numbers](RelativeError::numbers) of an error; zero for what a fit left as it was.
pub type ErrorVariances<T> = [T; ERROR_NUMBERS];

/// Mean square of what two fits to different pairs are apart, over what their variances allow for: one, unless residuals
/// hang together for longer than a pair takes, as those of vibration do.
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
    /// Nothing found: a place for one.
    #[inline(never)]
    pub fn none() -> Self {
        Self {
            error: RelativeError::none(),
            rung: Rung::Offset,
            directions: 0,
            shown: [zeros(); 3],
            row_covariance: [zeros(); 3],
            bias_sigma: zeros(),
            lever_arm_shown: zeros(),
            lever_arm_covariance: zeros(),
            pairs: 0,
        }
    }

    /// Its variances.
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

    /// Makes every variance so many times as large.
    pub fn weaken(&mut self, times: T) {
        for covariance in &mut self.row_covariance {
            *covariance *= times;
        }
        self.lever_arm_covariance *= times;
        self.bias_sigma *= times.square_root();
    }
}

/// What a step of a fit led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LadderState {
    /// Another step would lead elsewhere.
    GoesOn,
    /// A fit was found.
    Found,
    /// Numbers fail.
    Unsolvable,
}

/// Most steps of Gauss and Newton: M meets the lever arm in products, of which each step leaves the square of what was wrong.
const STEPS: u8 = 3;

/// Square of a step that is none, in sigmas (docs/theory/redundancy.md, eq. 23).
const SETTLED: f64 = 1e-4;

/// Square of how far a believed lever arm may be from the directions that are shown, over that of how far it is from the stored
/// one: more than single precision leaves of none.
const STRAYED: f64 = 1e-8;

/// Neighbouring triangles share a window, which makes the variance of means 1 + 2/4 times that of independent ones
/// (docs/theory/redundancy.md, eq. 12).
const SHARED: f64 = 1.5; // eq. 12: kappa

/// What one row shows, given M and the lever arm as they are believed.
struct RowStep<T: Real> {
    excited: ExcitedDirections<T>,
    /// What the motion explains of what is not explained yet.
    explained: Vector3<T>,
    /// What the motion explains of the lever.
    carried: Matrix3<T>,
}

/// The rows of a matrix.
fn rows_of<T: Real>(matrix: &Matrix3<T>) -> [Vector3<T>; 3] {
    columns(&matrix.transpose())
}

/// What the rows show of the lever arm, in sums over them.
struct LeverSums<T: Real> {
    /// What the lever shows beyond what the motion explains.
    complement: Matrix3<T>,
    /// Covariance of the lever.
    lever: Matrix3<T>,
    /// What the motion does not explain.
    unexplained: Vector3<T>,
    /// Variance that the motion leaves.
    left: T,
}

/// Means of what one row relates.
struct RowMeans<T: Real> {
    motion: Vector3<T>,
    /// At the row of M times the lever, as much of it as the rests leave.
    lever: Vector3<T>,
    /// Of what the secondary says beyond what is stored.
    beyond: T,
    /// Variance of that mean, over that of the mean of the pairs alone.
    variance: T,
}

/// Where the ladder has led so far.
struct Ladder<T: Real> {
    matrix: Matrix3<T>,
    lever_arm: Vector3<T>,
    rows: [RowStep<T>; 3],
    lever: ExcitedDirections<T>,
    /// Whether another step would lead nowhere else.
    settled: bool,
}

impl<T: Real> Ladder<T> {
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
    /// Goes up the ladder, as far as the motion excites it, by a step of Gauss and Newton from `near`, which is taken along.
    /// `taken` were before.
    #[inline(never)]
    pub fn go_on(&self, near: &mut RelativeError<T>, taken: u8, found: &mut Fit<T>) -> LadderState {
        let mut ladder = Ladder::from(near);
        self.step(&mut ladder);
        (near.matrix, near.lever_arm) = (ladder.matrix, ladder.lever_arm);
        if !ladder.settled && taken.saturating_add(1) < STEPS {
            return LadderState::GoesOn;
        }
        match self.conclude(&ladder, found) {
            Some(()) => LadderState::Found,
            None => LadderState::Unsolvable,
        }
    }

    /// A step of Gauss and Newton.
    #[inline(never)]
    fn step(&self, ladder: &mut Ladder<T>) {
        let change = ladder.lever_arm - self.stored.lever_arm;
        let v = &self.noise.angular_acceleration;
        let noise = diagonal(v.y + v.z, v.z + v.x, v.x + v.y); // eq. 10
        let mut sums = LeverSums {
            complement: -noise,
            lever: zeros(),
            unexplained: zeros(),
            left: T::zero(),
        };
        let matrices = rows_of(&ladder.matrix)
            .into_iter()
            .zip(rows_of(&self.stored.matrix));
        for ((number, row), (matrix, stored)) in ladder.rows.iter_mut().enumerate().zip(matrices) {
            let believed = BelievedRow {
                number,
                matrix,
                stored,
                change,
            };
            let moments = RowMoments::of(self, &believed);
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
        self.excite_lever(&sums.complement, &mut ladder.lever);
        self.take_step(ladder, &sums);
    }

    /// Takes the step that leaves least unexplained.
    #[inline(never)]
    fn take_step(&self, ladder: &mut Ladder<T>, sums: &LeverSums<T>) {
        let change = ladder.lever_arm - self.stored.lever_arm;
        let step = product(&ladder.lever.inverse, &sums.unexplained); // eq. 8: s
        let changes = ladder.rows.each_ref();
        let changes = changes.map(|row| row.explained - product(&row.carried, &step)); // eq. 9: Delta_i
        let matrix = self.stored.matrix + of_columns(changes).transpose();
        // Of what the step moved at the secondary, the next takes what M changed times it.
        let moved = step.dot(&product(&sums.lever, &step));
        let next = squared_matrix(&(matrix - ladder.matrix)) * moved;
        let left = sums.left - step.dot(&sums.unexplained);
        // Along directions that show nothing it stays what is stored, whatever was believed.
        let shown = product(&ladder.lever.projection, &change);
        let strayed = squared(&(change - shown)) > squared(&change) * real(STRAYED);
        // redundancy.md, eq. 23
        ladder.settled = !strayed && next <= left * self.share(0) * real(SETTLED / 3.0);
        ladder.matrix = matrix;
        ladder.lever_arm = self.stored.lever_arm + shown + step;
    }

    fn row_pairs(&self, row: usize) -> RowPairs<'_, T> {
        RowPairs::new(self.pairs, self.layout, self.rests.as_ref(), row)
    }

    /// What the mean of the pairs varies, over what a pair does, with so many unknowns of a row.
    fn share(&self, unknowns: u32) -> T {
        real::<T>(SHARED) / count(self.pairs.samples().saturating_sub(unknowns).max(1)) // eq. 11: kappa / n
    }

    /// The directions along which row `i` of M may be fitted.
    fn excited(&self, motion: &Matrix3<T>, i: usize) -> ExcitedDirections<T> {
        let least = self.excitation * self.excitation;
        match self.highest {
            _ if self.axes.get(i) != Some(&true) => ExcitedDirections::nothing(),
            Rung::Offset => ExcitedDirections::nothing(),
            Rung::Affine | Rung::AffineAndLeverArm if self.complete => ExcitedDirections::of(*motion, least),
            Rung::Gain | Rung::Affine | Rung::AffineAndLeverArm => {
                ExcitedDirections::along_axis(motion, i, least)
            }
        }
    }

    fn finds_lever_arm(&self) -> bool {
        self.lever_arm_excitation.is_some() && self.highest == Rung::AffineAndLeverArm
    }

    /// The directions along which the lever arm shows beyond what the motion explains.
    fn excite_lever(&self, complement: &Matrix3<T>, excited: &mut ExcitedDirections<T>) {
        if let Some(least) = self.lever_arm_excitation.filter(|_| self.finds_lever_arm()) {
            *excited = ExcitedDirections::of(*complement, least * least);
        }
    }

    /// Means of row `i`, with `m` the row of M that was found.
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
    fn conclude(&self, ladder: &Ladder<T>, fit: &mut Fit<T>) -> Option<()> {
        let Ladder {
            matrix,
            lever_arm,
            rows,
            ..
        } = ladder;
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
        fit.rung = self.rung(fit.directions, ladder.lever.directions);
        fit.pairs = self.pairs.samples();
        let share = self.share(1 + u32::from(fit.directions));
        let variance = [0, 1, 2].map(|i| self.residual_variance(&fit.error, i) * share);
        fit.lever_arm_shown = ladder.lever.projection;
        fit.lever_arm_covariance = ladder.lever.inverse * self.mean_of_rows(&variance); // eq. 11: C_r
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

    /// Mean over the rows that are fitted.
    fn mean_of_rows(&self, values: &[T; 3]) -> T {
        let fitted = values.iter().zip(self.axes).filter(|(_, fitted)| *fitted);
        let (sum, rows) = fitted.fold((T::zero(), T::zero()), |(sum, rows), (value, _)| {
            (sum + *value, rows + T::one())
        });
        sum / rows.max(T::one())
    }

    fn rung(&self, directions: u8, lever_directions: u8) -> Rung {
        match (directions, lever_directions) {
            (_, 1..) => Rung::AffineAndLeverArm,
            (0, 0) => Rung::Offset,
            _ if self.highest == Rung::Gain || !self.complete => Rung::Gain,
            _ => Rung::Affine,
        }
    }

    fn residual_variance(&self, error: &RelativeError<T>, row: usize) -> T {
        RowResidual::new(error, self.stored, &self.layout, row).variance(self.pairs)
    }
}

#[cfg(test)]
mod tests;
