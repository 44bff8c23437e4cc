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

use nalgebra::{Matrix3, Vector3};

use crate::products::{
    congruent, matrix_product, of_columns, product, transposed_matrix_product, transposed_product, zeros,
};
use crate::real::{Real, count, real};
use crate::redundancy::fit::excitation::ExcitedDirections;
use crate::redundancy::fit::residual::{Layout, PairMoments, RowResidual};
use crate::redundancy::fit::rests::{RowPairs, WeighedRests};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::samples::pair::FORCE_CHANNELS;
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
    /// Axes that the sensor has.
    pub axes: [bool; 3],
    /// Noise of the primary.
    pub noise: PrimaryNoise<T>,
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

impl<T: Real> Fit<T> {
    /// Mean square of what this fit and one to other pairs are apart, over what their covariances allow for: one, unless
    /// residuals hang together for longer than a pair takes, as those of vibration do.
    pub fn disagreement(&self, other: &Self) -> T {
        let (mut sum, mut terms) = (T::zero(), T::zero());
        let mut compare = |apart: T, variance: T| {
            if variance > T::zero() {
                sum += apart * apart / variance;
                terms += T::one();
            }
        };
        let matrix = (self.error.matrix - other.error.matrix).data.0;
        for (i, (one, another)) in self.row_covariance.iter().zip(&other.row_covariance).enumerate() {
            for j in 0..3 {
                compare(matrix[j][i], one.data.0[j][j] + another.data.0[j][j]);
            }
        }
        let [bias] = (self.error.bias - other.error.bias).data.0;
        let [arm] = (self.error.lever_arm - other.error.lever_arm).data.0;
        let [one, another] = [self, other].map(|of| of.bias_sigma.data.0[0]);
        let arms = (self.lever_arm_covariance + other.lever_arm_covariance).data.0;
        for j in 0..3 {
            compare(bias[j], one[j] * one[j] + another[j] * another[j]);
            compare(arm[j], arms[j][j]);
        }
        sum / terms.max(T::one())
    }

    /// With every variance so many times as large.
    pub fn less_certain(mut self, times: T) -> Self {
        for covariance in &mut self.row_covariance {
            *covariance *= times;
        }
        self.lever_arm_covariance *= times;
        self.bias_sigma *= times.square_root();
        self
    }
}

/// M meets the lever arm in products, of which each pass leaves the square of what was wrong.
const PASSES: u32 = 3;

/// Neighbouring triangles share a window, which makes the variance of means 1 + 2/4 times that of independent ones
/// (docs/theory/redundancy.md, eq. 12).
const SHARED: f64 = 1.5; // eq. 12: kappa

/// A weighted sum of channels of a pair.
type ChannelSum<T, const TERMS: usize> = [(usize, T); TERMS];

/// The covariances a pass needs of a row, with the primary taken to where the lever arm is believed to put the secondary.
struct PassMoments<'a, 'b, T: Real> {
    problem: &'a FitProblem<'b, T>,
    /// Pairs, and rests as they count in this row.
    pairs: RowPairs<'a, T>,
    /// Change of the lever arm so far.
    change: Vector3<T>,
}

/// Row `i` of a matrix; nothing where it has none.
#[inline(never)]
fn row_of<T: Real>(matrix: &Matrix3<T>, i: usize) -> [T; 3] {
    core::array::from_fn(|l| matrix.get((i, l)).copied().unwrap_or(T::zero()))
}

/// Row `i` of the pairs (docs/theory/redundancy.md, eq. 7), for a given M: the channels of the lever are those of `M W`.
struct RowMoments<T: Real> {
    /// Covariance of the motion with what is not explained yet.
    motion: Vector3<T>,
    /// Covariance of the motion with the lever.
    motion_lever: Matrix3<T>,
    /// Covariance of the lever with what is not explained yet.
    lever: Vector3<T>,
    /// Covariance of the lever with itself.
    lever_lever: Matrix3<T>,
}

impl<T: Real> PassMoments<'_, '_, T> {
    fn lever_channel(&self, l: usize, k: usize) -> usize {
        // Where there is no lever, a channel there is not: its covariances are zero.
        let first = self.problem.layout.lever;
        first.map_or(FORCE_CHANNELS, |first| first + 3 * l + k)
    }

    /// Axis `j` of the motion at the secondary: `u + W change`.
    fn moved(&self, j: usize) -> ChannelSum<T, 4> {
        let [[x, y, z]] = self.change.data.0;
        let carried = |k: usize, change: T| (self.lever_channel(j, k), change);
        [(j, T::one()), carried(0, x), carried(1, y), carried(2, z)] // eq. 7: u'' = u' + R W delta
    }

    /// Column `k` of a row of M times W.
    fn lever(&self, row: &[T; 3], k: usize) -> ChannelSum<T, 3> {
        core::array::from_fn(|l| (self.lever_channel(l, k), row[l])) // eq. 7: (M_k R W)_i
    }

    /// Row `i` of what the secondary says beyond what is stored, with the lever arm believed: less `M_0 W change`.
    fn beyond(&self, i: usize) -> ChannelSum<T, 10> {
        let stored = row_of(&self.problem.stored.matrix, i);
        let [change] = self.change.data.0;
        core::array::from_fn(|term| match term.checked_sub(1) {
            None => (self.problem.layout.second + i, T::one()), // eq. 7: d_i
            Some(at) => {
                let (l, k) = (at / 3, at % 3);
                let weight = stored[l] * change[k];
                (self.lever_channel(l, k), -weight) // eq. 7: - (M_0 R W delta)_i
            }
        })
    }

    /// Terms that add nothing are left out, of which there are many: no lever arm was found yet, or none is looked for.
    fn covariance(&self, a: &[(usize, T)], b: &[(usize, T)]) -> T {
        let adds = |(channel, weight): &&(usize, T)| *channel < FORCE_CHANNELS && *weight != T::zero();
        let mut sum = T::zero();
        for (i, a) in a.iter().filter(adds) {
            for (j, b) in b.iter().filter(adds) {
                sum += *a * *b * self.pairs.covariance_of(*i, *j);
            }
        }
        sum
    }

    /// Covariance of the motion, less the primary's noise.
    fn motion(&self) -> Matrix3<T> {
        let all = Matrix3::from_fn(|i, j| self.covariance(&self.moved(i), &self.moved(j)));
        all - self.problem.noise.reading // eq. 10: Sigma
    }

    /// The primary's noise is in the motion and, through the stored M, in what is not explained.
    fn row(&self, m: &Matrix3<T>, i: usize) -> RowMoments<T> {
        let stored: [T; 3] = row_of(&self.problem.stored.matrix, i);
        let noise = product(&self.problem.noise.reading, &stored.into());
        let (m, beyond) = (&row_of(m, i), self.beyond(i));
        RowMoments {
            motion: noise + Vector3::from_fn(|j, _| self.covariance(&self.moved(j), &beyond)), // eq. 10: c_i
            motion_lever: Matrix3::from_fn(|j, k| self.covariance(&self.moved(j), &self.lever(m, k))), // eq. 8: A_i
            lever: Vector3::from_fn(|k, _| self.covariance(&self.lever(m, k), &beyond)), // eq. 8: g_i
            lever_lever: Matrix3::from_fn(|k, n| self.covariance(&self.lever(m, k), &self.lever(m, n))),
        }
    }
}

/// One pass of the ladder.
struct LadderPass<T: Real> {
    matrix: Matrix3<T>,
    lever_arm: Vector3<T>,
    excited: [ExcitedDirections<T>; 3],
    lever: ExcitedDirections<T>,
    motion_lever: [Matrix3<T>; 3],
}

impl<T: Real> FitProblem<'_, T> {
    /// Goes up the ladder as far as the motion excites it. `None` where numbers fail.
    pub fn solve(&self) -> Option<Fit<T>> {
        let mut pass = self.pass(&self.stored.matrix, &self.stored.lever_arm);
        for _ in 1..PASSES {
            pass = self.pass(&pass.matrix, &pass.lever_arm);
        }
        self.conclude(&pass)
    }

    /// A step of Gauss and Newton from `m` and `arm`.
    fn pass(&self, m: &Matrix3<T>, arm: &Vector3<T>) -> LadderPass<T> {
        let change = arm - self.stored.lever_arm;
        let rows: [RowMoments<T>; 3] = core::array::from_fn(|i| self.moments(i, change).row(m, i));
        let excited = core::array::from_fn(|i| self.excited(&self.moments(i, change).motion(), i));
        let lever = self.lever(&rows, &excited);
        let unexplained = self
            .present(&rows, &excited)
            .fold(zeros(), |sum, (row, excited)| {
                sum + row.lever
                    - transposed_product(&row.motion_lever, &product(&excited.inverse, &row.motion)) // eq. 8: g_i - A_i^T Sigma^+ c_i
            });
        let step = product(&lever.inverse, &unexplained); // eq. 8: s
        let changes: [Vector3<T>; 3] = core::array::from_fn(|i| {
            let (row, excited) = (&rows[i], &excited[i]);
            product(
                &excited.inverse,
                &(row.motion - product(&row.motion_lever, &step)),
            ) // eq. 9: Delta_i
        });
        LadderPass {
            matrix: self.stored.matrix + of_columns(changes).transpose(),
            lever_arm: arm + step,
            excited,
            lever,
            motion_lever: rows.map(|row| row.motion_lever),
        }
    }

    /// Of one row, worked out when asked for: those of three take a device half a kilobyte of stack.
    fn moments(&self, row: usize, change: Vector3<T>) -> PassMoments<'_, '_, T> {
        PassMoments {
            problem: self,
            pairs: self.row_pairs(row),
            change,
        }
    }

    #[inline(never)]
    fn row_pairs(&self, row: usize) -> RowPairs<'_, T> {
        RowPairs::new(self.pairs, self.layout, self.rests.as_ref(), row)
    }

    /// The directions along which row `i` of M may be fitted.
    fn excited(&self, motion: &Matrix3<T>, i: usize) -> ExcitedDirections<T> {
        let least = self.excitation * self.excitation;
        let complete = self.axes == [true; 3];
        match self.highest {
            _ if !self.axes[i] => ExcitedDirections::nothing(),
            Rung::Offset => ExcitedDirections::nothing(),
            Rung::Affine | Rung::AffineAndLeverArm if complete => ExcitedDirections::of(*motion, least),
            Rung::Gain | Rung::Affine | Rung::AffineAndLeverArm => {
                ExcitedDirections::along_axis(motion, i, least)
            }
        }
    }

    fn present<'c>(
        &'c self,
        rows: &'c [RowMoments<T>; 3],
        excited: &'c [ExcitedDirections<T>; 3],
    ) -> impl Iterator<Item = (&'c RowMoments<T>, &'c ExcitedDirections<T>)> {
        let all = rows.iter().zip(excited).zip(self.axes);
        all.filter(|(_, present)| *present).map(|(row, _)| row)
    }

    /// What the lever arm shows beyond what the motion explains: the Schur complement, less the primary's noise.
    fn lever(&self, rows: &[RowMoments<T>; 3], excited: &[ExcitedDirections<T>; 3]) -> ExcitedDirections<T> {
        let (Some(least), Rung::AffineAndLeverArm) = (self.lever_arm_excitation, self.highest) else {
            return ExcitedDirections::nothing();
        };
        let v = &self.noise.angular_acceleration;
        let noise = Matrix3::from_diagonal(&Vector3::new(v.y + v.z, v.z + v.x, v.x + v.y)); // eq. 10
        let complement = self.present(rows, excited).fold(-noise, |sum, (row, excited)| {
            sum + row.lever_lever
                - transposed_matrix_product(
                    &row.motion_lever,
                    &matrix_product(&excited.inverse, &row.motion_lever),
                ) // eq. 8: S
        });
        ExcitedDirections::of(complement, least * least)
    }

    fn conclude(&self, pass: &LadderPass<T>) -> Option<Fit<T>> {
        let excited = &pass.excited;
        let sums: [RowPairs<'_, T>; 3] = core::array::from_fn(|i| self.row_pairs(i));
        let motions: [Vector3<T>; 3] = core::array::from_fn(|i| Vector3::from_fn(|j, _| sums[i].mean_of(j)));
        // At row i of M W, as much of it as the rests leave.
        let arms: [Vector3<T>; 3] = core::array::from_fn(|i| {
            let lever = self.layout.lever.map_or(zeros(), |first| {
                Matrix3::from_fn(|l, k| sums[i].mean_of(first + 3 * l + k))
            });
            transposed_product(&lever, &Vector3::from(row_of(&pass.matrix, i)))
        });
        let stored = self.stored;
        let bias = stored.bias
            + Vector3::from_fn(|i, _| {
                let explained = Vector3::from(row_of(&(pass.matrix - stored.matrix), i)).dot(&motions[i])
                    + arms[i].dot(&(pass.lever_arm - stored.lever_arm));
                let change = sums[i].mean_of(self.layout.second + i) - explained;
                if self.axes[i] { change } else { T::zero() }
            });
        let error = RelativeError::new(pass.matrix, bias, pass.lever_arm)?;
        let directions = excited.iter().fold(0, |most, row| row.directions.max(most));
        let pairs = self.pairs.samples();
        let unknowns = 1 + u32::from(directions);
        let share = real::<T>(SHARED) / count(pairs.saturating_sub(unknowns).max(1)); // eq. 11: kappa / n
        let variance: [T; 3] = core::array::from_fn(|i| self.residual_variance(&error, i) * share);
        let [x, y, z] = variance;
        let lever_arm_covariance = pass.lever.inverse * ((x + y + z) * real(1.0 / 3.0)); // eq. 11: C_r
        let carried_by_lever: [Matrix3<T>; 3] =
            core::array::from_fn(|i| matrix_product(&excited[i].inverse, &pass.motion_lever[i]));
        let row_covariance: [Matrix3<T>; 3] = core::array::from_fn(|i| {
            let by_lever = congruent(&carried_by_lever[i], &lever_arm_covariance);
            excited[i].inverse * variance[i] + by_lever // eq. 11: cov Delta_i
        });
        let bias_sigma = Vector3::from_fn(|i, _| {
            let (motion, arm) = (motions[i], arms[i]);
            let across = -product(&matrix_product(&carried_by_lever[i], &lever_arm_covariance), &arm);
            let spread = motion.dot(&product(&row_covariance[i], &motion))
                + arm.dot(&product(&lever_arm_covariance, &arm));
            let of_mean = variance[i] * sums[i].variance_of_mean();
            (of_mean + spread + motion.dot(&across) * real(2.0))
                .max(T::zero())
                .square_root()
        });
        Some(Fit {
            error,
            rung: self.rung(directions, pass.lever.directions),
            directions,
            shown: core::array::from_fn(|i| excited[i].projection),
            row_covariance,
            bias_sigma,
            lever_arm_shown: pass.lever.projection,
            lever_arm_covariance,
            pairs,
        })
    }

    fn rung(&self, directions: u8, lever_directions: u8) -> Rung {
        match (directions, lever_directions) {
            (_, 1..) => Rung::AffineAndLeverArm,
            (0, 0) => Rung::Offset,
            _ if self.highest == Rung::Gain || self.axes != [true; 3] => Rung::Gain,
            _ => Rung::Affine,
        }
    }

    fn residual_variance(&self, error: &RelativeError<T>, row: usize) -> T {
        RowResidual::new(error, self.stored, &self.layout, row).variance(self.pairs)
    }
}

#[cfg(test)]
mod tests;
