//! A target, calibrated against a fitted reference.

use super::error::TurntableError;
use super::pairing::{Pairing, pair};
use super::reference::{Reference, Ups};
use super::session::TargetSession;
use super::settings::{FEWEST_RESTS, TurntableSettings};
use super::triad::TriadCalibration;
use crate::acquisition::Acquired;

/// A target, calibrated.
#[derive(Clone, Debug)]
pub struct Target {
    /// How it was laid beside the reference.
    pub pairing: Pairing,
    /// Accelerometer, where the log has one.
    pub accelerometer: Option<TriadCalibration>,
    /// Gyroscope, where the logs of reference and target have one.
    pub gyroscope: Option<TriadCalibration>,
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
    let pairing = pair(reference_unit, unit, settings.clocks)?;
    if pairing.pairs.len() < FEWEST_RESTS {
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
    let accelerometer = triads
        .accelerometer
        .then(|| session.accelerometer())
        .transpose()?;
    let mounting = accelerometer.as_ref().map(|triad| triad.parts.mounting);
    let gyroscope = triads
        .gyroscope
        .then(|| session.gyroscope(mounting.as_ref()))
        .transpose()
        .map_err(TurntableError::of_gyroscope)?;
    Ok(Target {
        pairing,
        accelerometer,
        gyroscope,
    })
}
