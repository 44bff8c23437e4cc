//! What can be wrong with a recording, on purpose.
//!
//! Times are those of the session, in seconds; each unit meets them on its own clock.

use nalgebra::{Rotation3, Vector3};

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
    /// Readings end at a magnitude below the range.
    Saturated {
        /// Triad it is in.
        channels: Channels,
        /// Unit of the triad.
        limit: f64,
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
    /// The clock jumps backwards.
    TimeBackwards {
        /// s.
        at: f64,
        /// s.
        by: f64,
    },
}

/// Readings of one unit; row `i` of each belongs to `time[i]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// s, the unit's own clock.
    pub time: Vec<f64>,
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

    /// Spoils finished readings; `clock` turns session time into that of the unit.
    pub fn spoil(&self, samples: &mut Samples, clock: impl Fn(f64) -> f64) {
        match *self {
            // These two are in the readings from the start.
            Fault::Scale { .. } | Fault::Moved { .. } => {}
            Fault::Stuck { channels, axis, from } => {
                let start = samples.index(clock(from));
                let rows = samples.channels(channels);
                let held = rows.get(start.saturating_sub(1)).map_or(0.0, |row| row[axis]);
                rows.iter_mut().skip(start).for_each(|row| row[axis] = held);
            }
            Fault::Saturated { channels, limit } => {
                let rows = samples.channels(channels).iter_mut().flatten();
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
            Fault::TimeBackwards { at, by } => {
                let start = samples.index(clock(at));
                samples.time[start..].iter_mut().for_each(|time| *time -= by);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> Samples {
        let row = |i: usize| [i as f64, 10.0 + i as f64, -(i as f64)];
        Samples {
            time: (0..100).map(|i| i as f64 * 0.1).collect(),
            accelerometer: (0..100).map(row).collect(),
            gyroscope: (0..100).map(row).collect(),
            temperature: vec![25.0; 100],
        }
    }

    fn spoiled(fault: Fault) -> Samples {
        let mut samples = samples();
        fault.spoil(&mut samples, |t| t);
        samples
    }

    #[test]
    fn a_stuck_axis_repeats_the_reading_before_the_fault_and_leaves_the_others_alone() {
        let stuck = spoiled(Fault::Stuck {
            channels: Channels::Gyroscope,
            axis: 1,
            from: 4.95,
        });
        assert!(stuck.gyroscope[50..].iter().all(|row| row[1] == 59.0));
        assert_eq!(stuck.gyroscope[80][0], 80.0);
        assert_eq!(stuck.accelerometer, samples().accelerometer);
    }

    #[test]
    fn a_gap_removes_its_samples_from_every_column() {
        let gap = spoiled(Fault::Gap { from: 1.95, to: 2.95 });
        assert_eq!(gap.len(), 90);
        assert_eq!(gap.accelerometer[20], [30.0, 40.0, -30.0]);
        assert_eq!(gap.temperature.len(), 90);
        assert!((gap.time[20] - gap.time[19] - 1.1).abs() < 1e-12);
    }

    #[test]
    fn doubled_samples_have_the_same_time_twice() {
        let doubled = spoiled(Fault::Doubled { from: 0.95, to: 1.95 });
        assert_eq!(doubled.len(), 110);
        assert_eq!(doubled.time[10], doubled.time[11]);
    }

    #[test]
    fn time_goes_backwards_once() {
        let back = spoiled(Fault::TimeBackwards { at: 4.95, by: 1.0 });
        assert_eq!(back.time.windows(2).filter(|pair| pair[1] < pair[0]).count(), 1);
    }

    #[test]
    fn numbers_are_missing_only_in_their_window_and_axis() {
        let fault = Fault::NotANumber {
            channels: Channels::Accelerometer,
            axis: 2,
            from: 0.95,
            to: 1.45,
        };
        let missing = spoiled(fault);
        assert_eq!(
            missing
                .accelerometer
                .iter()
                .flatten()
                .filter(|v| v.is_nan())
                .count(),
            5
        );
        assert!(missing.accelerometer[10][2].is_nan() && missing.accelerometer[14][2].is_nan());
    }

    #[test]
    fn a_window_outside_the_recording_spoils_nothing() {
        assert_eq!(spoiled(Fault::Gap { from: 50.0, to: 60.0 }), samples());
        assert_eq!(spoiled(Fault::Gap { from: 5.0, to: 4.0 }), samples());
        let stuck = Fault::Stuck {
            channels: Channels::Gyroscope,
            axis: 0,
            from: 50.0,
        };
        assert_eq!(spoiled(stuck), samples());
    }

    #[test]
    fn sign_order_unit_and_range_change_as_named() {
        assert_eq!(
            spoiled(Fault::LeftHanded { axis: 1 }).gyroscope[3],
            [3.0, -13.0, -3.0]
        );
        assert_eq!(
            spoiled(Fault::SwappedAxes { first: 0, second: 1 }).accelerometer[3],
            [13.0, 3.0, -3.0]
        );
        let unit = Fault::WrongUnit {
            channels: Channels::Gyroscope,
            factor: 2.0,
        };
        assert_eq!(spoiled(unit).gyroscope[3], [6.0, 26.0, -6.0]);
        let limit = Fault::Saturated {
            channels: Channels::Accelerometer,
            limit: 20.0,
        };
        assert_eq!(spoiled(limit).accelerometer[50], [20.0, 20.0, -20.0]);
    }

    #[test]
    fn a_unit_slips_at_its_time_and_stays_there() {
        let moved = Fault::Moved {
            at: 3.0,
            axis: 2,
            angle: 0.1,
        };
        assert_eq!(moved.slip(2.9), None);
        assert!((moved.slip(3.0).unwrap().angle() - 0.1).abs() < 1e-12);
    }
}
