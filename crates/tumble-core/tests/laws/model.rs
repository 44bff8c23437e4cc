//! The error model and its parts.

use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use tumble_core::model::{Decomposition, ErrorModel, ModelCovariance, ModelError, PAIRS};
use tumble_core::real::Real;

use crate::common::{
    Calibration, Draws, assert_close, cast, double, non_orthogonality, rotation, rotation_vector, rounding,
    vector,
};

/// Errors of sensors from perfect to very poor: scale, non-orthogonality, mounting.
fn matrix() -> impl Strategy<Value = Matrix3<f64>> {
    let scale = prop_oneof![1 => Just(1.0), 4 => 0.05..20.0_f64];
    (
        (scale.clone(), scale.clone(), scale),
        non_orthogonality(0.5),
        rotation(),
    )
        .prop_map(|((x, y, z), l, q)| Matrix3::from_diagonal(&Vector3::new(x, y, z)) * l * q.matrix())
}

fn decompose<T: Real>(m: &Matrix3<f64>) -> Result<Decomposition<T>, TestCaseError> {
    Decomposition::of(&cast(m)).map_err(|error| TestCaseError::fail(format!("{error:?}")))
}

fn composing_gives_back<T: Real>(m: &Matrix3<f64>) -> Result<(), TestCaseError> {
    let parts = decompose::<T>(m)?;
    // Three products of three terms on elements up to the largest scale; Gram-Schmidt loses up to 1 / sin of the
    // smallest angle between axes, here a factor of about four.
    let tolerance = rounding::<T>(40.0) * m.amax();
    assert_close!(parts.compose(), cast::<T, 3, 3>(m), tolerance);
    Ok(())
}

fn parts_have_their_form<T: Real>(m: &Matrix3<f64>) -> Result<(), TestCaseError> {
    let parts = decompose::<T>(m)?;
    let l = parts.non_orthogonality;
    prop_assert_eq!([l[(0, 1)], l[(0, 2)], l[(1, 2)]], [T::zero(); 3]);
    prop_assert!((0..3).all(|i| l[(i, i)] > T::zero()) && parts.scale.iter().all(|k| *k > T::zero()));
    for i in 0..3 {
        prop_assert!((double(l.row(i).norm()) - 1.0).abs() < rounding::<T>(20.0));
    }
    let q = parts.mounting.matrix();
    assert_close!(q * q.transpose(), Matrix3::<T>::identity(), rounding::<T>(40.0));
    prop_assert!((double(q.determinant()) - 1.0).abs() < rounding::<T>(40.0));
    Ok(())
}

fn correction_undoes<T: Real>(
    m: &Matrix3<f64>,
    b: &Vector3<f64>,
    u: &Vector3<f64>,
) -> Result<(), TestCaseError> {
    let model = ErrorModel::<T> {
        matrix: cast(m),
        bias: cast(b),
    };
    let correction = model.correction().expect("a matrix of this kind has an inverse");
    let back = correction.apply(&model.measure(&cast(u)));
    // Rounding going forward, on M u and b, is magnified by M^-1 on the way back.
    let magnified =
        3.0 * m.try_inverse().expect("invertible").amax() * (3.0 * m.amax() * u.amax() + b.amax());
    assert_close!(back, cast::<T, 3, 1>(u), rounding::<T>(10.0) * (1.0 + magnified));
    Ok(())
}

proptest! {
    #[test]
    fn putting_together_what_was_taken_apart_gives_the_matrix_back(m in matrix()) {
        composing_gives_back::<f64>(&m)?;
        composing_gives_back::<f32>(&m)?;
    }

    #[test]
    fn m_splits_into_positive_scale_unit_triangle_and_rotation(m in matrix()) {
        parts_have_their_form::<f64>(&m)?;
        parts_have_their_form::<f32>(&m)?;
    }

    #[test]
    fn parts_put_together_come_apart_into_the_same_parts(
        scale in vector(0.5), l in non_orthogonality(0.5), turn in rotation_vector()
    ) {
        let parts = Decomposition {
            scale: scale.add_scalar(1.0),
            non_orthogonality: l,
            mounting: Rotation3::new(turn),
        };
        let again = decompose::<f64>(&parts.compose())?;
        assert_close!(again.scale, parts.scale, 1e-14);
        assert_close!(again.non_orthogonality, parts.non_orthogonality, 1e-14);
        assert_close!(*again.mounting.matrix(), *parts.mounting.matrix(), 1e-14);
        // Near half a turn the rotation vector is known to rounding over the sine of the angle left.
        let left = (core::f64::consts::PI - turn.norm()).min(1.0);
        assert_close!(again.parameters(&Vector3::zeros()).mounting, turn, 1e-14 / left);
    }

    #[test]
    fn correcting_a_measurement_gives_the_truth(m in matrix(), b in vector(2.0), u in vector(20.0)) {
        correction_undoes::<f64>(&m, &b, &u)?;
        correction_undoes::<f32>(&m, &b, &u)?;
    }

    #[test]
    fn non_orthogonality_angles_do_not_depend_on_the_mounting(m in matrix(), turn in rotation()) {
        let parameters = |m: &Matrix3<f64>| decompose::<f64>(m).map(|parts| parts.parameters(&Vector3::zeros()));
        let (here, there) = (parameters(&m)?, parameters(&(m * turn.matrix()))?);
        assert_close!(here.non_orthogonality, there.non_orthogonality, 1e-13);
        assert_close!(here.scale, there.scale, 1e-13);
        for (k, &(i, j)) in PAIRS.iter().enumerate() {
            let between = m.row(i).transpose().angle(&m.row(j).transpose());
            let expected = core::f64::consts::FRAC_PI_2 - between;
            // acos near a right angle is good to rounding.
            prop_assert!((here.non_orthogonality[k] - expected).abs() < 1e-13);
        }
    }

    #[test]
    fn a_mirrored_triad_is_left_handed(m in matrix(), axis in 0..3_usize) {
        let mut mirrored = m;
        mirrored.row_mut(axis).neg_mut();
        prop_assert_eq!(Decomposition::of(&mirrored), Err(ModelError::LeftHanded));
        prop_assert_eq!(Decomposition::of(&cast::<f32, 3, 3>(&mirrored)), Err(ModelError::LeftHanded));
    }

    #[test]
    fn a_triad_with_two_axes_the_same_is_singular(m in matrix(), from in 0..3_usize, step in 1..3_usize, by in 0.1..3.0_f64) {
        let mut flat = m;
        let row = m.row(from) * by;
        flat.row_mut((from + step) % 3).copy_from(&row);
        prop_assert_eq!(Decomposition::of(&flat), Err(ModelError::Singular));
        prop_assert_eq!(Decomposition::of(&cast::<f32, 3, 3>(&flat)), Err(ModelError::Singular));
    }

    #[test]
    fn an_axis_that_is_zero_or_not_a_number_is_singular(m in matrix(), axis in 0..3_usize, column in 0..3_usize) {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut broken = m;
            broken[(axis, column)] = bad;
            prop_assert_eq!(Decomposition::of(&broken), Err(ModelError::Singular));
        }
        let mut empty = m;
        empty.row_mut(axis).fill(0.0);
        prop_assert_eq!(Decomposition::of(&empty), Err(ModelError::Singular));
        prop_assert_eq!(Decomposition::of(&cast::<f32, 3, 3>(&empty)), Err(ModelError::Singular));
    }

    #[test]
    fn the_jacobian_of_the_angles_agrees_with_central_differences(
        scale in vector(0.3), l in non_orthogonality(0.3), turn in jacobian_mounting()
    ) {
        let m = Matrix3::from_diagonal(&scale.add_scalar(1.0)) * l * Rotation3::new(turn).matrix();
        let parts = decompose::<f64>(&m)?;
        assert_close!(parts.jacobian(), numeric_jacobian(&m), jacobian_tolerance(&turn));
    }

    #[test]
    fn the_jacobian_is_the_same_in_single_precision(scale in vector(0.3), l in non_orthogonality(0.3), turn in jacobian_mounting()) {
        let m = Matrix3::from_diagonal(&scale.add_scalar(1.0)) * l * Rotation3::new(turn).matrix();
        let single: ModelCovariance<f32> = decompose::<f32>(&m)?.jacobian();
        let left = (core::f64::consts::PI - turn.norm()).min(1.0);
        // J^-1 holds angle * cot(angle / 2), whose slope near half a turn is pi / 2: no loss there, but the rotation
        // vector itself comes out of a quaternion whose real part is small.
        assert_close!(single, cast::<f32, 12, 12>(&decompose::<f64>(&m)?.jacobian()), rounding::<f32>(200.0) / left);
    }
}

/// Mountings away from the cut at half a turn, where the rotation vector jumps and has no derivative.
fn jacobian_mounting() -> impl Strategy<Value = Vector3<f64>> {
    rotation_vector().prop_filter("on the cut", |turn| turn.norm() < 0.9995 * core::f64::consts::PI)
}

const STEP: f64 = 1e-5;

/// Central differences err by the third derivative, which near half a turn grows as the cut is approached.
fn jacobian_tolerance(turn: &Vector3<f64>) -> f64 {
    let left = (core::f64::consts::PI - turn.norm()).min(1.0);
    1e-8 / left
}

fn flat(m: &Matrix3<f64>, b: &Vector3<f64>) -> nalgebra::SVector<f64, 12> {
    let parameters = Decomposition::of(m)
        .expect("close to one that comes apart")
        .parameters(b);
    let parts = [
        parameters.bias,
        parameters.scale,
        parameters.non_orthogonality,
        parameters.mounting,
    ];
    nalgebra::SVector::from_fn(|i, _| parts[i / 3][i % 3])
}

fn numeric_jacobian(m: &Matrix3<f64>) -> ModelCovariance<f64> {
    let mut jacobian = ModelCovariance::zeros();
    for column in 0..12 {
        let at = |step: f64| {
            let (mut m, mut b) = (*m, Vector3::zeros());
            if column < 9 {
                m[(column / 3, column % 3)] += step;
            } else {
                b[column - 9] += step;
            }
            flat(&m, &b)
        };
        jacobian.set_column(column, &((at(STEP) - at(-STEP)) / (2.0 * STEP)));
    }
    jacobian
}

#[test]
fn the_perfect_sensor_comes_apart_into_nothing() {
    let parts = ErrorModel::<f64>::identity().decompose().expect("identity");
    let angles = parts.parameters(&Vector3::zeros());
    assert_eq!(angles.scale, Vector3::repeat(1.0));
    assert_eq!(angles.non_orthogonality, Vector3::zeros());
    assert_eq!(angles.mounting, Vector3::zeros());
    assert_eq!(parts.compose(), Matrix3::identity());
}

#[test]
fn a_half_turn_of_mounting_splits_with_a_finite_jacobian() {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let m = *Rotation3::new(axis * core::f64::consts::PI).matrix();
        let parts = Decomposition::of(&m).expect("a rotation");
        assert!((parts.parameters(&Vector3::zeros()).mounting.norm() - core::f64::consts::PI).abs() < 1e-7);
        assert!(parts.jacobian().iter().all(|value| value.is_finite()));
    }
}

#[test]
fn a_model_whose_matrix_has_no_inverse_has_no_correction() {
    let model = ErrorModel {
        matrix: Matrix3::new(1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        bias: Vector3::zeros(),
    };
    assert_eq!(model.correction(), Err(ModelError::Singular));
}

#[test]
fn the_covariance_of_angles_is_that_of_random_draws() {
    let mut draws = Draws::new(20);
    let m = Matrix3::from_diagonal(&Vector3::new(1.1, 0.9, 1.02))
        * Matrix3::new(
            1.0,
            0.0,
            0.0,
            0.1,
            0.99_f64.sqrt(),
            0.0,
            -0.05,
            0.2,
            (1.0 - 0.0425_f64).sqrt(),
        )
        * Rotation3::new(Vector3::new(1.2, -2.0, 1.4)).matrix();
    // A covariance without zeros: the square of a matrix drawn at random, small enough for the first order to hold.
    let root = ModelCovariance::<f64>::from_fn(|_, _| 1e-4 * draws.normal());
    let covariance = root * root.transpose();
    let carried = Decomposition::of(&m).expect("regular").carry(&covariance);
    let truth = flat(&m, &Vector3::zeros());
    let mut calibration = Calibration::<12>::new();
    for _ in 0..4000 {
        let error = root * draws.normals::<12>();
        let drawn = Matrix3::from_fn(|i, j| m[(i, j)] + error[3 * i + j]);
        calibration.push(
            flat(&drawn, &Vector3::new(error[9], error[10], error[11])) - truth,
            &carried,
        );
    }
    calibration.check("carried covariance", draws.seed);
}
