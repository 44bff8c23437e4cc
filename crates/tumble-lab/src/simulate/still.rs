//! Noise of a channel of a sensor that stands still, of known terms, sample by sample.
//!
//! A sample is the mean over its interval, as of a sensor that integrates, so that the Allan variance of each term is
//! that of theory at every averaging time: white noise, random walk, quantisation and ramp exactly, bias instability
//! within 0.5 % from averages of four samples on. It is made of first-order Gauss-Markov processes as in
//! [`crate::simulate::noise`], here each averaged over the interval, from a sixteenth of a sample on: what is faster is
//! missing, 4 % of the variance of bias instability between single samples, where white noise stands above it.

use rand::RngExt;
use rand_distr::StandardNormal;

use crate::noise::term::{NoiseTerm, TERMS};
use crate::simulate::stream::{RandomStream, StreamPurpose, stream};

/// Ratio of neighbouring correlation times.
const RATIO: f64 = 4.0;
/// Shortest correlation time, samples.
const SHORTEST: f64 = 1.0 / 16.0;
/// Longest correlation time at least, in lengths of the record.
const LONGEST: f64 = 4.0;
/// Samples per correlation time from which on series are more accurate than differences of exponentials.
const SLOW: f64 = 1e-3;

/// A first-order Gauss-Markov process and its mean over each sample.
#[derive(Clone, Copy, Debug)]
struct AveragedGaussMarkov {
    decay: f64,
    /// Share of the value at the start of a sample in its mean.
    held: f64,
    drive: f64,
    mean_with_drive: f64,
    mean_alone: f64,
    value: f64,
}

impl AveragedGaussMarkov {
    fn stationary(sigma: f64, correlation_samples: f64, random: &mut RandomStream) -> Self {
        let a = 1.0 / correlation_samples;
        let lost = -libm::expm1(-a);
        let lost_squared = -libm::expm1(-2.0 * a);
        // Variance of the mean and its covariance with the value at the end, from what happens within the sample:
        // integrals of (1 - e^-av)^2 / a^2 and of e^-av (1 - e^-av) / a over v from 0 to 1.
        let (of_mean, of_both) = if a < SLOW {
            (
                1.0 / 3.0 - a / 4.0 + 7.0 * a * a / 60.0,
                0.5 - 0.5 * a + 7.0 * a * a / 24.0,
            )
        } else {
            let twice = lost_squared / (2.0 * a);
            ((1.0 - 2.0 * lost / a + twice) / (a * a), (lost / a - twice) / a)
        };
        let drive = sigma * lost_squared.sqrt();
        let covariance = 2.0 * sigma * sigma * a * of_both;
        let mean_with_drive = covariance / drive;
        let alone = 2.0 * sigma * sigma * a * of_mean - mean_with_drive * mean_with_drive;
        Self {
            decay: libm::exp(-a),
            held: lost / a,
            drive,
            mean_with_drive,
            mean_alone: alone.max(0.0).sqrt(),
            value: sigma * normal(random),
        }
    }

    fn step(&mut self, random: &mut RandomStream) -> f64 {
        let (drive, alone) = (normal(random), normal(random));
        let mean = self.held * self.value + self.mean_with_drive * drive + self.mean_alone * alone;
        self.value = self.decay * self.value + self.drive * drive;
        mean
    }
}

fn normal(random: &mut RandomStream) -> f64 {
    random.sample(StandardNormal)
}

/// One channel.
#[derive(Clone, Debug)]
pub struct StillChannel {
    random: RandomStream,
    white: f64,
    flicker: Vec<AveragedGaussMarkov>,
    walk: f64,
    walk_step: f64,
    rounding: f64,
    rounding_step: f64,
    ramp: f64,
    samples: f64,
}

impl StillChannel {
    /// `channel` of a record of that many samples at `rate`, Hz, with the coefficient of each term in the units of the
    /// field.
    pub fn new(seed: u64, channel: u64, coefficients: [f64; TERMS], rate: f64, samples: usize) -> Self {
        let mut random = stream(seed, channel, StreamPurpose::StillNoise);
        let interval = 1.0 / rate;
        let of = |term: NoiseTerm| term.strength(coefficients[term as usize], interval).sqrt();
        let sigma = of(NoiseTerm::BiasInstability) * (libm::log(RATIO) / core::f64::consts::PI).sqrt();
        let beyond = LONGEST * RATIO * samples as f64;
        let times =
            core::iter::successors(Some(SHORTEST), |tau| Some(RATIO * tau)).take_while(|tau| *tau < beyond);
        let flicker = if sigma > 0.0 {
            times
                .map(|tau| AveragedGaussMarkov::stationary(sigma, tau, &mut random))
                .collect()
        } else {
            Vec::new()
        };
        let rounding_step = of(NoiseTerm::Quantisation) * 12f64.sqrt();
        Self {
            white: of(NoiseTerm::White),
            flicker,
            walk: 0.0,
            walk_step: of(NoiseTerm::RandomWalk),
            rounding: rounding_step * (random.random::<f64>() - 0.5),
            rounding_step,
            ramp: of(NoiseTerm::Ramp),
            samples: 0.0,
            random,
        }
    }

    /// The next sample.
    pub fn step(&mut self) -> f64 {
        let mut sample = self.ramp * (self.samples + 0.5) + self.white * normal(&mut self.random);
        self.samples += 1.0;
        for process in &mut self.flicker {
            sample += process.step(&mut self.random);
        }
        if self.walk_step > 0.0 {
            // Brownian motion and its mean over a sample: variance 1 and 1/3, covariance 1/2.
            let (end, within) = (normal(&mut self.random), normal(&mut self.random));
            sample += self.walk + self.walk_step * (0.5 * end + within / 12f64.sqrt());
            self.walk += self.walk_step * end;
        }
        if self.rounding_step > 0.0 {
            let next = self.rounding_step * (self.random.random::<f64>() - 0.5);
            sample += next - self.rounding;
            self.rounding = next;
        }
        sample
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::deviation::Deviations;
    use crate::noise::lowpass::LowPass;
    use crate::noise::variance_kind::VarianceKind;

    #[test]
    fn each_term_has_the_allan_variance_of_theory() {
        let (seed, samples, runs) = (20_261_122, 4096, 60);
        println!("seed {seed}");
        for term in NoiseTerm::ALL {
            let mut coefficients = [0.0; TERMS];
            coefficients[*term as usize] = 0.7;
            let (rate, mut found) = (50.0, Vec::new());
            for run in 0..runs {
                let mut channel = StillChannel::new(seed, run, coefficients, rate, samples);
                let mut deviations = Deviations::new(&[VarianceKind::Allan]);
                deviations.push((0..samples).map(|_| channel.step()));
                deviations.end_stretch();
                found.push(deviations.variances(VarianceKind::Allan));
            }
            let shortest = if *term == NoiseTerm::BiasInstability { 4 } else { 1 };
            for place in (0..found[0].len()).filter(|i| (shortest..=256).contains(&found[0][*i].samples)) {
                let each: Vec<f64> = found.iter().map(|variances| variances[place].variance).collect();
                let mean = each.iter().sum::<f64>() / runs as f64;
                let scatter = each.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (runs - 1) as f64;
                let sigma = (scatter / runs as f64).sqrt();
                let samples = found[0][place].samples as f64;
                let expected =
                    term.strength(0.7, 1.0 / rate) * term.allan_variance(samples, &LowPass::default());
                let off = (mean - expected).abs();
                assert!(
                    off < 4.5 * sigma + 4e-3 * expected,
                    "{} at {samples}: {mean} +- {sigma}, expected {expected}",
                    term.name()
                );
                assert!(sigma < 0.1 * expected, "{} at {samples}: {sigma}", term.name());
            }
        }
    }
}
