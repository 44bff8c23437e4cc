//! Largest changes of a unit from one sample to the next, over the latest spans.

use nalgebra::Vector3;

use crate::products::{Length, squared, zeros};
use crate::real::{Real, count, real};

/// Number of stored spans, and windows in each: 1.2 s at 50 ms.
const SPANS: usize = 4;
const WINDOWS_A_SPAN: u8 = 6;

/// Share by which the usual largest change follows, per span.
const USUAL_SHARE: f64 = 0.1;

/// Part of a change along a direction that noise exceeds in one span of four, except once in two hundred times.
const LEAST_PART: f64 = 0.25;

/// Change of three channels from one sample to the next, and its square.
pub(in crate::redundancy) type Step<T> = ([T; 3], T);

/// Largest changes of one sensor, in its own axes, m/s^2 or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargestSteps<T: Real> {
    /// Largest change in each span, the current one first.
    spans: [Vector3<T>; SPANS],
    /// Largest change in a usual span; zero until one is known.
    usual: T,
}

impl<T: Real> LargestSteps<T> {
    fn none() -> Self {
        Self {
            spans: [zeros(); SPANS],
            usual: T::zero(),
        }
    }

    fn take(&mut self, (step, square): &Step<T>) {
        let [span, ..] = &mut self.spans;
        if *square > squared(span) && square.is_finite() {
            *span = Vector3::from(*step);
        }
    }

    fn end_span(&mut self) {
        let [a, b, c, d] = self.spans;
        let left = d.length();
        if left > T::zero() {
            let before = if self.usual > T::zero() { self.usual } else { left };
            self.usual = before + (left - before) * real(USUAL_SHARE);
        }
        self.spans = [zeros(), a, b, c];
    }

    /// Largest change along a direction over the latest spans, and largest change against it.
    pub fn along(&self, direction: &Vector3<T>) -> (T, T) {
        let changes = self.spans.iter().map(|step| step.dot(direction));
        changes.fold((T::zero(), T::zero()), |(along, against), change| {
            (along.max(change), against.max(-change))
        })
    }

    /// Returns whether changes have a part along a direction, or against it, like noise.
    pub fn moves_along(&self, direction: &Vector3<T>) -> bool {
        let least = real::<T>(LEAST_PART * LEAST_PART);
        let mut parts = self.spans.iter().map(|step| (step.dot(direction), squared(step)));
        parts.any(|(part, square)| square > T::zero() && part * part > least * square)
    }

    /// Largest change in a usual span, once it is known.
    pub fn usual(&self) -> Option<T> {
        (self.usual > T::zero()).then_some(self.usual)
    }
}

/// Largest changes of both sensors of a unit, accelerometer first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitSteps<T: Real> {
    sensors: [LargestSteps<T>; 2],
    /// Windows of the current span.
    windows: u8,
    /// Samples in the latest complete window.
    samples: u16,
}

impl<T: Real> UnitSteps<T> {
    /// Creates changes of zero.
    pub fn none() -> Self {
        Self {
            sensors: [LargestSteps::none(); 2],
            windows: 0,
            samples: 0,
        }
    }

    /// Adds the change to the next sample.
    pub(in crate::redundancy) fn take(&mut self, steps: &[Step<T>; 2]) {
        for (sensor, step) in self.sensors.iter_mut().zip(steps) {
            sensor.take(step);
        }
    }

    /// Completes a window of a number of samples.
    pub(in crate::redundancy) fn complete(&mut self, samples: u16) {
        self.samples = samples;
        self.windows = self.windows.saturating_add(1);
        if self.windows >= WINDOWS_A_SPAN {
            self.windows = 0;
            self.sensors.iter_mut().for_each(LargestSteps::end_span);
        }
    }

    /// Largest changes of both sensors.
    pub fn sensors(&self) -> &[LargestSteps<T>; 2] {
        &self.sensors
    }

    /// Mean sample interval, as a share of a window.
    pub fn interval(&self) -> T {
        T::one() / count(u32::from(self.samples.max(1)))
    }
}
