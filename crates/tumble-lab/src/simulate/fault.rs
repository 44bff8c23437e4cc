//! Faults that are injected into a recording.
//!
//! Times are those of the session, in seconds; each unit meets them on its own clock.

use core::ops::Range;

use nalgebra::{Rotation3, Vector3};
use rand::RngExt;
use serde::Deserialize;

use crate::simulate::stream::{RandomStream, normal_vector};

/// Share of the readings that spike.
const SPIKES: f64 = 0.05;

/// Accelerometers or gyroscopes of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channels {
    /// Specific force.
    Accelerometer,
    /// Angular rate.
    Gyroscope,
}

/// One thing wrong with one unit.
///
/// Parameters that a kind does not need are ignored, so that a description of faults need not know those of each.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum InjectedFault {
    /// One axis has its scale multiplied; so has its truth.
    Scale {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// Multiplies the row of `M`.
        size: f64,
    },
    /// One axis repeats its last reading from a time on.
    Stuck {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// s.
        start: f64,
    },
    /// The unit slips in its mounting at a time, about one axis of the case.
    Moved {
        /// s.
        start: f64,
        /// 0, 1 or 2.
        axis: usize,
        /// rad.
        size: f64,
    },
    /// All axes of both triads repeat their last reading for a while.
    Frozen {
        /// s.
        start: f64,
        /// s.
        end: f64,
    },
    /// Readings end, for a while, at a magnitude below the range.
    Saturated {
        /// Triad it is in.
        channels: Channels,
        /// That magnitude, unit of the triad.
        size: f64,
        /// s.
        start: f64,
        /// s.
        end: f64,
    },
    /// Single readings of one axis are far off, either way: the first of a while, and one in twenty after it.
    Spikes {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// s.
        start: f64,
        /// s.
        end: f64,
        /// Unit of the triad.
        size: f64,
    },
    /// The bias of one axis moves evenly to another value, or at once, and stays there.
    Bias {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// s.
        start: f64,
        /// s.
        end: f64,
        /// Unit of the triad.
        size: f64,
    },
    /// White noise comes on top, more and more of it, and stays.
    Noise {
        /// Triad it is in.
        channels: Channels,
        /// s.
        start: f64,
        /// s.
        end: f64,
        /// Scatter of a sample from `end` on, unit of the triad, 1 sigma.
        size: f64,
    },
    /// One axis has no readings for a while.
    Nan {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// s.
        start: f64,
        /// s.
        end: f64,
    },
    /// Two axes of both triads are exchanged.
    SwappedAxes {
        /// 0, 1 or 2.
        axis: usize,
        /// 0, 1 or 2.
        other_axis: usize,
    },
    /// One axis of both triads has its sign turned.
    LeftHanded {
        /// 0, 1 or 2.
        axis: usize,
    },
    /// Readings are written in another unit than the log states.
    WrongUnit {
        /// Triad it is in.
        channels: Channels,
        /// Written number over the SI value.
        size: f64,
    },
    /// Samples are missing.
    Gap {
        /// s.
        start: f64,
        /// s.
        end: f64,
    },
    /// Samples are written twice.
    Doubled {
        /// s.
        start: f64,
        /// s.
        end: f64,
    },
    /// Samples arrive late; their time stamps are as before.
    Late {
        /// s.
        start: f64,
        /// s.
        end: f64,
        /// By this much, s.
        size: f64,
    },
    /// The clock jumps.
    ClockJump {
        /// s.
        start: f64,
        /// By this much, backwards where negative, s.
        size: f64,
    },
}

/// Readings of one unit; row `i` of each belongs to `time[i]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedSamples {
    /// s, the unit's own clock.
    pub time: Vec<f64>,
    /// When each was at hand, s, the clock of the session; never descends.
    pub arrival: Vec<f64>,
    /// m/s^2.
    pub accelerometer: Vec<[f64; 3]>,
    /// rad/s.
    pub gyroscope: Vec<[f64; 3]>,
    /// degC.
    pub temperature: Vec<f64>,
}

impl RecordedSamples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Checks that there are none.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    fn channels(&mut self, channels: Channels) -> &mut Vec<[f64; 3]> {
        match channels {
            Channels::Accelerometer => &mut self.accelerometer,
            Channels::Gyroscope => &mut self.gyroscope,
        }
    }

    fn both(&mut self) -> impl Iterator<Item = &mut [f64; 3]> {
        self.accelerometer.iter_mut().chain(&mut self.gyroscope)
    }

    /// The samples of these indices, in this order.
    fn select(&mut self, rows: &[usize]) {
        self.time = rows.iter().map(|&row| self.time[row]).collect();
        self.arrival = rows.iter().map(|&row| self.arrival[row]).collect();
        self.accelerometer = rows.iter().map(|&row| self.accelerometer[row]).collect();
        self.gyroscope = rows.iter().map(|&row| self.gyroscope[row]).collect();
        self.temperature = rows.iter().map(|&row| self.temperature[row]).collect();
    }

    /// First index at or after a time of the unit's clock; times ascend until a clock fault is applied.
    fn index(&self, time: f64) -> usize {
        self.time.partition_point(|&t| t < time)
    }

    fn window(&self, start: f64, end: f64) -> Range<usize> {
        let first = self.index(start);
        first..self.index(end).max(first)
    }

    fn stick(&mut self, channels: Channels, axis: usize, start: f64) {
        let start = self.index(start);
        let rows = self.channels(channels);
        let held = rows.get(start.saturating_sub(1)).map_or(0.0, |row| row[axis]);
        rows.iter_mut().skip(start).for_each(|row| row[axis] = held);
    }

    fn freeze(&mut self, window: &Range<usize>) {
        for rows in [&mut self.accelerometer, &mut self.gyroscope] {
            let held = rows
                .get(window.start.saturating_sub(1))
                .copied()
                .unwrap_or_default();
            rows[window.clone()].fill(held);
        }
    }

    fn delay(&mut self, window: Range<usize>, by: f64) {
        self.arrival[window].iter_mut().for_each(|arrival| *arrival += by);
        // Later samples wait for those that are late.
        let mut latest = f64::NEG_INFINITY;
        for arrival in &mut self.arrival {
            latest = arrival.max(latest);
            *arrival = latest;
        }
    }

    /// Writes as many copies of each sample as `copies` returns.
    fn repeat(&mut self, copies: impl Fn(usize) -> usize) {
        let rows: Vec<usize> = (0..self.len())
            .flat_map(|row| core::iter::repeat_n(row, copies(row)))
            .collect();
        self.select(&rows);
    }
}

impl InjectedFault {
    /// Rotation of the unit in the case frame at session time `t`.
    pub fn slip(&self, t: f64) -> Option<Rotation3<f64>> {
        match *self {
            InjectedFault::Moved { start, axis, size } if t >= start => {
                let mut vector = Vector3::zeros();
                vector[axis] = size;
                Some(Rotation3::new(vector))
            }
            _ => None,
        }
    }

    /// Adds to the readings of a triad what comes before they are rounded and end at the range.
    ///
    /// `rows` are samples at the session times `time`, s.
    pub fn disturb(
        &self,
        of: Channels,
        rows: &mut [[f64; 3]],
        time: impl Fn(usize) -> f64,
        random: &mut RandomStream,
    ) {
        let rows = rows.iter_mut().enumerate();
        match *self {
            InjectedFault::Bias {
                channels,
                axis,
                start,
                end,
                size,
            } if channels == of => {
                rows.for_each(|(index, row)| row[axis] += size * grown(time(index), start, end));
            }
            InjectedFault::Noise {
                channels,
                start,
                end,
                size,
            } if channels == of => {
                for (index, row) in rows {
                    let noise = normal_vector(random) * (size * grown(time(index), start, end));
                    *row = (Vector3::from(*row) + noise).into();
                }
            }
            _ => {}
        }
    }

    /// Injects the faults into finished readings; `clock` turns session time into that of the unit.
    pub fn spoil(
        &self,
        samples: &mut RecordedSamples,
        clock: impl Fn(f64) -> f64,
        random: &mut RandomStream,
    ) {
        match self {
            // These are in the readings from the start.
            InjectedFault::Scale { .. }
            | InjectedFault::Moved { .. }
            | InjectedFault::Bias { .. }
            | InjectedFault::Noise { .. } => {}
            InjectedFault::Stuck { .. }
            | InjectedFault::Frozen { .. }
            | InjectedFault::Saturated { .. }
            | InjectedFault::Nan { .. }
            | InjectedFault::Spikes { .. } => self.spoil_readings(samples, clock, random),
            InjectedFault::SwappedAxes { .. }
            | InjectedFault::LeftHanded { .. }
            | InjectedFault::WrongUnit { .. } => {
                self.spoil_axes(samples);
            }
            InjectedFault::Gap { .. }
            | InjectedFault::Doubled { .. }
            | InjectedFault::Late { .. }
            | InjectedFault::ClockJump { .. } => {
                self.spoil_time(samples, clock);
            }
        }
    }

    /// Readings of a while.
    fn spoil_readings(
        &self,
        samples: &mut RecordedSamples,
        clock: impl Fn(f64) -> f64,
        random: &mut RandomStream,
    ) {
        match *self {
            InjectedFault::Stuck {
                channels,
                axis,
                start,
            } => samples.stick(channels, axis, clock(start)),
            InjectedFault::Frozen { start, end } => samples.freeze(&samples.window(clock(start), clock(end))),
            InjectedFault::Saturated {
                channels,
                size,
                start,
                end,
            } => {
                let window = samples.window(clock(start), clock(end));
                let values = samples.channels(channels)[window].iter_mut().flatten();
                values.for_each(|value| *value = value.clamp(-size, size));
            }
            InjectedFault::Nan {
                channels,
                axis,
                start,
                end,
            } => {
                let window = samples.window(clock(start), clock(end));
                let rows = samples.channels(channels)[window].iter_mut();
                rows.for_each(|row| row[axis] = f64::NAN);
            }
            InjectedFault::Spikes {
                channels,
                axis,
                start,
                end,
                size,
            } => {
                let window = samples.window(clock(start), clock(end));
                strike(&mut samples.channels(channels)[window], axis, size, random);
            }
            _ => {}
        }
    }

    /// Axes and units of the whole recording.
    fn spoil_axes(&self, samples: &mut RecordedSamples) {
        match *self {
            InjectedFault::SwappedAxes { axis, other_axis } => {
                samples.both().for_each(|row| row.swap(axis, other_axis));
            }
            InjectedFault::LeftHanded { axis } => samples.both().for_each(|row| row[axis] = -row[axis]),
            InjectedFault::WrongUnit { channels, size } => {
                let values = samples.channels(channels).iter_mut().flatten();
                values.for_each(|value| *value *= size);
            }
            _ => {}
        }
    }

    /// Injects faults of time: which samples there are, when they are at hand, and their stamps.
    fn spoil_time(&self, samples: &mut RecordedSamples, clock: impl Fn(f64) -> f64) {
        match *self {
            InjectedFault::Gap { start, end } => {
                let window = samples.window(clock(start), clock(end));
                samples.repeat(|row| if window.contains(&row) { 0 } else { 1 });
            }
            InjectedFault::Doubled { start, end } => {
                let window = samples.window(clock(start), clock(end));
                samples.repeat(|row| if window.contains(&row) { 2 } else { 1 });
            }
            InjectedFault::Late { start, end, size } => {
                samples.delay(samples.window(clock(start), clock(end)), size);
            }
            InjectedFault::ClockJump { start, size } => {
                let start = samples.index(clock(start));
                samples.time[start..].iter_mut().for_each(|time| *time += size);
            }
            _ => {}
        }
    }
}

/// Moves one reading in twenty of an axis by `size`, either way, and the first for certain.
fn strike(rows: &mut [[f64; 3]], axis: usize, size: f64, random: &mut RandomStream) {
    for (index, row) in rows.iter_mut().enumerate() {
        let (strikes, up) = (random.random_bool(SPIKES), random.random_bool(0.5));
        if strikes || index == 0 {
            row[axis] += if up { size } else { -size };
        }
    }
}

/// Share, 0 to 1, by which an error has grown that begins at `start` and is whole at `end`.
fn grown(t: f64, start: f64, end: f64) -> f64 {
    if t >= end {
        1.0
    } else {
        ((t - start) / (end - start)).max(0.0)
    }
}

#[cfg(test)]
#[path = "fault_tests.rs"]
mod tests;
