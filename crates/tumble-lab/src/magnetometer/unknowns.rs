//! Unknowns of a fit, and where they stand in the state of a magnetometer and the field.

use nalgebra::{DVector, Matrix3, Vector3};
use tumble_core::model::{ErrorModel, PARAMETERS};

/// `[M row by row, b, response to current, upward part of the field]`.
pub(super) const STATE: usize = 16;

pub(super) const CURRENT: usize = PARAMETERS;
pub(super) const UPWARD: usize = 15;

/// Unknowns of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FieldUnknowns {
    /// All of M, and the upward part of the field: readings know up.
    pub(super) aligned: bool,
    pub(super) current: bool,
}

impl FieldUnknowns {
    /// Where the unknowns stand in the state.
    pub(super) fn places(self) -> Vec<usize> {
        let matrix: &[usize] = if self.aligned {
            &[0, 1, 2, 3, 4, 5, 6, 7, 8]
        } else {
            &[0, 3, 4, 6, 7, 8]
        };
        let current = if self.current { CURRENT..UPWARD } else { 0..0 };
        let upward = self.aligned.then_some(UPWARD);
        matrix
            .iter()
            .copied()
            .chain(9..12)
            .chain(current)
            .chain(upward)
            .collect()
    }

    pub(super) fn components(self) -> usize {
        1 + usize::from(self.aligned)
    }
}

/// State of a magnetometer and the field.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub(super) model: ErrorModel<f64>,
    pub(super) current: Vector3<f64>,
    pub(super) upward: f64,
}

impl State {
    pub(super) fn of(x: &DVector<f64>, layout: FieldUnknowns) -> Self {
        let mut all = [0.0; STATE];
        for (place, value) in layout.places().into_iter().zip(x.iter()) {
            all[place] = *value;
        }
        Self {
            model: ErrorModel {
                matrix: Matrix3::from_row_slice(&all[..9]),
                bias: Vector3::from_column_slice(&all[9..12]),
            },
            current: Vector3::from_column_slice(&all[CURRENT..UPWARD]),
            upward: all[UPWARD],
        }
    }

    pub(super) fn unknowns(&self, layout: FieldUnknowns) -> DVector<f64> {
        let value = |place: usize| match place {
            0..9 => self.model.matrix[(place / 3, place % 3)],
            9..12 => self.model.bias[place - 9],
            CURRENT..UPWARD => self.current[place - CURRENT],
            _ => self.upward,
        };
        let places = layout.places();
        DVector::from_iterator(places.len(), places.iter().map(|place| value(*place)))
    }
}
