//! Settings of a calibration on a turntable.

use tumble_core::turntable::truth::TruthSource;

/// Rests that twelve unknowns of three axes need.
pub const FEWEST_RESTS: usize = 4;

/// Relations between the two clocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clocks {
    /// One clock stamped both recordings.
    Shared,
    /// Each recording has its own; offset and skew are estimated.
    Apart,
    /// Shared if the recordings overlap in time and their turns coincide, else apart.
    Unknown,
}

/// Settings of the calibration.
#[derive(Clone, Copy, Debug)]
pub struct TurntableSettings {
    /// Local gravity, m/s^2.
    pub gravity: f64,
    /// 1-sigma of local gravity, m/s^2; 0 where scale is relative to it.
    pub gravity_sigma: f64,
    /// Latitude, rad, where it is known: it fixes the upward part of the Earth's rotation.
    pub latitude: Option<f64>,
    /// Where the truth comes from.
    pub truth: TruthSource,
    /// Relation between the clocks.
    pub clocks: Clocks,
    /// Choice to fit the gyroscope's sensitivity to specific force.
    pub g_sensitivity: GSensitivity,
}

/// When the gyroscope's sensitivity to specific force is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GSensitivity {
    /// Always.
    Always,
    /// Never.
    Never,
    /// Where the residuals without it ask for it, and the data show all of it.
    WhereShown,
}
