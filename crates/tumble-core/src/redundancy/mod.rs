//! A primary unit that keeps its secondaries calibrated, and a secondary that takes over when the primary fails.

pub mod sensor;
