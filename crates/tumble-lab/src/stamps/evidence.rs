//! Test of even sampling: the signal of a sensor shows it, its stamps do not.
//!
//! Equations: docs/theory/clocks.md.
//!
//! A sensor that samples evenly has a smooth signal over the numbers of its samples. One that samples when it is asked has a
//! smooth signal over its stamps: over the numbers it is rough by the rate of change times the time by which each sample was
//! taken late.

use super::fit::SampleTimes;
use crate::distributions::median;

/// Taps that smooth signals have no part in: a fourth difference.
const FOURTH_DIFFERENCE: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Sum of the squares of the taps.
const POWER: f64 = 70.0;
/// Sigmas of the noise above which the rate of change counts: its own noise is no motion.
const MOVING: f64 = 5.0;
/// Samples of a block, whose sums scatter as those of others.
const BLOCK: usize = 500;
/// Beta beyond which the stamps are the times, below which they are late, each by two sigma.
const STAMPS: f64 = 0.7;
const EVEN: f64 = 0.3;
/// 1-sigma of beta above which the scatter of stamps moves less than noise does.
const UNSHOWN: f64 = 0.15;
/// Samples on either side of the one that is judged.
const REACH: usize = 4;

tumble_core::vocabulary! {
    /// When the samples were taken, as the signal shows it.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Sampling {
        /// Evenly: stamps come late.
        Even = "even",
        /// Samples are taken at the times of their stamps.
        Stamped = "stamped",
        /// Neither.
        Between = "between",
        /// The signal does not show it; the scatter of stamps then moves less than noise does.
        Unshown = "unshown",
    }
}

/// Share of the scatter of stamps by which samples were really taken late (eq. 14), gathered over a recording.
#[derive(Clone, Debug, Default)]
pub struct LatenessEvidence {
    row: usize,
    /// Last samples: row, delay of the stamp behind the fitted time, s, and the channels.
    tail: Vec<(usize, f64, [f64; 6])>,
    blocks: Vec<(f64, f64)>,
}

impl LatenessEvidence {
    /// Takes in successive samples: stamps, s, and six channels; of the gyroscope and the accelerometer.
    pub fn push(&mut self, times: &SampleTimes, stamps: &[f64], force: &[[f64; 3]], rate: &[[f64; 3]]) {
        for (k, stamp) in stamps.iter().enumerate() {
            let row = self.row + k;
            let (f, w) = (force[k], rate[k]);
            self.tail
                .push((row, stamp - times.at(row), [f[0], f[1], f[2], w[0], w[1], w[2]]));
        }
        self.row += stamps.len();
        for channel in 0..6 {
            self.channel(times, channel);
        }
        let kept = self.tail.len().saturating_sub(2 * REACH);
        self.tail.drain(..kept);
    }

    /// Adds what one channel shows of the samples at hand.
    fn channel(&mut self, times: &SampleTimes, channel: usize) {
        let value = |k: usize| self.tail[k].2[channel];
        let fourth = |f: &dyn Fn(usize) -> f64, k: usize| -> f64 {
            FOURTH_DIFFERENCE
                .iter()
                .enumerate()
                .map(|(tap, by)| by * f(k + tap - 2))
                .sum()
        };
        let inner = REACH..self.tail.len().saturating_sub(REACH);
        if inner.is_empty() {
            return;
        }
        let mut rough: Vec<f64> = inner.clone().map(|k| fourth(&value, k).abs()).collect();
        let noise = 1.4826 * median(&mut rough).unwrap_or(0.0) / POWER.sqrt();
        if noise.is_nan() || noise <= 0.0 {
            return;
        }
        let period = times.period.seconds;
        let change =
            |k: usize| (2.0 * (value(k + 2) - value(k - 2)) + value(k + 1) - value(k - 1)) / (10.0 * period);
        let moving = MOVING * noise / (10.0_f64.sqrt() * period);
        let late = |k: usize| change(k) * self.tail[k].1;
        let mut sums = (0.0, 0.0);
        let mut in_block = 0;
        let mut found = Vec::new();
        for k in inner {
            let even = (k - REACH + 1..=k + REACH).all(|near| times.follows_the_last(self.tail[near].0));
            if !even || change(k).abs() < moving {
                continue;
            }
            let (y, z) = (fourth(&value, k) / noise, fourth(&late, k) / noise);
            if y.is_finite() && z.is_finite() {
                sums.0 += y * z;
                sums.1 += z * z;
                in_block += 1;
            }
            if in_block == BLOCK {
                found.push(sums);
                (sums, in_block) = ((0.0, 0.0), 0);
            }
        }
        found.push(sums);
        self.blocks
            .extend(found.into_iter().filter(|(_, power)| *power > 0.0));
    }

    /// Share by which samples were taken late, and its 1-sigma; none where nothing moved (eq. 14).
    #[must_use]
    pub fn share(&self) -> Option<(f64, f64)> {
        let (product, power) = self
            .blocks
            .iter()
            .fold((0.0, 0.0), |sum, each| (sum.0 + each.0, sum.1 + each.1));
        // Exact stamps differ from fitted times by nothing: 0 / 0.
        if power <= 0.0 || self.blocks.len() < 2 {
            return None;
        }
        let beta = product / power;
        let scatter: f64 = self.blocks.iter().map(|(y, z)| (y - beta * z).powi(2)).sum();
        // Where blocks are few, noise alone is a better measure than their scatter.
        let sigma = (scatter.max(POWER * power)).sqrt() / power;
        Some((beta, sigma))
    }

    /// When the samples were taken.
    #[must_use]
    pub fn sampling(&self) -> Sampling {
        match self.share() {
            Some((_, sigma)) if sigma > UNSHOWN => Sampling::Unshown,
            None => Sampling::Unshown,
            Some((beta, sigma)) if beta + 2.0 * sigma < EVEN => Sampling::Even,
            Some((beta, sigma)) if beta - 2.0 * sigma > STAMPS => Sampling::Stamped,
            Some(_) => Sampling::Between,
        }
    }
}
