//! Rests that are none: vibration, drift of the specific force, and slow turns that only the whole recording shows.

use nalgebra::Vector3;
use tumble_core::segmenter::{Segment, SegmenterSettings};
use tumble_core::stillness::Scatter;

use super::acquired::{Acquired, RestRejection};
use super::consistency::{GyroscopeConsistency, compare_gyroscope};
use super::interval::interval;

/// Takes out what only looked like a rest, now that the whole recording is known, given the noise at rest.
pub(super) fn reject_rests(
    found: &mut Acquired,
    settings: &SegmenterSettings<f64>,
    floor: Option<Scatter<f64>>,
) {
    reject(found, |found, i| disturbed(&found.rests[i], settings, floor));
    // In a wrong unit g-sensitivity looks like slow turns; the unit is the thing to complain of then.
    if matches!(
        compare_gyroscope(found),
        GyroscopeConsistency::Consistent | GyroscopeConsistency::Unknown
    ) {
        reject(found, |found, i| {
            is_turning(found, i).then_some(RestRejection::Turning)
        });
    }
}

/// Takes out the rests that there is a reason against; the turns beside one become one turn.
pub(super) fn reject(
    found: &mut Acquired,
    reason_against: impl Fn(&Acquired, usize) -> Option<RestRejection>,
) {
    let mut i = 0;
    while i < found.rests.len() {
        let Some(reason) = reason_against(found, i) else {
            i += 1;
            continue;
        };
        found.rejected.push((found.rests[i], reason));
        take_out(found, i);
    }
}

/// Takes out a rest; the turns beside it become one turn.
pub(super) fn take_out(found: &mut Acquired, i: usize) {
    if i > 0 && i < found.turns.len() {
        let rest = found.rests[i];
        let after = found.turns.remove(i);
        let before = &mut found.turns[i - 1];
        before.append(&rest);
        before.append(&after);
    } else if i < found.turns.len() {
        found.turns.remove(i);
    } else if i > 0 {
        found.turns.truncate(i - 1);
    }
    found.rests.remove(i);
    if i < found.rest_noise.len() {
        found.rest_noise.remove(i);
    }
}

/// Drift of the specific force that no rest shows, m/s^3: gravity turning at 0.4 mrad/s.
const LARGEST_SLOPE: f64 = 0.004;

/// Angular rate by which rests may differ from each other, rad/s: a bias does not jump that far in a session.
const LARGEST_RATE_JUMP: f64 = 0.005;

/// Largest response of a gyroscope to specific force, rad/s per m/s^2: 0.3 deg/s per g, the worst of consumer grade.
const WORST_G_SENSITIVITY: f64 = 5e-4;

/// Drift of specific force, m/s^2, and angular rate, rad/s, within a rest that is not vibration: a bias that warms up, or
/// the last of a turn before the sensor's own noise was known.
const LARGEST_DRIFT: (f64, f64) = (0.02, 0.003);

fn disturbed(
    rest: &Segment<f64>,
    settings: &SegmenterSettings<f64>,
    floor: Option<Scatter<f64>>,
) -> Option<RestRejection> {
    let scatter = Scatter::of(&rest.moments);
    let floor = floor?;
    let limits = &settings.stillness;
    let drift = |drift: f64| drift * drift / 3.0;
    let noisy = |scatter: f64, floor: f64, smallest: f64, allowed: f64| {
        scatter > limits.variance_ratio * floor + smallest * smallest + drift(allowed)
    };
    if noisy(
        scatter.specific_force,
        floor.specific_force,
        limits.smallest_specific_force_scatter,
        LARGEST_DRIFT.0,
    ) || noisy(
        scatter.angular_rate,
        floor.angular_rate,
        limits.smallest_angular_rate_scatter,
        LARGEST_DRIFT.1,
    ) {
        return Some(RestRejection::Vibrating);
    }
    let duration = rest.duration();
    let slope_sigma = (12.0 * scatter.specific_force / f64::from(rest.moments.samples())).sqrt() / duration;
    (rest.specific_force_slope().norm() > LARGEST_SLOPE.max(6.0 * slope_sigma))
        .then_some(RestRejection::Drifting)
}

/// A rest whose rate differs from both its neighbours', while these agree, is a slow turn. A turn that never ends
/// cannot be separated from bias by rate alone; that one the drift of gravity shows, unless it is about the vertical.
fn is_turning(found: &Acquired, i: usize) -> bool {
    let n = found.rests.len();
    if n < 3 {
        return false;
    }
    let (a, b) = match i {
        0 => (1, 2),
        _ if i + 1 == n => (n - 3, n - 2),
        _ => (i - 1, i + 1),
    };
    let variance = Scatter::of(&found.rests[i].moments).angular_rate;
    let rate = |k: usize| found.rests[k].angular_rate();
    let samples = |k: usize| f64::from(found.rests[k].moments.samples());
    let force = |k: usize| found.rests[k].specific_force();
    let gate = |j: usize, k: usize| {
        let noise = (variance / samples(j) + variance / samples(k)).sqrt();
        LARGEST_RATE_JUMP + WORST_G_SENSITIVITY * (force(j) - force(k)).norm() + 6.0 * noise
    };
    let apart = |j: usize, k: usize| -> Vector3<f64> { rate(j) - rate(k) };
    apart(i, a).norm() > gate(i, a) && apart(i, b).norm() > gate(i, b) && apart(a, b).norm() <= gate(a, b)
}

/// A turn in which the gyroscope reached the end of its range is not known in full.
pub(crate) fn leave_out_saturated(found: &mut Acquired) {
    for turn in &mut found.turns {
        let when = interval(turn);
        turn.complete &= !found.faults.iter().any(|fault| fault.interrupts(&when));
    }
}
