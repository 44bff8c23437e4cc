//! Calibration of one triad with all that goes with it.

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::{Covariance, Decomposition, ErrorModel};
use tumble_core::turntable::fit::TriadFit;
use tumble_core::turntable::observation::{FitInputs, Observation};

use super::error::TurntableError;
use super::flicker::variance_freedom;
use super::reference::mean_covariance;
use super::reference_uncertainty::scaled_alike;

/// Calibration of one triad with all that goes with it.
#[derive(Clone, Debug)]
pub struct TriadCalibration {
    /// M and b.
    pub model: ErrorModel<f64>,
    /// Of `[M row by row, b]`.
    pub covariance: Covariance<f64>,
    /// Covariance of `[M row by row, b]` that all targets of this reference have in common, beside the above; `None`
    /// where the uncertainty of the reference is not stated.
    pub inherited: Option<Covariance<f64>>,
    /// Whether the data showed each of `[M row by row, b]`.
    pub observed: [bool; 12],
    /// `M = K L Q`.
    pub parts: Decomposition<f64>,
    /// Of `[bias, scale, non-orthogonality, mounting]`.
    pub parts_covariance: Covariance<f64>,
    /// g-sensitivity and its sigma.
    pub g_sensitivity: Option<(Matrix3<f64>, Matrix3<f64>)>,
    /// Directions decided by the data.
    pub rank: usize,
    /// Factor on the variances because the residuals exceed the noise; one where they do not.
    pub widened: f64,
    /// Degrees of freedom with which the variances themselves are known.
    pub variance_freedom: f64,
    /// Sum of squared normalised residuals.
    pub chi_square: f64,
    /// Rows less unknowns.
    pub degrees_of_freedom: u32,
    /// Residual and 1-sigma of each interval.
    pub residuals: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// What each residual belongs to.
    pub labels: Vec<Label>,
}

impl TriadCalibration {
    /// Whether its response to specific force was fitted too.
    pub fn is_coupled(&self) -> bool {
        self.g_sensitivity.is_some()
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
pub enum Label {
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

/// `systematic` is the variance of an element of M because the reference errs itself.
pub(super) fn finish<const P: usize, const Q: usize>(
    solved: &TriadFit<f64, Q>,
    observations: &[Observation<f64, P, Q>],
    labels: Vec<Label>,
    inputs: &FitInputs<f64, Q>,
    systematic: f64,
) -> Result<TriadCalibration, TurntableError> {
    let parts = solved.model.decompose()?;
    let m = solved.model.matrix;
    let residuals = observations.iter().map(|observation| {
        let own = mean_covariance(&inputs.noise, &observation.interval, &inputs.session);
        let noise = (own + m * observation.truth_covariance * m.transpose()).diagonal(); // eq. 12
        let sigma = (noise + observation.reading_variance).map(f64::sqrt);
        (solved.residual(observation), sigma)
    });
    let widened = widening(solved.chi_square, solved.degrees_of_freedom);
    let mut covariance = solved.covariance * widened;
    for i in 0..9 {
        covariance[(i, i)] += systematic;
    }
    Ok(TriadCalibration {
        model: solved.model,
        covariance,
        inherited: None,
        observed: solved.observed,
        parts,
        parts_covariance: parts.carry(&covariance),
        g_sensitivity: solved.g_sensitivity.map(|(g, sigma)| (g, sigma * widened.sqrt())),
        rank: solved.rank,
        widened,
        variance_freedom: variance_freedom(observations, inputs),
        chi_square: solved.chi_square,
        degrees_of_freedom: solved.degrees_of_freedom,
        residuals: residuals.collect(),
        labels,
    })
}
