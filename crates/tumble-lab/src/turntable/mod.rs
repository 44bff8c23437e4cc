//! The turntable procedure on whole recordings: the reference first, then any number of targets.

use tumble_core::model::ModelError;
use tumble_core::regression::Unsolvable;
use tumble_core::turntable::truth::Truth;

use crate::acquisition::Acquired;
use crate::pairing::{Clocks, Pairing, PairingError, pair};

mod accelerometer;
mod flicker;
mod gyroscope;
mod reference;
mod session;
mod triad;

pub use reference::{Reference, Ups, force_sigma, own_sphere, poses, rate_sigma, understand};
use session::Session;
pub use triad::{Label, Triad};

/// How to calibrate.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Local gravity, m/s^2.
    pub gravity: f64,
    /// Latitude, rad, where it is known: it fixes the upward part of the Earth's rotation.
    pub latitude: Option<f64>,
    /// Where the truth comes from.
    pub truth: Truth,
    /// How the clocks are related.
    pub clocks: Clocks,
    /// Whether to fit the gyroscope's sensitivity to specific force.
    pub g_sensitivity: bool,
}

/// Why there is no calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TurntableError {
    /// Fewer rests than the unknowns need.
    TooFewRests {
        /// Rests found, or seen by both units.
        found: usize,
        /// Rests needed.
        needed: usize,
    },
    /// The rests point in too few directions.
    DirectionsTooAlike,
    /// The target could not be laid beside the reference.
    Pairing(PairingError),
    /// The truth asked for needs the mounting angle, which needs a pose list.
    NeedsPoses,
    /// The axes of the accelerometer form a left-handed set, or coincide.
    Axes(ModelError),
    /// The axes of the gyroscope form a left-handed set, or coincide.
    GyroscopeAxes(ModelError),
    /// Something was not finite.
    Unsolvable,
}

impl From<Unsolvable> for TurntableError {
    fn from(_: Unsolvable) -> Self {
        Self::Unsolvable
    }
}

impl From<PairingError> for TurntableError {
    fn from(error: PairingError) -> Self {
        Self::Pairing(error)
    }
}

impl From<ModelError> for TurntableError {
    fn from(error: ModelError) -> Self {
        Self::Axes(error)
    }
}

/// Rests that twelve unknowns of three axes need.
pub const FEWEST_RESTS: usize = 4;

/// A target, calibrated.
#[derive(Clone, Debug)]
pub struct Target {
    /// How it was laid beside the reference.
    pub pairing: Pairing,
    /// Accelerometer.
    pub accelerometer: Triad,
    /// Gyroscope.
    pub gyroscope: Triad,
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
    settings: &Settings,
) -> Result<Target, TurntableError> {
    let pairing = pair(reference_unit, unit, settings.clocks)?;
    if pairing.pairs.len() < FEWEST_RESTS {
        return Err(TurntableError::TooFewRests {
            found: pairing.pairs.len(),
            needed: FEWEST_RESTS,
        });
    }
    let session = Session {
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
        .map_err(|error| match error {
            TurntableError::Axes(of) => TurntableError::GyroscopeAxes(of),
            other => other,
        })?;
    Ok(Target {
        pairing,
        accelerometer,
        gyroscope,
    })
}
