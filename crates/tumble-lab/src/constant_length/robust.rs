//! Loss function in which a few corrupt rests or turns do not dominate (Huber 1964).

use crate::distributions::{chi_square_quantile, median};

/// Where the loss turns from square to linear, in units of the scatter: noise alone loses a hundredth of its efficiency.
const THRESHOLD: f64 = 2.5;

/// Weights of residuals in units of their sigma, `unknowns` of which were fitted; one where nothing stands out
/// (docs/theory/multipose.md, eq. 5). Each is the root mean square of so many `components`.
pub fn weights(normalised: &[f64], unknowns: usize, components: usize) -> Vec<f64> {
    let threshold = THRESHOLD * scatter(normalised, unknowns, components);
    normalised
        .iter()
        .map(|z| (threshold / z.abs()).min(1.0))
        .collect() // eq. 5
}

/// By how much residuals scatter beyond their sigma, never below one.
pub fn scatter(normalised: &[f64], unknowns: usize, components: usize) -> f64 {
    let mut sizes: Vec<f64> = normalised.iter().map(|z| z.abs()).collect();
    let usual = median(&mut sizes).unwrap_or(0.0);
    #[allow(clippy::cast_precision_loss)]
    let freedom = sizes.len() as f64 / (sizes.len().saturating_sub(unknowns)).max(1) as f64;
    #[allow(clippy::cast_precision_loss)]
    let components = components as f64;
    let usual_of_noise = (chi_square_quantile(0.5, components) / components).sqrt();
    (usual / usual_of_noise * freedom.sqrt()).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_alike_only_the_one_that_stands_out_weighs_less() {
        let mut normalised = vec![0.9; 20];
        normalised.push(60.0);
        let found = weights(&normalised, 9, 1);
        assert!(found[..20].iter().all(|weight| *weight == 1.0));
        assert!(found[20] < 0.1, "{}", found[20]);
    }
}
