//! Uncertainty of the reference, and the part of it that the targets inherit (docs/theory/uncertainty.md).
//!
//! Corrected by its calibration, a reference reads `(I + E) u + e`. The covariance of E and e follows from that of the
//! calibration, or from the figures of a grade. The response of a target's M and b to E and e is measured on the fit
//! itself: the reference is deviated by a small share of each principal direction, and the target is fitted anew.

use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector3};
use tumble_core::model::{ErrorModel, ModelCovariance};
use tumble_core::segmenter::Segment;

use super::error::TurntableError;
use super::reference::{DeviatedReference, Reference, ReferenceUncertainty, Ups, fit_reference};
use super::session::TargetSession;
use super::settings::{FEWEST_RESTS, TurntableSettings};
use crate::acquisition::Acquired;
use crate::distributions::chi_square_tail;
#[cfg(feature = "workstation")]
use crate::simulate::grade::TriadGrade;

/// Covariance of `[E row by row, e]` of a reference corrected by a calibration, from that of `[M row by row, b]`; `None`
/// where M has no inverse.
pub fn of_calibration(
    matrix: &Matrix3<f64>,
    covariance: &ModelCovariance<f64>,
) -> Option<ModelCovariance<f64>> {
    let correction = matrix.try_inverse()?;
    let mut jacobian = ModelCovariance::zeros();
    for i in 0..3 {
        for k in 0..3 {
            for column in 0..3 {
                jacobian[(3 * i + column, 3 * k + column)] = -correction[(i, k)]; // eq. 2
            }
            jacobian[(9 + i, 9 + k)] = -correction[(i, k)]; // eq. 2
        }
    }
    Some(jacobian * covariance * jacobian.transpose())
}

/// Covariance of `[E row by row, e]` of a unit of a grade as delivered.
#[cfg(feature = "workstation")]
pub fn of_grade(grade: &TriadGrade) -> ModelCovariance<f64> {
    let mut covariance = ModelCovariance::zeros();
    let mut add = |elements: &[(usize, f64)], sigma: f64| {
        let mut direction = SVector::<f64, 12>::zeros();
        for &(at, sign) in elements {
            direction[at] = sign * sigma;
        }
        covariance += direction * direction.transpose(); // eq. 4
    };
    for axis in 0..3 {
        add(&[(4 * axis, 1.0)], grade.scale_error);
        add(&[(9 + axis, 1.0)], grade.turn_on_bias);
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        add(&[(3 * i + j, -1.0), (3 * j + i, 1.0)], grade.alignment);
        let (first, later) = (i.min(j), i.max(j));
        add(&[(3 * later + first, 1.0)], grade.non_orthogonality);
    }
    covariance
}

/// Step along a principal direction, as a share of its sigma: responses are linear in it.
const STEP: f64 = 1e-3;

/// Deviation of one triad: `u + E u + e`.
pub(super) type ModelDeviation = (Matrix3<f64>, Vector3<f64>);

impl Reference {
    /// Takes in how uncertain the reference is.
    ///
    /// # Errors
    /// [`TurntableError`] as [`fit_reference`].
    pub fn with_uncertainty(
        mut self,
        unit: &Acquired,
        ups: &Ups,
        settings: &TurntableSettings,
        gyroscope: bool,
        uncertainty: ReferenceUncertainty,
    ) -> Result<Self, TurntableError> {
        if uncertainty.accelerometer.is_some() || settings.gravity_sigma > 0.0 {
            let stated = uncertainty.accelerometer.unwrap_or_else(ModelCovariance::zeros);
            self.norm_explained = explains_norm(unit, &self, &stated, settings)?;
        }
        if uncertainty != ReferenceUncertainty::default() {
            let (force, rate) = (roots(uncertainty.accelerometer), roots(uncertainty.gyroscope));
            for (force, rate) in force.iter().zip(&rate) {
                let unit = deviated(unit, force, rate);
                let mut reference = fit_reference(&unit, ups, settings, gyroscope)?;
                reference.norm_explained = self.norm_explained;
                reference.table.clone_from(&self.table);
                if unit.rests.is_empty() {
                    // Without rests, the rotation of the Earth is that of the fit.
                    reference.earth = self.earth;
                }
                self.deviated.push(DeviatedReference { unit, reference });
            }
        }
        self.uncertainty = uncertainty;
        Ok(self)
    }
}

/// Change of `[M row by row, b]` of a target.
pub type Response = SVector<f64, 12>;

/// Responses of a target's `[M row by row, b]` to what it inherits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inheritance {
    /// Derivative by the `[E row by row, e]` of the reference, in the directions that its uncertainty has.
    pub by_reference: ModelCovariance<f64>,
    /// Change by 1 sigma of gravity.
    pub by_gravity: Response,
    /// Change by 1 sigma of the rates of the table.
    pub by_table: Response,
}

impl Default for Inheritance {
    fn default() -> Self {
        Self {
            by_reference: ModelCovariance::zeros(),
            by_gravity: Response::zeros(),
            by_table: Response::zeros(),
        }
    }
}

/// Response of a target's `[M row by row, b]` to a full step in a direction.
fn response(found: &ErrorModel<f64>, deviated: &ErrorModel<f64>) -> Response {
    let matrix = (deviated.matrix - found.matrix) / STEP;
    let bias = (deviated.bias - found.bias) / STEP;
    Response::from_fn(|i, _| {
        if i < 9 {
            matrix[(i / 3, i % 3)]
        } else {
            bias[i - 9]
        }
    })
}

/// Sum of the squared responses of a target's `[M row by row, b]` to the principal directions.
pub(super) fn inherited(found: &ErrorModel<f64>, responses: &[ErrorModel<f64>]) -> ModelCovariance<f64> {
    let responses = responses.iter().map(|deviated| response(found, deviated));
    responses.map(|response| response * response.transpose()).sum() // eq. 5
}

/// Derivative of `[M row by row, b]` by `[E row by row, e]`, from the responses to the principal directions of `stated`.
pub(super) fn derivative(
    found: &ErrorModel<f64>,
    responses: &[ErrorModel<f64>],
    stated: &ModelCovariance<f64>,
) -> ModelCovariance<f64> {
    let eigen = stated.symmetric_eigen();
    let mut derivative = ModelCovariance::zeros();
    for (k, deviated) in responses.iter().enumerate() {
        let size = eigen.eigenvalues[k].max(0.0).sqrt();
        if size > 0.0 {
            let direction = eigen.eigenvectors.column(k).transpose();
            derivative += response(found, deviated) * direction / size; // eq. 13
        }
    }
    derivative
}

/// Change of `[M row by row, b]` where all truths are wrong by one factor, of this relative sigma.
pub(super) fn scaled(found: &ErrorModel<f64>, sigma: f64) -> Response {
    Response::from_fn(|i, _| {
        if i < 9 {
            sigma * found.matrix[(i / 3, i % 3)]
        } else {
            0.0
        }
    })
}

/// Covariance of `[M row by row, b]` where all truths are wrong by one factor, of this relative variance.
pub(crate) fn scaled_alike(found: &ErrorModel<f64>, variance: f64) -> ModelCovariance<f64> {
    let response = scaled(found, 1.0);
    response * response.transpose() * variance // turntable.md, eq. 42
}

/// Change of a target's `[M row by row, b]` by 1 sigma of gravity; `None` where nobody states one.
///
/// # Errors
/// [`TurntableError`] as the fits.
pub(super) fn of_gravity(
    session: &TargetSession<'_>,
    found: &ErrorModel<f64>,
) -> Result<Option<Response>, TurntableError> {
    let sigma = session.settings.gravity_sigma;
    if sigma <= 0.0 {
        return Ok(None);
    }
    let settings = TurntableSettings {
        gravity: session.settings.gravity + STEP * sigma,
        ..*session.settings
    };
    let mut reference = fit_reference(session.reference_unit, session.ups, &settings, false)?;
    reference.norm_explained = session.reference.norm_explained;
    let deviated = TargetSession {
        reference: &reference,
        settings: &settings,
        ..*session
    };
    Ok(Some(response(found, &deviated.accelerometer()?.model))) // eq. 9
}

/// Chance of residuals beyond which the statement of a reference does not explain its readings.
const UNEXPLAINED: f64 = 1e-3;

/// Tests whether noise and stated uncertainty, that of gravity included, explain the deviation of `|r - b|` from g at
/// all rests.
fn explains_norm(
    unit: &Acquired,
    reference: &Reference,
    stated: &ModelCovariance<f64>,
    settings: &TurntableSettings,
) -> Result<bool, TurntableError> {
    let rests = unit.rests.len();
    if rests < FEWEST_RESTS {
        return Ok(false);
    }
    let means: Vec<_> = (0..rests).map(|k| reference.force_at(unit, k)).collect();
    let length = (settings.gravity, settings.gravity_sigma);
    explains_length(&means, &reference.sphere.bias, length, stated, 3)
}

/// Tests whether noise and stated uncertainty of a reference explain the deviation of `|r - b|` from a length with its
/// 1-sigma, at all means with their covariances, where `unknowns` were fitted to them.
pub(super) fn explains_length(
    means: &[(Vector3<f64>, Matrix3<f64>)],
    bias: &Vector3<f64>,
    length: (f64, f64),
    stated: &ModelCovariance<f64>,
    unknowns: usize,
) -> Result<bool, TurntableError> {
    let rests = means.len();
    let (mut noise, mut residual) = (DMatrix::zeros(rests, rests), DVector::zeros(rests));
    let (mut directions, mut by_error) = (DMatrix::zeros(rests, 3), DMatrix::zeros(rests, 12));
    for (k, (mean, covariance)) in means.iter().enumerate() {
        let u = mean - bias;
        let direction = u.normalize();
        noise[(k, k)] = direction.dot(&(covariance * direction));
        residual[k] = u.norm() - length.0;
        for i in 0..3 {
            directions[(k, i)] = direction[i];
            by_error[(k, 9 + i)] = direction[i];
            for j in 0..3 {
                by_error[(k, 3 * i + j)] = direction[i] * u[j];
            }
        }
    }
    let of_length = DMatrix::from_element(rests, rests, length.1.powi(2));
    let joint = noise + &by_error * stated * by_error.transpose() + of_length; // eq. 6
    let solver = joint.cholesky().ok_or(TurntableError::Unsolvable)?;
    let (whitened, weighted) = (solver.solve(&residual), solver.solve(&directions));
    let of_bias = directions.transpose() * &whitened;
    let normal = (directions.transpose() * weighted).cholesky();
    let found = normal.ok_or(TurntableError::Unsolvable)?.solve(&of_bias);
    let chi_square = residual.dot(&whitened) - of_bias.dot(&found); // eq. 7
    #[allow(clippy::cast_precision_loss)]
    let freedom = rests as f64 - unknowns as f64;
    Ok(freedom > 0.0 && chi_square_tail(chi_square.max(0.0), freedom) > UNEXPLAINED)
}

/// Columns of a square root of a covariance, twelve; zero where there is none.
pub(super) fn roots(covariance: Option<ModelCovariance<f64>>) -> Vec<ModelDeviation> {
    let covariance = covariance.unwrap_or_else(ModelCovariance::zeros);
    let eigen = covariance.symmetric_eigen();
    (0..12)
        .map(|k| {
            let column = eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt();
            (
                Matrix3::from_fn(|i, j| column[3 * i + j]),
                Vector3::new(column[9], column[10], column[11]),
            )
        })
        .collect()
}

fn deviated(unit: &Acquired, force: &ModelDeviation, rate: &ModelDeviation) -> Acquired {
    let mut unit = unit.clone();
    for segment in unit.rests.iter_mut().chain(&mut unit.turns) {
        *segment = deviated_segment(segment, force, rate);
    }
    unit.motion
        .change(|length, velocity, angle| (moved(velocity, length, force), moved(angle, length, rate)));
    for plateau in &mut unit.plateaus {
        plateau.rate = moved(&plateau.rate, 1.0, rate);
    }
    for edge in &mut unit.edges {
        let of_rate = Vector3::new(edge.integral[3], edge.integral[4], edge.integral[5]);
        let moved = moved(&of_rate, edge.length, rate);
        edge.integral[3..].copy_from_slice(moved.as_slice());
    }
    unit
}

/// An integral over a length, s, or a mean, of length 1, of a triad that deviates.
pub(super) fn moved(of: &Vector3<f64>, length: f64, by: &ModelDeviation) -> Vector3<f64> {
    of + (by.0 * of + by.1 * length) * STEP
}

fn deviated_segment(segment: &Segment<f64>, force: &ModelDeviation, rate: &ModelDeviation) -> Segment<f64> {
    let mut other = *segment;
    let mean = [
        moved(&segment.specific_force(), 1.0, force),
        moved(&segment.angular_rate(), 1.0, rate),
    ];
    let integral = [
        moved(&segment.velocity(), segment.duration(), force),
        moved(&segment.angle(), segment.duration(), rate),
    ];
    let six = |[force, rate]: &[Vector3<f64>; 2]| [force.x, force.y, force.z, rate.x, rate.y, rate.z];
    other.moments = segment.moments.about(&six(&mean));
    other.integral = six(&integral);
    other
}
