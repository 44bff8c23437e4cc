//! From the samples of a magnetometer to its calibration, and what each rest or stretch shows of it.

use nalgebra::Vector3;
use tumble_core::model::ModelCovariance;

use super::disturbed::FALSE_ALARM;
use super::error::MagnetometerError;
use super::fit::{FieldFit, FieldSettings, dip_of, fit_field};
use super::next_field::{NextField, coverage, next_field};
use super::readings::FieldReadings;
use super::rests::{CalibratedAccelerometer, FieldSamples, RestUp, at_rests};
use super::turned::{FieldBlock, turned};
use crate::constant_length::influence::{Influence, held_out, influence};
use crate::turntable::reference_uncertainty::Inheritance;
use crate::turntable::{ResidualLabel, TriadCalibration, widening};

/// A rest, or a stretch of a log that was turned, and what the calibration makes of it.
#[derive(Clone, Copy, Debug)]
pub struct FieldPoint {
    /// Time of its first and last sample, s.
    pub span: (f64, f64),
    /// Field in the case frame, uT.
    pub field: Vector3<f64>,
    /// `|y|` raw less the strength, uT.
    pub before: f64,
    /// `|u|` less the strength, uT.
    pub after: f64,
    /// 1-sigma of the latter from noise, uT.
    pub sigma: f64,
    /// Dip less that of all, rad, and its 1-sigma, where up is known.
    pub dip: Option<(f64, f64)>,
    /// Weight in the robust loss; zero where it is disturbed.
    pub weight: f64,
    /// Chance that noise makes any of them disagree as much.
    pub chance: f64,
    /// Disagrees with the others beyond chance.
    pub disturbed: bool,
    /// Points of one number meet the field from one direction.
    pub direction: usize,
    /// Change of the fit without it.
    pub influence: Influence,
    /// `|u|` less the strength by a fit without this direction, or block, uT.
    pub held_out: Option<f64>,
}

/// A calibrated magnetometer.
#[derive(Clone, Debug)]
pub struct Magnetometer {
    /// Its calibration, in the case frame of the accelerometer, or of its own axes.
    pub calibration: TriadCalibration,
    /// Response to current and its 1-sigma, uT/A.
    pub current: Option<(Vector3<f64>, Vector3<f64>)>,
    /// Strength of the field, uT, and its 1-sigma where it is relative to the sensor's mean scale.
    pub strength: (f64, f64),
    /// Dip of the field, rad, and its 1-sigma.
    pub dip: Option<(f64, f64)>,
    /// Rests or stretches.
    pub points: Vec<FieldPoint>,
    /// The orientation that is worth most.
    pub next: Option<NextField>,
    /// Share of all directions that the field was met from.
    pub coverage: f64,
    /// Scatter of a sample, uT, and samples that are worth one independent reading, where it was turned.
    pub scatter: Option<(f64, f64)>,
}

/// Calibrates a magnetometer by the rests of a unit whose accelerometer is calibrated. `strength_sigma` is that of the strength
/// of the field, uT.
///
/// # Errors
/// [`MagnetometerError`] where the rests do not show all unknowns.
pub fn calibrate_at_rests(
    samples: &FieldSamples<'_>,
    rests: &[RestUp],
    accelerometer: &CalibratedAccelerometer,
    settings: &FieldSettings,
    strength_sigma: f64,
) -> Result<Magnetometer, MagnetometerError> {
    let (data, places) = at_rests(samples, rests, accelerometer);
    let fit = fit_field(&data, settings)?;
    let widened = widening(fit.chi_square(), fit.degrees_of_freedom());
    let spans: Vec<_> = places.iter().map(|k| rests[*k].span).collect();
    let points = rest_points(&fit, &data, &spans);
    let residuals = points
        .iter()
        .zip(&data.readings)
        .filter(|(point, _)| !point.disturbed);
    let residuals: Vec<_> = residuals
        .map(|(point, reading)| {
            let residual = fit.model.matrix * point.field.normalize() * point.after;
            (residual, reading.variance.map(f64::sqrt))
        })
        .collect();
    let labels = fit.used.iter().map(|k| ResidualLabel::Rest(places[*k])).collect();
    let triad = Triad {
        widened,
        variance_freedom: f64::INFINITY,
        chi_square: fit.chi_square(),
        degrees_of_freedom: fit.degrees_of_freedom(),
        residuals,
        labels,
    };
    describe(&fit, triad, points, &data, strength_sigma)
}

/// Calibrates a magnetometer that was turned through all directions without a rest.
///
/// # Errors
/// [`MagnetometerError`] where the samples do not show all unknowns.
pub fn calibrate_turned(
    samples: &FieldSamples<'_>,
    settings: &FieldSettings,
    strength_sigma: f64,
) -> Result<Magnetometer, MagnetometerError> {
    let found = turned(samples, settings)?;
    let points: Vec<_> = found
        .blocks
        .iter()
        .enumerate()
        .map(|(k, block)| block_point(k, block, samples, found.stride, found.fit.strength))
        .collect();
    let residual = |point: &FieldPoint| found.fit.model.matrix * point.field.normalize() * point.after;
    let residuals: Vec<_> = points
        .iter()
        .map(|point| (residual(point), Vector3::repeat(point.sigma)))
        .collect();
    #[allow(clippy::cast_precision_loss)]
    let worth = found.fit.used.len() as f64 / found.correlated;
    #[allow(clippy::cast_precision_loss)]
    let freedom = (worth - found.fit.places.len() as f64).max(1.0);
    let triad = Triad {
        widened: 1.0,
        variance_freedom: freedom,
        chi_square: found.fit.chi_square() / found.correlated,
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        degrees_of_freedom: freedom as u32,
        labels: (0..residuals.len()).map(ResidualLabel::Rest).collect(),
        residuals,
    };
    let data = found.readings;
    let mut described = describe(&found.fit, triad, points, &data, strength_sigma)?;
    described.scatter = Some((found.scatter, found.correlated));
    Ok(described)
}

/// Quality of a fit.
struct Triad {
    widened: f64,
    variance_freedom: f64,
    chi_square: f64,
    degrees_of_freedom: u32,
    residuals: Vec<(Vector3<f64>, Vector3<f64>)>,
    labels: Vec<ResidualLabel>,
}

fn describe(
    fit: &FieldFit,
    triad: Triad,
    points: Vec<FieldPoint>,
    data: &FieldReadings,
    strength_sigma: f64,
) -> Result<Magnetometer, MagnetometerError> {
    let parts = fit
        .model
        .decompose()
        .map_err(|_| MagnetometerError::FieldUnsolvable)?;
    let covariance: ModelCovariance<f64> = fit.model_covariance() * triad.widened;
    let sigma = |place: usize| (fit.covariance[(place, place)] * triad.widened).sqrt();
    let undisturbed = fit.used.iter().map(|k| fit.residuals[*k].field);
    let fields: Vec<_> = undisturbed.collect();
    let calibration = TriadCalibration {
        inherited: None,
        inheritance: Inheritance::default(),
        drift: None,
        slip: None,
        asymmetry: None,
        model: fit.model,
        covariance,
        observed: [true; 12],
        parts,
        parts_covariance: parts.carry(&covariance),
        g_sensitivity: None,
        rank: fit.places.iter().filter(|place| **place < 12).count(),
        widened: triad.widened,
        by_direction: 0.0,
        variance_freedom: triad.variance_freedom,
        chi_square: triad.chi_square,
        degrees_of_freedom: triad.degrees_of_freedom,
        residuals: triad.residuals,
        labels: triad.labels,
    };
    Ok(Magnetometer {
        calibration: calibration.with_gravity(strength_sigma / fit.strength),
        current: fit
            .current
            .map(|response| (response, Vector3::from_fn(|axis, _| sigma(12 + axis)))),
        strength: (fit.strength, sigma(16)),
        dip: fit.dip().map(|dip| (dip, fit.dip_sigma() * triad.widened.sqrt())),
        points,
        next: next_field(fit, &data.readings),
        coverage: coverage(&fields),
        scatter: None,
    })
}

pub(super) fn rest_points(fit: &FieldFit, data: &FieldReadings, spans: &[(f64, f64)]) -> Vec<FieldPoint> {
    let places = fit.residual_places();
    let groups: Vec<usize> = fit.used.iter().map(|k| fit.groups[*k]).collect();
    let (influences, unseen) = (
        influence(&fit.linear, &places),
        held_out(&fit.linear, &places, &groups),
    );
    let of = |k: usize| {
        let found = &fit.residuals[k];
        let among = fit.used.iter().position(|used| *used == k);
        let none = Influence {
            leverage: 0.0,
            change: 0.0,
        };
        FieldPoint {
            span: spans[k],
            field: found.field,
            before: data.readings[k].mean.norm() - fit.strength,
            after: found.values.x,
            sigma: found.covariance[(0, 0)].sqrt(),
            dip: fit.upward.map(|upward| {
                // No linear form: a field that is cut off may be shorter than what points up in the others.
                let here = |more: f64| dip_of(upward + found.values.y + more, found.field.norm());
                let sigma = found.covariance[(1, 1)].sqrt();
                (
                    here(0.0) - dip_of(upward, fit.strength),
                    (here(-sigma) - here(sigma)) / 2.0,
                )
            }),
            weight: fit.weights[k],
            chance: fit.chances[k],
            disturbed: among.is_none(),
            direction: fit.groups[k],
            influence: among.map_or(none, |place| influences[place]),
            // A disturbed reading is not in the fit.
            held_out: among.map_or(Some(found.values.x), |place| unseen[places[place][0]]),
        }
    };
    (0..data.readings.len()).map(of).collect()
}

fn block_point(
    number: usize,
    block: &FieldBlock,
    samples: &FieldSamples<'_>,
    stride: usize,
    strength: f64,
) -> FieldPoint {
    let (first, end) = (
        block.span.0 * stride,
        ((block.span.1 - 1) * stride + 1).min(samples.field.len()),
    );
    let raw = samples.field[first..end].iter().map(|y| Vector3::from(*y).norm());
    #[allow(clippy::cast_precision_loss)]
    let mean = raw.sum::<f64>() / (end - first) as f64;
    FieldPoint {
        span: (samples.time[first], samples.time[end - 1]),
        field: block.field,
        before: mean - strength,
        after: block.value,
        sigma: block.sigma,
        dip: None,
        weight: 1.0,
        chance: block.chance,
        disturbed: block.chance < FALSE_ALARM,
        direction: number,
        influence: block.influence,
        held_out: block.held_out,
    }
}
