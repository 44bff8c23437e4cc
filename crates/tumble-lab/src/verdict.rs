//! Verdict of a procedure on a unit, or on a set of them, in a word.

tumble_core::vocabulary! {
    /// Verdict at the top of a page.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Verdict {
        /// All that was asked for lies within its limits.
        Pass = "pass",
        /// All lies within its limits, something by less than its guard band.
        ConditionalPass = "conditional pass",
        /// Something lies beyond its limit, by less than its guard band.
        ConditionalFail = "conditional fail",
        /// Something does not, or was not shown to.
        Fail = "fail",
        /// It has a calibration, and there was nothing to hold that against.
        Calibrated = "calibrated",
        /// Its residuals are more than noise explains, so that its sigmas cannot be trusted.
        ModelNotMet = "model not met",
        /// One of two sensors has a calibration, the other none.
        PartlyCalibrated = "partly calibrated",
        /// It has none.
        NotCalibrated = "not calibrated",
        /// Rotation and lever arm relative to the primary were found.
        Aligned = "aligned",
        /// The motion did not show all of them.
        PartlyAligned = "partly aligned",
        /// White noise, bias instability and random walk of every channel were found.
        Measured = "measured",
        /// The record does not show all of them.
        PartlyMeasured = "partly measured",
        /// Two calibrations agree within what is known of both.
        Same = "same",
        /// They do not.
        Differ = "differ",
        /// Nothing of one is known with an uncertainty and stands in the other.
        CannotBeTold = "cannot be told",
    }
}
