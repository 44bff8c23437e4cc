use super::*;
use crate::redundancy::fit::joint_moments::JointMoments;
use crate::redundancy::fit::residual::{FORCE_LAYOUT, FORCE_PACKED, RATE_LAYOUT, RATE_PACKED};
use crate::redundancy::samples::pair::{FORCE_CHANNELS, MotionPair, RATE_CHANNELS};
use proptest::prelude::*;

fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-limit..limit).prop_map(Vector3::from)
}

fn matrix(limit: f64) -> impl Strategy<Value = Matrix3<f64>> {
    prop::array::uniform9(-limit..limit).prop_map(|m| Matrix3::from_row_slice(&m))
}

fn error(m: Matrix3<f64>, b: Vector3<f64>, r: Vector3<f64>) -> RelativeError<f64> {
    RelativeError::new(Matrix3::identity() + m, b, r).unwrap()
}

/// A hundred pairs without noise, with the error `truth`, in a motion that excites all parameters.
fn pairs(
    truth: &RelativeError<f64>,
    stored: &RelativeError<f64>,
    along: &Matrix3<f64>,
    noise: f64,
) -> (
    JointMoments<f64, FORCE_CHANNELS, FORCE_PACKED>,
    JointMoments<f64, RATE_CHANNELS, RATE_PACKED>,
) {
    let (mut forces, mut rates) = (JointMoments::new(), JointMoments::new());
    for i in 0..100 {
        let t = f64::from(i) * 0.05;
        let wave = |k: f64| {
            Vector3::new(
                (k * t).sin(),
                (1.7 * k * t + 1.0).sin(),
                (2.3 * k * t + 2.0).cos(),
            )
        };
        let f = along * (wave(3.0) * 3.0) + Vector3::new(0.0, 0.0, 9.8);
        let w = along * wave(2.0);
        let lever = wave(4.1).cross_matrix() * 5.0 + w.cross_matrix() * w.cross_matrix();
        // The times are irregular, and independent of the motion.
        let jitter = |k: f64| (1e4 * (k * t + 0.3).sin()).fract() - 0.5;
        let noise = Vector3::new(jitter(5.1), jitter(7.7), jitter(9.2)) * (noise * 12.0_f64.sqrt());
        let pair = MotionPair {
            first: [f, w],
            lever,
            second: [
                truth.predict(&(f + lever * truth.lever_arm)) + noise,
                truth.predict(&w),
            ],
        };
        forces.push(&pair.forces(t, stored));
        rates.push(&pair.rates(t, stored));
    }
    (forces, rates)
}

const NOISELESS: PrimaryNoise<f64> = PrimaryNoise {
    reading: Matrix3::from_array_storage(nalgebra::ArrayStorage([[0.0; 3]; 3])),
    angular_acceleration: Vector3::new(0.0, 0.0, 0.0),
};

fn problem<'a>(
    pairs: &'a dyn PairMoments<f64>,
    layout: Layout,
    stored: &'a RelativeError<f64>,
) -> FitProblem<'a, f64> {
    FitProblem {
        pairs,
        rests: None,
        layout,
        axes: [true; 3],
        complete: true,
        noise: &NOISELESS,
        stored,
        highest: FitModel::AffineAndLeverArm,
        excitation: 0.1,
        lever_arm_excitation: layout.lever.map(|_| 0.5),
    }
}

/// Runs a fit to the end.
fn solve(problem: &FitProblem<'_, f64>, near: &RelativeError<f64>) -> Fit<f64> {
    let (mut near, mut found) = (*near, Fit::none());
    let mut states = (0..).map(|taken| problem.go_on(&mut near, taken, &mut found));
    let end = states.find(|state| *state != FitProgress::GoesOn);
    assert_eq!(end, Some(FitProgress::Found));
    found
}

proptest! {
    #[test]
    fn without_noise_a_fit_finds_every_error_from_any_stored_one(
        m in matrix(0.02), b in vector(0.5), r in vector(0.2), m0 in matrix(0.02), b0 in vector(0.5), r0 in vector(0.2)
    ) {
        let (truth, stored) = (error(m, b, r), error(m0, b0, r0));
        let (forces, rates) = pairs(&truth, &stored, &Matrix3::identity(), 0.0);
        let fit = solve(&problem(&forces, FORCE_LAYOUT, &stored), &stored);
        prop_assert_eq!((fit.fit_model, fit.directions), (FitModel::AffineAndLeverArm, 3));
        // Three steps of Gauss and Newton leave this error.
        prop_assert!((fit.error.matrix - truth.matrix).amax() < 1e-6, "{}", fit.error.matrix - truth.matrix);
        let gravity = Vector3::new(0.0, 0.0, 9.8);
        prop_assert!((fit.error.predict(&gravity) - truth.predict(&gravity)).amax() < 1e-5);
        prop_assert!((fit.error.lever_arm - truth.lever_arm).amax() < 1e-5);
        let fit = solve(&problem(&rates, RATE_LAYOUT, &stored), &stored);
        prop_assert_eq!((fit.fit_model, fit.directions), (FitModel::Affine, 3));
        prop_assert!((fit.error.matrix - truth.matrix).amax() < 1e-9);
        prop_assert!((fit.error.bias - truth.bias).amax() < 1e-9);
    }
    #[test]
    fn a_fit_ends_within_hundredths_of_a_sigma_from_any_start(
        m in matrix(0.02), b in vector(0.5), r in vector(0.2), off in matrix(1e-3), away in vector(0.005)
    ) {
        let (truth, stored) = (error(m, b, r), RelativeError::none());
        let (forces, _) = pairs(&truth, &stored, &Matrix3::identity(), 0.05);
        let problem = problem(&forces, FORCE_LAYOUT, &stored);
        let far = solve(&problem, &stored);
        let near = solve(&problem, &error(m + off, b, r + away));
        let apart = far.error.numbers().zip(near.error.numbers()).zip(far.variances());
        for ((far, near), variance) in apart {
            prop_assert!((far - near).abs() < 0.06 * variance.sqrt(), "{far} {near} {}", variance.sqrt());
        }
    }

    #[test]
    fn a_lever_arm_without_rotation_keeps_its_stored_value(
        m in matrix(0.02), b in vector(0.5), r in vector(0.2), away in vector(0.2)
    ) {
        let (truth, stored) = (error(m, b, r), error(Matrix3::zeros(), Vector3::zeros(), r));
        // A rotation about one axis does not show the arm along it.
        let about = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0));
        let mut forces = JointMoments::<f64, FORCE_CHANNELS, FORCE_PACKED>::new();
        for i in 0..100 {
            let t = f64::from(i) * 0.05;
            let f = Vector3::new((3.0 * t).sin(), (5.0 * t).cos(), (4.0 * t).sin()) * 3.0;
            let turning = about * Vector3::new(0.0, 0.0, 2.0 * (2.3 * t).sin());
            let lever = turning.cross_matrix() * 3.0 + turning.cross_matrix() * turning.cross_matrix();
            let pair = MotionPair {
                first: [f, turning],
                lever,
                second: [truth.predict(&(f + lever * truth.lever_arm)), truth.predict(&turning)],
            };
            forces.push(&pair.forces(t, &stored));
        }
        let found = solve(&problem(&forces, FORCE_LAYOUT, &stored), &error(m, b, away));
        prop_assert!((found.error.lever_arm.z - r.z).abs() < 1e-6, "{} {}", found.error.lever_arm, r);
        prop_assert!((found.error.lever_arm - r).amax() < 1e-4, "{} {}", found.error.lever_arm, r);
    }
}
