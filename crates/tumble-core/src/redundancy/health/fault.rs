//! What is wrong with a unit, with the figures.

use crate::real::Real;
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
        /// A sensor is far from the median of the units.
        OutOfFamily {
            /// Which.
            sensor: Sensor,
            /// How far, m/s^2 or rad/s.
            apart: T,
            /// How far it may be.
            limit: T,
        } = "out of family",
        /// The readings of a sensor scatter much more than those of the other units.
        Noisy {
            /// Which.
            sensor: Sensor,
            /// How many times as much.
            ratio: T,
            /// How many it may be.
            limit: T,
        } = "noisy",
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
    }
}

impl<T: Real> HealthFault<T> {
    /// Whether readings that do not change would show that nothing moves: what they say may be wrong, but they live.
    pub fn leaves_stillness(&self) -> bool {
        match self {
            Self::OutOfFamily { .. }
            | Self::Noisy { .. }
            | Self::ImplausibleAtRest { .. }
            | Self::Spikes { .. } => true,
            Self::Late { .. }
            | Self::Frozen { .. }
            | Self::Stuck { .. }
            | Self::Saturated { .. }
            | Self::NotFinite { .. }
            | Self::ClockJumped => false,
        }
    }
}
