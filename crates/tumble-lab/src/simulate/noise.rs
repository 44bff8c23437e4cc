//! White noise and bias instability, as IEEE Std 952 defines them.
//!
//! Bias instability `B` is noise with the two-sided spectrum `S(f) = B^2 / (2 pi f)`, whose Allan deviation is flat at
//! `sqrt(2 ln 2 / pi) B = 0.664 B`. It is made of first-order Gauss-Markov processes with correlation times `tau_k` in
//! geometric progression (Keshner, "1/f noise", Proc. IEEE 70, 1982). One process of variance `s^2` has the spectrum
//!
//! ```text
//! S_k(f) = 2 s^2 tau_k / (1 + (2 pi f tau_k)^2),        f S_k(f) = (s^2 / pi) x / (1 + x^2),   x = 2 pi f tau_k
//! ```
//!
//! and the mean of the sum over `ln x`, with the steps `h = ln(tau_{k+1} / tau_k)`, is `s^2 / (2 h)`. Setting that to
//! `B^2 / (2 pi)` gives `s^2 = B^2 h / pi`. With a ratio of 4 the ripple about the mean is `2 / cosh(pi^2 / h)`, 0.3 %,
//! and `s` happens to be the Allan floor itself.

use rand::RngExt;
use rand_distr::StandardNormal;

use crate::simulate::stream::RandomStream;

/// Ratio of neighbouring correlation times.
const RATIO: f64 = 4.0;
/// Shortest correlation time, in samples.
const SHORTEST: f64 = 4.0;
/// Longest correlation time at least, in lengths of the recording.
const LONGEST: f64 = 4.0;

/// Scatter of one sample of white noise: `N sqrt(rate)`.
pub fn white_sigma(noise_density: f64, rate: f64) -> f64 {
    noise_density * rate.sqrt()
}

/// One first-order Gauss-Markov process, sampled: `x' = decay x + drive w`, `w` standard normal.
#[derive(Clone, Copy, Debug)]
struct GaussMarkov {
    decay: f64,
    drive: f64,
    value: f64,
}

impl GaussMarkov {
    fn stationary(sigma: f64, correlation_samples: f64, stream: &mut RandomStream) -> Self {
        let decay = libm::exp(-1.0 / correlation_samples);
        let drive = sigma * (-libm::expm1(-2.0 / correlation_samples)).sqrt();
        let value = sigma * stream.sample::<f64, _>(StandardNormal);
        Self { decay, drive, value }
    }

    fn step(&mut self, stream: &mut RandomStream) -> f64 {
        let value = self.value;
        self.value = self.decay * value + self.drive * stream.sample::<f64, _>(StandardNormal);
        value
    }
}

/// White noise of three channels, row by row.
pub fn white(noise_density: f64, rate: f64, samples: usize, stream: &mut RandomStream) -> Vec<[f64; 3]> {
    let sigma = white_sigma(noise_density, rate);
    let mut draw = || sigma * stream.sample::<f64, _>(StandardNormal);
    (0..samples).map(|_| [draw(), draw(), draw()]).collect()
}

/// Bias instability `b` (unit of the channel) of one channel, stationary from its first sample on.
///
/// The spectrum holds from a fraction of `1 / duration` up to about `rate / 25`, the Allan deviation from some hundred
/// samples on. Slower processes than the recording is long are part of it: nothing is subtracted, and the mean over the
/// recording is not zero.
pub fn flicker(b: f64, samples: usize, stream: &mut RandomStream) -> Vec<f64> {
    let mut series = vec![0.0; samples];
    for tau in correlation_samples(samples) {
        let mut process = GaussMarkov::stationary(process_sigma(b), tau, stream);
        series.iter_mut().for_each(|value| *value += process.step(stream));
    }
    series
}

fn process_sigma(b: f64) -> f64 {
    b * (libm::log(RATIO) / core::f64::consts::PI).sqrt()
}

/// Correlation times in samples, the last one at or beyond `LONGEST` recordings.
fn correlation_samples(samples: usize) -> impl Iterator<Item = f64> {
    let longest = LONGEST * samples as f64;
    let beyond = move |tau: &f64| *tau < RATIO * longest.max(SHORTEST);
    core::iter::successors(Some(SHORTEST), |tau| Some(RATIO * tau)).take_while(beyond)
}

#[cfg(test)]
mod tests {
    use tumble_core::noise::ALLAN_FLOOR;

    use super::*;
    use crate::simulate::stream::{StreamPurpose, stream};

    const SEED: u64 = 20_240_611;

    /// Overlapping Allan variance at `m` samples.
    fn allan_variance(y: &[f64], m: usize) -> f64 {
        let mut sums = vec![0.0];
        for value in y {
            sums.push(sums[sums.len() - 1] + value);
        }
        let terms = y.len() + 1 - 2 * m;
        let squares = (0..terms)
            .map(|i| (sums[i + 2 * m] - 2.0 * sums[i + m] + sums[i]).powi(2))
            .sum::<f64>();
        squares / (2.0 * (m * m) as f64 * terms as f64)
    }

    /// Flicker noise with B = 1.
    fn drawn(run: u64, samples: usize) -> Vec<f64> {
        let mut random = stream(SEED, run, StreamPurpose::GyroscopeFlicker);
        flicker(1.0, samples, &mut random)
    }

    /// Allan variance of the sum of processes, from their autocovariance.
    fn expected_allan_variance(samples: usize, m: usize) -> f64 {
        let variance_of_sum = |decay: f64, length: usize| {
            let n = length as f64;
            (1..length)
                .map(|lag| 2.0 * (n - lag as f64) * decay.powi(lag as i32))
                .sum::<f64>()
                + n
        };
        correlation_samples(samples)
            .map(|tau| {
                let decay = (-1.0 / tau).exp();
                // var(second half - first half) = 4 var(half) - var(whole)
                let difference = 4.0 * variance_of_sum(decay, m) - variance_of_sum(decay, 2 * m);
                process_sigma(1.0).powi(2) * difference / (2.0 * (m * m) as f64)
            })
            .sum()
    }

    #[test]
    fn the_allan_floor_is_the_root_of_two_ln_two_over_pi() {
        let exact = (2.0 * core::f64::consts::LN_2 / core::f64::consts::PI).sqrt();
        assert!((ALLAN_FLOOR - exact).abs() < 1e-15);
        assert!((process_sigma(1.0) - ALLAN_FLOOR).abs() < 1e-15);
    }

    #[test]
    fn flicker_processes_keep_the_allan_floor_within_one_percent() {
        for m in [256, 1024, 4096, 8192] {
            let deviation = expected_allan_variance(20_000, m).sqrt();
            assert!((deviation / ALLAN_FLOOR - 1.0).abs() < 0.01, "m {m}: {deviation}");
        }
    }

    #[test]
    fn drawn_flicker_noise_has_the_allan_variance_of_its_law() {
        println!("seed {SEED}");
        let (samples, runs) = (20_000, 60);
        let records: Vec<Vec<f64>> = (0..runs).map(|run| drawn(run, samples)).collect();
        for m in [1, 8, 64, 512, 4096] {
            let found: Vec<f64> = records.iter().map(|y| allan_variance(y, m)).collect();
            let mean = found.iter().sum::<f64>() / runs as f64;
            let scatter = found.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (runs - 1) as f64;
            let sigma = (scatter / runs as f64).sqrt();
            let expected = expected_allan_variance(samples, m);
            assert!(
                (mean - expected).abs() < 4.0 * sigma,
                "m {m}: {mean} +- {sigma}, expected {expected}"
            );
            assert!(
                sigma < 0.1 * expected,
                "m {m}: {sigma} is too wide to show anything"
            );
        }
    }

    #[test]
    fn flicker_noise_is_stationary_from_its_first_sample() {
        println!("seed {SEED}");
        let (samples, runs) = (200, 4000);
        let (mut first, mut last) = (0.0, 0.0);
        for y in (0..runs).map(|run| drawn(run, samples)) {
            first += y[0].powi(2) / runs as f64;
            last += y[samples - 1].powi(2) / runs as f64;
        }
        let expected = correlation_samples(samples).count() as f64 * process_sigma(1.0).powi(2);
        let bound = 4.0 * expected * (2.0 / runs as f64).sqrt();
        assert!((first - expected).abs() < bound, "{first} {expected}");
        assert!((last - expected).abs() < bound, "{last} {expected}");
    }

    #[test]
    fn correlation_times_reach_well_beyond_the_recording() {
        let times: Vec<f64> = correlation_samples(10_000).collect();
        assert_eq!(times[0], 4.0);
        assert!(times[times.len() - 1] >= 40_000.0);
    }

    #[test]
    fn white_noise_scatters_by_density_and_rate_without_memory() {
        let count = 50_000;
        let rows = white(
            2e-3,
            100.0,
            count,
            &mut stream(SEED, 1, StreamPurpose::AccelerometerWhite),
        );
        let numbers = 3.0 * count as f64;
        let variance = rows.iter().flatten().map(|v| v * v).sum::<f64>() / numbers;
        let product = |pair: &[[f64; 3]]| (0..3).map(|i| pair[0][i] * pair[1][i]).sum::<f64>();
        let covariance = rows.windows(2).map(product).sum::<f64>() / numbers;
        let expected = 2e-3_f64.powi(2) * 100.0;
        assert!((variance / expected - 1.0).abs() < 4.0 * (2.0 / numbers).sqrt());
        assert!((covariance / expected).abs() < 4.0 / numbers.sqrt());
    }
}
