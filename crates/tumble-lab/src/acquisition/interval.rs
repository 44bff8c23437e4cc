//! Times of segments, in seconds and in microseconds.

use tumble_core::noise::Interval;
use tumble_core::real::seconds;
use tumble_core::segmenter::Segment;

/// Microseconds of a time since the origin, s.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub(crate) fn microseconds(time: f64) -> u64 {
    (time * 1e6).round().max(0.0) as u64
}

/// When a segment took place, s since the origin.
pub fn interval(segment: &Segment<f64>) -> Interval<f64> {
    Interval {
        start: seconds(segment.start),
        end: seconds(segment.end),
    }
}
