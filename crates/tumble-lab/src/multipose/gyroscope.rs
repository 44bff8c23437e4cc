//! The gyroscope: gravity, carried through a turn, ends where the accelerometer finds it (docs/theory/multipose.md).
//!
//! Scale, non-orthogonality and the angles to the accelerometer come from the turns, the bias from turns and rests together.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, UnitQuaternion, Vector3};
use rayon::prelude::*;
use tumble_core::gravity::EARTH_RATE;
use tumble_core::model::{ErrorModel, ModelCovariance, PARAMETERS};
use tumble_core::noise::Noise;
use tumble_core::turntable::reference::earth_variance;

use super::error::MultiposeError;
use super::rotation_response::{IntegratedTurn, RateModel, TurnSamples};
use crate::constant_length::levenberg_marquardt::{Linearised, minimise};
use crate::constant_length::{observability, robust};
use crate::distributions::median;

/// Nine elements of M and three biases; with g-sensitivity nine more.
const UNKNOWNS: (usize, usize) = (12, 21);

/// Initial scales, as multiples of the one that readings suggest, from a twelfth to twelve times: each differs from the
/// last by a 25th. A wrong sample rate is as wrong a scale.
const SCALES: (i32, f64) = (63, 1.04);

/// Number of turns that separate one scale from another.
const ENOUGH_TURNS: usize = 16;

/// Change of weights, of variances as a share of them, and of attitudes, rad, below which a round changes nothing: the Earth's
/// rotation seen from an attitude that is wrong by so much is wrong by 7e-8 rad/s.
const SETTLED: f64 = 1e-3;

/// Median angle between gravity as turned and as found, rad, beyond which no gyroscope of this unit read this.
const CONTRADICTION: f64 = 0.1;

/// Rounds in which weights and covariances settle.
const ROUNDS: u32 = 4;

/// Chi-square beyond this many of its own sigma above its mean is no chance.
const UNLIKELY: f64 = 5.0;

const BISECTIONS: u32 = 60;

/// Bias that a gyroscope may have, rad/s, for what counts as shown.
pub(super) const RATE_BIAS: f64 = 0.1;

/// G-sensitivity that it may have, rad/s per m/s^2.
const G_SENSITIVITY: f64 = 0.01;

/// A rest as a calibrated accelerometer and the gyroscope saw it.
#[derive(Clone, Debug)]
pub struct RestDirection {
    /// True specific force, m/s^2.
    pub force: Vector3<f64>,
    /// Covariance of the direction of gravity from noise, rad^2.
    pub covariance: Matrix3<f64>,
    /// Derivative of the direction by `[M row by row, b]` of the accelerometer.
    pub by_accelerometer: SMatrix<f64, 3, PARAMETERS>,
    /// Mean reading of the gyroscope, rad/s.
    pub rate: Vector3<f64>,
    /// Variance of that mean, (rad/s)^2.
    pub rate_variance: Vector3<f64>,
    /// Known rotation of the Earth there, rad/s.
    pub earth_rate: Vector3<f64>,
    /// Case at the first sample of the rest, and at the first after it, from the case as it stood in the mean, where it trembled.
    pub ends: [UnitQuaternion<f64>; 2],
}

impl RestDirection {
    /// Up, in the case frame.
    pub fn up(&self) -> Vector3<f64> {
        self.force.normalize()
    }

    /// Up as the case stood when the rest began.
    pub fn up_at_start(&self) -> Vector3<f64> {
        self.ends[0] * self.up() // eq. 36
    }

    /// Up as the case stood when the rest ended.
    pub fn up_at_end(&self) -> Vector3<f64> {
        self.ends[1] * self.up() // eq. 36
    }
}

/// A turn between two rests.
#[derive(Clone, Debug)]
pub struct Turn {
    /// Index of the rest before.
    pub before: usize,
    /// Index of the rest after.
    pub after: usize,
    /// Readings of the turn.
    pub samples: TurnSamples,
    /// Variance of the angle about any axis from the gyroscope's noise, rad^2.
    pub variance: f64,
}

/// A turn about the vertical that ended where it began.
#[derive(Clone, Copy, Debug)]
pub struct FullTurn {
    /// Up in the case, for a turn in unknown direction.
    pub axis: Vector3<f64>,
    /// Integral of the readings, rad.
    pub angle: Vector3<f64>,
    /// Integral of true specific force, m/s.
    pub velocity: Vector3<f64>,
    /// Length, s.
    pub duration: f64,
    /// Covariance of the true angle and of the noise of its integral, rad^2.
    pub covariance: Matrix3<f64>,
}

impl FullTurn {
    /// True angle as integrated by a gyroscope with these errors, after its correction.
    fn turned(&self, errors: &RateModel, case_from_sensor: &Matrix3<f64>) -> Vector3<f64> {
        let felt = errors.g_sensitivity * self.velocity;
        case_from_sensor * (self.angle - errors.model.bias * self.duration - felt) // eq. 25
    }

    /// Angle about the axis less a full turn, either way, in the last column; before it its derivative.
    fn rows(&self, errors: &RateModel, case_from_sensor: &Matrix3<f64>, unknowns: usize) -> DMatrix<f64> {
        let turned = self.turned(errors, case_from_sensor);
        let truth = self.axis * std::f64::consts::TAU.copysign(turned.dot(&self.axis));
        let mut rows = DMatrix::zeros(3, unknowns + 1);
        rows.column_mut(unknowns).copy_from(&(turned - truth)); // eq. 25
        for row in 0..3 {
            let by_reading = -case_from_sensor.column(row);
            for column in 0..3 {
                rows.column_mut(3 * row + column)
                    .copy_from(&(by_reading * turned[column]));
                if unknowns == UNKNOWNS.1 {
                    rows.column_mut(12 + 3 * row + column)
                        .copy_from(&(by_reading * self.velocity[column]));
                }
            }
            rows.column_mut(9 + row).copy_from(&(by_reading * self.duration));
        }
        rows
    }
}

/// All that a gyroscope is fitted to.
#[derive(Clone, Debug)]
pub struct Rotations {
    /// Rests, in order.
    pub rests: Vec<RestDirection>,
    /// Turns that were recorded whole.
    pub turns: Vec<Turn>,
    /// Turns known to be full.
    pub full_turns: Vec<FullTurn>,
    /// Covariance of `[M row by row, b]` of the accelerometer.
    pub accelerometer_covariance: ModelCovariance<f64>,
    /// Noise of the three axes.
    pub noise: [Noise<f64>; 3],
    /// Covariance of flicker of B = 1 among the rests (docs/theory/noise.md, eq. 4).
    pub remembered: DMatrix<f64>,
    /// True if the response to specific force is fitted.
    pub g_sensitivity: bool,
    /// Latitude, rad, where the upward part of the Earth's rotation is known.
    pub latitude: Option<f64>,
}

/// Lower triangles that whiten the residuals of turns and of rests.
struct Factors {
    turns: DMatrix<f64>,
    full_turns: Vec<Matrix3<f64>>,
    rests: DMatrix<f64>,
}

/// Scale, non-orthogonality, mounting against the accelerometer, and bias of a gyroscope.
#[derive(Clone, Debug)]
pub struct RotationsFit {
    /// Errors of the gyroscope.
    pub errors: RateModel,
    /// Covariance of the unknowns from noise alone: `[M row by row, b]`, then G row by row.
    pub covariance: DMatrix<f64>,
    /// Direction of gravity as turned less as found, of each turn, rad.
    pub turned_less_found: Vec<Vector3<f64>>,
    /// Variance of one component of the same, rad^2.
    pub turn_variance: Vec<f64>,
    /// The same angle, rad, without any calibration of the gyroscope but its bias at rest.
    pub angle_before: Vec<f64>,
    /// Weight of each turn in the robust loss.
    pub weights: Vec<f64>,
    /// Scatter that noise does not explain, and the sigmas include.
    pub excess: ExcessScatter,
    /// Weighted squares over their expected size.
    pub chi_square: f64,
    /// Residuals less unknowns: two of a turn, three of a rest.
    pub degrees_of_freedom: u32,
}

impl RotationsFit {
    /// Angle between gravity as turned and as found, of each turn, rad.
    pub fn angles(&self) -> impl Iterator<Item = f64> {
        self.turned_less_found.iter().map(angle_of)
    }
}

/// Fits all turns and rests.
///
/// # Errors
/// [`MultiposeError`] where there are no turns, or they do not show all unknowns.
pub fn fit_rates(data: &Rotations) -> Result<RotationsFit, MultiposeError> {
    if data.turns.is_empty() && data.full_turns.is_empty() {
        return Err(MultiposeError::NoTurns);
    }
    let (mut x, angle_before) = data.start().ok_or(MultiposeError::Unsolvable)?;
    let mut data = data.clone();
    let mut weights = vec![1.0; data.turns.len()];
    let mut excess = ExcessScatter::none();
    let mut turned = data.turned(&x).ok_or(MultiposeError::Unsolvable)?;
    for _ in 0..ROUNDS {
        let noise = data.factors(&x, &turned, &weights);
        let noise = noise.ok_or(MultiposeError::Unsolvable)?;
        let solved = minimise(x.clone(), |x| data.whitened(x, &noise));
        x = solved.ok_or(MultiposeError::Unsolvable)?.x;
        let turned_before =
            std::mem::replace(&mut turned, data.turned(&x).ok_or(MultiposeError::Unsolvable)?);
        let moved = turned.iter().zip(&turned_before).map(|(a, b)| a.angle_to(b));
        let found = data.weights(&turned);
        let change = found.iter().zip(&weights).map(|(a, b)| (a - b).abs());
        // The Earth's rotation at rests is taken from the attitudes of the round before.
        let settled = change.chain(moved).fold(0.0, f64::max) < SETTLED;
        weights = found;
        let before = excess;
        excess = data.add_excess(&x, &turned, &weights, &before);
        if settled && excess.is_near(&before) {
            break;
        }
    }
    data.finish(&x, &turned, weights, angle_before, excess)
}

/// Scatter of turns and rests besides noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExcessScatter {
    /// Variance of the angle of a turn about any axis, rad^2.
    pub turn: f64,
    /// Variance of the bias from rest to rest, (rad/s)^2.
    pub rest: f64,
}

impl ExcessScatter {
    fn none() -> Self {
        Self { turn: 0.0, rest: 0.0 }
    }

    fn is_near(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= SETTLED * a.max(b);
        near(self.turn, other.turn) && near(self.rest, other.rest)
    }
}

impl Rotations {
    fn unknowns(&self) -> usize {
        if self.g_sensitivity {
            UNKNOWNS.1
        } else {
            UNKNOWNS.0
        }
    }

    /// Bias as the rests show it, and of many scales the one with which gravity turns as it was found to; beside it the
    /// angles, rad, without any.
    fn start(&self) -> Option<(DVector<f64>, Vec<f64>)> {
        #[allow(clippy::cast_precision_loss)]
        let bias = self.rests.iter().map(|rest| rest.rate).sum::<Vector3<f64>>() / self.rests.len() as f64;
        let scaled = |scale: f64| {
            let mut x = DVector::zeros(self.unknowns());
            for i in 0..3 {
                x[4 * i] = scale;
                x[9 + i] = bias[i];
            }
            x
        };
        let plain = self.angles(&self.turned(&scaled(1.0))?);
        if let Some(scale) = self.scale_of_full_turns(&bias) {
            return Some((scaled(scale), plain));
        }
        let every = self.turns.len().div_ceil(ENOUGH_TURNS).max(1);
        let some = Self {
            turns: self.turns.iter().step_by(every).cloned().collect(),
            ..self.clone()
        };
        let candidates = (-SCALES.0..=SCALES.0).filter_map(|step| {
            let x = scaled(SCALES.1.powi(step));
            let apart = median(&mut some.angles(&some.turned(&x)?)).unwrap_or(0.0);
            Some((apart, x))
        });
        let best = candidates.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((best.1, plain))
    }

    /// Scale with which full turns are full, in the mean.
    fn scale_of_full_turns(&self, bias: &Vector3<f64>) -> Option<f64> {
        let read = |turn: &FullTurn| (turn.angle - bias * turn.duration).norm() / std::f64::consts::TAU;
        let read: Vec<f64> = self.full_turns.iter().map(read).collect();
        #[allow(clippy::cast_precision_loss)]
        let count = read.len() as f64;
        (count > 0.0).then(|| read.iter().sum::<f64>() / count)
    }

    /// Case at the end of each turn from case at its start.
    fn turned(&self, x: &DVector<f64>) -> Option<Vec<UnitQuaternion<f64>>> {
        let errors = errors_of(x);
        self.turns
            .par_iter()
            .map(|turn| turn.samples.end_from_start(&errors))
            .collect()
    }

    /// Gravity as turned less as found, of each turn.
    fn apart(&self, turned: &[UnitQuaternion<f64>]) -> impl Iterator<Item = Vector3<f64>> {
        let each = self.turns.iter().zip(turned);
        each.map(|(turn, turned)| {
            turned * self.rests[turn.before].up_at_end() - self.rests[turn.after].up_at_start() // eq. 15
        })
    }

    /// Angle between the two, rad.
    fn angles(&self, turned: &[UnitQuaternion<f64>]) -> Vec<f64> {
        self.apart(turned).map(|apart| angle_of(&apart)).collect()
    }

    fn integrated(&self, errors: &RateModel) -> Option<Vec<IntegratedTurn>> {
        self.turns
            .par_iter()
            .map(|turn| turn.samples.integrate(errors, self.g_sensitivity))
            .collect()
    }

    /// Residuals of turns, then of rests, each over its sigma, with their derivative.
    fn whitened(&self, x: &DVector<f64>, noise: &Factors) -> Option<Linearised> {
        let errors = errors_of(x);
        let correction = errors.model.correction().ok()?;
        let turned = self.integrated(&errors)?;
        let (turns, rests, unknowns) = (self.turns.len(), self.rests.len(), self.unknowns());
        let mut of_turns = DMatrix::zeros(3 * turns, unknowns + 1);
        for (k, (turn, turned)) in self.turns.iter().zip(&turned).enumerate() {
            let carried = turned.end_from_start * self.rests[turn.before].up_at_end(); // eq. 12
            let mut rows = of_turns.rows_mut(3 * k, 3);
            rows.columns_mut(0, unknowns)
                .copy_from(&turned.derivative(&carried, &correction.matrix));
            rows.column_mut(unknowns)
                .copy_from(&(carried - self.rests[turn.after].up_at_start())); // eq. 15
        }
        noise.turns.solve_lower_triangular_mut(&mut of_turns);
        let mut of_rests = DMatrix::zeros(3 * rests, unknowns + 1);
        for (k, rest) in self.rests.iter().enumerate() {
            of_rests
                .rows_mut(3 * k, 3)
                .copy_from(&rest_rows(rest, &errors, unknowns));
        }
        noise.rests.solve_lower_triangular_mut(&mut of_rests);
        let full = self.full_turns.len();
        let mut all = DMatrix::zeros(3 * (turns + rests + full), unknowns + 1);
        all.rows_mut(0, 3 * turns).copy_from(&of_turns);
        all.rows_mut(3 * turns, 3 * rests).copy_from(&of_rests);
        for (k, (turn, factor)) in self.full_turns.iter().zip(&noise.full_turns).enumerate() {
            let mut rows = turn.rows(&errors, &correction.matrix, unknowns);
            factor.solve_lower_triangular_mut(&mut rows);
            all.rows_mut(3 * (turns + rests + k), 3).copy_from(&rows);
        }
        Some(Linearised {
            residuals: all.column(unknowns).into_owned(),
            jacobian: all.columns(0, unknowns).into_owned(),
        })
    }

    /// Factors by which residuals are whitened.
    fn factors(&self, x: &DVector<f64>, turned: &[UnitQuaternion<f64>], weights: &[f64]) -> Option<Factors> {
        let turned: Vec<_> = turned
            .iter()
            .map(|turned| turned.to_rotation_matrix().into_inner())
            .collect();
        Some(Factors {
            turns: self.turn_noise(&turned, weights)?,
            full_turns: self
                .full_turns
                .iter()
                .map(|turn| turn.covariance.cholesky().map(|factor| factor.l()))
                .collect::<Option<_>>()?,
            rests: self.rest_noise(&turned, &errors_of(x))?,
        })
    }

    /// Cholesky factor of the covariance of all rests: what is not known of the Earth's rotation is the same at all of
    /// them, seen from the attitudes that the turns lead to (docs/theory/multipose.md, eq. 18).
    fn rest_noise(&self, turned: &[Matrix3<f64>], errors: &RateModel) -> Option<DMatrix<f64>> {
        let size = 3 * self.rests.len();
        let mut covariance = DMatrix::zeros(size, size);
        let mut by_earth = DMatrix::zeros(size, 3);
        let mut here_from_start = Matrix3::identity();
        let mut first = 0;
        let mut turns = self.turns.iter().zip(turned).peekable();
        for k in 0..self.rests.len() {
            match turns.next_if(|(turn, _)| turn.after == k) {
                Some((_, turned)) => here_from_start = turned * here_from_start,
                // Nobody knows how the unit was turned: the Earth may be seen from anywhere.
                None => (here_from_start, first) = (Matrix3::identity(), k),
            }
            by_earth
                .fixed_view_mut::<3, 3>(3 * k, 0)
                .copy_from(&(errors.model.matrix * here_from_start));
            let unknown = self.unknown_earth(&self.rests[first].up());
            let since = by_earth.rows(3 * first, 3 * (k + 1 - first)) * unknown;
            let row = by_earth.fixed_rows::<3>(3 * k) * since.transpose(); // eq. 18
            covariance
                .view_mut((3 * k, 3 * first), (3, row.ncols()))
                .copy_from(&row);
            for axis in 0..3 {
                covariance[(3 * k + axis, 3 * k + axis)] += self.rests[k].rate_variance[axis];
                for before in 0..k {
                    covariance[(3 * k + axis, 3 * before + axis)] +=
                        self.noise[axis].flicker * self.remembered[(k, before)];
                }
            }
        }
        // The factor is made of the lower triangle alone.
        covariance.cholesky().map(|factor| factor.l())
    }

    /// Covariance of what is not known of the Earth's rotation, (rad/s)^2: of all of it, or of its part towards north.
    fn unknown_earth(&self, up: &Vector3<f64>) -> Matrix3<f64> {
        match self.latitude {
            Some(latitude) => {
                let level = Matrix3::identity() - up * up.transpose();
                level * (0.5 * (EARTH_RATE * libm::cos(latitude)).powi(2))
            }
            None => Matrix3::identity() * earth_variance::<f64>(),
        }
    }

    /// Cholesky factor of the covariance of all turns: neighbours share a rest, all share the accelerometer's calibration
    /// (docs/theory/multipose.md, eq. 16).
    fn turn_noise(&self, turned: &[Matrix3<f64>], weights: &[f64]) -> Option<DMatrix<f64>> {
        let size = 3 * self.turns.len();
        let mut covariance = DMatrix::zeros(size, size);
        let mut by_accelerometer = DMatrix::zeros(size, PARAMETERS);
        for (k, (turn, carry)) in self.turns.iter().zip(turned).enumerate() {
            let (from, to) = (&self.rests[turn.before], &self.rests[turn.after]);
            let up = to.up();
            let across = Matrix3::identity() - up * up.transpose();
            let own = carry * from.covariance * carry.transpose() + to.covariance;
            let gyroscope = turn.variance / weights[k];
            // Along up, where a direction cannot err, any size does that is neither large nor small.
            let along = up * up.transpose() * (gyroscope + 0.5 * own.trace());
            let block = own + across * gyroscope + along; // eq. 16
            covariance.fixed_view_mut::<3, 3>(3 * k, 3 * k).copy_from(&block);
            by_accelerometer
                .fixed_view_mut::<3, PARAMETERS>(3 * k, 0)
                .copy_from(&(carry * from.by_accelerometer - to.by_accelerometer));
            // The rest that ends one turn begins the next.
            if k > 0 && self.turns[k - 1].after == turn.before {
                let shared = -(carry * from.covariance); // eq. 16
                covariance
                    .fixed_view_mut::<3, 3>(3 * k, 3 * k - 3)
                    .copy_from(&shared);
                covariance
                    .fixed_view_mut::<3, 3>(3 * k - 3, 3 * k)
                    .copy_from(&shared.transpose());
            }
        }
        covariance += &by_accelerometer * self.accelerometer_covariance * by_accelerometer.transpose(); // eq. 16
        covariance.cholesky().map(|factor| factor.l())
    }

    /// Variance of one component of a turn's residual, rad^2.
    fn variance(&self, turn: &Turn) -> f64 {
        let (from, to) = (&self.rests[turn.before], &self.rests[turn.after]);
        turn.variance + 0.5 * (from.covariance + to.covariance).trace()
    }

    fn weights(&self, turned: &[UnitQuaternion<f64>]) -> Vec<f64> {
        let angles = self.angles(turned);
        let each = angles.iter().zip(&self.turns);
        let normalised: Vec<f64> = each
            .map(|(angle, turn)| angle / (2.0 * self.variance(turn)).sqrt())
            .collect();
        robust::weights(&normalised, self.unknowns() / 2, 1)
    }

    /// Puts what turns and rests scatter beyond noise into their variances, in place of what was put there before
    /// (docs/theory/multipose.md, eq. 19).
    fn add_excess(
        &mut self,
        x: &DVector<f64>,
        turned: &[UnitQuaternion<f64>],
        weights: &[f64],
        before: &ExcessScatter,
    ) -> ExcessScatter {
        let angles = self.angles(turned);
        let errors = errors_of(x);
        let rests = self.rest_terms(&errors, before);
        let mut excess = ExcessScatter {
            turn: 0.0,
            rest: unexplained(&rests, 3.0),
        };
        self.put_excess(&excess, before);
        let turns: Vec<_> = (0..self.turns.len())
            .map(|k| (weights[k] * angles[k].powi(2), self.variance(&self.turns[k]), 2.0))
            .collect();
        #[allow(clippy::cast_precision_loss)]
        let unknowns = self.unknowns() as f64 - 3.0;
        excess.turn = unexplained(&turns, unknowns);
        let of_rests = ExcessScatter { turn: 0.0, ..excess };
        self.put_excess(&excess, &of_rests);
        excess
    }

    /// Squares of what is left at each axis of each rest, and their variance from noise.
    fn rest_terms(&self, errors: &RateModel, before: &ExcessScatter) -> Vec<(f64, f64, f64)> {
        let of_rest = |rest: &RestDirection| {
            let apart = rest.rate - errors.modelled(&rest.earth_rate, &rest.force);
            let earth = self.unknown_earth(&rest.up()).trace() / 3.0;
            std::array::from_fn::<_, 3, _>(|i| {
                let noise = rest.rate_variance[i] - before.rest;
                (apart[i].powi(2), noise + earth, 1.0)
            })
        };
        self.rests.iter().flat_map(of_rest).collect()
    }

    /// A bias that wanders from rest to rest is as far off all through a turn.
    fn put_excess(&mut self, excess: &ExcessScatter, before: &ExcessScatter) {
        for turn in &mut self.turns {
            let wandering = (excess.rest - before.rest) * turn.samples.duration().powi(2);
            turn.variance += excess.turn - before.turn + wandering; // eq. 19
        }
        for rest in &mut self.rests {
            rest.rate_variance.add_scalar_mut(excess.rest - before.rest); // eq. 19
        }
    }

    fn finish(
        &self,
        x: &DVector<f64>,
        turned: &[UnitQuaternion<f64>],
        weights: Vec<f64>,
        angle_before: Vec<f64>,
        excess: ExcessScatter,
    ) -> Result<RotationsFit, MultiposeError> {
        let angle = median(&mut self.angles(turned)).unwrap_or(0.0);
        if angle > CONTRADICTION {
            return Err(MultiposeError::GyroscopeContradicts {
                angle: angle.to_degrees(),
            });
        }
        let at = self
            .factors(x, turned, &weights)
            .and_then(|noise| self.whitened(x, &noise))
            .ok_or(MultiposeError::Unsolvable)?;
        let covariance = observability::covariance(&at.jacobian, &self.sizes()).map_err(|shares| {
            MultiposeError::TurnsLeaveOpen {
                shares: std::array::from_fn(|i| shares[i]),
            }
        })?;
        let errors = errors_of(x);
        let residuals = 2 * self.turns.len() + 3 * (self.rests.len() + self.full_turns.len());
        Ok(RotationsFit {
            errors,
            covariance,
            turned_less_found: self.apart(turned).collect(),
            turn_variance: self.turns.iter().map(|turn| self.variance(turn)).collect(),
            angle_before,
            weights,
            excess,
            chi_square: at.residuals.norm_squared(),
            degrees_of_freedom: u32::try_from(residuals.saturating_sub(self.unknowns())).unwrap_or(u32::MAX),
        })
    }

    /// Typical size of each unknown.
    pub fn sizes(&self) -> DVector<f64> {
        DVector::from_fn(self.unknowns(), |i, _| match i {
            0..9 => 1.0,
            9..12 => RATE_BIAS,
            _ => G_SENSITIVITY,
        })
    }
}

/// Mean reading of a rest less what the model has, in the last column; before it its derivative.
fn rest_rows(rest: &RestDirection, errors: &RateModel, unknowns: usize) -> DMatrix<f64> {
    let modelled = errors.modelled(&rest.earth_rate, &rest.force);
    let mut rows = DMatrix::zeros(3, unknowns + 1);
    for axis in 0..3 {
        rows[(axis, unknowns)] = rest.rate[axis] - modelled[axis]; // eq. 17
        rows[(axis, 9 + axis)] = -1.0;
        for column in 0..3 {
            rows[(axis, 3 * axis + column)] = -rest.earth_rate[column];
            if unknowns == UNKNOWNS.1 {
                rows[(axis, 12 + 3 * axis + column)] = -rest.force[column];
            }
        }
    }
    rows
}

/// The errors that unknowns stand for.
fn errors_of(x: &DVector<f64>) -> RateModel {
    RateModel {
        model: ErrorModel {
            matrix: Matrix3::from_row_slice(&x.as_slice()[..9]),
            bias: Vector3::new(x[9], x[10], x[11]),
        },
        g_sensitivity: x
            .as_slice()
            .get(12..21)
            .map_or_else(Matrix3::zeros, Matrix3::from_row_slice),
    }
}

/// Variance that, added to that of noise, makes squares what they should be; zero where noise does explain them. Each
/// term: sum of squares, variance of one from noise, how many they are.
fn unexplained(terms: &[(f64, f64, f64)], unknowns: f64) -> f64 {
    let expected = terms.iter().map(|(_, _, count)| count).sum::<f64>() - unknowns;
    let cost = |excess: f64| -> f64 {
        terms
            .iter()
            .map(|(squares, noise, _)| squares / (noise + excess))
            .sum()
    };
    let chance = UNLIKELY * (2.0 * expected.max(0.0)).sqrt();
    if expected <= 0.0 || cost(0.0) <= expected + chance {
        return 0.0;
    }
    let mut high = terms.iter().map(|(squares, _, _)| squares).sum::<f64>();
    let mut low = 0.0;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if cost(middle) > expected {
            low = middle
        } else {
            high = middle
        } // eq. 19
    }
    high
}

/// Angle between two directions, rad, of which this is the difference.
fn angle_of(apart: &Vector3<f64>) -> f64 {
    2.0 * libm::asin((0.5 * apart.norm()).min(1.0))
}
