//! Channels that cannot be trusted: stuck at one value, or pinned at the end of their range.

use tumble_core::noise::AllanLadder;
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::Stretch;

use crate::acquisition::seconds;

/// What is wrong with a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// Index of the channel.
    pub channel: usize,
    /// What it does.
    pub kind: FaultKind,
    /// The value it holds, SI.
    pub value: f64,
    /// When it was first seen, s since the origin.
    pub time: f64,
}

/// Ways for a channel to fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// One value from beginning to end.
    Stuck,
    /// At the end of its range during a rest that is used.
    SaturatedAtRest,
    /// At the end of its range during a turn that is used.
    SaturatedInTurn,
}

/// Blocks in which a channel did not move at all, as far as they matter.
#[derive(Clone, Debug)]
struct Frozen {
    largest: f64,
    smallest: f64,
    /// Times and values of blocks without scatter.
    blocks: Vec<(u64, f64)>,
    moved: bool,
}

/// Watches the six channels, block by block.
#[derive(Clone, Debug)]
pub struct Channels {
    frozen: [Frozen; CHANNELS],
    allan: AllanLadder<f64>,
    first: Option<u64>,
}

/// Frozen blocks remembered for each channel.
const MOST: usize = 4096;

/// Readings within this share of the extreme are at the end of the range.
const AT_END: f64 = 0.999;

impl Default for Channels {
    fn default() -> Self {
        Self::new()
    }
}

impl Channels {
    /// Nothing seen yet.
    pub fn new() -> Self {
        let nothing = Frozen {
            largest: f64::NEG_INFINITY,
            smallest: f64::INFINITY,
            blocks: Vec::new(),
            moved: false,
        };
        Self {
            frozen: core::array::from_fn(|_| nothing.clone()),
            allan: AllanLadder::new(),
            first: None,
        }
    }

    /// Takes in the next block.
    pub fn push(&mut self, block: &Stretch<f64>) {
        self.first.get_or_insert(block.start);
        let variance = block.moments.variance();
        for ((frozen, &mean), &variance) in self.frozen.iter_mut().zip(block.moments.mean()).zip(&variance) {
            frozen.moved |= variance > 0.0 || (frozen.largest.is_finite() && mean != frozen.largest);
            frozen.largest = frozen.largest.max(mean);
            frozen.smallest = frozen.smallest.min(mean);
            if variance == 0.0 && block.moments.samples() > 4 && frozen.blocks.len() < MOST {
                frozen.blocks.push((block.start, mean));
            }
        }
    }

    /// Adds what a part of the recording showed of the noise.
    pub fn gather(&mut self, allan: &AllanLadder<f64>) {
        self.allan.merge(allan);
    }

    /// Noise of all parts.
    pub fn allan(&self) -> &AllanLadder<f64> {
        &self.allan
    }

    /// What is wrong, given the stretches that are used.
    pub fn faults(&self, rests: &[Stretch<f64>], turns: &[Stretch<f64>]) -> Vec<Fault> {
        self.frozen
            .iter()
            .enumerate()
            .filter_map(|(channel, frozen)| frozen.fault(channel, self.first?, rests, turns))
            .collect()
    }
}

impl Frozen {
    fn fault(
        &self,
        channel: usize,
        first: u64,
        rests: &[Stretch<f64>],
        turns: &[Stretch<f64>],
    ) -> Option<Fault> {
        if !self.moved {
            return Some(Fault {
                channel,
                kind: FaultKind::Stuck,
                value: self.largest,
                time: seconds(first),
            });
        }
        let magnitude = self.largest.abs().max(self.smallest.abs());
        let at_end = |value: f64| value.abs() >= AT_END * magnitude;
        // A coarse sensor holds its value in any rest; one at the end of its range holds it nowhere else.
        if self.blocks.iter().any(|(_, value)| !at_end(*value)) {
            return None;
        }
        let within = |stretches: &[Stretch<f64>]| {
            let inside = |t: u64| {
                stretches
                    .iter()
                    .any(|stretch| (stretch.start..stretch.end).contains(&t))
            };
            self.blocks.iter().find(|(t, _)| inside(*t)).copied()
        };
        let fault = |kind, (time, value): (u64, f64)| Fault {
            channel,
            kind,
            value,
            time: seconds(time),
        };
        within(rests)
            .map(|block| fault(FaultKind::SaturatedAtRest, block))
            .or_else(|| within(turns).map(|block| fault(FaultKind::SaturatedInTurn, block)))
    }
}
