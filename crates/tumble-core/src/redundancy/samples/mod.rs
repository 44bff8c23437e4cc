//! Samples of any unit, on one clock, become means over windows common to all, and pairs of primary and secondary.

pub mod clock;
pub mod history;
pub mod pair;
pub mod steps;
pub mod window;
