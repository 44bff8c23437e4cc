//! Sphere through readings: a start of a fit that may be far off.

use nalgebra::{Matrix4, Vector3, Vector4};
use tumble_core::model::ErrorModel;

/// Centre and radius of the sphere that readings lie on (docs/theory/multipose.md, eq. 20); `None` where they lie
/// in a plane.
pub fn sphere(readings: &[Vector3<f64>]) -> Option<(Vector3<f64>, f64)> {
    #[allow(clippy::cast_precision_loss)]
    let count = readings.len() as f64;
    let mean = readings.iter().sum::<Vector3<f64>>() / count;
    let size = (readings.iter().map(|y| (y - mean).norm_squared()).sum::<f64>() / count).sqrt();
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for reading in readings {
        let y = (reading - mean) / size;
        let row = Vector4::new(y.x, y.y, y.z, 1.0);
        normal += row * row.transpose();
        right += row * y.norm_squared();
    }
    let eigenvalues = normal.symmetric_eigenvalues();
    let surrounds = eigenvalues.min() > 1e-4 * eigenvalues.max();
    if !surrounds {
        return None;
    }
    let solved = normal.cholesky()?.solve(&right); // eq. 20
    let centre: Vector3<f64> = solved.fixed_rows::<3>(0) * 0.5;
    let radius = (solved.w + centre.norm_squared()).sqrt();
    radius
        .is_finite()
        .then_some((mean + centre * size, radius * size))
}

/// A model to start from: bias and one scale for all axes.
pub fn start(readings: &[Vector3<f64>], length: f64) -> ErrorModel<f64> {
    let mut model = ErrorModel::identity();
    if let Some((centre, radius)) = sphere(readings) {
        model.bias = centre;
        model.matrix *= radius / length;
    }
    model
}
