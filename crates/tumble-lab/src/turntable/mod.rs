//! The turntable procedure on whole recordings: the reference first, then any number of targets.
//!
//! [`fit_reference`] makes a [`Reference`] of a unit, [`pairing`] lays a target's rests beside the reference's, and
//! [`calibrate`] makes a [`Target`] of both.

mod accelerometer;
mod asymmetry;
mod clock_shift;
mod commanded;
mod direction_misfit;
mod error;
mod field;
mod field_disturbance;
pub(crate) mod flicker;
mod g_sensitivity;
mod gyroscope;
#[cfg(feature = "workstation")]
pub mod magnetometer;
pub mod pairing;
mod rate_response;
mod reference;
mod reference_drift;
pub mod reference_uncertainty;
mod session;
mod session_change;
mod settings;
mod target;
mod triad;

pub use commanded::CommandedRates;
pub use error::{PairingError, TurntableError};
pub use g_sensitivity::FALSE_ALARM as RESPONSE_FALSE_ALARM;
pub use rate_response::{AxisResponse, RateLevel};
pub use reference::{
    Reference, ReferenceUncertainty, TableTruth, Ups, fit_reference, force_sigma, own_sphere, poses,
    rate_sigma,
};
pub use reference_drift::ReferenceDrift;
pub use session_change::{BiasDrift, Side, Slip};
pub use settings::{Clocks, FEWEST_RESTS, GSensitivity, TurntableSettings};
pub use target::{Target, Triads, as_reference, calibrate};
pub(crate) use triad::widening;
pub use triad::{ResidualLabel, TriadCalibration};
