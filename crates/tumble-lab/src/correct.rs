//! Correction of whole arrays, `u = M^-1 (y - b)`, on all cores, and before it what temperature did to them.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use tumble_core::model::{ErrorModel, ModelError};
use tumble_core::temperature::TemperatureDrift;

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

/// Takes readings of a triad of bias `b`, each at a temperature, degC, to what they would be at the reference.
pub fn at_reference(
    drift: &TemperatureDrift<f64>,
    b: &Vector3<f64>,
    temperature: &[f64],
    y: &mut [[f64; 3]],
) {
    let batch = |y: &mut [[f64; 3]], temperature: &[f64]| {
        for (y, &temperature) in y.iter_mut().zip(temperature) {
            *y = drift.at_reference(&Vector3::from(*y), b, temperature).into();
        }
    };
    if y.len() <= BATCH {
        batch(y, temperature);
    } else {
        y.par_chunks_mut(BATCH)
            .zip(temperature.par_chunks(BATCH))
            .for_each(|(y, temperature)| batch(y, temperature));
    }
}
