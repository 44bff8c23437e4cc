//! Channels that cannot be trusted: stuck at one value, or pinned at the end of their range.

use tumble_core::gravity::STANDARD as STANDARD_GRAVITY;
use tumble_core::noise::Interval;
use tumble_core::real::seconds;
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::Segment;

use crate::sensor_range::{NEAR_END, PILED_UP, SMALLEST_RANGE};

/// Fault of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelFault {
    /// Index of the channel.
    pub channel: usize,
    /// Kind of the fault.
    pub kind: ChannelFaultKind,
    /// The value it holds, SI.
    pub value: f64,
    /// When it was first and last seen, s since the origin.
    pub span: (f64, f64),
    /// Samples at the end of the range, of a channel that is saturated in motion; zero else.
    pub samples: u32,
    /// When these were, first and last of each run, s since the origin.
    pub runs: Vec<(f64, f64)>,
}

impl ChannelFault {
    /// True where the channel was at the end of its range within these times, s since the origin.
    pub fn touches(&self, span: &Interval<f64>) -> bool {
        self.runs
            .iter()
            .any(|(first, last)| *first < span.end && span.start <= *last)
    }

    /// True where it leaves a turn of the gyroscope unknown: what an accelerometer reads in a turn is not integrated.
    pub fn interrupts(&self, turn: &Interval<f64>) -> bool {
        self.kind == ChannelFaultKind::SaturatedInMotion && self.channel >= CHANNELS / 2 && self.touches(turn)
    }
}

tumble_core::vocabulary! {
    /// Ways for a channel to fail.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ChannelFaultKind {
        /// One value for the whole recording, from some time on, or for several turns on end.
        Stuck = "stuck",
        /// At the end of its range in a rest.
        SaturatedAtRest = "saturated at rest",
        /// At the end of its range in motion.
        SaturatedInMotion = "saturated in motion",
    }
}

/// Watches the six channels, sample by sample and block by block.
#[derive(Clone, Debug)]
pub struct ChannelMonitor {
    ends: [[RangeEnd; 2]; CHANNELS],
    levels: [Levels; CHANNELS],
}

/// Statistics of the blocks of a channel.
#[derive(Clone, Debug)]
struct Levels {
    lowest: f64,
    highest: f64,
    /// Blocks within the smallest range, and how many of these are without scatter.
    within: u32,
    flat: u32,
    first: u64,
    last: u64,
    moved: bool,
    /// Blocks without scatter.
    frozen: Vec<Frozen>,
    /// Number of blocks without scatter at the end of the recording.
    frozen_last: usize,
}

/// A block in which a channel showed one value only.
#[derive(Clone, Copy, Debug)]
struct Frozen {
    start: u64,
    end: u64,
    value: f64,
}

/// One end of what a channel has reached. Sign-turned for the low end, so that both look upward.
#[derive(Clone, Debug)]
struct RangeEnd {
    value: f64,
    nearly: f64,
    at: u32,
    near: u32,
    /// The largest reading below the end, and how often it was seen.
    below: (f64, u32),
    /// Times of the first and the last sample of each run at this value, microseconds.
    runs: Vec<(u64, u64)>,
}

/// Samples closer than this are of one run, microseconds.
const ONE_RUN: u64 = 50_000;

/// Longest time for which a hand or a vehicle clips without a break, microseconds.
const EVEN_TURN: u64 = 2_000_000;

/// Share of an end below which no reading is the next step of a coarse sensor.
const STEP_BELOW: f64 = 0.5;

/// Share of blocks without scatter from which on a sensor repeats its readings wherever it turns evenly.
const FLAT: f64 = 0.1;

/// Relative distance within which a value is a full scale: sensitivities are rounded.
const AT_FULL_SCALE: f64 = 1.5e-3;

/// Full scales that sensors are sold with: specific force, m/s^2 as multiples of g, and angular rate, deg/s.
const FULL_SCALES: [&[f64]; 2] = [
    &[2.0, 4.0, 6.0, 8.0, 16.0, 24.0, 30.0, 32.0],
    &[125.0, 245.0, 250.0, 450.0, 500.0, 1000.0, 2000.0, 4000.0],
];

/// Longest gap between the runs of an even turn, in which noise moves a coarse sensor by a step, microseconds.
const BRIDGED: u64 = 250_000;

/// Runs kept; those after belong to the last.
const MOST_RUNS: usize = 4096;

/// So many turns in a row do not leave one value of a sensor alone.
const TURNS_SLEPT_THROUGH: usize = 3;

/// Turns smaller than this leave a coarse sensor as it was, rad.
const TURNED: f64 = 0.3;

/// Frozen blocks remembered for each channel.
const MOST: usize = 4096;

impl RangeEnd {
    const fn new() -> Self {
        Self {
            value: f64::NEG_INFINITY,
            nearly: f64::NEG_INFINITY,
            at: 0,
            near: 0,
            below: (f64::NEG_INFINITY, 0),
            runs: Vec::new(),
        }
    }

    #[inline]
    fn push(&mut self, y: f64, time: u64) {
        if y < self.nearly && (y < self.below.0 || y < STEP_BELOW * self.value) {
            return;
        }
        if y > self.value {
            self.below = if self.value < STEP_BELOW * y {
                (f64::NEG_INFINITY, 0)
            } else {
                (self.value, self.at)
            };
            let nearly = if y > 0.0 { NEAR_END * y } else { y / NEAR_END };
            self.near = if self.value >= nearly {
                self.near + self.at
            } else {
                0
            };
            (self.value, self.nearly, self.at) = (y, nearly, 1);
            self.runs.clear();
            self.runs.push((time, time));
        } else if y == self.value {
            self.at += 1;
            self.run_on(time);
        } else {
            self.near += u32::from(y >= self.nearly);
            if y > self.below.0 {
                self.below = (y, 1);
            } else if y == self.below.0 {
                self.below.1 += 1;
            }
        }
    }

    fn run_on(&mut self, time: u64) {
        let full = self.runs.len() >= MOST_RUNS;
        match self.runs.last_mut() {
            Some((_, last)) if full || time - *last <= ONE_RUN => *last = time,
            _ => self.runs.push((time, time)),
        }
    }

    /// Readings pile up at the end of a range, and hardly any lie just below it; a coarse sensor has its next step there.
    fn piled_up(&self) -> bool {
        self.at >= PILED_UP && self.at > self.near && self.at > self.below.1
    }

    /// Returns true where the value stood for longer than anybody clips, but for single readings beside it.
    fn lasts(&self) -> bool {
        let mut begun = u64::MAX;
        let mut ended = 0;
        self.runs.iter().any(|&(first, last)| {
            if begun == u64::MAX || first > ended + BRIDGED {
                begun = first;
            }
            ended = last;
            ended - begun > EVEN_TURN
        })
    }
}

impl Levels {
    fn push(&mut self, block: &Segment<f64>, smallest_range: f64, mean: f64, variance: f64) {
        let fresh = self.highest == f64::NEG_INFINITY;
        if fresh {
            self.first = block.start;
        }
        self.moved |= variance > 0.0 || (!fresh && mean != self.highest);
        self.last = block.end;
        self.highest = self.highest.max(mean);
        self.lowest = self.lowest.min(mean);
        if mean.abs() < smallest_range && block.moments.samples() > 4 {
            self.within += 1;
            self.flat += u32::from(variance == 0.0);
        }
        if variance > 0.0 {
            self.frozen_last = 0;
        } else if block.moments.samples() > 4 && self.frozen.len() < MOST {
            self.frozen.push(Frozen {
                start: block.start,
                end: block.end,
                value: mean,
            });
            self.frozen_last += 1;
        }
    }

    /// When and at what value it stuck, if it had noise until then, and none after, not even in the last turn.
    fn stuck_to_the_end(&self, turns: &[&Segment<f64>]) -> Option<(u64, f64)> {
        let first = self.frozen.first()?;
        let lasts = self.frozen_last == self.frozen.len();
        let value = self.slept_through(turns.last()?)?;
        (lasts && self.frozen.iter().all(|frozen| frozen.value == value)).then_some((first.start, value))
    }

    /// The one value shown all through a turn, if it was one.
    fn slept_through(&self, turn: &Segment<f64>) -> Option<f64> {
        let within = |frozen: &&Frozen| turn.start <= frozen.start && frozen.start < turn.end;
        let value = self.frozen.iter().find(within)?.value;
        let asleep: u64 = self
            .frozen
            .iter()
            .filter(within)
            .take_while(|frozen| frozen.value == value)
            .map(|frozen| frozen.end - frozen.start)
            .sum();
        (10 * asleep >= 9 * (turn.end - turn.start)).then_some(value)
    }
}

/// Returns true where a value is a full scale of the sensors of that kind.
fn is_full_scale(value: f64, kind: usize) -> bool {
    let unit = [STANDARD_GRAVITY, 1_f64.to_radians()][kind];
    let at = |scale: &f64| (value - scale * unit).abs() < AT_FULL_SCALE * scale * unit;
    FULL_SCALES[kind].iter().any(at)
}

/// Tests whether all readings lie within the smallest range of any sensor, where they are finite and no end is near.
#[inline]
pub(super) fn is_calm(y: &[f64; CHANNELS]) -> bool {
    (0..CHANNELS).fold(true, |calm, i| calm & (y[i].abs() <= SMALLEST_RANGE[i / 3]))
}

/// Tests whether a unit turned at all between two rests: they may be parts of one.
fn has_turned(turn: &Segment<f64>, before: &Segment<f64>, after: &Segment<f64>) -> bool {
    let gravity = before.specific_force().angle(&after.specific_force());
    gravity.max(turn.angle().norm()) > TURNED
}

impl Default for ChannelMonitor {
    fn default() -> Self {
        Self::new()
    }
}

impl ChannelMonitor {
    /// Nothing seen yet.
    pub fn new() -> Self {
        let levels = Levels {
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            within: 0,
            flat: 0,
            first: 0,
            last: 0,
            moved: false,
            frozen: Vec::new(),
            frozen_last: 0,
        };
        Self {
            ends: core::array::from_fn(|_| [RangeEnd::new(), RangeEnd::new()]),
            levels: core::array::from_fn(|_| levels.clone()),
        }
    }

    /// Takes in a sample that is not calm.
    pub fn push_sample(&mut self, time: u64, y: &[f64; CHANNELS]) {
        for ([low, high], &y) in self.ends.iter_mut().zip(y) {
            low.push(-y, time);
            high.push(y, time);
        }
    }

    /// Takes in a block.
    pub fn push_block(&mut self, block: &Segment<f64>) {
        let variance = block.moments.variance();
        let of_channels = block.moments.mean().iter().zip(&variance);
        for (channel, (levels, (&mean, &variance))) in self.levels.iter_mut().zip(of_channels).enumerate() {
            levels.push(block, SMALLEST_RANGE[channel / 3], mean, variance);
        }
    }

    /// Faults of the channels, given the rests that are used and the turns between them.
    pub fn faults(&self, rests: &[Segment<f64>], turns: &[Segment<f64>]) -> Vec<ChannelFault> {
        let turned: Vec<_> = turns
            .iter()
            .zip(rests.windows(2))
            .filter(|(turn, rests)| has_turned(turn, &rests[0], &rests[1]))
            .map(|(turn, _)| turn)
            .collect();
        (0..CHANNELS)
            .filter_map(|channel| {
                self.stuck(channel, &turned)
                    .or_else(|| self.at_rest(channel, rests))
                    .or_else(|| self.in_motion(channel))
            })
            .collect()
    }

    /// A channel that never moved, that fell silent, or that slept through several turns in a row.
    fn stuck(&self, channel: usize, turns: &[&Segment<f64>]) -> Option<ChannelFault> {
        let levels = &self.levels[channel];
        let fault = |value, first, last| ChannelFault {
            channel,
            kind: ChannelFaultKind::Stuck,
            value,
            span: (seconds(first), seconds(last)),
            samples: 0,
            runs: Vec::new(),
        };
        if !levels.moved && levels.last > levels.first {
            return Some(fault(levels.highest, levels.first, levels.last));
        }
        if let Some((time, value)) = levels.stuck_to_the_end(turns) {
            return Some(fault(value, time, levels.last));
        }
        turns.windows(TURNS_SLEPT_THROUGH).find_map(|turns| {
            let value = levels.slept_through(turns[0])?;
            let others = turns.iter().all(|turn| levels.slept_through(turn) == Some(value));
            let first = levels.frozen.iter().find(|frozen| frozen.value == value)?;
            others.then(|| fault(value, first.start, levels.last))
        })
    }

    /// A coarse sensor holds its value in any rest; one at the end of its range holds it nowhere else, and there for
    /// most of the rest: one step above the noise, a value may repeat for a block by chance.
    fn at_rest(&self, channel: usize, rests: &[Segment<f64>]) -> Option<ChannelFault> {
        let levels = &self.levels[channel];
        // Turned one way only, a coarse gyroscope shows the least of all at rest, where no range ends.
        let least = if channel < CHANNELS / 2 {
            0.0
        } else {
            SMALLEST_RANGE[1]
        };
        let at_end = |value: f64| value.abs() > least && (value == levels.highest || value == levels.lowest);
        if levels.frozen.iter().any(|frozen| !at_end(frozen.value)) {
            return None;
        }
        let within = |frozen: &Frozen, rest: &Segment<f64>| (rest.start..rest.end).contains(&frozen.start);
        let pinned = |rest: &&Segment<f64>| {
            let frozen = levels.frozen.iter().filter(|frozen| within(frozen, rest));
            2 * frozen.map(|frozen| frozen.end - frozen.start).sum::<u64>() > rest.end - rest.start
        };
        let rests: Vec<_> = rests.iter().filter(pinned).collect();
        let inside = |frozen: &&Frozen| rests.iter().any(|rest| within(frozen, rest));
        let mut held = levels.frozen.iter().filter(inside);
        let &Frozen {
            start: first, value, ..
        } = held.next()?;
        let last = held.next_back().map_or(first, |frozen| frozen.start);
        Some(ChannelFault {
            channel,
            kind: ChannelFaultKind::SaturatedAtRest,
            value,
            span: (seconds(first), seconds(last)),
            samples: 0,
            runs: Vec::new(),
        })
    }

    /// Tests whether the sensor of a kind repeats its readings away from any end too: noise does not move it from step to step.
    fn repeats(&self, kind: usize) -> bool {
        let flat = |levels: &Levels| levels.moved && f64::from(levels.flat) > FLAT * f64::from(levels.within);
        self.levels[3 * kind..3 * kind + 3].iter().any(flat)
    }

    /// Returns true where readings pile up at the end of a range. A sensor that repeats its readings does so at any even
    /// rate: its range ends where it stands but briefly, or at a full scale, and not below what another axis or sign reached.
    fn is_end(&self, end: &RangeEnd, kind: usize) -> bool {
        if end.value <= SMALLEST_RANGE[kind] || !end.piled_up() {
            return false;
        }
        let ends = self.ends[3 * kind..3 * kind + 3].iter().flatten();
        let largest = ends.map(|end| end.value).fold(0.0, f64::max);
        let even_turn = end.lasts() || end.value < NEAR_END * largest;
        !(self.repeats(kind) && even_turn && !is_full_scale(end.value, kind))
    }

    /// Either end of the range may be reached, or both; where readings pile up at one end, all ends of the sensor are known.
    fn in_motion(&self, channel: usize) -> Option<ChannelFault> {
        let kind = channel / 3;
        let of_sensor = self.ends.iter().skip(3 * kind).take(3).flatten();
        let ranges: Vec<f64> = of_sensor
            .filter(|end| self.is_end(end, kind))
            .map(|end| end.value)
            .collect();
        let [low, high] = &self.ends[channel];
        let reached = |end: &RangeEnd| ranges.contains(&end.value);
        let value = if reached(low) { -low.value } else { high.value };
        let ends: Vec<&RangeEnd> = [low, high].into_iter().filter(|end| reached(end)).collect();
        let runs = ends.iter().flat_map(|end| &end.runs);
        let mut runs: Vec<_> = runs
            .map(|(first, last)| (seconds(*first), seconds(*last)))
            .collect();
        runs.sort_by(|a, b| f64::total_cmp(&a.0, &b.0));
        Some(ChannelFault {
            channel,
            kind: ChannelFaultKind::SaturatedInMotion,
            value,
            span: (runs.first()?.0, runs.last()?.1),
            samples: ends.iter().map(|end| end.at).sum(),
            runs,
        })
    }
}
