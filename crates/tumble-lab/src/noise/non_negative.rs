//! Weighted least squares for a few strengths, none below zero.

use nalgebra::{DMatrix, DVector};

use super::chance::Strengths;
use super::term::TERMS;

/// Strengths of the terms listed that fit best, none below zero: the best of all subsets that need no bound.
///
/// `design` (n, all terms), `weight` (n): what a squared residual counts.
pub(super) fn non_negative(
    design: &DMatrix<f64>,
    y: &DVector<f64>,
    weight: &DVector<f64>,
    terms: &[usize],
) -> Strengths {
    let mut best = ([0.0; TERMS], f64::INFINITY);
    for subset in 1_u32..1 << terms.len() {
        let chosen: Vec<usize> = (0..terms.len())
            .filter(|k| subset >> k & 1 == 1)
            .map(|k| terms[k])
            .collect();
        if chosen.len() > y.len() {
            continue;
        }
        let Some(gain) = gain(design, weight, &chosen) else {
            continue;
        };
        let found = gain * y;
        if found.iter().any(|strength| *strength < 0.0) {
            continue;
        }
        let mut strengths = [0.0; TERMS];
        chosen
            .iter()
            .zip(found.iter())
            .for_each(|(k, strength)| strengths[*k] = *strength);
        let residual = y - design * DVector::from_row_slice(&strengths);
        let cost = residual.component_mul(&residual).dot(weight);
        if cost < best.1 {
            best = (strengths, cost);
        }
    }
    best.0
}

/// Gain from variances to strengths: `(A^T W A)^-1 A^T W` of the columns listed; None where they look alike.
pub(super) fn gain(design: &DMatrix<f64>, weight: &DVector<f64>, terms: &[usize]) -> Option<DMatrix<f64>> {
    let columns = design.select_columns(terms);
    let mut weighted = columns.transpose();
    for (mut column, weight) in weighted.column_iter_mut().zip(weight.iter()) {
        column *= *weight;
    }
    let normal = &weighted * &columns;
    // Strengths differ by many powers of ten: scaled to a diagonal of ones before they are inverted.
    let scale = normal.diagonal().map(|each| 1.0 / each.sqrt());
    let scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| {
        normal[(i, j)] * scale[i] * scale[j]
    });
    let inverse = scaled.cholesky()?.inverse();
    let inverse = DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| {
        inverse[(i, j)] * scale[i] * scale[j]
    });
    Some(inverse * weighted)
}
