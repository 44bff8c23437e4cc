//! Moments of one row of a fit: of the motion of the primary, of the lever, and of the readings of the
//! secondary minus the prediction of the stored error (docs/theory/redundancy.md, eq. 7 to 10).

use nalgebra::{Matrix3, Vector3};

use crate::products::product;
use crate::real::Real;
use crate::redundancy::components::dot;
use crate::redundancy::fit::FitProblem;
use crate::redundancy::fit::residual::{PairMoments, covariance_of};

/// Channels of a row: motion 3, lever 9, row by row, and reading of the secondary minus the stored prediction.
const CHANNELS: usize = 13;

/// First channel of the lever.
const LEVER: usize = 3;

/// Channel of the secondary.
const BEYOND: usize = 12;

/// Covariances of the channels; those of their sums later take the places of the first of them.
type Covariances<T> = [[T; CHANNELS]; CHANNELS];

/// Current estimate of a row, whose values weight the channels in the sums of a step.
pub(super) struct EstimatedRow<T: Real> {
    /// Number of the row.
    pub number: usize,
    /// Current row of M.
    pub matrix: Vector3<T>,
    /// Stored row of M.
    pub stored: Vector3<T>,
    /// Current lever arm minus the stored one, m.
    pub change: Vector3<T>,
}

/// Covariances of a row, for a given M and lever arm.
pub(super) struct RowMoments<T: Real> {
    /// Covariance of the motion, minus the noise of the primary.
    pub motion: Matrix3<T>,
    /// Covariance of the motion with the unexplained readings.
    pub motion_beyond: Vector3<T>,
    /// Covariance of the motion with the lever.
    pub motion_lever: Matrix3<T>,
    /// Covariance of the lever with the unexplained readings.
    pub lever_beyond: Vector3<T>,
    /// Covariance of the lever with itself.
    pub lever: Matrix3<T>,
    /// Variance of the unexplained readings.
    pub beyond: T,
}

impl<T: Real> RowMoments<T> {
    /// Computes the moments of a row.
    #[inline(never)]
    pub fn of(problem: &FitProblem<'_, T>, row: &EstimatedRow<T>) -> Self {
        let mut moments = [[T::zero(); CHANNELS]; CHANNELS];
        problem.covariances(row.number, &mut moments);
        // Without a lever arm to estimate, a sum equals its channel.
        if problem.finds_lever_arm() {
            row.sum(&mut moments);
        }
        Self::out_of(&moments, &problem.noise.reading, &row.stored)
    }

    /// Extracts the moments from covariances of the sums. The noise of the primary is in the motion and,
    /// through the stored M, in the unexplained readings.
    #[inline(never)]
    fn out_of(moments: &Covariances<T>, noise: &Matrix3<T>, stored: &Vector3<T>) -> Self {
        let at = |a: usize, b: usize| {
            let moment = moments.get(a).and_then(|moments| moments.get(b));
            moment.copied().unwrap_or(T::zero())
        };
        Self {
            motion: Matrix3::from_fn(at) - noise, // eq. 10: Sigma
            motion_beyond: product(noise, stored) + Vector3::from_fn(|j, _| at(j, BEYOND)), // eq. 10: c_i
            motion_lever: Matrix3::from_fn(|j, k| at(j, LEVER + k)), // eq. 8: A_i
            lever_beyond: Vector3::from_fn(|k, _| at(LEVER + k, BEYOND)), // eq. 8: g_i
            lever: Matrix3::from_fn(|k, n| at(LEVER + k, LEVER + n)),
            beyond: at(BEYOND, BEYOND),
        }
    }
}

impl<T: Real> EstimatedRow<T> {
    /// Replaces channels by sums: motion at the estimated place of the secondary 3, row of M times lever 3, and reading of
    /// the secondary minus the stored prediction there.
    fn sums(&self, channels: &mut [T; CHANNELS]) {
        let [mx, my, mz, xx, xy, xz, yx, yy, yz, zx, zy, zz, beyond] = channels;
        let (x, y, z) = (
            Vector3::new(*xx, *xy, *xz),
            Vector3::new(*yx, *yy, *yz),
            Vector3::new(*zx, *zy, *zz),
        );
        let change = &self.change;
        let arm = Vector3::new(dot(&x, change), dot(&y, change), dot(&z, change));
        *mx += arm.x; // eq. 7: u'' = u' + R W delta
        *my += arm.y;
        *mz += arm.z;
        *beyond -= dot(&self.stored, &arm); // eq. 7: d_i - (M_0 R W delta)_i
        let m = &self.matrix;
        *xx = x.x * m.x + y.x * m.y + z.x * m.z; // eq. 7: (M_k R W)_i
        *xy = x.y * m.x + y.y * m.y + z.y * m.z;
        *xz = x.z * m.x + y.z * m.y + z.z * m.z;
    }

    /// Replaces covariances of channels by those of the sums: rows first, then columns.
    #[inline(never)]
    fn sum(&self, covariances: &mut Covariances<T>) {
        covariances.iter_mut().for_each(|row| self.sums(row));
        for j in (0..LEVER + 3).chain([BEYOND]) {
            let mut column = [T::zero(); CHANNELS];
            for (value, row) in column.iter_mut().zip(covariances.iter()) {
                *value = row.get(j).copied().unwrap_or(T::zero());
            }
            self.sums(&mut column);
            for (value, row) in column.iter().zip(covariances.iter_mut()) {
                if let Some(place) = row.get_mut(j) {
                    *place = *value;
                }
            }
        }
    }
}

impl<T: Real> FitProblem<'_, T> {
    /// Covariances of the channels of row `i`; zero for a lever that is not estimated.
    #[inline(never)]
    fn covariances(&self, i: usize, covariances: &mut Covariances<T>) {
        let mut pairs = self.row_pairs(i);
        pairs.take_off_drift();
        let channels = if self.finds_lever_arm() { BEYOND } else { LEVER };
        let beyond = self.layout.second + i;
        for (channel, row) in covariances.iter_mut().enumerate().take(channels) {
            row[BEYOND] = covariance_of(&pairs, channel, beyond);
            if let Some(later) = row.get_mut(channel..channels) {
                pairs.covariances_of(channel, channel, later);
            }
        }
        covariances[BEYOND][BEYOND] = covariance_of(&pairs, beyond, beyond);
        for row in 1..CHANNELS {
            for column in 0..row {
                covariances[row][column] = covariances[column][row];
            }
        }
    }
}
