//! The two kinds of number the core runs on.

use nalgebra::RealField;

/// Microseconds in a second.
pub const SECOND: u64 = 1_000_000;

/// `f32` on devices, `f64` on hosts. Conversions of whole numbers are its own: by way of `f64`, which most devices lack,
/// they would cost more than what is done with them.
pub trait Real: RealField + Copy {
    /// The number closest to a count.
    fn of_count(count: u32) -> Self;

    /// A number of single precision.
    fn of_single(value: f32) -> Self;

    /// Seconds in a span of microseconds.
    fn of_microseconds(span: u64) -> Self;
}

impl Real for f32 {
    #[allow(clippy::cast_precision_loss)]
    fn of_count(count: u32) -> Self {
        count as f32
    }

    fn of_single(value: f32) -> Self {
        value
    }

    #[allow(clippy::cast_precision_loss)]
    fn of_microseconds(span: u64) -> Self {
        span as f32 * 1e-6
    }
}

impl Real for f64 {
    fn of_count(count: u32) -> Self {
        f64::from(count)
    }

    fn of_single(value: f32) -> Self {
        f64::from(value)
    }

    #[allow(clippy::cast_precision_loss)]
    fn of_microseconds(span: u64) -> Self {
        // Processors convert signed integers in one step, and 2^63 microseconds are 292 000 years.
        span.cast_signed() as f64 * 1e-6
    }
}

/// A constant of the text, in the number type at hand.
pub fn real<T: Real>(value: f64) -> T {
    nalgebra::convert(value)
}

/// A constant out of a table that is read at a place known only at run time. Tables stand in single precision, since a
/// device would have to convert doubles as it reads them.
pub fn tabulated<T: Real>(value: f32) -> T {
    T::of_single(value)
}

/// A count as a number.
pub fn count<T: Real>(count: u32) -> T {
    T::of_count(count)
}

/// Seconds in a span of microseconds.
pub fn seconds<T: Real>(microseconds: u64) -> T {
    T::of_microseconds(microseconds)
}
