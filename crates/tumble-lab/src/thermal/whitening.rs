//! Whitening of the noise of means over blocks (docs/theory/thermal.md, Noise).

use std::ops::Range;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use tumble_core::noise::{Interval, Noise};

use super::block::RestBlock;

/// Rotates the errors of blocks into ones that have nothing in common, whatever the ratio of flicker to white noise:
/// worked out once for all axes and all polynomials.
#[derive(Clone, Debug)]
pub struct Whitening {
    /// Blocks of each session, and the rotation of their errors over the root of their white noise.
    sessions: Vec<(Range<usize>, DMatrix<f64>)>,
    /// Variance of each rotated error for `B = 1`, where that of white noise of `N = 1` is one.
    wandering: DVector<f64>,
}

impl Whitening {
    /// Whitening of blocks, session after session.
    pub fn new(blocks: &[RestBlock]) -> Self {
        let mut sessions = Vec::new();
        let mut wandering = Vec::with_capacity(blocks.len());
        let mut first = 0;
        for session in blocks.chunk_by(|a, b| a.session == b.session) {
            let (rotation, variances) = of_session(session);
            wandering.extend(variances.iter());
            sessions.push((first..first + session.len(), rotation));
            first += session.len();
        }
        Self {
            sessions,
            wandering: DVector::from_vec(wandering),
        }
    }

    /// Rows that stand for blocks, as rows whose errors have nothing in common.
    pub fn apply(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        let mut whitened = DMatrix::zeros(rows.nrows(), rows.ncols());
        for (range, rotation) in &self.sessions {
            let part = rotation * rows.rows(range.start, range.len());
            whitened.rows_mut(range.start, range.len()).copy_from(&part);
        }
        whitened
    }

    /// Variance of each error, that of white noise being one, for a ratio of `B^2` to `N^2`, 1/s.
    pub fn variances(&self, ratio: f64) -> DVector<f64> {
        self.wandering.map(|wandering| 1.0 + ratio * wandering)
    }
}

fn of_session(blocks: &[RestBlock]) -> (DMatrix<f64>, DVector<f64>) {
    let span = Interval {
        start: blocks.first().map_or(0.0, |first| first.interval.start),
        end: blocks.last().map_or(0.0, |last| last.interval.end),
    };
    let white = Noise {
        white: 1.0,
        ..Noise::none()
    };
    let flicker = Noise {
        flicker: 1.0,
        ..Noise::none()
    };
    let root: Vec<f64> = blocks
        .iter()
        .map(|a| white.covariance(&a.interval, &a.interval, &span).sqrt())
        .collect();
    let wandering = DMatrix::from_fn(blocks.len(), blocks.len(), |i, j| {
        flicker.covariance(&blocks[i].interval, &blocks[j].interval, &span) / (root[i] * root[j])
    });
    let SymmetricEigen {
        eigenvectors,
        eigenvalues,
    } = wandering.symmetric_eigen();
    let scaling = DMatrix::from_diagonal(&DVector::from_vec(root).map(f64::recip));
    (
        eigenvectors.transpose() * scaling,
        eigenvalues.map(|value| value.max(0.0)),
    )
}
