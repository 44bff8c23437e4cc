//! A record as blocks of equal length, however long it is: what disturbances are looked for in.

/// Blocks that are kept; beyond, neighbours are joined.
const MOST_BLOCKS: usize = 1 << 14;

/// One channel over one block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Which log.
    pub(super) log: usize,
    /// First and last sample, s.
    pub(super) time: [f64; 2],
    /// Samples at rest.
    pub(super) count: f64,
    /// Mean of the samples at rest.
    pub(super) mean: f64,
    squares: f64,
    low: f64,
    high: f64,
    /// Lowest and highest sample that was not at rest.
    pub(super) moved: Option<[f64; 2]>,
}

impl Window {
    /// Standard deviation of a sample; None where there are too few.
    pub(super) fn scatter(&self) -> Option<f64> {
        (self.count > 1.0).then(|| (self.squares / (self.count - 1.0)).sqrt())
    }

    /// Sample furthest from the mean, less the mean.
    pub(super) fn excursion(&self) -> f64 {
        let (below, above) = (self.low - self.mean, self.high - self.mean);
        if above > -below { above } else { below }
    }
}

#[derive(Clone, Copy, Debug)]
struct Sums {
    mean: f64,
    squares: f64,
    low: f64,
    high: f64,
    moved: [f64; 2],
}

#[derive(Clone, Debug)]
struct WatchBlock {
    log: usize,
    time: [f64; 2],
    /// Samples, at rest or not.
    samples: u64,
    count: f64,
    channels: Vec<Sums>,
}

impl WatchBlock {
    fn new(log: usize, time: f64, width: usize) -> Self {
        let nothing = Sums {
            mean: 0.0,
            squares: 0.0,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            moved: [f64::INFINITY, f64::NEG_INFINITY],
        };
        Self {
            log,
            time: [time; 2],
            samples: 0,
            count: 0.0,
            channels: vec![nothing; width],
        }
    }

    fn push(&mut self, time: f64, row: &[f64], at_rest: bool) {
        self.time[1] = time;
        self.samples += 1;
        if !at_rest {
            for (sums, value) in self.channels.iter_mut().zip(row) {
                sums.moved = [sums.moved[0].min(*value), sums.moved[1].max(*value)];
            }
            return;
        }
        self.count += 1.0;
        for (sums, value) in self.channels.iter_mut().zip(row) {
            let off = value - sums.mean;
            sums.mean += off / self.count;
            sums.squares += off * (value - sums.mean);
            sums.low = sums.low.min(*value);
            sums.high = sums.high.max(*value);
        }
    }

    fn append(&mut self, later: &Self) {
        let count = self.count + later.count;
        for (sums, other) in self.channels.iter_mut().zip(&later.channels) {
            let [low, high] = other.moved;
            sums.moved = [sums.moved[0].min(low), sums.moved[1].max(high)];
            if later.count > 0.0 {
                let off = other.mean - sums.mean;
                sums.mean += off * later.count / count;
                sums.squares += other.squares + off * off * self.count * later.count / count;
                sums.low = sums.low.min(other.low);
                sums.high = sums.high.max(other.high);
            }
        }
        self.count = count;
        self.samples += later.samples;
        self.time[1] = later.time[1];
    }
}

/// Takes in a record sample by sample, at rest or not.
#[derive(Clone, Debug)]
pub struct Watched {
    width: usize,
    log: usize,
    blocks: Vec<WatchBlock>,
    /// Samples of a block.
    length: u64,
}

impl Watched {
    /// No samples yet.
    pub fn new(channels: usize) -> Self {
        Self {
            width: channels,
            log: 0,
            blocks: Vec::new(),
            length: 1,
        }
    }

    /// Number of channels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Begins another log.
    pub fn end_log(&mut self) {
        self.log += 1;
    }

    /// Takes in a sample, at rest or not: s and all channels.
    pub fn push(&mut self, time: f64, row: &[f64], at_rest: bool) {
        match self.blocks.last_mut() {
            Some(last) if last.samples < self.length && last.log == self.log => last.push(time, row, at_rest),
            _ => {
                if self.blocks.len() >= MOST_BLOCKS {
                    self.join();
                }
                let mut block = WatchBlock::new(self.log, time, self.width);
                block.push(time, row, at_rest);
                self.blocks.push(block);
            }
        }
    }

    fn join(&mut self) {
        self.length *= 2;
        let mut joined: Vec<WatchBlock> = Vec::with_capacity(MOST_BLOCKS);
        for block in std::mem::take(&mut self.blocks) {
            match joined.last_mut() {
                Some(last) if last.log == block.log && last.samples + block.samples <= self.length => {
                    last.append(&block);
                }
                _ => joined.push(block),
            }
        }
        self.blocks = joined;
    }

    /// All blocks of one channel.
    pub(super) fn windows(&self, channel: usize) -> Vec<Window> {
        let of_block = |block: &WatchBlock| {
            let sums = block.channels[channel];
            let [low, high] = sums.moved;
            Window {
                log: block.log,
                time: block.time,
                count: block.count,
                mean: sums.mean,
                squares: sums.squares,
                low: sums.low,
                high: sums.high,
                moved: (low <= high).then_some([low, high]),
            }
        };
        self.blocks.iter().map(of_block).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_a_long_record_are_those_of_its_samples() {
        let mut watched = Watched::new(1);
        let samples = 5 * MOST_BLOCKS;
        for number in 0..samples {
            let value = [(number % 7) as f64];
            watched.push(number as f64, &value, true);
        }
        let windows = watched.windows(0);
        assert!(windows.len() <= MOST_BLOCKS);
        assert_eq!(
            windows.iter().map(|window| window.count).sum::<f64>(),
            samples as f64
        );
        let mean: f64 = (0..8).map(|number| f64::from(number % 7)).sum::<f64>() / 8.0;
        assert!((windows[0].mean - mean).abs() < 1e-12);
        assert_eq!(windows[0].time, [0.0, 7.0]);
        assert_eq!(windows[0].excursion(), 6.0 - mean);
    }
}
