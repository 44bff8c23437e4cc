//! The two kinds of number the core runs on.

use nalgebra::{ComplexField, RealField};

use crate::single;

/// Microseconds in a second.
pub const SECOND: u64 = 1_000_000;

/// `f32` on devices, `f64` on hosts. Conversions of whole numbers, and functions that libm works out by way of `f64`, are its
/// own: most devices lack `f64`, and they would cost more than what is done with them.
pub trait Real: RealField + Copy {
    /// The number closest to a count.
    fn of_count(count: u32) -> Self;

    /// A number of single precision.
    fn of_single(value: f32) -> Self;

    /// Seconds in a span of microseconds.
    fn of_microseconds(span: u64) -> Self;

    /// Microseconds in a span of seconds, to the nearest; the largest there are of a longer one, 0 of NaN.
    fn microseconds(self) -> i64;

    /// Square root; NaN of what is negative.
    fn square_root(self) -> Self;

    /// Sine and cosine of an angle in rad; those of `f32` are limited to the angles stated there.
    fn sine_cosine(self) -> (Self, Self);

    /// Angle in rad of a sine.
    fn arc_sine(self) -> Self;

    /// `sqrt(x^2 + y^2)`.
    fn hypotenuse(self, other: Self) -> Self;
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

    #[allow(clippy::cast_possible_truncation)]
    fn microseconds(self) -> i64 {
        (self * 1e6 + if self < 0.0 { -0.5 } else { 0.5 }) as i64
    }

    fn square_root(self) -> Self {
        tumble_processor::square_root(self)
    }

    fn sine_cosine(self) -> (Self, Self) {
        single::sine_cosine(self)
    }

    fn arc_sine(self) -> Self {
        single::arc_sine(self)
    }

    fn hypotenuse(self, other: Self) -> Self {
        single::hypotenuse(self, other)
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

    #[allow(clippy::cast_possible_truncation)]
    fn microseconds(self) -> i64 {
        (self * 1e6 + if self < 0.0 { -0.5 } else { 0.5 }) as i64
    }

    fn square_root(self) -> Self {
        ComplexField::sqrt(self)
    }

    fn sine_cosine(self) -> (Self, Self) {
        ComplexField::sin_cos(self)
    }

    fn arc_sine(self) -> Self {
        ComplexField::asin(self)
    }

    fn hypotenuse(self, other: Self) -> Self {
        ComplexField::hypot(self, other)
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

/// Whole spans in a time, and what is left of it: by divisions of 32 bits, which processors have. A span shorter than one
/// microsecond counts as one, and it has to be shorter than 2^31.
#[inline(never)]
#[allow(clippy::cast_possible_truncation)]
pub fn whole_spans(time: u64, span: u64) -> (u64, u64) {
    let span = span.clamp(1, (1 << 31) - 1) as u32;
    let (upper, lower) = ((time >> 32) as u32, time as u32);
    let (mut whole, mut left) = (u64::from(upper / span), upper % span);
    // The remainder is less than the span: so many bits more fit beside it.
    let most = span.leading_zeros();
    let mut bits = u32::BITS;
    while bits > 0 {
        let taken = most.min(bits);
        bits -= taken;
        let next = left << taken | lower >> bits & ((1 << taken) - 1);
        whole = whole << taken | u64::from(next / span);
        left = next % span;
    }
    (whole, u64::from(left))
}

/// A count as a number.
pub fn count<T: Real>(count: u32) -> T {
    T::of_count(count)
}

/// Seconds in a span of microseconds.
pub fn seconds<T: Real>(microseconds: u64) -> T {
    T::of_microseconds(microseconds)
}

#[cfg(test)]
mod tests {
    use super::whole_spans;

    #[test]
    fn whole_spans_and_what_is_left_make_up_the_time() {
        let times = (0..64)
            .map(|bits| 1_u64 << bits)
            .chain([0, u64::MAX, 86_400_000_000]);
        for time in times.flat_map(|time| [time, time.wrapping_sub(1), time / 3]) {
            for span in [1, 2, 3, 7, 1000, 50_000, 1_000_000, (1 << 20) + 1, (1 << 31) - 1] {
                assert_eq!(
                    whole_spans(time, span),
                    (time / span, time % span),
                    "{time} / {span}"
                );
            }
        }
    }
}
