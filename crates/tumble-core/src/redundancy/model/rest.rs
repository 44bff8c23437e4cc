//! Rests: physics bounds each unit's own error, |f| = g and w = 0, and shows which of two units changed.

use super::table::{BLOCK, CHANGED, EVIDENCE, HOP_SECONDS, STILL};
use super::test::Exceedance;
use super::window::UnitWindow;
use crate::gravity::STANDARD;
use crate::real::{Real, count, real};
use crate::redundancy::components::smaller;
use crate::redundancy::sensor::SENSORS;
use crate::sample::CHANNELS;

/// One unit at rest: how long it has been still, its mean of the present rest, and the last one that was sound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitRest<T: Real> {
    windows: u32,
    middle: [T; CHANNELS],
    squares: [T; CHANNELS],
    is_still: bool,
    at_rest: u32,
    total: [T; CHANNELS],
    sound: Option<[T; 4]>,
}

impl<T: Real> UnitRest<T> {
    /// No rest yet.
    pub fn new() -> Self {
        Self {
            windows: 0,
            middle: [T::zero(); CHANNELS],
            squares: [T::zero(); CHANNELS],
            is_still: false,
            at_rest: 0,
            total: [T::zero(); CHANNELS],
            sound: None,
        }
    }

    /// Takes a window: whether the unit has scattered no more than at rest (docs/theory/set.md, eq. 22).
    fn take(&mut self, window: &UnitWindow<T>) {
        self.is_still = false;
        if !window.is_whole {
            return;
        }
        self.windows = self.windows.saturating_add(1);
        let (limits, moved, turning) = STILL;
        let windows = count::<T>(self.windows);
        let share = T::one() / windows;
        let mut has_moved = false;
        let means = self.middle.iter_mut().zip(&mut self.squares);
        for (channel, ((middle, square), value)) in means.zip(&window.reading).enumerate() {
            let limit = real::<T>(limits[usize::from(channel > 2)]);
            let away = *value - *middle;
            *middle += away * share;
            *square += away * (*value - *middle);
            has_moved |= away.abs() > limit * real(moved);
            has_moved |= self.windows >= BLOCK.into() && *square > windows * limit * limit;
        }
        if has_moved {
            (self.windows, self.middle, self.squares) = (1, window.reading, [T::zero(); CHANNELS]);
        }
        let [_, _, _, x, y, z] = self.middle;
        let turns = x * x + y * y + z * z > real(turning * turning);
        self.is_still = self.windows >= BLOCK.into() && !turns;
    }

    /// Adds a window to the mean of the rest of the set, or ends it.
    fn add(&mut self, window: &UnitWindow<T>, is_rest: bool) {
        if !is_rest {
            (self.at_rest, self.total) = (0, [T::zero(); CHANNELS]);
        } else if window.is_whole {
            self.at_rest = self.at_rest.saturating_add(1);
            for (total, value) in self.total.iter_mut().zip(&window.reading) {
                *total += *value;
            }
        }
    }

    /// |f| - g, m/s^2, and w, rad/s, after the first second of a rest.
    fn mean(&self) -> Option<[T; 4]> {
        if self.at_rest < BLOCK.into() {
            return None;
        }
        let share = T::one() / count(self.at_rest);
        let [x, y, z, a, b, c] = self.total.map(|total| total * share);
        let norm = (x * x + y * y + z * z).square_root() - real(STANDARD);
        Some([norm, a, b, c])
    }

    /// Half the square of its change in sigmas, by sensor clipped (eq. 23); `None` where there is no rest.
    pub fn evidence(&self) -> Option<T> {
        let (force, rate) = self.by_sensor()?;
        Some(force.1 + rate.1)
    }

    /// The larger change of its sensors, and the one that decides between two units; `None` where there is no rest.
    pub fn shift(&self) -> Option<Exceedance<T>> {
        let [accelerometer, gyroscope] = SENSORS;
        let (force, rate) = self.by_sensor()?;
        let ((apart, evidence), sensor) = if force.1 > rate.1 {
            (force, accelerometer)
        } else {
            (rate, gyroscope)
        };
        let [_, _, decides] = EVIDENCE.map(real::<T>);
        Some(Exceedance {
            ratio: (evidence / decides).square_root(),
            apart,
            sensor,
            seconds: count::<T>(self.at_rest) * real(HOP_SECONDS),
        })
    }

    /// Change of each sensor, m/s^2 and rad/s, with half its square in sigmas.
    fn by_sensor(&self) -> Option<((T, T), (T, T))> {
        let mean = self.mean()?;
        let [changed, unknown] = CHANGED;
        let ([norm, a, b, c], sigmas) = match self.sound {
            Some([n, x, y, z]) => {
                let [norm, a, b, c] = mean;
                ([norm - n, a - x, b - y, c - z], changed)
            }
            None => (mean, unknown),
        };
        let [force, rate] = sigmas.map(|sigma| real::<T>(0.5 / (sigma * sigma)));
        let [most, ..] = EVIDENCE;
        let turned = a * a + b * b + c * c;
        Some((
            (norm.abs(), smaller(norm * norm * force, real(most))),
            (turned.square_root(), smaller(turned * rate, real(most))),
        ))
    }

    /// Takes the mean of a unit that agrees as sound.
    pub fn learn(&mut self) {
        self.sound = self.mean().or(self.sound);
    }
}

impl<T: Real> Default for UnitRest<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Takes a window of all units; returns whether the set is at rest: most units whose readings change are still.
///
/// A unit that moves cannot look still, but a noisy one that is still looks moved.
pub fn take<T: Real, const UNITS: usize>(
    rests: [&mut UnitRest<T>; UNITS],
    windows: &[UnitWindow<T>; UNITS],
) -> bool {
    let mut rests = rests;
    let (mut still, mut usable) = (0_usize, 0_usize);
    for (rest, window) in rests.iter_mut().zip(windows) {
        rest.take(window);
        let changes = window.repeated.iter().any(|repeated| *repeated < BLOCK);
        still += usize::from(rest.is_still && changes);
        usable += usize::from(window.is_whole && changes);
    }
    let is_rest = still > 0 && 2 * still >= usable;
    for (rest, window) in rests.into_iter().zip(windows) {
        rest.add(window, is_rest);
    }
    is_rest
}
