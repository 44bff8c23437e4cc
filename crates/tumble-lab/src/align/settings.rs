//! Settings of the alignment.

use nalgebra::{SVector, Vector3};

/// Settings of the alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignSettings {
    /// Shortest window, s.
    pub window: f64,
    /// Largest offset of the secondary's clock, s, either way from `around`.
    pub search: f64,
    /// Offset around which to search, s.
    pub around: f64,
    /// True if there is but one clock, so that one unit may be late but no clock fast.
    pub one_clock: bool,
    /// 1-sigma by which scales of the two units may differ.
    pub scale_sigma: f64,
    /// 1-sigma of the sensitivity of one unit across its axes, against the other, rad.
    pub cross_sigma: f64,
    /// The primary's own gyroscope bias, rad/s, with its 1-sigma an axis.
    pub rate_bias: (Vector3<f64>, f64),
}

impl Default for AlignSettings {
    fn default() -> Self {
        Self {
            window: 0.05,
            search: 5.0,
            around: 0.0,
            one_clock: false,
            scale_sigma: 0.03,
            cross_sigma: 0.01,
            rate_bias: (Vector3::zeros(), 0.1),
        }
    }
}

impl AlignSettings {
    pub(super) fn stretch_sigma(&self) -> SVector<f64, 6> {
        let (scale, cross) = (self.scale_sigma, self.cross_sigma);
        SVector::from([scale, scale, scale, cross, cross, cross])
    }
}
