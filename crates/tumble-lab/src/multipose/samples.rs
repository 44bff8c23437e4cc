//! Samples of one unit.

/// The samples of one unit, all finite, in order of time.
#[derive(Clone, Copy, Debug)]
pub struct MultiposeSamples<'a> {
    /// s.
    pub time: &'a [f64],
    /// Specific force, m/s^2, or counts.
    pub force: &'a [[f64; 3]],
    /// Angular rate, rad/s, or counts; zero where there is no gyroscope.
    pub rate: &'a [[f64; 3]],
}
