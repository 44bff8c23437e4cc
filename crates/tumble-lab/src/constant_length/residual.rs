//! Error of the length of a corrected vector (docs/theory/multipose.md, eq. 1 to 4).

use nalgebra::{SVector, Vector3};
use tumble_core::model::{Correction, PARAMETERS};

/// Length of a corrected vector against its known length.
#[derive(Clone, Copy, Debug)]
pub struct LengthResidual {
    /// `|u|` less the known length, unit of the readings.
    pub value: f64,
    /// 1-sigma of the same from noise, unit of the readings.
    pub sigma: f64,
    /// Excess of the length that noise across the vector causes on average, unit of the readings.
    pub excess: f64,
    /// Corrected vector, unit of the readings.
    pub vector: Vector3<f64>,
    /// Derivative of the value by `[M row by row, b]`.
    pub row: SVector<f64, PARAMETERS>,
}

impl LengthResidual {
    /// The residual of a reading of known variance.
    pub fn of(
        correction: &Correction<f64>,
        mean: &Vector3<f64>,
        variance: &Vector3<f64>,
        length: f64,
    ) -> Self {
        let vector = correction.apply(mean); // eq. 1
        let found = vector.norm();
        // Response of the length to the reading: C^T u / |u|.
        let response = correction.matrix.tr_mul(&vector) / found; // eq. 3
        let along = response.component_mul(&response).dot(variance);
        let columns = (0..3).map(|axis| correction.matrix.column(axis).norm_squared() * variance[axis]);
        let total: f64 = columns.sum();
        Self {
            value: found - length, // eq. 2
            sigma: along.sqrt(),   // eq. 4
            excess: 0.5 * (total - along).max(0.0) / found,
            vector,
            row: derivative(&response, &vector),
        }
    }

    /// Derivative of the value by the reading.
    pub fn response(&self) -> Vector3<f64> {
        -self.row.fixed_rows::<3>(9)
    }
}

/// Derivative of a component of the corrected vector by `[M row by row, b]`, by its response to the reading
/// (docs/theory/multipose.md, eq. 3).
pub fn derivative(response: &Vector3<f64>, vector: &Vector3<f64>) -> SVector<f64, PARAMETERS> {
    SVector::from_fn(|place, _| match place {
        0..9 => -response[place / 3] * vector[place % 3],
        place => -response[place - 9],
    })
}
