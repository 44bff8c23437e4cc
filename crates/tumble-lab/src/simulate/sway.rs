//! Smooth random functions of time, or of the way gone.

use core::f64::consts::TAU;

use rand::RngExt;

use crate::simulate::series::Series;
use crate::simulate::stream::Stream;

/// A sum of waves with random frequencies and phases.
#[derive(Clone, Debug, PartialEq)]
pub struct Sway {
    waves: Vec<Wave>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave {
    amplitude: f64,
    /// rad in a unit of the argument.
    pace: f64,
    phase: f64,
}

/// How a sway is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Root mean square of its derivative of that order.
    pub size: f64,
    /// Which derivative `size` is of; 0 for the sway itself.
    pub order: i32,
    /// Lowest and highest frequency, cycles in a unit of the argument.
    pub band: (f64, f64),
    /// Number of waves.
    pub waves: usize,
}

impl Sway {
    /// One wave in each of as many parts of the band, equal in octaves, with equal shares of the mean square.
    pub fn draw(swing: &Swing, stream: &mut Stream) -> Self {
        let (low, high) = (libm::log(swing.band.0), libm::log(swing.band.1));
        let share = swing.size * (2.0 / swing.waves as f64).sqrt();
        let wave = |index: usize| {
            let part = (index as f64 + stream.random::<f64>()) / swing.waves as f64;
            let pace = TAU * libm::exp(low + part * (high - low));
            Wave {
                amplitude: share / pace.powi(swing.order),
                pace,
                phase: TAU * stream.random::<f64>(),
            }
        };
        Self {
            waves: (0..swing.waves).map(wave).collect(),
        }
    }

    /// Value at an argument that is itself a function of time.
    pub fn at<const N: usize>(&self, argument: &Series<N>) -> Series<N> {
        let wave = |wave: &Wave| (*argument * wave.pace + wave.phase).sincos().0 * wave.amplitude;
        self.waves
            .iter()
            .map(wave)
            .fold(Series::constant(0.0), |sum, each| sum + each)
    }
}
