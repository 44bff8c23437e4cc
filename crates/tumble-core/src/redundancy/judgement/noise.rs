//! Who is noisier than it used to be beside the others.

use crate::real::{Real, count, real, tabulated};
use crate::redundancy::components::larger;
use crate::redundancy::sensor::Sensor;

/// Scatter of a sample below which nobody is noisy, whatever that of the others: m/s^2 and rad/s.
const QUIET: [f32; 2] = [0.15, 0.015];

/// Time over which the usual scatter is taken, s.
const USUAL_OVER: f64 = 30.0;

/// Windows in succession that exclude.
const WINDOWS: u8 = 4;

/// Scatter of the samples of one sensor of a unit, from sample to sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsualScatter<T: Real> {
    /// m/s^2 or rad/s.
    usual: T,
    learnt: u16,
    noisy: u8,
}

impl<T: Real> UsualScatter<T> {
    /// Nothing seen.
    pub fn new() -> Self {
        Self {
            usual: T::zero(),
            learnt: 0,
            noisy: 0,
        }
    }

    /// Learns from a window in health. `window` is its length, s.
    pub fn learn(&mut self, scatter: T, window: T) {
        self.learnt = self.learnt.saturating_add(1);
        let share = larger(
            window / real(USUAL_OVER),
            T::one() / count::<T>(self.learnt.into()),
        );
        self.usual += (scatter - self.usual) * share;
    }

    /// What it usually is, once it is known, m/s^2 or rad/s.
    pub fn usual(&self) -> Option<T> {
        (self.learnt > 0).then_some(self.usual)
    }

    /// Whether the latest window was beyond the limit.
    pub fn was_noisy(&self) -> bool {
        self.noisy > 0
    }

    /// The latest window cannot have been beyond any limit.
    pub fn was_quiet(&mut self) {
        self.noisy = 0;
    }

    /// Whether a scatter has been beyond a limit, m/s^2 or rad/s, for long enough.
    pub fn is_noisy(&mut self, scatter: T, limit: T) -> bool {
        self.noisy = if scatter > limit {
            self.noisy.saturating_add(1)
        } else {
            0
        };
        self.noisy >= WINDOWS
    }
}

/// Whether a scatter, m/s^2 or rad/s, is so small that it does not matter, whatever that of the others.
pub fn is_quiet<T: Real>(sensor: Sensor, scatter: T) -> bool {
    scatter <= tabulated(*sensor.of(&QUIET))
}

/// The scatter a unit may have: `times` what the others, each by its usual ratio to it, make one expect, and no less than
/// what does not matter; a unit may be as loud as the others where all shake (docs/theory/judgement.md, eq. 11).
pub fn limit<T: Real>(sensor: Sensor, usual: T, others: impl Iterator<Item = (T, T)>, times: T) -> Option<T> {
    let expected = others
        // One that repeats itself is no standard of noise.
        .filter(|(scatter, usual)| *scatter > T::zero() && *usual > T::zero())
        .map(|(scatter, usual_of_other)| scatter * larger(T::one(), usual / usual_of_other))
        .reduce(larger)?;
    Some(larger(tabulated(*sensor.of(&QUIET)), expected * times)) // eq. 11
}
