//! Why there is no calibration, with the figures.

use tumble_core::model::ModelError;
use tumble_core::regression::Unsolvable;

tumble_core::vocabulary! {
    /// Why there is no calibration.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum TurntableError {
        /// Fewer rests than the unknowns need.
        TooFewRests {
            /// Rests found, or seen by both units.
            found: usize,
            /// Rests needed.
            needed: usize,
        } = "too few rests",
        /// The rests point in too few directions.
        DirectionsTooAlike = "directions too alike",
        /// The target could not be laid beside the reference.
        Pairing(PairingError) = "pairing",
        /// The truth asked for needs the mounting angle, which needs a pose list.
        NeedsPoses = "needs poses",
        /// The axes of the accelerometer form a left-handed set.
        LeftHanded = "left-handed",
        /// Two axes of the accelerometer read the same.
        AxesCoincide = "axes coincide",
        /// The axes of the gyroscope form a left-handed set.
        LeftHandedGyroscope = "left-handed gyroscope",
        /// Two axes of the gyroscope read the same.
        GyroscopeAxesCoincide = "gyroscope axes coincide",
        /// The commanded rates are to be the truth, and the reference never turned at a constant rate.
        NoConstantRates = "no constant rates",
        /// The reference turned at a constant rate that was not commanded.
        NotCommanded {
            /// When it began, s since the origin of the reference.
            time: f64,
            /// Rate that the reference measured, deg/s.
            rate: f64,
        } = "rate not commanded",
        /// The table turned about an axis that is not vertical.
        AxisNotVertical {
            /// When it began, s since the origin of the reference.
            time: f64,
            /// Angle between axis and vertical, deg.
            angle: f64,
        } = "axis not vertical",
        /// Something was not finite.
        Unsolvable = "unsolvable",
    }
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

impl TurntableError {
    /// The same of the gyroscope, where it is of the accelerometer's axes.
    #[must_use]
    pub fn of_gyroscope(self) -> Self {
        match self {
            Self::LeftHanded => Self::LeftHandedGyroscope,
            Self::AxesCoincide => Self::GyroscopeAxesCoincide,
            other => other,
        }
    }

    /// Its word, or that of what it comes from.
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Pairing(error) => error.name(),
            other => other.name(),
        }
    }
}

/// Errors in the axes of an accelerometer.
impl From<ModelError> for TurntableError {
    fn from(error: ModelError) -> Self {
        match error {
            ModelError::LeftHanded => Self::LeftHanded,
            ModelError::Singular => Self::AxesCoincide,
        }
    }
}

tumble_core::vocabulary! {
    /// Why a target could not be laid beside the reference.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum PairingError {
        /// No turn or rest of the target meets one of the reference.
        NoCommonTime = "no common time",
        /// The target turned in itself while the reference stood still.
        MovedDuringRest {
            /// Index of the reference rest.
            rest: usize,
            /// When, s of the target's own clock.
            time: f64,
            /// By how much its gravity turned, deg.
            angle: f64,
        } = "moved during rest",
        /// The reference turned in itself while the target stood still.
        ReferenceMoved {
            /// When, s of the reference's clock.
            time: f64,
            /// By how much its gravity turned, deg.
            angle: f64,
        } = "reference moved",
        /// One unit was recorded in one file a pose, the other continuously.
        OneInFiles = "one in files",
        /// No file of the target has the name of one of the reference.
        NoCommonFile = "no common file",
        /// Both units rested often enough, but hardly ever at the same time.
        FewMeet {
            /// Rests both saw.
            met: usize,
            /// Rests of the target.
            rests: usize,
        } = "few meet",
        /// The clocks are stated to be shared, and then hardly any rest meets another.
        ClocksApart {
            /// Offset by the turns, s.
            offset: f64,
        } = "clocks apart",
    }
}
