//! A primary unit that keeps its secondaries calibrated, and a secondary that takes over when the primary fails.
//!
//! Reading order:
//!
//! 1. [`sensor`], [`platform`] and [`settings`]: the configuration of the set, and checks of its settings;
//! 2. [`samples`]: samples of any unit, averaged over common windows, and pairs of primary and secondary;
//! 3. [`evaluation`] and [`gate`]: deviations at rest, and the triggers of calibrations;
//! 4. [`fit`]: moments of pairs, the fit to them, and its adoption; [`relative_error`] and [`record`]:
//!    its result;
//! 5. [`health`] and [`selection`]: usable units, and the source; [`output`]: the output of the set;
//! 6. [`isolation`] and [`aiding`]: isolation of faulty units by comparison with each other and with
//!    aiding measurements;
//! 7. [`monitor`]: the whole process, and its events;
//! 8. [`model`]: the next monitor, which holds all of a set by one model (docs/theory/set.md).
//!
//! Derivations: docs/theory/redundancy.md.

pub mod aiding;
mod components;
#[cfg(test)]
mod draws;
pub mod evaluation;
pub mod fit;
pub mod gate;
pub mod health;
pub mod isolation;
mod leaky;
pub mod model;
pub mod monitor;
mod optional_time;
pub mod output;
pub mod platform;
pub mod record;
pub mod relative_error;
pub mod samples;
pub mod selection;
pub mod sensor;
pub mod settings;
pub mod unit_count;
mod unit_set;
