//! Laws of the magnetometer, on readings whose truth is known.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use tumble_core::model::{ErrorModel, ModelCovariance};

use super::calibration::rest_points;
use super::turned::turned;
use super::{FieldReading, FieldReadings, FieldSamples, FieldSettings, MagnetometerError, Upward, fit_field};
use crate::constant_length::directions::covering;
use crate::simulate::stream::{StreamPurpose, normal_vector, stream};

const STRENGTH: f64 = 48.0;
const DIP: f64 = 1.1;
const SIGMA: f64 = 0.05;

fn truth() -> ErrorModel<f64> {
    let mounting = Rotation3::from_euler_angles(0.3, -0.2, 2.9);
    ErrorModel {
        matrix: Matrix3::new(1.1, 0.0, 0.0, 0.05, 0.9, 0.0, -0.03, 0.08, 1.05) * mounting.matrix(),
        bias: Vector3::new(40.0, -25.0, 12.0),
    }
}

/// Attitudes of a unit, all over.
fn attitudes(count: u32) -> Vec<UnitQuaternion<f64>> {
    covering(count)
        .enumerate()
        .map(|(k, axis)| {
            UnitQuaternion::from_scaled_axis(axis * (0.9 * k as f64 % 3.0))
                * UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 1.7 * k as f64))
        })
        .collect()
}

/// Readings at attitudes `case_from_world`.
fn readings(attitudes: &[UnitQuaternion<f64>], sigma: f64, current: Vector3<f64>) -> FieldReadings {
    let field = Vector3::new(DIP.cos(), 0.0, -DIP.sin()) * STRENGTH;
    let mut noise = stream(7, 0, StreamPurpose::GyroscopeWhite);
    let each = attitudes.iter().enumerate().map(|(k, attitude)| {
        let flowing = (k % 3) as f64;
        FieldReading {
            mean: truth().measure(&(attitude * field))
                + current * flowing
                + normal_vector(&mut noise) * sigma,
            variance: Vector3::repeat(SIGMA * SIGMA),
            current: flowing,
            up: Some(Upward::exact(attitude * Vector3::z())),
        }
    });
    FieldReadings {
        readings: each.collect(),
        accelerometer: ModelCovariance::zeros(),
    }
}

fn known() -> FieldSettings {
    FieldSettings {
        strength: Some(STRENGTH),
        current: false,
    }
}

#[test]
fn iron_and_mounting_are_found_with_the_dip() {
    let data = readings(&attitudes(18), 0.0, Vector3::zeros());
    let found = fit_field(&data, &known()).expect("solvable");
    assert!(
        (found.model.matrix - truth().matrix).amax() < 1e-4,
        "{}",
        found.model.matrix
    );
    assert!(
        (found.model.bias - truth().bias).amax() < 1e-2,
        "{}",
        found.model.bias
    );
    assert!((found.dip().expect("aligned") - DIP).abs() < 1e-4);
}

#[test]
fn without_a_field_strength_only_ratios_are_found() {
    let data = readings(&attitudes(18), 0.0, Vector3::zeros());
    let found = fit_field(&data, &FieldSettings::default()).expect("solvable");
    let factor = truth().matrix.determinant().cbrt();
    assert!((found.model.matrix * factor - truth().matrix).amax() < 1e-4);
    assert!((found.strength - STRENGTH * factor).abs() < 1e-2);
    assert!((found.model.matrix.determinant() - 1.0).abs() < 1e-12);
    assert!(found.covariance[(16, 16)] > 0.0);
}

#[test]
fn current_has_a_response_of_its_own() {
    let response = Vector3::new(1.5, -0.7, 0.3);
    let data = readings(&attitudes(24), 0.0, response);
    let settings = FieldSettings {
        current: true,
        ..known()
    };
    let found = fit_field(&data, &settings).expect("solvable");
    assert!((found.current.expect("asked for") - response).amax() < 1e-3);
    let steady = readings(&attitudes(24), 0.0, Vector3::zeros());
    let still: Vec<_> = steady
        .readings
        .iter()
        .map(|each| FieldReading {
            current: 2.0,
            ..*each
        })
        .collect();
    let refusal = fit_field(
        &FieldReadings {
            readings: still,
            ..steady
        },
        &settings,
    );
    assert!(matches!(refusal, Err(MagnetometerError::ReadingsLeaveOpen { shares }) if shares[12] > 0.1));
}

#[test]
fn a_reading_near_metal_is_found_and_left_out() {
    let mut data = readings(&attitudes(20), SIGMA, Vector3::zeros());
    data.readings[4].mean += Vector3::new(3.0, 2.0, -2.0);
    let found = fit_field(&data, &known()).expect("solvable");
    assert_eq!(found.used, (0..20).filter(|k| *k != 4).collect::<Vec<_>>());
    assert!(found.chances[4] < 1e-6 && found.weights[4] == 0.0);
    assert!((found.model.bias - truth().bias).amax() < 0.2);
}

#[test]
fn the_dip_of_a_field_that_is_cut_off_is_an_angle() {
    let mut data = readings(&attitudes(20), SIGMA, Vector3::zeros());
    data.readings[4].mean = data.readings[4].mean * 0.85 + truth().bias * 0.15;
    let found = fit_field(&data, &known()).expect("solvable");
    let points = rest_points(&found, &data, &[(0.0, 1.0); 20]);
    let (cut, cut_sigma) = points[4].dip.expect("aligned");
    assert!(points[4].disturbed && cut.abs() < PI && cut_sigma < PI);
    for (k, point) in points.iter().enumerate().filter(|(k, _)| *k != 4) {
        let (dip, sigma) = point.dip.expect("aligned");
        assert!(dip.abs() < 5.0 * sigma && sigma < 0.01, "{k}: {dip} {sigma}");
    }
}

#[test]
fn turning_level_leaves_the_vertical_open() {
    let level: Vec<_> = (0..40)
        .map(|k| UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.4 * f64::from(k))))
        .collect();
    let found = fit_field(&readings(&level, SIGMA, Vector3::zeros()), &known());
    assert!(
        matches!(
            found,
            Err(MagnetometerError::Flat | MagnetometerError::ReadingsLeaveOpen { .. })
        ),
        "{found:?}"
    );
}

#[test]
fn errors_are_as_large_as_their_sigmas() {
    let (mut squares, mut expected) = (0.0, 0.0);
    for seed in 0..40 {
        let mut data = readings(&attitudes(20), 0.0, Vector3::zeros());
        let mut noise = stream(100 + seed, 0, StreamPurpose::GyroscopeWhite);
        for reading in &mut data.readings {
            reading.mean += normal_vector(&mut noise) * SIGMA;
        }
        let found = fit_field(&data, &known()).expect("solvable");
        let errors = (found.model.matrix - truth().matrix).norm_squared() * STRENGTH.powi(2)
            + (found.model.bias - truth().bias).norm_squared();
        let variances = found.covariance.diagonal();
        squares += errors;
        expected += variances.rows(0, 9).sum() * STRENGTH.powi(2) + variances.rows(9, 3).sum();
    }
    let ratio = squares / expected;
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn a_hand_turned_log_needs_no_rest() {
    let mut noise = stream(3, 0, StreamPurpose::GyroscopeWhite);
    let field = Vector3::new(DIP.cos(), 0.0, -DIP.sin()) * STRENGTH;
    let samples: Vec<[f64; 3]> = (0..2000)
        .map(|k| {
            let t = 0.02 * f64::from(k);
            let attitude = UnitQuaternion::from_scaled_axis(Vector3::new(0.7 * t, 0.0, 0.0))
                * UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 1.1 * t, 0.3 * t));
            (truth().measure(&(attitude * field)) + normal_vector(&mut noise) * 0.4).into()
        })
        .collect();
    let time: Vec<f64> = (0..2000).map(|k| 0.02 * f64::from(k)).collect();
    let samples = FieldSamples {
        time: &time,
        field: &samples,
        current: &[],
    };
    let found = turned(&samples, &known()).expect("solvable");
    assert!((found.scatter - 0.4).abs() < 0.03, "{}", found.scatter);
    assert!((0.8..1.5).contains(&found.correlated), "{}", found.correlated);
    let error = found.fit.model.bias - truth().bias;
    let sigmas = found.fit.covariance.diagonal().map(f64::sqrt);
    for axis in 0..3 {
        assert!(
            error[axis].abs() < 4.0 * sigmas[9 + axis],
            "{error} {}",
            sigmas[9 + axis]
        );
    }
    assert!(found.blocks.iter().all(|block| block.chance >= 1e-3));
}
