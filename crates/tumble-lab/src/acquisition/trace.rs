//! A recording at a glance: means over equal segments, never more than can be drawn.

use tumble_core::real::seconds;
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::Segment;

/// Points kept at most.
const MOST: usize = 4096;

/// Mean time and mean channels over equal numbers of blocks. When full, neighbours are merged and the stride doubles.
#[derive(Clone, Debug)]
pub struct Trace {
    points: Vec<(f64, [f64; CHANNELS])>,
    stride: u32,
    gathered: u32,
    sum: (f64, [f64; CHANNELS]),
}

impl Default for Trace {
    fn default() -> Self {
        Self::new()
    }
}

impl Trace {
    /// No blocks yet.
    pub fn new() -> Self {
        Self {
            points: Vec::new(),
            stride: 1,
            gathered: 0,
            sum: (0.0, [0.0; CHANNELS]),
        }
    }

    /// Takes in the next block.
    pub fn push(&mut self, block: &Segment<f64>) {
        self.sum.0 += 0.5 * (seconds::<f64>(block.start) + seconds::<f64>(block.end));
        for (sum, mean) in self.sum.1.iter_mut().zip(block.moments.mean()) {
            *sum += mean;
        }
        self.gathered += 1;
        if self.gathered == self.stride {
            let share = 1.0 / f64::from(self.gathered);
            self.points
                .push((self.sum.0 * share, self.sum.1.map(|sum| sum * share)));
            self.sum = (0.0, [0.0; CHANNELS]);
            self.gathered = 0;
            if self.points.len() == MOST {
                self.halve();
            }
        }
    }

    /// Time in s since the origin, and the means of the channels.
    pub fn points(&self) -> &[(f64, [f64; CHANNELS])] {
        &self.points
    }

    fn halve(&mut self) {
        let merged = self.points.chunks_exact(2).map(|pair| {
            let mean = |a: f64, b: f64| 0.5 * (a + b);
            (
                mean(pair[0].0, pair[1].0),
                core::array::from_fn(|i| mean(pair[0].1[i], pair[1].1[i])),
            )
        });
        self.points = merged.collect();
        self.stride *= 2;
    }
}
