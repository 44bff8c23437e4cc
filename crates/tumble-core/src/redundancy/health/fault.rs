//! Faults of a unit, with their figures.

use crate::real::Real;
use crate::redundancy::isolation::attribution::{Ground, Precedence};
use crate::redundancy::selection::Condition;
use crate::redundancy::sensor::Sensor;

crate::vocabulary! {
    /// Reason for which a unit is not healthy.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum HealthFault<T: Real> {
        /// No sample arrived.
        Late {
            /// Time without a sample, s.
            pause: T,
        } = "late",
        /// All axes of a sensor repeat their readings.
        Frozen {
            /// Sensor that repeats.
            sensor: Sensor,
            /// Least time of repetition, s.
            duration: T,
        } = "frozen",
        /// One axis repeats its reading while the others of its sensor move.
        Stuck {
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: u8,
            /// Repeated reading, m/s^2 or rad/s.
            value: T,
        } = "stuck",
        /// A sensor is at the end of its range too often.
        Saturated {
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: u8,
            /// Latest reading, m/s^2 or rad/s.
            value: T,
        } = "saturated",
        /// Too many readings are not finite numbers.
        NotFinite {
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: u8,
        } = "not finite",
        /// Readings depart and return too often.
        Spikes {
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: u8,
            /// Magnitude of the latest departure, m/s^2 or rad/s.
            value: T,
        } = "spikes",
        /// The other units agree without this one.
        OutOfFamily {
            /// Sensor concerned.
            sensor: Sensor,
            /// Difference from the unit that it contradicts most, m/s^2 or rad/s.
            apart: T,
            /// Largest difference that is accepted.
            limit: T,
            /// Time over which it shows, s.
            scale: T,
            /// Units that agree, one bit each, the primary's the lowest.
            agreeing: u8,
        } = "out of family",
        /// The readings of a sensor scatter much more than those of the other units predict.
        Noisy {
            /// Sensor concerned.
            sensor: Sensor,
            /// Scatter from sample to sample, m/s^2 or rad/s.
            scatter: T,
            /// Largest scatter that is accepted.
            limit: T,
        } = "noisy",
        /// The unit is the faulty one of two that disagree.
        Isolated {
            /// Sensor concerned.
            sensor: Sensor,
            /// Kind of evidence.
            ground: Ground,
            /// Figure of the evidence.
            value: T,
            /// Threshold that the figure exceeded.
            limit: T,
        } = "isolated",
        /// The deviation from a valid primary at rest is larger than any error that a calibration can find.
        Refuted {
            /// Sensor concerned.
            sensor: Sensor,
            /// Deviation, m/s^2 or rad/s.
            deviation: T,
            /// Largest deviation that is accepted.
            limit: T,
        } = "refuted",
        /// A reading at rest contradicts physics.
        ImplausibleAtRest {
            /// Sensor concerned.
            sensor: Sensor,
            /// Deviation from gravity, m/s^2, or from zero, rad/s.
            deviation: T,
            /// Largest deviation that is accepted.
            limit: T,
        } = "implausible at rest",
        /// The clock of the unit left that of the other units.
        ClockJumped = "clock jumped",
        /// The unit sends each reading twice or more often, and did not do so before.
        Duplicated = "duplicated",
        /// The readings are those of another unit.
        Copy {
            /// Other unit, one bit, the primary's the lowest.
            of: u8,
        } = "copy",
        /// Its samples come ever later than those of the others, or ever earlier.
        Clock {
            /// Growth of the delay since it was first measured, s, without its sign.
            by: T,
            /// Largest growth that is accepted, s.
            limit: T,
        } = "clock",
        /// The unit loses too many samples.
        Lossy {
            /// Share of time in which samples are missing, 1.
            share: T,
            /// Largest share that is accepted, 1.
            limit: T,
        } = "lossy",
    }
}

/// Figures of a fault. Each kind has some of them; their meanings and units are given at the fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultFigures<T: Real> {
    /// Sensor concerned, if the fault is not of a single channel.
    pub sensor: Option<Sensor>,
    /// 0 to 2 accelerometer, 3 to 5 gyroscope.
    pub channel: Option<u8>,
    /// Kind of evidence.
    pub ground: Option<Ground>,
    /// Measured value.
    pub value: Option<T>,
    /// Limit of the value.
    pub limit: Option<T>,
    /// Time scale on which the fault shows, s.
    pub scale: Option<T>,
    /// Units that agree, one bit each, the primary's the lowest.
    pub agreeing: Option<u8>,
}

impl<T: Real> FaultFigures<T> {
    const NONE: Self = Self {
        sensor: None,
        channel: None,
        ground: None,
        value: None,
        limit: None,
        scale: None,
        agreeing: None,
    };
}

impl<T: Real> HealthFault<T> {
    /// Figures of the fault.
    pub fn figures(&self) -> FaultFigures<T> {
        let of_channel = |channel: u8, value: Option<T>| FaultFigures {
            channel: Some(channel),
            value,
            ..FaultFigures::NONE
        };
        let of_sensor = |sensor: Sensor, value: T, limit: Option<T>| FaultFigures {
            sensor: Some(sensor),
            value: Some(value),
            limit,
            ..FaultFigures::NONE
        };
        match *self {
            Self::Late { pause } => FaultFigures {
                value: Some(pause),
                ..FaultFigures::NONE
            },
            Self::Frozen { sensor, duration } => of_sensor(sensor, duration, None),
            Self::Stuck { channel, value }
            | Self::Saturated { channel, value }
            | Self::Spikes { channel, value } => of_channel(channel, Some(value)),
            Self::NotFinite { channel } => of_channel(channel, None),
            Self::OutOfFamily {
                sensor,
                apart,
                limit,
                scale,
                agreeing,
            } => FaultFigures {
                scale: Some(scale),
                agreeing: Some(agreeing),
                ..of_sensor(sensor, apart, Some(limit))
            },
            Self::Isolated {
                sensor,
                ground,
                value,
                limit,
            } => FaultFigures {
                ground: Some(ground),
                ..of_sensor(sensor, value, Some(limit))
            },
            Self::Noisy {
                sensor,
                scatter: value,
                limit,
            }
            | Self::Refuted {
                sensor,
                deviation: value,
                limit,
            }
            | Self::ImplausibleAtRest {
                sensor,
                deviation: value,
                limit,
            } => of_sensor(sensor, value, Some(limit)),
            Self::Clock { by: value, limit } | Self::Lossy { share: value, limit } => FaultFigures {
                value: Some(value),
                limit: Some(limit),
                ..FaultFigures::NONE
            },
            Self::Copy { of } => FaultFigures {
                agreeing: Some(of),
                ..FaultFigures::NONE
            },
            Self::ClockJumped | Self::Duplicated => FaultFigures::NONE,
        }
    }

    /// Returns whether constant readings of the unit would still show a rest: its readings may be wrong, but
    /// they change.
    pub fn leaves_stillness(&self) -> bool {
        match self {
            Self::OutOfFamily { .. }
            | Self::Noisy { .. }
            | Self::Isolated { .. }
            | Self::Refuted { .. }
            | Self::ImplausibleAtRest { .. }
            | Self::Duplicated
            | Self::Clock { .. }
            | Self::Lossy { .. }
            | Self::Spikes { .. } => true,
            Self::Late { .. }
            | Self::Frozen { .. }
            | Self::Stuck { .. }
            | Self::Saturated { .. }
            | Self::NotFinite { .. }
            | Self::Copy { .. }
            | Self::ClockJumped => false,
        }
    }

    /// Remaining use of the unit while it sends readings.
    pub fn condition(&self) -> Condition {
        match self {
            Self::Saturated { .. } => Condition::Saturated,
            Self::Stuck { .. } => Condition::Stuck,
            Self::Refuted { .. } => Condition::Refuted,
            Self::OutOfFamily { .. }
            | Self::Noisy { .. }
            | Self::Isolated { .. }
            | Self::Spikes { .. }
            | Self::ImplausibleAtRest { .. }
            | Self::Late { .. }
            | Self::Frozen { .. }
            | Self::NotFinite { .. }
            | Self::Duplicated
            | Self::Copy { .. }
            | Self::Clock { .. }
            | Self::Lossy { .. }
            | Self::ClockJumped => Condition::Doubtful,
        }
    }

    /// Returns whether the fault was found by comparing units, so that the comparison must continue in order to
    /// clear it.
    pub fn is_found_by_comparison(&self) -> bool {
        matches!(
            self,
            Self::OutOfFamily { .. }
                | Self::Noisy { .. }
                | Self::Isolated { .. }
                | Self::Clock { .. }
                | Self::Lossy { .. }
        )
    }

    /// Precedence of the evidence for an error of the readings; `None` where the fault is another one, which evidence on
    /// that error does not touch.
    fn precedence(&self) -> Option<Precedence> {
        match self {
            Self::OutOfFamily { .. } => Some(Precedence::Vote),
            Self::Isolated { ground, .. } => Some(ground.precedence()),
            _ => None,
        }
    }

    /// Returns whether evidence of a precedence overrules the fault.
    pub fn yields_to(&self, precedence: Precedence) -> bool {
        self.precedence().is_some_and(|own| own < precedence)
    }

    /// Returns whether a unit with the fault may follow its primary without bound: evidence from the unit alone is
    /// only a likelihood, and no calibration mends noise or a clock.
    pub fn frees(&self) -> bool {
        self.precedence().is_some_and(|own| own > Precedence::Own)
    }

    /// Returns whether a calibration may correct the fault.
    pub fn may_be_corrected(&self) -> bool {
        matches!(
            self,
            Self::OutOfFamily { .. } | Self::Isolated { .. } | Self::Refuted { .. }
        )
    }
}
