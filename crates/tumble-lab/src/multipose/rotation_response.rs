//! A turn integrated from a gyroscope's readings, with the derivative of the result by the gyroscope's errors.

use nalgebra::{DMatrix, Matrix3, SMatrix, UnitQuaternion, Vector3};
use tumble_core::model::{Correction, ErrorModel};
use tumble_core::rotation::{cross_matrix, rotation_of};

/// Columns of the regressor `[u, 1, f]`: true rate, one for the bias, true specific force for g-sensitivity.
pub const REGRESSORS: usize = 7;

/// Errors of a gyroscope: `y = M u + b + G f`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateModel {
    /// M and b.
    pub model: ErrorModel<f64>,
    /// G, rad/s per m/s^2; zero where it is not asked for.
    pub g_sensitivity: Matrix3<f64>,
}

/// What was read between two rests, from the end of the first to the start of the second.
#[derive(Clone, Debug)]
pub struct TurnSamples {
    /// s.
    pub time: Vec<f64>,
    /// rad/s, as read.
    pub rate: Vec<Vector3<f64>>,
    /// True specific force, m/s^2.
    pub force: Vec<Vector3<f64>>,
}

/// A turn as a gyroscope with these errors tells it.
#[derive(Clone, Debug)]
pub struct IntegratedTurn {
    /// Case at the end from case at the start.
    pub end_from_start: Matrix3<f64>,
    /// Rotation vector, in the case at its end, of what an error `du = [e_1 e_2 e_3] z` of the true rate adds: three
    /// columns for each element of the regressor.
    response: SMatrix<f64, 3, { 3 * REGRESSORS }>,
}

impl RateModel {
    /// What the gyroscope reads where rate and specific force truly are these.
    pub fn modelled(&self, rate: &Vector3<f64>, force: &Vector3<f64>) -> Vector3<f64> {
        self.model.measure(rate) + self.g_sensitivity * force // eq. 10
    }
}

impl TurnSamples {
    /// Length, s.
    pub fn duration(&self) -> f64 {
        self.time
            .last()
            .zip(self.time.first())
            .map_or(0.0, |(end, start)| end - start)
    }

    /// Integrates sample by sample, rates straight between samples (docs/theory/multipose.md, eq. 11 to 13); `None` where
    /// M has no inverse.
    pub fn integrate(&self, errors: &RateModel) -> Option<IntegratedTurn> {
        let correction = errors.model.correction().ok()?;
        let truth = |k: usize| true_rate(&correction, errors, &self.rate[k], &self.force[k]);
        let mut turned = IntegratedTurn {
            end_from_start: Matrix3::identity(),
            response: SMatrix::zeros(),
        };
        let mut from = truth(0);
        for k in 1..self.time.len() {
            let to = truth(k);
            let dt = self.time[k] - self.time[k - 1];
            turned.advance(dt, (&from, &self.force[k - 1]), (&to, &self.force[k]));
            from = to;
        }
        Some(turned)
    }
}

fn true_rate(
    correction: &Correction<f64>,
    errors: &RateModel,
    rate: &Vector3<f64>,
    force: &Vector3<f64>,
) -> Vector3<f64> {
    correction.apply(&(rate - errors.g_sensitivity * force)) // eq. 10
}

fn regressor(rate: &Vector3<f64>, force: &Vector3<f64>) -> [f64; REGRESSORS] {
    [rate.x, rate.y, rate.z, 1.0, force.x, force.y, force.z]
}

impl IntegratedTurn {
    /// One step; `from` and `to` are true rate and specific force at its ends.
    fn advance(&mut self, dt: f64, from: (&Vector3<f64>, &Vector3<f64>), to: (&Vector3<f64>, &Vector3<f64>)) {
        let coning = dt * dt / 12.0;
        let angle = (from.0 + to.0) * (0.5 * dt) + from.0.cross(to.0) * coning; // eq. 11
        let back: UnitQuaternion<f64> = rotation_of(&-angle);
        let back = back.to_rotation_matrix().into_inner();
        let jacobian = right_jacobian(&angle);
        let half = Matrix3::identity() * (0.5 * dt);
        let by_first = jacobian * (half - cross_matrix(to.0) * coning); // eq. 13
        let by_second = jacobian * (half + cross_matrix(from.0) * coning); // eq. 13
        self.end_from_start = back * self.end_from_start; // eq. 12
        self.response = back * self.response; // eq. 13
        let (first, second) = (regressor(from.0, from.1), regressor(to.0, to.1));
        for column in 0..REGRESSORS {
            let mut own = self.response.fixed_columns_mut::<3>(3 * column);
            own += by_first * first[column] + by_second * second[column]; // eq. 13
        }
    }

    /// Derivative of a direction carried through the turn, `to = R from`, by `[M row by row, b]`, and by G row by row where
    /// `unknowns` are 21 (docs/theory/multipose.md, eq. 14).
    pub fn derivative(
        &self,
        to: &Vector3<f64>,
        case_from_sensor: &Matrix3<f64>,
        unknowns: usize,
    ) -> DMatrix<f64> {
        let turning = -cross_matrix(to);
        let mut derivative = DMatrix::zeros(3, unknowns);
        for column in 0..REGRESSORS {
            let each = turning * self.response.fixed_columns::<3>(3 * column) * case_from_sensor; // eq. 14
            for row in 0..3 {
                let unknown = match column {
                    0..3 => 3 * row + column,
                    3 => 9 + row,
                    _ => 12 + 3 * row + column - 4,
                };
                if unknown < unknowns {
                    derivative.column_mut(unknown).copy_from(&each.column(row));
                }
            }
        }
        derivative
    }
}

/// `exp(phi + d) = exp(phi) exp(J d)` for the short angles of a sample.
fn right_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let hat = cross_matrix(phi);
    let square = hat * hat;
    Matrix3::identity() - hat * 0.5 + square / 6.0 - square * hat / 24.0
}
