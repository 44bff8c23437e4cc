//! Uncertainty that rounding, and dead bands, leave on means and integrals of a recording (docs/theory/rounding.md).

use nalgebra::Vector3;
use tumble_core::noise::Interval;
use tumble_core::real::seconds;
use tumble_core::resolution::{DeadBand, Resolution, variance_of_rounding};
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::Segment;

use super::interval::interval;

/// Axes of a gyroscope.
const AXES: usize = 3;

/// Change, in steps, up to which a reading still shows the same rounding: noise moves it to the next step and back.
const SAME: f64 = 1.5;

/// Shorter stretches of even readings average out, microseconds.
const SHORTEST: u64 = 40_000;

/// Scatter over that at rest from which on an axis took part in a turn.
const TURNED: f64 = 4.0;

/// A channel of which rounding, or a dead band, matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseChannel {
    /// Index of the channel.
    pub channel: usize,
    /// Step that its readings are multiples of; zero where rounding does not matter.
    pub step: f64,
    /// Half the width of its dead band; zero where that does not matter.
    pub dead_band: f64,
    /// Share of the samples at rest that read exactly zero, at most.
    pub zeros: f64,
    /// 1-sigma that both leave on a mean at rest.
    pub sigma: f64,
}

/// Time in which an axis of the gyroscope read the same but for a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct EvenStretch {
    level: f64,
    start: u64,
    end: u64,
}

/// Watches the six channels, sample by sample.
#[derive(Clone, Debug)]
pub struct RoundingMonitor {
    resolution: [Resolution<f64, 1>; CHANNELS],
    dead_band: DeadBand<f64, CHANNELS>,
    open: [EvenStretch; AXES],
    stretches: [Vec<EvenStretch>; AXES],
    /// Those in which it read exactly zero, but for moments.
    zero_stretches: [Vec<EvenStretch>; AXES],
}

impl Default for RoundingMonitor {
    fn default() -> Self {
        Self::new()
    }
}

impl RoundingMonitor {
    /// Nothing seen yet.
    pub fn new() -> Self {
        Self {
            resolution: [Resolution::new(); CHANNELS],
            dead_band: DeadBand::new(),
            open: [EvenStretch::default(); AXES],
            stretches: [const { Vec::new() }; AXES],
            zero_stretches: [const { Vec::new() }; AXES],
        }
    }

    /// Takes in a sample, its time in microseconds since the origin.
    #[inline]
    pub fn push(&mut self, time: u64, y: &[f64; CHANNELS]) {
        for (resolution, y) in self.resolution.iter_mut().zip(y) {
            resolution.push([*y]);
        }
        self.dead_band.push(*y);
        for axis in 0..AXES {
            let level = y[CHANNELS / 2 + axis];
            if level == 0.0 {
                push_zero(&mut self.zero_stretches[axis], time);
            }
            let same = SAME * self.resolution[CHANNELS / 2 + axis].smallest_change();
            let open = &mut self.open[axis];
            if (level - open.level).abs() <= same {
                open.end = time;
            } else {
                if open.end - open.start >= SHORTEST {
                    self.stretches[axis].push(*open);
                }
                *open = EvenStretch {
                    level,
                    start: time,
                    end: time,
                };
            }
        }
    }

    /// Rounding of the recording, given its rests.
    pub fn finish(mut self, rests: &[Segment<f64>]) -> Rounding {
        for (open, stretches) in self.open.iter().zip(&mut self.stretches) {
            if open.end - open.start >= SHORTEST {
                stretches.push(*open);
            }
        }
        let samples: u32 = rests.iter().map(|rest| rest.moments.samples()).sum();
        let scatter: [f64; CHANNELS] = std::array::from_fn(|i| {
            let squares =
                |rest: &Segment<f64>| rest.moments.variance()[i] * f64::from(rest.moments.samples());
            rests.iter().map(squares).sum::<f64>() / f64::from(samples.max(1))
        });
        let steps: [Option<f64>; CHANNELS] = std::array::from_fn(|i| self.resolution[i].step());
        let hidden = self.dead_band.variance(steps, samples);
        Rounding {
            step: steps.map(Option::unwrap_or_default),
            dead_band: self.dead_band.half_width(steps),
            zeros: std::array::from_fn(|i| self.dead_band.share(i, samples)),
            of_steps: std::array::from_fn(|i| variance_of_rounding(steps[i], scatter[i])),
            hidden,
            scatter,
            stretches: self.stretches,
            zero_stretches: self.zero_stretches,
        }
    }
}

/// Goes on with the last stretch, or begins one: noise at the edge of a dead band interrupts it for a moment.
fn push_zero(stretches: &mut Vec<EvenStretch>, time: u64) {
    match stretches.last_mut() {
        Some(last) if time.saturating_sub(last.end) <= SHORTEST => last.end = time,
        _ => stretches.push(EvenStretch {
            level: 0.0,
            start: time,
            end: time,
        }),
    }
}

/// Rounding and dead bands of the six channels of a recording.
#[derive(Clone, Debug, Default)]
pub struct Rounding {
    /// Step that readings are multiples of; zero where nothing shows one.
    step: [f64; CHANNELS],
    /// Half the width of the band about zero in which a channel reads exactly zero; zero where there is none.
    dead_band: [f64; CHANNELS],
    /// Share of the samples at rest that read exactly zero, at most.
    zeros: [f64; CHANNELS],
    /// Variance that rounding leaves on a mean at rest.
    of_steps: [f64; CHANNELS],
    /// Variance that the dead band leaves on a mean at rest.
    hidden: [f64; CHANNELS],
    /// Variance of a sample at rest.
    scatter: [f64; CHANNELS],
    stretches: [Vec<EvenStretch>; AXES],
    zero_stretches: [Vec<EvenStretch>; AXES],
}

impl Rounding {
    /// Variance of the error that a mean at rest keeps however long the rest is, of a channel.
    pub fn variance(&self, channel: usize) -> f64 {
        self.of_steps[channel] + self.hidden[channel]
    }

    /// Channels of which rounding, or a dead band, leaves more on a mean at rest than noise does, given the variance of that.
    pub fn coarse_channels(&self, of_noise: &[f64; CHANNELS]) -> Vec<CoarseChannel> {
        let of = |channel: usize| {
            let rounded = self.of_steps[channel] > of_noise[channel];
            let hides = self.hidden[channel] > of_noise[channel];
            (rounded || hides).then(|| CoarseChannel {
                channel,
                step: if rounded { self.step[channel] } else { 0.0 },
                dead_band: if hides { self.dead_band[channel] } else { 0.0 },
                zeros: self.zeros[channel],
                sigma: self.variance(channel).sqrt(),
            })
        };
        (0..CHANNELS).filter_map(of).collect()
    }

    /// Variance left on the means of the three channels from `first` at rest `k`, so that the mean over all rests that read the
    /// same is as uncertain as one (docs/theory/rounding.md, eq. 2).
    pub fn of_rest(&self, rests: &[Segment<f64>], k: usize, first: usize) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let channel = first + i;
            let variance = self.variance(channel);
            if variance == 0.0 {
                return 0.0;
            }
            let reach = self.reach(channel);
            let level = |rest: &Segment<f64>| rest.moments.mean()[channel];
            let alike = |rest: &&Segment<f64>| (level(rest) - level(&rests[k])).abs() < reach;
            #[allow(clippy::cast_precision_loss)]
            let alike = rests.iter().filter(alike).count().max(1) as f64;
            variance * alike // eq. 2
        })
    }

    /// Readings that are this close share the error of rounding.
    fn reach(&self, channel: usize) -> f64 {
        self.step[channel].max(self.dead_band[channel])
    }

    /// Variance left on the angle of a turn, rad^2, of which the rests, whose rates are alike, share the error
    /// (docs/theory/rounding.md, eq. 3, 5).
    pub fn of_turn(&self, turn: &Segment<f64>, rests: usize) -> Vector3<f64> {
        let span = interval(turn);
        let turned = turn.moments.variance();
        Vector3::from_fn(|axis, _| {
            let channel = CHANNELS / 2 + axis;
            if self.of_steps[channel] == 0.0 && self.dead_band[channel] == 0.0 {
                return 0.0;
            }
            let stood = turned[channel] < TURNED * self.scatter[channel].max(self.step[channel].powi(2));
            let variance = if stood {
                self.variance(channel) * span.duration().powi(2)
            } else {
                self.of_even(axis, &span)
            };
            #[allow(clippy::cast_precision_loss)]
            let shared = rests.max(1) as f64;
            variance * shared // eq. 3, 5
        })
    }

    /// Variance left on the angle over a span at one rate, rad^2.
    pub fn of_constant_rate(&self, span: &Interval<f64>) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.variance(CHANNELS / 2 + axis) * span.duration().powi(2))
    }

    /// Variance of the angle, rad^2, that the stretches of even readings within a span leave: each has one error all along.
    /// A dead band has one sign as the axis starts and as it stops.
    fn of_even(&self, axis: usize, span: &Interval<f64>) -> f64 {
        const UNIFORM: f64 = 1.0 / 3.0;
        let channel = CHANNELS / 2 + axis;
        let squares: f64 = within(&self.stretches[axis], span)
            .map(|length| length * length)
            .sum();
        let hidden: f64 = within(&self.zero_stretches[axis], span).sum();
        self.of_steps[channel] * squares + (self.dead_band[channel] * hidden).powi(2) * UNIFORM // eq. 3, 5
    }
}

/// Lengths, s, of the stretches within a span, of stretches in the order of time.
fn within<'a>(stretches: &'a [EvenStretch], span: &'a Interval<f64>) -> impl Iterator<Item = f64> + 'a {
    let first = stretches.partition_point(|each| seconds::<f64>(each.end) <= span.start);
    stretches[first..]
        .iter()
        .take_while(|each| seconds::<f64>(each.start) < span.end)
        .map(|each| seconds::<f64>(each.end).min(span.end) - seconds::<f64>(each.start).max(span.start))
}
