//! Which turn to add: the one that lowers the largest sigma of the gyroscope most.

use nalgebra::{DMatrix, DVector, Matrix2, Vector3};
use rayon::prelude::*;
use tumble_core::model::ErrorModel;

use super::gyroscope::{Rotations, RotationsFit};
use super::rotation_response::{RateModel, TurnSamples};
use crate::constant_length::directions::covering;
use crate::distributions::median;

/// Axes all over the sphere, 12 deg apart.
const CANDIDATES: u32 = 360;

/// Samples of a turn at an even rate, which any number shows.
const SAMPLES: u32 = 20;

/// A turn that is worth adding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextTurn {
    /// Axis to turn about by half a turn, a unit vector in the case frame.
    pub axis: Vector3<f64>,
    /// Direction that is up at its start, across the axis, in the case frame.
    pub up: Vector3<f64>,
    /// Largest sigma as it is, in units of scale or of what bias and g-sensitivity may be.
    pub before: f64,
    /// The same with that turn.
    pub after: f64,
    /// Place of that unknown in `[M row by row, b]`, then G row by row.
    pub unknown: usize,
}

/// Tries half turns of median noise about level axes all over the sphere (docs/theory/multipose.md, eq. 9).
pub fn next_turn(data: &Rotations, fit: &RotationsFit) -> Option<NextTurn> {
    let sizes = data.sizes();
    let largest = |variances: DVector<f64>| variances.map(f64::sqrt).component_div(&sizes).argmax();
    let (unknown, before) = largest(fit.covariance.diagonal());
    let variance = median(&mut fit.turn_variance.clone())?;
    let mut durations: Vec<f64> = data.turns.iter().map(|turn| turn.samples.duration()).collect();
    let duration = median(&mut durations)?;
    let candidates: Vec<_> = covering(CANDIDATES)
        .flat_map(|axis| starts(axis).map(|up| (axis, up)))
        .collect();
    let tried: Vec<_> = candidates
        .par_iter()
        .filter_map(|(axis, up)| {
            let rows = rows(data, &fit.errors, axis, up, duration)? / variance.sqrt();
            let gain = &fit.covariance * rows.transpose();
            let scatter =
                Matrix2::identity() + Matrix2::from_fn(|i, j| rows.row(i).dot(&gain.column(j).transpose()));
            let inverse = scatter.try_inverse()?;
            let after = DVector::from_fn(gain.nrows(), |i, _| {
                let own = gain.row(i);
                let own = nalgebra::Vector2::new(own[0], own[1]);
                fit.covariance[(i, i)] - own.dot(&(inverse * own)) // eq. 9
            });
            Some(NextTurn {
                axis: *axis,
                up: *up,
                before,
                after: largest(after).1,
                unknown,
            })
        })
        .collect();
    tried.into_iter().min_by(|a, b| a.after.total_cmp(&b.after))
}

/// Two directions across an axis, across each other.
fn starts(axis: Vector3<f64>) -> [Vector3<f64>; 2] {
    let across = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    [across, axis.cross(&across)]
}

/// Derivative of where gravity is found after half a turn, by the unknowns: the two directions it can err in.
fn rows(
    data: &Rotations,
    errors: &RateModel,
    axis: &Vector3<f64>,
    up: &Vector3<f64>,
    duration: f64,
) -> Option<DMatrix<f64>> {
    let rate = axis * (std::f64::consts::PI / duration);
    let gravity = data.rests.first()?.force.norm();
    let time: Vec<f64> = (0..=SAMPLES)
        .map(|k| duration * f64::from(k) / f64::from(SAMPLES))
        .collect();
    // Up, as the case sees it while it turns.
    let force: Vec<_> = time
        .iter()
        .map(|t| nalgebra::Rotation3::new(-rate * *t) * up * gravity)
        .collect();
    let samples = TurnSamples {
        rate: force.iter().map(|force| errors.modelled(&rate, force)).collect(),
        time,
        force,
    };
    let turned = samples.integrate(errors, data.g_sensitivity)?;
    let end = turned.end_from_start * up;
    let model: &ErrorModel<f64> = &errors.model;
    let derivative = turned.derivative(&end, &model.correction().ok()?.matrix);
    let across = starts(end.normalize());
    let basis = DMatrix::from_fn(2, 3, |i, j| across[i][j]);
    Some(basis * derivative)
}
