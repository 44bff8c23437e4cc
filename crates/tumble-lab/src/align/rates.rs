//! Clock and rotation between two units, from their angular rates alone.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};
use tumble_core::eigen;
use tumble_core::rotation::{cross_matrix, inverse_left_jacobian};
use tumble_core::turntable::clock::LARGEST_SKEW;

use crate::align::grid::{Grid, RelativeClock, TrianglePair};
use crate::align::response::{ResponseTerms, is_shown, shared_noise};
use crate::align::robust::{
    GaussianPrior, ResidualRow, UnknownStep, covariance, covariance_of_neglected, covariance_of_shared_noise,
    scale_of, step,
};
use crate::align::samples::{UnitSamples, rate_of};
use crate::align::settings::AlignSettings;

/// Rotation, stretch, bias, offset and skew of the clock, second order of the response.
const UNKNOWNS: usize = 15;
const STRETCH: usize = 3;
const BIAS: usize = 9;
const OFFSET: usize = 12;
const SKEW: usize = 13;
const SECOND: usize = 14;

/// Unknowns that may be left out of the fit: stretch, and second order of the response.
const NEGLECTED: usize = 7;

const ROUNDS: usize = 20;
/// Changes of rotation, rad, and offset, s, after which another round is not worth it.
const SETTLED: (f64, f64) = (1e-7, 1e-8);

/// Rates about an axis count as seen where their energy is so many times that of noise.
pub const ABOVE_NOISE: f64 = 10.0;

/// The same for scale: noise in what is stretched makes it look shrunk, by the inverse of this.
const STRETCH_ABOVE_NOISE: f64 = 100.0;

/// Inverse variance, 1/rad^2 or 1/m^2, with which a direction that nothing shows is held where it is.
pub const HELD: f64 = 1e12;

/// 1-sigma of a bias before any data, rad/s: no sensor is so bad.
const LARGEST_BIAS: f64 = 1.0;
/// 1-sigma of a skew before any data where there is only one clock.
const NO_SKEW: f64 = 1e-12;

/// Unknowns that a log does not change: rotation and offset.
const CONSTANT: [usize; 4] = [0, 1, 2, OFFSET];

/// Unknowns that have other values from some time on.
#[derive(Clone, Copy, Debug)]
pub struct Changed<const M: usize> {
    /// Time of the first pair that has them, s of the primary's clock.
    pub time: f64,
    /// Later values less those before.
    pub size: SVector<f64, M>,
}

impl<const M: usize> Changed<M> {
    /// The step with its time, that of the first pair of its block.
    pub(super) fn at(pairs: &[TrianglePair], step: UnknownStep<M>) -> Self {
        let first = pairs.partition_point(|pair| pair.block < step.block);
        Self {
            time: pairs.get(first).map_or(f64::NAN, |pair| pair.time),
            size: step.size,
        }
    }
}

/// Estimates from the rates of two units.
#[derive(Clone, Debug)]
pub struct RatesFit {
    /// `secondary_from_primary`.
    pub rotation: Rotation3<f64>,
    /// Covariance of a small rotation that follows it, secondary's frame, rad^2: none about what is not seen,
    /// where the rotation is held, until [`RatesFit::open`] has put it there.
    pub rotation_covariance: Matrix3<f64>,
    /// Unit vectors, secondary's frame, about which the rates do not show the rotation.
    pub unseen: Vec<Vector3<f64>>,
    /// S of `M = (1 + S) R`: differences in scale and cross-axis sensitivity, symmetric where all of it is seen.
    pub stretch: Matrix3<f64>,
    /// Bias of the secondary less that of the primary as the secondary has it, rad/s.
    pub bias: Vector3<f64>,
    /// Its covariance, (rad/s)^2.
    pub bias_covariance: Matrix3<f64>,
    /// Clock.
    pub clock: RelativeClock,
    /// 1-sigma of offset, s, and of skew.
    pub clock_sigma: (f64, f64),
    /// Step of rotation, rad about the secondary's axes, and offset, s, in the course of the log.
    pub changed: Option<Changed<4>>,
    /// 1-sigma of a component of a residual, rad/s.
    pub scale: f64,
    /// 1-sigma of a component of the difference of angular accelerations, rad/s^2.
    pub slope_scale: f64,
    /// Minus twice the logarithm of the likelihood.
    pub deviance: f64,
    /// Pairs, at the clock found.
    pub pairs: Vec<TrianglePair>,
}

impl RatesFit {
    /// Widens all that was found by a factor on the variances.
    pub(super) fn widen(&mut self, by: f64) {
        self.rotation_covariance *= by;
        self.bias_covariance *= by;
        self.clock_sigma.0 *= by.sqrt();
        self.clock_sigma.1 *= by.sqrt();
    }

    /// Rotation vector, rad, and its covariance (docs/theory/align.md, eq. 15).
    pub fn rotation_vector(&self) -> (Vector3<f64>, Matrix3<f64>) {
        let vector = self.rotation.scaled_axis();
        let jacobian = inverse_left_jacobian(&vector);
        (vector, jacobian * self.rotation_covariance * jacobian.transpose()) // eq. 15
    }

    /// Turns the secondary about one of its axes, with the bias of the primary that it sees turned.
    pub fn turn(&mut self, axis: &Vector3<f64>, angle: f64) {
        let turn = Rotation3::new(axis * angle);
        let mean = self.mean_rate();
        self.bias += mean - turn * mean;
        self.rotation = turn * self.rotation;
    }

    /// Adds a variance, rad^2, about one of the secondary's axes: to rotation, and to the bias that follows from it.
    pub fn open(&mut self, axis: &Vector3<f64>, variance: f64) {
        let influence = axis.cross(&self.mean_rate());
        self.rotation_covariance += axis * axis.transpose() * variance;
        self.bias_covariance += influence * influence.transpose() * variance;
    }

    /// Mean rate of the primary, in the secondary's axes, rad/s.
    fn mean_rate(&self) -> Vector3<f64> {
        #[allow(clippy::cast_precision_loss)]
        let share = 1.0 / self.pairs.len().max(1) as f64;
        let rates = self.pairs.iter().map(|pair| rate_of(&pair.primary.mean));
        self.rotation * rates.sum::<Vector3<f64>>() * share
    }
}

/// The six unknowns of a symmetric matrix as entries (row, column).
pub const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

struct RateUnknowns {
    rotation: Rotation3<f64>,
    stretch: SVector<f64, 6>,
    /// Leaves of a vector what lies along directions whose stretch the rates show.
    stretchable: Matrix3<f64>,
    bias: Vector3<f64>,
    clock: RelativeClock,
    /// Second order of the response, s^2.
    second: f64,
    /// True if the motion shows the second order of the response.
    bends: bool,
}

/// Fits by Gauss and Newton, from a rotation and a clock that are roughly right (docs/theory/align.md, eq. 6, 7).
pub fn fit(
    grid: &Grid,
    secondary: &UnitSamples<'_>,
    rotation: Rotation3<f64>,
    clock: RelativeClock,
    settings: &AlignSettings,
) -> Option<RatesFit> {
    let mut guess = RateUnknowns {
        rotation,
        stretch: SVector::zeros(),
        stretchable: Matrix3::identity(),
        bias: Vector3::zeros(),
        clock,
        second: 0.0,
        bends: true,
    };
    let mut pairs = grid.pairs(secondary, &guess.clock);
    guess.bias = guess.mean_residual(&pairs);
    guess.settle(&mut pairs, &clock, grid, secondary, settings)?;
    let scale = guess.scale(&pairs);
    if !guess.bends_at(&pairs, scale, grid.length) {
        (guess.bends, guess.second) = (false, 0.0);
        guess.settle(&mut pairs, &clock, grid, secondary, settings)?;
    }
    guess.finish(&clock, pairs, grid, settings)
}

impl RateUnknowns {
    /// Rounds until nothing changes; the secondary is averaged anew in each.
    fn settle(
        &mut self,
        pairs: &mut Vec<TrianglePair>,
        start: &RelativeClock,
        grid: &Grid,
        secondary: &UnitSamples<'_>,
        settings: &AlignSettings,
    ) -> Option<()> {
        for _ in 0..ROUNDS {
            let scale = self.scale(pairs);
            self.stretchable = self.stretchable_at(pairs, scale);
            let row = |k: usize| self.row(&pairs[k]);
            let unseen = self.unseen(pairs, scale);
            let prior = self.prior(start, &unseen, grid.length, settings);
            let next = step(pairs.len(), row, &prior)?;
            self.change(&next.change, grid.length);
            *pairs = grid.pairs(secondary, &self.clock);
            if next.change.fixed_rows::<3>(0).norm() < SETTLED.0 && next.change[OFFSET].abs() < SETTLED.1 {
                break;
            }
        }
        Some(())
    }

    fn matrix(&self) -> Matrix3<f64> {
        self.stretched() * self.rotation
    }

    fn stretched(&self) -> Matrix3<f64> {
        Matrix3::identity() + symmetric(&self.stretch) * self.stretchable
    }

    fn scale(&self, pairs: &[TrianglePair]) -> f64 {
        scale_of(pairs.iter().map(|pair| self.row(pair).1))
    }

    fn stretchable_at(&self, pairs: &[TrianglePair], scale: f64) -> Matrix3<f64> {
        let rates = pairs
            .iter()
            .map(|pair| self.rotation * rate_of(&pair.primary.mean));
        directions_above_noise(rates, scale)
    }

    fn mean_residual(&self, pairs: &[TrianglePair]) -> Vector3<f64> {
        let residuals = pairs.iter().map(|pair| self.row(pair).1);
        #[allow(clippy::cast_precision_loss)]
        let share = 1.0 / pairs.len().max(1) as f64;
        residuals.sum::<Vector3<f64>>() * share
    }

    /// Mean second derivative of what both units measure of the secondary's rate (docs/theory/align.md, eq. 21).
    fn curvature(&self, pair: &TrianglePair) -> Vector3<f64> {
        let ours = self.matrix() * rate_of(&pair.primary.curvature);
        (rate_of(&pair.secondary.curvature) + ours) * 0.5 // eq. 21
    }

    /// Second order of the response; the delay of a gyroscope's filter is part of the offset.
    fn response(&self) -> ResponseTerms {
        ResponseTerms {
            second: self.second,
            third: 0.0,
        }
    }

    /// 1-sigma of the second order before any data, s^2.
    fn second_sigma(&self) -> f64 {
        self.response().sigma(0.0).0 // eq. 20
    }

    fn bends_at(&self, pairs: &[TrianglePair], scale: f64, window: f64) -> bool {
        let sigma = self.response().shown_from(0.0);
        is_shown(
            pairs.iter().map(|pair| self.curvature(pair)),
            scale,
            window,
            sigma,
        )
    }

    fn row(&self, pair: &TrianglePair) -> ResidualRow<UNKNOWNS> {
        let half = 0.5 * self.second;
        let turned = self.rotation * (rate_of(&pair.primary.mean) + rate_of(&pair.primary.curvature) * half);
        let stretched = self.stretched();
        let predicted = stretched * turned + self.bias + rate_of(&pair.secondary.curvature) * half; // eq. 6, 21
        let slope = rate_of(&pair.secondary.slope);
        let mut design = SMatrix::<f64, 3, UNKNOWNS>::zeros();
        design
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(-stretched * cross_matrix(&turned))); // eq. 6: d phi
        set_stretch(&mut design, STRETCH, &(self.stretchable * turned)); // eq. 6: dS
        design
            .fixed_view_mut::<3, 3>(0, BIAS)
            .copy_from(&Matrix3::identity()); // eq. 6: db
        design.set_column(OFFSET, &slope); // eq. 6: d tau
        design.set_column(SKEW, &(slope * (pair.time - self.clock.reference))); // eq. 6: d kappa
        if self.bends {
            design.set_column(SECOND, &self.curvature(pair)); // eq. 21: d gamma
        }
        (design, rate_of(&pair.secondary.mean) - predicted)
    }

    /// Derivative by the stretch and second order of the response that are not fitted, for they act on little more than noise.
    fn neglected(&self, pair: &TrianglePair) -> SMatrix<f64, 3, NEGLECTED> {
        let turned = self.rotation * rate_of(&pair.primary.mean);
        let mut design = SMatrix::<f64, 3, NEGLECTED>::zeros();
        set_stretch(&mut design, 0, &(turned - self.stretchable * turned));
        if !self.bends {
            design.set_column(NEGLECTED - 1, &self.curvature(pair));
        }
        design
    }

    /// Axes of the secondary about which only noise would show the rotation.
    fn unseen(&self, pairs: &[TrianglePair], scale: f64) -> Vec<Vector3<f64>> {
        #[allow(clippy::cast_precision_loss)]
        let share = 1.0 / pairs.len().max(1) as f64;
        let rates = || {
            pairs
                .iter()
                .map(|pair| self.rotation * rate_of(&pair.primary.mean))
        };
        let mean = rates().sum::<Vector3<f64>>() * share;
        let spread: Matrix3<f64> = rates().map(|w| (w - mean) * (w - mean).transpose() * share).sum();
        let information = Matrix3::identity() * spread.trace() - spread;
        directions_below(&information, ABOVE_NOISE * 2.0 * scale * scale)
    }

    fn prior(
        &self,
        start: &RelativeClock,
        unseen: &[Vector3<f64>],
        window: f64,
        settings: &AlignSettings,
    ) -> GaussianPrior<UNKNOWNS> {
        let mut sigma = SVector::<f64, UNKNOWNS>::repeat(1.0);
        sigma
            .fixed_rows_mut::<6>(STRETCH)
            .copy_from(&settings.stretch_sigma());
        sigma.fixed_rows_mut::<3>(BIAS).fill(LARGEST_BIAS);
        sigma[OFFSET] = 2.0 * window;
        sigma[SKEW] = if settings.one_clock { NO_SKEW } else { LARGEST_SKEW };
        sigma[SECOND] = self.second_sigma();
        let mut missing = SVector::<f64, UNKNOWNS>::zeros();
        missing[SECOND] = -self.second;
        missing.fixed_rows_mut::<6>(STRETCH).copy_from(&-self.stretch);
        missing.fixed_rows_mut::<3>(BIAS).copy_from(&-self.bias);
        missing[OFFSET] = start.offset - self.clock.offset;
        missing[SKEW] = start.skew - self.clock.skew;
        let mut precision = SMatrix::from_diagonal(&sigma.map(|sigma| 1.0 / (sigma * sigma)));
        for axis in unseen {
            let mut rotation = precision.fixed_view_mut::<3, 3>(0, 0);
            rotation += axis * axis.transpose() * HELD;
        }
        GaussianPrior { precision, missing }
    }

    fn change(&mut self, by: &SVector<f64, UNKNOWNS>, window: f64) {
        self.rotation = Rotation3::new(by.fixed_rows::<3>(0).into_owned()) * self.rotation;
        self.rotation.renormalize();
        self.stretch += by.fixed_rows::<6>(STRETCH);
        self.bias += by.fixed_rows::<3>(BIAS);
        self.clock.offset += by[OFFSET].clamp(-window, window);
        self.clock.skew += by[SKEW];
        self.second += by[SECOND];
    }

    fn finish(
        self,
        start: &RelativeClock,
        pairs: Vec<TrianglePair>,
        grid: &Grid,
        settings: &AlignSettings,
    ) -> Option<RatesFit> {
        let row = |k: usize| self.row(&pairs[k]);
        let scale = self.scale(&pairs);
        let unseen = self.unseen(&pairs, scale);
        let prior = self.prior(start, &unseen, grid.length, settings);
        let deviance = step(pairs.len(), row, &prior)?.deviance;
        let neglected = |k: usize| self.neglected(&pairs[k]);
        let sigma = settings.stretch_sigma().push(self.second_sigma());
        let spread = covariance(pairs.len(), row, |k| pairs[k].block, scale, &prior, CONSTANT)?;
        let mut covariance =
            spread.covariance + covariance_of_neglected(pairs.len(), row, neglected, scale, &prior, &sigma)?;
        if self.bends {
            let shared = 3.0 * shared_noise(scale, grid.length);
            covariance += covariance_of_shared_noise(pairs.len(), row, SECOND, shared, scale, &prior)?;
        }
        let matrix = self.matrix();
        let slopes = pairs
            .iter()
            .map(|pair| rate_of(&pair.secondary.slope) - matrix * rate_of(&pair.primary.slope));
        Some(RatesFit {
            rotation: self.rotation,
            rotation_covariance: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
            unseen,
            stretch: self.stretched() - Matrix3::identity(),
            bias: self.bias,
            bias_covariance: covariance.fixed_view::<3, 3>(BIAS, BIAS).into_owned(),
            clock: self.clock,
            clock_sigma: (
                covariance[(OFFSET, OFFSET)].sqrt(),
                covariance[(SKEW, SKEW)].sqrt(),
            ),
            changed: spread.step.map(|step| Changed::at(&pairs, step)),
            scale,
            slope_scale: scale_of(slopes),
            deviance,
            pairs,
        })
    }
}

/// The symmetric matrix of six entries.
pub fn symmetric(entries: &SVector<f64, 6>) -> Matrix3<f64> {
    let mut matrix = Matrix3::zeros();
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        matrix[(i, j)] = entries[k];
        matrix[(j, i)] = entries[k];
    }
    matrix
}

/// Writes the derivative of `S v` by the six entries of S.
pub fn set_stretch<const N: usize>(design: &mut SMatrix<f64, 3, N>, column: usize, v: &Vector3<f64>) {
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        design[(i, column + k)] = v[j];
        design[(j, column + k)] = v[i];
    }
}

/// Projects on the directions along which vectors are so far above noise that it does not shrink their stretch.
pub fn directions_above_noise(vectors: impl Iterator<Item = Vector3<f64>>, scale: f64) -> Matrix3<f64> {
    let (mut moments, mut count) = (Matrix3::zeros(), 0.0);
    for vector in vectors {
        moments += vector * vector.transpose();
        count += 1.0;
    }
    let below = directions_below(&moments, STRETCH_ABOVE_NOISE * scale * scale * count);
    let noisy: Matrix3<f64> = below.iter().map(|axis| axis * axis.transpose()).sum();
    Matrix3::identity() - noisy
}

/// Eigenvectors of a symmetric matrix whose eigenvalues are not above a limit.
pub fn directions_below(matrix: &Matrix3<f64>, limit: f64) -> Vec<Vector3<f64>> {
    let (values, vectors) = eigen::symmetric(*matrix);
    let below = |k: &usize| values[*k] <= limit;
    (0..3)
        .filter(below)
        .map(|k| vectors.column(k).into_owned())
        .collect()
}

#[cfg(test)]
#[path = "rates_tests.rs"]
mod tests;
