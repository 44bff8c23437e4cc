extern crate std;

use std::vec::Vec;

use super::*;
use crate::redundancy::draws::Draw;

const H: f64 = 0.05;

fn flight(t: f64) -> [Vector3<f64>; 2] {
    let w = Vector3::new((0.9 * t).sin(), 0.7 * (1.3 * t).cos(), 0.4 * (0.31 * t).sin());
    let f = Vector3::new(
        2.0 * (0.7 * t).sin(),
        1.5 * (1.1 * t).sin(),
        9.8 + (0.5 * t).cos(),
    );
    [f, w]
}

/// Seconds from a fault until a unit is found faulty, with that unit; `None` for ten minutes without.
fn fly<const N: usize>(
    seed: u64,
    fault: impl Fn(usize, f64) -> [Vector3<f64>; 2],
    until: f64,
) -> Vec<(f64, usize, Sensor)>
where
    Units<N>: UnitCount,
{
    let mut isolator = FaultIsolator::<f64, N>::new();
    let mut draw = Draw(seed);
    let mut found = Vec::new();
    let scale: [Vector3<f64>; N] =
        core::array::from_fn(|_| Vector3::new(draw.normal(), draw.normal(), draw.normal()) * 5e-4);
    for k in 0..(until / H) as u64 {
        let t = k as f64 * H;
        let [f, w] = flight(t);
        let units: [Option<UnitReading<f64>>; N] = core::array::from_fn(|i| {
            let [df, dw] = fault(i, t);
            let mut noise = |s: f64| Vector3::new(draw.normal(), draw.normal(), draw.normal()) * s;
            let f = f.component_mul(&(Vector3::repeat(1.0) + scale[i])) + noise(0.008) + df;
            let w = w + noise(0.0005) + dw;
            Some(UnitReading {
                reading: [f, w],
                scatter: [0.02, 0.0014],
                at_rest: None,
                votes: [true; 2],
                known: [true; 2],
                calibrated: [true; 2],
                matrix_shown: [true; 2],
                place: 0.0,
                residual: [1e-5, 1e-8],
                uncertainty: [0.0; 2],
                interval: 0.005,
            })
        });
        let window = SetWindow {
            units: &units,
            number: k,
            span: 50_000,
            steps: &[UnitSteps::none(); N],
            mounted: &core::array::from_fn(|i| MountedUnit::new(i as u64)),
            length: H,
            gravity: 9.8,
            noise_ratio: 9.0,
            means_only: false,
            per_kelvin: crate::redundancy::settings::ForceAndRate {
                specific_force: 0.0,
                angular_rate: 0.0,
            },
            tolerated: crate::redundancy::settings::ForceAndRate {
                specific_force: 0.05,
                angular_rate: 0.005,
            },
        };
        isolator.look(&window, None, &mut |sensor, event| {
            if let IsolationEvent::OutOfFamily { unit, .. } = event {
                found.push((t, unit, sensor));
            }
        });
    }
    found
}

#[test]
fn nobody_is_faulty_in_ten_minutes_of_health() {
    for seed in 0..5 {
        let found = fly::<3>(seed, |_, _| [Vector3::zeros(); 2], 600.0);
        assert!(found.is_empty(), "seed {seed}: {found:?}");
    }
}

#[test]
fn a_jump_is_found_within_a_second_and_so_is_its_unit() {
    for seed in 0..20 {
        let unit = seed as usize % 4;
        let jump = |i: usize, t: f64| {
            let x = if i == unit && t >= 100.0 { 0.3 } else { 0.0 };
            [Vector3::new(x, 0.0, 0.0), Vector3::zeros()]
        };
        let found = fly::<4>(seed, jump, 110.0);
        assert!(
            matches!(found[..], [(t, found, Sensor::Accelerometer), ..] if found == unit && t < 101.0),
            "seed {seed}: {found:?}"
        );
    }
}

#[test]
fn a_ramp_is_found_before_it_is_large() {
    for seed in 0..10 {
        let unit = seed as usize % 3;
        let ramp = |i: usize, t: f64| {
            let x = if i == unit {
                0.005 * (t - 100.0).max(0.0)
            } else {
                0.0
            };
            [Vector3::new(0.0, x, 0.0), Vector3::zeros()]
        };
        let found = fly::<3>(seed, ramp, 200.0);
        assert!(
            matches!(found[..], [(t, found, Sensor::Accelerometer), ..] if found == unit && t < 140.0),
            "seed {seed}: {found:?}"
        );
    }
}

#[test]
fn no_reading_before_a_calibration_is_evidence_against_it() {
    let mut isolator = FaultIsolator::<f64, 2>::new();
    let rates = [Vector3::new(1e-3, 0.0, 0.0), Vector3::new(0.03, -0.01, 0.0)];
    for (evidence, rate) in isolator.evidence.iter_mut().zip(rates) {
        evidence.resting_rate = rate;
        let force = Vector3::new(0.0, 0.0, 9.8) + rate * 10.0;
        for _ in 0..100 {
            evidence.gravity.push(&force, &rate, 9.8, H);
        }
    }
    for sensor in SENSORS {
        isolator.recalibrated(sensor, 1);
    }
    let [primary, secondary] = &isolator.evidence;
    assert_eq!(secondary.gravity, primary.gravity);
    assert_eq!(secondary.resting_rate, primary.resting_rate);
    // A trim takes as much off the zero rate as off each reading.
    let change = Vector3::new(2e-3, 0.0, 0.0);
    isolator.trimmed(Sensor::Gyroscope, 1, &change, false);
    assert_eq!(isolator.evidence[1].resting_rate, rates[0] - change);
}
