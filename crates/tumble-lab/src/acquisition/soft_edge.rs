//! Rests and turns with soft edges: what vibrates averages out of their means and integrals (docs/theory/noise.md, vibration).
//!
//! A unit that shakes shows the begin of a turn late: the first and last `TRIM` seconds of a rest go to the turns beside it.

use std::collections::VecDeque;

use nalgebra::Vector3;
use tumble_core::noise::Interval;
use tumble_core::real::seconds;
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::Segment;
use tumble_core::soft_mean::{SoftMeans, rise, slope_of_rise};

use super::interval::interval;

/// Length of an edge, s: as half a window of the soft means of rests.
const LENGTH: f64 = 0.4;

/// Length, s, by which a rest may begin too early and end too late.
const TRIM: f64 = 0.3;

/// Blocks older than this are not needed, microseconds: a turn is known a second after the next rest has begun, or a block.
const OLDEST: u64 = 5_000_000;

/// Integral of the end or the beginning of a rest, weighted so that it rises from zero towards the turn beside it, and is one
/// over the trimmed part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftEdge {
    /// Where turn and rest meet, microseconds.
    pub at: u64,
    /// Integrals of the six channels, m/s and rad.
    pub integral: [f64; CHANNELS],
    /// Integral of the weight, s.
    pub length: f64,
}

/// A turn that begins and ends in the middle of its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftTurn {
    /// Integral of the angular rate, rad.
    pub angle: Vector3<f64>,
    /// Over this interval, s since the origin.
    pub interval: Interval<f64>,
}

impl SoftTurn {
    /// A turn with abrupt edges.
    pub fn abrupt(turn: &Segment<f64>) -> Self {
        Self {
            angle: turn.angle(),
            interval: interval(turn),
        }
    }

    /// A turn with both its edges, where they are known.
    pub fn with_edges(turn: &Segment<f64>, edges: &[SoftEdge]) -> Self {
        let edge = |at: u64| edges.iter().find(|edge| edge.at == at);
        let (Some(before), Some(after)) = (edge(turn.start), edge(turn.end)) else {
            return Self::abrupt(turn);
        };
        let rate = |edge: &SoftEdge| Vector3::new(edge.integral[3], edge.integral[4], edge.integral[5]);
        let abrupt = Self::abrupt(turn);
        Self {
            angle: abrupt.angle + rate(before) + rate(after),
            interval: Interval {
                start: abrupt.interval.start - before.length,
                end: abrupt.interval.end + after.length,
            },
        }
    }

    /// Length, s.
    pub fn duration(&self) -> f64 {
        self.interval.duration()
    }
}

/// Fewest blocks as long as the one given that last so many seconds.
fn blocks_over(length: f64, block: &Segment<f64>) -> u32 {
    let mut count = 1_u32;
    while f64::from(count) * block.duration() < length {
        count += 1;
    }
    count
}

/// Means with soft edges over a rest that goes on, trimmed at both ends.
#[derive(Clone, Debug)]
pub(super) struct SoftRest {
    means: SoftMeans<f64>,
    held: VecDeque<Segment<f64>>,
    trim: u32,
}

impl SoftRest {
    /// A rest whose first blocks are these.
    pub fn begin<'a>(mut blocks: impl Iterator<Item = &'a Segment<f64>>) -> Option<Self> {
        let trim = blocks_over(TRIM, blocks.next()?);
        let mut rest = Self {
            means: SoftMeans::new(),
            held: VecDeque::new(),
            trim,
        };
        for block in blocks.skip(trim as usize - 1) {
            rest.push(block);
        }
        Some(rest)
    }

    /// Takes in a block; the newest are held back, and those two that turn out to begin a turn.
    pub fn push(&mut self, block: &Segment<f64>) {
        self.held.push_back(*block);
        if self.held.len() > self.trim as usize + 2
            && let Some(block) = self.held.pop_front()
        {
            self.means
                .push(block.moments.mean(), block.duration(), &block.lever);
        }
    }

    /// The means without what was held back.
    pub fn finish(self) -> SoftMeans<f64> {
        self.means
    }
}

/// The newest blocks of a recording.
#[derive(Clone, Debug, Default)]
pub(super) struct RecentBlocks(VecDeque<Segment<f64>>);

impl RecentBlocks {
    /// Takes in a block.
    pub fn push(&mut self, block: &Segment<f64>) {
        let oldest = block
            .end
            .saturating_sub(OLDEST.max(12 * (block.end - block.start)));
        while self.0.front().is_some_and(|first| first.start < oldest) {
            self.0.pop_front();
        }
        self.0.push_back(*block);
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Blocks that begin at a time or later, microseconds.
    pub fn since(&self, at: u64) -> impl Iterator<Item = &Segment<f64>> {
        self.0.iter().filter(move |block| block.start >= at)
    }

    /// The edge of a rest that ended; `None` where it is shorter than an edge.
    pub fn rise(&self, rest: &Segment<f64>) -> Option<SoftEdge> {
        let inside = self.0.iter().filter(|block| within(block, rest));
        let blocks: Vec<_> = inside.rev().copied().collect();
        edge(&blocks, rest.end, -1.0)
    }

    /// The edge of a rest that begins at `at`, of which blocks have come already.
    pub fn fall(&self, at: u64) -> Option<SoftEdge> {
        let blocks: Vec<_> = self.since(at).copied().collect();
        edge(&blocks, at, 1.0)
    }
}

fn within(block: &Segment<f64>, rest: &Segment<f64>) -> bool {
    block.start >= rest.start && block.end <= rest.end
}

/// The edge over the blocks nearest to `at`, the nearest first; `direction` is that of time away from `at`.
fn edge(blocks: &[Segment<f64>], at: u64, direction: f64) -> Option<SoftEdge> {
    let nearest = blocks.first()?;
    let meets = if direction > 0.0 {
        nearest.start
    } else {
        nearest.end
    } == at;
    let (trimmed, count) = (blocks_over(TRIM, nearest), blocks_over(LENGTH, nearest));
    let used = blocks.get(..(trimmed + count) as usize)?;
    if !(meets && used.iter().all(|block| block.complete)) {
        return None;
    }
    let mut edge = SoftEdge {
        at,
        integral: [0.0; CHANNELS],
        length: 0.0,
    };
    for (place, block) in (0_u32..).zip(used) {
        let duration = seconds::<f64>(block.end - block.start);
        let past = f64::from(place) - f64::from(trimmed) + 0.5;
        let x = (1.0 - past / f64::from(count)).min(1.0);
        let weight = rise(x);
        let slope = -direction * slope_of_rise(x) / (duration * f64::from(count));
        for (i, sum) in edge.integral.iter_mut().enumerate() {
            *sum +=
                weight * block.integral[i] + slope * (block.lever[i] - block.integral[i] * 0.5 * duration);
        }
        edge.length += weight * duration;
    }
    Some(edge)
}
