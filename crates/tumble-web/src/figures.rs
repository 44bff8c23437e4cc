//! Arrays as the lists of an answer, and samples as the page lays them down.

use nalgebra::{Matrix3, SMatrix, Vector3};
use serde_json::{Value, json};

/// Samples of one unit in the numbers of a page: all times, then x, y, z of each specific force, then of each angular rate,
/// then temperatures where there are any.
pub struct Samples<'a> {
    /// s.
    pub time: &'a [f64],
    /// Specific force, m/s^2.
    pub force: &'a [[f64; 3]],
    /// Angular rate, rad/s.
    pub rate: &'a [[f64; 3]],
    /// Temperature, degC.
    pub temperature: Option<&'a [f64]>,
}

impl<'a> Samples<'a> {
    /// Finds the samples among the numbers, 7 of each, or 8 with a temperature.
    pub fn of(numbers: &'a [f64], has_temperature: bool) -> Self {
        let count = numbers.len() / if has_temperature { 8 } else { 7 };
        let (time, rest) = numbers.split_at(count);
        let (force, rest) = rest.split_at(3 * count);
        let (rate, temperature) = rest.split_at(3 * count);
        Self {
            time,
            force: force.as_chunks().0,
            rate: rate.as_chunks().0,
            temperature: has_temperature.then_some(temperature),
        }
    }

    /// Readings of the triads that were recorded.
    pub fn triads(&self, has_gyroscope: bool) -> [Option<&'a [[f64; 3]]>; 2] {
        [Some(self.force), has_gyroscope.then_some(self.rate)]
    }
}

/// Rows of a matrix.
pub fn matrix<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> Value {
    let rows: Vec<Vec<f64>> = matrix
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect();
    json!(rows)
}

/// Rows of a matrix of three.
pub fn square(of: &Matrix3<f64>) -> Value {
    matrix(of)
}

/// A vector as a list.
pub fn vector(of: &Vector3<f64>) -> Value {
    json!([of.x, of.y, of.z])
}

/// Vectors as a list of lists.
pub fn vectors(of: impl Iterator<Item = Vector3<f64>>) -> Value {
    json!(of.map(|each| [each.x, each.y, each.z]).collect::<Vec<_>>())
}
