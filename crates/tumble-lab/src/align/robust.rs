//! Robust least squares over rows of three, whose covariance comes from the residuals of whole blocks of time.

use nalgebra::{Cholesky, Const, SMatrix, SVector, Vector3};

use crate::distributions::{chi_square_tail, median};

/// Residuals of so many sigmas count half: what is worse than noise counts the less the worse it is.
const HALF_WEIGHT: f64 = 4.0;

/// Median length of three independent standard normal numbers.
const MEDIAN_LENGTH: f64 = 1.538_172;

/// Residuals are never taken to be smaller than this, in the unit of the rows: data without noise.
const SMALLEST_SCALE: f64 = 1e-9;

/// Information on a step, over all that there is on the unknown, below which its time is not tried. In the middle of an even
/// log it is a quarter, and a sixteenth for the offset beside a skew.
const INFORMATION: f64 = 0.03;

/// Chance of a step where there is none, in a whole log.
const BY_CHANCE: f64 = 1e-2;

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

/// Share of one block of time in the normal equations.
struct BlockShare<const N: usize> {
    number: usize,
    normal: SMatrix<f64, N, N>,
    score: SVector<f64, N>,
}

fn blocks<const N: usize>(
    count: usize,
    row: impl Fn(usize) -> ResidualRow<N>,
    block: impl Fn(usize) -> usize,
    scale: f64,
) -> Vec<BlockShare<N>> {
    let mut blocks: Vec<BlockShare<N>> = Vec::new();
    for k in 0..count {
        let (design, residual) = row(k);
        let squared = residual.norm_squared() / (scale * scale);
        let weight = weight(squared);
        // Derivative of the weighted residual, in the mean over its directions.
        let stiffness = weight - 2.0 / 3.0 * weight * weight * squared / (HALF_WEIGHT * HALF_WEIGHT);
        let number = block(k);
        if blocks.last().is_none_or(|last| last.number != number) {
            let (normal, score) = (SMatrix::zeros(), SVector::zeros());
            blocks.push(BlockShare {
                number,
                normal,
                score,
            });
        }
        if let Some(last) = blocks.last_mut() {
            last.normal += design.tr_mul(&design) * (stiffness / (scale * scale));
            last.score += design.tr_mul(&residual) * (weight / (scale * scale));
        }
    }
    blocks
}

/// Unknowns that take other values from some block on.
#[derive(Clone, Copy, Debug)]
pub struct UnknownStep<const M: usize> {
    /// Number of the first block that has the later values.
    pub block: usize,
    /// Later values less those before.
    pub size: SVector<f64, M>,
}

/// Covariance of a solution, and what its unknowns that ought to be constant did.
#[derive(Clone, Copy, Debug)]
pub struct RobustCovariance<const N: usize, const M: usize> {
    /// Covariance, the step included.
    pub covariance: SMatrix<f64, N, N>,
    /// Step of those unknowns, where chance explains none of it.
    pub step: Option<UnknownStep<M>>,
}

/// Covariance of the solution: its change as each block in turn is left out (docs/theory/align.md, eq. 9), and the
/// share that the priors leave open. `block` gives the block of each row, ascending. It grows where the unknowns
/// `constant` took a step (eq. 11).
pub fn covariance<const N: usize, const M: usize>(
    count: usize,
    row: impl Fn(usize) -> ResidualRow<N>,
    block: impl Fn(usize) -> usize,
    scale: f64,
    prior: &GaussianPrior<N>,
    constant: [usize; M],
) -> Option<RobustCovariance<N, M>> {
    let blocks = blocks(count, row, block, scale);
    let normal = blocks
        .iter()
        .fold(prior.precision, |sum, block| sum + block.normal);
    let inverse = Cholesky::<f64, Const<N>>::new(normal)?.inverse();
    #[allow(clippy::cast_precision_loss)]
    let share = (blocks.len() as f64 - 1.0) / blocks.len() as f64;
    let mut covariance = inverse * prior.precision * inverse; // eq. 9
    for block in &blocks {
        // A block without which nothing could be solved keeps the influence it has beside the others.
        let change = Cholesky::new(normal - block.normal)
            .map_or_else(|| inverse * block.score, |rest| rest.solve(&block.score));
        covariance += change * change.transpose() * share; // eq. 9
    }
    let found = largest_step(&blocks, &inverse, constant);
    if let Some((step, pulled)) = &found {
        // The error before the step is what it pulls, that after it is less by the step.
        let mut after = *pulled;
        for (place, unknown) in constant.into_iter().enumerate() {
            after[unknown] -= step.size[place];
        }
        covariance += (pulled * pulled.transpose() + after * after.transpose()) * 0.5; // eq. 11
    }
    Some(RobustCovariance {
        covariance,
        step: found.map(|(step, _)| step),
    })
}

/// Finds the step, and what it does to the solution, that explains most of the scores, if chance does not explain it
/// (docs/theory/align.md, eq. 10).
fn largest_step<const N: usize, const M: usize>(
    blocks: &[BlockShare<N>],
    inverse: &SMatrix<f64, N, N>,
    constant: [usize; M],
) -> Option<(UnknownStep<M>, SVector<f64, N>)> {
    #[allow(clippy::cast_precision_loss)]
    let (tried, freedom) = (blocks.len() as f64, M as f64);
    let own = |score: &SVector<f64, N>| SVector::<f64, M>::from_fn(|j, _| score[constant[j]]);
    let mut later: SMatrix<f64, N, N> = blocks.iter().map(|block| block.normal).sum();
    let mut score: SVector<f64, M> = blocks.iter().map(|block| own(&block.score)).sum();
    let all = SMatrix::<f64, M, M>::from_fn(|i, j| later[(constant[i], constant[j])]);
    let mut best: Option<(f64, UnknownStep<M>, SVector<f64, N>)> = None;
    for split in 1..blocks.len() {
        later -= blocks[split - 1].normal;
        score -= own(&blocks[split - 1].score);
        let columns = SMatrix::<f64, N, M>::from_fn(|i, j| later[(i, constant[j])]);
        let influence = inverse * columns; // eq. 10: B
        let information =
            SMatrix::<f64, M, M>::from_fn(|i, j| columns[(constant[i], j)]) - columns.tr_mul(&influence);
        // Less in any direction: what follows would be amplified noise.
        if Cholesky::<f64, Const<M>>::new(information - all * INFORMATION).is_none() {
            continue;
        }
        let inverted =
            |matrix: SMatrix<f64, M, M>| Cholesky::<f64, Const<M>>::new(matrix).map(|found| found.inverse());
        let Some(solved) = inverted(information) else {
            continue;
        };
        let size = solved * score; // eq. 10: delta
        let mut design = -influence;
        let mut scatter = SMatrix::<f64, M, M>::zeros();
        for (k, block) in blocks.iter().enumerate() {
            if k == split {
                (0..M).for_each(|j| design[(constant[j], j)] += 1.0);
            }
            let effective = design.tr_mul(&block.score); // eq. 10: e
            scatter += effective * effective.transpose();
        }
        let Some(scattered) = inverted(scatter) else {
            continue;
        };
        let share = score.dot(&(scattered * score)) / tried; // eq. 10: lambda / G
        let statistic = -(tried - 0.5 * (freedom + 1.0)) * (-share).ln_1p(); // eq. 10
        if statistic.is_finite() && best.as_ref().is_none_or(|(most, ..)| statistic > *most) {
            let block = blocks[split].number;
            best = Some((statistic, UnknownStep { block, size }, influence * size));
        }
    }
    let (statistic, step, pulled) = best?;
    (tried * chi_square_tail(statistic, freedom) < BY_CHANCE).then_some((step, pulled))
}

/// Covariance due to noise that residuals share with the derivative by an unknown (docs/theory/align.md, eq. 20): `shared` is the
/// largest sum of the products of both in a row. Which unit has it is open, so that it may be anything from minus that to that.
pub fn covariance_of_shared_noise<const N: usize>(
    count: usize,
    row: impl Fn(usize) -> ResidualRow<N>,
    unknown: usize,
    shared: f64,
    scale: f64,
    prior: &GaussianPrior<N>,
) -> Option<SMatrix<f64, N, N>> {
    let mut normal = prior.precision;
    let mut right = SVector::<f64, N>::zeros();
    for k in 0..count {
        let (design, residual) = row(k);
        let share = weight(residual.norm_squared() / (scale * scale)) / (scale * scale);
        normal += design.tr_mul(&design) * share; // eq. 7
        right[unknown] += shared * share;
    }
    let pulled = Cholesky::<f64, Const<N>>::new(normal)?.solve(&right); // eq. 20
    Some(pulled * pulled.transpose() / 3.0) // eq. 20: variance of a uniform number
}

/// Covariance due to unknowns that are not fitted (docs/theory/align.md, eq. 12): `neglected` is the derivative of the
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
        normal += design.tr_mul(&design) * share; // eq. 12
        cross += design.tr_mul(&neglected(k)) * share; // eq. 12
    }
    let influence = Cholesky::<f64, Const<N>>::new(normal)?.solve(&cross); // eq. 12: B
    let open = SMatrix::from_diagonal(&sigma.map(|sigma| sigma * sigma));
    Some(influence * open * influence.transpose()) // eq. 12
}
