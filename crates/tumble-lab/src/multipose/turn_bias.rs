//! The gyroscope's bias in turns against that at rest: one that zeroes itself at rest has two (docs/theory/multipose.md,
//! section 13).

use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix2xX, Matrix3, RowVector3, Vector2, Vector3};
use rayon::prelude::*;
use tumble_core::model::PARAMETERS;

use super::gyroscope::{Rotations, RotationsFit, Turn};
use crate::distributions::{balanced_median, chi_square_tail};

/// Residuals less unknowns, below which the scatter of turns is not known.
const LEAST_FREEDOM: usize = 3;

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

/// Bias of the turns alone, compared with that of the rests; `None` where the turns do not show it.
pub(super) fn turn_bias(data: &Rotations, fit: &RotationsFit) -> Option<TurnBias> {
    let residuals = 2 * data.turns.len();
    if residuals < PARAMETERS + LEAST_FREEDOM {
        return None;
    }
    let correction = fit.errors.model.correction().ok()?;
    let of_turns: Option<Vec<_>> = data
        .turns
        .par_iter()
        .enumerate()
        .map(|(k, turn)| whitened(data, fit, &correction.matrix, k, turn))
        .collect();
    let mut rows = DMatrix::zeros(residuals, PARAMETERS);
    let mut left = DVector::zeros(residuals);
    for (k, (response, residual)) in of_turns?.into_iter().enumerate() {
        rows.rows_mut(2 * k, 2).copy_from(&response);
        left.rows_mut(2 * k, 2).copy_from(&residual);
    }
    let of_rests = data
        .rests
        .iter()
        .map(|rest| rest.rate - fit.errors.modelled(&rest.earth_rate, &rest.force));
    difference(rows, &left, &of_rests.collect::<Vec<_>>())
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

/// Bias that whitened residuals (n,) of turns show less the mean of those of rests, rad/s.
fn difference(rows: DMatrix<f64>, left: &DVector<f64>, of_rests: &[Vector3<f64>]) -> Option<TurnBias> {
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
    let (freedom, rests) = ((left.len() - PARAMETERS) as f64, of_rests.len() as f64);
    let scatter = (left + &rows * &change).norm_squared() / freedom;
    let mean = of_rests.iter().sum::<Vector3<f64>>() / rests;
    let squares = of_rests
        .iter()
        .map(|each| (each - mean).component_mul(&(each - mean)));
    let of_mean = squares.sum::<Vector3<f64>>() / ((rests - 1.0) * rests);
    let difference = change.fixed_rows::<3>(9) - mean;
    let covariance = known.fixed_view::<3, 3>(9, 9) * scatter + Matrix3::from_diagonal(&of_mean); // eq. 43
    let square = difference.dot(&covariance.cholesky()?.solve(&difference)); // eq. 43
    Some(TurnBias {
        difference,
        sigma: covariance.diagonal().map(f64::sqrt),
        // Student's square as a chi-square: its own distribution where turns are many, and no smaller chance else.
        chance: chi_square_tail(freedom * libm::log1p(square / freedom), 3.0), // eq. 44
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
