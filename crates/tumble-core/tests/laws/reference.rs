//! Errors that the reference adds to the truth: its biases, and the rotation of the Earth.

use nalgebra::{Matrix3, Rotation3, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;
use tumble_core::gravity::{EARTH_RATE, STANDARD};
use tumble_core::real::Real;
use tumble_core::regression::Unsolvable;
use tumble_core::turntable::reference::{
    EarthFit, GyroscopeRest, SphereFit, earth_variance, fit_earth, fit_sphere,
};

use crate::common::{Calibration, Draws, assert_close, cast, direction, faces, rounding, vector};

fn sphere<T: Real>(rests: &[Vector3<f64>], sigma: f64) -> Result<SphereFit<T>, Unsolvable> {
    let variance: T = nalgebra::convert(sigma * sigma);
    let covariance = Matrix3::identity() * variance;
    let rests: Vec<_> = rests.iter().map(|rest| (cast(rest), covariance)).collect();
    fit_sphere(&rests, nalgebra::convert(STANDARD))
}

/// Six faces, each pose some degrees from its nominal attitude, and more poses besides.
fn poses() -> impl Strategy<Value = Vec<Vector3<f64>>> {
    (
        prop::collection::vec(vector(0.05), 6),
        prop::collection::vec(direction(), 0..12),
    )
        .prop_map(|(off, more)| {
            let tipped = faces()
                .into_iter()
                .zip(off)
                .map(|(face, off)| (face + off).normalize());
            tipped.chain(more).collect()
        })
}

proptest! {
    #[test]
    fn the_bias_is_the_centre_of_the_sphere_at_any_poses(poses in poses(), bias in vector(1.0)) {
        let rests: Vec<_> = poses.iter().map(|up| up * STANDARD + bias).collect();
        let fit = sphere::<f64>(&rests, 1e-4).expect("six faces");
        // The prior of 2 m/s^2 pulls by the square of the noise over it: 2.5e-9 of the bias.
        assert_close!(fit.bias, bias, 5e-9);
        prop_assert_eq!(fit.observed, [true; 3]);
        prop_assert!(fit.norm_residual < 5e-9);
        prop_assert_eq!(fit.model_variance(), 0.0);
        let single = sphere::<f32>(&rests, 1e-4).expect("six faces");
        // Lengths of 10 m/s^2 in f32, and of each row of the last step the difference of two of them.
        assert_close!(single.bias, cast::<f32, 3, 1>(&bias), rounding::<f32>(10.0) * STANDARD);
    }

    #[test]
    fn an_axis_that_gravity_never_lies_along_is_not_observed(bias in vector(0.5), count in 4..20_usize, silent in 0..3_usize) {
        // Poses around a circle across the silent axis, as far as they are concerned the centre may lie anywhere
        // along it.
        let rests: Vec<_> = (0..count).map(|k| {
            let angle = core::f64::consts::TAU * k as f64 / count as f64;
            let mut up = Vector3::zeros();
            up[(silent + 1) % 3] = angle.cos();
            up[(silent + 2) % 3] = angle.sin();
            let mut rest = up * STANDARD + bias;
            rest[silent] = 0.0;
            rest
        }).collect();
        let fit = sphere::<f64>(&rests, 1e-3).expect("finite");
        for axis in 0..3 {
            prop_assert_eq!(fit.observed[axis], axis != silent);
        }
        prop_assert!((fit.covariance[(silent, silent)] - 4.0).abs() < 0.1);
    }

    #[test]
    fn a_scale_error_shows_in_the_residual_and_not_in_the_bias(scale in 1e-3..0.05_f64, bias in vector(0.5)) {
        let rests: Vec<_> = faces().iter().map(|up| up * (STANDARD * (1.0 + scale)) + bias).collect();
        let fit = sphere::<f64>(&rests, 1e-4).expect("six faces");
        assert_close!(fit.bias, bias, 1e-6);
        prop_assert!((fit.norm_residual - STANDARD * scale).abs() < 1e-6);
        prop_assert!(fit.excess() > 3.0);
        prop_assert!((fit.model_variance() - (STANDARD * scale).powi(2)).abs() < 1e-6);
    }

    #[test]
    fn a_rest_that_is_not_finite_or_zero_is_unsolvable(poses in poses(), bad in any::<prop::sample::Index>()) {
        for value in [f64::NAN, f64::INFINITY, 0.0] {
            let mut rests: Vec<_> = poses.iter().map(|up| up * STANDARD).collect();
            let at = bad.index(rests.len());
            rests[at].fill(value);
            prop_assert_eq!(sphere::<f64>(&rests, 1e-3).map(|fit| fit.bias), Err(Unsolvable));
        }
    }

    #[test]
    fn a_unit_that_turned_separates_bias_from_the_earths_rotation(bias in vector(0.01), north in direction(), seed in any::<u64>()) {
        let mut draws = Draws::new(seed);
        let earth = north * EARTH_RATE;
        let rests: Vec<_> = attitudes(&mut draws, 8).iter().map(|q| gyroscope(bias + q.inverse() * earth, Some(*q), 1e-9)).collect();
        let fit = fit_earth(&rests, None).expect("finite");
        // The prior of the Earth, 4e-5 rad/s, pulls by the square of the noise over it.
        assert_close!(fit.bias, bias, 1e-11);
        assert_close!(fit.earth_rate, earth, 1e-11);
        let single: Vec<GyroscopeRest<f32>> = rests.iter().map(in_single_precision).collect();
        let single = fit_earth(&single, None).expect("finite");
        // Readings of 0.01 rad/s in f32.
        assert_close!(single.bias, cast::<f32, 3, 1>(&bias), rounding::<f32>(10.0) * 0.01);
        assert_close!(single.earth_rate, cast::<f32, 3, 1>(&earth), rounding::<f32>(10.0) * 0.01);
    }

    #[test]
    fn a_unit_that_did_not_turn_keeps_what_is_believed_of_the_earth(bias in vector(0.01), count in 1..20_usize) {
        let rests = vec![gyroscope(bias, Some(UnitQuaternion::identity()), 1e-9); count];
        believes_no_more(&fit_earth(&rests, None).expect("finite"), &bias)?;
        let rests = vec![gyroscope(bias, None, 1e-9); count];
        let fit = fit_earth(&rests, None).expect("finite");
        prop_assert_eq!(fit.earth_rate, Vector3::zeros());
        for axis in 0..3 {
            // Each rest is as uncertain as the Earth; and for all that is known each sees another direction of it.
            let expected = (earth_variance::<f64>() / count as f64).sqrt();
            prop_assert!((fit.covariance[(axis, axis)].sqrt() / expected - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn latitude_pins_the_upward_part_of_the_earth_and_no_other(up in direction(), latitude in -1.5..1.5_f64, bias in vector(0.01)) {
        let rate = EARTH_RATE * latitude.sin();
        let rests = vec![gyroscope(bias, Some(UnitQuaternion::identity()), 1e-9); 4];
        let fit = fit_earth(&rests, Some((up, rate))).expect("finite");
        prop_assert!((fit.earth_rate.dot(&up) - rate).abs() < 2e-3 * EARTH_RATE);
        let earth = fit.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        let sigma = |along: &Vector3<f64>| along.dot(&(earth * along)).sqrt();
        prop_assert!(sigma(&up) < 0.02 * EARTH_RATE);
        let across = if up.x.abs() < 0.6 { up.cross(&Vector3::x()) } else { up.cross(&Vector3::y()) }.normalize();
        prop_assert!((sigma(&across) / earth_variance::<f64>().sqrt() - 1.0).abs() < 1e-3);
    }
}

fn believes_no_more(fit: &EarthFit<f64>, bias: &Vector3<f64>) -> Result<(), TestCaseError> {
    // Bias and Earth together are what was read; which is which nobody knows.
    assert_close!(fit.bias + fit.earth_rate, *bias, 1e-12);
    for axis in 0..3 {
        let share = fit.covariance[(3 + axis, 3 + axis)] / earth_variance::<f64>();
        prop_assert!((share - 1.0).abs() < 1e-3, "{}", share);
        let own = fit.covariance[(axis, axis)] / earth_variance::<f64>();
        prop_assert!((own - 1.0).abs() < 1e-3, "{}", own);
    }
    Ok(())
}

fn attitudes(draws: &mut Draws, count: usize) -> Vec<UnitQuaternion<f64>> {
    (0..count)
        .map(|k| {
            if k == 0 {
                UnitQuaternion::identity()
            } else {
                UnitQuaternion::from_scaled_axis(draws.normals::<3>())
            }
        })
        .collect()
}

fn gyroscope(
    mean: Vector3<f64>,
    start_from_here: Option<UnitQuaternion<f64>>,
    sigma: f64,
) -> GyroscopeRest<f64> {
    GyroscopeRest {
        mean,
        covariance: Matrix3::identity() * (sigma * sigma),
        start_from_here,
    }
}

fn in_single_precision(rest: &GyroscopeRest<f64>) -> GyroscopeRest<f32> {
    GyroscopeRest {
        mean: cast(&rest.mean),
        covariance: cast(&rest.covariance),
        start_from_here: rest.start_from_here.map(UnitQuaternion::cast),
    }
}

#[test]
fn the_sphere_is_unbiased_and_errs_as_its_covariance_says() {
    let mut draws = Draws::new(91);
    let bias = Vector3::new(0.05, -0.02, 0.03);
    // Another noise on each axis, and correlated, as it is after the mounting of the reference itself is corrected.
    let root = Matrix3::new(2.0, 0.0, 0.0, 0.5, 1.0, 0.0, -0.3, 0.4, 0.6) * 1e-3;
    let mut calibration = Calibration::<3>::new();
    let mut chi_square = 0.0;
    let runs = 2000;
    for _ in 0..runs {
        let rests: Vec<_> = faces()
            .iter()
            .cycle()
            .take(12)
            .map(|up| {
                let tipped = (up + draws.normals::<3>() * 0.01).normalize();
                (
                    tipped * STANDARD + bias + root * draws.normals::<3>(),
                    root * root.transpose(),
                )
            })
            .collect();
        let fit = fit_sphere(&rests, STANDARD).expect("six faces");
        chi_square += fit.chi_square / f64::from(fit.degrees_of_freedom) / f64::from(runs);
        calibration.push(fit.bias - bias, &fit.covariance);
    }
    calibration.check("sphere", draws.seed);
    // Nine degrees of freedom.
    let bound = 5.0 * (2.0 / 9.0 / f64::from(runs)).sqrt();
    assert!(
        (chi_square - 1.0).abs() < bound,
        "seed {}: {chi_square}",
        draws.seed
    );
}

#[test]
fn bias_and_earth_err_as_their_covariance_says() {
    let mut draws = Draws::new(92);
    let bias = Vector3::new(1e-3, -2e-3, 5e-4);
    let mut calibration = Calibration::<6>::new();
    for _ in 0..2000 {
        // The prior of the Earth's rotation is a normal distribution, so it is drawn from that.
        let earth = draws.normals::<3>() * earth_variance::<f64>().sqrt();
        let sigma = 2e-5;
        let rests: Vec<_> = attitudes(&mut draws, 6)
            .iter()
            .map(|q| {
                gyroscope(
                    bias + q.inverse() * earth + draws.normals::<3>() * sigma,
                    Some(*q),
                    sigma,
                )
            })
            .collect();
        let fit = fit_earth(&rests, None).expect("finite");
        let errors = [fit.bias - bias, fit.earth_rate - earth];
        calibration.push(SVector::from_fn(|i, _| errors[i / 3][i % 3]), &fit.covariance);
    }
    calibration.check("bias and Earth", draws.seed);
}

#[test]
fn no_rests_leave_the_prior() {
    let fit = fit_sphere::<f64>(&[], STANDARD).expect("the prior");
    assert_eq!((fit.bias, fit.observed), (Vector3::zeros(), [false; 3]));
    assert_eq!(
        (fit.degrees_of_freedom, fit.excess(), fit.norm_residual),
        (0, 1.0, 0.0)
    );
    let fit = fit_earth::<f64>(&[], None).expect("the prior");
    assert_eq!((fit.bias, fit.earth_rate), (Vector3::zeros(), Vector3::zeros()));
}

#[test]
fn few_rests_with_ordinary_noise_show_no_model_error() {
    let (seed, runs) = (93, 2000);
    let mut draws = Draws::new(seed);
    let turned = Rotation3::new(Vector3::new(0.1, 0.2, 0.3));
    let accused = (0..runs)
        .filter(|_| {
            let rests: Vec<_> = faces()
                .iter()
                .map(|up| turned * up * STANDARD + draws.normals::<3>() * 1e-3)
                .collect();
            sphere::<f64>(&rests, 1e-3).expect("six faces").model_variance() > 0.0
        })
        .count();
    // Chi-square of three degrees of freedom exceeds nine in 2.9 % of all cases.
    assert!(accused < runs * 5 / 100, "seed {seed}: {accused} of {runs}");
}
