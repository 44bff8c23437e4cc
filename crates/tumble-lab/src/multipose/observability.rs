//! What residuals say of unknowns: their covariance, or the combination that is left open.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Sigma, as a share of the size an unknown may have, beyond which it counts as not shown: 3 % of scale.
const OPEN: f64 = 0.03;

/// The covariance of the unknowns of a whitened derivative; else shares of the combination that is known least.
/// `sizes` are what each unknown may be, and make unlike units comparable (docs/theory/multipose.md, eq. 6).
pub(super) fn covariance(
    whitened: &DMatrix<f64>,
    sizes: &DVector<f64>,
) -> Result<DMatrix<f64>, DVector<f64>> {
    let mut scaled = whitened.clone();
    for (mut column, size) in scaled.column_iter_mut().zip(sizes) {
        column *= *size;
    }
    let information = SymmetricEigen::new(scaled.tr_mul(&scaled)); // eq. 6
    let least = information.eigenvalues.imin();
    if !(information.eigenvalues[least] > OPEN.powi(-2)) {
        let shares = information.eigenvectors.column(least);
        return Err(shares.map(f64::abs));
    }
    let inverse = DMatrix::from_diagonal(&information.eigenvalues.map(f64::recip));
    let vectors = DMatrix::from_diagonal(sizes) * &information.eigenvectors;
    Ok(&vectors * inverse * vectors.transpose()) // eq. 6
}
