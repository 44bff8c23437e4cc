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
    /// Accelerometer.
    pub accelerometer: TriadCalibration,
    /// Gyroscope.
    pub gyroscope: TriadCalibration,
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
    let accelerometer = session.accelerometer()?;
    let gyroscope = session
        .gyroscope(&accelerometer.parts.mounting)
        .map_err(TurntableError::of_gyroscope)?;
    Ok(Target {
        pairing,
        accelerometer,
        gyroscope,
    })
}
