//! State at which the readings agree best, from a start in the sensor's own axes.

use super::alignment::rotation_by_dip;
use super::constancy::{Constancy, covariance_of};
use super::error::MagnetometerError;
use super::readings::FieldReadings;
use super::unknowns::{FieldUnknowns, State};
use crate::constant_length::reweighted::solve;

/// State, and the weight of each reading, from a start in the sensor's own axes.
pub(super) fn settle(
    data: &FieldReadings,
    strength: f64,
    begin: State,
    layout: FieldUnknowns,
) -> Result<(State, Vec<f64>), MagnetometerError> {
    let own_axes = FieldUnknowns {
        aligned: false,
        ..layout
    };
    let mut weights = vec![1.0; data.readings.len()];
    let lengths = Constancy::of(data, strength, own_axes);
    let x =
        solve(&lengths, begin.unknowns(own_axes), &mut weights).ok_or(MagnetometerError::FieldUnsolvable)?;
    let residuals = lengths.residuals(&x).ok_or(MagnetometerError::FieldUnsolvable)?;
    covariance_of(&lengths, &residuals, &weights)?;
    let mut state = State::of(&x, own_axes);
    if !layout.aligned {
        return Ok((state, weights));
    }
    let fields: Vec<_> = residuals.iter().map(|r| r.field).collect();
    let ups: Vec<_> = data
        .readings
        .iter()
        .filter_map(|reading| Some(reading.up?.direction))
        .collect();
    let (rotation, upward) = rotation_by_dip(&fields, &ups).ok_or(MagnetometerError::FieldUnsolvable)?;
    state.model.matrix *= rotation.matrix().transpose();
    state.upward = upward;
    weights.fill(1.0);
    let both = Constancy::of(data, strength, layout);
    let x = solve(&both, state.unknowns(layout), &mut weights).ok_or(MagnetometerError::FieldUnsolvable)?;
    Ok((State::of(&x, layout), weights))
}
