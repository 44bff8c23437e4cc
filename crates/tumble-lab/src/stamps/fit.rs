//! Even times of a whole recording.
//!
//! Equations: docs/theory/clocks.md.

use super::count::{Loss, losses};
use super::envelope::{DelayBlock, Delayed, Follows, blocks, choose};
use super::period::{FEWEST, Period, measure};
use super::walk::{Walk, join};

/// Least 1-sigma of a block's offset over the scatter of stamps: resolution of stamps hides smaller ones.
const LEAST_SIGMA: f64 = 1e-3;
/// Rounds in which the period is measured anew by what the blocks show of it.
const ROUNDS: usize = 2;

/// Samples from a row on whose times are of one clock.
#[derive(Clone, Debug)]
struct Stretch {
    first_row: usize,
    /// s, stamp that its even times count from.
    origin: f64,
    /// Number of its first sample.
    first_number: f64,
    walk: Walk,
}

/// Times of samples by their row in a recording.
#[derive(Clone, Debug)]
pub struct SampleTimes {
    /// Sampling period and scatter of stamps.
    pub period: Period,
    /// Source of the times.
    pub follows: Follows,
    /// Samples that were lost on the way.
    pub lost: u64,
    /// s by which the latest stamp is behind its sample, but for the thousandth that are later.
    pub latest: f64,
    losses: Vec<Loss>,
    stretches: Vec<Stretch>,
}

impl SampleTimes {
    /// Time of the sample in a row, s.
    #[must_use]
    pub fn at(&self, row: usize) -> f64 {
        let number = self.number(row);
        let stretch = &self.stretches[self.stretches.partition_point(|each| each.first_row <= row) - 1];
        let since = (number - stretch.first_number) * self.period.seconds;
        stretch.origin + since + stretch.walk.at(since) // eq. 13
    }

    /// True where the sample in a row is the one that was taken a period after the one before.
    #[must_use]
    pub fn follows_the_last(&self, row: usize) -> bool {
        row > 0
            && self
                .losses
                .binary_search_by_key(&row, |loss| loss.first_row)
                .is_err()
    }

    /// 1-sigma of times beside each other, s.
    #[must_use]
    pub fn sigma(&self) -> f64 {
        self.stretches
            .iter()
            .fold(0.0, |most, each| most.max(each.walk.offset_sigma()))
    }

    /// 1-sigma of a span of time, relative.
    #[must_use]
    pub fn rate_sigma(&self) -> f64 {
        self.stretches
            .iter()
            .fold(0.0, |most, each| most.max(each.walk.rate_sigma()))
    }

    /// Mean s from one sample to the next, as fitted, over the longest stretch.
    #[must_use]
    pub fn interval(&self) -> f64 {
        let longest = self
            .stretches
            .iter()
            .max_by(|a, b| span(&a.walk).total_cmp(&span(&b.walk)));
        longest.map_or(f64::NAN, |stretch| {
            let (from, to) = (
                &stretch.walk.states[0],
                &stretch.walk.states[stretch.walk.states.len() - 1],
            );
            let length = span(&stretch.walk);
            let rate = if length > 0.0 {
                (to[0] - from[0]) / length
            } else {
                0.0
            };
            self.period.seconds * (1.0 + rate)
        })
    }

    #[allow(clippy::cast_precision_loss)]
    fn number(&self, row: usize) -> f64 {
        let place = self.losses.partition_point(|loss| loss.first_row <= row) - 1;
        (row as u64 + self.losses[place].lost) as f64
    }
}

fn span(walk: &Walk) -> f64 {
    walk.times[walk.times.len() - 1] - walk.times[0]
}

/// Cuts one stretch into blocks, its times counted from its first stamp.
#[allow(clippy::cast_precision_loss)]
fn blocks_of(stamps: &[f64], numbers: &[u64], period: f64) -> Vec<DelayBlock> {
    let samples = stamps.iter().zip(numbers).map(|(stamp, number)| {
        let time = (number - numbers[0]) as f64 * period;
        Delayed {
            time,
            delay: stamp - stamps[0] - time,
            odd: number % 2 == 1,
        }
    });
    blocks(
        samples,
        (numbers[numbers.len() - 1] - numbers[0]) as f64 * period,
        period,
    )
}

/// Fits even times to stamps that come late, of successive samples, s.
///
/// `None` where they are too few, run backwards, or step by parts of a period: then nobody knows which sample is which.
#[must_use]
pub fn fit_times(stamps: &[f64]) -> Option<SampleTimes> {
    if stamps.windows(2).any(|pair| pair[1] < pair[0]) {
        return None;
    }
    let mut period = measure(stamps)?;
    let mut fitted = fit_by(stamps, &period)?;
    for _ in 0..ROUNDS {
        period.seconds = fitted.interval();
        fitted = fit_by(stamps, &period)?;
    }
    let steady = (1..fitted.stretches.len()).all(|k| {
        let first = fitted.stretches[k].first_row;
        fitted.at(first) > fitted.at(first - 1)
    });
    steady.then_some(fitted)
}

fn fit_by(stamps: &[f64], period: &Period) -> Option<SampleTimes> {
    let losses = losses(stamps, period)?;
    let numbers = numbers(stamps.len(), &losses);
    let mut firsts: Vec<usize> = losses
        .iter()
        .filter(|loss| loss.begins)
        .map(|loss| loss.first_row)
        .collect();
    firsts.push(stamps.len());
    let cut: Vec<(usize, Vec<DelayBlock>)> = firsts
        .windows(2)
        .map(|rows| {
            (
                rows[0],
                blocks_of(
                    &stamps[rows[0]..rows[1]],
                    &numbers[rows[0]..rows[1]],
                    period.seconds,
                ),
            )
        })
        .collect();
    let (follows, shown) = choose(cut.iter().flat_map(|(_, blocks)| blocks));
    let sigma = shown.max(LEAST_SIGMA * period.scatter);
    let stretches = cut
        .iter()
        .map(|(first_row, blocks)| {
            let nodes: Vec<_> = blocks.iter().map(|block| block.node(follows)).collect();
            #[allow(clippy::cast_precision_loss)]
            let first_number = numbers[*first_row] as f64;
            Stretch {
                first_row: *first_row,
                origin: stamps[*first_row],
                first_number,
                walk: join(&nodes, sigma),
            }
        })
        .collect();
    let mut times = SampleTimes {
        period: *period,
        follows,
        lost: losses.last().map_or(0, |loss| loss.lost),
        latest: 0.0,
        losses,
        stretches,
    };
    let mut late: Vec<f64> = (0..stamps.len()).map(|row| stamps[row] - times.at(row)).collect();
    let place = late.len() - 1 - late.len() / 1000;
    debug_assert!(late.len() >= FEWEST);
    times.latest = *late.select_nth_unstable_by(place, f64::total_cmp).1;
    Some(times)
}

/// Number of the sample in each row.
fn numbers(rows: usize, losses: &[Loss]) -> Vec<u64> {
    let mut numbers = Vec::with_capacity(rows);
    for (k, loss) in losses.iter().enumerate() {
        let end = losses.get(k + 1).map_or(rows, |next| next.first_row);
        numbers.extend((loss.first_row..end).map(|row| row as u64 + loss.lost));
    }
    numbers
}
