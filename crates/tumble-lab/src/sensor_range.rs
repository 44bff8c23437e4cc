//! Detection of readings at the end of a sensor's range.

/// Share of the extreme from which a reading counts as near it.
pub(crate) const NEAR_END: f64 = 0.98;

/// A value is the end of a range only where it was reached so often.
pub(crate) const PILED_UP: u32 = 4;

/// Specific force, m/s^2, and angular rate, rad/s, below which no range ends; no rest shows as much.
pub(crate) const SMALLEST_RANGE: [f64; 2] = [15.0, 0.5];
