//! Offsets of successive seconds: the least delay of each, or the mean.
//!
//! Equations: docs/theory/clocks.md.

use super::walk::Node;

/// s of a block of a long recording; a short one has fewer and shorter blocks.
const BLOCK: f64 = 10.0;
/// Blocks of a short recording.
const FEWEST_BLOCKS: f64 = 8.0;
/// Fewest samples of a block.
const FEWEST_SAMPLES: f64 = 40.0;

/// A sample: its own even time, s, its delay after that, s, and whether its number is odd.
#[derive(Clone, Copy, Debug)]
pub(super) struct Delayed {
    pub time: f64,
    pub delay: f64,
    pub odd: bool,
}

/// Least delays and means of the odd samples of a block, of the even ones, and of all.
#[derive(Clone, Copy, Debug)]
pub(super) struct DelayBlock {
    least: [Node; 2],
    sum: [f64; 2],
    time: f64,
    count: [f64; 2],
}

/// Which figure of a block follows the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follows {
    /// The least delay: where stamps are late by a time that has a lower end.
    Least,
    /// The mean: where they scatter to both sides.
    Mean,
}

impl DelayBlock {
    fn new() -> Self {
        let nothing = Node {
            time: 0.0,
            offset: f64::INFINITY,
        };
        Self {
            least: [nothing; 2],
            sum: [0.0; 2],
            time: 0.0,
            count: [0.0; 2],
        }
    }

    fn add(&mut self, sample: Delayed) {
        let half = usize::from(sample.odd);
        if sample.delay < self.least[half].offset {
            self.least[half] = Node {
                time: sample.time,
                offset: sample.delay,
            };
        }
        self.sum[half] += sample.delay;
        self.count[half] += 1.0;
        self.time += sample.time;
    }

    /// Offset that follows the clock.
    pub fn node(&self, follows: Follows) -> Node {
        let count = self.count[0] + self.count[1];
        match follows {
            Follows::Least if self.least[0].offset <= self.least[1].offset => self.least[0],
            Follows::Least => self.least[1],
            Follows::Mean => Node {
                time: self.time / count,
                offset: (self.sum[0] + self.sum[1]) / count,
            },
        }
    }

    /// That of the odd samples less that of the even ones; `None` where one of them is missing.
    fn disagreement(&self, follows: Follows) -> Option<f64> {
        (self.count[0] > 0.0 && self.count[1] > 0.0).then(|| match follows {
            Follows::Least => self.least[1].offset - self.least[0].offset,
            Follows::Mean => self.sum[1] / self.count[1] - self.sum[0] / self.count[0],
        })
    }
}

/// Cuts samples, in order of time, into blocks of even length.
pub(super) fn blocks(samples: impl Iterator<Item = Delayed>, span: f64, period: f64) -> Vec<DelayBlock> {
    let length = (span / FEWEST_BLOCKS).clamp(FEWEST_SAMPLES * period, BLOCK.max(FEWEST_SAMPLES * period));
    let mut found: Vec<(f64, DelayBlock)> = Vec::new();
    for sample in samples {
        let place = (sample.time / length).floor();
        if found.last().is_none_or(|(last, _)| place > *last) {
            found.push((place, DelayBlock::new()));
        }
        if let Some((_, block)) = found.last_mut() {
            block.add(sample);
        }
    }
    found.into_iter().map(|(_, block)| block).collect()
}

/// Chooses the figure of which odd and even samples agree better, and gives 1-sigma of it, s (eq. 11).
pub(super) fn choose<'a>(blocks: impl Iterator<Item = &'a DelayBlock> + Clone) -> (Follows, f64) {
    let sigma = |follows| {
        let apart: Vec<f64> = (blocks.clone())
            .filter_map(|block| block.disagreement(follows))
            .collect();
        #[allow(clippy::cast_precision_loss)]
        let count = apart.len().max(1) as f64;
        let mean = apart.iter().sum::<f64>() / count;
        // Where readers poll, odd samples wait longer than even ones, all alike.
        let variance = apart.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        0.5 * variance.sqrt() // eq. 11
    };
    let (least, mean) = (sigma(Follows::Least), sigma(Follows::Mean));
    if least <= mean {
        (Follows::Least, least)
    } else {
        (Follows::Mean, mean)
    }
}
