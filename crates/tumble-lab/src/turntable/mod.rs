//! The turntable procedure on whole recordings: the reference first, then any number of targets.
//!
//! [`understand`] makes a [`Reference`] of a unit, [`pairing`] lays a target's rests beside the reference's, and
//! [`calibrate`] makes a [`Target`] of both.

mod accelerometer;
mod error;
mod flicker;
mod gyroscope;
pub mod pairing;
mod reference;
mod session;
mod settings;
mod target;
mod triad;

pub use error::{PairingError, TurntableError};
pub use reference::{Reference, Ups, force_sigma, own_sphere, poses, rate_sigma, understand};
pub use settings::{Clocks, FEWEST_RESTS, TurntableSettings};
pub use target::{Target, calibrate};
pub use triad::{Label, TriadCalibration};
