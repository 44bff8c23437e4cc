//! Rests, turns and faults of a recording.

use serde::Deserialize;
use serde_json::{Value, json};
use tumble_core::real::seconds;
use tumble_lab::acquisition::consistency::{GyroscopeConsistency, compare_gyroscope};
use tumble_lab::acquisition::{
    Acquired, Acquisition, AlternationWatch, CHANNEL_NAMES, Repetition, Standstill, standstills,
};
use tumble_lab::multipose::rest_settings;

use crate::figures::{Samples, vectors};

/// Shortest rest that is looked for, microseconds.
pub const SHORTEST_REST: u64 = 1_000_000;

/// A recording to be cut into rests and turns.
#[derive(Deserialize)]
pub struct AcquireRequest {
    temperature: bool,
    gyroscope: bool,
    pace_sigma: f64,
    stamp_sigma: f64,
}

/// Cuts a recording into rests and turns, as `tumble` does; stretches in which all stood still are left out.
pub fn acquire(request: &AcquireRequest, numbers: &[f64]) -> Value {
    let samples = Samples::of(numbers, request.temperature);
    let triads = samples.triads(request.gyroscope);
    let still = standstills(samples.time, triads);
    let mut turns = AlternationWatch::default();
    turns.push(triads);
    let mut acquisition = Acquisition::new(rest_settings(SHORTEST_REST, 1.0));
    acquisition.begin_part("");
    acquisition.push(
        &still.moving(samples.time),
        &still.moving(samples.force),
        &still.moving(samples.rate),
        samples.temperature.map(|each| still.moving(each)).as_deref(),
    );
    let mut acquired = acquisition.finish();
    acquired.pace_sigma = request.pace_sigma;
    acquired.stamp_sigma = request.stamp_sigma;
    let at = |(first, last): Repetition| (samples.time[first], samples.time[last]);
    json!({
        "units": turns.units(),
        "frozen": still.frozen.iter().map(|run| at(*run)).collect::<Vec<_>>(),
        "stuck": still.stuck.iter().map(|each| stuck(each, at(each.run))).collect::<Vec<_>>(),
        "acquired": figures(&acquired),
    })
}

/// A standstill as the fault of a channel, by its first and last time, s.
fn stuck(found: &Standstill, (first, last): (f64, f64)) -> Value {
    json!({
        "channel": CHANNEL_NAMES[found.channel],
        "kind": "stuck",
        "value": found.value,
        "first": first,
        "last": last,
        "samples": 0,
        "runs": [],
    })
}

/// Figures of what was acquired.
pub fn figures(acquired: &Acquired) -> Value {
    let at = |microseconds: u64| acquired.origin + seconds::<f64>(microseconds);
    let spans = acquired
        .rests
        .iter()
        .map(|rest| (at(rest.start), at(rest.end)))
        .collect::<Vec<_>>();
    let rejected = acquired.rejected.iter();
    let faults = acquired.faults.iter();
    let noise = acquired.noise.iter();
    let points = acquired.trace.points();
    json!({
        "samples": acquired.samples,
        "not_finite": acquired.not_finite,
        "missing": acquired.missing,
        "first_backwards": acquired.first_backwards,
        "temperature": acquired.temperature,
        "rest_times": spans,
        "rest_specific_force": vectors(acquired.rests.iter().map(|rest| rest.specific_force())),
        "rest_angular_rate": vectors(acquired.rests.iter().map(|rest| rest.angular_rate())),
        "turn_complete": acquired.turns.iter().map(|turn| turn.complete).collect::<Vec<_>>(),
        "rejected_rests": rejected
            .map(|(rest, reason)| (at(rest.start), at(rest.end), reason.name()))
            .collect::<Vec<_>>(),
        "noise_density": noise.clone().map(|noise| noise.white.sqrt()).collect::<Vec<_>>(),
        "bias_instability": noise
            .map(|noise| if noise.flicker > 2.0 * noise.flicker_sigma { noise.flicker.sqrt() } else { 0.0 })
            .collect::<Vec<_>>(),
        "faults": faults
            .map(|fault| json!({
                "channel": CHANNEL_NAMES[fault.channel],
                "kind": fault.kind.name(),
                "value": fault.value,
                "first": acquired.origin + fault.span.0,
                "last": acquired.origin + fault.span.1,
                "samples": fault.samples,
                "runs": fault.runs
                    .iter()
                    .map(|(first, last)| (acquired.origin + first, acquired.origin + last))
                    .collect::<Vec<_>>(),
            }))
            .collect::<Vec<_>>(),
        "coarse_channels": acquired.coarse_channels()
            .iter()
            .map(|each| (CHANNEL_NAMES[each.channel], each.step, each.dead_band, each.zeros, each.sigma))
            .collect::<Vec<_>>(),
        "consistency": consistency(acquired),
        "trace": {
            "time": points.iter().map(|(time, _)| acquired.origin + time).collect::<Vec<_>>(),
            "channels": points.iter().map(|(_, channels)| channels).collect::<Vec<_>>(),
        },
    })
}

/// Consistency of gyroscope and accelerometer, which show the same turns: a word, a figure, axes.
fn consistency(acquired: &Acquired) -> Value {
    match compare_gyroscope(acquired) {
        GyroscopeConsistency::Consistent => json!(["consistent", 0.0, []]),
        GyroscopeConsistency::Unknown => json!(["unknown", 0.0, []]),
        GyroscopeConsistency::Scaled(scale) => json!(["scaled", scale, []]),
        GyroscopeConsistency::Permuted(axes) => json!(["permuted", 0.0, axes]),
        GyroscopeConsistency::Inconsistent(angle) => json!(["inconsistent", angle, []]),
    }
}
