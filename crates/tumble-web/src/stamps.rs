//! Times of samples whose stamps come late.

use serde_json::{Value, json};
use tumble_lab::stamps::{LatenessEvidence, are_late, fit_times};

use crate::figures::Samples;

/// Tests whether stamps scatter so much that even times differ from them.
pub fn late(stamps: &[f64]) -> bool {
    are_late(stamps)
}

/// Even times fitted to the stamps of samples, with what the signal shows of them; null where none fit.
pub fn sample_times(numbers: &[f64]) -> Value {
    let samples = Samples::of(numbers, false);
    let Some(times) = fit_times(samples.time) else {
        return Value::Null;
    };
    let mut evidence = LatenessEvidence::default();
    evidence.push(&times, samples.time, samples.force, samples.rate);
    let fitted: Vec<f64> = (0..samples.time.len()).map(|row| times.at(row)).collect();
    json!({
        "times": fitted,
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
