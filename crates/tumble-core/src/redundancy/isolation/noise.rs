//! Detection of a unit that is noisier than before, compared with the others.

use crate::real::{Real, count, real, tabulated};
use crate::redundancy::components::larger;
use crate::redundancy::sensor::Sensor;

/// Scatter below which a unit is never noisy, whatever the scatter of the others: m/s^2 and rad/s.
const QUIET: [f32; 2] = [0.15, 0.015];

/// Time constant of the usual scatter, s.
const USUAL_OVER: f64 = 30.0;

/// Successive noisy windows after which a unit is excluded.
const WINDOWS: u8 = 4;

/// Usual scatter of one sensor of a unit, from sample to sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsualScatter<T: Real> {
    /// Usual scatter in motion and at rest, m/s^2 or rad/s, and the windows from which each was learnt.
    usual: [T; 2],
    learnt: [u16; 2],
    noisy: u8,
}

impl<T: Real> UsualScatter<T> {
    /// Creates a scatter without any window.
    pub fn new() -> Self {
        Self {
            usual: [T::zero(); 2],
            learnt: [0; 2],
            noisy: 0,
        }
    }

    /// Learns from a window in health. `window` is its length, s.
    pub fn learn(&mut self, scatter: T, rests: bool, window: T) {
        let [in_motion, at_rest] = &mut self.usual;
        let [windows_in_motion, windows_at_rest] = &mut self.learnt;
        let (usual, learnt) = if rests {
            (at_rest, windows_at_rest)
        } else {
            (in_motion, windows_in_motion)
        };
        *learnt = learnt.saturating_add(1);
        let share = larger(window / real(USUAL_OVER), T::one() / count::<T>((*learnt).into()));
        *usual += (scatter - *usual) * share;
    }

    /// Usual scatter, m/s^2 or rad/s, once it is known: after that time in motion. Scatter at rest does not
    /// show the vibration that a mount passes, and motors may run at rest.
    pub fn usual(&self, rests: bool, window: T) -> Option<T> {
        let ([in_motion, at_rest], [windows, _]) = (self.usual, self.learnt);
        let known = window * count::<T>(windows.into()) >= real(USUAL_OVER);
        let usual = if rests {
            larger(in_motion, at_rest)
        } else {
            in_motion
        };
        known.then_some(usual)
    }

    /// Returns whether the latest window exceeded the limit.
    pub fn was_noisy(&self) -> bool {
        self.noisy > 0
    }

    /// Marks the latest window as within any limit.
    pub fn was_quiet(&mut self) {
        self.noisy = 0;
    }

    /// Returns whether a scatter has exceeded a limit, m/s^2 or rad/s, for long enough.
    pub fn is_noisy(&mut self, scatter: T, limit: T) -> bool {
        self.noisy = if scatter > limit {
            self.noisy.saturating_add(1)
        } else {
            0
        };
        self.noisy >= WINDOWS
    }
}

/// Returns whether a scatter, m/s^2 or rad/s, is too small to matter, whatever the scatter of the others.
pub fn is_quiet<T: Real>(sensor: Sensor, scatter: T) -> bool {
    scatter <= tabulated(*sensor.of(&QUIET))
}

/// Largest scatter that a unit may have: `times` its usual one or the scatter expected from the others, each scaled by its
/// usual ratio to the unit, and at least the scatter that does not matter. Where all units shake, a unit may be as noisy as
/// the others; beside one that scatters less than before, it may be as noisy as before (docs/theory/isolation.md, eq. 11).
pub fn limit<T: Real>(sensor: Sensor, usual: T, others: impl Iterator<Item = (T, T)>, times: T) -> Option<T> {
    let expected = others
        // A unit that repeats its readings gives no standard of noise.
        .filter(|(scatter, usual)| *scatter > T::zero() && *usual > T::zero())
        .map(|(scatter, usual_of_other)| scatter * larger(T::one(), usual / usual_of_other))
        .reduce(larger)?;
    Some(larger(
        tabulated(*sensor.of(&QUIET)),
        larger(usual, expected) * times,
    )) // eq. 11
}
