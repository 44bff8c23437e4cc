//! Three units or more, and the odd one among them: each is compared with the median of all.

use crate::real::{Real, real};
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::sample::CHANNELS;

/// Fewest units that have a channel for a vote on it.
pub const FEWEST: usize = 3;

/// What a unit said over one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitMean<T: Real> {
    /// Means, compensated and brought to the primary's place, m/s^2 and rad/s.
    pub mean: [T; CHANNELS],
    /// Standard deviation of the samples of the accelerometer, m/s^2, and of the gyroscope, rad/s.
    pub scatter: [T; 2],
    /// Which channels it has, and has a mean of.
    pub axes: Axes,
}

/// How a sensor compares with those of the other units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison<T: Real> {
    /// Distance of its means from the medians, m/s^2 or rad/s; not a number where there is none.
    pub apart: T,
    /// Median of all units' distances, m/s^2 or rad/s.
    pub usual_apart: T,
    /// Standard deviation of its samples, m/s^2 or rad/s.
    pub scatter: T,
    /// Median of all units' standard deviations, m/s^2 or rad/s.
    pub usual_scatter: T,
}

/// Compares accelerometer and gyroscope of each unit with the medians over those that said something; `None` for a
/// sensor none of whose channels at least three units have.
pub fn vote<T: Real, const UNITS: usize>(
    units: &[Option<UnitMean<T>>; UNITS],
) -> [[Option<Comparison<T>>; 2]; UNITS] {
    let mut comparisons = [[None; 2]; UNITS];
    for (i, sensor) in SENSORS.into_iter().enumerate() {
        let medians = medians(units, sensor);
        let Some(usual_scatter) = median(units, |unit| {
            let scatter = *unit.scatter.get(i)?;
            unit.axes.any(sensor).then_some(scatter)
        }) else {
            continue;
        };
        let usual_apart = median(units, |unit| apart(unit, sensor, &medians));
        for (comparisons, unit) in comparisons.iter_mut().zip(units) {
            let having = unit.as_ref().filter(|unit| unit.axes.any(sensor));
            let comparison = having.and_then(|unit| {
                Some(Comparison {
                    apart: apart(unit, sensor, &medians).unwrap_or(real(f64::NAN)),
                    usual_apart: usual_apart.unwrap_or(T::zero()),
                    scatter: *unit.scatter.get(i)?,
                    usual_scatter,
                })
            });
            if let Some(slot) = comparisons.get_mut(i) {
                *slot = comparison;
            }
        }
    }
    comparisons
}

/// Median of each of a sensor's three channels.
fn medians<T: Real, const UNITS: usize>(
    units: &[Option<UnitMean<T>>; UNITS],
    sensor: Sensor,
) -> [Option<T>; 3] {
    core::array::from_fn(|axis| median(units, |unit| reading(unit, sensor, axis)))
}

fn reading<T: Real>(unit: &UnitMean<T>, sensor: Sensor, axis: usize) -> Option<T> {
    let channel = sensor.first_channel() + axis;
    let has = unit.axes.0.get(channel).copied().unwrap_or(false);
    unit.mean.get(channel).copied().filter(|_| has)
}

/// Norm over the channels that it has and that there is a median of.
fn apart<T: Real>(unit: &UnitMean<T>, sensor: Sensor, medians: &[Option<T>; 3]) -> Option<T> {
    let mut squares = None;
    for (axis, median) in medians.iter().enumerate() {
        if let (Some(x), Some(median)) = (reading(unit, sensor, axis), median) {
            let d = x - *median;
            squares = Some(squares.unwrap_or(T::zero()) + d * d);
        }
    }
    squares.map(|squares: T| squares.sqrt())
}

/// Median of a figure over the units that have it as a finite number: the mean of the middle two if these are even in
/// number, `None` if fewer than three.
fn median<T: Real, const UNITS: usize>(
    units: &[Option<UnitMean<T>>; UNITS],
    figure: impl Fn(&UnitMean<T>) -> Option<T>,
) -> Option<T> {
    let mut sorted = [T::zero(); UNITS];
    let mut found = 0;
    let figures = units.iter().flatten().filter_map(figure);
    for x in figures.filter(|x| x.is_finite()) {
        insert(&mut sorted, found, x);
        found += 1;
    }
    if found < FEWEST {
        return None;
    }
    let (lower, upper) = (sorted.get((found - 1) / 2)?, sorted.get(found / 2)?);
    // Halved first: the sum of two large numbers may not be finite.
    Some(*lower * real(0.5) + *upper * real(0.5))
}

/// Puts one more in its place among the first that are sorted.
fn insert<T: Real>(sorted: &mut [T], found: usize, x: T) {
    let mut carried = x;
    for slot in sorted.iter_mut().take(found) {
        if carried < *slot {
            core::mem::swap(slot, &mut carried);
        }
    }
    if let Some(slot) = sorted.get_mut(found) {
        *slot = carried;
    }
}

#[cfg(test)]
#[path = "median_vote_tests.rs"]
mod tests;
