//! The magnetometer: hard iron, soft iron and mounting from the length and the dip of the Earth's field
//! (docs/theory/magnetometer.md).
//!
//! [`fit_field`] solves for all unknowns of [`FieldReadings`]. [`calibrate_at_rests`] takes these from the rests of a unit whose
//! accelerometer is calibrated, [`calibrate_turned`] from a log of a unit that was turned without a rest.

mod alignment;
mod calibration;
mod constancy;
mod disturbed;
mod error;
mod fit;
mod next_field;
mod range_ends;
mod readings;
mod rests;
mod settled;
mod turned;
mod unknowns;

#[cfg(test)]
mod tests;

pub use calibration::{FieldPoint, Magnetometer, calibrate_at_rests, calibrate_turned};
pub use error::MagnetometerError;
pub use fit::{FieldFit, FieldSettings, MOST_LEFT_OUT, fit_field};
pub use next_field::{NextField, coverage};
pub use range_ends::range_ends;
pub use readings::{FieldReading, FieldReadings, Upward};
pub(crate) use rests::means_at;
pub use rests::{CalibratedAccelerometer, FieldSamples, RestUp};
