//! What is wrong with a unit, with the figures.

use crate::real::Real;
use crate::redundancy::judgement::attribution::Ground;
use crate::redundancy::selection::Condition;
use crate::redundancy::sensor::Sensor;

crate::vocabulary! {
    /// Why a unit is not healthy.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum HealthFault<T: Real> {
        /// No sample came.
        Late {
            /// For how long, s.
            pause: T,
        } = "late",
        /// All axes of a sensor repeat their readings.
        Frozen {
            /// Which.
            sensor: Sensor,
            /// For how long at least, s.
            duration: T,
        } = "frozen",
        /// One axis repeats its reading while the others of its sensor move.
        Stuck {
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: u8,
            /// What it says, m/s^2 or rad/s.
            value: T,
        } = "stuck",
        /// A sensor is at the end of its range too often.
        Saturated {
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: u8,
            /// What it said last, m/s^2 or rad/s.
            value: T,
        } = "saturated",
        /// Too many readings are not finite numbers.
        NotFinite {
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: u8,
        } = "not finite",
        /// Readings leave and come back too often.
        Spikes {
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: u8,
            /// How far the last of them was away, m/s^2 or rad/s.
            value: T,
        } = "spikes",
        /// Without it, the other units agree.
        OutOfFamily {
            /// In this sensor.
            sensor: Sensor,
            /// How far it is from that of them that it contradicts most, m/s^2 or rad/s.
            apart: T,
            /// How far it may be.
            limit: T,
            /// Time over which it shows, s.
            scale: T,
            /// The units that agree, a bit each, the primary's the lowest.
            agreeing: u8,
        } = "out of family",
        /// The readings of a sensor scatter much more than those of the other units make one expect.
        Noisy {
            /// Which.
            sensor: Sensor,
            /// Scatter from sample to sample, m/s^2 or rad/s.
            scatter: T,
            /// What it may be.
            limit: T,
        } = "noisy",
        /// Of two units that disagree, it is the one that is wrong.
        Blamed {
            /// In this sensor.
            sensor: Sensor,
            /// What proves it.
            ground: Ground,
            /// The figure that does.
            value: T,
            /// What it had to exceed.
            limit: T,
        } = "blamed",
        /// It is farther from a valid primary at rest than any error that calibration can find.
        Refuted {
            /// In this sensor.
            sensor: Sensor,
            /// How far, m/s^2 or rad/s.
            deviation: T,
            /// How far it may be.
            limit: T,
        } = "refuted",
        /// At rest a sensor does not say what physics says.
        ImplausibleAtRest {
            /// Which.
            sensor: Sensor,
            /// Deviation from gravity, m/s^2, or from zero, rad/s.
            deviation: T,
            /// How large it may be.
            limit: T,
        } = "implausible at rest",
        /// Its clock left that of the other units.
        ClockJumped = "clock jumped",
        /// It gives each reading twice, and did not do so before.
        Duplicated = "duplicated",
        /// Its readings are those of another unit.
        Copy {
            /// The other, a bit, the primary's the lowest.
            of: u8,
        } = "copy",
    }
}

/// Figures of a fault. Each kind has some of them; what they say and their units stand at the fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultFigures<T: Real> {
    /// The sensor at fault, where no single channel is.
    pub sensor: Option<Sensor>,
    /// 0 to 2 accelerometer, 3 to 5 gyroscope.
    pub channel: Option<u8>,
    /// What proves it.
    pub ground: Option<Ground>,
    /// What was found.
    pub value: Option<T>,
    /// What it may be.
    pub limit: Option<T>,
    /// Time over which it shows, s.
    pub scale: Option<T>,
    /// The units that agree, a bit each, the primary's the lowest.
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
    /// What is known of it besides its kind.
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
            Self::Blamed {
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
            Self::Copy { of } => FaultFigures {
                agreeing: Some(of),
                ..FaultFigures::NONE
            },
            Self::ClockJumped | Self::Duplicated => FaultFigures::NONE,
        }
    }

    /// Whether readings that do not change would show that nothing moves: what they say may be wrong, but they live.
    pub fn leaves_stillness(&self) -> bool {
        match self {
            Self::OutOfFamily { .. }
            | Self::Noisy { .. }
            | Self::Blamed { .. }
            | Self::Refuted { .. }
            | Self::ImplausibleAtRest { .. }
            | Self::Duplicated
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

    /// What is left of the unit as long as it speaks.
    pub fn condition(&self) -> Condition {
        match self {
            Self::Saturated { .. } => Condition::Saturated,
            Self::Stuck { .. } => Condition::Stuck,
            Self::Refuted { .. } => Condition::Refuted,
            Self::OutOfFamily { .. }
            | Self::Noisy { .. }
            | Self::Blamed { .. }
            | Self::Spikes { .. }
            | Self::ImplausibleAtRest { .. }
            | Self::Late { .. }
            | Self::Frozen { .. }
            | Self::NotFinite { .. }
            | Self::Duplicated
            | Self::Copy { .. }
            | Self::ClockJumped => Condition::Doubtful,
        }
    }

    /// Whether it was found by comparing units: what the unit says goes on being compared, or nothing would ever clear it.
    pub fn is_judged(&self) -> bool {
        matches!(
            self,
            Self::OutOfFamily { .. } | Self::Noisy { .. } | Self::Blamed { .. }
        )
    }

    /// Whether it was found by what a unit says against itself in motion, which is likely only: physics at rest overrules it, and
    /// no calibration may follow it without bound.
    pub fn is_likelihood(&self) -> bool {
        matches!(
            self,
            Self::Blamed {
                ground: Ground::Step | Ground::Gravity,
                ..
            }
        )
    }

    /// Whether a unit of which it is found may follow its primary wherever that leads.
    pub fn frees(&self) -> bool {
        self.is_judged() && !self.is_likelihood()
    }

    /// Whether a calibration may mend it.
    pub fn may_be_mended(&self) -> bool {
        matches!(
            self,
            Self::OutOfFamily { .. } | Self::Blamed { .. } | Self::Refuted { .. }
        )
    }
}
