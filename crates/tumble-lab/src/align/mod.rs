//! Alignment of two units that move together: clock and rotation from their angular rates alone, then the lever arm
//! from their specific forces. Derivation: docs/theory/align.md.
//!
//! [`samples`] takes means of a unit's samples over windows, [`grid`] pairs those of two units, [`coarse`] finds clock and
//! rotation roughly, [`rates`] finds them to the last digit, [`forces`] finds the lever arm. Where the
//! motion was about one axis, [`gravity`] finds what the rates leave open. [`response`] holds what filters differ in; [`robust`]
//! solves both fits.
//! [`procedure`] takes these steps one by one.

pub mod coarse;
mod error;
pub mod forces;
pub mod gravity;
pub mod grid;
pub mod procedure;
pub mod rates;
pub mod response;
pub mod robust;
pub mod samples;
mod settings;

pub use error::AlignError;
pub use procedure::{Aligned, LEAST_CORRELATION, LEAST_MOTION, align};
pub use settings::AlignSettings;
