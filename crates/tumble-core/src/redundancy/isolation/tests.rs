extern crate std;

use std::vec::Vec;

use nalgebra::Matrix3;

use super::*;
use crate::redundancy::draws::{Draw, sound_reading};

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
            Some(sound_reading(f, w))
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
            evidence.gravity.push(&force, &rate, &Vector3::z(), 9.8, H);
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

/// Flight of a quadrotor: its thrust, along its third axis, makes all of its acceleration.
struct Quadrotor {
    waves: [[f64; 3]; 6],
    yaw: [f64; 2],
}

impl Quadrotor {
    fn drawn(draw: &mut Draw) -> Self {
        let mut wave = || {
            let frequency = 0.15 + 0.5 * (0.5 + 0.5 * (draw.normal() * 3.0).sin());
            [draw.normal() * 2.5, frequency, draw.normal() * 3.0]
        };
        Self {
            waves: core::array::from_fn(|_| wave()),
            yaw: [0.3 * draw.normal(), draw.normal()],
        }
    }

    /// Specific force, m/s^2, and attitude: the axes of the body in rows.
    fn state(&self, t: f64) -> (Vector3<f64>, Matrix3<f64>) {
        let mut thrust = Vector3::new(0.0, 0.0, 9.8);
        for (k, [size, frequency, phase]) in self.waves.iter().enumerate() {
            let share = if k % 3 == 2 { 0.5 } else { 1.0 };
            thrust[k % 3] += share * size * (core::f64::consts::TAU * frequency * t + phase).sin();
        }
        let up = thrust.normalize();
        let heading = self.yaw[0] * t + self.yaw[1];
        let ahead = Vector3::new(heading.cos(), heading.sin(), 0.0);
        let left = up.cross(&ahead).normalize();
        let axes = Matrix3::from_rows(&[left.cross(&up).transpose(), left.transpose(), up.transpose()]);
        (axes * thrust, axes)
    }

    /// Specific force, m/s^2, and angular rate, rad/s, in body axes.
    fn at(&self, t: f64) -> [Vector3<f64>; 2] {
        let step = 1e-4;
        let (f, axes) = self.state(t);
        let change = (self.state(t + step).1 - self.state(t - step).1) / (2.0 * step);
        let turning = axes * change.transpose();
        [f, Vector3::new(turning[(2, 1)], turning[(0, 2)], turning[(1, 0)])]
    }
}

/// Fault of a unit: alters its readings.
type Alter<'a> = &'a dyn Fn(&mut UnitReading<f64>);

/// First unit named in a flight of 150 s of two units, with the ground; `fault` alters the readings of one of them from 90 s
/// on. Both scatter by `scatter`, m/s^2 and rad/s, from sample to sample.
fn two_fly(seed: u64, faulty: usize, scatter: [f64; 2], fault: Alter<'_>) -> Option<(usize, &'static str)> {
    let mut isolator = FaultIsolator::<f64, 2>::new();
    let mut draw = Draw(seed);
    let flight = Quadrotor::drawn(&mut draw);
    let mut found = None;
    for k in 0..(150.0 / H) as u64 {
        let t = k as f64 * H;
        let [f, w] = flight.at(t);
        let units: [Option<UnitReading<f64>>; 2] = core::array::from_fn(|i| {
            let mut reading = UnitReading {
                scatter,
                ..sound_reading(f + draw.vector(0.008), w + draw.vector(0.0005))
            };
            if i == faulty && t >= 90.0 {
                fault(&mut reading);
            }
            Some(reading)
        });
        let window = SetWindow {
            units: &units,
            number: k,
            span: 50_000,
            steps: &[UnitSteps::none(); 2],
            mounted: &core::array::from_fn(|i| MountedUnit::new(i as u64)),
            length: H,
            gravity: 9.8,
            noise_ratio: 9.0,
            means_only: false,
            per_kelvin: ForceAndRate {
                specific_force: 0.0,
                angular_rate: 0.0,
            },
            tolerated: ForceAndRate {
                specific_force: 0.05,
                angular_rate: 0.005,
            },
        };
        isolator.look(&window, None, &mut |_, event| {
            let named = match event {
                IsolationEvent::Isolated { unit, proof } => (unit, proof.ground.name()),
                IsolationEvent::Noisy { unit, .. } => (unit, "noisy"),
                _ => return,
            };
            found = found.or(Some(named));
        });
    }
    found
}

const STEADY: [f64; 2] = [0.02, 0.0014];

#[test]
fn of_two_units_no_function_of_a_reading_names_the_sound_one() {
    for seed in 0..24_u64 {
        let mut draw = Draw(seed + 1000);
        let (scale, rail) = (0.7 + 0.6 * draw.uniform(), 9.8 + 3.0 * draw.uniform());
        let (bent, axis) = (0.006 * draw.uniform(), (draw.uniform() * 3.0) as usize);
        let faults: [Alter<'_>; 6] = [
            &|unit| unit.reading[0] *= scale,
            &|unit| unit.reading[0][axis] *= scale,
            &|unit| unit.reading[0].apply(|x| *x = x.clamp(-rail, rail)),
            &|unit| unit.reading[0].apply(|x| *x = x.min(rail)),
            &|unit| unit.reading[0].apply(|x| *x -= bent * *x * *x),
            &|unit| unit.reading[1] *= scale,
        ];
        let faulty = seed as usize % 2;
        for (which, fault) in faults.iter().enumerate() {
            let named = two_fly(seed, faulty, STEADY, fault);
            let right = named.is_none_or(|(unit, _)| unit == faulty);
            assert!(
                right,
                "seed {seed}, fault {which}, {scale} {rail} {bent}: {named:?}"
            );
        }
    }
}

#[test]
fn of_two_units_a_large_error_names_the_faulty_one() {
    let faults: [Alter<'_>; 3] = [
        &|unit| unit.reading[0].x += 5.0,
        &|unit| unit.reading[1].x += 1.0,
        &|unit| unit.reading[0].swap_rows(0, 2),
    ];
    for fault in faults {
        let right = (0..16_u64).filter(|seed| {
            let faulty = *seed as usize % 2;
            two_fly(*seed, faulty, STEADY, fault).is_some_and(|(unit, _)| unit == faulty)
        });
        assert!(right.count() >= 14);
    }
}

#[test]
fn no_unit_at_its_own_usual_scatter_is_noisy() {
    let shaken = [2.0, 0.1];
    for seed in 0..12_u64 {
        let left = 0.3 * Draw(seed + 50).uniform();
        let filtered =
            |unit: &mut UnitReading<f64>| unit.scatter = unit.scatter.map(|scatter| scatter * left);
        let named = two_fly(seed, seed as usize % 2, shaken, &filtered);
        assert_eq!(named, None, "seed {seed}, {left}");
        let noisy = |unit: &mut UnitReading<f64>| unit.scatter = unit.scatter.map(|scatter| scatter * 20.0);
        let named = two_fly(seed, seed as usize % 2, shaken, &noisy);
        assert_eq!(named, Some((seed as usize % 2, "noisy")), "seed {seed}");
    }
}
