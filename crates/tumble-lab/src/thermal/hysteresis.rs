//! The loop between warming and cooling: largest and mean difference of both legs at equal temperature
//! (docs/theory/thermal.md, Hysteresis).

use nalgebra::{DMatrix, DVector};

use super::fit::{DriftFit, KNOTS};
use crate::distributions::{INTERVAL, chi_square_tail, median, student_quantile};

/// Chance of a chi-square below which the difference is no constant.
const UNLIKELY: f64 = 0.01;
/// Chance below which there is a difference: that of four sigmas.
const CLEAR: f64 = 6e-5;
/// Median sigmas beyond which a knot is too uncertain to be called the largest.
const FAR_FROM_DATA: f64 = 3.0;
/// Share beyond one end of a 95 % interval.
const BEYOND: f64 = 0.025;

/// By how much more is read while warming than while cooling.
#[derive(Clone, Debug, PartialEq)]
pub struct Hysteresis {
    /// Temperature less the reference, K, difference and its 1-sigma; one of each where the difference is a constant.
    pub knots: Vec<[f64; 3]>,
    /// Largest difference, with its sign, and a 1-sigma that holds wherever in the range it was found.
    pub largest: [f64; 2],
    /// Mean over temperature and its 1-sigma.
    pub mean: [f64; 2],
    /// True where it is beyond chance.
    pub is_clear: bool,
}

impl Hysteresis {
    /// Hysteresis of a fit with a constant or a curve; None where it has neither.
    pub fn of(fit: &DriftFit) -> Option<Self> {
        let first = fit.terms.bias + fit.terms.scale;
        let count = fit.terms.hysteresis;
        let values = DVector::from_column_slice(fit.hysteresis());
        let covariance = fit.covariance.view((first, first), (count, count)).into_owned();
        match count {
            0 => None,
            1 => Some(Self::constant(fit, values[0], covariance[(0, 0)].sqrt())),
            _ => Self::curve(fit, &values, &covariance),
        }
    }

    fn constant(fit: &DriftFit, value: f64, sigma: f64) -> Self {
        Self {
            knots: vec![[0.5 * (fit.shared[0] + fit.shared[1]), value, sigma]],
            largest: [value, sigma],
            mean: [value, sigma],
            is_clear: chi_square_tail((value / sigma).powi(2), 1.0) < CLEAR,
        }
    }

    fn curve(fit: &DriftFit, values: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<Self> {
        let count = values.len();
        let sigmas = covariance.diagonal().map(f64::sqrt);
        let trapezoid = DVector::from_fn(count, |knot, _| {
            let share = if knot == 0 || knot == count - 1 { 0.5 } else { 1.0 };
            share / (count - 1) as f64
        });
        let mut all: Vec<f64> = sigmas.iter().copied().collect();
        let usual = median(&mut all)?;
        let known = |knot: &usize| sigmas[*knot] <= FAR_FROM_DATA * usual;
        let largest = (0..count)
            .filter(known)
            .max_by(|a, b| values[*a].abs().total_cmp(&values[*b].abs()))?;
        // The largest of several differs from its truth by more than one of them alone.
        let of_several = student_quantile(1.0 - BEYOND / count as f64, f64::MAX.sqrt()) / INTERVAL; // eq. 13
        let [low, high] = fit.shared;
        let at = |knot: usize| low + (high - low) * knot as f64 / (count - 1) as f64;
        let squares = values.dot(&covariance.clone().cholesky()?.solve(values));
        Some(Self {
            knots: (0..count)
                .map(|knot| [at(knot), values[knot], sigmas[knot]])
                .collect(),
            largest: [values[largest], of_several * sigmas[largest]],
            mean: [
                trapezoid.dot(values),
                trapezoid.dot(&(covariance * &trapezoid)).sqrt(),
            ],
            is_clear: chi_square_tail(squares, count as f64) < CLEAR,
        })
    }
}

/// True where a fit with a curve shows that the difference is no constant.
pub fn is_curve(fit: &DriftFit) -> bool {
    let first = fit.terms.bias + fit.terms.scale;
    let values = DVector::from_column_slice(fit.hysteresis());
    let covariance = fit.covariance.view((first, first), (KNOTS, KNOTS)).into_owned();
    let Some(factor) = covariance.cholesky() else {
        return false;
    };
    let weights = factor.solve(&DVector::from_element(KNOTS, 1.0));
    let off = values.add_scalar(-weights.dot(&values) / weights.sum());
    chi_square_tail(off.dot(&factor.solve(&off)), (KNOTS - 1) as f64) < UNLIKELY // eq. 14
}
