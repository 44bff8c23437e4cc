//! Which stretches are rests: what counts as still is chosen by what the calibration gains from it.

use tumble_core::segmenter::SegmenterSettings;

use crate::acquisition::{Acquired, Acquisition};

/// Tolerances tried, as factors on the usual limits of scatter and drift: a table, a lap, a hand.
pub(super) const TOLERANCES: [f64; 4] = [1.0, 2.0, 4.0, BY_HAND];

/// Tolerance for a unit that is held, not laid down.
pub const BY_HAND: f64 = 8.0;

/// Settings of the segmenter with limits wider than usual by this factor; `shortest_rest` in microseconds.
pub fn rest_settings(shortest_rest: u64, tolerance: f64) -> SegmenterSettings<f64> {
    let mut settings = SegmenterSettings {
        shortest_rest,
        ..SegmenterSettings::default()
    };
    let limits = &mut settings.stillness;
    limits.variance_ratio *= tolerance * tolerance;
    limits.smallest_specific_force_scatter *= tolerance;
    limits.smallest_angular_rate_scatter *= tolerance;
    limits.specific_force_drift *= tolerance;
    limits.angular_rate_drift *= tolerance;
    settings
}

/// Cuts samples into rests and turns.
pub(super) fn acquire(
    time: &[f64],
    force: &[[f64; 3]],
    rate: &[[f64; 3]],
    shortest_rest: u64,
    tolerance: f64,
) -> Acquired {
    let mut acquisition = Acquisition::new(rest_settings(shortest_rest, tolerance));
    acquisition.push(time, force, rate, None);
    acquisition.finish()
}
