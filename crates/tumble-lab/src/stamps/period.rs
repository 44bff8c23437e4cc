//! Sampling period of a sensor, from stamps of which each is late by a time of its own.
//!
//! Equations: docs/theory/clocks.md.

use crate::distributions::median;

/// Scatter of stamps over the period below which they are exact.
const EXACT: f64 = 0.002;
/// Fewest stamps that show how they scatter.
pub const FEWEST: usize = 200;
/// Most differences of which the median is taken.
const MOST_DIFFERENCES: usize = 20_000;
/// Longest difference, in samples.
const LONGEST: usize = 4096;
/// Samples that hold several bursts, or a whole one.
const BURSTS_WITHIN: usize = 128;
/// Step over period below which two samples were stamped in one burst.
const IN_BURST: f64 = 0.2;
/// Share of such steps from which stamps come in bursts.
const BURSTS: f64 = 0.4;

/// Sampling period, and how stamps scatter about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Period {
    /// s from one sample to the next.
    pub seconds: f64,
    /// 1-sigma of the step between stamps, s, steps over pauses left out.
    pub scatter: f64,
    /// Mean number of samples that were stamped together; one where each has a stamp of its own.
    pub burst: f64,
}

/// Share of the deviations that are closest to the median, of which scatter is the mean: a pause is among the others.
const CLOSEST: f64 = 0.9;
/// The same mean of Gaussian deviations of 1-sigma.
const CLOSEST_OF_GAUSSIAN: f64 = 0.6573;

/// Median, over `span`, of differences over `span` samples, and their scatter over `span`, both s.
///
/// Most differences of coarse stamps are alike: their median deviation is zero, whatever the others are.
fn differences(stamps: &[f64], span: usize) -> (f64, f64) {
    let stride = (stamps.len() / MOST_DIFFERENCES).max(1);
    let pairs = stamps.iter().zip(&stamps[span..]).step_by(stride);
    #[allow(clippy::cast_precision_loss)]
    let mut steps: Vec<f64> = pairs.map(|(first, last)| (last - first) / span as f64).collect();
    let middle = median(&mut steps).unwrap_or(f64::NAN);
    for step in &mut steps {
        *step = (*step - middle).abs();
    }
    steps.sort_by(f64::total_cmp);
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss
    )]
    let closest = ((CLOSEST * steps.len() as f64) as usize).max(1);
    #[allow(clippy::cast_precision_loss)]
    let scatter = steps.iter().take(closest).sum::<f64>() / closest as f64 / CLOSEST_OF_GAUSSIAN;
    (middle, scatter)
}

/// Measures the sampling period: the median of differences over so few samples that they are exact, or that scatter least (eq. 9).
///
/// `None` for too few stamps, or such as do not advance.
#[must_use]
pub fn measure(stamps: &[f64]) -> Option<Period> {
    if stamps.len() < FEWEST {
        return None;
    }
    // Within bursts, steps of nearly nothing are most even.
    let is_burst = differences(stamps, 1).0 < IN_BURST * differences(stamps, BURSTS_WITHIN).0;
    let shortest = if is_burst { BURSTS_WITHIN } else { 1 };
    let spans = (0..).map(|power| shortest << power);
    let found: Vec<(f64, f64)> = spans
        .take_while(|&span| span <= LONGEST && (4 * span <= stamps.len() || span == shortest))
        .map(|span| differences(stamps, span))
        .collect();
    // Beyond what is exact, a longer span gains nothing, and samples that are lost regularly would pass for a longer period.
    let exact = found.iter().find(|(middle, scatter)| *scatter <= EXACT * middle);
    let (seconds, _) = *exact.or_else(|| found.iter().min_by(|a, b| a.1.total_cmp(&b.1)))?; // eq. 9
    if seconds <= 0.0 || !seconds.is_finite() {
        return None;
    }
    let steps = || stamps.windows(2).map(|pair| pair[1] - pair[0]);
    let together = steps().filter(|&step| step < IN_BURST * seconds).count();
    let apart = steps().count() - together;
    let (mut sum, mut number) = (0.0, 0.0);
    for off in steps()
        .map(|step| step - seconds)
        .filter(|off| off.abs() < 0.5 * seconds)
    {
        sum += off * off;
        number += 1.0;
    }
    #[allow(clippy::cast_precision_loss)]
    let burst = stamps.len() as f64 / (apart + 1) as f64;
    #[allow(clippy::cast_precision_loss)]
    let bursts = together as f64 > BURSTS * steps().count() as f64;
    Some(Period {
        seconds,
        scatter: if bursts {
            burst * seconds
        } else {
            (sum / f64::max(number, 1.0)).sqrt()
        },
        burst: if bursts { burst } else { 1.0 },
    })
}

/// Decides whether stamps scatter so much about even times that these differ from them.
#[must_use]
pub fn are_late(stamps: &[f64]) -> bool {
    measure(stamps).is_some_and(|period| period.scatter > EXACT * period.seconds)
}
