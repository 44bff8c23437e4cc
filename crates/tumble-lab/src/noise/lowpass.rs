//! White noise that a sensor's own filter passed: density one far below its bandwidth, less at short averages.
//!
//! Variances of sums of such samples follow from the impulse response (docs/theory/noise.md, eq. 28).

/// Time constants after which an impulse response is over.
const SUPPORT: f64 = 16.0;
/// Time constants tried, samples: from one that takes 0.7 % off the variance of samples, a factor apart.
const FIRST: f64 = 0.2;
const FACTOR: f64 = 1.3;
/// Shares of the white noise that the filter passes; the rest is added behind it, as rounding is.
const SHARES: [f64; 3] = [1.0, 0.9, 0.6];

/// Order of a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    First,
    /// Butterworth.
    Second,
}

/// White noise after a filter.
#[derive(Clone, Debug, PartialEq)]
pub struct LowPass {
    /// Time constant of the filter, samples; 0 for none.
    pub constant: f64,
    /// Variance of a sum of so many samples, less their number, from none on; the last of them stays.
    excess: Vec<f64>,
}

impl Default for LowPass {
    fn default() -> Self {
        Self {
            constant: 0.0,
            excess: vec![0.0],
        }
    }
}

impl LowPass {
    /// Filters of both orders, with time constants up to a longest, samples. One of the second order that swings within a sample
    /// is none of samples.
    pub fn candidates(longest: f64) -> Vec<Self> {
        let constants = std::iter::successors(Some(FIRST), |constant| Some(constant * FACTOR));
        constants
            .take_while(|constant| *constant <= longest)
            .flat_map(|constant| [Order::First, Order::Second].map(|order| (constant, order)))
            .flat_map(|(constant, order)| SHARES.map(|share| Self::new(constant, order, share)))
            .filter(|filter| filter.allan_variance(1.0) < 1.0)
            .collect()
    }

    fn new(constant: f64, order: Order, share: f64) -> Self {
        let response = impulse_response(constant, order);
        let n = response.len();
        let autocovariance: Vec<f64> = (0..n)
            .map(|lag| (0..n - lag).map(|k| response[k] * response[k + lag]).sum())
            .collect();
        let mut excess = vec![0.0];
        // The variance of a sum grows by the sum of all lags it spans.
        let (mut spanned, mut sum) = (autocovariance[0], 0.0);
        for samples in 1..=n {
            sum += spanned;
            excess.push(share * (sum - samples as f64));
            spanned += 2.0 * autocovariance.get(samples).copied().unwrap_or(0.0);
        }
        Self { constant, excess }
    }

    /// Variance of the sum of so many samples.
    pub(super) fn of_sum(&self, samples: f64) -> f64 {
        let place = samples.abs().round();
        let last = self.excess.len() - 1;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let place = if place < last as f64 { place as usize } else { last };
        samples.abs() + self.excess[place]
    }

    /// Allan variance at an averaging time, samples.
    pub(super) fn allan_variance(&self, samples: f64) -> f64 {
        (4.0 * self.of_sum(samples) - self.of_sum(2.0 * samples)) / (2.0 * samples * samples) // eq. 28
    }
}

/// Response to one sample, of sum one.
fn impulse_response(constant: f64, order: Order) -> Vec<f64> {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let length = (SUPPORT * constant).ceil() as usize + 2;
    let of_time = |k: usize| {
        let t = k as f64 / constant;
        match order {
            Order::First => (-t).exp(),
            Order::Second => {
                let (t, half) = ((k as f64 + 0.5) / constant, std::f64::consts::FRAC_1_SQRT_2);
                (-t * half).exp() * (t * half).sin()
            }
        }
    };
    let response: Vec<f64> = (0..length).map(of_time).collect();
    let sum: f64 = response.iter().sum();
    response.into_iter().map(|each| each / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_filter_noise_is_white() {
        for samples in [1.0, 5.0, 640.0] {
            assert_eq!(LowPass::default().of_sum(samples), samples);
            assert!((LowPass::default().allan_variance(samples) * samples - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_first_order_filter_gives_the_variance_of_its_closed_form() {
        let filter = LowPass::new(5.0, Order::First, 1.0);
        let decay = (-0.2_f64).exp();
        for n in [1.0, 2.0, 30.0, 60.0] {
            let whole = n - 2.0 * decay * (1.0 - decay.powf(n)) / (1.0 - decay * decay);
            assert!((filter.of_sum(n) - whole).abs() < 1e-4, "{n}");
        }
    }

    #[test]
    fn a_filter_takes_noise_from_short_averages_only() {
        for filter in LowPass::candidates(20.0) {
            assert!(filter.allan_variance(1.0) < 1.0, "{}", filter.constant);
            assert!((1e6 * filter.allan_variance(1e6) - 1.0).abs() < 1e-4);
        }
    }
}
