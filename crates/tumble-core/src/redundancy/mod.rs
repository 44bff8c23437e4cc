//! A primary unit that keeps its secondaries calibrated, and a secondary that takes over when the primary fails.
//!
//! Read in this order:
//!
//! 1. [`sensor`], [`platform`] and [`settings`]: the set as it is built, and how it is to behave; [`thresholds`], and what
//!    [`contradiction`] there may be;
//! 2. [`clock`], [`window`] and [`unit`]: samples of any unit become means over windows common to all;
//! 3. [`rest`], [`evaluation`] and [`gate`]: what is found at rest, and whether it triggers;
//! 4. [`calibrating`]: the mode that waits for motion and collects; [`pairing`] and [`joint`]: what it keeps of pairs;
//! 5. [`residual`] and [`fit`]: the ladder; [`adoption`]: whether the result may replace what is stored; [`relation`] and [`record`]: what
//!    is;
//! 6. [`health`], [`family`] and [`selection`]: who can be trusted, and who is the source; [`output`]: what comes out;
//! 7. [`monitor`] ties it together, and [`event`] tells of it.
//!
//! Derivations: docs/theory/redundancy.md.

pub mod adoption;
pub mod calibrating;
pub mod clock;
mod conclusion;
pub mod contradiction;
pub mod evaluation;
pub mod event;
mod excitation;
pub mod family;
pub mod fit;
pub mod gate;
pub mod health;
pub mod joint;
pub mod monitor;
pub mod output;
pub mod pairing;
pub mod platform;
pub mod record;
pub mod relation;
pub mod residual;
pub mod rest;
mod resting;
mod restoring;
pub mod selection;
pub mod sensor;
pub mod settings;
mod step;
pub mod thresholds;
pub mod unit;
pub mod window;
