//! Times of samples whose stamps come late.

use serde_json::{Value, json};
use tumble_lab::stamps::{LatenessEvidence, StampJudgement, are_late, fit_times, judge, scatter_of_steps};

use crate::figures::Samples;

/// Tests whether stamps scatter so much that even times differ from them.
pub fn late(stamps: &[f64]) -> bool {
    are_late(stamps)
}

/// Even times fitted to the stamps of samples, with what the signal shows of them; the scatter of their steps where none fit.
///
/// `kept_sigma` is null where the times replace the stamps.
pub fn sample_times(numbers: &[f64]) -> Value {
    let samples = Samples::of(numbers, false);
    let Some(times) = fit_times(samples.time) else {
        return json!({ "scatter_of_steps": scatter_of_steps(samples.time) });
    };
    let mut evidence = LatenessEvidence::default();
    evidence.push(&times, samples.time, samples.force, samples.rate);
    let kept_sigma = match judge(&times, &evidence, samples.time) {
        StampJudgement::Fitted => None,
        StampJudgement::Kept(sigma) => Some(sigma),
    };
    let fitted: Vec<f64> = (0..samples.time.len()).map(|row| times.at(row)).collect();
    json!({
        "times": fitted,
        "kept_sigma": kept_sigma,
        "sampling": evidence.sampling().name(),
        "share": evidence.share(),
        "interval": times.interval(),
        "latest": times.latest,
        "burst": times.period.burst,
        "lost": times.lost,
        "sigma": times.sigma(),
        "rate_sigma": times.rate_sigma(),
    })
}
