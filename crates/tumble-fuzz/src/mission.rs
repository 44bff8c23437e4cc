//! True motion of a set of three units, and their readings: rest, motion, rest, motion in which the primary falls
//! silent. Short, so that a monitor with short settings goes through all of it in thousands of samples.

use nalgebra::Vector3;
use tumble_core::gravity;
use tumble_core::sample::Sample;

use crate::draw::FuzzDraw;

/// A primary and two secondaries.
pub const UNITS: usize = 3;

/// From one sample of a unit to its next, microseconds.
const PERIOD: u64 = 4_000;

/// Where it begins on the common clock, microseconds.
const START: u64 = 40_000_000;

/// Samples of all units together: 12 s.
pub const LENGTH: u64 = 9_000;

/// When the primary falls silent, s.
const SILENT: f32 = 10.5;

/// When it rests, s.
const RESTS: [(f32, f32); 2] = [(0.0, 1.2), (7.0, 8.4)];

/// Returns the sample taken as the `step`-th, and its unit; `None` where that unit is silent.
pub fn sample(step: u64) -> Option<(usize, Sample<f32>)> {
    let time = step * PERIOD / UNITS as u64;
    let number = usize::try_from(step % UNITS as u64).unwrap_or(0);
    let seconds = time as f32 * 1e-6;
    if number == 0 && seconds >= SILENT {
        return None;
    }
    let [force, rate] = truth(seconds);
    let mut draw = FuzzDraw::new(step);
    let mut noise = |size| Vector3::from_fn(|_, _| draw.usual(size));
    let wrong = number as f32;
    let sample = Sample {
        time: START + time,
        specific_force: force * (1.0 + 0.01 * wrong) + Vector3::repeat(0.2 * wrong) + noise(0.02),
        angular_rate: rate * (1.0 - 0.01 * wrong) + Vector3::repeat(0.02 * wrong) + noise(0.002),
    };
    Some((number, sample))
}

/// Specific force, m/s^2, and angular rate, rad/s, of all of the platform.
fn truth(seconds: f32) -> [Vector3<f32>; 2] {
    let up = Vector3::z() * gravity::STANDARD as f32;
    if RESTS.iter().any(|(from, to)| (*from..*to).contains(&seconds)) {
        return [up, Vector3::zeros()];
    }
    let wave = |frequency: f32, shift: f32| (frequency * seconds + shift).sin();
    let force = Vector3::new(wave(4.0, 0.0), wave(5.5, 1.0), wave(7.5, 2.0)) * 3.0;
    let rate = Vector3::new(wave(6.0, 3.0), wave(4.5, 4.0), wave(8.0, 5.0));
    [up + force, rate]
}
