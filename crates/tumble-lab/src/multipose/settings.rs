//! Settings of a calibration without equipment.

use tumble_core::noise::Noise;
use tumble_core::sample::CHANNELS;

use super::sections::Section;
use crate::acquisition::Acquired;

/// Directions that nine unknowns and one to check them need.
pub const FEWEST_DIRECTIONS: usize = 10;

/// 1-sigma of a full turn by hand against an edge, rad. Nothing in a session shows it, and it is 0.28 % of scale.
pub const FULL_TURN_SIGMA: f64 = 0.0175;

/// Settings of a calibration without equipment.
#[derive(Clone, Debug)]
pub struct MultiposeSettings {
    /// Local gravity, m/s^2.
    pub gravity: f64,
    /// 1-sigma of local gravity, m/s^2; 0 where scale is relative to it.
    pub gravity_sigma: f64,
    /// Latitude, rad, where the rotation of the Earth is to be taken off.
    pub latitude: Option<f64>,
    /// True to fit the gyroscope's sensitivity to specific force.
    pub g_sensitivity: bool,
    /// True if there is a gyroscope.
    pub gyroscope: bool,
    /// True if readings are counts of unknown scale.
    pub raw: bool,
    /// Shortest rest, microseconds.
    pub shortest_rest: u64,
    /// True if the unit was laid on the six faces of a box.
    pub faces: bool,
    /// 1-sigma of the pace of the clock that stamped the samples, relative: turns are integrated by it.
    pub pace_sigma: f64,
    /// 1-sigma of the time of a sample, s, where nobody knows when between an even clock and its stamp it was taken.
    pub stamp_sigma: f64,
    /// Labelled stretches, whose rests are taken for such; none where rests are to be found.
    pub sections: Vec<Section>,
    /// Noise of the channels where it is known from elsewhere.
    pub noise: [KnownNoise; CHANNELS],
}

/// Noise of a channel as a longer record showed it; what is not known is read off the rests.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KnownNoise {
    /// N, unit / sqrt(Hz).
    pub density: Option<f64>,
    /// B, unit.
    pub bias_instability: Option<f64>,
}

impl KnownNoise {
    /// Puts what is known in place of what rests showed.
    pub(super) fn put_into(known: &[Self; CHANNELS], unit: &mut Acquired) {
        for (known, noise) in known.iter().zip(&mut unit.noise) {
            let white = known.density.map_or(noise.white, |density| density * density);
            *noise = match known.bias_instability {
                None => Noise { white, ..*noise },
                Some(instability) => Noise {
                    white,
                    flicker: instability * instability,
                    flicker_shown: instability * instability,
                    flicker_sigma: 0.0,
                },
            };
        }
    }
}
