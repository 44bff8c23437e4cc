//! Storage that outlasts a reset: calibration records as bytes, and in flash, without heap or operating system.
//!
//! 1. [`checksum`]: what is at the end of all bytes that are stored.
//! 2. [`record`]: one record, its bytes (`docs/record-format.md`) and what can be wrong with them.
//! 3. [`flash`]: the records of many units in NOR flash, whole after a power cut at any point.
//!
//! State belongs to the caller, time comes with each call, and nothing here panics on data, like in `tumble-core`.
#![no_std]

pub mod checksum;
pub mod flash;
pub mod record;
