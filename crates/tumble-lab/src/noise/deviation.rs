//! Allan, modified Allan and Hadamard variances of one channel, from samples as they come, in constant memory.
//!
//! Averaging times grow by a quarter octave. Up to 31 samples a difference starts at every sample; from there on, at
//! every sixteenth to thirty-first part of the averaging time. Nothing is sampled down: sums of all samples are what
//! differences are formed of (docs/theory/noise.md, eq. 17 to 19).

use std::collections::BTreeMap;

use super::level::{Level, LevelBlock};
use super::variance_kind::VarianceKind;

/// A variance at one averaging time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variance {
    /// Averaging time, samples.
    pub samples: usize,
    /// unit^2.
    pub variance: f64,
    /// Differences it is the mean of.
    pub count: u64,
}

/// Samples between two starts of differences at that averaging time.
pub(super) fn stride(samples: usize) -> usize {
    if samples < 32 {
        1
    } else {
        1 << (samples.ilog2() - 4)
    }
}

/// Sums over the samples of one channel.
#[derive(Clone, Debug)]
pub struct Deviations {
    kinds: Vec<VarianceKind>,
    levels: Vec<Level>,
    /// Samples taken in, less the first of them, to go one level up.
    rising: Vec<Vec<LevelBlock>>,
    /// First sample of the stretch at hand.
    origin: Option<f64>,
    in_stretch: u64,
    stretches: BTreeMap<u64, u64>,
}

/// Samples handed up at once.
const HANDED: usize = 1024;

impl Deviations {
    /// No samples yet.
    pub fn new(kinds: &[VarianceKind]) -> Self {
        Self {
            kinds: kinds.to_vec(),
            levels: Vec::new(),
            rising: Vec::new(),
            origin: None,
            in_stretch: 0,
            stretches: BTreeMap::new(),
        }
    }

    /// Takes in samples that follow each other without a gap.
    pub fn push(&mut self, samples: impl Iterator<Item = f64>) {
        let mut samples = samples.peekable();
        let Some(first) = samples.peek().copied() else {
            return;
        };
        let origin = *self.origin.get_or_insert(first);
        let mut blocks = Vec::with_capacity(HANDED);
        for sample in samples {
            self.in_stretch += 1;
            blocks.push(LevelBlock {
                sum: sample - origin,
                sum_of_sums: 0.0,
            });
            if blocks.len() == HANDED {
                self.raise(&blocks);
                blocks.clear();
            }
        }
        self.raise(&blocks);
    }

    fn raise(&mut self, blocks: &[LevelBlock]) {
        if self.levels.is_empty() {
            self.add_level();
        }
        self.levels[0].push(blocks, &self.kinds, &mut self.rising[0]);
        for number in 1.. {
            if self.rising[number - 1].is_empty() {
                break;
            }
            if number == self.levels.len() {
                self.add_level();
            }
            let blocks = std::mem::take(&mut self.rising[number - 1]);
            self.levels[number].push(&blocks, &self.kinds, &mut self.rising[number]);
            self.rising[number - 1] = blocks;
            self.rising[number - 1].clear();
        }
    }

    fn add_level(&mut self) {
        self.levels.push(Level::new(self.levels.len() as u32));
        self.rising.push(Vec::new());
    }

    /// Ends a stretch: what follows lies beyond a gap, or in another record.
    pub fn end_stretch(&mut self) {
        for level in &mut self.levels {
            level.form(&self.kinds);
        }
        self.form_last_of_modified();
        self.levels.iter_mut().for_each(Level::begin);
        if self.in_stretch > 0 {
            *self.stretches.entry(self.in_stretch).or_insert(0) += 1;
        }
        self.in_stretch = 0;
        self.origin = None;
    }

    /// Forms the modified differences whose span ends with the last sample. Their last sum of sums is known one sample
    /// early (eq. 18): any sample completes its block, and none of its value enters.
    fn form_last_of_modified(&mut self) {
        if self.in_stretch == 0 || !self.kinds.contains(&VarianceKind::Modified) {
            return;
        }
        let kinds = std::mem::replace(&mut self.kinds, vec![VarianceKind::Modified]);
        self.raise(&[LevelBlock::default()]);
        for level in &mut self.levels {
            level.form(&self.kinds);
        }
        self.kinds = kinds;
    }

    /// Number of stretches of each length in samples, of those that were ended.
    pub fn stretches(&self) -> &BTreeMap<u64, u64> {
        &self.stretches
    }

    /// Variances at all averaging times that have any difference, of the stretches that were ended.
    pub fn variances(&self, kind: VarianceKind) -> Vec<Variance> {
        let of_levels = self.levels.iter().flat_map(Level::squares);
        of_levels
            .map(|(samples, squares)| (samples, squares[kind as usize]))
            .filter(|(_, squares)| squares.count > 0)
            .map(|(samples, squares)| Variance {
                samples,
                variance: squares.sum / (squares.count as f64 * kind.divisor(samples as f64)),
                count: squares.count,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn deviations(records: &[&[f64]]) -> Deviations {
        let mut found = Deviations::new(&VarianceKind::ALL);
        for record in records {
            found.push(record.iter().copied());
            found.end_stretch();
        }
        found
    }

    /// Mean of `samples` samples from `start` on.
    fn mean(y: &[f64], start: usize, samples: usize) -> f64 {
        y[start..start + samples].iter().sum::<f64>() / samples as f64
    }

    /// Samples that enter a difference by its definition.
    fn span(kind: VarianceKind, m: usize) -> usize {
        match kind {
            VarianceKind::Allan => 2 * m,
            VarianceKind::Modified => 3 * m - 1,
            VarianceKind::Hadamard => 3 * m,
        }
    }

    /// Sum of squares by the definition, and number of differences.
    fn by_definition(y: &[f64], m: usize, kind: VarianceKind) -> (f64, u64) {
        let starts = (0..)
            .step_by(stride(m))
            .take_while(|i| i + span(kind, m) <= y.len());
        let difference = |i| match kind {
            VarianceKind::Allan => (mean(y, i + m, m) - mean(y, i, m)) / 2f64.sqrt(),
            VarianceKind::Hadamard => {
                (mean(y, i + 2 * m, m) - 2.0 * mean(y, i + m, m) + mean(y, i, m)) / 6f64.sqrt()
            }
            VarianceKind::Modified => {
                let each = (i..i + m).map(|k| mean(y, k + m, m) - mean(y, k, m));
                each.sum::<f64>() / (m as f64 * 2f64.sqrt())
            }
        };
        starts.fold((0.0, 0), |(sum, count), i| {
            (sum + difference(i).powi(2), count + 1)
        })
    }

    fn series(samples: usize, seed: u64) -> Vec<f64> {
        let mut state = seed | 1;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        (0..samples).map(|i| 9.8 + draw() + 1e-4 * i as f64).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn every_variance_is_that_of_its_definition(lengths in prop::collection::vec(1usize..1500, 1..4), seed: u64) {
            let records: Vec<Vec<f64>> = lengths.iter().map(|n| series(*n, seed ^ *n as u64)).collect();
            let found = deviations(&records.iter().map(Vec::as_slice).collect::<Vec<_>>());
            for kind in VarianceKind::ALL {
                for each in found.variances(kind) {
                    let (sum, count) = records
                        .iter()
                        .map(|y| by_definition(y, each.samples, kind))
                        .fold((0.0, 0), |(s, n), (sum, count)| (s + sum, n + count));
                    prop_assert_eq!(count, each.count);
                    let expected = sum / count as f64;
                    prop_assert!((each.variance - expected).abs() < 1e-9 * expected + 1e-16, "{:?} {:?} {}", kind, each, expected);
                }
            }
        }

        #[test]
        fn samples_in_pieces_give_what_all_at_once_give(cuts in prop::collection::vec(0usize..20_000, 0..6), seed: u64) {
            let y = series(20_000, seed);
            let whole = deviations(&[&y]);
            let mut cuts = cuts;
            cuts.extend([0, y.len()]);
            cuts.sort_unstable();
            let mut pieces = Deviations::new(&VarianceKind::ALL);
            cuts.windows(2).for_each(|pair| pieces.push(y[pair[0]..pair[1]].iter().copied()));
            pieces.end_stretch();
            for kind in VarianceKind::ALL {
                let (a, b) = (whole.variances(kind), pieces.variances(kind));
                prop_assert_eq!(a.len(), b.len());
                for (a, b) in a.iter().zip(&b) {
                    prop_assert!((a.variance - b.variance).abs() < 1e-9 * a.variance);
                    prop_assert_eq!(a.count, b.count);
                }
            }
        }

        #[test]
        fn a_scale_and_an_offset_scale_variances_and_leave_them(scale in 0.01f64..100.0, offset in -100f64..100.0, seed: u64) {
            let y = series(3000, seed);
            let other: Vec<f64> = y.iter().map(|v| scale * v + offset).collect();
            for kind in VarianceKind::ALL {
                for (a, b) in deviations(&[&y]).variances(kind).iter().zip(&deviations(&[&other]).variances(kind)) {
                    prop_assert!((b.variance / (scale * scale * a.variance) - 1.0).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn a_ramp_has_allan_deviation_of_half_its_rise_and_no_hadamard() {
        let slope = 3e-3;
        let y: Vec<f64> = (0..100_000).map(|i| slope * f64::from(i)).collect();
        let found = deviations(&[&y]);
        for each in found.variances(VarianceKind::Allan) {
            let expected = (slope * each.samples as f64).powi(2) / 2.0;
            assert!(
                (each.variance / expected - 1.0).abs() < 1e-9,
                "{each:?} {expected}"
            );
        }
        for each in found.variances(VarianceKind::Hadamard) {
            assert!(
                each.variance < 1e-18 * (1.0 + each.samples as f64).powi(2),
                "{each:?}"
            );
        }
    }

    #[test]
    fn differences_do_not_span_a_gap() {
        let low = vec![0.0; 5000];
        let high = vec![1.0; 5000];
        let found = deviations(&[&low, &high]);
        assert!(
            found
                .variances(VarianceKind::Allan)
                .iter()
                .all(|each| each.variance == 0.0)
        );
        assert_eq!(found.stretches().get(&5000), Some(&2));
    }

    #[test]
    fn memory_grows_by_a_level_an_octave_not_with_the_record() {
        let mut found = Deviations::new(&[VarianceKind::Allan]);
        for _ in 0..64 {
            found.push(series(1 << 14, 5).into_iter());
        }
        assert!(found.levels.len() <= 21, "{}", found.levels.len());
        assert!(found.rising.iter().all(|blocks| blocks.capacity() <= 2 * HANDED));
    }
}
