//! Samples of two or more units that take turns in one log, as if they were of one.

use core::f64::consts::FRAC_PI_2;

use tumble_core::sample::CHANNELS;

use crate::distributions::balanced_median;

/// Units that may take turns.
pub const MOST_UNITS: usize = 4;
/// Samples over which turns are taken; a lost one moves those behind it.
const BLOCK: usize = 256;
/// Blocks that are looked at: three minutes at 500 Hz.
const MOST_BLOCKS: usize = 400;
/// Blocks without which nothing is known.
const FEWEST_BLOCKS: usize = 4;
/// Median over blocks of a difference of medians, in its sigmas: at most 2.4 in two channels of 170 logs, 6.4 where a line lies at a
/// share of the sample rate, 100 where two units with usual biases take turns.
const SIGMAS: f64 = 10.0;
/// Channels that have to differ: a line at a share of the sample rate may be in one.
const FEWEST_CHANNELS: usize = 2;
/// Median of the magnitude of a normal variable, sigmas.
const OF_NORMAL: f64 = 0.6745;

/// Readings of one channel over a block, SI.
type ChannelBlock = [f64; BLOCK];

/// Compares the medians of every second, third and fourth sample, less the motion, block by block.
///
/// The unit of a sample differs from those beside it by its own bias, and so alternates, while motion goes on. The noise of a sample is
/// that of the difference to the next of the same turn.
#[derive(Clone, Debug, Default)]
pub struct AlternationWatch {
    /// Ratio of each block, of two, three and four units.
    ratios: [Vec<[f64; CHANNELS]>; MOST_UNITS - 1],
}

impl AlternationWatch {
    /// Takes in successive readings of accelerometer and gyroscope, SI; `None` of one that was not recorded.
    pub fn push(&mut self, triads: [Option<&[[f64; 3]]>; 2]) {
        if self.ratios[0].len() >= MOST_BLOCKS {
            return;
        }
        let blocks = triads.map(|rows| rows.map(|rows| rows.as_chunks::<BLOCK>().0));
        let count = blocks.iter().flatten().map(|each| each.len()).min();
        for number in 0..count.unwrap_or(0).min(MOST_BLOCKS) {
            let channels = channels(blocks.map(|rows| Some(&rows?[number])));
            if !channels.iter().flatten().all(|value| value.is_finite()) {
                continue;
            }
            for (ratios, units) in self.ratios.iter_mut().zip(2..) {
                ratios.push(channels.map(|channel| ratio(&channel, units)));
            }
        }
    }

    /// Returns how many units take turns; 1 where nothing shows that it is more than one.
    #[must_use]
    pub fn units(&self) -> usize {
        let mut found = self.ratios.iter().zip(2..);
        let alternates = |ratios: &[[f64; CHANNELS]]| {
            let usual = |channel: usize| {
                let mut each: Vec<f64> = ratios.iter().map(|ratio| ratio[channel]).collect();
                balanced_median(&mut each).unwrap_or(0.0)
            };
            ratios.len() >= FEWEST_BLOCKS
                && (0..CHANNELS).filter(|channel| usual(*channel) > SIGMAS).count() >= FEWEST_CHANNELS
        };
        found
            .find(|(ratios, _)| alternates(ratios))
            .map_or(1, |(_, units)| units)
    }
}

/// Readings of each channel of a block; zero of one that was not recorded.
fn channels(triads: [Option<&[[f64; 3]; BLOCK]>; 2]) -> [ChannelBlock; CHANNELS] {
    core::array::from_fn(|channel| {
        triads[channel / 3].map_or([0.0; BLOCK], |rows| rows.map(|row| row[channel % 3]))
    })
}

/// Largest difference between the median of a turn and that of all, in its sigmas; zero of readings that do not scatter.
fn ratio(block: &ChannelBlock, units: usize) -> f64 {
    let beside = beside(block, units);
    let whole = beside.len() / units * units;
    // Medians, as a motion that begins at once is beside all that is around it.
    let middles: Vec<f64> = (0..units)
        .map(|turn| {
            let mut own: Vec<f64> = beside[..whole]
                .iter()
                .skip(turn)
                .step_by(units)
                .copied()
                .collect();
            balanced_median(&mut own).unwrap_or(0.0)
        })
        .collect();
    let mut steps: Vec<f64> = (units..BLOCK)
        .map(|place| (block[place] - block[place - units]).abs())
        .collect();
    let noise = balanced_median(&mut steps).unwrap_or(0.0) / (OF_NORMAL * 2.0_f64.sqrt());
    #[allow(clippy::cast_precision_loss)]
    let (each, all) = (units as f64, whole as f64);
    // The standard error of a median is that of a mean, larger by the root of half of pi.
    let sigma = FRAC_PI_2.sqrt() * noise * (each / all).sqrt();
    let mean = middles.iter().sum::<f64>() / each;
    let largest = middles
        .iter()
        .map(|middle| (middle - mean).abs())
        .fold(0.0, f64::max);
    if sigma > 0.0 { largest / sigma } else { 0.0 }
}

/// Readings less the mean of samples around each, which shares its motion: an even number of them halves the ends.
fn beside(block: &ChannelBlock, units: usize) -> Vec<f64> {
    let length = units + 1 - units % 2;
    #[allow(clippy::cast_precision_loss)]
    let weight = 1.0 / units as f64;
    block
        .windows(length)
        .map(|around| {
            let ends = if units.is_multiple_of(2) {
                0.5 * (around[0] + around[length - 1])
            } else {
                0.0
            };
            let all: f64 = around.iter().sum();
            around[length / 2] - weight * (all - ends)
        })
        .collect()
}
