//! Residuals of an accelerometer that go with the direction of gravity: a fixture that gives way under the weight of the
//! unit, or a response that is not linear (docs/theory/turntable.md, section 14).
//!
//! Both are alike at opposite faces and whenever a face is shown again, so that no repetition averages them out.

use nalgebra::Vector3;
use tumble_core::turntable::fit::{TriadFit, fit};
use tumble_core::turntable::observation::FitInputs;
use tumble_core::turntable::truth::ForceObservation;

use super::error::TurntableError;
use super::reference::mean_covariance;
use crate::distributions::{chi_square_tail, f_tail};

/// Cosine of the angle within which two directions, or their opposites, are one.
const ALIKE: f64 = 0.98;

/// Chance of a misfit where there is none, by the noise that rests show, and by what repetitions of a direction show.
const FALSE_ALARM: f64 = 1e-3;
const FALSE_ALARM_BY_REPEATS: f64 = 1e-2;

/// Unknowns of an accelerometer.
const UNKNOWNS: usize = 12;

/// Variances, (m/s^2)^2, between which the one that explains the residuals is sought: a unit that is tilted by more than
/// 3 deg did not turn as the reference did.
const SOUGHT: (f64, f64) = (1e-12, 0.25);

const BISECTIONS: u32 = 40;

/// Misfit that goes with direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DirectionMisfit {
    /// Variance of an axis in one direction, (m/s^2)^2.
    pub variance: f64,
    /// Mean square of the residuals between directions over what noise explains.
    pub excess: f64,
    /// Degrees of freedom that it is known with.
    pub freedom: f64,
}

/// Residuals between directions, and within those that were shown again.
struct DirectionSums {
    between: f64,
    within: f64,
}

/// The misfit that residuals show under the noise of the rests; `None` where they show none, or repetitions of a direction
/// scatter as much (docs/theory/turntable.md, eq. 53 and 54). `taken_off` numbers were fitted to the observations before.
pub(super) fn direction_misfit(
    observations: &[ForceObservation<f64>],
    inputs: &FitInputs<f64, 3>,
    taken_off: usize,
) -> Result<Option<DirectionMisfit>, TurntableError> {
    let directions = grouped(observations, |cosine| cosine > ALIKE);
    let shown = directions.iter().max().map_or(0, |last| last + 1);
    let Some(between) = (3 * shown)
        .checked_sub(UNKNOWNS + taken_off)
        .filter(|freedom| *freedom > 0)
    else {
        return Ok(None);
    };
    #[allow(clippy::cast_precision_loss)]
    let (between, within) = (between as f64, (3 * (observations.len() - shown)) as f64);
    let sums = |variance: f64| -> Result<DirectionSums, TurntableError> {
        let with = with_misfit(observations, variance);
        let solved = fit::<f64, 4, 3, 15>(&with, inputs)?;
        Ok(sums(&with, &solved, inputs, &directions))
    };
    let plain = sums(0.0)?;
    if chi_square_tail(plain.between, between) >= FALSE_ALARM {
        return Ok(None);
    }
    if within > 0.0 {
        let ratio = plain.between / between / (plain.within / within).max(1.0);
        if f_tail(ratio, between, within) >= FALSE_ALARM_BY_REPEATS {
            return Ok(None); // eq. 53
        }
    }
    if sums(SOUGHT.1)?.between > between {
        return Ok(None);
    }
    let (mut low, mut high) = (SOUGHT.0.ln(), SOUGHT.1.ln());
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if sums(middle.exp())?.between > between {
            low = middle;
        } else {
            high = middle;
        } // eq. 54
    }
    Ok(Some(DirectionMisfit {
        variance: high.exp(),
        excess: plain.between / between,
        freedom: between,
    }))
}

/// Sum of squares within directions that were shown again, and its degrees of freedom.
pub(super) fn within_directions(
    observations: &[ForceObservation<f64>],
    inputs: &FitInputs<f64, 3>,
) -> Result<(f64, f64), TurntableError> {
    let directions = grouped(observations, |cosine| cosine > ALIKE);
    let shown = directions.iter().max().map_or(0, |last| last + 1);
    let solved = fit::<f64, 4, 3, 15>(observations, inputs)?;
    #[allow(clippy::cast_precision_loss)]
    let freedom = (3 * (observations.len() - shown)) as f64;
    Ok((sums(observations, &solved, inputs, &directions).within, freedom))
}

/// The same rests, each as uncertain as makes their mean along a line, there and back, uncertain by the variance.
pub(super) fn with_misfit(
    observations: &[ForceObservation<f64>],
    variance: f64,
) -> Vec<ForceObservation<f64>> {
    let lines = grouped(observations, |cosine| cosine.abs() > ALIKE);
    let each = observations.iter().zip(&lines);
    each.map(|(observation, line)| {
        let alike = lines.iter().filter(|other| *other == line).count();
        #[allow(clippy::cast_precision_loss)]
        let added = variance * alike as f64; // eq. 54
        ForceObservation {
            reading_variance: observation.reading_variance.add_scalar(added),
            ..*observation
        }
    })
    .collect()
}

/// Number of the direction of each rest, in the order in which they were first shown.
fn grouped(observations: &[ForceObservation<f64>], alike: impl Fn(f64) -> bool) -> Vec<usize> {
    let mut firsts: Vec<Vector3<f64>> = Vec::new();
    let each = observations.iter().map(|observation| {
        let up = observation.regressor.fixed_rows::<3>(0).normalize();
        firsts
            .iter()
            .position(|first| alike(first.dot(&up)))
            .unwrap_or_else(|| {
                firsts.push(up);
                firsts.len() - 1
            })
    });
    each.collect()
}

fn sums(
    observations: &[ForceObservation<f64>],
    solved: &TriadFit<f64, 3>,
    inputs: &FitInputs<f64, 3>,
    directions: &[usize],
) -> DirectionSums {
    let m = solved.model.matrix;
    let each: Vec<_> = observations
        .iter()
        .map(|observation| {
            let own = mean_covariance(&inputs.noise, &observation.interval, &inputs.session);
            let of_truth = m * observation.truth_covariance * m.transpose();
            let variance = (own + of_truth).diagonal() + observation.reading_variance;
            (solved.residual(observation), variance)
        })
        .collect();
    let (mut all, mut between) = (0.0, 0.0);
    for axis in 0..3 {
        let last = directions.iter().max().map_or(0, |last| last + 1);
        let (mut weights, mut weighted) = (vec![0.0; last], vec![0.0; last]);
        for ((residual, variance), direction) in each.iter().zip(directions) {
            all += residual[axis].powi(2) / variance[axis];
            weights[*direction] += variance[axis].recip();
            weighted[*direction] += residual[axis] / variance[axis];
        }
        between += weighted
            .iter()
            .zip(&weights)
            .map(|(sum, weight)| sum * sum / weight)
            .sum::<f64>();
    }
    DirectionSums {
        between,
        within: (all - between).max(0.0),
    }
}
