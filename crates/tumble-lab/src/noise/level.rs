//! Second and third differences of sums of samples, at one spacing of what they start from (docs/theory/noise.md).

use super::variance_kind::VarianceKind;

/// Lengths of averages in blocks of a level: from half as many as begin the next level.
pub(super) const RATIOS: [usize; 4] = [16, 19, 23, 27];
/// Shorter ones, of which only single samples can be the blocks.
const SHORTEST: [usize; 11] = [1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 13];
/// Blocks that the longest difference reaches over.
const REACH: usize = 3 * 27;
/// Blocks taken in before differences are formed.
const BATCH: usize = 4096;

/// Sum of the samples of a block, and sum of what the sum was before each of them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LevelBlock {
    pub(super) sum: f64,
    pub(super) sum_of_sums: f64,
}

impl LevelBlock {
    /// This block and the next, each of `samples`.
    fn with(self, next: Self, samples: f64) -> Self {
        Self {
            sum: self.sum + next.sum,
            sum_of_sums: self.sum_of_sums + next.sum_of_sums + samples * self.sum, // eq. 18
        }
    }
}

/// Sum of squared differences of a kind at one length, and how many there are.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DifferenceSquares {
    pub(super) sum: f64,
    pub(super) count: u64,
}

/// Differences at all lengths that start every `samples` samples.
#[derive(Clone, Debug)]
pub(super) struct Level {
    samples: usize,
    ratios: Vec<usize>,
    squares: Vec<[DifferenceSquares; VarianceKind::COUNT]>,
    /// Sums of samples up to each boundary of blocks, and sums of those sums, from the first boundary still needed.
    sums: Vec<f64>,
    sums_of_sums: Vec<f64>,
    /// First boundaries from which differences were not formed yet.
    starts: Vec<[usize; VarianceKind::COUNT]>,
    pending: Option<LevelBlock>,
}

impl Level {
    pub(super) fn new(number: u32) -> Self {
        let shortest = SHORTEST.iter().filter(|_| number == 0);
        let ratios: Vec<usize> = shortest.chain(&RATIOS).copied().collect();
        let mut level = Self {
            samples: 1 << number,
            squares: vec![[DifferenceSquares::default(); VarianceKind::COUNT]; ratios.len()],
            starts: vec![[0; VarianceKind::COUNT]; ratios.len()],
            ratios,
            sums: Vec::with_capacity(BATCH + REACH + 1),
            sums_of_sums: Vec::with_capacity(BATCH + REACH + 1),
            pending: None,
        };
        level.begin();
        level
    }

    /// Begins a stretch: no difference spans what was before.
    pub(super) fn begin(&mut self) {
        self.sums.clear();
        self.sums.push(0.0);
        self.sums_of_sums.clear();
        self.sums_of_sums.push(0.0);
        self.starts.fill([0; VarianceKind::COUNT]);
        self.pending = None;
    }

    /// Takes in blocks; gives pairs of them to `above`.
    pub(super) fn push(
        &mut self,
        blocks: &[LevelBlock],
        kinds: &[VarianceKind],
        above: &mut Vec<LevelBlock>,
    ) {
        let samples = self.samples as f64;
        for block in blocks {
            let sum = self.sums[self.sums.len() - 1];
            let sum_of_sums = self.sums_of_sums[self.sums_of_sums.len() - 1];
            self.sums.push(sum + block.sum);
            self.sums_of_sums
                .push(sum_of_sums + samples * sum + block.sum_of_sums); // eq. 18
            match self.pending.take() {
                Some(before) => above.push(before.with(*block, samples)),
                None => self.pending = Some(*block),
            }
            if self.sums.len() > BATCH + REACH {
                self.form(kinds);
                self.forget();
            }
        }
    }

    /// Forms all differences that the sums at hand allow.
    pub(super) fn form(&mut self, kinds: &[VarianceKind]) {
        let have = self.sums.len();
        for (i, &ratio) in self.ratios.iter().enumerate() {
            for &kind in kinds {
                let start = self.starts[i][kind as usize];
                let reach = kind.reach() * ratio;
                if start + reach < have {
                    let count = have - reach - start;
                    let squares = &mut self.squares[i][kind as usize];
                    squares.sum += match kind {
                        VarianceKind::Allan => squared_second(&self.sums[start..], ratio, count),
                        VarianceKind::Hadamard => squared_third(&self.sums[start..], ratio, count),
                        VarianceKind::Modified => squared_third(&self.sums_of_sums[start..], ratio, count),
                    };
                    squares.count += count as u64;
                    self.starts[i][kind as usize] += count;
                }
            }
        }
    }

    /// Keeps what differences to come reach back to, counted from its first sum: numbers stay small, and no
    /// difference changes.
    fn forget(&mut self) {
        let drop = self.sums.len() - REACH - 1;
        let (sum, sum_of_sums) = (self.sums[drop], self.sums_of_sums[drop]);
        self.sums.drain(..drop);
        self.sums_of_sums.drain(..drop);
        let step = self.samples as f64 * sum;
        for (number, (one, two)) in self.sums.iter_mut().zip(&mut self.sums_of_sums).enumerate() {
            *one -= sum;
            *two -= sum_of_sums + number as f64 * step;
        }
        for starts in &mut self.starts {
            starts
                .iter_mut()
                .for_each(|start| *start = start.saturating_sub(drop));
        }
    }

    /// Length in samples, and squares, of each kind.
    pub(super) fn squares(
        &self,
    ) -> impl Iterator<Item = (usize, [DifferenceSquares; VarianceKind::COUNT])> + '_ {
        let lengths = self.ratios.iter().map(|ratio| ratio * self.samples);
        lengths.zip(self.squares.iter().copied())
    }
}

/// Numbers summed side by side, as processors do.
const LANES: usize = 8;

fn squared_second(x: &[f64], ratio: usize, count: usize) -> f64 {
    let (a, b, c) = (&x[..count], &x[ratio..][..count], &x[2 * ratio..][..count]);
    let mut lanes = [0.0; LANES];
    let whole = count - count % LANES;
    for i in (0..whole).step_by(LANES) {
        let (a, b, c) = (&a[i..i + LANES], &b[i..i + LANES], &c[i..i + LANES]);
        for k in 0..LANES {
            let d = (c[k] - b[k]) - (b[k] - a[k]);
            lanes[k] += d * d;
        }
    }
    let rest = (whole..count).map(|i| ((c[i] - b[i]) - (b[i] - a[i])).powi(2));
    lanes.iter().sum::<f64>() + rest.sum::<f64>()
}

fn squared_third(x: &[f64], ratio: usize, count: usize) -> f64 {
    let (a, b) = (&x[..count], &x[ratio..][..count]);
    let (c, d) = (&x[2 * ratio..][..count], &x[3 * ratio..][..count]);
    let third = |a: f64, b: f64, c: f64, d: f64| (d - a) - 3.0 * (c - b);
    let mut lanes = [0.0; LANES];
    let whole = count - count % LANES;
    for i in (0..whole).step_by(LANES) {
        let (a, b) = (&a[i..i + LANES], &b[i..i + LANES]);
        let (c, d) = (&c[i..i + LANES], &d[i..i + LANES]);
        for k in 0..LANES {
            let difference = third(a[k], b[k], c[k], d[k]);
            lanes[k] += difference * difference;
        }
    }
    let rest = (whole..count).map(|i| third(a[i], b[i], c[i], d[i]).powi(2));
    lanes.iter().sum::<f64>() + rest.sum::<f64>()
}
