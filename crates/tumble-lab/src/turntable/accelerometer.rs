//! Step 4 for the accelerometer: every rest both units saw.

use nalgebra::{Matrix3, Rotation3, Vector3};
use tumble_core::noise::Interval;
use tumble_core::rotation::Procrustes;
use tumble_core::turntable::fit::{TriadFit, fit};
use tumble_core::turntable::observation::{FitInputs, Observation};
use tumble_core::turntable::truth::{CommonRest, ForceObservation, TruthSource, from_poses, from_reference};

use super::direction_misfit::{direction_misfit, with_misfit, within_directions};
use super::error::TurntableError;
use super::flicker::refine;
use super::pairing::PairedRest;
use super::session::{LARGEST_FORCE_BIAS, TargetSession};
use super::session_change::{
    LARGEST_SLIP, SessionChange, Side, Slip, as_slipped, drifting, find_change, shown, slipping, with_slips,
    without_drift,
};
use super::settings::FEWEST_RESTS;
use super::triad::{ResidualLabel, TriadCalibration, finish};

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
        let repeats = repeats(&observations);
        let misfit = direction_misfit(&observations, &inputs, 0)?;
        let plain = match &misfit {
            Some(misfit) => with_misfit(&observations, misfit.variance),
            None => observations.clone(),
        };
        inputs.noise = refine(&plain, &inputs);
        let solved = fit::<f64, 4, 3, 15>(&plain, &inputs)?;
        let systematic = self.systematic();
        let triad = finish(&solved, &plain, labels.clone(), &inputs, systematic, &repeats)?;
        // Bias instability that is found in the residuals would take a change for its own.
        let changed = self.with_change(&observations, &labels, &of_rests, &repeats)?;
        if let Some(changed) = changed {
            return Ok(changed);
        }
        Ok(match misfit {
            Some(misfit) => TriadCalibration {
                widened: misfit.excess.max(triad.widened),
                by_direction: misfit.variance.sqrt(),
                variance_freedom: triad.variance_freedom.min(misfit.freedom),
                ..triad
            },
            None => triad,
        })
    }

    /// The calibration with the change within the session that explains what noise does not; `None` where none does
    /// (docs/theory/turntable.md, section 15).
    fn with_change(
        &self,
        observations: &[ForceObservation<f64>],
        labels: &[ResidualLabel],
        of_rests: &FitInputs<f64, 3>,
        repeats: &[bool],
    ) -> Result<Option<TriadCalibration>, TurntableError> {
        let (labels, systematic) = (labels.to_vec(), self.systematic());
        let session = of_rests.session;
        let (within, freedom) = within_directions(observations, of_rests)?;
        let Some(change) = find_change(observations, of_rests, freedom > 0.0)? else {
            return Ok(None);
        };
        let (triad, settled) = match change {
            SessionChange::Drift(course) => {
                let drifting = drifting(observations, &session, course);
                let inputs = FitInputs {
                    noise: refine(&drifting, of_rests),
                    ..*of_rests
                };
                let solved = fit::<f64, 5, 3, 18>(&drifting, &inputs)?;
                let mut triad = finish(&solved, &drifting, labels, &inputs, systematic, repeats)?;
                let Some(drift) = &mut triad.drift else {
                    return Ok(None);
                };
                drift.constant = course.constant(&session);
                let settled = without_drift(observations, &session, course, &drift.change);
                (triad, settled)
            }
            SessionChange::Slip(place) => {
                let first = fit::<f64, 4, 6, 18>(&slipping(observations, place), &with_slips(of_rests))?;
                let turn = turn_of(&first);
                // About what the first fit found, the turn is linear.
                let turned = as_slipped(observations, place, &turn);
                let slipping = slipping(&turned, place);
                let mut inputs = with_slips(of_rests);
                inputs.noise = refine(&slipping, &inputs);
                let solved = fit::<f64, 4, 6, 18>(&slipping, &inputs)?;
                let mut triad = finish(&solved, &slipping, labels, &inputs, systematic, repeats)?;
                let turn = (Rotation3::new(turn_of(&solved)) * Rotation3::new(turn)).scaled_axis();
                if turn.norm() > LARGEST_SLIP {
                    return Ok(None);
                }
                triad.slip = slip(turn, &solved, place, &triad.labels, observations);
                // A fit does not count the errors that truths share among its unknowns.
                triad.degrees_of_freedom = triad.degrees_of_freedom.saturating_sub(3);
                (triad, as_slipped(observations, place, &turn))
            }
        };
        if freedom > 0.0 {
            // A fixture that gives way is the same whenever a direction is shown, and looks like a change between directions.
            let (left, _) = within_directions(&settled, of_rests)?;
            let unknowns = change.unknowns();
            if shown(within, left, unknowns, freedom - unknowns, 1.0).is_none() {
                return Ok(None);
            }
        }
        let is_left = direction_misfit(&settled, of_rests, CHANGED)?.is_some();
        Ok((!is_left && explains(&triad)).then_some(triad))
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
        let (reference, reference_covariance) = self.reference.force_at(self.reference_unit, pair.reference);
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

/// The turn that a fit found among the errors that the truths share.
fn turn_of(solved: &TriadFit<f64, 6>) -> Vector3<f64> {
    solved.shared.fixed_rows::<3>(3).into_owned()
}

/// The turn of a target before the rest of this number.
fn slip(
    turn: Vector3<f64>,
    solved: &TriadFit<f64, 6>,
    place: usize,
    labels: &[ResidualLabel],
    observations: &[ForceObservation<f64>],
) -> Option<Slip> {
    let rest = |k: usize| match labels[k] {
        ResidualLabel::Rest(rest) => Some(rest),
        _ => None,
    };
    Some(Slip {
        turn,
        covariance: solved.shared_covariance.fixed_view::<3, 3>(3, 3).into_owned(),
        rests: (rest(place - 1)?, rest(place)?),
        span: Interval {
            start: observations[place - 1].interval.end,
            end: observations[place].interval.start,
        },
        side: Side::of(observations, place),
    })
}

/// Numbers of a change: of three axes.
const CHANGED: usize = 3;

/// Sigmas by which a change of an axis is no chance.
const CLEAR: f64 = 4.0;

/// Tests whether a change leaves what noise explains, and is shown.
fn explains(changed: &TriadCalibration) -> bool {
    let is_clear = |value: &Vector3<f64>, sigma: &Vector3<f64>| {
        value.iter().zip(sigma).any(|(v, s)| v.abs() > CLEAR * s)
    };
    let checked = changed.degrees_of_freedom > 0 && !changed.observed.contains(&false);
    let drifted = changed
        .drift
        .is_some_and(|drift| is_clear(&drift.change, &drift.sigma));
    let slipped = changed
        .slip
        .is_some_and(|slip| is_clear(&slip.turn, &slip.covariance.diagonal().map(f64::sqrt)));
    checked && changed.widened == 1.0 && (drifted || slipped)
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
