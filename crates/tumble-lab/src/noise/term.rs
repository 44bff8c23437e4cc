//! Terms of noise, each with its own slope against averaging time.
//!
//! Lengths are in samples and strengths are squared coefficients at one sample a second; [`NoiseTerm::coefficient`] leads to
//! the units of the field.

use std::f64::consts::{LN_2, PI};

use super::lowpass::LowPass;
use super::variance_kind::VarianceKind;

tumble_core::vocabulary! {
    /// A term of noise, as IEEE Std 952-1997, annex C, has it.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum NoiseTerm {
        /// Q: rounding of the integral of the channel.
        Quantisation = "quantisation",
        /// N: angle or velocity random walk.
        White = "white noise",
        /// B: flicker, with an Allan deviation of 0.664 B.
        BiasInstability = "bias instability",
        /// K: rate or acceleration random walk.
        RandomWalk = "random walk",
        /// R: a steady drift.
        Ramp = "ramp",
    }
}

/// Number of terms.
pub const TERMS: usize = NoiseTerm::ALL.len();
/// Those that are chance; a ramp is not.
pub(super) const RANDOM: usize = TERMS - 1;

impl NoiseTerm {
    /// Allan variance of strength one at an averaging time of that many samples; white noise is `filtered`.
    pub fn allan_variance(self, samples: f64, filtered: &LowPass) -> f64 {
        match self {
            Self::Quantisation => 3.0 / (samples * samples), // eq. 20
            Self::White => filtered.allan_variance(samples), // eq. 20, 29
            Self::BiasInstability => 2.0 * LN_2 / PI,        // eq. 20
            Self::RandomWalk => samples / 3.0,               // eq. 20
            Self::Ramp => samples * samples / 2.0,           // eq. 20
        }
    }

    /// Coefficient in the units of the field of that strength, at an interval between samples, s.
    pub fn coefficient(self, strength: f64, interval: f64) -> f64 {
        (strength * interval.powi(self.power())).sqrt()
    }

    /// Strength of that coefficient.
    pub fn strength(self, coefficient: f64, interval: f64) -> f64 {
        coefficient * coefficient / interval.powi(self.power())
    }

    /// Power of time in the square of the coefficient.
    fn power(self) -> i32 {
        match self {
            Self::Quantisation => 2,
            Self::White => 1,
            Self::BiasInstability => 0,
            Self::RandomWalk => -1,
            Self::Ramp => -2,
        }
    }
}

/// Generalised autocovariances at a lag, of the sums that differences of a kind are formed of, for each random term of
/// strength one (docs/theory/noise.md, eq. 21). White noise is `filtered`; twice summed, for the modified variance, it
/// is taken as it is without a filter.
pub(super) fn autocovariances(kind: VarianceKind, lag: f64, filtered: &LowPass) -> [f64; RANDOM] {
    let t = lag.abs();
    let log = if t > 0.0 { t.ln() } else { 0.0 };
    match kind {
        VarianceKind::Allan | VarianceKind::Hadamard => [
            if t < 0.5 { 1.0 } else { 0.0 },
            -0.5 * filtered.of_sum(t),
            t * t * log / (2.0 * PI),
            t.powi(3) / 12.0,
        ],
        VarianceKind::Modified => [
            -0.5 * t,
            t.powi(3) / 12.0,
            -t.powi(4) * log / (24.0 * PI),
            -t.powi(5) / 240.0,
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_and_strengths_are_inverse() {
        for term in NoiseTerm::ALL {
            let coefficient = term.coefficient(term.strength(0.3, 0.01), 0.01);
            assert!((coefficient - 0.3).abs() < 1e-15);
        }
    }

    #[test]
    fn the_allan_variance_of_each_term_follows_its_autocovariance() {
        for samples in [1.0, 7.0, 640.0] {
            let white = LowPass::default();
            let at = |lag| autocovariances(VarianceKind::Allan, lag, &white);
            let (zero, one, two) = (at(0.0), at(samples), at(2.0 * samples));
            for (k, term) in NoiseTerm::ALL.iter().take(RANDOM).enumerate() {
                let squared = 6.0 * zero[k] - 8.0 * one[k] + 2.0 * two[k];
                let expected = term.allan_variance(samples, &white);
                assert!(
                    (squared / (2.0 * samples * samples) / expected - 1.0).abs() < 1e-9,
                    "{}",
                    term.name()
                );
            }
        }
    }
}
