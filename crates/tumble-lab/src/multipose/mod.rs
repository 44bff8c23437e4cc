//! Calibration without equipment: rests in many orientations, turned by hand in between (docs/theory/multipose.md).
//!
//! [`multipose()`] takes the samples of one unit. [`accelerometer`] fits the length of gravity at the rests,
//! [`gyroscope`] how gravity turned between them, both by [`constant_length`](crate::constant_length).
//! [`next_orientation`] and [`next_turn`] report how well the poses determine the result, `nominal_scale` guesses the
//! scale of an unknown unit's counts. [`turn_bias`] and [`dead_band`] are gyroscopes that read otherwise in turns than at
//! rest, [`stated_rate`] a sample rate beside stamps. [`sections`] are stretches that somebody labelled; six [`faces`] of a box are a
//! case of their own, beside which stand the formulas of [`ferraris`].

pub mod accelerometer;
pub mod dead_band;
mod error;
pub mod faces;
pub mod ferraris;
pub mod gyroscope;
mod held;
pub mod next_orientation;
pub mod next_turn;
mod nominal_scale;
mod procedure;
mod rest_selection;
pub mod rotation_response;
mod samples;
pub mod sections;
mod settings;
pub mod stated_rate;
mod time_base;
pub mod turn_bias;

#[cfg(test)]
mod tests;

pub use crate::constant_length::directions::grouped;
pub use error::MultiposeError;
pub use held::{HeldSpan, held_spans};
pub use nominal_scale::NominalScale;
pub use procedure::{Faces, Gyroscope, LeftOut, Multipose, Pose, multipose};
pub use rest_selection::{BY_HAND, rest_settings};
pub use samples::MultiposeSamples;
pub use sections::{Section, SectionLabel};
pub use settings::{FEWEST_DIRECTIONS, FULL_TURN_SIGMA, KnownNoise, MultiposeSettings};
