//! Why there is no calibration, with the figures.

use tumble_core::model::ModelError;
use tumble_core::regression::Unsolvable;

/// Why there is no calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TurntableError {
    /// Fewer rests than the unknowns need.
    TooFewRests {
        /// Rests found, or seen by both units.
        found: usize,
        /// Rests needed.
        needed: usize,
    },
    /// The rests point in too few directions.
    DirectionsTooAlike,
    /// The target could not be laid beside the reference.
    Pairing(PairingError),
    /// The truth asked for needs the mounting angle, which needs a pose list.
    NeedsPoses,
    /// The axes of the accelerometer form a left-handed set, or coincide.
    Axes(ModelError),
    /// The axes of the gyroscope form a left-handed set, or coincide.
    GyroscopeAxes(ModelError),
    /// Something was not finite.
    Unsolvable,
}

impl From<Unsolvable> for TurntableError {
    fn from(_: Unsolvable) -> Self {
        Self::Unsolvable
    }
}

impl From<PairingError> for TurntableError {
    fn from(error: PairingError) -> Self {
        Self::Pairing(error)
    }
}

impl From<ModelError> for TurntableError {
    fn from(error: ModelError) -> Self {
        Self::Axes(error)
    }
}

/// Why a target could not be laid beside the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairingError {
    /// No turn or rest of the target meets one of the reference.
    NoCommonTime,
    /// The target turned in itself while the reference stood still.
    MovedDuringRest {
        /// Index of the reference rest.
        rest: usize,
        /// When, s of the target's own clock.
        time: f64,
        /// By how much its gravity turned, deg.
        angle: f64,
    },
    /// The reference turned in itself while the target stood still.
    ReferenceMoved {
        /// When, s of the reference's clock.
        time: f64,
        /// By how much its gravity turned, deg.
        angle: f64,
    },
    /// One unit was recorded in one file a pose, the other continuously.
    OneInFiles,
    /// No file of the target has the name of one of the reference.
    NoCommonFile,
    /// Both units rested often enough, but hardly ever at the same time.
    FewMeet {
        /// Rests both saw.
        met: usize,
        /// Rests of the target.
        rests: usize,
    },
    /// The clocks are said to be shared, and then hardly any rest meets another.
    ClocksApart {
        /// What the turns show the offset to be, s.
        offset: f64,
    },
}
