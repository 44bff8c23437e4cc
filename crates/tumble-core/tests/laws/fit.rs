//! Calibration of one triad from intervals whose truth and reading are known.

use nalgebra::{Matrix3, Matrix6, Rotation3, SMatrix, SVector, Vector3};
use proptest::prelude::*;
use tumble_core::gravity::STANDARD;
use tumble_core::model::ErrorModel;
use tumble_core::noise::{Interval, Noise};
use tumble_core::real::Real;
use tumble_core::regression::Unsolvable;
use tumble_core::turntable::fit::{TriadFit, fit};
use tumble_core::turntable::observation::{FitInputs, Observation};

use crate::common::{
    Calibration, Correlated, Draws, assert_close, cases, cast, direction, faces, non_orthogonality, rotation,
    rounding, vector,
};

/// Accelerometer: three regressors and one, three shared errors.
type Force = Observation<f64, 4, 3>;
/// Gyroscope with g-sensitivity: three more regressors, six shared errors.
type Rate = Observation<f64, 7, 6>;

/// Rests of five seconds, eight seconds apart.
fn interval(k: usize) -> Interval<f64> {
    let start = 8.0 * k as f64;
    Interval {
        start,
        end: start + 5.0,
    }
}

fn session(count: usize) -> Interval<f64> {
    Interval {
        start: 0.0,
        end: interval(count - 1).end,
    }
}

fn inputs<const Q: usize>(
    count: usize,
    nominal: &Rotation3<f64>,
    noise: Noise<f64>,
    shared: SMatrix<f64, Q, Q>,
) -> FitInputs<f64, Q> {
    FitInputs {
        noise: [noise; 3],
        session: session(count),
        nominal: *nominal.matrix(),
        largest_bias: 20.0,
        shared,
    }
}

fn white(density: f64) -> Noise<f64> {
    Noise {
        white: density * density,
        ..Noise::none()
    }
}

/// Truth of a perfect reference at a rest, with the reading of the target.
fn force(k: usize, u: &Vector3<f64>, model: &ErrorModel<f64>) -> Force {
    Observation {
        interval: interval(k),
        regressor: SVector::from([u.x, u.y, u.z, 1.0]),
        reading: model.measure(u),
        reading_variance: Vector3::zeros(),
        truth_covariance: Matrix3::zeros(),
        sensitivity: SMatrix::zeros(),
    }
}

fn calibrated<T: Real>(
    observations: &[Force],
    inputs: &FitInputs<f64, 3>,
) -> Result<TriadFit<T, 3>, Unsolvable> {
    let noise = |n: &Noise<f64>| Noise {
        white: nalgebra::convert(n.white),
        flicker: nalgebra::convert(n.flicker),
        ..Noise::none()
    };
    let span = |i: &Interval<f64>| Interval {
        start: nalgebra::convert(i.start),
        end: nalgebra::convert(i.end),
    };
    let same: Vec<Observation<T, 4, 3>> = observations
        .iter()
        .map(|o| Observation {
            interval: span(&o.interval),
            regressor: cast(&o.regressor),
            reading: cast(&o.reading),
            reading_variance: cast(&o.reading_variance),
            truth_covariance: cast(&o.truth_covariance),
            sensitivity: cast(&o.sensitivity),
        })
        .collect();
    let known = FitInputs {
        noise: [0, 1, 2].map(|i| noise(&inputs.noise[i])),
        session: span(&inputs.session),
        nominal: cast(&inputs.nominal),
        largest_bias: nalgebra::convert(inputs.largest_bias),
        shared: cast(&inputs.shared),
    };
    fit::<T, 4, 3, 15>(&same, &known)
}

/// A sensor as it may come off a line, screwed in any way.
fn sensor() -> impl Strategy<Value = (ErrorModel<f64>, Rotation3<f64>)> {
    (vector(0.05), non_orthogonality(0.05), rotation(), vector(1.0)).prop_map(|(scale, l, mounting, bias)| {
        let k = Matrix3::from_diagonal(&scale.add_scalar(1.0));
        let matrix = k * l * mounting.matrix();
        (ErrorModel { matrix, bias }, mounting)
    })
}

/// Six faces, and more.
fn truths() -> impl Strategy<Value = Vec<Vector3<f64>>> {
    prop::collection::vec(direction(), 0..8)
        .prop_map(|more| faces().into_iter().chain(more).map(|up| up * STANDARD).collect())
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn a_sensor_without_noise_is_found_exactly((model, mounting) in sensor(), truths in truths(), flicker in prop_oneof![Just(0.0), Just(1e-8)]) {
        let observations: Vec<_> = truths.iter().enumerate().map(|(k, u)| force(k, u, &model)).collect();
        let noise = Noise { flicker, ..white(1e-4) };
        let known = inputs(truths.len(), &mounting, noise, Matrix3::identity() * 1e-12);
        let found = calibrated::<f64>(&observations, &known).expect("solvable");
        // The prior of 0.3 and 20 m/s^2 pulls by the square of the noise of a mean, 4e-5 m/s^2, over it.
        assert_close!(found.model.matrix, model.matrix, 1e-9);
        assert_close!(found.model.bias, model.bias, 1e-9);
        prop_assert_eq!(found.observed, [true; 12]);
        prop_assert_eq!(found.rank, 12);
        prop_assert!(found.chi_square < 1e-6);
        prop_assert_eq!(found.degrees_of_freedom as usize, 3 * truths.len() - 12);
        prop_assert!(observations.iter().all(|o| found.residual(o).amax() < 1e-8));
    }

    #[test]
    fn single_precision_finds_the_same_sensor_to_its_rounding((model, mounting) in sensor(), truths in truths(), seed in any::<u64>()) {
        let mut draws = Draws::new(seed);
        let observations: Vec<_> = truths.iter().enumerate().map(|(k, u)| {
            let mut observation = force(k, u, &model);
            observation.reading += draws.normals::<3>() * 4e-4;
            observation
        }).collect();
        let known = inputs(truths.len(), &mounting, white(1e-3), Matrix3::identity() * 1e-6);
        let double = calibrated::<f64>(&observations, &known).expect("solvable");
        let single = calibrated::<f32>(&observations, &known).expect("solvable");
        // Readings of 11 m/s^2 have a rounding of 1e-6; against six faces M errs by that over g, b by as much, and a few
        // dozen rotations of rows each add their own.
        assert_close!(single.model.matrix, cast::<f32, 3, 3>(&double.model.matrix), rounding::<f32>(20.0));
        assert_close!(single.model.bias, cast::<f32, 3, 1>(&double.model.bias), rounding::<f32>(20.0) * STANDARD);
        for i in 0..12 {
            let ratio = f64::from(single.covariance[(i, i)]) / double.covariance[(i, i)];
            prop_assert!((ratio - 1.0).abs() < 1e-4, "{}", ratio);
        }
        prop_assert_eq!((single.rank, single.observed), (double.rank, double.observed));
    }

    #[test]
    fn poses_in_a_plane_leave_one_column_of_m_at_its_nominal_value((model, _) in sensor(), silent in 0..3_usize) {
        let observations: Vec<_> = (0..12).map(|k| {
            let angle = core::f64::consts::TAU * k as f64 / 12.0;
            let mut up = Vector3::zeros();
            up[(silent + 1) % 3] = angle.cos();
            up[(silent + 2) % 3] = angle.sin();
            force(k, &(up * STANDARD), &model)
        }).collect();
        let nominal = Rotation3::identity();
        let known = inputs(12, &nominal, white(1e-3), Matrix3::identity() * 1e-12);
        let found = calibrated::<f64>(&observations, &known).expect("solvable");
        for i in 0..12 {
            prop_assert_eq!(found.observed[i], i >= 9 || i % 3 != silent, "{}", i);
        }
        for axis in 0..3 {
            prop_assert_eq!(found.model.matrix[(axis, silent)], nominal.matrix()[(axis, silent)]);
            let i = 3 * axis + silent;
            prop_assert!((found.covariance[(i, i)].sqrt() - 0.3).abs() < 1e-9);
        }
        prop_assert_eq!(found.rank, 9);
    }

    #[test]
    fn an_observation_that_is_not_finite_is_unsolvable((model, mounting) in sensor(), truths in truths(), bad in any::<prop::sample::Index>()) {
        let good: Vec<_> = truths.iter().enumerate().map(|(k, u)| force(k, u, &model)).collect();
        let known = inputs(truths.len(), &mounting, white(1e-3), Matrix3::identity() * 1e-12);
        let mut broken = good.clone();
        broken[bad.index(good.len())].reading.y = f64::NAN;
        prop_assert_eq!(calibrated::<f64>(&broken, &known).map(|fit| fit.rank), Err(Unsolvable));
        let mut broken = good;
        let at = bad.index(broken.len());
        broken[at].regressor[0] = f64::INFINITY;
        prop_assert_eq!(calibrated::<f64>(&broken, &known).map(|fit| fit.rank), Err(Unsolvable));
    }

    #[test]
    fn readings_without_any_noise_claimed_are_unsolvable((model, mounting) in sensor(), truths in truths()) {
        let observations: Vec<_> = truths.iter().enumerate().map(|(k, u)| force(k, u, &model)).collect();
        let known = inputs(truths.len(), &mounting, Noise::none(), Matrix3::identity() * 1e-12);
        prop_assert_eq!(calibrated::<f64>(&observations, &known).map(|fit| fit.rank), Err(Unsolvable));
    }

    #[test]
    fn no_observations_leave_the_nominal_sensor(mounting in rotation()) {
        let known = inputs(1, &mounting, white(1e-3), Matrix3::identity() * 1e-12);
        let found = calibrated::<f64>(&[], &known).expect("the prior");
        prop_assert_eq!(found.model.matrix, *mounting.matrix());
        prop_assert_eq!(found.model.bias, Vector3::zeros());
        prop_assert_eq!((found.rank, found.observed), (0, [false; 12]));
    }
}

/// Truth errors of all kinds in one session of an accelerometer.
struct Session {
    model: ErrorModel<f64>,
    mounting: Rotation3<f64>,
    noise: Noise<f64>,
    own: Correlated,
    count: usize,
}

impl Session {
    fn new(count: usize, noise: Noise<f64>) -> Self {
        let mounting = Rotation3::new(Vector3::new(0.02, -0.3, 1.1));
        let l = Matrix3::new(1.0, 0.0, 0.0, 0.01, 0.99995, 0.0, -0.02, 0.015, 0.99969);
        Self {
            model: ErrorModel {
                matrix: Matrix3::from_diagonal(&Vector3::new(1.01, 0.98, 1.003)) * l * mounting.matrix(),
                bias: Vector3::new(0.3, -0.2, 0.1),
            },
            mounting,
            noise,
            own: Correlated::new(count, |i, j| {
                noise.covariance(&interval(i), &interval(j), &session(count))
            }),
            count,
        }
    }

    /// Noise of each axis at each interval.
    fn readings(&self, draws: &mut Draws) -> Vec<Vector3<f64>> {
        let axes = [0, 1, 2].map(|_| self.own.draw(draws));
        (0..self.count)
            .map(|k| Vector3::new(axes[0][k], axes[1][k], axes[2][k]))
            .collect()
    }
}

/// Accelerometer at the six faces again and again. `shared` is the sigma of the bias of the reference, `single` that of
/// its noise at each rest, m/s^2.
fn force_runs(what: &str, noise: Noise<f64>, shared: f64, single: f64, seed: u64) -> (Calibration<12>, f64) {
    let count = 24;
    let session = Session::new(count, noise);
    let mut draws = Draws::new(seed);
    let mut calibration = Calibration::new();
    let mut chi_square = 0.0;
    let runs = 400;
    let known = inputs(
        count,
        &session.mounting,
        session.noise,
        Matrix3::identity() * (shared * shared).max(1e-14),
    );
    for _ in 0..runs {
        let bias = draws.normals::<3>() * shared;
        let observations: Vec<Force> = session
            .readings(&mut draws)
            .iter()
            .enumerate()
            .map(|(k, noise)| {
                let u = (faces()[k % 6] + draws.normals::<3>() * 0.02).normalize() * STANDARD;
                let mut observation = force(k, &u, &session.model);
                observation.reading += noise;
                // The reference reads u minus its error: the shared error s enters as u + D s.
                let said = u + bias + draws.normals::<3>() * single;
                observation.regressor.fixed_rows_mut::<3>(0).copy_from(&said);
                observation.sensitivity = -Matrix3::identity();
                observation.truth_covariance = Matrix3::identity() * (single * single);
                observation
            })
            .collect();
        let found = fit::<f64, 4, 3, 15>(&observations, &known).expect("solvable");
        chi_square += found.chi_square / f64::from(runs);
        calibration.push(error(&found.model, &session.model), &found.covariance);
    }
    calibration.check(what, seed);
    (calibration, chi_square)
}

fn error(found: &ErrorModel<f64>, truth: &ErrorModel<f64>) -> SVector<f64, 12> {
    let (m, b) = (found.matrix - truth.matrix, found.bias - truth.bias);
    SVector::from_fn(|i, _| if i < 9 { m[(i / 3, i % 3)] } else { b[i - 9] })
}

/// Coverage of 12 x 400 intervals, of which those of one run depend on each other.
fn covers(calibration: &Calibration<12>) {
    assert!(
        (0.935..0.965).contains(&calibration.coverage()),
        "{}",
        calibration.coverage()
    );
}

#[test]
fn errors_with_white_noise_are_those_of_the_covariance() {
    let (calibration, chi_square) = force_runs("accelerometer, white", white(1e-3), 0.0, 0.0, 111);
    covers(&calibration);
    // 72 rows less 12 unknowns; the mean of 400 errs by 0.55.
    assert!((chi_square - 60.0).abs() < 2.8, "{chi_square}");
}

#[test]
fn errors_of_single_and_shared_truth_are_as_the_covariance() {
    let (calibration, chi_square) = force_runs("accelerometer, truth errs", white(1e-3), 2e-3, 1e-3, 112);
    covers(&calibration);
    assert!((chi_square - 60.0).abs() < 4.0, "{chi_square}");
}

#[test]
fn an_accelerometer_with_flicker_errs_as_its_covariance_says() {
    let noise = Noise {
        flicker: 1e-6,
        ..white(1e-3)
    };
    let (calibration, chi_square) = force_runs("accelerometer, flicker", noise, 1e-3, 0.0, 113);
    covers(&calibration);
    assert!((chi_square - 60.0).abs() < 4.0, "{chi_square}");
}

#[test]
fn flicker_taken_for_white_noise_would_be_found_out() {
    // The law above has teeth: with the same noise, but its memory not known to the fit, intervals are wrong.
    let count = 24;
    let noise = Noise {
        flicker: 1e-6,
        ..white(1e-4)
    };
    let session = Session::new(count, noise);
    let mut draws = Draws::new(114);
    let known = inputs(count, &session.mounting, white(1e-4), Matrix3::identity() * 1e-14);
    let mut calibration = Calibration::<12>::new();
    for _ in 0..200 {
        let observations: Vec<Force> = session
            .readings(&mut draws)
            .iter()
            .enumerate()
            .map(|(k, noise)| {
                let mut observation = force(k, &(faces()[k % 6] * STANDARD), &session.model);
                observation.reading += noise;
                observation
            })
            .collect();
        let found = fit::<f64, 4, 3, 15>(&observations, &known).expect("solvable");
        calibration.push(error(&found.model, &session.model), &found.covariance);
    }
    assert!(calibration.ratio().max() > 2.0, "{:?}", calibration.ratio());
}

#[test]
fn a_gyroscope_with_g_sensitivity_errs_as_its_covariance_says() {
    let (count, runs, seed) = (25, 400, 115);
    let noise = Noise {
        flicker: 1e-10,
        ..white(2e-4)
    };
    let session = Session::new(count, noise);
    let mut draws = Draws::new(seed);
    let g = Matrix3::new(1.0, -0.5, 0.3, 0.2, 0.8, -0.4, 0.0, 0.6, -1.0) * 1e-4;
    let shared =
        Matrix6::from_diagonal(&SVector::from([1e-5, 1e-5, 1e-5, 4e-5, 4e-5, 4e-5]).map(|s: f64| s * s));
    let known = FitInputs {
        largest_bias: 1.0,
        ..inputs(count, &session.mounting, noise, shared)
    };
    let (mut calibration, mut coupling) = (Calibration::<12>::new(), Calibration::<9>::new());
    for _ in 0..runs {
        let errors = SVector::<f64, 6>::from_fn(|i, _| shared[(i, i)].sqrt() * draws.normal());
        let observations: Vec<Rate> = session
            .readings(&mut draws)
            .iter()
            .enumerate()
            .map(|(k, noise)| {
                // Even ones are rests under the Earth, odd ones turns about each axis in turn, both ways.
                let turning = k % 2 == 1;
                let attitude = Rotation3::new(draws.normals::<3>());
                let mut sensitivity = SMatrix::<f64, 3, 6>::zeros();
                if turning {
                    sensitivity
                        .fixed_columns_mut::<3>(0)
                        .copy_from(&-Matrix3::identity());
                } else {
                    sensitivity.fixed_columns_mut::<3>(3).copy_from(attitude.matrix());
                }
                let said = if turning {
                    faces()[(k / 2) % 6] * 0.8
                } else {
                    Vector3::zeros()
                };
                let truth = said + sensitivity * errors;
                let force = draws.direction() * STANDARD;
                let mut regressor = SVector::from([0.0, 0.0, 0.0, 1.0, force.x, force.y, force.z]);
                regressor.fixed_rows_mut::<3>(0).copy_from(&said);
                Observation {
                    interval: interval(k),
                    regressor,
                    reading: session.model.matrix * truth + session.model.bias * 0.01 + g * force + noise,
                    reading_variance: Vector3::zeros(),
                    truth_covariance: Matrix3::zeros(),
                    sensitivity,
                }
            })
            .collect();
        let found = fit::<f64, 7, 6, 27>(&observations, &known).expect("solvable");
        let truth = ErrorModel {
            bias: session.model.bias * 0.01,
            ..session.model
        };
        calibration.push(error(&found.model, &truth), &found.covariance);
        let (g_found, g_sigma) = found.g_sensitivity.expect("asked for");
        let (apart, variance) = (g_found - g, g_sigma.component_mul(&g_sigma));
        coupling.push(
            SVector::from_iterator(apart.iter().copied()),
            &SMatrix::from_diagonal(&SVector::from_iterator(variance.iter().copied())),
        );
    }
    calibration.check("gyroscope with g-sensitivity", seed);
    coupling.check_errors("g-sensitivity", seed);
    covers(&calibration);
}
