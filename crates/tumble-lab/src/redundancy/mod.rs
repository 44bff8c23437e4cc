//! Logs through the redundancy monitor of the core: the very code that runs on a device, sample by sample.
//!
//! [`names`] gives every setting a name, [`told`] puts events in words and figures, [`set`] hides how many units there
//! are and in which precision they are watched, and [`replay`] drives it with arrays.

pub mod dyn_monitor;
pub mod event_text;
pub mod names;
pub mod replay;
