//! A turn integrated from a gyroscope's readings, with the derivative of the result by the gyroscope's errors.

use nalgebra::{DMatrix, Matrix3, UnitQuaternion, Vector3};
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

impl RateModel {
    /// Reading of the gyroscope at this true rate and specific force.
    pub fn modelled(&self, rate: &Vector3<f64>, force: &Vector3<f64>) -> Vector3<f64> {
        self.model.measure(rate) + self.g_sensitivity * force // eq. 10
    }
}

/// Readings between two rests, from the end of the first to the start of the second.
#[derive(Clone, Debug)]
pub struct TurnSamples {
    /// s.
    pub time: Vec<f64>,
    /// Raw angular rate, rad/s.
    pub rate: Vec<Vector3<f64>>,
    /// True specific force, m/s^2.
    pub force: Vec<Vector3<f64>>,
}

/// A turn as integrated by a gyroscope with these errors.
#[derive(Clone, Debug)]
pub struct IntegratedTurn {
    /// Case at the end from case at the start.
    pub end_from_start: Matrix3<f64>,
    /// Rotation vector, in the case at its end, of what an error `du = e z_c` of the true rate adds, for each element
    /// `z_c` of the regressor; the first four where g-sensitivity is not asked for.
    response: Vec<Matrix3<f64>>,
}

impl TurnSamples {
    /// Length, s.
    pub fn duration(&self) -> f64 {
        self.time
            .last()
            .zip(self.time.first())
            .map_or(0.0, |(end, start)| end - start)
    }

    /// Case at the end from case at the start, rates straight between samples (docs/theory/multipose.md, eq. 11 and 12);
    /// `None` where M has no inverse.
    pub fn end_from_start(&self, errors: &RateModel) -> Option<UnitQuaternion<f64>> {
        let correction = errors.model.correction().ok()?;
        let mut end_from_start = UnitQuaternion::identity();
        self.for_each_step(&correction, errors, |step| {
            end_from_start = rotation_of(&-step.angle()) * end_from_start; // eq. 12
        });
        Some(end_from_start)
    }

    /// The same rotation with its derivative (docs/theory/multipose.md, eq. 11 to 13); `None` where M has no inverse.
    pub fn integrate(&self, errors: &RateModel, g_sensitivity: bool) -> Option<IntegratedTurn> {
        let correction = errors.model.correction().ok()?;
        let columns = if g_sensitivity { REGRESSORS } else { REGRESSORS - 3 };
        let mut turning = Turning::begin(columns);
        self.for_each_step(&correction, errors, |step| turning.advance(step));
        Some(turning.end())
    }

    fn for_each_step(
        &self,
        correction: &Correction<f64>,
        errors: &RateModel,
        mut take: impl FnMut(&RotationStep),
    ) {
        let truth = |k: usize| true_rate(correction, errors, &self.rate[k], &self.force[k]);
        let mut from = truth(0);
        for k in 1..self.time.len() {
            let to = truth(k);
            take(&RotationStep {
                duration: self.time[k] - self.time[k - 1],
                rates: [from, to],
                forces: [self.force[k - 1], self.force[k]],
            });
            from = to;
        }
    }
}

/// From one sample to the next: true rates and specific forces at both.
struct RotationStep {
    duration: f64,
    rates: [Vector3<f64>; 2],
    forces: [Vector3<f64>; 2],
}

impl RotationStep {
    /// Factor of the second order of coning, s^2.
    fn coning(&self) -> f64 {
        self.duration * self.duration / 12.0
    }

    /// Rotation vector of the step.
    fn angle(&self) -> Vector3<f64> {
        let [from, to] = &self.rates;
        (from + to) * (0.5 * self.duration) + from.cross(to) * self.coning() // eq. 11
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

/// A turn while it is integrated.
struct Turning {
    end_from_start: UnitQuaternion<f64>,
    /// Effect of an error of the true rate, seen from the case at the start, for each element of the regressor.
    response: Vec<Matrix3<f64>>,
    /// The regressor of the last sample, and what the steps to it and from it multiply it by.
    regressor: [f64; REGRESSORS],
    by_regressor: Matrix3<f64>,
}

impl Turning {
    fn begin(columns: usize) -> Self {
        Self {
            end_from_start: UnitQuaternion::identity(),
            response: vec![Matrix3::zeros(); columns],
            regressor: [0.0; REGRESSORS],
            by_regressor: Matrix3::zeros(),
        }
    }

    fn advance(&mut self, step: &RotationStep) {
        let [from, to] = &step.rates;
        let angle = step.angle();
        self.end_from_start = rotation_of(&-angle) * self.end_from_start; // eq. 12
        let start_from_end = self.end_from_start.inverse().to_rotation_matrix().into_inner();
        let turning = start_from_end * right_jacobian(&angle);
        let half = turning * (0.5 * step.duration);
        // The regressor of the first sample has been waiting for its second half.
        self.by_regressor += half - cross_rows(&turning, to) * step.coning(); // eq. 13
        self.regressor = regressor(from, &step.forces[0]);
        self.take();
        self.by_regressor = half + cross_rows(&turning, from) * step.coning(); // eq. 13
        self.regressor = regressor(to, &step.forces[1]);
    }

    fn take(&mut self) {
        for (response, regressor) in self.response.iter_mut().zip(self.regressor) {
            *response += self.by_regressor * regressor; // eq. 13
        }
    }

    fn end(mut self) -> IntegratedTurn {
        self.take();
        let end_from_start = self.end_from_start.to_rotation_matrix().into_inner();
        let response = self.response.iter().map(|each| end_from_start * each);
        IntegratedTurn {
            response: response.collect(),
            end_from_start,
        }
    }
}

fn regressor(rate: &Vector3<f64>, force: &Vector3<f64>) -> [f64; REGRESSORS] {
    [rate.x, rate.y, rate.z, 1.0, force.x, force.y, force.z]
}

/// `A [v]_x`: each row of A crossed with v.
fn cross_rows(matrix: &Matrix3<f64>, v: &Vector3<f64>) -> Matrix3<f64> {
    let column = |i| matrix.fixed_view::<3, 1>(0, i).into_owned();
    let (x, y, z) = (column(0), column(1), column(2));
    Matrix3::from_columns(&[y * v.z - z * v.y, z * v.x - x * v.z, x * v.y - y * v.x])
}

impl IntegratedTurn {
    /// Derivative of a direction carried through the turn, `to = R from`, by `[M row by row, b]`, and by G row by row where
    /// that was asked for (docs/theory/multipose.md, eq. 14).
    pub fn derivative(&self, to: &Vector3<f64>, case_from_sensor: &Matrix3<f64>) -> DMatrix<f64> {
        let turning = -cross_matrix(to);
        self.by_unknown(|response| turning * response * case_from_sensor) // eq. 14
    }

    /// Derivative of the rotation vector of the end, in the case there, by the same unknowns.
    pub fn rotation_derivative(&self, case_from_sensor: &Matrix3<f64>) -> DMatrix<f64> {
        self.by_unknown(|response| response * case_from_sensor)
    }

    fn by_unknown(&self, of: impl Fn(&Matrix3<f64>) -> Matrix3<f64>) -> DMatrix<f64> {
        let mut derivative = DMatrix::zeros(3, 3 * self.response.len());
        for (column, response) in self.response.iter().enumerate() {
            let each = of(response);
            for row in 0..3 {
                let unknown = match column {
                    0..3 => 3 * row + column,
                    3 => 9 + row,
                    _ => 12 + 3 * row + column - 4,
                };
                derivative.column_mut(unknown).copy_from(&each.column(row));
            }
        }
        derivative
    }
}

/// `exp(phi + d) = exp(phi) exp(J d)` for the short angles of a sample: `1 - h/2 + h^2/6 - h^3/24` with `h = [phi]_x`, of
/// which `h^2 = phi phi' - |phi|^2` and `h^3 = -|phi|^2 h`.
fn right_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let square = phi.norm_squared();
    let mut jacobian = phi * phi.transpose() / 6.0 - cross_matrix(phi) * (0.5 - square / 24.0);
    for i in 0..3 {
        jacobian[(i, i)] += 1.0 - square / 6.0;
    }
    jacobian
}
