//! What a secondary says where the primary says something, and back.

use nalgebra::{Matrix3, Vector3};

use crate::model::ErrorModel;
use crate::products::{columns, cross, identity, matrix_product, product, zeros};
use crate::real::Real;
use crate::redundancy::components::{difference, dot};
use crate::redundancy::record::Record;

/// How many numbers an error is.
pub const ERROR_NUMBERS: usize = 15;

/// Error of one sensor of a secondary in its own axes: `y = M (u + W r) + b`, `u` being what the primary reads turned
/// into these axes by the nominal rotation, so that M is close to identity.
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

    /// `None` where M has no inverse.
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

    /// M column by column, b, r.
    pub fn numbers(&self) -> impl Iterator<Item = T> {
        let numbers = self
            .matrix
            .iter()
            .chain(self.bias.iter())
            .chain(self.lever_arm.iter());
        numbers.copied()
    }

    /// Of a record, which holds the nominal rotation too.
    pub fn of(record: &Record<T>, sensor_from_primary: &Matrix3<T>) -> Option<Self> {
        let matrix = matrix_product(&record.model.matrix, &sensor_from_primary.transpose());
        Self::new(matrix, record.model.bias, record.lever_arm)
    }

    /// With the nominal rotation, as records hold it.
    pub fn model(&self, sensor_from_primary: &Matrix3<T>) -> ErrorModel<T> {
        ErrorModel {
            matrix: matrix_product(&self.matrix, sensor_from_primary),
            bias: self.bias,
        }
    }

    /// What the secondary says where the primary, at its place, says `u`.
    pub fn predict(&self, u: &Vector3<T>) -> Vector3<T> {
        product(&self.matrix, u) + self.bias // redundancy.md, eq. 5
    }

    /// What the primary would say, at the place of the secondary and in its axes, where the secondary says `y`.
    pub fn correct(&self, y: &Vector3<T>) -> Vector3<T> {
        let mut said = [*y];
        self.correct_all(&mut said);
        let [u] = said;
        u
    }

    /// The same of several readings, in place.
    pub fn correct_all(&self, readings: &mut [Vector3<T>]) {
        let ([x, y, z], determinant) = self.cofactors();
        for reading in readings {
            let d = difference(reading, &self.bias);
            let [x, y, z] = [&x, &y, &z].map(|across| dot(across, &d) / determinant);
            *reading = Vector3::new(x, y, z);
        }
    }

    /// The cross products of the columns of M and its determinant: all that Cramer's rule needs. An inverse that is kept
    /// would cost a device with two secondaries 216 bytes.
    fn cofactors(&self) -> ([Vector3<T>; 3], T) {
        let [a, b, c] = columns(&self.matrix);
        let across = cross(&b, &c);
        ([across, cross(&c, &a), cross(&a, &b)], a.dot(&across))
    }
}
