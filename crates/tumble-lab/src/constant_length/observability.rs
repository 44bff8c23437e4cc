//! Covariance of unknowns by their residuals, or the combination that is not observable.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Sigma, as a share of the size an unknown may have, beyond which it counts as not shown: 3 % of scale.
const OPEN: f64 = 0.03;

/// The covariance of the unknowns of a whitened derivative; else the share of each in what is left open: the length of its
/// part in those combinations. `sizes` are what each unknown may be, and make unlike units comparable
/// (docs/theory/multipose.md, eq. 6).
pub fn covariance(whitened: &DMatrix<f64>, sizes: &DVector<f64>) -> Result<DMatrix<f64>, DVector<f64>> {
    let mut scaled = whitened.clone();
    for (mut column, size) in scaled.column_iter_mut().zip(sizes) {
        column *= *size;
    }
    let information = SymmetricEigen::new(scaled.tr_mul(&scaled)); // eq. 6
    let is_open = |eigenvalue: &f64| eigenvalue.is_nan() || *eigenvalue <= OPEN.powi(-2);
    let mut shares = DVector::zeros(sizes.len());
    for (eigenvalue, vector) in information
        .eigenvalues
        .iter()
        .zip(information.eigenvectors.column_iter())
    {
        if is_open(eigenvalue) {
            shares += vector.component_mul(&vector);
        }
    }
    if information.eigenvalues.iter().any(is_open) {
        return Err(shares.map(f64::sqrt));
    }
    let inverse = DMatrix::from_diagonal(&information.eigenvalues.map(f64::recip));
    let vectors = DMatrix::from_diagonal(sizes) * &information.eigenvectors;
    Ok(&vectors * inverse * vectors.transpose()) // eq. 6
}
