//! Stored data of one unit: its latest windows, and its means at rest.

use crate::moments::Moments;
use crate::real::Real;
use crate::redundancy::samples::steps::UnitSteps;
use crate::redundancy::samples::window::{KEPT, Means, Windows, low};
use crate::redundancy::sensor::SENSORS;
use crate::redundancy::settings::ForceAndRate;
use crate::sample::CHANNELS;

/// Latest windows of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowHistory<T: Real> {
    windows: Windows<T, CHANNELS>,
    /// In a ring; the newest lies at the place that the count of completed windows gives.
    recent: [Option<Means<T, CHANNELS>>; KEPT as usize],
}

impl<T: Real> Default for WindowHistory<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> WindowHistory<T> {
    /// Creates a history without windows.
    pub fn new() -> Self {
        Self {
            windows: Windows::new(),
            recent: [None; KEPT as usize],
        }
    }

    /// Creates a history of products of rates.
    pub fn of_products() -> Self {
        Self {
            windows: Windows::of_products(),
            recent: [None; KEPT as usize],
        }
    }

    /// Adds a reading; returns whether it completes a window. Changes from sample to sample are added to
    /// `steps`.
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
        if let Some(oldest) = self.recent.get_mut(self.windows.completed()) {
            *oldest = Some(means);
        }
        true
    }

    /// Latest reading.
    #[inline]
    pub fn latest(&self) -> Option<&[T; CHANNELS]> {
        self.windows.latest()
    }

    /// Window of a number, if it is stored.
    pub fn window(&self, index: u64) -> Option<&Means<T, CHANNELS>> {
        let index = low(index);
        self.recent.iter().flatten().find(|means| means.index == index)
    }

    /// Window of a number and the one before.
    pub fn pair(&self, index: u64) -> Option<(&Means<T, CHANNELS>, &Means<T, CHANNELS>)> {
        Some((self.window(index.checked_sub(1)?)?, self.window(index)?))
    }

    /// Number of the newest window.
    #[inline(never)]
    pub fn newest(&self) -> Option<u64> {
        let newest = self.recent.get(self.windows.completed())?.as_ref()?;
        Some(self.windows.number(newest.index))
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
    /// Creates the means of a unit that is not at rest.
    pub fn new() -> Self {
        Self {
            reference: None,
            means: Moments::new(),
        }
    }

    /// Returns whether a window is one at rest: little scatter, and means near the beginning of the rest. The
    /// first window of a rest sets that reference.
    pub fn is_still(&mut self, mean: &[T; CHANNELS], scatter: [T; 2], limits: &ForceAndRate<T>) -> bool {
        let reference = self.reference.get_or_insert(*mean);
        SENSORS.into_iter().zip(scatter).all(|(sensor, scatter)| {
            let limit = limits.of(sensor) * limits.of(sensor);
            scatter <= limit && sensor.squared_distance(mean, reference) <= limit
        })
    }

    /// Adds the means of a window at rest.
    pub fn push(&mut self, mean: &[T; CHANNELS]) {
        self.means.push(mean);
    }

    /// Restarts the means; the reference of the rest stays.
    pub fn restart(&mut self) {
        if self.windows() > 0 {
            self.means = Moments::new();
        }
    }

    /// Ends the rest.
    pub fn end(&mut self) {
        self.reference = None;
        self.restart();
    }

    /// Number of windows.
    pub fn windows(&self) -> u32 {
        self.means.samples()
    }

    /// Mean of each channel.
    pub fn mean(&self) -> &[T; CHANNELS] {
        self.means.mean()
    }

    /// Variance of the windows, per channel.
    pub fn variance(&self) -> [T; CHANNELS] {
        self.means.variance()
    }
}
