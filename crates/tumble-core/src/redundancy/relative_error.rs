//! Prediction of the reading of a secondary from that of the primary, and its inverse.

use nalgebra::{Matrix3, Vector3};

use crate::model::ErrorModel;
use crate::products::{columns, cross, identity, matrix_product, product, zeros};
use crate::real::Real;
use crate::redundancy::components::{difference, dot};
use crate::redundancy::record::Record;

/// Number of parameters of an error.
pub const ERROR_NUMBERS: usize = 15;

/// Error of one sensor of a secondary in its own axes: `y = M (u + W r) + b`, where `u` is the reading of the
/// primary turned into these axes by the nominal rotation, so that M is close to identity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeError<T: Real> {
    /// M.
    pub matrix: Matrix3<T>,
    /// b, m/s^2 or rad/s.
    pub bias: Vector3<T>,
    /// r, m, primary's case frame.
    pub lever_arm: Vector3<T>,
}

impl<T: Real> RelativeError<T> {
    /// No error.
    pub fn none() -> Self {
        Self {
            matrix: identity(),
            bias: zeros(),
            lever_arm: zeros(),
        }
    }

    /// Creates an error; `None` if M has no inverse.
    pub fn new(matrix: Matrix3<T>, bias: Vector3<T>, lever_arm: Vector3<T>) -> Option<Self> {
        let error = Self {
            matrix,
            bias,
            lever_arm,
        };
        let finite = error.numbers().all(|x| x.is_finite());
        let (_, determinant) = error.cofactors();
        let invertible = determinant.is_finite() && (T::one() / determinant).is_finite();
        (finite && invertible).then_some(error)
    }

    /// Parameters: M column by column, b, r.
    pub fn numbers(&self) -> impl Iterator<Item = T> {
        let numbers = self
            .matrix
            .iter()
            .chain(self.bias.iter())
            .chain(self.lever_arm.iter());
        numbers.copied()
    }

    /// Creates the error from a record, which includes the nominal rotation.
    pub fn of(record: &Record<T>, sensor_from_primary: &Matrix3<T>) -> Option<Self> {
        let matrix = matrix_product(&record.model.matrix, &sensor_from_primary.transpose());
        Self::new(matrix, record.model.bias, record.lever_arm)
    }

    /// Error model with the nominal rotation, like that of records.
    pub fn model(&self, sensor_from_primary: &Matrix3<T>) -> ErrorModel<T> {
        ErrorModel {
            matrix: matrix_product(&self.matrix, sensor_from_primary),
            bias: self.bias,
        }
    }

    /// Reading of the secondary, predicted from a reading `u` of the primary at its place.
    pub fn predict(&self, u: &Vector3<T>) -> Vector3<T> {
        product(&self.matrix, u) + self.bias // redundancy.md, eq. 5
    }

    /// Reading of the primary, at the place of the secondary and in its axes, computed from a reading `y` of
    /// the secondary.
    pub fn correct(&self, y: &Vector3<T>) -> Vector3<T> {
        let mut measured = [*y];
        self.correct_all(&mut measured);
        let [u] = measured;
        u
    }

    /// Corrects several readings in place.
    pub fn correct_all(&self, readings: &mut [Vector3<T>]) {
        let ([x, y, z], determinant) = self.cofactors();
        for reading in readings {
            let d = difference(reading, &self.bias);
            let [x, y, z] = [&x, &y, &z].map(|across| dot(across, &d) / determinant);
            *reading = Vector3::new(x, y, z);
        }
    }

    /// Cross products of the columns of M, and its determinant, for Cramer's rule. A stored inverse would cost
    /// a device with two secondaries 216 bytes.
    fn cofactors(&self) -> ([Vector3<T>; 3], T) {
        let [a, b, c] = columns(&self.matrix);
        let across = cross(&b, &c);
        ([across, cross(&c, &a), cross(&a, &b)], a.dot(&across))
    }
}
