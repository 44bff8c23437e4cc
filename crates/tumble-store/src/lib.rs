//! What outlasts a reset: calibration records as bytes, without heap or operating system.
//!
//! [`record`]: one record, its bytes (`docs/record-format.md`) and what can be wrong with them.
//!
//! As in `tumble-core`, state belongs to the caller, time comes with each call, and nothing here panics on data.
#![no_std]

pub mod record;
