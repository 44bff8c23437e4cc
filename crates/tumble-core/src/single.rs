//! Sine, cosine, arc sine and hypotenuse in single precision, by single precision alone.
//!
//! Those of libm go by way of double precision, which a Cortex-M4F lacks: 6 KiB of flash, and hundreds of instructions a
//! sine. Here are sums, products and roots, and the arc tangent of libm, which are the same bits on every machine.
//! Functions are named with their trait: where `std` is at hand, a method is that of the machine's own library.

use core::f32::consts::FRAC_2_PI;

use nalgebra::RealField;

use crate::real::Real;

/// Largest angle, rad, that has a sine: beyond 16,000 turns single precision resolves no heading to half a degree.
const LARGEST_ANGLE: f32 = 1e5;

/// A quarter turn in three parts, of which whole multiples lose nothing (Cody and Waite, "Software Manual for the
/// Elementary Functions", 1980, chapter 8; the parts are twice those of `sinf.c` in Moshier's Cephes).
const QUARTER_TURN: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// Sine and cosine of an angle in rad; both NaN beyond 100,000 rad.
///
/// The remainder of the angle within an eighth of a turn goes into minimax polynomials (`sinf.c` of Moshier's Cephes).
/// The error is below 1e-7 up to 1000 rad and 1e-6 beyond; within an eighth of a turn it is below 1 unit in the last
/// place of the sine and 1.5 of the cosine.
#[inline(never)]
pub fn sine_cosine(angle: f32) -> (f32, f32) {
    if angle.abs() > LARGEST_ANGLE {
        return (f32::NAN, f32::NAN);
    }
    let quarters = nearest(angle * FRAC_2_PI);
    #[allow(clippy::cast_precision_loss)]
    let share = quarters as f32;
    let [most, more, rest] = QUARTER_TURN;
    let x = angle - share * most - share * more - share * rest;
    let square = x * x;
    let sine = x + x * square * (-0.166_666_55 + square * (0.008_332_161 + square * -0.000_195_152_96));
    let cosine = 1.0 - 0.5 * square
        + square * square * (0.041_666_646 + square * (-0.001_388_731_6 + square * 2.443_315_7e-5));
    match quarters & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// Arc sine in rad; NaN outside of -1 to 1. Error below 2.5 units in the last place.
#[inline(never)]
pub fn arc_sine(sine: f32) -> f32 {
    RealField::atan2(sine, ((1.0 - sine) * (1.0 + sine)).square_root())
}

/// `sqrt(x^2 + y^2)`, for sizes whose squares single precision holds.
pub fn hypotenuse(x: f32, y: f32) -> f32 {
    (x * x + y * y).square_root()
}

/// The nearest whole number; halves go away from zero.
#[allow(clippy::cast_possible_truncation)]
fn nearest(x: f32) -> i32 {
    (x + if x < 0.0 { -0.5 } else { 0.5 }) as i32
}

#[cfg(test)]
mod tests {
    use core::f32::consts::FRAC_PI_4;

    use nalgebra::ComplexField;

    use super::*;

    /// Largest errors of a function in single precision at arguments evenly spread from `-end` to `end`: absolute, and
    /// in units in the last place.
    fn errors(end: f32, said: impl Fn(f32) -> f32, truth: impl Fn(f64) -> f64) -> (f64, f64) {
        const STEPS: i32 = 400_000;
        (-STEPS..=STEPS).fold((0.0, 0.0), |(absolute, units): (f64, f64), step| {
            #[allow(clippy::cast_precision_loss)]
            let x = end * (step as f32 / STEPS as f32);
            let (said, truth) = (said(x), truth(f64::from(x)));
            let off = (f64::from(said) - truth).abs();
            #[allow(clippy::cast_possible_truncation)]
            let rounded = (truth as f32).abs();
            let unit = f64::from(f32::from_bits(rounded.to_bits() + 1)) - f64::from(rounded);
            (absolute.max(off), units.max(off / unit))
        })
    }

    fn sine(x: f32) -> f32 {
        sine_cosine(x).0
    }

    fn cosine(x: f32) -> f32 {
        sine_cosine(x).1
    }

    #[test]
    fn sine_and_cosine_agree_with_those_of_double_precision() {
        for (end, within) in [(63.0, 1e-7), (1e3, 1e-7), (LARGEST_ANGLE, 1e-6)] {
            let (sine_off, _) = errors(end, sine, ComplexField::sin);
            let (cosine_off, _) = errors(end, cosine, ComplexField::cos);
            assert!(sine_off < within, "sine to {end} rad: off by {sine_off:e}");
            assert!(cosine_off < within, "cosine to {end} rad: off by {cosine_off:e}");
        }
    }

    #[test]
    fn within_an_eighth_of_a_turn_they_agree_to_the_last_place() {
        let (_, sine_units) = errors(FRAC_PI_4, sine, ComplexField::sin);
        let (_, cosine_units) = errors(FRAC_PI_4, cosine, ComplexField::cos);
        assert!(sine_units < 1.0, "off by {sine_units} units in the last place");
        assert!(
            cosine_units < 1.5,
            "off by {cosine_units} units in the last place"
        );
    }

    #[test]
    fn the_arc_sine_agrees_with_that_of_double_precision() {
        let (_, units) = errors(1.0, arc_sine, ComplexField::asin);
        assert!(units < 2.5, "off by {units} units in the last place");
        assert!(arc_sine(1.1).is_nan());
    }

    #[test]
    fn the_hypotenuse_agrees_with_that_of_double_precision() {
        let (_, units) = errors(
            1e3,
            |x| hypotenuse(x, 9.8),
            |x| ComplexField::hypot(x, f64::from(9.8_f32)),
        );
        assert!(units < 1.5, "off by {units} units in the last place");
    }

    #[test]
    fn an_angle_that_tells_no_heading_has_no_sine() {
        for angle in [1.1e5, -1e30, f32::INFINITY, f32::NAN] {
            let (sine, cosine) = sine_cosine(angle);
            assert!(sine.is_nan() && cosine.is_nan(), "{angle}");
        }
    }
}
