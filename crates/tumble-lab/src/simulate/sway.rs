//! Smooth random functions of time, or of the way gone.

use core::f64::consts::TAU;

use rand::RngExt;

use crate::simulate::series::Series;
use crate::simulate::stream::RandomStream;

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

/// Statistics from which a sway is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwayStatistics {
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
    pub fn draw(swing: &SwayStatistics, stream: &mut RandomStream) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::stream::{StreamPurpose, stream};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn the_derivative_named_has_the_root_mean_square_asked_for(
            seed in any::<u64>(), size in 0.1..10.0f64, order in 0..3i32, waves in 1..5usize,
        ) {
            let swing = SwayStatistics { size, order, band: (0.1, 0.5), waves };
            let sway = Sway::draw(&swing, &mut stream(seed, 0, StreamPurpose::Ride));
            let count = 200_000;
            let at = |index: i32| sway.at(&Series::<3>::time(f64::from(index) * 0.1)).derivative(order as usize);
            let square = (0..count).map(|index| at(index).powi(2)).sum::<f64>() / f64::from(count);
            prop_assert!((square.sqrt() / size - 1.0).abs() < 0.03, "{square}");
        }
    }
}
