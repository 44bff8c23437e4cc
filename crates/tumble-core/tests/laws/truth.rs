//! True readings of the target.

use nalgebra::{Matrix3, Matrix6, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;
use tumble_core::gravity::{EARTH_RATE, STANDARD};
use tumble_core::noise::{Interval, Noise};
use tumble_core::real::Real;
use tumble_core::turntable::mounting::MountingFit;
use tumble_core::turntable::reference::{EarthFit, SphereFit, earth_variance};
use tumble_core::turntable::truth::{
    CommonRest, ForceObservation, ReferenceTurn, TruthSource, at_rest, from_poses, from_reference, turning,
    with_specific_force,
};

use crate::common::{Calibration, Draws, assert_close, cast, direction, rotation, rounding, vector};

const WHEN: Interval<f64> = Interval { start: 3.0, end: 8.0 };

fn sphere<T: Real>(bias: &Vector3<f64>) -> SphereFit<T> {
    SphereFit {
        bias: cast(bias),
        covariance: Matrix3::identity() * nalgebra::convert::<f64, T>(1e-6),
        observed: [true; 3],
        chi_square: T::one(),
        degrees_of_freedom: 3,
        norm_residual: T::zero(),
    }
}

fn pair<T: Real>(
    reference: &Vector3<f64>,
    covariance: &Matrix3<f64>,
    up: Option<Vector3<f64>>,
) -> CommonRest<T> {
    CommonRest {
        interval: Interval {
            start: nalgebra::convert(WHEN.start),
            end: nalgebra::convert(WHEN.end),
        },
        reference: cast(reference),
        reference_covariance: cast(covariance),
        target: cast(&(reference * 1.01)),
        up: up.map(|up| cast(&up)),
    }
}

fn u<T: Real, const P: usize, const Q: usize>(
    observation: &tumble_core::turntable::observation::Observation<T, P, Q>,
) -> Vector3<T> {
    observation.regressor.fixed_rows::<3>(0).into_owned()
}

/// A covariance of the noise of a rest, not the same on all axes.
fn covariance() -> impl Strategy<Value = Matrix3<f64>> {
    (vector(1e-3), vector(1e-3), vector(1e-3)).prop_map(|(a, b, c)| {
        let root = Matrix3::from_columns(&[a, b, c]);
        root * root.transpose() + Matrix3::identity() * 1e-8
    })
}

fn mounting(rotation: &Rotation3<f64>) -> MountingFit<f64> {
    MountingFit {
        rotation: *rotation,
        bias: Vector3::zeros(),
        covariance: Matrix3::identity() * 1e-8,
        pose_variance: 1e-4,
    }
}

fn earth(bias: &Vector3<f64>, rate: &Vector3<f64>) -> EarthFit<f64> {
    EarthFit {
        bias: *bias,
        earth_rate: *rate,
        covariance: Matrix6::identity() * 1e-12,
    }
}

/// Central differences of a truth by each shared error.
fn numeric<const Q: usize>(
    step: f64,
    truth: impl Fn(&SVector<f64, Q>) -> Vector3<f64>,
) -> SMatrix<f64, 3, Q> {
    let mut derivative = SMatrix::<f64, 3, Q>::zeros();
    for i in 0..Q {
        let error = SVector::<f64, Q>::from_fn(|k, _| if k == i { step } else { 0.0 });
        derivative.set_column(i, &((truth(&error) - truth(&-error)) / (2.0 * step)));
    }
    derivative
}

proptest! {
    #[test]
    fn truth_from_the_reference_is_as_long_as_gravity(up in direction(), off in vector(0.01), bias in vector(0.5), covariance in covariance()) {
        let reading = up * STANDARD + bias + off;
        let observation = from_reference(&pair::<f64>(&reading, &covariance, None), &sphere(&bias), STANDARD);
        // It is drawn along its own uncertainty, not straight: what that moves it across is of second order in length.
        let along = (reading - bias).normalize();
        let way = covariance * along / along.dot(&(covariance * along));
        let second_order = (way.norm() * ((reading - bias).norm() - STANDARD)).powi(2) / STANDARD;
        prop_assert!((u(&observation).norm() - STANDARD).abs() < second_order + 1e-13);
        let single = from_reference(&pair::<f32>(&reading, &covariance, None), &sphere(&bias), STANDARD as f32);
        // Lengths of ten in f32.
        assert_close!(u(&single), cast::<f32, 3, 1>(&u(&observation)), rounding::<f32>(10.0) * STANDARD);
        prop_assert_eq!(observation.regressor[3], 1.0);
        prop_assert_eq!(observation.reading, reading * 1.01);
    }

    #[test]
    fn the_derivative_of_the_truth_by_the_references_bias_is_exact(up in direction(), bias in vector(0.5), covariance in covariance()) {
        let reading = up * STANDARD + bias;
        let truth = |error: &Vector3<f64>| from_reference(&pair(&reading, &covariance, None), &sphere(&(bias + error)), STANDARD);
        let sensitivity = truth(&Vector3::zeros()).sensitivity;
        assert_close!(sensitivity, numeric(1e-5, |error| u(&truth(error))), 1e-6);
        // An error of the bias tips the truth and does not stretch it.
        prop_assert!((sensitivity.transpose() * up).amax() < 1e-12);
    }

    #[test]
    fn a_reference_that_misses_the_sphere_is_not_corrected(up in direction(), bias in vector(0.5), length in 0.9..1.1_f64) {
        // Its noise is far below its error: the sphere is the worse knowledge.
        let reading = up * (STANDARD * length) + bias;
        let missing = SphereFit { norm_residual: 0.5, chi_square: 1e6, ..sphere(&bias) };
        let observation = from_reference(&pair(&reading, &(Matrix3::identity() * 1e-6), None), &missing, STANDARD);
        assert_close!(u(&observation), up * (STANDARD * length), 1e-5);
    }

    #[test]
    fn truth_from_poses_needs_the_pose(truth in truths(), rotation in rotation()) {
        prop_assert!(from_poses(truth, &pair::<f64>(&Vector3::z(), &Matrix3::identity(), None), &mounting(&rotation), STANDARD).is_none());
    }

    #[test]
    fn turning_the_truth_is_exact_and_turns_the_reading_back(up in direction(), rotation in rotation()) {
        let reading = rotation * up * STANDARD;
        let rest = pair::<f64>(&reading, &Matrix3::identity(), Some(up));
        let of = |truth: TruthSource| from_poses(truth, &rest, &mounting(&rotation), STANDARD).expect("a pose");
        assert_close!(u(&of(TruthSource::RotateTruth)), reading, 1e-13);
        prop_assert_eq!(of(TruthSource::RotateTruth).reading, rest.target);
        assert_close!(u(&of(TruthSource::RotateMeasurement)), up * STANDARD, 1e-13);
        assert_close!(of(TruthSource::RotateMeasurement).reading, up * STANDARD * 1.01, 1e-13);
        assert_close!(u(&of(TruthSource::Ideal)), up * STANDARD, 1e-13);
        prop_assert_eq!(of(TruthSource::Ideal).reading, rest.target);
        prop_assert_eq!(of(TruthSource::Ideal).sensitivity, Matrix3::zeros());
    }

    #[test]
    fn what_the_mounting_does_to_the_truth_is_its_derivative(up in direction(), rotation in rotation()) {
        let truth = |error: &Vector3<f64>| {
            let rest = pair::<f64>(&Vector3::z(), &Matrix3::identity(), Some(up));
            from_poses(TruthSource::RotateTruth, &rest, &mounting(&(Rotation3::new(*error) * rotation)), STANDARD).expect("a pose")
        };
        assert_close!(truth(&Vector3::zeros()).sensitivity, numeric(1e-5, |error| u(&truth(error))), 1e-8);
    }

    #[test]
    fn errors_of_the_table_act_across_the_vertical_only(truth in truths(), up in direction(), rotation in rotation()) {
        let rest = pair::<f64>(&Vector3::z(), &Matrix3::identity(), Some(up));
        let observation = from_poses(truth, &rest, &mounting(&rotation), STANDARD).expect("a pose");
        let along = u(&observation) / STANDARD;
        prop_assert!((observation.truth_covariance * along).amax() < 1e-18);
        prop_assert!((observation.truth_covariance.trace() - 2e-4).abs() < 1e-15);
    }

    #[test]
    fn at_rest_the_rate_is_the_earths_as_seen_from_there(turn in rotation(), north in direction(), bias in vector(0.01)) {
        let attitude = UnitQuaternion::from_rotation_matrix(&turn);
        let rate = north * EARTH_RATE;
        let of = |error: &SVector<f64, 6>| {
            let (b, e) = (error.fixed_rows::<3>(0).into_owned(), error.fixed_rows::<3>(3).into_owned());
            at_rest(WHEN, bias, &Some(attitude), &earth(&(bias + b), &(rate + e)))
        };
        let observation = of(&SVector::zeros());
        assert_close!(u(&observation), turn.inverse() * rate, 1e-18);
        assert_close!(observation.sensitivity, numeric(1e-5, |error| u(&of(error))), 1e-10);
        prop_assert_eq!(observation.truth_covariance, Matrix3::zeros());
        let lost = at_rest(WHEN, bias, &None, &earth(&bias, &rate));
        prop_assert_eq!(u(&lost), Vector3::zeros());
        prop_assert_eq!(lost.truth_covariance, Matrix3::identity() * earth_variance::<f64>());
    }

    #[test]
    fn both_units_turn_by_the_same_angle_whatever_their_clocks(angle in vector(3.0), bias in vector(0.01), length in 0.9..1.1_f64) {
        // The reference saw the turn in another length of time, with its bias over that.
        let seen = Interval { start: 3.0, end: 3.0 + 5.0 * length };
        let noise = Noise { white: 1e-8, ..Noise::none() };
        let turn = ReferenceTurn {
            angle_variance: Vector3::zeros(),
            angle: angle + bias * seen.duration(),
            interval: seen,
            noise: [noise; 3],
            session: Interval { start: 0.0, end: 100.0 },
        };
        let of = |error: &SVector<f64, 6>| {
            turning(WHEN, Vector3::zeros(), &turn, &earth(&(bias + error.fixed_rows::<3>(0)), &Vector3::zeros()))
        };
        let observation = of(&SVector::zeros());
        assert_close!(u(&observation) * WHEN.duration(), angle, 1e-14);
        assert_close!(observation.sensitivity, numeric(1e-5, |error| u(&of(error))), 1e-9);
        // N^2 T over the square of the target's own length of time.
        let expected = 1e-8 * seen.duration() / (WHEN.duration() * WHEN.duration());
        assert_close!(observation.truth_covariance, Matrix3::identity() * expected, 1e-20);
    }

    #[test]
    fn specific_force_joins_the_regressors_and_changes_nothing_else(reading in vector(1.0), force in vector(10.0), bias in vector(0.01)) {
        let rate = at_rest(WHEN, reading, &None, &earth(&bias, &Vector3::zeros()));
        let wide = with_specific_force(&rate, &force);
        prop_assert_eq!(wide.regressor.fixed_rows::<4>(0).into_owned(), rate.regressor);
        prop_assert_eq!(wide.regressor.fixed_rows::<3>(4).into_owned(), force);
        prop_assert_eq!((wide.interval, wide.reading, wide.truth_covariance, wide.sensitivity),
                        (rate.interval, rate.reading, rate.truth_covariance, rate.sensitivity));
    }
}

fn truths() -> impl Strategy<Value = TruthSource> {
    prop_oneof![
        Just(TruthSource::Ideal),
        Just(TruthSource::RotateMeasurement),
        Just(TruthSource::RotateTruth)
    ]
}

#[test]
fn truth_from_the_reference_errs_as_its_covariance_says() {
    let mut draws = Draws::new(121);
    let root = Matrix3::new(3.0, 0.0, 0.0, 1.0, 2.0, 0.0, -0.5, 0.4, 1.0) * 1e-3;
    let truth = draws.direction() * STANDARD;
    let bias = Vector3::new(0.1, -0.2, 0.05);
    // The truth is on the sphere, so that only the two directions across it err.
    let across = {
        let up = truth / STANDARD;
        let first = up.cross(&Vector3::x()).normalize();
        SMatrix::<f64, 3, 2>::from_columns(&[first, up.cross(&first)])
    };
    let mut calibration = Calibration::<2>::new();
    let mut along: f64 = 0.0;
    for _ in 0..4000 {
        let reading = truth + bias + root * draws.normals::<3>();
        let rest = pair::<f64>(&reading, &(root * root.transpose()), None);
        let observation: ForceObservation<f64> = from_reference(&rest, &sphere(&bias), STANDARD);
        let error = u(&observation) - truth;
        let covariance = across.transpose() * observation.truth_covariance * across;
        calibration.push(across.transpose() * error, &covariance);
        along = along.max((error.dot(&truth) / STANDARD).abs());
    }
    calibration.check("truth from the reference", draws.seed);
    assert!(along < 1e-4, "{along}");
}
