//! Rotation between two sets of vectors, and the calculus of small rotations.

use nalgebra::{Matrix3, Matrix6, Rotation3, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;
use tumble_core::real::Real;
use tumble_core::rotation::{
    Procrustes, RotationFit, inverse_left_jacobian, rotation_by_series, rotation_of, rotation_onto,
};

use crate::common::{
    Calibration, Draws, assert_close, cast, direction, double, rotation, rotation_vector, rounding, vector,
};

/// Rotation vector of `exp([d]x) exp([phi]x)`.
fn composed(d: &Vector3<f64>, phi: &Vector3<f64>) -> Vector3<f64> {
    (UnitQuaternion::from_scaled_axis(*d) * UnitQuaternion::from_scaled_axis(*phi)).scaled_axis()
}

proptest! {
    #[test]
    fn a_direction_is_brought_onto_another_be_it_the_opposite(from in direction(), to in direction()) {
        prop_assert!((rotation_onto(&(from * 9.8), &to) * from - to).norm() < 1e-9);
        prop_assert!((rotation_onto(&from, &-from) * from + from).norm() < 1e-9);
        prop_assert!(rotation_onto(&from, &Vector3::zeros()).angle() == 0.0);
    }

    #[test]
    fn a_rotation_by_series_is_that_of_its_vector(phi in rotation_vector()) {
        prop_assert!(rotation_by_series(&phi).angle_to(&rotation_of(&phi)) < 1e-8);
    }

    #[test]
    fn the_inverse_left_jacobian_is_the_rotation_vectors_derivative(phi in rotation_vector()) {
        prop_assume!(phi.norm() < 3.13);
        let step = 1e-5;
        let numeric = Matrix3::from_columns(&[0, 1, 2].map(|i| {
            let d = Vector3::ith(i, step);
            (composed(&d, &phi) - composed(&-d, &phi)) / (2.0 * step)
        }));
        let left = (core::f64::consts::PI - phi.norm()).min(1.0);
        assert_close!(inverse_left_jacobian(&phi), numeric, 1e-9 / left);
    }

    #[test]
    fn the_inverse_left_jacobian_is_the_same_in_single_precision(phi in rotation_vector()) {
        let double = inverse_left_jacobian(&phi);
        // (1 - x cot x) / angle^2 just above the change to the series at an angle of 0.01: the difference is 1e-4 / 12
        // of numbers near one, known to rounding, over 1e-4, then multiplied by the angle squared again.
        assert_close!(inverse_left_jacobian(&cast::<f32, 3, 1>(&phi)), cast::<f32, 3, 3>(&double), rounding::<f32>(20.0));
    }

    #[test]
    fn vectors_turned_and_moved_give_back_rotation_and_offset(
        turn in rotation(), offset in vector(5.0), from in spanning(3..12), weights in prop::collection::vec(0.1..10.0_f64, 12)
    ) {
        exact::<f64>(&turn, &offset, &from, &weights)?;
        exact::<f32>(&turn, &offset, &from, &weights)?;
    }

    #[test]
    fn vectors_in_a_plane_give_a_rotation_and_no_reflection(
        turn in rotation(), normal in direction(), from in spanning(3..8)
    ) {
        let flat: Vec<_> = from.iter().map(|v| v - normal * normal.dot(v)).collect();
        prop_assume!(spread(&flat)[1] > 0.1);
        exact::<f64>(&turn, &Vector3::zeros(), &flat, &[1.0; 8])?;
        exact::<f32>(&turn, &Vector3::zeros(), &flat, &[1.0; 8])?;
    }

    #[test]
    fn mirrored_vectors_still_give_a_rotation(turn in rotation(), from in spanning(4..12)) {
        let mut pairs = Procrustes::new();
        from.iter().for_each(|v| pairs.push(&(turn * -v), v, 1.0));
        if let Some(fit) = pairs.solve() {
            assert_close!(*fit.rotation.matrix() * fit.rotation.matrix().transpose(), Matrix3::identity(), 1e-12);
            prop_assert!((fit.rotation.matrix().determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn vectors_along_one_line_give_no_rotation(turn in rotation(), along in direction(), offset in vector(5.0),
                                              lengths in prop::collection::vec(-10.0..10.0_f64, 0..10)) {
        collinear::<f64>(&turn, &along, &offset, &lengths)?;
        collinear::<f32>(&turn, &along, &offset, &lengths)?;
    }

    #[test]
    fn the_order_and_scale_of_the_weights_do_not_matter(turn in rotation(), from in spanning(4..10), scale in 1e-3..1e3_f64) {
        let (mut there, mut back) = (Procrustes::new(), Procrustes::new());
        let noisy = |v: &Vector3<f64>| turn * v + Vector3::new(0.01 * v.y, -0.02 * v.z, 0.01);
        from.iter().for_each(|v| there.push(&noisy(v), v, 1.0));
        from.iter().rev().for_each(|v| back.push(&noisy(v), v, scale));
        let (there, back) = (there.solve().expect("spanning"), back.solve().expect("spanning"));
        assert_close!(*there.rotation.matrix(), *back.rotation.matrix(), 1e-11);
        assert_close!(there.offset, back.offset, 1e-11);
        assert_close!(there.information * scale, back.information, 1e-11 * scale * there.information.norm());
    }
}

/// Singular values of the centred vectors, per vector.
fn spread(from: &[Vector3<f64>]) -> Vector3<f64> {
    let n = from.len() as f64;
    let mean = from.iter().sum::<Vector3<f64>>() / n;
    let scatter: Matrix3<f64> = from.iter().map(|v| (v - mean) * (v - mean).transpose()).sum();
    let mut values = scatter
        .symmetric_eigenvalues()
        .map(|value| (value.max(0.0) / n).sqrt());
    values.as_mut_slice().sort_by(|a, b| b.total_cmp(a));
    values
}

/// Vectors that span a plane at least, whatever their mean.
fn spanning(count: core::ops::Range<usize>) -> impl Strategy<Value = Vec<Vector3<f64>>> {
    prop::collection::vec(vector(10.0), count).prop_filter("along a line", |from| spread(from)[1] > 0.5)
}

fn fitted<T: Real>(
    turn: &Rotation3<f64>,
    offset: &Vector3<f64>,
    from: &[Vector3<f64>],
    weights: &[f64],
) -> Option<RotationFit<T>> {
    let mut pairs = Procrustes::<T>::default();
    for (v, weight) in from.iter().zip(weights) {
        pairs.push(&cast(&(turn * v + offset)), &cast(v), nalgebra::convert(*weight));
    }
    pairs.solve()
}

fn exact<T: Real>(
    turn: &Rotation3<f64>,
    offset: &Vector3<f64>,
    from: &[Vector3<f64>],
    weights: &[f64],
) -> Result<(), TestCaseError> {
    let fit = fitted::<T>(turn, offset, from, weights).ok_or_else(|| TestCaseError::fail("no rotation"))?;
    let lengths = spread(from);
    // Errors of the inputs, rounding times their length, over the length that determines the rotation; the SVD works
    // on products of lengths and so squares that ratio. Ten vectors and a dozen operations each.
    let ratio = (offset.norm() + 10.0) / lengths[1];
    let tolerance = rounding::<T>(30.0) * ratio * ratio;
    assert_close!(*fit.rotation.matrix(), cast::<T, 3, 3>(turn.matrix()), tolerance);
    assert_close!(fit.offset, cast::<T, 3, 1>(offset), 20.0 * tolerance);
    prop_assert!((double(fit.rotation.matrix().determinant()) - 1.0).abs() < rounding::<T>(50.0));
    Ok(())
}

fn collinear<T: Real>(
    turn: &Rotation3<f64>,
    along: &Vector3<f64>,
    offset: &Vector3<f64>,
    lengths: &[f64],
) -> Result<(), TestCaseError> {
    let from: Vec<_> = lengths.iter().map(|length| along * *length).collect();
    let fit = fitted::<T>(turn, offset, &from, &[1.0; 10]);
    prop_assert!(fit.is_none(), "{fit:?}");
    Ok(())
}

#[test]
fn the_inverse_left_jacobian_of_no_rotation_is_the_identity() {
    assert_eq!(
        inverse_left_jacobian(&Vector3::<f64>::zeros()),
        Matrix3::identity()
    );
    assert_eq!(
        inverse_left_jacobian(&Vector3::<f32>::zeros()),
        Matrix3::identity()
    );
}

#[test]
fn series_and_closed_form_of_the_inverse_left_jacobian_meet() {
    // Either side of the change, at an angle of 0.01.
    let axis = Vector3::new(0.6, 0.0, 0.8);
    let (below, above) = (axis * (0.01 - 1e-13), axis * (0.01 + 1e-13));
    let apart = inverse_left_jacobian(&below) - inverse_left_jacobian(&above);
    // The slope is one half, so the two differ by 1e-13 for being at different angles.
    assert!(apart.amax() < 2e-13, "{apart}");
}

#[test]
fn no_pairs_and_one_pair_give_no_rotation() {
    let mut pairs = Procrustes::<f64>::new();
    assert!(pairs.solve().is_none());
    pairs.push(&Vector3::x(), &Vector3::y(), 1.0);
    assert!(pairs.solve().is_none());
    pairs.push(&Vector3::x(), &Vector3::y(), 1.0);
    assert!(pairs.solve().is_none());
}

#[test]
fn the_covariance_of_rotation_and_offset_is_that_of_random_fits() {
    let mut draws = Draws::new(31);
    let sigma = 0.01;
    let turn = Rotation3::new(Vector3::new(0.4, -1.1, 2.0));
    // Off centre, so that errors of rotation and offset depend on each other.
    let from: Vec<Vector3<f64>> = (0..6)
        .map(|_| draws.direction() * 9.8 + Vector3::new(3.0, -2.0, 1.0))
        .collect();
    let mut calibration = Calibration::<6>::new();
    for _ in 0..2000 {
        let mut pairs = Procrustes::new();
        for v in &from {
            pairs.push(&(turn * v + draws.normals::<3>() * sigma), v, 1.0);
        }
        let fit = pairs.solve().expect("six directions");
        let twist = (fit.rotation * turn.inverse()).scaled_axis();
        calibration.push(
            SVector::from_iterator(twist.iter().chain(&fit.offset).copied()),
            &covariance(&fit, sigma),
        );
    }
    calibration.check("rotation and offset", draws.seed);
}

/// Covariance of the twist `d` in `R' = exp([d]x) R` and the offset: `offset = mean_to - R mean_from`, so a twist moves
/// it by `[R mean_from]x d`.
fn covariance(fit: &RotationFit<f64>, sigma: f64) -> Matrix6<f64> {
    let twist = fit.information.try_inverse().expect("determined") * (sigma * sigma);
    let lever = (fit.rotation * fit.mean_from).cross_matrix();
    let mut whole = Matrix6::zeros();
    whole.fixed_view_mut::<3, 3>(0, 0).copy_from(&twist);
    whole.fixed_view_mut::<3, 3>(3, 0).copy_from(&(lever * twist));
    whole
        .fixed_view_mut::<3, 3>(0, 3)
        .copy_from(&(lever * twist).transpose());
    let offset = lever * twist * lever.transpose() + Matrix3::identity() * (sigma * sigma / fit.weight);
    whole.fixed_view_mut::<3, 3>(3, 3).copy_from(&offset);
    whole
}
