extern crate std;

use std::vec::Vec;

use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::redundancy::judgement::attribution::Ground;
use crate::redundancy::judgement::{Judge, Judgement, SetWindow, UnitReading};
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::samples::steps::UnitSteps;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::ForceAndRate;

const SPAN: u64 = 50_000;
const H: f64 = 0.05;
const GRAVITY: f64 = 9.80665;
const SIGMA: f64 = 0.3;

/// Uniform numbers of a seed (Knuth's multiplier).
struct Draw(u64);

impl Draw {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()) * sigma
    }
}

/// What a set that rests for 12 s and then moves does, in the level frame.
fn motion(t: f64) -> (Rotation3<f64>, Vector3<f64>, Vector3<f64>) {
    let swell = ((t - 12.0) / 8.0).clamp(0.0, 1.0);
    let ease = swell * swell * (3.0 - 2.0 * swell);
    let slope = if swell > 0.0 && swell < 1.0 {
        6.0 * swell * (1.0 - swell) / 8.0
    } else {
        0.0
    };
    let (rates, sizes) = ([0.35, 0.27, 0.61], [5.0, 6.0, 1.5]);
    let wave = Vector3::from_fn(|i, _| sizes[i] * (rates[i] * t + i as f64).sin());
    let steep = Vector3::from_fn(|i, _| sizes[i] * rates[i] * (rates[i] * t + i as f64).cos());
    let (velocity, acceleration) = (wave * ease, steep * ease + wave * slope);
    let lean = |x: f64| 0.3 * ease * x;
    let attitude = Rotation3::from_euler_angles(
        lean((0.8 * t).sin()),
        lean((0.55 * t).cos()),
        0.7 + 2.0 * lean((0.2 * t).sin() + 0.1 * t),
    );
    (attitude, velocity, acceleration)
}

/// Specific force and angular rate under the triangle over two windows, the second of which ends at `t`.
fn felt(t: f64) -> [Vector3<f64>; 2] {
    let parts = 10_i32;
    let step = H / f64::from(parts);
    let (mut f, mut w, mut sum) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for k in -parts..=parts {
        let at = t - H + f64::from(k) * step;
        let weight = 1.0 - f64::from(k.abs()) / f64::from(parts);
        let (attitude, _, acceleration) = motion(at);
        let turn = motion(at - 5e-4).0.inverse() * motion(at + 5e-4).0;
        f += attitude.inverse() * (acceleration + Vector3::z() * GRAVITY) * weight;
        w += turn.scaled_axis() * (weight / 1e-3);
        sum += weight;
    }
    [f / sum, w / sum]
}

/// What is found of a set of N, and when.
#[derive(Debug, PartialEq)]
enum Found {
    Blamed(usize, Sensor),
    OutOfFamily(usize, Sensor),
    Disagree(usize, usize),
    Lost,
    Regained,
}

struct Flight<const N: usize> {
    seed: u64,
    until: f64,
    /// Errors of a unit at a time.
    fault: fn(usize, f64) -> [Vector3<f64>; 2],
    /// What the witness says of a velocity at a time; not a number where it says nothing.
    says: fn(f64, Vector3<f64>) -> Witness<f64>,
    /// Time that it takes, s.
    latency: f64,
}

fn velocity(value: Vector3<f64>) -> Witness<f64> {
    Witness::Velocity {
        value,
        sigma: Vector3::repeat(SIGMA),
    }
}

impl<const N: usize> Flight<N> {
    fn fly(&self) -> Vec<(f64, Found)> {
        let mut judge = Judge::<f64, N>::new();
        let mut draw = Draw(self.seed);
        let mut found = Vec::new();
        // Until a witness has spoken, nothing of one is kept.
        for k in 1..(self.until / H) as u64 {
            let t = (k + 1) as f64 * H;
            let [f, w] = felt(t);
            let units: [Option<UnitReading<f64>>; N] = core::array::from_fn(|i| {
                let [df, dw] = (self.fault)(i, t);
                Some(UnitReading {
                    reading: [f + draw.vector(0.004) + df, w + draw.vector(0.0003) + dw],
                    scatter: [0.02, 0.0014],
                    at_rest: None,
                    votes: [true; 2],
                    calibrated: [true; 2],
                    matrix_shown: [true; 2],
                    place: 0.0,
                    left: [1e-5, 1e-8],
                    interval: 0.005,
                })
            });
            let window = SetWindow {
                units: &units,
                steps: &[UnitSteps::none(); N],
                mounted: &core::array::from_fn(|i| MountedUnit::new(i as u64)),
                number: k,
                span: SPAN,
                length: H,
                gravity: GRAVITY,
                noise_ratio: 9.0,
                tolerated: ForceAndRate {
                    specific_force: 0.05,
                    angular_rate: 0.0075,
                },
            };
            judge.look(&window, &mut |sensor, judgement| {
                let what = match judgement {
                    Judgement::Blamed { unit, proof } if proof.ground == Ground::Witness => {
                        Found::Blamed(unit, sensor)
                    }
                    Judgement::OutOfFamily { unit, .. } => Found::OutOfFamily(unit, sensor),
                    Judgement::Disagree { units: [i, j], .. } => Found::Disagree(i, j),
                    _ => return,
                };
                found.push((t, what));
            });
            if k % 4 == 0 {
                let at = t - self.latency;
                let said = (self.says)(at, motion(at).1 + draw.vector(SIGMA));
                match judge.listen((at * 1e6) as u64, &said) {
                    Ok(None) | Err(_) => {}
                    Ok(Some(Trust::Lost { .. })) => found.push((t, Found::Lost)),
                    Ok(Some(Trust::Regained)) => found.push((t, Found::Regained)),
                }
            }
        }
        found
    }
}

#[allow(dead_code)]
const SOUND: fn(usize, f64) -> [Vector3<f64>; 2] = |_, _| [Vector3::zeros(); 2];

fn ramp(unit: usize, t: f64, slope: f64) -> Vector3<f64> {
    let size = if unit == 1 {
        slope * (t - 100.0).max(0.0)
    } else {
        0.0
    };
    Vector3::new(0.6, -0.64, 0.48) * size
}

#[test]
fn a_witness_says_which_of_two_drifts() {
    for seed in 0..3 {
        let flight = Flight::<2> {
            seed,
            until: 150.0,
            fault: |unit, t| [ramp(unit, t, 0.01), Vector3::zeros()],
            says: |_, v| velocity(v),
            latency: 0.15,
        };
        let found = flight.fly();
        let blamed = found
            .iter()
            .position(|(_, found)| *found == Found::Blamed(1, Sensor::Accelerometer));
        assert!(blamed.is_some(), "seed {seed}: {found:?}");
    }
}
