//! The temperature of the sensor, from a thermometer that has steps, noise, and a time constant of its own.
//!
//! Over a window that several steps fall into, a straight line through the readings is nearer to the temperature than
//! any reading; its slope shows whether the unit warms, and the error of a slow thermometer.

use super::recorder::Span;
use crate::distributions::median;

/// Steps of the thermometer in a window, at least.
const STEPS: f64 = 4.0;
/// Longest and shortest window, as shares of a session: a slope needs that long in a thermometer that scatters, and a value
/// over another window than its slope would err where temperature turns.
const LONGEST: f64 = 0.1;
const SHORTEST: f64 = 0.02;
/// Spans in a window, at least.
const SPANS: usize = 3;
/// Share of the usual slope below which it neither warms nor cools.
const LEVEL: f64 = 0.02;

/// Smoothed temperature of one span.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothTemperature {
    /// degC.
    pub value: f64,
    /// K/s.
    pub slope: f64,
    /// 1 where it warms, -1 where it cools, else 0.
    pub leg: f64,
}

impl SmoothTemperature {
    /// The mean with that of a later span, which is a share of both.
    pub(super) fn append(&mut self, later: &Self, share: f64) {
        self.value += (later.value - self.value) * share;
        self.slope += (later.slope - self.slope) * share;
        self.leg += (later.leg - self.leg) * share;
    }
}

/// Smooths the temperature of one session, whose thermometer has a step, K (docs/theory/thermal.md, eq. 9).
pub fn smooth(spans: &[Span], step: f64) -> Vec<SmoothTemperature> {
    let (times, readings): (Vec<f64>, Vec<f64>) =
        spans.iter().map(|span| (span.middle(), span.temperature)).unzip();
    let half = 0.5 * window(&times, &readings, step);
    let lines: Vec<(f64, f64)> = (0..times.len())
        .map(|place| line_at(&times, &readings, place, half))
        .collect();
    let mut sizes: Vec<f64> = lines.iter().map(|(_, slope)| slope.abs()).collect();
    let usual = median(&mut sizes).unwrap_or(0.0);
    lines
        .into_iter()
        .map(|(value, slope)| SmoothTemperature {
            value,
            slope,
            leg: if slope.abs() > LEVEL * usual {
                slope.signum()
            } else {
                0.0
            },
        })
        .collect()
}

fn window(times: &[f64], readings: &[f64], step: f64) -> f64 {
    let session = times.last().unwrap_or(&0.0) - times.first().unwrap_or(&0.0);
    let travelled: f64 = readings.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    let rate = travelled / session.max(f64::MIN_POSITIVE);
    let steps = if step.is_finite() {
        STEPS * step / rate.max(f64::MIN_POSITIVE)
    } else {
        0.0
    };
    let spans = session / times.len().max(1) as f64;
    let shortest = (SHORTEST * session).max(SPANS as f64 * spans);
    steps.min(LONGEST * session).max(shortest)
}

/// The line through the readings within `half` a window of a place: its value there and its slope.
fn line_at(times: &[f64], readings: &[f64], place: usize, half: f64) -> (f64, f64) {
    let centre = times[place];
    let first = times.partition_point(|time| *time < centre - half);
    let end = times.partition_point(|time| *time <= centre + half);
    let count = (end - first) as f64;
    let mean = |values: &[f64]| values[first..end].iter().sum::<f64>() / count;
    let (middle, level) = (mean(times), mean(readings));
    let (mut products, mut squares) = (0.0, 0.0);
    for (time, reading) in times[first..end].iter().zip(&readings[first..end]) {
        products += (time - middle) * (reading - level);
        squares += (time - middle).powi(2);
    }
    let slope = if squares > 0.0 { products / squares } else { 0.0 };
    (level + slope * (centre - middle), slope)
}
