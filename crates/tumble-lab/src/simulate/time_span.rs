//! Stretches of time, and smooth steps over them.

use crate::simulate::series::Series;

/// A stretch of time between two others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeSpan {
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
}

impl TimeSpan {
    /// s.
    pub fn duration(&self) -> f64 {
        self.end - self.start
    }

    /// From 0 before the span to 1 after it, with four continuous derivatives: `x^5` times a polynomial that makes the
    /// step odd about its middle.
    pub fn rise<const N: usize>(&self, t: f64) -> Series<N> {
        if t <= self.start {
            return Series::constant(0.0);
        }
        if t >= self.end {
            return Series::constant(1.0);
        }
        let x = (Series::time(t) + -self.start) / self.duration();
        let falling = [70.0, -315.0, 540.0, -420.0, 126.0];
        let polynomial = falling
            .into_iter()
            .fold(Series::constant(0.0), |sum, factor| sum * x + factor);
        let square = x * x;
        square * square * x * polynomial
    }

    /// From 0 up to 1 over a first stretch of the span, and down again over a last one as long, `ramp` s at most.
    pub fn swell<const N: usize>(&self, t: f64, ramp: f64) -> Series<N> {
        let ramp = ramp.min(self.duration() / 2.0);
        let (start, end) = (self.start, self.end);
        let up = TimeSpan {
            start,
            end: start + ramp,
        };
        let down = TimeSpan {
            start: end - ramp,
            end,
        };
        up.rise(t) - down.rise(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_rise_goes_up_only_and_is_odd_about_its_middle(start in -5.0..5.0f64, length in 0.5..9.0f64, part in 0.0..1.0f64) {
            let span = TimeSpan { start, end: start + length };
            let rise = |part: f64| span.rise::<2>(start + part * length);
            prop_assert!(rise(part).derivative(1) >= -1e-12);
            prop_assert!((rise(part).value() + rise(1.0 - part).value() - 1.0).abs() < 1e-9);
        }

        #[test]
        fn a_rise_joins_before_and_after_with_four_derivatives(start in -5.0..5.0f64, length in 0.5..9.0f64) {
            let span = TimeSpan { start, end: start + length };
            let near = 1e-9 * length;
            for (t, level) in [(start + near, 0.0), (start + length - near, 1.0)] {
                let rise = span.rise::<5>(t);
                prop_assert!((rise.value() - level).abs() < 1e-12);
                for order in 1..5 {
                    prop_assert!(rise.derivative(order).abs() < 1e-4 / length.powi(order as i32), "order {order}");
                }
            }
        }

        #[test]
        fn a_swell_is_whole_between_its_ramps_and_nothing_outside(length in 1.0..30.0f64, ramp in 0.1..40.0f64) {
            let span = TimeSpan { start: 2.0, end: 2.0 + length };
            let at = |t| span.swell::<1>(t, ramp).value();
            prop_assert_eq!((at(1.9), at(2.1 + length)), (0.0, 0.0));
            prop_assert!((at(2.0 + length / 2.0) - 1.0).abs() < 1e-12);
        }
    }
}
