//! Stretches of time, and smooth steps over them.

use crate::simulate::series::Series;

/// A stretch of time between two others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
}

impl Span {
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
        let up = Span {
            start,
            end: start + ramp,
        };
        let down = Span {
            start: end - ramp,
            end,
        };
        up.rise(t) - down.rise(t)
    }
}
