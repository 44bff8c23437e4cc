//! Calibration without equipment: rests in many orientations, turned by hand in between (docs/theory/multipose.md).
//!
//! [`multipose()`] takes the samples of one unit. [`accelerometer`] fits the length of gravity at the rests, [`gyroscope`]
//! how gravity turned between them, each with [`levenberg_marquardt`]. [`influence`] and [`next_orientation`] say how far
//! the poses carry the result, [`nominal_scale`] what counts of an unknown unit are.

pub mod accelerometer;
mod directions;
mod error;
pub mod gyroscope;
pub mod influence;
pub mod levenberg_marquardt;
pub mod next_orientation;
mod nominal_scale;
mod observability;
mod procedure;
mod rest_selection;
mod robust;
pub mod rotation_response;
mod settings;

#[cfg(test)]
mod tests;

pub use error::MultiposeError;
pub use nominal_scale::NominalScale;
pub use procedure::{Gyroscope, Multipose, Pose, UnitSamples, multipose};
pub use settings::{FEWEST_DIRECTIONS, MultiposeSettings};
