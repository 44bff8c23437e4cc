//! Vibration of a structure: tones of motors, and a broad band around them.
//!
//! It is drawn once as a loop of evenly spaced values, between which it runs straight, so that it can be read at any
//! time by any unit. The angular acceleration is the slope of the angular rate, exactly. The angle of the vibration,
//! some 1e-4 rad, is left out of the direction of gravity.

use core::f64::consts::TAU;

use nalgebra::Vector3;
use rand::RngExt;
use rand_distr::StandardNormal;
use serde::Deserialize;

use crate::simulate::stream::RandomStream;

/// Values in the loop.
const NODES: usize = 1 << 15;
/// Values a second, Hz.
const RATE: f64 = 2000.0;
/// Share of the mean square that is in the tones.
const TONE_SHARE: f64 = 0.5;

/// Settings of a structure's vibration.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VibrationSettings {
    /// Root mean square of each axis of specific force, m/s^2.
    pub specific_force: f64,
    /// Root mean square of each axis of angular rate, rad/s.
    pub angular_rate: f64,
    /// Frequencies of the tones, Hz, which share half of the mean square between them.
    pub tones: Vec<f64>,
    /// Where the broad band, the other half, has half its power, Hz.
    pub band: (f64, f64),
}

/// Contribution of vibration to the truth of a place, body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VibrationSample {
    /// m/s^2.
    pub specific_force: Vector3<f64>,
    /// rad/s.
    pub angular_rate: Vector3<f64>,
    /// rad/s^2.
    pub angular_acceleration: Vector3<f64>,
}

/// A drawn vibration; a structure without any has an empty loop.
#[derive(Clone, Debug, PartialEq)]
pub struct VibrationLoop {
    nodes: Vec<[f64; 6]>,
    /// Integral from the begin of the loop to each node, and to its end.
    integrals: Vec<[f64; 6]>,
}

impl VibrationLoop {
    /// Draws the loop.
    pub fn draw(settings: &VibrationSettings, stream: &mut RandomStream) -> Self {
        if settings.specific_force == 0.0 && settings.angular_rate == 0.0 {
            return Self {
                nodes: Vec::new(),
                integrals: Vec::new(),
            };
        }
        let mut nodes = vec![[0.0; 6]; NODES];
        for channel in 0..6 {
            let size = if channel < 3 {
                settings.specific_force
            } else {
                settings.angular_rate
            };
            let values = channel_loop(settings, stream);
            for (node, value) in nodes.iter_mut().zip(values) {
                node[channel] = size * value;
            }
        }
        Self {
            integrals: integrals(&nodes),
            nodes,
        }
    }

    /// Vibration at time `t`, s, round and round the loop.
    pub fn at(&self, t: f64) -> VibrationSample {
        if self.nodes.is_empty() {
            return VibrationSample::default();
        }
        let (from, to, part) = self.around(t);
        let slope = |channel: usize| (to[channel] - from[channel]) * RATE;
        let value = |channel: usize| from[channel] + part * (to[channel] - from[channel]);
        VibrationSample {
            specific_force: Vector3::from_fn(|axis, _| value(axis)),
            angular_rate: Vector3::from_fn(|axis, _| value(3 + axis)),
            angular_acceleration: Vector3::from_fn(|axis, _| slope(3 + axis)),
        }
    }

    /// Mean of the vibration over a while, s, with `t` in its middle.
    pub fn mean(&self, t: f64, over: f64) -> VibrationSample {
        if self.nodes.is_empty() || over == 0.0 {
            return self.at(t);
        }
        let (begin, end) = (t - over / 2.0, t + over / 2.0);
        let (before, after) = (self.integral(begin), self.integral(end));
        let mean = |channel: usize| (after[channel] - before[channel]) / over;
        VibrationSample {
            specific_force: Vector3::from_fn(|axis, _| mean(axis)),
            angular_rate: Vector3::from_fn(|axis, _| mean(3 + axis)),
            angular_acceleration: (self.at(end).angular_rate - self.at(begin).angular_rate) / over,
        }
    }

    /// The nodes before and after time `t`, and which part of the way between them it is.
    fn around(&self, t: f64) -> (&[f64; 6], &[f64; 6], f64) {
        let position = (t * RATE).rem_euclid(NODES as f64);
        let index = position as usize % NODES;
        let part = position - position.floor();
        (&self.nodes[index], &self.nodes[(index + 1) % NODES], part)
    }

    /// Integral of each channel from time 0 to `t`, s.
    fn integral(&self, t: f64) -> [f64; 6] {
        let (from, to, part) = self.around(t);
        let rounds = (t * RATE / NODES as f64).floor();
        let index = (t * RATE).rem_euclid(NODES as f64) as usize % NODES;
        core::array::from_fn(|channel| {
            let mean = from[channel] + part * (to[channel] - from[channel]) / 2.0;
            rounds * self.integrals[NODES][channel] + self.integrals[index][channel] + mean * part / RATE
        })
    }
}

/// Integral of the loop from its begin to each node and to its end.
fn integrals(nodes: &[[f64; 6]]) -> Vec<[f64; 6]> {
    let mut sum = [0.0; 6];
    let mut integrals = vec![sum];
    for (index, from) in nodes.iter().enumerate() {
        let to = &nodes[(index + 1) % nodes.len()];
        for channel in 0..6 {
            sum[channel] += (from[channel] + to[channel]) / (2.0 * RATE);
        }
        integrals.push(sum);
    }
    integrals
}

impl VibrationSample {
    /// This vibration `envelope` times as strong, where that changes by `slope` a second.
    pub fn scaled(&self, envelope: f64, slope: f64) -> Self {
        Self {
            specific_force: self.specific_force * envelope,
            angular_rate: self.angular_rate * envelope,
            angular_acceleration: self.angular_acceleration * envelope + self.angular_rate * slope,
        }
    }

    /// Both at once.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            specific_force: self.specific_force + other.specific_force,
            angular_rate: self.angular_rate + other.angular_rate,
            angular_acceleration: self.angular_acceleration + other.angular_acceleration,
        }
    }
}

/// One channel with a mean square of 1: the tones, each with a phase of its own, and the band.
fn channel_loop(settings: &VibrationSettings, stream: &mut RandomStream) -> Vec<f64> {
    let tone_share = if settings.tones.is_empty() {
        0.0
    } else {
        TONE_SHARE
    };
    let mut values = band_loop(settings.band, stream);
    let mean_square = values.iter().map(|value| value * value).sum::<f64>() / NODES as f64;
    let scale = ((1.0 - tone_share) / mean_square).sqrt();
    values.iter_mut().for_each(|value| *value *= scale);
    let amplitude = (2.0 * tone_share / settings.tones.len().max(1) as f64).sqrt();
    for tone in &settings.tones {
        // Whole waves in the loop.
        let pace = TAU * (tone / RATE * NODES as f64).round() / NODES as f64;
        let phase = TAU * stream.random::<f64>();
        for (index, value) in values.iter_mut().enumerate() {
            *value += amplitude * libm::sin(pace * index as f64 + phase);
        }
    }
    values
}

/// White noise through a band-pass, twice.
///
/// A noise that repeats comes out as one that repeats, once the filter has gone round the loop.
fn band_loop(band: (f64, f64), stream: &mut RandomStream) -> Vec<f64> {
    let mut values: Vec<f64> = (0..NODES).map(|_| stream.sample(StandardNormal)).collect();
    for _ in 0..2 {
        let mut filter = BandPass::new(band);
        values.iter().for_each(|value| {
            filter.step(*value);
        });
        values.iter_mut().for_each(|value| *value = filter.step(*value));
    }
    values
}

/// Second-order band-pass (Bristow-Johnson, "Cookbook formulae for audio equaliser biquad filter coefficients").
struct BandPass {
    gain: f64,
    feedback: (f64, f64),
    inputs: (f64, f64),
    outputs: (f64, f64),
}

impl BandPass {
    fn new((low, high): (f64, f64)) -> Self {
        let (sine, cosine) = libm::sincos(TAU * (low * high).sqrt() / RATE);
        let width = sine * (high - low) / (2.0 * (low * high).sqrt());
        Self {
            gain: width / (1.0 + width),
            feedback: (2.0 * cosine / (1.0 + width), -(1.0 - width) / (1.0 + width)),
            inputs: (0.0, 0.0),
            outputs: (0.0, 0.0),
        }
    }

    fn step(&mut self, input: f64) -> f64 {
        let output = self.gain * (input - self.inputs.1)
            + self.feedback.0 * self.outputs.0
            + self.feedback.1 * self.outputs.1;
        self.inputs = (input, self.inputs.0);
        self.outputs = (output, self.outputs.0);
        output
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::stream::{StreamPurpose, stream};

    fn settings() -> VibrationSettings {
        VibrationSettings {
            specific_force: 3.0,
            angular_rate: 0.05,
            tones: vec![87.0, 131.0],
            band: (60.0, 140.0),
        }
    }

    fn vibration(settings: &VibrationSettings) -> VibrationLoop {
        VibrationLoop::draw(settings, &mut stream(3, 0, StreamPurpose::Vibration))
    }

    /// Power of specific force x in a tone of that many waves a loop, over the mean square.
    fn share_at(vibration: &VibrationLoop, hertz: f64) -> f64 {
        let waves = (hertz / RATE * NODES as f64).round();
        let (mut re, mut im) = (0.0, 0.0);
        for (index, node) in vibration.nodes.iter().enumerate() {
            let (sine, cosine) = libm::sincos(TAU * waves * index as f64 / NODES as f64);
            re += node[0] * cosine / NODES as f64;
            im += node[0] * sine / NODES as f64;
        }
        2.0 * (re * re + im * im) / 9.0
    }

    #[test]
    fn every_axis_has_the_root_mean_square_asked_for() {
        let vibration = vibration(&settings());
        for channel in 0..6 {
            let size = if channel < 3 { 3.0 } else { 0.05 };
            let sum: f64 = vibration.nodes.iter().map(|node| node[channel].powi(2)).sum();
            let found = (sum / NODES as f64).sqrt();
            // A tone and the band may by chance go together or against each other.
            assert!((found / size - 1.0).abs() < 0.05, "channel {channel}: {found}");
        }
    }

    #[test]
    fn half_of_the_power_is_in_the_tones_and_little_below_the_band() {
        let vibration = vibration(&settings());
        for tone in [87.0, 131.0] {
            assert!((share_at(&vibration, tone) - 0.25).abs() < 0.03);
        }
        let low: f64 = (1..160)
            .map(|waves| share_at(&vibration, f64::from(waves) * RATE / NODES as f64))
            .sum();
        assert!(low < 1e-3, "{low} below 10 Hz");
    }

    #[test]
    fn the_loop_closes_and_acceleration_is_the_slope_of_the_rate() {
        let vibration = vibration(&settings());
        let loop_duration = NODES as f64 / RATE;
        assert_eq!(vibration.at(1.0), vibration.at(1.0 + loop_duration));
        let h = 1e-7;
        for t in [0.000_12, 3.000_33, loop_duration - 0.000_11, 100.000_21] {
            let slope = (vibration.at(t + h).angular_rate - vibration.at(t - h).angular_rate) / (2.0 * h);
            assert!((slope - vibration.at(t).angular_acceleration).amax() < 1e-4);
        }
    }

    #[test]
    fn a_swelling_vibration_has_the_acceleration_of_its_rate() {
        let vibration = vibration(&settings());
        let scaled = |t: f64| vibration.at(t).scaled(0.3 * t, 0.3);
        let (t, h) = (2.000_12, 1e-7);
        let slope = (scaled(t + h).angular_rate - scaled(t - h).angular_rate) / (2.0 * h);
        assert!((slope - scaled(t).angular_acceleration).amax() < 1e-4);
    }

    #[test]
    fn a_mean_is_that_within_and_over_nothing_the_value() {
        let vibration = vibration(&settings());
        let loop_duration = NODES as f64 / RATE;
        for t in [0.001, 3.000_33, loop_duration - 0.001, 5.0 * loop_duration + 2.3] {
            let (over, count) = (0.005, 100_000);
            let times = (0..count).map(|i| t + over * ((f64::from(i) + 0.5) / f64::from(count) - 0.5));
            let mut sum = VibrationSample::default();
            for time in times {
                sum = sum.plus(&vibration.at(time).scaled(1.0 / f64::from(count), 0.0));
            }
            let mean = vibration.mean(t, over);
            assert!((mean.specific_force - sum.specific_force).amax() < 1e-6);
            assert!((mean.angular_rate - sum.angular_rate).amax() < 1e-8);
            assert!((mean.angular_acceleration - sum.angular_acceleration).amax() < 1e-3);
            assert_eq!(vibration.mean(t, 0.0), vibration.at(t));
        }
    }

    #[test]
    fn without_vibration_nothing_moves() {
        let none = VibrationSettings {
            specific_force: 0.0,
            angular_rate: 0.0,
            ..settings()
        };
        assert_eq!(vibration(&none).at(12.3), VibrationSample::default());
    }
}
