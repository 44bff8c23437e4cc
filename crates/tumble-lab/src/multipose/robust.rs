//! Loss function in which a few corrupt rests or turns do not dominate (Huber 1964).

use crate::distributions::median;

/// Where the loss turns from square to linear, in units of the scatter: noise alone loses a hundredth of its efficiency.
const THRESHOLD: f64 = 2.5;

/// A median of absolute normal deviates in units of sigma.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_75;

/// Weights of residuals in units of their sigma, `unknowns` of which were fitted; one where nothing stands out
/// (docs/theory/multipose.md, eq. 5).
pub(super) fn weights(normalised: &[f64], unknowns: usize) -> Vec<f64> {
    let threshold = THRESHOLD * scatter(normalised, unknowns);
    normalised
        .iter()
        .map(|z| (threshold / z.abs()).min(1.0))
        .collect() // eq. 5
}

/// By how much residuals scatter beyond their sigma, never below one.
fn scatter(normalised: &[f64], unknowns: usize) -> f64 {
    let mut sizes: Vec<f64> = normalised.iter().map(|z| z.abs()).collect();
    let usual = median(&mut sizes).unwrap_or(0.0);
    #[allow(clippy::cast_precision_loss)]
    let freedom = sizes.len() as f64 / (sizes.len().saturating_sub(unknowns)).max(1) as f64;
    (usual / MEDIAN_OF_NORMAL * freedom.sqrt()).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_alike_only_the_one_that_stands_out_weighs_less() {
        let mut normalised = vec![0.9; 20];
        normalised.push(60.0);
        let found = weights(&normalised, 9);
        assert!(found[..20].iter().all(|weight| *weight == 1.0));
        assert!(found[20] < 0.1, "{}", found[20]);
    }
}
