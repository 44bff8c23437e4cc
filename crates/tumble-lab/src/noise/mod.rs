//! Noise of a sensor that stands still: Allan deviations of records of any length, and the terms they show.
//!
//! [`deviation`] takes in samples and keeps sums, [`chance`] computes the covariance of such deviations by chance,
//! [`term`] names the terms of noise, [`fit`] estimates them; [`lowpass`] filters white noise. Method:
//! docs/theory/noise.md, "Long records".

pub mod chance;
pub mod deviation;
pub mod disturbance;
pub mod fit;
mod level;
pub mod lowpass;
mod non_negative;
pub mod record;
mod skewed;
pub mod term;
pub mod variance_kind;
pub mod watch;
