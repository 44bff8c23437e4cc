//! Quantiles of a skewed distribution: that of a chi-square, shifted and scaled.

/// Quantile, in sigmas from the mean, that belongs to the normal quantile `z` where the skewness is not zero: Wilson
/// and Hilferty, "The distribution of chi-square", PNAS 17 (1931).
pub(super) fn quantile(z: f64, skewness: f64) -> f64 {
    if skewness.abs() < 1e-6 {
        return z;
    }
    let sixth = skewness / 6.0;
    let cube = (1.0 + sixth * (z - sixth)).max(0.0).powi(3);
    (cube - 1.0) * 2.0 / skewness
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distributions::{INTERVAL, chi_square_quantile};

    #[test]
    fn quantiles_are_those_of_chi_square() {
        for freedom in [4.0_f64, 10.0, 40.0] {
            for (z, tail) in [(INTERVAL, 0.025), (-INTERVAL, 0.975)] {
                let exact = (chi_square_quantile(tail, freedom) - freedom) / (2.0 * freedom).sqrt();
                assert!(
                    (quantile(z, (8.0 / freedom).sqrt()) - exact).abs() < 0.02,
                    "{freedom} {z}"
                );
            }
        }
    }
}
