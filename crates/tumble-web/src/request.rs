//! Requests of a page, and what answers each.

use serde::Deserialize;
use serde_json::{Value, json};
use tumble_lab::acquisition::failed_reads;
use tumble_lab::distributions::student_quantile;

use crate::{acquired, multipose, stamps};

/// A request of the page; samples lie in the numbers that it gave.
#[derive(Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case")]
enum PageRequest {
    /// Rests, turns and faults of a recording.
    Acquire(acquired::AcquireRequest),
    /// Tests whether stamps come late.
    Late,
    /// Rows of a triad whose read failed.
    FailedReads,
    /// Even times in place of late stamps.
    SampleTimes,
    /// Calibration of a unit that was held in many orientations.
    Multipose(multipose::MultiposeRequest),
    /// Rate of stamps, beside one that was stated, Hz.
    StampedRate { stated: f64 },
    /// A quantile of Student's distribution.
    StudentQuantile { probability: f64, freedom: f64 },
}

/// Answers a request; one that cannot be read is answered by `{"bug": ...}`, as pages send none.
pub fn answer(request: &[u8], numbers: &mut [f64]) -> Value {
    match serde_json::from_slice(request) {
        Err(error) => json!({ "bug": error.to_string() }),
        Ok(PageRequest::Acquire(settings)) => acquired::acquire(&settings, numbers),
        Ok(PageRequest::Late) => json!(stamps::late(numbers)),
        Ok(PageRequest::FailedReads) => json!(failed_reads(numbers.as_chunks().0)),
        Ok(PageRequest::SampleTimes) => stamps::sample_times(numbers),
        Ok(PageRequest::Multipose(settings)) => multipose::calibrate(&settings, numbers),
        Ok(PageRequest::StampedRate { stated }) => multipose::stamped_rate(numbers, stated),
        Ok(PageRequest::StudentQuantile { probability, freedom }) => {
            json!(student_quantile(probability, freedom))
        }
    }
}
