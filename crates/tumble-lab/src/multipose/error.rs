//! Why there is no calibration, with the figures.

use tumble_core::model::ModelError;

tumble_core::vocabulary! {
    /// Why a triad has no calibration.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum MultiposeError {
        /// Nobody held the unit still.
        NoRests = "no rests",
        /// The rests point in fewer directions than there are unknowns and one to check them.
        TooFewDirections {
            /// Directions that differ.
            found: usize,
            /// Directions needed.
            needed: usize,
            /// Rests in them.
            rests: usize,
        } = "too few directions",
        /// Some of six faces were not laid down.
        FacesMissing {
            /// True for each missing face, in the order of [`super::SectionLabel::FACES`].
            missing: [bool; 6],
        } = "faces missing",
        /// The directions leave a combination of the accelerometer's unknowns open.
        PosesLeaveOpen {
            /// Share of each of `[M row by row, b]` in it.
            shares: [f64; 12],
        } = "poses leave open",
        /// No turn between two rests was recorded whole.
        NoTurns = "no turns",
        /// The turns leave a combination of the gyroscope's unknowns open.
        TurnsLeaveOpen {
            /// Share of each of `[M row by row, b]` in it.
            shares: [f64; 12],
        } = "turns leave open",
        /// No scale of the gyroscope makes its turns those of gravity.
        GyroscopeContradicts {
            /// Median angle by which they miss each other, deg.
            angle: f64,
        } = "gyroscope contradicts",
        /// The axes of the gyroscope form a left-handed set.
        LeftHandedGyroscope = "left-handed gyroscope",
        /// Two axes read the same.
        AxesCoincide = "axes coincide",
        /// Something was not finite.
        Unsolvable = "unsolvable",
    }
}

impl From<ModelError> for MultiposeError {
    fn from(error: ModelError) -> Self {
        match error {
            ModelError::LeftHanded => Self::LeftHandedGyroscope,
            ModelError::Singular => Self::AxesCoincide,
        }
    }
}
