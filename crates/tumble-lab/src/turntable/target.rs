//! A target, calibrated against a fitted reference.

use super::error::TurntableError;
use super::pairing::{Pairing, pair, pair_rates};
use super::rate_response::AxisResponse;
use super::reference::{Reference, Ups};
use super::session::TargetSession;
use super::settings::{Clocks, FEWEST_RESTS, TurntableSettings};
use super::triad::TriadCalibration;
use crate::acquisition::{Acquired, without_turning};
use tumble_core::noise::Interval;

/// A target, calibrated.
#[derive(Clone, Debug)]
pub struct Target {
    /// How it was laid beside the reference.
    pub pairing: Pairing,
    /// Accelerometer, where the log has one.
    pub accelerometer: Option<TriadCalibration>,
    /// Gyroscope, where the logs of reference and target have one.
    pub gyroscope: Option<TriadCalibration>,
    /// Response of each axis of the gyroscope that turned at constant rates.
    pub responses: Vec<AxisResponse>,
}

/// Which triads there are to calibrate; what a log has not is zero in what was acquired from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triads {
    /// The target's log has specific force.
    pub accelerometer: bool,
    /// The logs of both have angular rate.
    pub gyroscope: bool,
}

/// Calibrates one target.
///
/// # Errors
/// [`TurntableError`] as it says.
pub fn calibrate(
    reference_unit: &Acquired,
    reference: &Reference,
    unit: &Acquired,
    ups: &Ups,
    settings: &TurntableSettings,
    triads: Triads,
) -> Result<Target, TurntableError> {
    let rates = reference_unit.constant_rates().next().is_some() && triads.gyroscope;
    let rested = reference_unit.rests.len() >= FEWEST_RESTS;
    let pairing = if rates && !rested {
        pair_rates(reference_unit, unit, settings.clocks)?
    } else {
        pair(reference_unit, unit, settings.clocks)?
    };
    if pairing.pairs.len() < FEWEST_RESTS && !(rates && !rested) {
        return Err(TurntableError::TooFewRests {
            found: pairing.pairs.len(),
            needed: FEWEST_RESTS,
        });
    }
    let session = TargetSession {
        reference_unit,
        reference,
        unit,
        pairing: &pairing,
        ups,
        settings,
    };
    let accelerometer = (triads.accelerometer && rested)
        .then(|| session.accelerometer())
        .transpose()?;
    let mounting = accelerometer.as_ref().map(|triad| triad.parts.mounting);
    let fitted = triads
        .gyroscope
        .then(|| session.gyroscope(mounting.as_ref()))
        .transpose()
        .map_err(TurntableError::of_gyroscope)?;
    let (gyroscope, responses) = fitted.unzip();
    Ok(Target {
        pairing,
        accelerometer,
        gyroscope,
        responses: responses.unwrap_or_default(),
    })
}

/// What a target showed, with rests and constant rates as the reference saw them; `None` where its own are the same.
pub fn as_reference(reference_unit: &Acquired, unit: &Acquired, clocks: Clocks) -> Option<Acquired> {
    let pairing = pair_rates(reference_unit, unit, clocks).ok()?;
    let own = |time: f64| time + pairing.clock.offset_at(time).0;
    let turning: Vec<_> = reference_unit
        .constant_rates()
        .map(|plateau| Interval {
            start: own(plateau.interval.start),
            end: own(plateau.interval.end),
        })
        .collect();
    without_turning(unit, &turning)
}
