//! A primary unit that keeps its secondaries calibrated, and a secondary that takes over when the primary fails.
//!
//! Read in this order:
//!
//! 1. [`sensor`], [`platform`] and [`settings`]: the set as it is built, how it is to behave, and whether the settings
//!    contradict each other;
//! 2. [`samples`]: samples of any unit become means over windows common to all, and pairs of primary and secondary;
//! 3. [`evaluation`] and [`gate`]: what is found at rest, and whether it triggers;
//! 4. [`fit`]: what is kept of pairs, the ladder of fits, and whether the result may replace what is stored;
//!    [`relative_error`] and [`record`]: what is;
//! 5. [`health`] and [`selection`]: who can be trusted, and who is the source; [`output`]: what comes out;
//! 6. [`judgement`] and [`aiding`]: who is wrong, by what units say of each other and what something else says of them;
//! 7. [`monitor`] ties it together, and its events tell of it.
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
pub mod judgement;
mod leaky;
pub mod monitor;
pub mod output;
pub mod platform;
pub mod record;
pub mod relative_error;
pub mod samples;
pub mod selection;
pub mod sensor;
pub mod settings;
mod unit_set;
