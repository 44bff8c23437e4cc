//! Consistency of accelerometer and gyroscope of one unit: they measure the same turns.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tumble_lab::acquisition::consistency::{GyroscopeConsistency, compare_gyroscope};

use super::common::{Draws, cases, direction};
use super::stream::{Phase, Unit};
use super::unit::{Recording, on_the_grid, poor_model, six_faces};

/// Quarter turns with other turns among them, so that no exchange of axes goes unseen.
fn schedule() -> Vec<Phase> {
    let mut schedule = six_faces(2.0);
    for turn in [
        Vector3::new(0.7, 0.4, 0.0),
        Vector3::new(-0.3, 1.0, 0.2),
        Vector3::new(0.5, -0.2, 1.2),
    ] {
        schedule.extend([Phase::Turn(turn, 1.5), Phase::Rest(2.0)]);
    }
    on_the_grid(schedule)
}

fn consistency(change: impl Fn(Vector3<f64>) -> Vector3<f64>, seed: u64) -> GyroscopeConsistency {
    let recording = Recording::of(&schedule(), &Unit::noisy(0.02, 0.002), &mut Draws::new(seed));
    compare_gyroscope(&recording.change(|f| f, change).acquire())
}

fn permutation(order: [usize; 3], signs: [f64; 3]) -> Matrix3<f64> {
    // Case axis i is so much of sensor axis order[i].
    let mut matrix = Matrix3::zeros();
    for i in 0..3 {
        matrix[(i, order[i])] = signs[i];
    }
    matrix
}

#[test]
fn a_good_gyroscope_is_consistent() {
    assert_eq!(consistency(|w| w, 1), GyroscopeConsistency::Consistent);
}

#[test]
fn a_poor_gyroscope_with_a_large_bias_is_consistent() {
    let model = poor_model(0.3);
    assert_eq!(
        consistency(|w| model.measure(&w), 2),
        GyroscopeConsistency::Consistent
    );
}

#[test]
fn degrees_taken_for_radians_and_radians_for_degrees_are_told() {
    let degree = 180.0 / core::f64::consts::PI;
    let as_found = consistency(|w| w * degree, 3);
    assert!(
        matches!(as_found, GyroscopeConsistency::Scaled(scale) if (scale - degree).abs() < 1e-12),
        "{as_found:?}"
    );
    let as_found = consistency(|w| w / degree, 4);
    assert!(
        matches!(as_found, GyroscopeConsistency::Scaled(scale) if (scale * degree - 1.0).abs() < 1e-12),
        "{as_found:?}"
    );
}

#[test]
fn every_exchange_of_axes_and_signs_is_told_as_what_it_is() {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    for (k, order) in orders.into_iter().enumerate() {
        for signs in 0..8_usize {
            let sign = |i: usize| if signs & (1 << i) == 0 { 1.0 } else { -1.0 };
            let signs = [sign(0), sign(1), sign(2)];
            let case_from_sensor = permutation(order, signs);
            let found = consistency(|w| case_from_sensor.transpose() * w, 5 + k as u64);
            if case_from_sensor == Matrix3::identity() {
                assert_eq!(found, GyroscopeConsistency::Consistent);
            } else {
                let expected = [0, 1, 2].map(|i| (order[i], signs[i]));
                assert_eq!(
                    found,
                    GyroscopeConsistency::Permuted(expected),
                    "{case_from_sensor}"
                );
            }
        }
    }
}

#[test]
fn fewer_than_three_turns_are_too_few_to_compare() {
    let schedule = [Phase::Rest(2.0), Phase::Turn(Vector3::x(), 1.0), Phase::Rest(2.0)];
    let recording = Recording::of(&schedule, &Unit::noisy(0.02, 0.002), &mut Draws::new(6));
    assert_eq!(
        compare_gyroscope(&recording.acquire()),
        GyroscopeConsistency::Unknown
    );
}

#[test]
fn half_turns_that_end_alike_either_way_round_do_not_convict() {
    let half = core::f64::consts::PI;
    let mut schedule = vec![Phase::Rest(2.0)];
    for axis in [
        Vector3::x(),
        Vector3::y(),
        Vector3::x(),
        Vector3::y(),
        Vector3::x(),
    ] {
        schedule.extend([Phase::Turn(axis * half, 2.0), Phase::Rest(2.0)]);
    }
    let recording = Recording::of(&schedule, &Unit::noisy(0.02, 0.002), &mut Draws::new(7));
    assert_eq!(
        compare_gyroscope(&recording.acquire()),
        GyroscopeConsistency::Consistent
    );
}

#[test]
fn a_gyroscope_that_measures_other_turns_is_inconsistent() {
    // Every other turn half as large, every other twice: no single change of units or axes explains it.
    let found = consistency(
        |w| Vector3::new(0.4 * w.x - 0.9 * w.y, 2.0 * w.z + 0.7 * w.x, 0.5 * w.y),
        8,
    );
    assert!(
        matches!(found, GyroscopeConsistency::Inconsistent(angle) if angle > 15.0),
        "{found:?}"
    );
}

proptest! {
    #![proptest_config(cases(16))]

    #[test]
    fn a_gyroscope_misaligned_by_some_degrees_is_consistent(axis in direction(), angle in 0.0..0.12_f64, seed in any::<u64>()) {
        let off = nalgebra::Rotation3::new(axis * angle);
        prop_assert_eq!(consistency(|w| off * w, seed), GyroscopeConsistency::Consistent);
    }
}
