//! Correction of whole arrays, `u = M^-1 (y - b)`, on all cores.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use tumble_core::model::{ErrorModel, ModelError};

/// Samples that are worth a task of their own.
const BATCH: usize = 1 << 14;

/// Corrects samples `y` (n x 3, row by row) into `u` of the same length.
///
/// # Errors
/// [`ModelError::Singular`] if M has no inverse.
pub fn correct(model: &ErrorModel<f64>, y: &[f64], u: &mut [f64]) -> Result<(), ModelError> {
    let correction = model.correction()?;
    let (c, offset): (Matrix3<f64>, Vector3<f64>) =
        (correction.matrix, -(correction.matrix * correction.bias));
    let batch = |y: &[f64], u: &mut [f64]| {
        for (y, u) in y.chunks_exact(3).zip(u.chunks_exact_mut(3)) {
            for (i, u) in u.iter_mut().enumerate() {
                *u = c[(i, 0)] * y[0] + c[(i, 1)] * y[1] + c[(i, 2)] * y[2] + offset[i];
            }
        }
    };
    if y.len() <= 3 * BATCH {
        batch(y, u);
    } else {
        y.par_chunks(3 * BATCH)
            .zip(u.par_chunks_mut(3 * BATCH))
            .for_each(|(y, u)| batch(y, u));
    }
    Ok(())
}
