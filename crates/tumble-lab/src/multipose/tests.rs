//! Laws of both fits, on poses and turns whose truth is known.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;
use tumble_core::model::ErrorModel;
use tumble_core::noise::{Interval, Noise};

use super::accelerometer::{
    PLACES, RestForce, RestForces, UNKNOWNS, fit_forces, model_of, residual, unknowns_of,
};
use super::error::MultiposeError;
use super::gyroscope::{RestDirection, Rotations, Turn, fit_rates};
use super::held::tremor;
use super::next_orientation::next_orientation;
use super::next_turn::next_turn;
use super::rotation_response::{RateModel, TurnSamples};
use super::samples::MultiposeSamples;
use crate::simulate::stream::{StreamPurpose, normal_vector, stream};
use crate::turntable::flicker::remembered;

/// Rests and turns of a gyroscope without noise or g-sensitivity, at a latitude that is not known.
fn without_noise(rests: Vec<RestDirection>, turns: Vec<Turn>) -> Rotations {
    Rotations {
        remembered: DMatrix::zeros(rests.len(), rests.len()),
        rests,
        turns,
        full_turns: Vec::new(),
        accelerometer_covariance: SMatrix::zeros(),
        noise: [Noise::none(); 3],
        g_sensitivity: false,
        latitude: None,
    }
}

const GRAVITY: f64 = 9.8;
const SIGMA: f64 = 1e-3;

/// Points that cover the sphere, turned off its axes.
fn ups(count: u32) -> Vec<Vector3<f64>> {
    (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (sine, cosine) = (2.4 * f64::from(i) + 0.3).sin_cos();
            let across = (1.0 - z * z).sqrt();
            Vector3::new(across * cosine, across * sine, z)
        })
        .collect()
}

fn truth() -> ErrorModel<f64> {
    ErrorModel {
        matrix: Matrix3::new(1.25, 0.0, 0.0, 0.01, 0.8, 0.0, -0.02, 0.015, 1.1),
        bias: Vector3::new(0.4, -0.3, 0.2),
    }
}

/// Rests with an error that alternates.
fn rests(ups: &[Vector3<f64>], error: f64) -> RestForces {
    let each = ups.iter().enumerate().map(|(k, up)| {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        RestForce {
            mean: truth().measure(&(up * (GRAVITY + sign * error))),
            variance: Vector3::repeat(SIGMA * SIGMA),
        }
    });
    RestForces::independent(each.collect())
}

/// The same with bias instability, remembered from rest to rest.
fn wandering(ups: &[Vector3<f64>], error: f64) -> RestForces {
    let mut all = rests(ups, error);
    let intervals: Vec<_> = (0..ups.len())
        .map(|k| Interval {
            start: 6.0 * k as f64,
            end: 6.0 * k as f64 + 4.0,
        })
        .collect();
    let session = Interval {
        start: 0.0,
        end: 6.0 * ups.len() as f64,
    };
    all.remembered = remembered(&intervals, &session);
    all.flicker = Vector3::repeat(4.0 * SIGMA * SIGMA);
    for (k, rest) in all.rests.iter_mut().enumerate() {
        rest.variance += all.flicker * all.remembered[(k, k)];
    }
    all
}

#[test]
fn errors_are_found_from_scales_a_quarter_wrong() {
    let found = fit_forces(&rests(&ups(15), 0.0), GRAVITY, &ErrorModel::identity()).expect("solvable");
    assert!(
        (found.model.matrix - truth().matrix).amax() < 1e-9,
        "{}",
        found.model.matrix
    );
    assert!(
        (found.model.bias - truth().bias).amax() < 1e-8,
        "{}",
        found.model.bias
    );
}

#[test]
fn nine_orientations_are_refused_whatever_they_are() {
    let refused = fit_forces(&rests(&ups(9), 0.0), GRAVITY, &truth());
    assert!(
        matches!(
            refused,
            Err(MultiposeError::TooFewDirections {
                found: 9,
                needed: 10,
                rests: 9
            })
        ),
        "{refused:?}"
    );
}

#[test]
fn poses_in_a_plane_leave_the_axis_across_it_open() {
    let in_plane: Vec<_> = (0..20)
        .map(|i| {
            let (sine, cosine) = (f64::from(i) * 0.314).sin_cos();
            Vector3::new(cosine, sine, 0.0)
        })
        .collect();
    let refused = fit_forces(&rests(&in_plane, 0.0), GRAVITY, &ErrorModel::identity());
    let Err(MultiposeError::PosesLeaveOpen { shares }) = refused else {
        panic!("{refused:?}");
    };
    let across: f64 = [6, 7, 8, 11].iter().map(|place| shares[*place].powi(2)).sum();
    assert!(across > 0.9, "{shares:?}");
}

#[test]
fn one_pose_that_was_touched_does_not_carry_the_others_with_it() {
    let mut touched = rests(&ups(20), 0.5 * SIGMA);
    touched.rests[7].mean *= 1.02;
    let found = fit_forces(&touched, GRAVITY, &truth()).expect("solvable");
    assert!(found.weights[7] < 0.1, "{:?}", found.weights);
    assert!(
        (found.model.matrix - truth().matrix).amax() < 0.01,
        "{}",
        found.model.matrix
    );
}

#[test]
fn the_influence_of_a_pose_is_what_a_fit_without_it_changes() {
    for all in [rests(&ups(16), 0.2 * SIGMA), wandering(&ups(16), 0.2 * SIGMA)] {
        influence_is_that_of_a_fit_without(&all);
    }
}

fn some_of(all: &RestForces, kept: &[usize]) -> RestForces {
    RestForces {
        rests: kept.iter().map(|k| all.rests[*k]).collect(),
        flicker: all.flicker,
        remembered: all.remembered.select_rows(kept).select_columns(kept),
    }
}

fn influence_is_that_of_a_fit_without(all: &RestForces) {
    let found = fit_forces(all, GRAVITY, &truth()).expect("solvable");
    let sigmas = found.covariance.diagonal().map(f64::sqrt);
    for (k, influence) in found.influence().iter().enumerate() {
        let others: Vec<usize> = (0..all.rests.len()).filter(|other| *other != k).collect();
        let without = fit_forces(&some_of(all, &others), GRAVITY, &truth()).expect("solvable");
        let change = unknowns_of(&found.model) - unknowns_of(&without.model);
        let largest = (0..UNKNOWNS)
            .map(|i| (change[i] / sigmas[i]).abs())
            .fold(0.0, f64::max);
        assert!(
            (influence.change - largest).abs() < 0.01 * largest + 1e-6,
            "rest {k}"
        );
    }
}

#[test]
fn what_a_fit_has_not_seen_it_foretells_worse_than_what_it_has() {
    let all = rests(&ups(16), SIGMA);
    let found = fit_forces(&all, GRAVITY, &truth()).expect("solvable");
    for (k, unseen) in found.held_out().iter().enumerate() {
        let unseen = unseen.expect("fifteen others carry a fit");
        let others: Vec<usize> = (0..16).filter(|other| *other != k).collect();
        let without = fit_forces(&some_of(&all, &others), GRAVITY, &truth()).expect("solvable");
        let refitted = residual(&without.model, &all.rests[k], GRAVITY)
            .expect("invertible")
            .value;
        assert!(
            (unseen - refitted).abs() < 0.01 * refitted.abs() + 1e-6,
            "rest {k}: {unseen} {refitted}"
        );
        assert!(unseen.abs() >= found.residuals[k].value.abs() - 1e-9, "rest {k}");
    }
}

#[test]
fn the_orientation_to_add_lies_where_none_has_been() {
    let away: Vec<_> = ups(40).into_iter().filter(|up| up.x < 0.2).collect();
    let all = rests(&away, 0.0);
    let found = fit_forces(&all, GRAVITY, &truth()).expect("solvable");
    let next = next_orientation(&found, &all.rests, GRAVITY).expect("rests");
    assert!(next.up.x > 0.6, "{}", next.up);
    assert!(next.after < 0.5 * next.before, "{next:?}");
}

/// A turn with all axes in it, sampled at 100 Hz.
fn turn() -> TurnSamples {
    let times: Vec<f64> = (0..200).map(|k| f64::from(k) * 0.01).collect();
    let rate = |t: &f64| {
        Vector3::new(
            (3.0 * t).sin(),
            0.8 * (2.0 * t).cos(),
            1.5 * (1.3 * t).sin() - 0.2,
        )
    };
    let force = |t: &f64| Vector3::new(9.0 * t.cos(), 4.0, 9.0 * t.sin());
    TurnSamples {
        rate: times.iter().map(rate).collect(),
        force: times.iter().map(force).collect(),
        time: times,
    }
}

#[test]
fn a_tremor_is_found_beneath_noise_of_the_samples() {
    const AMPLITUDE: f64 = 0.03;
    let mut random = stream(7, 0, StreamPurpose::StillNoise);
    let time: Vec<f64> = (0..4000).map(|k| f64::from(k) * 0.005).collect();
    for (frequency, noise) in [(4.0, 0.0), (9.0, 0.0), (4.0, 0.02), (9.0, 0.02)] {
        let rate: Vec<[f64; 3]> = time
            .iter()
            .map(|t| {
                let swing = |phase: f64| AMPLITUDE * (std::f64::consts::TAU * frequency * t + phase).sin();
                (Vector3::new(swing(0.0), swing(1.0), swing(2.0)) + normal_vector(&mut random) * noise).into()
            })
            .collect();
        let samples = MultiposeSamples {
            time: &time,
            force: &rate,
            rate: &rate,
        };
        let found = tremor(&samples, (0, time.len())).expect("it trembles");
        assert!((found.amplitude / AMPLITUDE - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.frequency / frequency - 1.0).abs() < 0.05, "{found:?}");
    }
}

#[test]
fn a_turn_about_one_axis_comes_out_as_its_angle() {
    let samples = TurnSamples {
        time: (0..=100).map(|k| f64::from(k) * 0.01).collect(),
        rate: vec![Vector3::new(0.0, 0.0, 0.7); 101],
        force: vec![Vector3::zeros(); 101],
    };
    let errors = RateModel {
        model: ErrorModel::identity(),
        g_sensitivity: Matrix3::zeros(),
    };
    assert!((samples.duration() - 1.0).abs() < 1e-12);
    let carried = samples.end_from_start(&errors).expect("invertible") * Vector3::x();
    let expected = Vector3::new(0.7_f64.cos(), -(0.7_f64.sin()), 0.0);
    assert!((carried - expected).amax() < 1e-12, "{carried}");
}

proptest! {
    #[test]
    fn the_derivative_of_gravitys_length_agrees_with_differences(
        x in prop::array::uniform9(-0.1_f64..0.1), up in prop::array::uniform3(-1.0_f64..1.0)
    ) {
        let up = Vector3::from(up);
        prop_assume!(up.norm() > 0.1);
        let mut start = unknowns_of(&truth());
        start += DVector::from_column_slice(&x);
        let rest = RestForce { mean: up.normalize() * GRAVITY, variance: Vector3::repeat(1.0) };
        let value = |x: &DVector<f64>| residual(&model_of(x), &rest, GRAVITY).expect("invertible").value;
        let row = residual(&model_of(&start), &rest, GRAVITY).expect("invertible").row;
        for unknown in 0..PLACES.len() {
            let mut step = DVector::zeros(UNKNOWNS);
            step[unknown] = 1e-6;
            let numeric = (value(&(&start + &step)) - value(&(&start - &step))) / 2e-6;
            prop_assert!((row[PLACES[unknown]] - numeric).abs() < 1e-6 * (1.0 + numeric.abs()), "unknown {}", unknown);
        }
    }

    #[test]
    fn the_derivative_of_a_turn_is_that_of_differences(
        x in prop::array::uniform21(-0.05_f64..0.05), up in prop::array::uniform3(-1.0_f64..1.0)
    ) {
        let up = Vector3::from(up);
        prop_assume!(up.norm() > 0.1);
        let up = up.normalize();
        let samples = turn();
        let errors = |x: &[f64]| RateModel {
            model: ErrorModel {
                matrix: Matrix3::identity() + Matrix3::from_row_slice(&x[..9]),
                bias: Vector3::from_column_slice(&x[9..12]),
            },
            g_sensitivity: Matrix3::from_row_slice(&x[12..]) * 0.01,
        };
        let at = errors(&x);
        let turned = samples.integrate(&at, true).expect("invertible");
        let to = turned.end_from_start * up;
        let carried = samples.end_from_start(&at).expect("invertible") * up;
        prop_assert!((to - carried).amax() < 1e-12);
        let correction = at.model.correction().expect("invertible");
        let derivative = turned.derivative(&to, &correction.matrix);
        let turning = turned.rotation_derivative(&correction.matrix);
        for unknown in 0..21 {
            let by_rotation = Vector3::from_column_slice(turning.column(unknown).as_slice()).cross(&to);
            prop_assert!((derivative.column(unknown) - by_rotation).amax() < 1e-12, "unknown {}", unknown);
            let moved = |by: f64| {
                let mut x = x;
                x[unknown] += by;
                samples.end_from_start(&errors(&x)).expect("invertible") * up
            };
            let unit = if unknown < 12 { 1.0 } else { 0.01 };
            let numeric = (moved(1e-5) - moved(-1e-5)) / (2e-5 * unit);
            let apart = (derivative.column(unknown) - numeric).amax();
            prop_assert!(apart < 1e-6 * (1.0 + numeric.amax()), "unknown {}: {}", unknown, apart);
        }
    }
}

#[test]
fn errors_match_the_covariance_where_rests_share_flicker() {
    const SESSIONS: u32 = 300;
    let mut random = stream(5, 0, StreamPurpose::AccelerometerFlicker);
    let quiet = wandering(&ups(18), 0.0);
    let spread = (&quiet.remembered * quiet.flicker.x + DMatrix::identity(18, 18) * (SIGMA * SIGMA))
        .cholesky()
        .expect("positive")
        .l();
    let session = || {
        let mut drawn = quiet.clone();
        let draws: Vec<Vector3<f64>> = (0..18).map(|_| normal_vector(&mut random)).collect();
        for (k, rest) in drawn.rests.iter_mut().enumerate() {
            rest.mean += draws
                .iter()
                .enumerate()
                .map(|(l, draw)| draw * spread[(k, l)])
                .sum::<Vector3<f64>>();
        }
        let found = fit_forces(&drawn, GRAVITY, &truth()).expect("solvable");
        let error = unknowns_of(&found.model) - unknowns_of(&truth());
        let error = SVector::<f64, UNKNOWNS>::from_fn(|i, _| error[i]);
        let inverse = found.covariance.try_inverse().expect("positive");
        error.dot(&(inverse * error))
    };
    let mean = std::iter::repeat_with(session)
        .take(SESSIONS as usize)
        .sum::<f64>()
        / f64::from(SESSIONS);
    let (unknowns, sigma) = (9.0, (2.0 * 9.0 / f64::from(SESSIONS)).sqrt());
    assert!((mean - unknowns).abs() < 4.0 * sigma, "{mean}");
}

#[test]
fn a_turn_is_advised_about_the_axis_that_no_turn_was_about() {
    let rest = |up: Vector3<f64>| RestDirection {
        force: up * GRAVITY,
        covariance: Matrix3::identity() * 1e-8,
        by_accelerometer: SMatrix::zeros(),
        rate: Vector3::zeros(),
        rate_variance: Vector3::repeat(1e-8),
        earth_rate: Vector3::zeros(),
        ends: [UnitQuaternion::identity(); 2],
    };
    let axes = [
        Vector3::x(),
        Vector3::y(),
        Vector3::new(0.6, 0.8, 0.0),
        Vector3::new(0.99, 0.0, 0.14),
        Vector3::new(0.0, 0.99, 0.14),
    ];
    let (mut rests, mut turns) = (vec![rest(Vector3::z())], Vec::new());
    for (k, axis) in axes.iter().cycle().take(30).enumerate() {
        let axis = axis.normalize();
        let rate = axis * 2.0;
        let before = rests[k].up();
        let samples = TurnSamples {
            time: (0..=100).map(|i| f64::from(i) * 0.01).collect(),
            rate: vec![rate; 101],
            force: vec![before * GRAVITY; 101],
        };
        rests.push(rest(Rotation3::new(-rate) * before));
        turns.push(Turn {
            before: k,
            after: k + 1,
            samples,
            variance: 1e-6,
        });
    }
    let data = without_noise(rests, turns);
    let fit = fit_rates(&data).expect("solvable");
    let next = next_turn(&data, &fit).expect("turns");
    assert!(next.axis.z.abs() > 0.7, "{next:?}");
    assert!(next.after < next.before, "{next:?}");
    assert!(next.axis.dot(&next.up).abs() < 1e-9, "{next:?}");
}

/// Rests of a sensor that feels `f + k f^2`, without noise.
fn bent(ups: &[Vector3<f64>], k: &Vector3<f64>) -> RestForces {
    let mut all = rests(ups, 0.0);
    for (rest, up) in all.rests.iter_mut().zip(ups) {
        let force = up * GRAVITY;
        rest.mean = truth().measure(&(force + force.component_mul(&force).component_mul(k)));
    }
    all
}

#[test]
fn a_sensor_that_is_not_linear_keeps_bias_and_scale() {
    let k = Vector3::new(2e-4, -3e-4, 1.5e-4);
    let found = fit_forces(&bent(&ups(40), &k), GRAVITY, &ErrorModel::identity()).expect("solvable");
    let shown = found.non_linearity.expect("far beyond noise");
    let [square, sigma] = shown.square;
    assert!(
        (square - k).amax() < 4.0 * sigma.amax(),
        "{shown:?} in place of {k}"
    );
    let sigmas = found.covariance.diagonal().map(f64::sqrt);
    let errors = unknowns_of(&found.model) - unknowns_of(&truth());
    for i in 0..UNKNOWNS {
        assert!(
            errors[i].abs() < 4.0 * sigmas[i],
            "{i}: {} of {}",
            errors[i],
            sigmas[i]
        );
    }
}

#[test]
fn a_linear_sensor_shows_no_other_order() {
    for count in [12, 13, 20, 40] {
        let found = fit_forces(&rests(&ups(count), 0.0), GRAVITY, &truth()).expect("solvable");
        assert_eq!(found.non_linearity, None);
    }
}

/// A session of half turns and less, whose gyroscope has no noise to speak of, a scale error of 2 % and the Earth's rotation.
fn quiet_session(seed: u64, scale: f64, bias: &Vector3<f64>) -> Rotations {
    const NOISE: f64 = 1e-7;
    let mut random = stream(seed, 0, StreamPurpose::GyroscopeWhite);
    let (mut up, mut earth) = (Vector3::z(), Vector3::new(3e-5, 2e-5, 6e-5));
    let (mut rests, mut turns) = (Vec::new(), Vec::new());
    for k in 0..=15 {
        rests.push(RestDirection {
            force: up * GRAVITY,
            covariance: Matrix3::identity() * 1e-10,
            by_accelerometer: SMatrix::zeros(),
            rate: earth * scale + bias + normal_vector(&mut random) * NOISE,
            rate_variance: Vector3::repeat(NOISE * NOISE),
            earth_rate: Vector3::zeros(),
            ends: [UnitQuaternion::identity(); 2],
        });
        let rate = normal_vector(&mut random).normalize() * 2.0;
        if k < 15 {
            turns.push(Turn {
                before: k,
                after: k + 1,
                samples: TurnSamples {
                    time: (0..=100).map(|i| f64::from(i) * 0.01).collect(),
                    rate: vec![rate * scale + bias; 101],
                    force: vec![up * GRAVITY; 101],
                },
                variance: 1e-8,
            });
        }
        (up, earth) = (Rotation3::new(-rate) * up, Rotation3::new(-rate) * earth);
    }
    without_noise(rests, turns)
}

/// Attitudes of a gyroscope that was not calibrated yet left 1 % of the Earth's rotation in the bias, four to six sigmas.
#[test]
fn the_earth_is_seen_from_attitudes_that_have_settled() {
    let bias = Vector3::new(1e-3, -2e-3, 5e-4);
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..8 {
        let fit = fit_rates(&quiet_session(seed, 1.02, &bias)).expect("solvable");
        for axis in 0..3 {
            let error = fit.errors.model.bias[axis] - bias[axis];
            squares += error * error / fit.covariance[(9 + axis, 9 + axis)];
            count += 1.0;
        }
    }
    let score = f64::sqrt(squares / count);
    assert!(score < 1.5, "{score}");
}
