//! Why there is no calibration, with the figures.

tumble_core::vocabulary! {
    /// Why a magnetometer has no calibration.
    #[derive(Clone, Debug, PartialEq)]
    pub enum MagnetometerError {
        /// Readings are fewer than the unknowns and one to check them.
        TooFewReadings {
            /// Readings.
            found: usize,
            /// Readings needed.
            needed: usize,
        } = "too few readings",
        /// All readings lie in a plane.
        Flat = "flat",
        /// The field was met from fewer directions than there are unknowns and one to check them.
        TooFewFieldDirections {
            /// Directions that differ.
            found: usize,
            /// Directions needed.
            needed: usize,
        } = "too few field directions",
        /// The readings leave a combination of the unknowns open.
        ReadingsLeaveOpen {
            /// Share of each of `[M row by row, b, response to current, vertical part]` in it.
            shares: Box<[f64; 16]>,
        } = "readings leave open",
        /// Most readings disagree with each other.
        Disturbed {
            /// Readings that disagree.
            found: usize,
            /// All of them.
            readings: usize,
        } = "disturbed",
        /// Something was not finite.
        FieldUnsolvable = "field unsolvable",
    }
}
