//! Noise of a unit at rest.

use tumble_core::noise::{AllanLadder, Noise};
use tumble_core::sample::CHANNELS;

/// Noise as the blocks, and the windows with soft edges, of rests show it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RestLadders {
    /// Ladder of blocks.
    pub flat: AllanLadder<f64>,
    /// Ladder of windows.
    pub soft: AllanLadder<f64>,
}

impl RestLadders {
    pub(super) fn merge(&mut self, other: &Self) {
        self.flat.merge(&other.flat);
        self.soft.merge(&other.soft);
    }
}

/// Noise of the six channels, with the flicker that the axes of a triad share.
pub(super) fn noise_of(ladder: &AllanLadder<f64>) -> [Noise<f64>; CHANNELS] {
    let ([fx, fy, fz], [wx, wy, wz]) = (ladder.fit_jointly([0, 1, 2]), ladder.fit_jointly([3, 4, 5]));
    [fx, fy, fz, wx, wy, wz]
}
