//! Least squares in rounds, in which weights settle (Huber 1964; docs/theory/multipose.md, eq. 5).

use nalgebra::DVector;

use super::levenberg_marquardt::{Linearised, minimise};
use super::robust;
use super::whitening::ResidualWhitening;

/// Rounds in which weights settle.
const ROUNDS: u32 = 6;

/// Readings, and residuals that they give to any unknowns.
pub trait Problem {
    /// Residuals and their derivative; `None` where they are not finite.
    fn linearised(&self, x: &DVector<f64>) -> Option<Linearised>;

    /// ResidualWhitening of the residuals, for a weight of each reading.
    fn whitening(&self, x: &DVector<f64>, weights: &[f64]) -> Option<ResidualWhitening>;

    /// Residual of each reading in units of its sigma: root mean square of its components.
    fn normalised(&self, x: &DVector<f64>) -> Option<Vec<f64>>;

    /// Components of the residual of a reading.
    fn components(&self) -> usize {
        1
    }
}

/// Fits the unknowns, and the weight of each reading; `None` where the problem gives nothing finite.
///
/// Residuals are whitened by their sigmas at the start of the round, so that a larger scale does not make them smaller.
pub fn solve(problem: &impl Problem, start: DVector<f64>, weights: &mut Vec<f64>) -> Option<DVector<f64>> {
    let mut x = start;
    for _ in 0..ROUNDS {
        let whitening = problem.whitening(&x, weights)?;
        let solved = minimise(x.clone(), |x| {
            let mut found = problem.linearised(x)?;
            whitening.apply(&mut found.jacobian);
            found.residuals = whitening.of(found.residuals);
            Some(found)
        });
        x = solved?.x;
        let normalised = problem.normalised(&x)?;
        let unknowns = x.len() / problem.components();
        let found = robust::weights(&normalised, unknowns, problem.components());
        let before = std::mem::replace(weights, found);
        let change = weights.iter().zip(&before).map(|(a, b)| (a - b).abs());
        if change.fold(0.0, f64::max) < 1e-6 {
            break;
        }
    }
    Some(x)
}
