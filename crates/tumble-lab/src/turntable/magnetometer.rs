//! Magnetometer of a target against that of the reference, at every rest both saw (docs/theory/turntable.md, section 13).

use nalgebra::{Matrix3, SMatrix, Vector3};
use tumble_core::model::ModelCovariance;
use tumble_core::noise::{Interval, Noise};
use tumble_core::turntable::fit::{TriadFit, fit};
use tumble_core::turntable::observation::FitInputs;
use tumble_core::turntable::truth::CommonRest;

use super::accelerometer::nominal;
use super::error::TurntableError;
use super::field::{
    DIFFERENCE, FieldObservation, FieldRest, LARGEST_FIELD, ReferenceField, SHARED, fit_field,
};
use super::field_disturbance::disagreeing;
use super::reference_uncertainty::{derivative, inherited, moved, roots};
use super::triad::{ResidualLabel, TriadCalibration, finish};
use crate::distributions::{chi_square_tail, f_tail};
use crate::magnetometer::{FieldSamples, means_at};

/// Rests that all unknowns need, with one to check them.
pub const FEWEST_FIELD_RESTS: usize = 5;

/// Magnetometer of the reference.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceMagnetometer<'a> {
    /// Its readings, corrected by its calibration where there is one.
    pub samples: FieldSamples<'a>,
    /// Covariance of its `[E row by row, e]`, as `ReferenceUncertainty` has it; `None` where nobody states it.
    pub uncertainty: Option<ModelCovariance<f64>>,
}

/// A rest both units saw.
#[derive(Clone, Copy, Debug)]
pub struct FieldSpan {
    /// Which rest of the reference.
    pub rest: usize,
    /// First and last time on the clock of the reference, s.
    pub reference: (f64, f64),
    /// First and last time on the clock of the target, s.
    pub target: (f64, f64),
    /// Specific force by the reference there, m/s^2.
    pub force: Vector3<f64>,
}

/// Why a rest is not in the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldDisturbance {
    /// The strength of the field at the reference departs from that of the other rests.
    Strength,
    /// The reading of the target departs from what the others predict of the field at the reference.
    Target,
}

/// The field at a rest.
#[derive(Clone, Copy, Debug)]
pub struct FieldAtRest {
    /// Which rest of the reference.
    pub rest: usize,
    /// Field at the reference, uT, case frame.
    pub field: Vector3<f64>,
    /// Its strength less that of all, uT, and its 1-sigma from noise.
    pub deviation: (f64, f64),
    /// Why it is not in the fit; `None` where it is.
    pub disturbance: Option<FieldDisturbance>,
}

/// Magnetometer of a target, calibrated.
#[derive(Clone, Debug)]
pub struct TargetMagnetometer {
    /// Its calibration in the case frame of the reference.
    pub calibration: TriadCalibration,
    /// Strength of the field, uT, and its 1-sigma.
    pub strength: (f64, f64),
    /// Bias of the magnetometer of the reference, uT, and its 1-sigma.
    pub reference_bias: (Vector3<f64>, Vector3<f64>),
    /// Field at the target less that at the reference, across the field, uT, upwards, to magnetic north and west; `None` where
    /// residuals do not show it.
    pub difference: Option<Vector3<f64>>,
    /// Rests, in order of time.
    pub rests: Vec<FieldAtRest>,
}

/// Calibrates the magnetometer of a target.
///
/// # Errors
/// [`TurntableError`] where the rests do not show its axes.
pub fn calibrate_magnetometer(
    reference: &ReferenceMagnetometer<'_>,
    target: &FieldSamples<'_>,
    spans: &[FieldSpan],
) -> Result<TargetMagnetometer, TurntableError> {
    let all = rests_of(&reference.samples, target, spans);
    if all.len() < FEWEST_FIELD_RESTS {
        return Err(TurntableError::TooFewRests {
            found: all.len(),
            needed: FEWEST_FIELD_RESTS,
        });
    }
    let stated = reference.uncertainty.as_ref();
    let uneven = uneven(&all, stated);
    let even = without(&all, &uneven);
    let stray = stray(&even, stated);
    let used = without(&even, &stray);
    let departs: Vec<usize> = stray.iter().map(|k| even[*k].rest).collect();
    let fitted = TargetFieldFit::of(&used, stated)?;
    let mut calibration = fitted.calibration()?;
    if let Some(stated) = stated {
        let deviated = roots(Some(*stated)).into_iter().map(|by| {
            let mut rests = used.clone();
            for rest in &mut rests {
                rest.common.reference = moved(&rest.common.reference, 1.0, &by);
            }
            Ok(TargetFieldFit::like(&fitted, &rests)?.solved.model)
        });
        let responses = deviated.collect::<Result<Vec<_>, TurntableError>>()?;
        calibration.inherited = Some(inherited(&calibration.model, &responses));
        calibration.inheritance.by_reference = derivative(&calibration.model, &responses, stated);
    }
    let shared = fitted.field.shared();
    let sigma = shared.diagonal().map(f64::sqrt);
    let sphere = &fitted.field.sphere;
    let describe = |(k, rest): (usize, &FieldRest)| FieldAtRest {
        rest: rest.rest,
        field: rest.common.reference - sphere.bias,
        deviation: fitted.field.deviation(&rest.common),
        disturbance: if uneven.contains(&k) {
            Some(FieldDisturbance::Strength)
        } else {
            departs.contains(&rest.rest).then_some(FieldDisturbance::Target)
        },
    };
    Ok(TargetMagnetometer {
        strength: (fitted.field.strength, sigma[3]),
        reference_bias: (sphere.bias, sigma.fixed_rows::<3>(0).into_owned()),
        difference: fitted.difference(),
        rests: all.iter().enumerate().map(describe).collect(),
        calibration,
    })
}

/// Means of both magnetometers at the rests that hold enough samples of each.
fn rests_of(reference: &FieldSamples<'_>, target: &FieldSamples<'_>, spans: &[FieldSpan]) -> Vec<FieldRest> {
    let of = |samples: &FieldSamples<'_>, span: fn(&FieldSpan) -> (f64, f64)| {
        means_at(samples, &spans.iter().map(span).collect::<Vec<_>>())
    };
    let seen = of(reference, |span| span.reference);
    let felt = of(target, |span| span.target);
    let both = spans.iter().zip(seen.iter().zip(&felt));
    both.filter_map(|(span, (seen, felt))| {
        let (seen, felt) = (seen.as_ref()?, felt.as_ref()?);
        Some(FieldRest {
            rest: span.rest,
            common: CommonRest {
                interval: Interval {
                    start: span.reference.0,
                    end: span.reference.1,
                },
                reference: seen.value,
                reference_covariance: Matrix3::from_diagonal(&seen.variance),
                target: felt.value,
                up: span.force.try_normalize(f64::MIN_POSITIVE),
            },
            target_variance: felt.variance,
        })
    })
    .collect()
}

fn without(rests: &[FieldRest], places: &[usize]) -> Vec<FieldRest> {
    let kept = rests.iter().enumerate().filter(|(k, _)| !places.contains(k));
    kept.map(|(_, rest)| *rest).collect()
}

/// Rests at which the strength of the field at the reference departs from that of the others.
fn uneven(rests: &[FieldRest], stated: Option<&ModelCovariance<f64>>) -> Vec<usize> {
    if fit_field(rests, stated).is_ok_and(|field| field.explained) {
        return Vec::new();
    }
    disagreeing(rests.len(), 1, |kept| {
        let some: Vec<_> = kept.iter().map(|k| rests[*k]).collect();
        let sphere = fit_field(&some, None).ok()?.sphere;
        Some((sphere.chi_square, sphere.degrees_of_freedom))
    })
}

/// Rests at which the target departs from what the others predict.
fn stray(rests: &[FieldRest], stated: Option<&ModelCovariance<f64>>) -> Vec<usize> {
    disagreeing(rests.len(), 3, |kept| {
        let some: Vec<_> = kept.iter().map(|k| rests[*k]).collect();
        let solved = TargetFieldFit::of(&some, stated).ok()?;
        let shown = some.len() >= FEWEST_FIELD_RESTS && !solved.solved.observed.contains(&false);
        shown.then_some((solved.solved.chi_square, solved.solved.degrees_of_freedom))
    })
}

/// A fit to some rests.
struct TargetFieldFit {
    field: ReferenceField,
    observations: Vec<FieldObservation>,
    labels: Vec<ResidualLabel>,
    inputs: FitInputs<f64, SHARED>,
    solved: TriadFit<f64, SHARED>,
    /// Variance of each component of the difference of the field between the places, uT^2; zero where none is asked for.
    difference: f64,
}

/// Largest plausible difference of the field between the places of reference and target, over its strength.
const LARGEST_DIFFERENCE: f64 = 0.1;

/// Variance of a difference that is not asked for, uT^2; a prior must only not be singular.
const NONE: f64 = 1e-18;

/// Chance of a difference where there is none, by the noise that rests show and by that of the residuals.
const FALSE_ALARM: f64 = 1e-3;

impl TargetFieldFit {
    fn of(rests: &[FieldRest], stated: Option<&ModelCovariance<f64>>) -> Result<Self, TurntableError> {
        let plain = Self::prepared(fit_field(rests, stated)?, rests, 0.0)?;
        if plain.solved.observed.contains(&false) {
            return Ok(plain);
        }
        let largest = LARGEST_DIFFERENCE * plain.field.strength;
        let wide = Self::prepared(plain.field, rests, largest.powi(2))?;
        if !wide.explains_more(&plain) {
            return Ok(plain);
        }
        // Nothing separates the part along the field from scale: it is taken to be as large as those across it.
        let across = wide.difference_across().norm_squared() / 2.0;
        Self::prepared(plain.field, rests, across)
    }

    /// The same unknowns as of another fit.
    fn like(other: &Self, rests: &[FieldRest]) -> Result<Self, TurntableError> {
        let mut field = fit_field(rests, None)?;
        field.explained = other.field.explained;
        Self::prepared(field, rests, other.difference)
    }

    fn prepared(field: ReferenceField, rests: &[FieldRest], difference: f64) -> Result<Self, TurntableError> {
        let observations: Vec<_> = rests.iter().map(|rest| field.truth(rest)).collect();
        let ends = rests.iter().map(|rest| rest.common.interval);
        let session = ends.reduce(|a, b| Interval {
            start: a.start.min(b.start),
            end: a.end.max(b.end),
        });
        let mut shared = SMatrix::<f64, SHARED, SHARED>::identity() * difference.max(NONE);
        shared
            .fixed_view_mut::<DIFFERENCE, DIFFERENCE>(0, 0)
            .copy_from(&field.shared());
        let inputs = FitInputs {
            noise: [SILENT; 3],
            session: session.ok_or(TurntableError::DirectionsTooAlike)?,
            nominal: nominal(&observations).ok_or(TurntableError::DirectionsTooAlike)?,
            largest_bias: LARGEST_FIELD,
            shared,
        };
        let mut solved = fit::<f64, 4, SHARED, 19>(&observations, &inputs)?; // eq. 48
        if difference > 0.0 {
            solved.degrees_of_freedom = solved.degrees_of_freedom.saturating_sub(3);
        }
        Ok(Self {
            field,
            observations,
            labels: rests.iter().map(|rest| ResidualLabel::Rest(rest.rest)).collect(),
            inputs,
            solved,
            difference,
        })
    }

    /// Tests whether the difference of the field explains more than chance does (docs/theory/turntable.md, eq. 51).
    fn explains_more(&self, plain: &Self) -> bool {
        let (with, without) = (&self.solved, &plain.solved);
        let freedom = f64::from(with.degrees_of_freedom);
        let explained = (without.chi_square - with.chi_square).max(0.0);
        let ratio = explained / 3.0 / (with.chi_square / freedom);
        freedom > 0.0
            && chi_square_tail(explained, 3.0) < FALSE_ALARM
            && f_tail(ratio, 3.0, freedom) < FALSE_ALARM // eq. 51
    }

    /// Difference of the field between the places without its part along the field, uT, upwards, north and west.
    fn difference_across(&self) -> Vector3<f64> {
        let found = self.solved.shared.fixed_rows::<3>(DIFFERENCE).into_owned();
        let in_room = |observation: &FieldObservation| {
            let case_from_room = observation.sensitivity.fixed_columns::<3>(DIFFERENCE);
            case_from_room.tr_mul(&observation.regressor.fixed_rows::<3>(0))
        };
        let field: Vector3<f64> = self.observations.iter().map(in_room).sum();
        match field.try_normalize(f64::MIN_POSITIVE) {
            Some(along) => found - along * along.dot(&found),
            None => found,
        }
    }

    /// Difference of the field between the places, where it was asked for.
    fn difference(&self) -> Option<Vector3<f64>> {
        (self.difference > 0.0).then(|| self.difference_across())
    }

    fn calibration(&self) -> Result<TriadCalibration, TurntableError> {
        let systematic = self.field.unexplained_variance() / self.field.strength.powi(2);
        let labels = self.labels.clone();
        finish(
            &self.solved,
            &self.observations,
            labels,
            &self.inputs,
            systematic,
            &[],
        )
    }
}

/// Noise of a magnetometer beside the variance of its means.
const SILENT: Noise<f64> = Noise {
    white: 0.0,
    flicker: 0.0,
    flicker_shown: 0.0,
    flicker_sigma: 0.0,
};

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use tumble_core::model::ErrorModel;

    use crate::simulate::stream::{StreamPurpose, normal_vector, stream};

    const SAMPLES: u32 = 200;

    /// Readings at twelve poses of a field of 48 uT that dips by 60 deg, at the reference and at the target.
    struct Played {
        reference: Vec<[f64; 3]>,
        target: Vec<[f64; 3]>,
        time: Vec<f64>,
        spans: Vec<FieldSpan>,
    }

    fn model() -> ErrorModel<f64> {
        ErrorModel {
            matrix: Matrix3::new(1.04, 0.03, -0.02, -0.05, 0.97, 0.01, 0.02, 0.06, 1.1),
            bias: Vector3::new(31.0, -12.0, 8.0),
        }
    }

    fn played(difference: Vector3<f64>, magnet_at: Option<usize>) -> Played {
        let room = Vector3::new(-48.0 * 60_f64.to_radians().sin(), 24.0, 0.0);
        let mut all = Played {
            reference: Vec::new(),
            target: Vec::new(),
            time: Vec::new(),
            spans: Vec::new(),
        };
        let mut noise = stream(11, 0, StreamPurpose::GyroscopeWhite);
        for k in 0..12_u32 {
            let x = f64::from(k);
            let case_from_room = Rotation3::from_euler_angles(2.4 * x, 1.1 * x + 0.3 * x * x, 0.7 * x);
            let magnet = if magnet_at == usize::try_from(k).ok() {
                Vector3::new(2.0, 1.0, -3.0)
            } else {
                Vector3::zeros()
            };
            let seen = case_from_room * (room + magnet) + Vector3::new(3.0, -2.0, 1.0);
            let felt = model().measure(&(case_from_room * (room + magnet + difference)));
            let start = 10.0 * x;
            for i in 0..SAMPLES {
                all.reference
                    .push((seen + normal_vector(&mut noise) * 0.2).into());
                all.target.push((felt + normal_vector(&mut noise) * 0.2).into());
                all.time.push(start + 0.01 * f64::from(i));
            }
            let span = (start, start + 1.999);
            all.spans.push(FieldSpan {
                rest: all.spans.len(),
                reference: span,
                target: span,
                force: case_from_room * Vector3::x() * 9.8,
            });
        }
        all
    }

    fn calibrated(played: &Played) -> TargetMagnetometer {
        tried(played).expect("enough rests")
    }

    fn tried(played: &Played) -> Result<TargetMagnetometer, TurntableError> {
        let samples = |field| FieldSamples {
            time: &played.time,
            field,
            current: &[],
        };
        let reference = ReferenceMagnetometer {
            samples: samples(&played.reference),
            uncertainty: None,
        };
        calibrate_magnetometer(&reference, &samples(&played.target), &played.spans)
    }

    #[test]
    fn bias_of_the_reference_leaves_nothing_on_the_target() {
        let found = calibrated(&played(Vector3::zeros(), None));
        let error = found.calibration.model.bias - model().bias;
        assert!(error.norm() < 0.1, "{error}");
        assert!((found.calibration.model.matrix - model().matrix).norm() < 0.003);
        assert!((found.strength.0 - 48.0).abs() < 0.05);
        assert!(found.difference.is_none());
    }

    #[test]
    fn a_field_that_differs_between_the_places_is_found_in_the_room() {
        let found = calibrated(&played(Vector3::new(0.0, 0.0, 0.8), None));
        let difference = found.difference.expect("0.8 uT stand out of the noise");
        assert!((difference.z - 0.8).abs() < 0.1, "{difference}");
        assert!((found.calibration.model.bias - model().bias).norm() < 0.1);
    }

    #[test]
    fn a_field_met_from_three_directions_only_shows_nothing() {
        let mut few = played(Vector3::zeros(), None);
        few.spans.truncate(3);
        let again = few.spans.clone();
        few.spans.extend(again);
        assert_eq!(tried(&few).unwrap_err(), TurntableError::DirectionsTooAlike);
    }

    #[test]
    fn a_magnet_near_one_pose_is_found_and_left_out() {
        let found = calibrated(&played(Vector3::zeros(), Some(4)));
        let disturbed: Vec<_> = found.rests.iter().map(|rest| rest.disturbance).collect();
        assert_eq!(disturbed[4], Some(FieldDisturbance::Strength));
        assert_eq!(disturbed.iter().flatten().count(), 1);
    }
}
