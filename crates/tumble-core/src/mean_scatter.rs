//! Scatter of the means of successive blocks at rest: noise that was low-passed on board hangs together from sample to
//! sample, so that means of blocks scatter by more than the scatter within a block makes of white noise.

use crate::real::{Real, count, real};
use crate::sample::CHANNELS;
use crate::stillness::Scatter;

/// Blocks over which the scatter of means is found, successive ones.
const WINDOW: usize = 16;

/// Ratio of the scatter of means about their mean to that of their second differences, beyond which they move.
const STATIONARY: f64 = 2.0;

/// Variance that white noise makes of a mean, so many times exceeded, is none of white noise.
const COLOURED: f64 = 2.0;

/// The quietest of many windows lies below the noise by no more than this factor.
const BELOW_NOISE: f64 = 2.0;

/// Variance of a mean over that within a block, beyond which it is no noise of a sensor: a low-pass of 5 Hz makes two.
const LARGEST_RATIO: f64 = 4.0;

/// Learns the variance of block means from the quietest stretch so far in which they do not move.
///
/// Second differences lack what drifts evenly or moves smoothly, as gravity in a slow turn or a hand. Means that scatter
/// about their mean by as much as their second differences do therefore scatter by noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanScatter<T: Real> {
    means: [[T; CHANNELS]; WINDOW],
    filled: usize,
    quietest: [Option<T>; 2],
}

impl<T: Real> Default for MeanScatter<T> {
    fn default() -> Self {
        Self {
            means: [[T::zero(); CHANNELS]; WINDOW],
            filled: 0,
            quietest: [None; 2],
        }
    }
}

impl<T: Real> MeanScatter<T> {
    /// Takes in the mean of the next block.
    pub fn push(&mut self, mean: &[T; CHANNELS]) {
        if self.filled == WINDOW {
            self.means.rotate_left(1);
            self.filled -= 1;
        }
        self.means[self.filled] = *mean;
        self.filled += 1;
        if self.filled < WINDOW {
            return;
        }
        for triad in 0..2 {
            let (about_mean, of_bends) = self.variances(3 * triad);
            if about_mean <= of_bends * real(STATIONARY) {
                // noise.md, eq. 36
                let quietest = &mut self.quietest[triad];
                *quietest = Some(quietest.map_or(about_mean, |least| least.min(about_mean)));
            }
        }
    }

    /// Begins anew after a gap: what lies across it are no neighbours.
    pub fn pause(&mut self) {
        self.filled = 0;
    }

    /// Variance of a block mean beyond that of white noise of this scatter; zero where the noise is white.
    pub fn coloured(&self, floor: &Scatter<T>, samples: u32) -> Scatter<T> {
        let beyond = |found: Option<T>, floor: T| {
            let white = floor / count(samples.max(1));
            match found {
                Some(found) if found > white * real(COLOURED) => {
                    (found * real(BELOW_NOISE) - white).min(floor * real(LARGEST_RATIO))
                }
                _ => T::zero(),
            }
        };
        Scatter {
            specific_force: beyond(self.quietest[0], floor.specific_force),
            angular_rate: beyond(self.quietest[1], floor.angular_rate),
        }
    }

    /// Variance of the means of a triad about their mean, and of noise that has their second differences.
    fn variances(&self, first: usize) -> (T, T) {
        let (mut about_mean, mut of_bends) = (T::zero(), T::zero());
        for i in first..first + 3 {
            let middle = self.means.iter().fold(T::zero(), |sum, mean| sum + mean[i]) / real(WINDOW as f64);
            for mean in &self.means {
                about_mean += (mean[i] - middle) * (mean[i] - middle);
            }
            for three in self.means.windows(3) {
                let bend = three[0][i] - three[1][i] * real(2.0) + three[2][i];
                of_bends += bend * bend;
            }
        }
        let freedom = 3.0 * (WINDOW as f64 - 1.0);
        // A second difference has six times the variance of a mean.
        let bends = 18.0 * (WINDOW as f64 - 2.0);
        (about_mean / real(freedom), of_bends / real(bends))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: Scatter<f64> = Scatter {
        specific_force: 0.1,
        angular_rate: 0.1,
    };

    fn coloured(mean: impl Fn(u32) -> f64) -> f64 {
        let mut scatter = MeanScatter::default();
        for block in 0..64 {
            scatter.push(&[mean(block); CHANNELS]);
        }
        let found = scatter.coloured(&FLOOR, 20);
        assert_eq!(found.specific_force, found.angular_rate);
        found.specific_force
    }

    /// Without correlation from one block to the next, of variance one.
    fn drawn(block: u32) -> f64 {
        let bits = block
            .wrapping_mul(2_654_435_761)
            .rotate_left(13)
            .wrapping_mul(2_246_822_519)
            >> 16;
        (f64::from(bits) / 65_535.0 - 0.5) * 12.0_f64.sqrt()
    }

    #[test]
    fn means_that_move_smoothly_are_no_noise() {
        assert_eq!(coloured(|block| 0.3 * f64::from(block)), 0.0);
        assert_eq!(coloured(|block| (0.3 * f64::from(block)).sin()), 0.0);
    }

    #[test]
    fn means_that_scatter_as_white_noise_does_add_nothing() {
        assert_eq!(coloured(|block| (0.1_f64 / 20.0).sqrt() * drawn(block)), 0.0);
    }

    #[test]
    fn means_that_scatter_more_are_found_to() {
        let found = coloured(|block| 0.1_f64.sqrt() * drawn(block));
        assert!((0.05..0.4).contains(&found), "{found}");
    }
}
