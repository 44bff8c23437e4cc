//! Step 4 for the accelerometer: every rest both units saw.

use nalgebra::Matrix3;
use tumble_core::rotation::Procrustes;
use tumble_core::turntable::fit::fit;
use tumble_core::turntable::observation::{FitInputs, Observation};
use tumble_core::turntable::truth::{CommonRest, ForceObservation, TruthSource, from_poses, from_reference};

use super::error::TurntableError;
use super::flicker::refine;
use super::pairing::PairedRest;
use super::reference::force_at;
use super::session::{LARGEST_FORCE_BIAS, TargetSession};
use super::settings::FEWEST_RESTS;
use super::triad::{Label, TriadCalibration, finish};

impl TargetSession<'_> {
    /// Calibrates the accelerometer.
    pub fn accelerometer(&self) -> Result<TriadCalibration, TurntableError> {
        let (labels, observations) = self.forces()?;
        if observations.len() < FEWEST_RESTS {
            return Err(TurntableError::TooFewRests {
                found: observations.len(),
                needed: FEWEST_RESTS,
            });
        }
        let mut inputs = FitInputs {
            noise: self.unit.force_noise(),
            session: self.span(),
            nominal: nominal(&observations).ok_or(TurntableError::DirectionsTooAlike)?,
            largest_bias: LARGEST_FORCE_BIAS,
            shared: self.shared_force_error(),
        };
        inputs.noise = refine(&observations, &inputs);
        let solved = fit::<f64, 4, 3, 15>(&observations, &inputs)?;
        if solved.observed.contains(&false) {
            return Err(TurntableError::DirectionsTooAlike);
        }
        let repeats = repeats(&observations);
        finish(
            &solved,
            &observations,
            labels,
            &inputs,
            self.systematic(),
            &repeats,
        )
    }

    fn forces(&self) -> Result<(Vec<Label>, Vec<ForceObservation<f64>>), TurntableError> {
        let (mut labels, mut observations) = (Vec::new(), Vec::new());
        for pair in &self.pairing.pairs {
            if let Some(observation) = self.force(pair)? {
                labels.push(Label::Rest(pair.reference));
                observations.push(observation);
            }
        }
        Ok((labels, observations))
    }

    /// Truth and reading at one rest; `None` where the truth needs a pose that is not known.
    fn force(&self, pair: &PairedRest) -> Result<Option<ForceObservation<f64>>, TurntableError> {
        let gravity = self.settings.gravity;
        let (reference, reference_covariance) = force_at(self.reference_unit, pair.reference);
        let rest = CommonRest {
            interval: self.when(&pair.segment),
            reference,
            reference_covariance,
            target: pair.segment.specific_force(),
            up: self.ups.get(pair.reference).copied().flatten(),
        };
        match (self.settings.truth, &self.reference.mounting) {
            (TruthSource::Reference, _) => Ok(Some(from_reference(&rest, &self.reference.sphere, gravity))),
            (truth, Some(mounting)) => Ok(from_poses(truth, &rest, mounting, gravity)),
            (_, None) => Err(TurntableError::NeedsPoses),
        }
    }

    /// Covariance of what the truths of all rests err by alike.
    fn shared_force_error(&self) -> Matrix3<f64> {
        let sphere = &self.reference.sphere;
        match (self.settings.truth, &self.reference.mounting) {
            (TruthSource::RotateMeasurement | TruthSource::RotateTruth, Some(mounting)) => {
                mounting.covariance
            }
            // The ideal poses share no error that anybody knows of; the prior must only not be singular.
            (TruthSource::Ideal, _) => Matrix3::identity() * 1e-18,
            _ => sphere.covariance * self.reference.excess(),
        }
    }

    /// Variance of an element of M because the reference errs itself.
    fn systematic(&self) -> f64 {
        match self.settings.truth {
            TruthSource::Reference => self.reference.unexplained_variance() / self.settings.gravity.powi(2),
            _ => 0.0,
        }
    }
}

/// Angle by which a structure that is bumped turns at most, rad.
const SAME_POSE: f64 = 0.01;

/// Tests whether each rest shows the pose of the one before.
fn repeats(observations: &[ForceObservation<f64>]) -> Vec<bool> {
    let truth = |k: usize| observations[k].regressor.fixed_rows::<3>(0).into_owned();
    let goes_on = |k: usize| k > 0 && truth(k).angle(&truth(k - 1)) < SAME_POSE;
    (0..observations.len()).map(goes_on).collect()
}

/// M without any error: the rotation between truth and readings.
pub(super) fn nominal<const P: usize, const Q: usize>(
    observations: &[Observation<f64, P, Q>],
) -> Option<Matrix3<f64>> {
    let mut pairs = Procrustes::new();
    for observation in observations {
        pairs.push(
            &observation.reading,
            &observation.regressor.fixed_rows::<3>(0).into_owned(),
            1.0,
        );
    }
    pairs.solve().map(|fit| fit.rotation.into_inner())
}
