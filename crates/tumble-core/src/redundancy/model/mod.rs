//! A redundant set by one model: each secondary's errors are one Gaussian, which is its calibration, the uncertainty of it, and
//! the allowance in the test of pairs, at once.
//!
//! 1. [`table`]: all constants;
//! 2. [`window`]: readings of a unit under triangles of 0.1 s; [`motion`]: those of the set; [`means`]: over scales of time;
//!    [`clock`]: the delay of a unit;
//! 3. [`error`] and [`triangle`]: the Gaussian, to which motion adds information;
//! 4. [`mod@test`] and [`vibration`]: a pair against what health explains;
//! 5. [`vote`], [`own`], [`rest`] and [`bounds`]: the unit that is wrong;
//! 6. `gather`: blocks that are learnt from once they have ended in agreement; [`monitor`]: all of it, and its events.
//!
//! Derivation: docs/theory/set.md. `benchmarks/flights/model` is the same in numpy, step by step.

pub mod bounds;
pub mod clock;
pub mod error;
mod gather;
pub mod means;
pub mod monitor;
pub mod motion;
pub mod own;
pub mod rest;
pub mod table;
pub mod test;
pub mod triangle;
pub mod vibration;
pub mod vote;
pub mod window;
