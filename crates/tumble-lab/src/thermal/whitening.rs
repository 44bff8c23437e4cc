//! Whitening of the noise of means over blocks (docs/theory/thermal.md, Noise).

use std::ops::Range;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use tumble_core::noise::{Interval, Noise};

use super::block::RestBlock;

/// Slow noise of a bias, beside white noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wander {
    /// Bias instability, `S(f) = B^2 / (2 pi f)`.
    Flicker,
    /// Random walk, whose change over a time t has the variance `K^2 t`.
    RandomWalk,
}

/// Slow noise of one kind, as strong as white noise at one averaging time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlowNoise {
    /// Which.
    pub wander: Wander,
    /// Square of its strength over that of white noise: `B^2 / N^2`, 1/s, or `K^2 / N^2`, 1/s^2.
    pub ratio: f64,
}

impl Wander {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Flicker, Self::RandomWalk];

    /// That which is as strong as white noise at an averaging time, s.
    pub fn from(self, time: f64) -> SlowNoise {
        let ratio = match self {
            Self::Flicker => time.recip(),
            Self::RandomWalk => time.powi(2).recip(),
        };
        SlowNoise { wander: self, ratio }
    }

    /// Covariance of the means over two blocks of a session for a strength of one, each taken against the mean of the
    /// session.
    fn covariance(self, a: &Interval<f64>, b: &Interval<f64>, session: &Interval<f64>) -> f64 {
        match self {
            Self::Flicker => Noise {
                flicker: 1.0,
                ..Noise::none()
            }
            .covariance(a, b, session),
            Self::RandomWalk => {
                let off = |of: &Interval<f64>| with_session(of, session);
                walked(a, b, session.start) - off(a) - off(b) + session.duration() / 3.0 // eq. 4b
            }
        }
    }
}

/// Covariance of the means over two intervals, the same or apart, of a random walk that is zero at an instant before.
fn walked(a: &Interval<f64>, b: &Interval<f64>, zero: f64) -> f64 {
    if a == b {
        return a.start - zero + a.duration() / 3.0;
    }
    centre(a).min(centre(b)) - zero // eq. 4a
}

/// The same of the means over an interval and over the session that holds it, of one that is zero at its start.
fn with_session(of: &Interval<f64>, session: &Interval<f64>) -> f64 {
    let from_start = centre(of) - session.start;
    let square = from_start.powi(2) + of.duration().powi(2) / 12.0;
    from_start - 0.5 * square / session.duration() // eq. 4b
}

fn centre(of: &Interval<f64>) -> f64 {
    0.5 * (of.start + of.end)
}

/// Rotates the errors of blocks into ones that have nothing in common, whatever the strength of slow noise beside white
/// noise: worked out once for all axes and all polynomials.
#[derive(Clone, Debug)]
pub struct Whitening {
    /// Rotation of each kind of slow noise.
    each: [Rotation; Wander::ALL.len()],
}

#[derive(Clone, Debug)]
struct Rotation {
    /// Blocks of each session, and the rotation of their errors over the root of their white noise.
    sessions: Vec<(Range<usize>, DMatrix<f64>)>,
    /// Variance of each rotated error for slow noise of strength one, where that of white noise of `N = 1` is one.
    wandering: DVector<f64>,
}

impl Whitening {
    /// Whitening of blocks, session after session.
    pub fn new(blocks: &[RestBlock]) -> Self {
        Self {
            each: Wander::ALL.map(|wander| Rotation::new(blocks, wander)),
        }
    }

    /// Rows that stand for blocks, as rows whose errors have nothing in common.
    pub fn apply(&self, wander: Wander, rows: &DMatrix<f64>) -> DMatrix<f64> {
        let mut whitened = DMatrix::zeros(rows.nrows(), rows.ncols());
        for (range, rotation) in &self.each[wander as usize].sessions {
            let part = rotation * rows.rows(range.start, range.len());
            whitened.rows_mut(range.start, range.len()).copy_from(&part);
        }
        whitened
    }

    /// Variance of each error, that of white noise being one.
    pub fn variances(&self, slow: SlowNoise) -> DVector<f64> {
        let of = &self.each[slow.wander as usize];
        of.wandering.map(|wandering| 1.0 + slow.ratio * wandering)
    }
}

impl Rotation {
    fn new(blocks: &[RestBlock], wander: Wander) -> Self {
        let mut sessions = Vec::new();
        let mut wandering = Vec::with_capacity(blocks.len());
        let mut first = 0;
        for session in blocks.chunk_by(|a, b| a.session == b.session) {
            let (rotation, variances) = of_session(session, wander);
            wandering.extend(variances.iter());
            sessions.push((first..first + session.len(), rotation));
            first += session.len();
        }
        Self {
            sessions,
            wandering: DVector::from_vec(wandering),
        }
    }
}

fn of_session(blocks: &[RestBlock], wander: Wander) -> (DMatrix<f64>, DVector<f64>) {
    let span = Interval {
        start: blocks.first().map_or(0.0, |first| first.interval.start),
        end: blocks.last().map_or(0.0, |last| last.interval.end),
    };
    let root: Vec<f64> = blocks
        .iter()
        .map(|block| block.interval.duration().sqrt().recip())
        .collect();
    let wandering = DMatrix::from_fn(blocks.len(), blocks.len(), |i, j| {
        wander.covariance(&blocks[i].interval, &blocks[j].interval, &span) / (root[i] * root[j])
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
