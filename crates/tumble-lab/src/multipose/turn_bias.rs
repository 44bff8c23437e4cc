//! The gyroscope's bias in turns against that at rest: one that zeroes itself at rest has two, or loses an angle at both ends of
//! each turn (docs/theory/multipose.md, section 13).

use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix2xX, Matrix3, RowVector3, Vector2, Vector3};
use rayon::prelude::*;
use tumble_core::model::PARAMETERS;

use super::gyroscope::{Rotations, RotationsFit, Turn};
use crate::distributions::{balanced_median, chi_square_tail};

/// Residuals less unknowns, below which the scatter of turns is not known.
const LEAST_FREEDOM: usize = 3;

/// Place of the bias among the unknowns.
const BIAS: usize = 9;

/// Chance of a larger difference in a sound session, below which turns and rests have two biases.
const CHANCE: f64 = 1e-6;

/// Share of the largest singular value from which a combination of unknowns is shown.
const SHOWN: f64 = 1e-9;

/// Share of the variance of turns that noise explains at least: the excess is found by bisection.
const LEAST_NOISE: f64 = 1e-6;

/// Bias that turns show less that of rests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnBias {
    /// rad/s.
    pub difference: Vector3<f64>,
    /// 1-sigma of it, rad/s, as turns scatter.
    pub sigma: Vector3<f64>,
    /// Chance of a larger difference, were it zero.
    pub chance: f64,
}

impl TurnBias {
    /// True if turns and rests have two biases.
    pub fn contradicts(&self) -> bool {
        self.chance < CHANCE
    }
}

/// Angle that a gyroscope loses in every turn, however far it goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnLoss {
    /// rad.
    pub angle: f64,
    /// 1-sigma of it, rad, as turns scatter.
    pub sigma: f64,
    /// Chance of an angle further from zero, were nothing lost.
    pub chance: f64,
}

impl TurnLoss {
    /// True if turns end short.
    pub fn contradicts(&self) -> bool {
        self.angle > 0.0 && self.chance < CHANCE
    }
}

/// Bias of the turns alone, compared with that of the rests; `None` where the turns do not show it.
pub(super) fn turn_bias(data: &Rotations, fit: &RotationsFit) -> Option<TurnBias> {
    let (rows, left) = equations(data, fit, 0)?;
    let of_rests = data
        .rests
        .iter()
        .map(|rest| rest.rate - fit.errors.modelled(&rest.earth_rate, &rest.force));
    difference(rows, &left, &of_rests.collect::<Vec<_>>())
}

/// Angle that turns lose whatever their size, beside errors that grow with it; `None` where the turns do not show it.
pub(super) fn turn_loss(data: &Rotations, fit: &RotationsFit) -> Option<TurnLoss> {
    let (rows, left) = equations(data, fit, 1)?;
    let turns = OfTurns::solve(&rows, &left)?;
    let angle = -turns.change[PARAMETERS];
    let variance = turns.known[(PARAMETERS, PARAMETERS)] * turns.scatter;
    Some(TurnLoss {
        angle,
        sigma: variance.sqrt(),
        chance: turns.chance(angle * angle / variance, 1.0), // eq. 46
    })
}

/// Rows (n, 12 + m) of all turns and their residuals (n,), over sigma: by `[M row by row, b]`, then by the first m of `[angle
/// read too much in any turn]`.
fn equations(data: &Rotations, fit: &RotationsFit, more: usize) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let (residuals, unknowns) = (2 * data.turns.len(), PARAMETERS + more);
    if residuals < unknowns + LEAST_FREEDOM {
        return None;
    }
    let correction = fit.errors.model.correction().ok()?;
    let of_turns: Option<Vec<_>> = data
        .turns
        .par_iter()
        .enumerate()
        .map(|(k, turn)| whitened(data, fit, &correction.matrix, k, turn))
        .collect();
    let mut rows = DMatrix::zeros(residuals, unknowns);
    let mut left = DVector::zeros(residuals);
    for (k, ((response, residual), turn)) in of_turns?.into_iter().zip(&data.turns).enumerate() {
        rows.view_mut((2 * k, 0), (2, PARAMETERS)).copy_from(&response);
        if more > 0 {
            let mean = turn.samples.rate.iter().sum::<Vector3<f64>>() / turn.samples.rate.len() as f64;
            let along = (mean - fit.errors.model.bias).normalize() / turn.samples.duration();
            rows.view_mut((2 * k, PARAMETERS), (2, 1))
                .copy_from(&(response.columns(BIAS, 3) * along)); // eq. 45
        }
        left.rows_mut(2 * k, 2).copy_from(&residual);
    }
    Some((rows, left))
}

/// Factor by which turns are off beyond noise and a bias that varies; 1 where they are not.
pub(super) fn turn_widening(fit: &RotationsFit) -> f64 {
    let variance = balanced_median(&mut fit.turn_variance.clone());
    variance
        .filter(|_| fit.excess.turn > 0.0)
        .map_or(1.0, |variance| {
            (variance / (variance - fit.excess.turn).max(LEAST_NOISE * variance)).sqrt()
        })
}

/// Derivative (2, 12) by `[M row by row, b]` of a turn's end across up, and its residual there, both over sigma.
fn whitened(
    data: &Rotations,
    fit: &RotationsFit,
    case_from_sensor: &Matrix3<f64>,
    k: usize,
    turn: &Turn,
) -> Option<(Matrix2xX<f64>, Vector2<f64>)> {
    let up = data.rests[turn.after].up();
    let turned = turn.samples.integrate(&fit.errors, false)?;
    let across = across(&up) / fit.turn_variance[k].sqrt();
    let response = across * turned.rotation_derivative(case_from_sensor); // eq. 42
    let residual = across * up.cross(&fit.turned_less_found[k]); // eq. 42
    Some((response, residual))
}

/// Two directions across a unit vector, as rows.
fn across(up: &Vector3<f64>) -> Matrix2x3<f64> {
    let first = up.cross(&Vector3::ith(up.iamin(), 1.0)).normalize();
    let second = up.cross(&first);
    Matrix2x3::from_rows(&[first, second].map(|each| RowVector3::new(each.x, each.y, each.z)))
}

/// Least squares of whitened residuals of turns.
struct OfTurns {
    change: DVector<f64>,
    /// Covariance of that, over the scatter.
    known: DMatrix<f64>,
    /// Variance of unit weight.
    scatter: f64,
    freedom: f64,
}

impl OfTurns {
    fn solve(rows: &DMatrix<f64>, left: &DVector<f64>) -> Option<Self> {
        // Singular values of what is no number are never found.
        if !rows.iter().chain(left).all(|value| value.is_finite()) {
            return None;
        }
        let svd = rows.clone().svd(false, true);
        let sizes = &svd.singular_values;
        if sizes.min() < SHOWN * sizes.max() || sizes.min() == 0.0 {
            return None;
        }
        let directions = DMatrix::from_diagonal(&sizes.map(f64::recip)) * svd.v_t?;
        let known = directions.tr_mul(&directions);
        let change = -(&known * rows.tr_mul(left));
        #[allow(clippy::cast_precision_loss)]
        let freedom = (rows.nrows() - rows.ncols()) as f64;
        let scatter = (left + rows * &change).norm_squared() / freedom;
        Some(Self {
            change,
            known,
            scatter,
            freedom,
        })
    }

    /// Student's square as a chi-square: its own distribution where turns are many, and no smaller chance else.
    fn chance(&self, square: f64, unknowns: f64) -> f64 {
        chi_square_tail(self.freedom * libm::log1p(square / self.freedom), unknowns) // eq. 44
    }
}

/// Bias that whitened residuals (n,) of turns show less the mean of those of rests, rad/s.
fn difference(rows: DMatrix<f64>, left: &DVector<f64>, of_rests: &[Vector3<f64>]) -> Option<TurnBias> {
    let turns = OfTurns::solve(&rows, left)?;
    #[allow(clippy::cast_precision_loss)]
    let rests = of_rests.len() as f64;
    let mean = of_rests.iter().sum::<Vector3<f64>>() / rests;
    let squares = of_rests
        .iter()
        .map(|each| (each - mean).component_mul(&(each - mean)));
    let of_mean = squares.sum::<Vector3<f64>>() / ((rests - 1.0) * rests);
    let difference = turns.change.fixed_rows::<3>(BIAS) - mean;
    let covariance =
        turns.known.fixed_view::<3, 3>(BIAS, BIAS) * turns.scatter + Matrix3::from_diagonal(&of_mean); // eq. 43
    let square = difference.dot(&covariance.cholesky()?.solve(&difference)); // eq. 43
    Some(TurnBias {
        difference,
        sigma: covariance.diagonal().map(f64::sqrt),
        chance: turns.chance(square, 3.0),
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, SMatrix, UnitQuaternion};
    use tumble_core::noise::Noise;

    use super::*;
    use crate::multipose::gyroscope::{ExcessScatter, RestDirection, fit_rates};
    use crate::multipose::rotation_response::TurnSamples;
    use crate::simulate::stream::{StreamPurpose, normal_vector, stream};

    const GRAVITY: f64 = 9.8;
    const NOISE: f64 = 1e-3;

    /// A session of turns about drawn axes, of a gyroscope with one bias at rest and another in turns.
    fn session(seed: u64, turns: usize, at_rest: &Vector3<f64>, in_turns: &Vector3<f64>) -> Rotations {
        let mut random = stream(seed, 0, StreamPurpose::GyroscopeWhite);
        let mut up = Vector3::z();
        let mut data = Rotations {
            rests: Vec::new(),
            turns: Vec::new(),
            full_turns: Vec::new(),
            accelerometer_covariance: SMatrix::zeros(),
            noise: [Noise::none(); 3],
            remembered: DMatrix::zeros(turns + 1, turns + 1),
            g_sensitivity: false,
            latitude: None,
        };
        for k in 0..=turns {
            data.rests.push(RestDirection {
                force: up * GRAVITY,
                covariance: Matrix3::identity() * 1e-12,
                by_accelerometer: SMatrix::zeros(),
                rate: at_rest + normal_vector(&mut random) * NOISE,
                rate_variance: Vector3::repeat(NOISE * NOISE),
                earth_rate: Vector3::zeros(),
                ends: [UnitQuaternion::identity(); 2],
            });
            let rate = normal_vector(&mut random).normalize() * 1.5;
            if k < turns {
                let read = rate + in_turns + normal_vector(&mut random) * NOISE;
                data.turns.push(Turn {
                    before: k,
                    after: k + 1,
                    samples: TurnSamples {
                        time: (0..=50).map(|i| f64::from(i) * 0.02).collect(),
                        rate: vec![read; 51],
                        force: vec![up * GRAVITY; 51],
                    },
                    variance: NOISE * NOISE,
                });
            }
            up = Rotation3::new(-rate) * up;
        }
        data
    }

    fn found(data: &Rotations) -> Option<TurnBias> {
        turn_bias(data, &fit_rates(data).expect("solvable"))
    }

    /// A session of turns of drawn angles, 1.5 s each, that speed up and slow down as minimum jerk has it.
    fn smooth_session(seed: u64, turns: usize, tracking: Option<(f64, f64)>) -> Rotations {
        const STEP: f64 = 0.01;
        const DURATION: f64 = 1.5;
        const STILL: f64 = 0.15;
        let mut random = stream(seed, 1, StreamPurpose::GyroscopeWhite);
        let bias = normal_vector(&mut random) * 0.01;
        let mut data = session(seed, turns, &bias, &bias);
        let mut up = Vector3::z();
        for k in 0..turns {
            data.rests[k].force = up * GRAVITY;
            data.rests[k].rate_variance = Vector3::repeat(1e-10);
            data.rests[k].rate = bias + normal_vector(&mut random) * 1e-5;
            let axis = normal_vector(&mut random).normalize();
            let angle = 0.4 + 2.6 * (0.5 + 0.5 * normal_vector(&mut random).normalize().x);
            let mut tracked = bias;
            let samples = &mut data.turns[k].samples;
            let count = ((DURATION + 2.0 * STILL) / STEP).round() as usize;
            samples.time = (0..=count).map(|i| i as f64 * STEP).collect();
            samples.rate = samples
                .time
                .iter()
                .map(|time| {
                    let u = ((time - STILL) / DURATION).clamp(0.0, 1.0);
                    let rate = axis * (angle / DURATION * 30.0 * (u * (1.0 - u)).powi(2));
                    let read = rate + bias + normal_vector(&mut random) * NOISE;
                    let Some((threshold, constant)) = tracking else {
                        return read;
                    };
                    if (read - tracked).norm() < threshold {
                        tracked += (read - tracked) * (STEP / constant);
                    }
                    read - tracked + bias
                })
                .collect();
            samples.force = vec![up * GRAVITY; samples.time.len()];
            data.turns[k].variance = 3e-8;
            up = Rotation3::new(-axis * angle) * up;
        }
        data.rests[turns].force = up * GRAVITY;
        data.rests[turns].rate = bias;
        data.rests[turns].rate_variance = Vector3::repeat(1e-10);
        data
    }

    #[test]
    fn following_its_bias_costs_an_angle_in_every_turn() {
        for tracking in [(0.05, 0.3), (0.1, 1.0)] {
            for seed in 0..8 {
                let data = smooth_session(seed, 17, Some(tracking));
                let fit = fit_rates(&data).expect("solvable");
                // Nothing else shows it: it looks like a scale that is too small.
                assert!(!turn_bias(&data, &fit).expect("shown").contradicts());
                let loss = turn_loss(&data, &fit).expect("shown");
                assert!(loss.contradicts(), "{seed} {loss:?}");
                assert!((2e-3..0.03).contains(&loss.angle), "{seed} {loss:?}");
            }
        }
    }

    #[test]
    fn sound_turns_lose_no_angle() {
        for seed in 0..40 {
            let data = smooth_session(seed, 12 + usize::try_from(seed % 9).unwrap(), None);
            let loss = turn_loss(&data, &fit_rates(&data).expect("solvable")).expect("shown");
            assert!(!loss.contradicts() && loss.chance > 1e-4, "{seed} {loss:?}");
        }
    }

    #[test]
    fn a_bias_that_turns_alone_have_is_found() {
        let (at_rest, apart) = (Vector3::new(0.02, 0.0, -0.01), Vector3::new(0.03, -0.02, 0.04));
        for seed in 0..6 {
            let bias = found(&session(seed, 24, &at_rest, &(at_rest + apart))).expect("shown");
            assert!(bias.contradicts(), "{bias:?}");
            let errors = (bias.difference - apart).component_div(&bias.sigma);
            assert!(errors.amax() < 5.0, "{bias:?}");
        }
    }

    #[test]
    fn one_bias_of_turns_and_rests_is_no_contradiction() {
        let bias = Vector3::new(0.02, 0.0, -0.01);
        for seed in 0..20 {
            let found = found(&session(seed, 18, &bias, &bias)).expect("shown");
            assert!(found.chance > 1e-3, "{found:?}");
        }
    }

    #[test]
    fn few_turns_show_no_bias_of_their_own() {
        let bias = Vector3::zeros();
        assert_eq!(found(&session(1, 7, &bias, &bias)), None);
        assert!(found(&session(1, 8, &bias, &bias)).is_some());
    }

    #[test]
    fn turns_are_widened_by_what_noise_leaves() {
        let bias = Vector3::zeros();
        let mut fit = fit_rates(&session(1, 12, &bias, &bias)).expect("solvable");
        fit.turn_variance = vec![4.0, 1.0, 100.0, 5.0];
        fit.excess = ExcessScatter { turn: 0.0, rest: 1.0 };
        assert_eq!(turn_widening(&fit), 1.0);
        fit.excess.turn = 4.0;
        assert!((turn_widening(&fit) - 3.0).abs() < 1e-12);
        fit.excess.turn = 100.0;
        assert!((turn_widening(&fit) - 1e3).abs() < 1e-6);
    }
}
