//! Robust least squares over rows of three, whose covariance comes from the residuals of whole blocks of time.

use nalgebra::{Cholesky, Const, SMatrix, SVector, Vector3};

use crate::distributions::median;

/// Residuals of so many sigmas count half: what is worse than noise counts the less the worse it is.
const HALF_WEIGHT: f64 = 4.0;

/// Median length of three independent standard normal numbers.
const MEDIAN_LENGTH: f64 = 1.538_172;

/// Residuals are never taken to be smaller than this, in the unit of the rows: data without noise.
const SMALLEST_SCALE: f64 = 1e-9;

/// Model derivative by the unknowns, and residual.
pub type ResidualRow<const N: usize> = (SMatrix<f64, 3, N>, Vector3<f64>);

/// Prior of the unknowns, besides the rows.
#[derive(Clone, Copy, Debug)]
pub struct GaussianPrior<const N: usize> {
    /// Inverse covariance.
    pub precision: SMatrix<f64, N, N>,
    /// Prior value minus present value.
    pub missing: SVector<f64, N>,
}

/// Where a round of Gauss and Newton leads.
#[derive(Clone, Copy, Debug)]
pub struct GaussNewtonStep<const N: usize> {
    /// To be added to the unknowns.
    pub change: SVector<f64, N>,
    /// 1-sigma of a component of a residual that is noise.
    pub scale: f64,
    /// Minus twice the logarithm of the likelihood, but for a constant.
    pub deviance: f64,
}

/// 1-sigma of a component of vectors of which less than half are outliers.
pub fn scale_of(vectors: impl Iterator<Item = Vector3<f64>>) -> f64 {
    let mut lengths: Vec<f64> = vectors.map(|vector| vector.norm()).collect();
    (median(&mut lengths).unwrap_or(0.0) / MEDIAN_LENGTH).max(SMALLEST_SCALE)
}

/// Weight of a residual of so many sigmas, squared (docs/theory/align.md, eq. 8).
pub fn weight(squared: f64) -> f64 {
    1.0 / (1.0 + squared / (HALF_WEIGHT * HALF_WEIGHT)) // eq. 8
}

/// One round of Gauss and Newton; `None` where the rows are not finite.
pub fn step<const N: usize>(
    count: usize,
    row: impl Fn(usize) -> ResidualRow<N>,
    prior: &GaussianPrior<N>,
) -> Option<GaussNewtonStep<N>> {
    let scale = scale_of((0..count).map(|k| row(k).1));
    let mut normal = prior.precision;
    let mut right = prior.precision * prior.missing;
    let mut loss = 0.0;
    for k in 0..count {
        let (design, residual) = row(k);
        let squared = residual.norm_squared() / (scale * scale);
        let weight = weight(squared) / (scale * scale);
        normal += design.tr_mul(&design) * weight; // eq. 7
        right += design.tr_mul(&residual) * weight; // eq. 7
        loss += HALF_WEIGHT * HALF_WEIGHT * (squared / (HALF_WEIGHT * HALF_WEIGHT)).ln_1p();
    }
    let change = Cholesky::new(normal)?.solve(&right); // eq. 7
    #[allow(clippy::cast_precision_loss)]
    let deviance = loss + 6.0 * count as f64 * scale.ln();
    change
        .iter()
        .all(|value| value.is_finite())
        .then_some(GaussNewtonStep {
            change,
            scale,
            deviance,
        })
}

/// Covariance of the solution: its change as each block in turn is left out (docs/theory/align.md, eq. 9), and the
/// share that the priors leave open. `block` gives the block of each row, ascending.
pub fn covariance<const N: usize>(
    count: usize,
    row: impl Fn(usize) -> ResidualRow<N>,
    block: impl Fn(usize) -> usize,
    scale: f64,
    prior: &GaussianPrior<N>,
) -> Option<SMatrix<f64, N, N>> {
    let mut blocks: Vec<(usize, SMatrix<f64, N, N>, SVector<f64, N>)> = Vec::new();
    for k in 0..count {
        let (design, residual) = row(k);
        let squared = residual.norm_squared() / (scale * scale);
        let weight = weight(squared);
        // Derivative of the weighted residual, in the mean over its directions.
        let stiffness = weight - 2.0 / 3.0 * weight * weight * squared / (HALF_WEIGHT * HALF_WEIGHT);
        if blocks.last().is_none_or(|(number, ..)| *number != block(k)) {
            blocks.push((block(k), SMatrix::zeros(), SVector::zeros()));
        }
        if let Some((_, normal, score)) = blocks.last_mut() {
            *normal += design.tr_mul(&design) * (stiffness / (scale * scale));
            *score += design.tr_mul(&residual) * (weight / (scale * scale));
        }
    }
    let normal = blocks.iter().fold(prior.precision, |sum, block| sum + block.1);
    let inverse = Cholesky::<f64, Const<N>>::new(normal)?.inverse();
    #[allow(clippy::cast_precision_loss)]
    let share = (blocks.len() as f64 - 1.0) / blocks.len() as f64;
    let mut covariance = inverse * prior.precision * inverse; // eq. 9
    for (_, without, score) in &blocks {
        // A block without which nothing could be solved keeps the influence it has beside the others.
        let change =
            Cholesky::new(normal - without).map_or_else(|| inverse * score, |rest| rest.solve(score));
        covariance += change * change.transpose() * share; // eq. 9
    }
    Some(covariance)
}

/// Covariance due to unknowns that are not fitted (docs/theory/align.md, eq. 10): `neglected` is the derivative of the
/// model by them, `sigma` their standard deviation.
pub fn covariance_of_neglected<const N: usize, const K: usize>(
    count: usize,
    row: impl Fn(usize) -> ResidualRow<N>,
    neglected: impl Fn(usize) -> SMatrix<f64, 3, K>,
    scale: f64,
    prior: &GaussianPrior<N>,
    sigma: &SVector<f64, K>,
) -> Option<SMatrix<f64, N, N>> {
    let mut normal = prior.precision;
    let mut cross = SMatrix::<f64, N, K>::zeros();
    for k in 0..count {
        let (design, residual) = row(k);
        let share = weight(residual.norm_squared() / (scale * scale)) / (scale * scale);
        normal += design.tr_mul(&design) * share; // eq. 10
        cross += design.tr_mul(&neglected(k)) * share; // eq. 10
    }
    let influence = Cholesky::<f64, Const<N>>::new(normal)?.solve(&cross); // eq. 10: B
    let open = SMatrix::from_diagonal(&sigma.map(|sigma| sigma * sigma));
    Some(influence * open * influence.transpose()) // eq. 10
}
