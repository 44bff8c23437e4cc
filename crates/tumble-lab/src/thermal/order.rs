//! Choice of the terms that the data bear: those that best predict held-out data (docs/theory/thermal.md, Order).
//!
//! Stretches of time are held out, not single means: neighbours share their errors, so that one predicts the other
//! whatever the polynomial.

use super::block::RestBlock;
use super::fit::{DriftDesign, Terms};
use super::whitening::Whitening;

/// Stretches of equal length that are left out one by one.
const STRETCHES: usize = 10;
/// Standard errors by which what is left must be worse than the least for terms to be too few: what Student's t of
/// nine degrees of freedom exceeds once in forty times. With one, one axis in ten is given a power that it has not.
const CLEARLY: f64 = 2.262;

/// Error of prediction of each of several sets of terms.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Which of them: the first that is not clearly worse than the best.
    pub chosen: usize,
    /// Root mean square error of prediction of each, in the unit of the axis.
    pub left: Vec<f64>,
}

/// The ways to leave a stretch out, worked out once for all axes.
#[derive(Clone, Debug)]
pub struct Folds {
    folds: Vec<Fold>,
}

/// One stretch left out.
#[derive(Clone, Debug)]
struct Fold {
    kept: Vec<usize>,
    /// Those that were kept, with their poses numbered anew.
    blocks: Vec<RestBlock>,
    whitening: Whitening,
    /// Held-out blocks, with the new number of their pose: poses that were held in no other stretch have none.
    out: Vec<(usize, usize)>,
}

impl Folds {
    /// Stretches of blocks in order of time.
    pub fn new(blocks: &[RestBlock]) -> Self {
        let folds = (0..STRETCHES).filter_map(|stretch| Fold::new(blocks, stretch));
        Self {
            folds: folds.collect(),
        }
    }

    /// Chooses among `candidates`, the simplest first, for the `means` of one axis, which go with `blocks`; one whose
    /// powers are `certain` is not passed over for a simpler one.
    ///
    /// None where there is too little to leave anything out.
    pub fn choose(
        &self,
        blocks: &[RestBlock],
        means: &[f64],
        reference: f64,
        candidates: &[Terms],
        certain: &[bool],
    ) -> Option<Choice> {
        let foretold = |fold: &Fold| fold.foretold(blocks, means, reference, candidates);
        let squares: Vec<Vec<f64>> = self.folds.iter().filter_map(foretold).collect();
        if squares.len() < 2 {
            return None;
        }
        let of_candidate = |each: usize| mean(squares.iter().map(|stretch| stretch[each]));
        let left: Vec<f64> = (0..candidates.len()).map(of_candidate).collect();
        let best = (0..candidates.len()).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
        let simplest = (0..=best)
            .find(|each| is_as_good(&squares, *each, best))
            .unwrap_or(best);
        let known = (0..=best).rev().find(|each| certain[*each]).unwrap_or(0);
        Some(Choice {
            chosen: simplest.max(known),
            left: left.iter().map(|square| square.sqrt()).collect(),
        })
    }
}

impl Fold {
    fn new(blocks: &[RestBlock], stretch: usize) -> Option<Self> {
        let (out, kept): (Vec<usize>, Vec<usize>) =
            (0..blocks.len()).partition(|place| place * STRETCHES / blocks.len() == stretch);
        let mut poses: Vec<usize> = kept.iter().map(|place| blocks[*place].pose).collect();
        poses.sort_unstable();
        poses.dedup();
        let number = |place: &usize| poses.binary_search(&blocks[*place].pose).ok();
        let others: Vec<RestBlock> = kept
            .iter()
            .filter_map(|place| {
                Some(RestBlock {
                    pose: number(place)?,
                    ..blocks[*place]
                })
            })
            .collect();
        let out: Vec<(usize, usize)> = out
            .into_iter()
            .filter_map(|place| Some((place, number(&place)?)))
            .collect();
        (!out.is_empty()).then(|| Self {
            whitening: Whitening::new(&others),
            blocks: others,
            kept,
            out,
        })
    }

    /// Mean squares of the errors of the stretch, for each candidate, when it is predicted from the others.
    fn foretold(
        &self,
        blocks: &[RestBlock],
        means: &[f64],
        reference: f64,
        candidates: &[Terms],
    ) -> Option<Vec<f64>> {
        let design = DriftDesign::new(&self.whitening, &self.blocks, reference);
        let kept: Vec<f64> = self.kept.iter().map(|place| means[*place]).collect();
        candidates
            .iter()
            .map(|terms| {
                let fit = design.fit(&kept, terms)?;
                Some(mean(self.out.iter().map(|&(place, pose)| {
                    let block = &blocks[place];
                    (means[place] - fit.reading(pose, block.temperature - reference, block.leg)).powi(2)
                })))
            })
            .collect()
    }
}

/// Tests whether one candidate is not clearly worse than the best, by the squares of each stretch.
fn is_as_good(squares: &[Vec<f64>], candidate: usize, best: usize) -> bool {
    let worse = || squares.iter().map(|stretch| stretch[candidate] - stretch[best]);
    let average = mean(worse());
    let count = squares.len() as f64;
    let variance = mean(worse().map(|more| (more - average).powi(2))) / (count - 1.0);
    average <= CLEARLY * variance.sqrt() // eq. 8
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / f64::max(count, 1.0)
}
