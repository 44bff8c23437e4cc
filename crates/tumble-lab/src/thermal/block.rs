//! Blocks of a thermal log: means over successive stretches at rest (docs/theory/thermal.md).

use nalgebra::Vector3;
use tumble_core::noise::Interval;
use tumble_core::sample::CHANNELS;

use super::recorder::Span;
use super::rest::rests;
use super::thermometer::{SmoothTemperature, smooth};
use crate::distributions::median;

/// Blocks of a session: what is fitted has a matrix of their square.
const BLOCKS: f64 = 150.0;
/// Usual times between spans from which on samples are missing.
const PAUSE: f64 = 1.5;
/// Blocks of a pose below which it determines nothing but its own constant.
const FEWEST_OF_A_POSE: usize = 2;
/// Cosine of the angle between two orientations of a fixture: 10 degrees.
const SAME_ORIENTATION: f64 = 0.985;

/// A stretch during which the unit stood still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestBlock {
    /// Which session: errors of different ones have nothing in common.
    pub session: usize,
    /// In which pose it was held: a constant of its own is fitted to each.
    pub pose: usize,
    /// When, s.
    pub interval: Interval<f64>,
    /// By the thermometer, degC.
    pub temperature: f64,
    /// Its change, K/s.
    pub slope: f64,
    /// Direction of temperature: warming (1), cooling (-1) or neither (0); between these where it turned.
    pub leg: f64,
}

impl RestBlock {
    /// With the temperature of a sensor that its thermometer is behind by a time constant, s.
    pub fn lagged(&self, lag: f64) -> Self {
        Self {
            temperature: self.temperature + lag * self.slope, // eq. 10
            ..*self
        }
    }
}

/// Blocks, and the means of the six channels over each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ThermalBlocks {
    /// In order of time.
    pub blocks: Vec<RestBlock>,
    /// m/s^2, then rad/s.
    pub means: Vec<[f64; CHANNELS]>,
    /// Poses, in all sessions.
    pub poses: usize,
    /// s at rest.
    pub still: f64,
    /// s that were left out because the unit moved.
    pub moved: f64,
}

/// Makes blocks of the spans of all logs; `step` is that of the thermometer, K.
///
/// Each rest is a pose of its own, as a hand never returns to one; with `fixture`, all of one orientation are one.
pub fn blocks(spans: &[Span], step: f64, fixture: bool) -> ThermalBlocks {
    let mut found = ThermalBlocks::default();
    for session in spans.chunk_by(|a, b| a.session == b.session) {
        found.add_session(session, step, fixture);
    }
    found
}

impl ThermalBlocks {
    /// Readings of one channel, in the order of the blocks.
    pub fn channel(&self, channel: usize) -> Vec<f64> {
        self.means.iter().map(|means| means[channel]).collect()
    }

    /// Gives the blocks the temperature of a sensor that its thermometer is behind by a time constant, s. When that turned is
    /// known no better than by as much.
    pub fn lag(&mut self, lag: f64) {
        let lagged = self.blocks.iter().map(|block| RestBlock {
            leg: leg_about(&self.blocks, block, lag.abs()),
            ..block.lagged(lag)
        });
        self.blocks = lagged.collect();
    }

    fn add_session(&mut self, spans: &[Span], step: f64, fixture: bool) {
        let length = spans.last().map_or(0.0, |last| last.time[1] - spans[0].time[0]) / BLOCKS;
        let rests = rests(spans);
        let usual = usual_interval(spans);
        let mut stretches: Vec<RestStretch> = Vec::new();
        for ((span, temperature), rest) in spans.iter().zip(smooth(spans, step)).zip(rests) {
            let Some(rest) = rest else {
                self.moved += span.duration();
                continue;
            };
            self.still += span.duration();
            match stretches.last_mut() {
                Some(open) if open.holds(span, rest, length, PAUSE * usual) => {
                    open.append(span, &temperature)
                }
                _ => stretches.push(RestStretch::of(span, temperature, rest)),
            }
        }
        self.close(&stretches, fixture);
    }

    /// Numbers the poses of a session, and keeps the stretches of those that are informative.
    fn close(&mut self, stretches: &[RestStretch], fixture: bool) {
        let mut poses: Vec<BlockPose> = Vec::new();
        let numbers: Vec<usize> = stretches
            .iter()
            .map(|stretch| {
                let force = stretch.force();
                let known = poses.iter().position(|pose| {
                    if fixture {
                        pose.force.dot(&force) >= SAME_ORIENTATION
                    } else {
                        pose.rest == stretch.rest
                    }
                });
                let number = known.unwrap_or(poses.len());
                if known.is_none() {
                    poses.push(BlockPose {
                        rest: stretch.rest,
                        force,
                        blocks: 0,
                        number: None,
                    });
                }
                poses[number].blocks += 1;
                number
            })
            .collect();
        for pose in poses.iter_mut().filter(|pose| pose.blocks >= FEWEST_OF_A_POSE) {
            pose.number = Some(self.poses);
            self.poses += 1;
        }
        for (stretch, number) in stretches.iter().zip(numbers) {
            if let Some(pose) = poses[number].number {
                self.blocks.push(stretch.block(pose));
                self.means.push(*stretch.span.moments.mean());
            }
        }
    }
}

/// Mean direction of temperature about the middle of a block, to so many s before and after it.
fn leg_about(blocks: &[RestBlock], block: &RestBlock, within: f64) -> f64 {
    let middle = |of: &RestBlock| 0.5 * (of.interval.start + of.interval.end);
    let near = |of: &&RestBlock| of.session == block.session && (middle(of) - middle(block)).abs() <= within;
    let (sum, time) = blocks.iter().filter(near).fold((0.0, 0.0), |(sum, time), of| {
        let lasts = of.interval.duration();
        (sum + of.leg * lasts, time + lasts)
    });
    sum / time // eq. 10a
}

struct BlockPose {
    rest: usize,
    force: Vector3<f64>,
    blocks: usize,
    number: Option<usize>,
}

/// Spans of a rest that follow each other, on the way to a block.
struct RestStretch {
    span: Span,
    temperature: SmoothTemperature,
    rest: usize,
}

impl RestStretch {
    fn of(span: &Span, temperature: SmoothTemperature, rest: usize) -> Self {
        Self {
            span: *span,
            temperature,
            rest,
        }
    }

    fn holds(&self, span: &Span, rest: usize, length: f64, pause: f64) -> bool {
        let together = span.time[0] - self.span.time[1] < pause && rest == self.rest;
        together && span.time[1] - self.span.time[0] <= length
    }

    fn append(&mut self, span: &Span, temperature: &SmoothTemperature) {
        self.span.append(span);
        self.temperature
            .append(temperature, span.count() / self.span.count());
    }

    fn force(&self) -> Vector3<f64> {
        let [x, y, z, ..] = *self.span.moments.mean();
        Vector3::new(x, y, z)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::zeros)
    }

    fn block(&self, pose: usize) -> RestBlock {
        RestBlock {
            session: self.span.session,
            pose,
            interval: Interval {
                start: self.span.time[0],
                end: self.span.time[1],
            },
            temperature: self.temperature.value,
            slope: self.temperature.slope,
            leg: self.temperature.leg,
        }
    }
}

/// Time from the start of a span to that of the next, s, the median.
fn usual_interval(spans: &[Span]) -> f64 {
    let mut steps: Vec<f64> = spans
        .windows(2)
        .map(|pair| pair[1].time[0] - pair[0].time[0])
        .collect();
    median(&mut steps).unwrap_or(0.0)
}
