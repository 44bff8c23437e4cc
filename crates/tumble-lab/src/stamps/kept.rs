//! Stamps that a recording keeps, and their error; or the times that replace them.
//!
//! Equations: docs/theory/clocks.md.

use super::evidence::{LatenessEvidence, Sampling};
use super::fit::SampleTimes;
use crate::distributions::median;

/// s, time in which a hand or a robot gets up to its rate: shorter errors of stamps average out over it.
const RAMP: f64 = 0.25;
/// Steps that are longer or shorter than the middle one by this share of it lead over a pause, or from stamp to stamp of a burst.
const OTHER_STEP: f64 = 0.5;

/// Times that a recording goes by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StampJudgement {
    /// Those fitted to its stamps.
    Fitted,
    /// Its stamps, with the 1-sigma of one, s.
    Kept(f64),
}

/// Decides between the stamps of a whole recording and the times fitted to them, by what its signal shows.
#[must_use]
pub fn judge(times: &SampleTimes, evidence: &LatenessEvidence, stamps: &[f64]) -> StampJudgement {
    let is_burst = times.period.burst > 1.0;
    match evidence.sampling() {
        Sampling::Even => StampJudgement::Fitted,
        Sampling::Stamped => StampJudgement::Kept(0.0),
        Sampling::Unshown if is_burst => StampJudgement::Fitted,
        Sampling::Unshown => StampJudgement::Kept(scatter_of_means(times, stamps)),
        Sampling::Between => {
            let (beta, sigma) = evidence.share().unwrap_or((0.0, 0.0));
            StampJudgement::Kept((1.0 - beta + 2.0 * sigma) * scatter_of_means(times, stamps)) // eq. 15
        }
    }
}

/// Scatter, s, of the steps between successive stamps, s, that no times fit; those over pauses have no part in it.
#[must_use]
pub fn scatter_of_steps(stamps: &[f64]) -> f64 {
    let steps = || stamps.windows(2).map(|pair| pair[1] - pair[0]);
    let middle = median(&mut steps().collect::<Vec<_>>()).unwrap_or(0.0);
    deviation(
        &steps()
            .filter(|step| (step - middle).abs() < OTHER_STEP * middle)
            .collect::<Vec<_>>(),
    )
}

/// Scatter, s, of how late stamps are in the mean over the time in which a turn gets up to its rate.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss
)]
fn scatter_of_means(times: &SampleTimes, stamps: &[f64]) -> f64 {
    let size = (RAMP / times.interval()).round().max(1.0) as usize;
    let late: Vec<f64> = stamps
        .iter()
        .enumerate()
        .map(|(row, stamp)| stamp - times.at(row))
        .collect();
    let means: Vec<f64> = late
        .chunks_exact(size)
        .map(|chunk| chunk.iter().sum::<f64>() / size as f64)
        .collect();
    deviation(&means)
}

/// Standard deviation of values about their mean; zero of none.
#[allow(clippy::cast_precision_loss)]
fn deviation(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}
