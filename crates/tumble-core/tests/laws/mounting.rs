//! The mounting angle of the reference.

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use tumble_core::gravity::STANDARD;
use tumble_core::real::Real;
use tumble_core::turntable::mounting::{MountingFit, PoseMean, fit_mounting};

use crate::common::{Calibration, Draws, assert_close, cast, direction, faces, rotation, rounding, vector};

fn poses<T: Real>(measured: &[Vector3<f64>], ups: &[Vector3<f64>], sigma: f64) -> Vec<PoseMean<T>> {
    let pose = |(measured, up): (&Vector3<f64>, &Vector3<f64>)| PoseMean {
        measured: cast(measured),
        up: cast(up),
        sigma: nalgebra::convert(sigma),
    };
    measured.iter().zip(ups).map(pose).collect()
}

fn fitted<T: Real>(measured: &[Vector3<f64>], ups: &[Vector3<f64>], sigma: f64) -> Option<MountingFit<T>> {
    fit_mounting(&poses(measured, ups, sigma), nalgebra::convert(STANDARD))
}

proptest! {
    #[test]
    fn mounting_and_bias_of_ideal_poses_are_found_exactly(
        turn in rotation(), bias in vector(1.0), more in prop::collection::vec(direction(), 0..6)
    ) {
        let ups: Vec<_> = faces().into_iter().chain(more).collect();
        let measured: Vec<_> = ups.iter().map(|up| turn * up * STANDARD + bias).collect();
        let fit = fitted::<f64>(&measured, &ups, 1e-3).expect("six faces");
        assert_close!(*fit.rotation.matrix(), *turn.matrix(), 1e-13);
        assert_close!(fit.bias, bias, 1e-12);
        for pose in poses(&measured, &ups, 1e-3) {
            prop_assert!(fit.residual(&pose, STANDARD).amax() < 1e-12);
            prop_assert!(fit.table_error(&pose, STANDARD) < 1e-12);
        }
        // Never better than the noise of the means.
        prop_assert!((fit.pose_variance - 1e-6).abs() < 1e-15);
        let single = fitted::<f32>(&measured, &ups, 1e-3).expect("six faces");
        assert_close!(*single.rotation.matrix(), cast::<f32, 3, 3>(turn.matrix()), rounding::<f32>(10.0));
        assert_close!(single.bias, cast::<f32, 3, 1>(&bias), rounding::<f32>(10.0) * STANDARD);
    }

    #[test]
    fn a_table_that_errs_at_one_pose_is_found_out_there(tip in 0.01..0.1_f64, which in 0..24_usize, across in direction()) {
        let ups: Vec<_> = faces().iter().cycle().take(24).copied().collect();
        let axis = (across - ups[which] * ups[which].dot(&across)).try_normalize(0.3);
        prop_assume!(axis.is_some());
        let tipped = Rotation3::new(axis.unwrap_or_default() * tip);
        let mut measured: Vec<_> = ups.iter().map(|up| up * STANDARD).collect();
        measured[which] = tipped * measured[which];
        let fit = fitted::<f64>(&measured, &ups, 1e-4).expect("six faces");
        let errors: Vec<f64> = poses(&measured, &ups, 1e-4).iter().map(|pose| fit.table_error(pose, STANDARD)).collect();
        for (k, error) in errors.iter().enumerate() {
            // One pose in 24 takes rotation and bias along by a twelfth of its error at most.
            let expected = if k == which { tip } else { 0.0 };
            prop_assert!((error - expected).abs() < 0.12 * tip, "{} {}", error, expected);
        }
    }

    #[test]
    fn poses_along_one_line_determine_no_mounting(up in direction(), count in 0..8_usize, bias in vector(1.0)) {
        let ups: Vec<_> = (0..count).map(|k| if k % 2 == 0 { up } else { -up }).collect();
        let measured: Vec<_> = ups.iter().map(|up| up * STANDARD + bias).collect();
        prop_assert!(fitted::<f64>(&measured, &ups, 1e-3).is_none());
        prop_assert!(fitted::<f32>(&measured, &ups, 1e-3).is_none());
    }
}

/// Mounting found over many sessions with errors of the table, rad, and noise, m/s^2; and the mean of the variance of
/// a pose that was claimed.
fn sessions(count: usize, table: f64, noise: f64, seed: u64) -> (Calibration<3>, f64) {
    let mut draws = Draws::new(seed);
    let turn = Rotation3::new(Vector3::new(0.05, -0.02, 0.03));
    let ups: Vec<_> = faces().iter().cycle().take(count).copied().collect();
    let mut calibration = Calibration::new();
    let mut variance = 0.0;
    let runs = 3000;
    for _ in 0..runs {
        let measured: Vec<_> = ups
            .iter()
            .map(|up| {
                turn * (Rotation3::new(draws.normals::<3>() * table) * up) * STANDARD
                    + draws.normals::<3>() * noise
            })
            .collect();
        let fit = fitted::<f64>(&measured, &ups, noise).expect("six faces");
        calibration.push((fit.rotation * turn.inverse()).scaled_axis(), &fit.covariance);
        variance += fit.pose_variance / f64::from(runs);
    }
    (calibration, variance)
}

#[test]
fn table_errors_scatter_the_mounting_by_its_covariance() {
    let (calibration, variance) = sessions(6, 1e-3, 1e-4, 101);
    calibration.check_errors("mounting, six poses, table", 101);
    // Seven degrees of freedom each time.
    let expected = (1e-3 * STANDARD).powi(2) + 1e-8;
    assert!((variance / expected - 1.0).abs() < 0.06, "{variance} {expected}");
    // The scatter is known from seven numbers: fewer intervals hold the truth than with a known one, 91 of 100.
    assert!(
        (0.89..0.94).contains(&calibration.coverage()),
        "{}",
        calibration.coverage()
    );
    let (calibration, _) = sessions(24, 1e-3, 1e-4, 102);
    calibration.check_errors("mounting, 24 poses, table", 102);
    assert!(
        (0.93..0.96).contains(&calibration.coverage()),
        "{}",
        calibration.coverage()
    );
}

#[test]
fn noise_scatters_the_mounting_by_at_most_its_covariance() {
    let (calibration, variance) = sessions(24, 0.0, 1e-3, 103);
    // Never less than the noise, and by chance up to a third more.
    assert!((1.0..1.2).contains(&(variance / 1e-6)), "{variance}");
    assert!(calibration.bias().amax() < 5.0);
    let ratio = calibration.ratio();
    assert!(
        ratio.iter().all(|ratio| (0.87..1.03).contains(ratio)),
        "{ratio:?}"
    );
}
