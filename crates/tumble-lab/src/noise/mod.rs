//! Noise of a sensor that stands still: Allan deviations of records of any length, and the terms they show.
//!
//! [`deviation`] takes in samples and keeps sums, [`chance`] says how much such deviations scatter by chance and
//! together, [`term`] names what they are made of, [`fit`] finds it. Method: docs/theory/noise.md, "Long records".

pub mod chance;
pub mod deviation;
pub mod fit;
mod level;
mod non_negative;
pub mod record;
mod skewed;
pub mod term;
