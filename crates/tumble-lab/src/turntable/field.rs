//! Magnetic field at the rests, as the magnetometer of the reference measured it: its bias and the strength of the field
//! (docs/theory/turntable.md, section 13).

use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};
use tumble_core::model::ModelCovariance;
use tumble_core::regression::{LeastSquares, Prior, degrees_of_freedom};
use tumble_core::turntable::observation::Observation;
use tumble_core::turntable::reference::SphereFit;
use tumble_core::turntable::truth::{CommonRest, from_reference};

use super::error::TurntableError;
use super::reference_uncertainty::explains_length;
use crate::constant_length::sphere::sphere;

/// Largest plausible bias of a magnetometer, and of the strength of the field, uT.
pub(super) const LARGEST_FIELD: f64 = 1000.0;

/// Errors that the truths of all rests share: bias of the reference, strength of the field, and the field at the target less that
/// at the reference, in the frame of the room.
pub(super) const SHARED: usize = 7;

/// Where that difference stands among them.
pub(super) const DIFFERENCE: usize = 4;

/// Truth and reading of a magnetometer at a rest.
pub(super) type FieldObservation = Observation<f64, 4, SHARED>;

/// Largest sigma of bias and strength, over the strength, that the rests show: half of what an element of M may err.
const SHOWN: f64 = 0.15;

/// A rest at which both magnetometers were read.
#[derive(Clone, Copy, Debug)]
pub(super) struct FieldRest {
    /// Rests both saw, its reading of the target and its interval.
    pub common: CommonRest<f64>,
    /// Variance of the mean of the target, uT^2.
    pub target_variance: Vector3<f64>,
    /// Which rest of the reference.
    pub rest: usize,
}

/// Field as the reference shows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReferenceField {
    /// Bias of the reference, as from a sphere whose radius is not known.
    pub sphere: SphereFit<f64>,
    /// Strength of the field, uT.
    pub strength: f64,
    /// Covariance of bias and strength, uT^2.
    pub covariance: Matrix4<f64>,
    /// True if the uncertainty that the reference states explains the deviation of `|r - b|` from the strength.
    pub explained: bool,
}

impl ReferenceField {
    /// Factor on the variance of bias and strength, because the reference misses the sphere by more than noise and stated
    /// uncertainty explain.
    fn excess(&self) -> f64 {
        if self.explained { 1.0 } else { self.sphere.excess() }
    }

    /// Covariance of what the truths of all rests err by alike.
    pub fn shared(&self) -> Matrix4<f64> {
        self.covariance * self.excess()
    }

    /// Variance of the length of the field, uT^2, that neither noise nor stated uncertainty explains.
    pub fn unexplained_variance(&self) -> f64 {
        if self.explained {
            0.0
        } else {
            self.sphere.model_variance()
        }
    }

    /// `|r - b|` less the strength at a rest, uT, and its 1-sigma from noise.
    pub fn deviation(&self, rest: &CommonRest<f64>) -> (f64, f64) {
        let field = rest.reference - self.sphere.bias;
        let direction = field.normalize();
        let variance = direction.dot(&(rest.reference_covariance * direction));
        (field.norm() - self.strength, variance.sqrt())
    }

    /// Truth at a rest on the sphere of radius F, as `from_reference` has it of gravity, with further errors that all share.
    pub fn truth(&self, rest: &FieldRest) -> FieldObservation {
        let seen = rest.common.reference - self.sphere.bias;
        let observed = from_reference(&rest.common, &self.sphere, self.strength);
        let mut sensitivity = SMatrix::<f64, 3, SHARED>::zeros();
        sensitivity
            .fixed_columns_mut::<3>(0)
            .copy_from(&observed.sensitivity);
        let gain = (observed.sensitivity + Matrix3::identity()) * seen.normalize();
        sensitivity.set_column(3, &gain); // eq. 47
        if let Some(case_from_room) = rest.common.up.and_then(|up| attitude(&up, &seen)) {
            sensitivity
                .fixed_columns_mut::<3>(DIFFERENCE)
                .copy_from(&case_from_room); // eq. 50
        }
        Observation {
            interval: observed.interval,
            regressor: observed.regressor,
            reading: observed.reading,
            reading_variance: rest.target_variance,
            truth_covariance: observed.truth_covariance,
            sensitivity,
        }
    }
}

/// Least sine of the angle between field and vertical that shows which way is north.
const LEAST_SINE: f64 = 0.1;

/// Attitude of the case, its columns up, magnetic north and west; `None` where the field is nearly vertical.
fn attitude(up: &Vector3<f64>, field: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let level = field - up * up.dot(field);
    (level.norm() > LEAST_SINE * field.norm()).then(|| {
        let north = level.normalize();
        Matrix3::from_columns(&[*up, north, up.cross(&north)])
    })
}

/// Solves `|r - b| = F` for b and F by Gauss-Newton. `stated` is the covariance of `[E row by row, e]` of the corrected
/// reference, where it is stated.
///
/// # Errors
/// [`TurntableError::DirectionsTooAlike`] where the field was met from too few directions, [`TurntableError::Unsolvable`] if a
/// reading is not finite.
pub(super) fn fit_field(
    rests: &[FieldRest],
    stated: Option<&ModelCovariance<f64>>,
) -> Result<ReferenceField, TurntableError> {
    const STEPS: u32 = 8;
    let readings: Vec<_> = rests.iter().map(|rest| rest.common.reference).collect();
    #[allow(clippy::cast_precision_loss)]
    let usual = readings.iter().map(Vector3::norm).sum::<f64>() / readings.len() as f64;
    let (mut bias, mut strength) = sphere(&readings).unwrap_or((Vector3::zeros(), usual));
    let prior = Prior {
        mean: Vector4::new(0.0, 0.0, 0.0, usual),
        covariance: Matrix4::identity() * LARGEST_FIELD.powi(2),
    };
    let mut solution = LeastSquares::<f64, 4>::new(&prior).solve()?;
    for _ in 0..STEPS {
        let mut equations = LeastSquares::<f64, 4>::new(&prior);
        for rest in rests {
            let field = rest.common.reference - bias;
            let direction = field.normalize();
            // |r - b| - F = 0 linearised about the bias of the step before.
            let row = Vector4::new(direction.x, direction.y, direction.z, 1.0); // eq. 46
            let right = direction.dot(&bias) + field.norm(); // eq. 46
            equations.push(
                &row,
                right,
                direction.dot(&(rest.common.reference_covariance * direction)),
            );
        }
        solution = equations.solve()?;
        bias = solution.x.fixed_rows::<3>(0).into_owned();
        strength = solution.x[3];
    }
    let sigma = solution.covariance.diagonal().max().sqrt();
    if sigma.is_nan() || sigma > SHOWN * strength.abs() {
        return Err(TurntableError::DirectionsTooAlike);
    }
    let squares = readings.iter().map(|r| ((r - bias).norm() - strength).powi(2));
    #[allow(clippy::cast_precision_loss)]
    let norm_residual = (squares.sum::<f64>() / readings.len() as f64).sqrt();
    let sphere = SphereFit {
        bias,
        covariance: solution.covariance.fixed_view::<3, 3>(0, 0).into_owned(),
        observed: [true; 3],
        chi_square: solution.chi_square,
        degrees_of_freedom: degrees_of_freedom(solution.rows, 4),
        norm_residual,
    };
    let means: Vec<_> = rests
        .iter()
        .map(|rest| (rest.common.reference, rest.common.reference_covariance))
        .collect();
    let explained = match stated {
        Some(stated) => explains_length(&means, &bias, (strength, LARGEST_FIELD), stated, 4)?,
        None => false,
    };
    Ok(ReferenceField {
        sphere,
        strength,
        covariance: solution.covariance,
        explained,
    })
}
