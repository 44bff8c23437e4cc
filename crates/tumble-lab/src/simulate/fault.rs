//! What can be wrong with a recording, on purpose.
//!
//! Times are those of the session, in seconds; each unit meets them on its own clock.

use nalgebra::{Rotation3, Vector3};
use rand::RngExt;

use crate::simulate::stream::{Stream, normal_vector};

/// Share of the readings that spike.
const SPIKES: f64 = 0.05;

/// Accelerometers or gyroscopes of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Specific force.
    Accelerometer,
    /// Angular rate.
    Gyroscope,
}

/// One thing wrong with one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// One axis has its scale multiplied; its truth says so too.
    Scale {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// Multiplies the row of `M`.
        factor: f64,
    },
    /// One axis repeats its last reading from a time on.
    Stuck {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// s.
        from: f64,
    },
    /// The unit slips in its mounting at a time, about one axis of the case.
    Moved {
        /// s.
        at: f64,
        /// 0, 1 or 2.
        axis: usize,
        /// rad.
        angle: f64,
    },
    /// All axes of both triads repeat their last reading for a while.
    Frozen {
        /// s.
        from: f64,
        /// s.
        to: f64,
    },
    /// Readings end, for a while, at a magnitude below the range.
    Saturated {
        /// Triad it is in.
        channels: Channels,
        /// Unit of the triad.
        limit: f64,
        /// s.
        from: f64,
        /// s.
        to: f64,
    },
    /// Single readings of one axis are far off, either way: the first of a while, and one in twenty after it.
    Spikes {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// s.
        from: f64,
        /// s.
        to: f64,
        /// Unit of the triad.
        size: f64,
    },
    /// The bias of one axis moves evenly to another value, or at once, and stays there.
    BiasMoves {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// s.
        from: f64,
        /// s.
        to: f64,
        /// Unit of the triad.
        by: f64,
    },
    /// White noise comes on top, more and more of it, and stays.
    Noise {
        /// Triad it is in.
        channels: Channels,
        /// s.
        from: f64,
        /// s.
        to: f64,
        /// Scatter of a sample from `to` on, unit of the triad.
        sigma: f64,
    },
    /// One axis says nothing for a while.
    NotANumber {
        /// Triad it is in.
        channels: Channels,
        /// 0, 1 or 2.
        axis: usize,
        /// s.
        from: f64,
        /// s.
        to: f64,
    },
    /// Two axes of both triads are exchanged.
    SwappedAxes {
        /// 0, 1 or 2.
        first: usize,
        /// 0, 1 or 2.
        second: usize,
    },
    /// One axis of both triads has its sign turned.
    LeftHanded {
        /// 0, 1 or 2.
        axis: usize,
    },
    /// Readings are written in another unit than the log says.
    WrongUnit {
        /// Triad it is in.
        channels: Channels,
        /// Written number over the SI value.
        factor: f64,
    },
    /// Samples are missing.
    Gap {
        /// s.
        from: f64,
        /// s.
        to: f64,
    },
    /// Samples are written twice.
    Doubled {
        /// s.
        from: f64,
        /// s.
        to: f64,
    },
    /// Samples arrive late; their time stamps are as before.
    Late {
        /// s.
        from: f64,
        /// s.
        to: f64,
        /// s.
        by: f64,
    },
    /// The clock jumps.
    ClockJump {
        /// s.
        at: f64,
        /// Backwards where negative, s.
        by: f64,
    },
}

/// Readings of one unit; row `i` of each belongs to `time[i]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
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

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are none.
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

    fn window(&self, from: f64, to: f64) -> core::ops::Range<usize> {
        let start = self.index(from);
        start..self.index(to).max(start)
    }
}

impl Fault {
    /// Rotation of the unit in the case frame at session time `t`.
    pub fn slip(&self, t: f64) -> Option<Rotation3<f64>> {
        match *self {
            Fault::Moved { at, axis, angle } if t >= at => {
                let mut vector = Vector3::zeros();
                vector[axis] = angle;
                Some(Rotation3::new(vector))
            }
            _ => None,
        }
    }

    /// Stirs what is added to the readings of a triad before they are rounded and end at the range.
    ///
    /// `rows` are samples at the session times `time`, s.
    pub fn stir(
        &self,
        of: Channels,
        rows: &mut [[f64; 3]],
        time: impl Fn(usize) -> f64,
        random: &mut Stream,
    ) {
        match *self {
            Fault::BiasMoves {
                channels,
                axis,
                from,
                to,
                by,
            } if channels == of => {
                let moved = |index| by * grown(time(index), from, to);
                rows.iter_mut()
                    .enumerate()
                    .for_each(|(index, row)| row[axis] += moved(index));
            }
            Fault::Noise {
                channels,
                from,
                to,
                sigma,
            } if channels == of => {
                for (index, row) in rows.iter_mut().enumerate() {
                    let noise = normal_vector(random) * (sigma * grown(time(index), from, to));
                    *row = (Vector3::from(*row) + noise).into();
                }
            }
            _ => {}
        }
    }

    /// Spoils finished readings; `clock` turns session time into that of the unit.
    pub fn spoil(&self, samples: &mut Samples, clock: impl Fn(f64) -> f64, random: &mut Stream) {
        match *self {
            // These are in the readings from the start.
            Fault::Scale { .. } | Fault::Moved { .. } | Fault::BiasMoves { .. } | Fault::Noise { .. } => {}
            Fault::Stuck { channels, axis, from } => {
                let start = samples.index(clock(from));
                let rows = samples.channels(channels);
                let held = rows.get(start.saturating_sub(1)).map_or(0.0, |row| row[axis]);
                rows.iter_mut().skip(start).for_each(|row| row[axis] = held);
            }
            Fault::Frozen { from, to } => {
                let window = samples.window(clock(from), clock(to));
                for rows in [&mut samples.accelerometer, &mut samples.gyroscope] {
                    let held = rows
                        .get(window.start.saturating_sub(1))
                        .copied()
                        .unwrap_or_default();
                    rows[window.clone()].fill(held);
                }
            }
            Fault::Saturated {
                channels,
                limit,
                from,
                to,
            } => {
                let window = samples.window(clock(from), clock(to));
                let rows = samples.channels(channels)[window].iter_mut().flatten();
                rows.for_each(|value| *value = value.clamp(-limit, limit));
            }
            Fault::NotANumber {
                channels,
                axis,
                from,
                to,
            } => {
                let window = samples.window(clock(from), clock(to));
                samples.channels(channels)[window]
                    .iter_mut()
                    .for_each(|row| row[axis] = f64::NAN);
            }
            Fault::Spikes {
                channels,
                axis,
                from,
                to,
                size,
            } => {
                let window = samples.window(clock(from), clock(to));
                for (index, row) in samples.channels(channels)[window].iter_mut().enumerate() {
                    let (strikes, up) = (random.random_bool(SPIKES), random.random_bool(0.5));
                    if strikes || index == 0 {
                        row[axis] += if up { size } else { -size };
                    }
                }
            }
            Fault::SwappedAxes { first, second } => samples.both().for_each(|row| row.swap(first, second)),
            Fault::LeftHanded { axis } => samples.both().for_each(|row| row[axis] = -row[axis]),
            Fault::WrongUnit { channels, factor } => {
                samples
                    .channels(channels)
                    .iter_mut()
                    .flatten()
                    .for_each(|value| *value *= factor);
            }
            Fault::Gap { from, to } => {
                let window = samples.window(clock(from), clock(to));
                let rows: Vec<usize> = (0..samples.len()).filter(|row| !window.contains(row)).collect();
                samples.select(&rows);
            }
            Fault::Doubled { from, to } => {
                let window = samples.window(clock(from), clock(to));
                let times = |row: usize| if window.contains(&row) { 2 } else { 1 };
                let rows: Vec<usize> = (0..samples.len())
                    .flat_map(|row| core::iter::repeat_n(row, times(row)))
                    .collect();
                samples.select(&rows);
            }
            Fault::Late { from, to, by } => {
                let window = samples.window(clock(from), clock(to));
                samples.arrival[window]
                    .iter_mut()
                    .for_each(|arrival| *arrival += by);
                // What comes after waits for what is late.
                let mut latest = f64::NEG_INFINITY;
                for arrival in &mut samples.arrival {
                    latest = arrival.max(latest);
                    *arrival = latest;
                }
            }
            Fault::ClockJump { at, by } => {
                let start = samples.index(clock(at));
                samples.time[start..].iter_mut().for_each(|time| *time += by);
            }
        }
    }
}

/// How far something has grown that begins at `from` and is whole at `to`.
fn grown(t: f64, from: f64, to: f64) -> f64 {
    if t >= to {
        1.0
    } else {
        ((t - from) / (to - from)).max(0.0)
    }
}

#[cfg(test)]
#[path = "fault_tests.rs"]
mod tests;
