//! Readings of one unit under triangles of 0.1 s at 20 Hz, and what its samples show by themselves.
//!
//! Triangles are exact for straight lines between samples, and close for curves (docs/theory/set.md, eq. 1 to 3).

use super::table::{COUNTED, HOP, HOP_SECONDS, LATE, LONGEST};
use crate::real::{Real, count, real, seconds, whole_spans};
use crate::redundancy::components::larger;
use crate::redundancy::samples::window::{Means, Windows};
use crate::sample::CHANNELS;

/// Windows that are kept of a unit: those for which a window waits, and itself.
const KEPT: usize = 4;
/// Channels that are averaged: readings, then products xx, yy, zz, xy, xz, yz of angular rates.
const AVERAGED: usize = 12;

/// One window of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitWindow<T: Real> {
    /// Number of the window: that of its middle in the grid of hops, the lower half of it.
    index: u32,
    /// m/s^2 and rad/s.
    pub reading: [T; CHANNELS],
    /// Derivative of the same, under the same triangle.
    pub change: [T; CHANNELS],
    /// rad^2/s^2: products xx, yy, zz, xy, xz, yz of angular rates.
    pub product: [T; CHANNELS],
    /// Variance of a sample, accelerometer and gyroscope, from steps between samples.
    pub scatter: [T; 2],
    /// s since the last sample, at the end of the window; negative before the first.
    pub silence: T,
    /// Equal readings of a channel in succession, at the end of the window.
    pub repeated: [u8; CHANNELS],
    /// True if no sample is missing.
    pub is_whole: bool,
}

impl<T: Real> UnitWindow<T> {
    /// A window of a unit that has not sent.
    fn absent(silence: T, repeated: [u8; CHANNELS]) -> Self {
        Self {
            index: 0,
            reading: [T::zero(); CHANNELS],
            change: [T::zero(); CHANNELS],
            product: [T::zero(); CHANNELS],
            scatter: [T::zero(); 2],
            silence,
            repeated,
            is_whole: false,
        }
    }
}

/// Count of samples until their interval is known.
#[derive(Clone, Copy, Debug, PartialEq)]
struct UsualInterval<T: Real> {
    since: u64,
    samples: u32,
    counts: u8,
    shortest: T,
}

impl<T: Real> UsualInterval<T> {
    /// Counts a sample after the first.
    fn count(&mut self, time: u64) {
        let (span, counts) = COUNTED;
        if self.counts >= counts {
            return;
        }
        self.samples += 1;
        let passed = time - self.since;
        if passed >= span {
            let mean = seconds::<T>(passed) / count(self.samples);
            if self.counts == 0 || mean < self.shortest {
                self.shortest = mean;
            }
            (self.since, self.samples) = (time, 0);
            self.counts += 1;
        }
    }

    /// s from sample to sample, once it is known.
    fn known(&self) -> Option<T> {
        (self.counts >= COUNTED.1).then_some(self.shortest)
    }
}

/// Windows of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitWindows<T: Real> {
    averaging: Windows<T, AVERAGED>,
    before: Option<Means<T, AVERAGED>>,
    interval: UsualInterval<T>,
    /// Microseconds of the latest sample; `None` before the first.
    last: Option<u64>,
    /// Microseconds of the end of the latest pause of all units: none was silent before.
    resumed: u64,
    repeated: [u8; CHANNELS],
    resolution: [T; 2],
    /// Number of the window that ends next.
    open: u64,
    ended: [UnitWindow<T>; KEPT],
}

impl<T: Real> UnitWindows<T> {
    /// Creates the windows of a unit that has not sent.
    pub fn new() -> Self {
        Self {
            averaging: Windows::new(),
            before: None,
            interval: UsualInterval {
                since: 0,
                samples: 0,
                counts: 0,
                shortest: T::zero(),
            },
            last: None,
            resumed: 0,
            repeated: [0; CHANNELS],
            resolution: [T::zero(); 2],
            open: 0,
            ended: [UnitWindow::absent(-T::one(), [0; CHANNELS]); KEPT],
        }
    }

    /// Microseconds of the latest sample.
    pub fn last(&self) -> Option<u64> {
        self.last
    }

    /// s from sample to sample, usually; zero while it is not known.
    pub fn interval(&self) -> T {
        self.interval.known().unwrap_or(T::zero())
    }

    /// Smallest change of a reading so far that is none of zero, m/s^2 and rad/s; zero before the first.
    pub fn resolution(&self) -> [T; 2] {
        self.resolution
    }

    /// s of silence after which a unit is late.
    pub fn late_after(&self) -> T {
        larger(real(LATE.0), self.interval() * real(LATE.1))
    }

    /// Takes note that all units paused until a time, microseconds: the pause is the platform's.
    pub fn resume(&mut self, time: u64) {
        self.resumed = time;
    }

    /// s of silence until a time, microseconds; negative before the first sample, and in a pause of all units.
    fn silence(&self, end: u64) -> T {
        let since = self.last.map(|last| last.max(self.resumed));
        since
            .filter(|since| *since < end)
            .map_or(-T::one(), |since| seconds(end - since))
    }

    /// Tests whether a window has ended.
    pub fn has_ended(&self, index: u64) -> bool {
        self.last.is_some() && self.open > index
    }

    /// The window of a number.
    #[allow(clippy::cast_possible_truncation)]
    pub fn of(&self, index: u64) -> UnitWindow<T> {
        let wanted = index as u32;
        if self.has_ended(index)
            && let Some(window) = self.ended.iter().find(|window| window.index == wanted)
        {
            return *window;
        }
        let end = (index + 1).saturating_mul(HOP);
        UnitWindow::absent(self.silence(end), self.repeated)
    }

    /// Takes the next sample; one that is no later than the last, or not a number, is dropped.
    pub fn push(&mut self, time: u64, reading: &[T; CHANNELS]) {
        if !reading.iter().all(|value| value.is_finite()) {
            return;
        }
        let [_, _, _, x, y, z] = *reading;
        let mut channels = [T::zero(); AVERAGED];
        let products = [x * x, y * y, z * z, x * y, x * z, y * z];
        for (to, from) in channels.iter_mut().zip(reading.iter().chain(&products)) {
            *to = *from;
        }
        let Some(last) = self.last else {
            self.interval.since = time;
            self.open = whole_spans(time, HOP).0;
            self.averaging.push(time, &channels, [false; 2], HOP, None);
            self.last = Some(time);
            return;
        };
        if time <= last {
            return;
        }
        self.interval.count(time);
        let gap = real::<T>(LONGEST) * self.interval();
        let usable = seconds::<T>(time - last) <= gap.min(real(HOP_SECONDS));
        let before = self.averaging.latest().copied();
        let half = self.averaging.push(time, &channels, [usable; 2], HOP, None);
        self.end_windows(time, half);
        let same = before.unwrap_or(channels);
        let channels = self.repeated.iter_mut().zip(same).zip(reading);
        for (channel, ((repeated, was), is)) in channels.enumerate() {
            *repeated = if was == *is { repeated.saturating_add(1) } else { 0 };
            let step = (was - *is).abs();
            if let Some(least) = self.resolution.get_mut(channel / 3)
                && step > T::zero()
                && (*least == T::zero() || step < *least)
            {
                *least = step;
            }
        }
        self.last = Some(time);
    }

    /// Ends the windows that a sample leaves behind.
    #[allow(clippy::cast_possible_truncation)]
    fn end_windows(&mut self, time: u64, half: Option<Means<T, AVERAGED>>) {
        let now = whole_spans(time, HOP).0;
        let first = self.open.max(now.saturating_sub(KEPT as u64));
        for index in first..now {
            let end = (index + 1).saturating_mul(HOP);
            let mut window = UnitWindow {
                index: index as u32,
                ..UnitWindow::absent(self.silence(end), self.repeated)
            };
            let falling = half.filter(|half| half.index == index as u32);
            if let (Some(rising), Some(falling)) = (self.before, falling)
                && rising.index == (index as u32).wrapping_sub(1)
            {
                fill(&mut window, &rising, &falling);
            }
            self.before = falling;
            if let Some(place) = self.ended.get_mut(index as usize % KEPT) {
                *place = window;
            }
        }
        self.open = self.open.max(now);
    }
}

impl<T: Real> Default for UnitWindows<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Puts two halves of a triangle together.
fn fill<T: Real>(window: &mut UnitWindow<T>, rising: &Means<T, AVERAGED>, falling: &Means<T, AVERAGED>) {
    let joined = rising.triangle(falling); // eq. 1
    let places = window.reading.iter_mut().chain(&mut window.product);
    for (place, value) in places.zip(joined) {
        *place = value;
    }
    let means = rising.mean.iter().zip(&falling.mean);
    for (change, (before, after)) in window.change.iter_mut().zip(means) {
        *change = (*after - *before) / real(HOP_SECONDS); // eq. 2
    }
    let scatters = rising.scatter.iter().zip(&falling.scatter);
    for (scatter, (before, after)) in window.scatter.iter_mut().zip(scatters) {
        *scatter = (*before + *after) * real(0.5); // eq. 3
    }
    let [rose, _] = rising.usable;
    let [fell, _] = falling.usable;
    window.is_whole = rose && fell;
}
