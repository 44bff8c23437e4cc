//! Readings that a driver gives where it could read none: zero, for one sample or some equal ones, amid readings that are not.

use nalgebra::Vector3;

use crate::distributions::median;

/// Steps of noise, or of resolution, by which the readings on both sides are away from zero.
const FAR: f64 = 8.0;
/// Share of their length by which the readings on both sides differ at most.
const ALIKE: f64 = 0.25;
/// Steps of resolution, all axes, within which a reading is zero: buses that fail read as zero or as minus one.
const ZERO: f64 = 2.0;

/// Finds the rows of a triad, m/s^2 or rad/s, whose read failed.
///
/// They are zero within the noise or the resolution. The readings before and after are alike and far from zero, so that no motion
/// went through it.
#[must_use]
pub fn failed_reads(readings: &[[f64; 3]]) -> Vec<usize> {
    let scale = step(readings);
    let length = |row: usize| Vector3::from(readings[row]).norm();
    let apart =
        |one: usize, other: usize| (Vector3::from(readings[one]) - Vector3::from(readings[other])).norm();
    let mut found = Vec::new();
    let mut next = 1;
    while next + 1 < readings.len() {
        let first = next;
        next += 1;
        if length(first).is_nan() || length(first) > scale {
            continue;
        }
        while next + 1 < readings.len() && readings[next] == readings[first] {
            next += 1;
        }
        let least = length(first - 1).min(length(next));
        if least >= FAR * scale && apart(first - 1, next) <= ALIKE * least {
            found.extend(first..next);
        }
    }
    found
}

/// Usual length of the step from one reading to the next, at least a few steps of resolution.
fn step(readings: &[[f64; 3]]) -> f64 {
    let mut lengths = Vec::with_capacity(readings.len());
    let mut resolution = f64::INFINITY;
    for pair in readings.windows(2) {
        let change = Vector3::from(pair[1]) - Vector3::from(pair[0]);
        for each in change.iter().filter(|each| **each != 0.0) {
            resolution = resolution.min(each.abs());
        }
        lengths.push(change.norm());
    }
    let usual = median(&mut lengths).unwrap_or(0.0);
    usual.max(ZERO * 3.0_f64.sqrt() * resolution)
}
