//! The two kinds of number the core runs on.

use nalgebra::RealField;

/// `f32` on devices, `f64` on hosts.
pub trait Real: RealField + Copy {}

impl Real for f32 {}
impl Real for f64 {}

/// A constant of the text, in the number type at hand.
pub fn real<T: Real>(value: f64) -> T {
    nalgebra::convert(value)
}

/// A count as a number.
pub fn count<T: Real>(count: u32) -> T {
    nalgebra::convert(f64::from(count))
}

/// Seconds in a span of microseconds.
pub fn seconds<T: Real>(microseconds: u64) -> T {
    // Processors convert signed integers in one step, and 2^63 microseconds are 292 000 years.
    #[allow(clippy::cast_precision_loss)]
    nalgebra::convert(microseconds.cast_signed() as f64 * 1e-6)
}
