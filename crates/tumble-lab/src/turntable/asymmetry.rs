//! Scale of a gyroscope that differs at positive and at negative rates (docs/theory/turntable.md, section 16).
//!
//! An axis that turned both ways shows it in its residuals. One that turned one way only has it in its scale, and no residual.

use nalgebra::Vector3;
use tumble_core::turntable::fit::{TriadFit, fit};
use tumble_core::turntable::observation::{FitInputs, Observation};
use tumble_core::turntable::truth::RateObservation;

use super::error::TurntableError;
use super::reference::mean_covariance;
use super::session::LARGEST_RATE_BIAS;
use super::triad::widening;
use crate::distributions::{chi_square_tail, f_tail};

/// Chance of an asymmetry where there is none, by the noise, and by what the fit with it leaves, as of other changes of a session
/// (docs/theory/turntable.md, eq. 58).
const FALSE_ALARM: f64 = 1e-3;
const FALSE_ALARM_BY_RESIDUALS: f64 = 1e-2;
/// 1-sigma of half the difference of the scales over their mean before any data: ten times what data sheets of consumer units
/// allow. Twice as much takes drift of a bias at slow rates for it more often.
const LARGEST_BEND: f64 = 0.05;
/// Axes that are tried.
const AXES: f64 = 3.0;
/// Unknowns of an axis.
const UNKNOWNS: usize = 4;
/// Numbers of the covariance of M, row by row, and b that belong to an axis.
const OF_AXIS: [[usize; 4]; 3] = [[0, 1, 2, 9], [3, 4, 5, 10], [6, 7, 8, 11]];

/// Turns or rests with the magnitude of the rate about an axis for a fifth regressor.
type BentObservation = Observation<f64, 5, 6>;

/// A gyroscope's fit with the asymmetry that its residuals ask for.
#[derive(Clone, Debug)]
pub(super) struct AsymmetricFit {
    /// M of the mean of both directions, and b.
    pub solved: TriadFit<f64, 6>,
    /// The observations less what the asymmetry adds to readings.
    pub observations: Vec<RateObservation<f64>>,
    /// Difference of the scales at positive and negative rates over their mean, and 1-sigma.
    pub asymmetry: (Vector3<f64>, Vector3<f64>),
}

/// The fit with an asymmetry, `None` where no axis shows one.
///
/// # Errors
/// [`TurntableError`] where no fit can be made.
pub(super) fn asymmetric(
    observations: &[RateObservation<f64>],
    inputs: &FitInputs<f64, 6>,
    plain: &TriadFit<f64, 6>,
) -> Result<Option<AsymmetricFit>, TurntableError> {
    if observations.len() <= UNKNOWNS + 1 {
        return Ok(None);
    }
    #[allow(clippy::cast_precision_loss)]
    let left = (observations.len() - UNKNOWNS - 1) as f64;
    #[allow(clippy::cast_possible_truncation)]
    let freedom = (observations.len() - UNKNOWNS - 1) as u32;
    let size = LARGEST_BEND / LARGEST_RATE_BIAS;
    let (mut sum, mut shown) = (0.0, 0_u32);
    for axis in 0..3 {
        let (bent, free) = bent_fit(observations, inputs, plain, axis, size)?;
        let before = axis_squares(observations, plain, inputs, axis);
        let after = axis_squares(&bent, &free, inputs, axis);
        let share = (before - after) / (after / left);
        let is_shown = AXES * chi_square_tail(before - after, 1.0) < FALSE_ALARM
            && f_tail(share, 1.0, left) < FALSE_ALARM_BY_RESIDUALS
            && widening(after, freedom) <= 1.0; // eq. 64
        if let Some((bend, _)) = free.drift.filter(|_| is_shown) {
            sum += (size * bend[axis]).powi(2);
            shown += 1;
        }
    }
    if shown == 0 {
        return Ok(None);
    }
    let usual = (sum / f64::from(shown)).sqrt(); // eq. 65
    assembled(observations, inputs, plain, usual, shown).map(Some)
}

/// Puts the fits of the three axes together, each with an asymmetry of a usual size.
fn assembled(
    observations: &[RateObservation<f64>],
    inputs: &FitInputs<f64, 6>,
    plain: &TriadFit<f64, 6>,
    usual: f64,
    shown: u32,
) -> Result<AsymmetricFit, TurntableError> {
    let mut solved = *plain;
    let mut settled = observations.to_vec();
    let mut asymmetry = (Vector3::zeros(), Vector3::zeros());
    solved.chi_square = 0.0;
    solved.degrees_of_freedom = plain.degrees_of_freedom.saturating_sub(shown);
    for (axis, own) in OF_AXIS.iter().enumerate() {
        let (bent, found) = bent_fit(observations, inputs, plain, axis, usual / LARGEST_RATE_BIAS)?;
        solved
            .model
            .matrix
            .set_row(axis, &found.model.matrix.row(axis).into_owned());
        solved.model.bias[axis] = found.model.bias[axis];
        for i in own {
            for j in own {
                solved.covariance[(*i, *j)] = found.covariance[(*i, *j)];
            }
        }
        solved.chi_square += axis_squares(&bent, &found, inputs, axis);
        let (bend, sigma) = found.drift.unwrap_or_default();
        for (observation, bent) in settled.iter_mut().zip(&bent) {
            observation.reading[axis] -= bend[axis] * bent.regressor[UNKNOWNS];
        }
        let of_slopes = 2.0 * usual / LARGEST_RATE_BIAS / found.model.matrix.row(axis).norm();
        asymmetry.0[axis] = of_slopes * bend[axis];
        asymmetry.1[axis] = of_slopes * sigma[axis];
    }
    Ok(AsymmetricFit {
        solved,
        observations: settled,
        asymmetry,
    })
}

/// Fits `y = M u + b + a |m u|` with m the row of M of an axis; `a` over `size` has the prior of a bias.
fn bent_fit(
    observations: &[RateObservation<f64>],
    inputs: &FitInputs<f64, 6>,
    plain: &TriadFit<f64, 6>,
    axis: usize,
    size: f64,
) -> Result<(Vec<BentObservation>, TriadFit<f64, 6>), TurntableError> {
    let row = plain.model.matrix.row(axis);
    let bent: Vec<_> = observations
        .iter()
        .map(|each| {
            let truth = each.regressor.fixed_rows::<3>(0);
            Observation {
                interval: each.interval,
                regressor: each.regressor.push(size * (row * truth)[0].abs()), // eq. 63
                reading: each.reading,
                reading_variance: each.reading_variance,
                truth_covariance: each.truth_covariance,
                sensitivity: each.sensitivity,
            }
        })
        .collect();
    let found = fit::<f64, 5, 6, 21>(&bent, inputs)?;
    Ok((bent, found))
}

/// Sum of squares of the residuals of an axis over their variances.
fn axis_squares<const P: usize>(
    observations: &[Observation<f64, P, 6>],
    solved: &TriadFit<f64, 6>,
    inputs: &FitInputs<f64, 6>,
    axis: usize,
) -> f64 {
    let matrix = solved.model.matrix;
    observations
        .iter()
        .map(|each| {
            let own = mean_covariance(&inputs.noise, &each.interval, &inputs.session);
            let noise = own + matrix * each.truth_covariance * matrix.transpose(); // eq. 12
            let variance = noise[(axis, axis)] + each.reading_variance[axis];
            solved.residual(each)[axis].powi(2) / variance
        })
        .sum()
}
