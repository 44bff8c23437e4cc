//! Calibration of one triad with all that goes with it.

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::{Decomposition, ErrorModel, ModelCovariance};
use tumble_core::turntable::fit::TriadFit;
use tumble_core::turntable::observation::{FitInputs, Observation};

use super::error::TurntableError;
use super::flicker::variance_freedom;
use super::reference::mean_covariance;
use super::reference_uncertainty::{Inheritance, scaled, scaled_alike};
use super::session_change::{BiasDrift, Slip};

/// Calibration of one triad with all that goes with it.
#[derive(Clone, Debug)]
pub struct TriadCalibration {
    /// M and b.
    pub model: ErrorModel<f64>,
    /// Covariance of `[M row by row, b]`.
    pub covariance: ModelCovariance<f64>,
    /// Covariance of `[M row by row, b]` that all targets of this reference, or of this gravity, have in common, beside the
    /// above; `None` where neither is stated.
    pub inherited: Option<ModelCovariance<f64>>,
    /// Responses that it follows from; zero where nothing is stated.
    pub inheritance: Inheritance,
    /// True for each of `[M row by row, b]` that the data showed.
    pub observed: [bool; 12],
    /// `M = K L Q`.
    pub parts: Decomposition<f64>,
    /// Covariance of `[bias, scale, non-orthogonality, mounting]`.
    pub parts_covariance: ModelCovariance<f64>,
    /// g-sensitivity and its sigma.
    pub g_sensitivity: Option<(Matrix3<f64>, Matrix3<f64>)>,
    /// Change of the bias over the session, where the residuals asked for it.
    pub drift: Option<BiasDrift>,
    /// Turn of the unit in its fixture, where the residuals asked for it: M is that before.
    pub slip: Option<Slip>,
    /// Difference of the scales of a gyroscope at positive and negative rates over their mean, and its 1-sigma, where the
    /// residuals asked for it.
    pub asymmetry: Option<(Vector3<f64>, Vector3<f64>)>,
    /// Directions decided by the data.
    pub rank: usize,
    /// Factor on the variances because the residuals exceed the noise; one where they do not.
    pub widened: f64,
    /// 1-sigma, m/s^2, by which residuals of an accelerometer go with the direction of gravity, which its covariance includes;
    /// zero where they do not.
    pub by_direction: f64,
    /// Degrees of freedom with which the variances themselves are known.
    pub variance_freedom: f64,
    /// Sum of squared normalised residuals.
    pub chi_square: f64,
    /// Rows less unknowns.
    pub degrees_of_freedom: u32,
    /// Residual and 1-sigma of each interval.
    pub residuals: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// Label of each residual.
    pub labels: Vec<ResidualLabel>,
}

impl TriadCalibration {
    /// Tests whether its response to specific force was fitted too.
    pub fn is_coupled(&self) -> bool {
        self.g_sensitivity.is_some()
    }

    /// Bias, scale, non-orthogonality and mounting, each of x, y and z.
    pub fn values(&self) -> Vec<f64> {
        let parameters = self.parts.parameters(&self.model.bias);
        let triples = [
            parameters.bias,
            parameters.scale,
            parameters.non_orthogonality,
            parameters.mounting,
        ];
        triples.iter().flat_map(|of| [of.x, of.y, of.z]).collect()
    }

    /// 1-sigma of each of [`Self::values`].
    pub fn sigmas(&self) -> Vec<f64> {
        let variances = self.parts_covariance.diagonal();
        variances.iter().map(|variance| variance.sqrt()).collect()
    }

    /// Adds to what all targets have in common.
    pub(super) fn add_inherited(&mut self, covariance: ModelCovariance<f64>) {
        self.inherited = Some(self.inherited.unwrap_or_else(ModelCovariance::zeros) + covariance);
    }

    /// The same where local gravity, which its scale rests on, is uncertain by this relative sigma; 0 where nobody states it.
    #[must_use]
    pub(crate) fn with_gravity(mut self, relative: f64) -> Self {
        if relative > 0.0 {
            self.add_inherited(scaled_alike(&self.model, relative.powi(2))); // uncertainty.md, eq. 9
            self.inheritance.by_gravity = scaled(&self.model, relative);
        }
        self
    }

    /// The same where the target's clock may go faster than the reference's by the root of `variance`, relative: all of M with
    /// it (docs/theory/turntable.md, section 6).
    #[must_use]
    pub(super) fn with_pace(mut self, variance: f64) -> Self {
        self.covariance += scaled_alike(&self.model, variance);
        self.parts_covariance = self.parts.carry(&self.covariance);
        self
    }
}

/// The interval a residual belongs to, by index of the reference's rests and constant rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResidualLabel {
    /// A rest.
    Rest(usize),
    /// The turn between two rests.
    Turn(usize, usize),
    /// A constant rate.
    Rate(usize),
    /// From a rest to a constant rate.
    RampUp(usize, usize),
    /// From a constant rate to another.
    Ramp(usize, usize),
    /// From a constant rate to a rest.
    RampDown(usize, usize),
}

impl ResidualLabel {
    /// Name of the kind of interval, and the indices it lies between; one of a single index has it twice.
    pub fn named(&self) -> (&'static str, usize, usize) {
        match *self {
            Self::Rest(k) => ("rest", k, k),
            Self::Turn(i, j) => ("turn", i, j),
            Self::Rate(k) => ("rate", k, k),
            Self::RampUp(i, j) => ("ramp up", i, j),
            Self::Ramp(i, j) => ("ramp", i, j),
            Self::RampDown(i, j) => ("ramp down", i, j),
        }
    }
}

/// Chi-square beyond this many of its own sigma above its mean is no chance.
const UNLIKELY: f64 = 5.0;

/// Factor on the variances where the residuals show more than the noise explains (Birge 1932; docs/theory/turntable.md,
/// eq. 20).
pub(crate) fn widening(chi_square: f64, degrees_of_freedom: u32) -> f64 {
    let freedom = f64::from(degrees_of_freedom);
    if chi_square > freedom + UNLIKELY * (2.0 * freedom).sqrt() && freedom > 0.0 {
        chi_square / freedom // eq. 20
    } else {
        1.0
    }
}

/// Chi-square and its degrees of freedom without the differences within a pose that fell into several rests: errors
/// that last longer than a rest, as drift does, leave nothing there, and their sum would be taken for smaller than it
/// is. `repeats` is true for each interval that goes on with the one before.
fn between_poses(
    chi_square: f64,
    degrees_of_freedom: u32,
    residuals: &[(Vector3<f64>, Vector3<f64>)],
    repeats: &[bool],
) -> (f64, u32) {
    let (mut within, mut differences) = (0.0, 0);
    for axis in 0..3 {
        // Mean of the pose so far, and its variance.
        let (mut mean, mut variance) = (0.0, 1.0);
        for ((residual, sigma), repeats) in residuals.iter().zip(repeats) {
            let (value, own) = (residual[axis], sigma[axis] * sigma[axis]);
            if *repeats {
                within += (value - mean) * (value - mean) / (variance + own);
                differences += 1;
                mean = (mean * own + value * variance) / (variance + own);
                variance *= own / (variance + own);
            } else {
                (mean, variance) = (value, own);
            }
        }
    }
    (
        (chi_square - within).max(0.0),
        degrees_of_freedom.saturating_sub(differences),
    )
}

/// `systematic` is the variance of an element of M because the reference errs itself; `repeats` is true for each
/// interval that goes on with the one before, and empty where none does.
pub(super) fn finish<const P: usize, const Q: usize>(
    solved: &TriadFit<f64, Q>,
    observations: &[Observation<f64, P, Q>],
    labels: Vec<ResidualLabel>,
    inputs: &FitInputs<f64, Q>,
    systematic: f64,
    repeats: &[bool],
) -> Result<TriadCalibration, TurntableError> {
    let parts = solved.model.decompose()?;
    let m = solved.model.matrix;
    let residuals = observations.iter().map(|observation| {
        let own = mean_covariance(&inputs.noise, &observation.interval, &inputs.session);
        let noise = (own + m * observation.truth_covariance * m.transpose()).diagonal(); // eq. 12
        let sigma = (noise + observation.reading_variance).map(f64::sqrt);
        (solved.residual(observation), sigma)
    });
    let residuals: Vec<_> = residuals.collect();
    let (chi_square, freedom) =
        between_poses(solved.chi_square, solved.degrees_of_freedom, &residuals, repeats);
    let widened = widening(chi_square, freedom);
    let mut variance_freedom = variance_freedom(observations, inputs);
    if widened > 1.0 {
        // The variance of what widens is known from these residuals alone.
        variance_freedom = variance_freedom.min(f64::from(freedom));
    }
    let mut covariance = solved.covariance * widened;
    for i in 0..9 {
        covariance[(i, i)] += systematic;
    }
    Ok(TriadCalibration {
        model: solved.model,
        covariance,
        inherited: None,
        inheritance: Inheritance::default(),
        observed: solved.observed,
        parts,
        parts_covariance: parts.carry(&covariance),
        g_sensitivity: solved.g_sensitivity.map(|(g, sigma)| (g, sigma * widened.sqrt())),
        drift: solved.drift.map(|(change, sigma)| BiasDrift {
            change,
            sigma: sigma * widened.sqrt(),
            constant: f64::INFINITY,
        }),
        slip: None,
        asymmetry: None,
        rank: solved.rank,
        widened,
        by_direction: 0.0,
        variance_freedom,
        chi_square: solved.chi_square,
        degrees_of_freedom: solved.degrees_of_freedom,
        residuals,
        labels,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rests_of_one_pose_leave_chi_square_to_their_mean() {
        let rest = |residual: f64, sigma: f64| (Vector3::repeat(residual), Vector3::repeat(sigma));
        let residuals = [rest(3.0, 1.0), rest(5.0, 1.0), rest(7.0, 2.0), rest(-1.0, 1.0)];
        let sum: f64 = residuals
            .iter()
            .map(|(r, s)| r.component_div(s).norm_squared())
            .sum();
        // Weights 1, 1 and 1/4: the pose's mean is 39/9 with variance 4/9.
        let between = 3.0 * ((39.0_f64 / 9.0).powi(2) * 9.0 / 4.0 + 1.0);
        let (chi_square, freedom) = between_poses(sum, 12, &residuals, &[false, true, true, false]);
        assert!(
            (chi_square - between).abs() < 1e-12 * between,
            "{chi_square} {between}"
        );
        assert_eq!(freedom, 6);
        assert_eq!(between_poses(sum, 12, &residuals, &[]), (sum, 12));
    }
}
