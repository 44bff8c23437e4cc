//! Rotation of a magnetometer in its case: the angle between field and gravity is the same at all rests
//! (docs/theory/magnetometer.md, eq. 5).

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

use crate::constant_length::levenberg_marquardt::{Linearised, minimise};

/// Case from the frame of the fields, and the upward part of the field, that explain all pairs best, of the starts by all 24
/// ways to name axes; `None` where nothing is finite.
pub(super) fn rotation_by_dip(
    fields: &[Vector3<f64>],
    ups: &[Vector3<f64>],
) -> Option<(Rotation3<f64>, f64)> {
    let tried = axis_namings().filter_map(|start| {
        let x = DVector::zeros(4);
        let found = minimise(x, |x| Some(vertical_parts(&start, x, fields, ups)))?;
        let rotation = rotation_of(&found.x) * start;
        Some((found.at.residuals.norm_squared(), rotation, found.x[3]))
    });
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((best.1, best.2))
}

/// Upward part of each field less the one of all, by a rotation vector on top of the start and that part.
fn vertical_parts(
    start: &Rotation3<f64>,
    x: &DVector<f64>,
    fields: &[Vector3<f64>],
    ups: &[Vector3<f64>],
) -> Linearised {
    let rotation = rotation_of(x) * start;
    let jacobian_of_vector = left_jacobian(&Vector3::new(x[0], x[1], x[2]));
    let mut residuals = DVector::zeros(fields.len());
    let mut jacobian = DMatrix::zeros(fields.len(), 4);
    for (k, (field, up)) in fields.iter().zip(ups).enumerate() {
        let turned = rotation * field;
        residuals[k] = up.dot(&turned) - x[3]; // eq. 5
        let by_rotation = jacobian_of_vector.tr_mul(&turned.cross(up));
        jacobian
            .view_mut((k, 0), (1, 3))
            .copy_from(&by_rotation.transpose());
        jacobian[(k, 3)] = -1.0;
    }
    Linearised { residuals, jacobian }
}

fn rotation_of(x: &DVector<f64>) -> Rotation3<f64> {
    Rotation3::from_scaled_axis(Vector3::new(x[0], x[1], x[2]))
}

/// Rotation on the left per change of a rotation vector (Barfoot 2017, eq. 7.85).
fn left_jacobian(vector: &Vector3<f64>) -> Matrix3<f64> {
    let angle = vector.norm();
    let cross = vector.cross_matrix();
    let (first, second) = if angle < 1e-4 {
        (0.5, 1.0 / 6.0)
    } else {
        (
            (1.0 - angle.cos()) / angle.powi(2),
            (angle - angle.sin()) / angle.powi(3),
        )
    };
    Matrix3::identity() + cross * first + cross * cross * second
}

/// Rotations that take axes to axes.
fn axis_namings() -> impl Iterator<Item = Rotation3<f64>> {
    let signed = [0, 1, 2]
        .into_iter()
        .flat_map(|axis| [1.0, -1.0].map(|sign| Vector3::ith(axis, sign)));
    let pairs = signed
        .clone()
        .flat_map(move |x| signed.clone().map(move |y| (x, y)));
    pairs
        .filter(|(x, y): &(Vector3<f64>, Vector3<f64>)| x.dot(y).abs() < 0.5)
        .map(|(x, y)| Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_can_be_named_in_24_ways() {
        let all: Vec<_> = axis_namings().collect();
        assert_eq!(all.len(), 24);
        assert!(
            all.iter()
                .all(|one| (one.matrix().determinant() - 1.0).abs() < 1e-12)
        );
    }
}
