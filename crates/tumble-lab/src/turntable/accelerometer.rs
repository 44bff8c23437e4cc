//! Step 4 for the accelerometer: every rest both units saw.

use nalgebra::{Matrix3, Vector3};
use tumble_core::rotation::Procrustes;
use tumble_core::turntable::fit::{TriadFit, fit};
use tumble_core::turntable::observation::{FitInputs, Observation};
use tumble_core::turntable::truth::{
    CommonRest, ForceObservation, TruthSource, from_poses, from_reference, with_drift,
};

use super::direction_misfit::{direction_misfit, with_misfit};
use super::error::TurntableError;
use super::flicker::refine;
use super::pairing::PairedRest;
use super::reference::force_at;
use super::session::{LARGEST_FORCE_BIAS, TargetSession};
use super::settings::FEWEST_RESTS;
use super::triad::{ResidualLabel, TriadCalibration, finish};
use crate::distributions::{chi_square_tail, f_tail};

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
        let of_rests = inputs;
        refuse_unshown(&fit::<f64, 4, 3, 15>(&observations, &inputs)?)?;
        let misfit = direction_misfit(&observations, &inputs)?;
        let observations = match &misfit {
            Some(misfit) => with_misfit(&observations, misfit.variance),
            None => observations,
        };
        inputs.noise = refine(&observations, &inputs);
        let solved = fit::<f64, 4, 3, 15>(&observations, &inputs)?;
        let repeats = repeats(&observations);
        let systematic = self.systematic();
        let triad = finish(
            &solved,
            &observations,
            labels.clone(),
            &inputs,
            systematic,
            &repeats,
        )?;
        let drifting: Vec<_> = observations
            .iter()
            .map(|each| with_drift(each, &inputs.session))
            .collect();
        if let Some(misfit) = misfit {
            return Ok(TriadCalibration {
                widened: misfit.excess.max(triad.widened),
                by_direction: misfit.variance.sqrt(),
                variance_freedom: triad.variance_freedom.min(misfit.freedom),
                ..triad
            });
        }
        if triad.widened == 1.0 && !asks_for_drift(&observations, &drifting, &of_rests)? {
            return Ok(triad);
        }
        let noise = refine(&drifting, &of_rests);
        let inputs = FitInputs { noise, ..inputs };
        let solved = fit::<f64, 5, 3, 18>(&drifting, &inputs)?;
        let with_drift = finish(&solved, &drifting, labels, &inputs, systematic, &repeats)?;
        Ok(if explains(&with_drift) { with_drift } else { triad })
    }

    fn forces(&self) -> Result<(Vec<ResidualLabel>, Vec<ForceObservation<f64>>), TurntableError> {
        let (mut labels, mut observations) = (Vec::new(), Vec::new());
        for pair in &self.pairing.pairs {
            if let Some(observation) = self.force(pair)? {
                labels.push(ResidualLabel::Rest(pair.reference));
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
        let observed = match (self.settings.truth, &self.reference.mounting) {
            (TruthSource::Reference, _) => Ok(Some(from_reference(&rest, &self.reference.sphere, gravity))),
            (truth, Some(mounting)) => Ok(from_poses(truth, &rest, mounting, gravity)),
            (_, None) => Err(TurntableError::NeedsPoses),
        };
        let excess = self.unit.excess_variance(pair.target.0, 0);
        Ok(observed?.map(|observation| ForceObservation {
            reading_variance: excess,
            ..observation
        }))
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

/// Sigma of an element of M beyond which the rests do not show it: poses in a plane show a scale by their tilt alone.
const OPEN: f64 = 0.03;

fn refuse_unshown(solved: &TriadFit<f64, 3>) -> Result<(), TurntableError> {
    let sigma = |place: usize| solved.covariance[(place, place)].sqrt();
    if solved.observed.contains(&false) || (0..9).any(|place| sigma(place) > OPEN) {
        return Err(TurntableError::DirectionsTooAlike);
    }
    Ok(())
}

/// Chance of a drift where there is none, by the noise that rests show and by that of the residuals.
const FALSE_ALARM: f64 = 1e-3;
const FALSE_ALARM_BY_RESIDUALS: f64 = 1e-2;

/// True if a straight line explains more than chance does, under the noise that rests show: bias instability that is found in the
/// residuals would take a drift for its own (docs/theory/turntable.md, eq. 45).
fn asks_for_drift(
    plain: &[Observation<f64, 4, 3>],
    drifting: &[Observation<f64, 5, 3>],
    inputs: &FitInputs<f64, 3>,
) -> Result<bool, TurntableError> {
    let plain = fit::<f64, 4, 3, 15>(plain, inputs)?;
    let drifting = fit::<f64, 5, 3, 18>(drifting, inputs)?;
    let freedom = f64::from(drifting.degrees_of_freedom);
    if freedom <= 0.0 {
        return Ok(false);
    }
    let explained = plain.chi_square - drifting.chi_square;
    let ratio = explained / 3.0 / (drifting.chi_square / freedom);
    Ok(chi_square_tail(explained.max(0.0), 3.0) < FALSE_ALARM
        && f_tail(ratio.max(0.0), 3.0, freedom) < FALSE_ALARM_BY_RESIDUALS) // eq. 45
}

/// Sigmas by which the drift of an axis is no chance.
const CLEAR: f64 = 4.0;

/// True if biases that drift on a straight line leave what noise explains, and are shown.
fn explains(drifting: &TriadCalibration) -> bool {
    let is_clear = |(value, sigma): &(Vector3<f64>, Vector3<f64>)| {
        value.iter().zip(sigma).any(|(v, s)| v.abs() > CLEAR * s)
    };
    let checked = drifting.degrees_of_freedom > 0 && !drifting.observed.contains(&false);
    checked && drifting.widened == 1.0 && drifting.drift.as_ref().is_some_and(is_clear)
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
