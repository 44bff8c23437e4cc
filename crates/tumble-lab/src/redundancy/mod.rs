//! Logs through the redundancy monitor of the core: the very code that runs on a device, sample by sample.
//!
//! [`event_text`] puts events in words and figures, [`dyn_monitor`] hides how many units there are and in which
//! precision they are watched, and [`replay`] drives it with arrays. [`dyn_set`] does both for the next monitor.

pub mod dyn_monitor;
pub mod dyn_set;
pub mod event_text;
pub mod replay;
