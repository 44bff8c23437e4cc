//! What the monitor keeps of one unit: its latest windows, and its means at rest.

use crate::moments::Moments;
use crate::real::Real;
use crate::redundancy::samples::steps::UnitSteps;
use crate::redundancy::samples::window::{Means, Windows};
use crate::redundancy::sensor::SENSORS;
use crate::redundancy::settings::ForceAndRate;
use crate::sample::CHANNELS;

/// Windows that are kept of a unit, so that others may be one and a half windows behind.
const KEPT: usize = 3;

/// Windows of one unit, as they come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowHistory<T: Real> {
    windows: Windows<T, CHANNELS>,
    recent: [Option<Means<T, CHANNELS>>; KEPT],
    /// Place of the newest of them.
    newest: usize,
}

impl<T: Real> Default for WindowHistory<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> WindowHistory<T> {
    /// Nothing seen.
    pub fn new() -> Self {
        Self {
            windows: Windows::new(),
            recent: [None; KEPT],
            newest: 0,
        }
    }

    /// Takes in a reading; gives whether it completes a window. Changes from sample to sample are told to `steps`.
    pub fn push(
        &mut self,
        time: u64,
        channels: &[T; CHANNELS],
        usable: [bool; 2],
        length: u64,
        steps: Option<&mut UnitSteps<T>>,
    ) -> bool {
        let Some(means) = self.windows.push(time, channels, usable, length, steps) else {
            return false;
        };
        self.newest = (self.newest + 1) % KEPT;
        if let Some(oldest) = self.recent.get_mut(self.newest) {
            *oldest = Some(means);
        }
        true
    }

    /// The latest reading.
    #[inline]
    pub fn latest(&self) -> Option<&[T; CHANNELS]> {
        self.windows.latest()
    }

    /// The window of this number, if it is kept.
    pub fn window(&self, index: u64) -> Option<&Means<T, CHANNELS>> {
        self.recent.iter().flatten().find(|means| means.index == index)
    }

    /// This window and the one before.
    pub fn pair(&self, index: u64) -> Option<(&Means<T, CHANNELS>, &Means<T, CHANNELS>)> {
        Some((self.window(index.checked_sub(1)?)?, self.window(index)?))
    }

    /// Number of the newest window.
    pub fn newest(&self) -> Option<u64> {
        let newest = self.recent.get(self.newest)?.as_ref()?;
        Some(newest.index)
    }
}

/// Means of the windows of one unit at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestMean<T: Real> {
    reference: Option<[T; CHANNELS]>,
    means: Moments<T, CHANNELS>,
}

impl<T: Real> Default for RestMean<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> RestMean<T> {
    /// Not at rest.
    pub fn new() -> Self {
        Self {
            reference: None,
            means: Moments::new(),
        }
    }

    /// Whether a window is one at rest: little scatter, and means where the rest began. The first window of a rest says
    /// where that is.
    pub fn is_still(&mut self, mean: &[T; CHANNELS], scatter: [T; 2], limits: &ForceAndRate<T>) -> bool {
        let reference = self.reference.get_or_insert(*mean);
        SENSORS.into_iter().zip(scatter).all(|(sensor, scatter)| {
            let limit = limits.of(sensor) * limits.of(sensor);
            scatter <= limit && sensor.squared_distance(mean, reference) <= limit
        })
    }

    /// Takes in the means of a window at rest.
    pub fn push(&mut self, mean: &[T; CHANNELS]) {
        self.means.push(mean);
    }

    /// Means from here on; where the rest began stays known.
    pub fn restart(&mut self) {
        if self.windows() > 0 {
            self.means = Moments::new();
        }
    }

    /// It moves again.
    pub fn end(&mut self) {
        self.reference = None;
        self.restart();
    }

    /// Windows taken in.
    pub fn windows(&self) -> u32 {
        self.means.samples()
    }

    /// Mean of each channel.
    pub fn mean(&self) -> &[T; CHANNELS] {
        self.means.mean()
    }

    /// Variance of the windows, each channel.
    pub fn variance(&self) -> [T; CHANNELS] {
        self.means.variance()
    }
}
