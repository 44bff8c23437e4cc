//! Why a spin cannot be used, with the figures.

use crate::real::Real;

crate::vocabulary! {
    /// Reasons why a spin fails.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum SpinFailure<T: Real> {
        /// The robot never stood still long enough.
        NeverStill {
            /// Time waited, s.
            waited: T,
        } = "never still",
        /// There is no rest to take the bias from.
        NoRest = "no rest",
        /// The robot did not turn.
        NoTurn {
            /// Angle turned nevertheless, rad.
            turned: T,
        } = "no turn",
        /// It turned less than asked before time ran out.
        TurnedTooLittle {
            /// Both directions together, rad.
            turned: T,
            /// rad.
            wanted: T,
        } = "turned too little",
        /// It rotated about other axes too: picked up, or pushed over a sill.
        NotOneAxis {
            /// When, microseconds.
            time: u64,
            /// Rate across the turning axis, rad/s.
            across: T,
            /// Largest allowed, rad/s.
            limit: T,
        } = "not one axis",
        /// The force along the turning axis changed: lifted, or dropped.
        Lifted {
            /// When, microseconds.
            time: u64,
            /// By how much it changed, m/s^2.
            change: T,
            /// Largest allowed, m/s^2.
            limit: T,
        } = "lifted",
        /// A sensor was at the end of its range.
        Saturated {
            /// When, microseconds.
            time: u64,
            /// 0 to 2 accelerometer, 3 to 5 gyroscope.
            channel: usize,
            /// Reading, m/s^2 or rad/s.
            value: T,
        } = "saturated",
        /// The floor tilts more than is allowed.
        FloorTooSteep {
            /// rad.
            tilt: T,
            /// rad.
            limit: T,
        } = "floor too steep",
        /// The robot turned too far from one sample to the next.
        SampleRateTooLow {
            /// Samples a second, Hz.
            rate: T,
            /// Samples a second needed at this speed, Hz.
            needed: T,
        } = "sample rate too low",
        /// Samples are missing while the robot turned.
        SamplesMissing {
            /// When, microseconds.
            time: u64,
            /// For how long, s.
            gap: T,
        } = "samples missing",
        /// No more samples came.
        StreamStopped {
            /// Time of the last sample, microseconds.
            time: u64,
            /// For how long, s.
            gap: T,
        } = "stream stopped",
        /// The equations have no solution: something was not a number.
        Unsolvable = "unsolvable",
    }
}
