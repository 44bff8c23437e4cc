//! A flight with five times as many samples as the vectors hold: 200 a second of each unit.

use mission::MissionError;
use mission::units::{Instant, UNITS, UnitReadings, platform};
use mission::vectors::Cases;
use mission::work_meter::{WorkMeter, WorkPart};
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::sample::Sample;

/// Samples for each of the vectors.
const TIMES: u8 = 5;

/// Rest, motion and a fit, with samples in between on straight lines: what is found is of no interest, what it costs is.
///
/// # Errors
/// [`MissionError`].
pub fn fly<W: WorkMeter>(file: &[u8], watch: &mut W) -> Result<(), MissionError> {
    let cases = Cases::of(file)?;
    let platform = platform(&cases)?;
    let mut monitor = Monitor::<f32, UNITS, 1>::new();
    let mut readings = UnitReadings::new(&cases)?;
    let Some(mut before) = readings.next().transpose()? else {
        return Err(MissionError::Vectors("primary_counts"));
    };
    for instant in readings {
        let after = instant?;
        for part in 1..=TIMES {
            for (unit, sample) in between(&before, &after, part).iter().enumerate() {
                let part = if monitor.is_fitting() {
                    WorkPart::Fit
                } else {
                    WorkPart::Push
                };
                watch.during(|| monitor.push(&platform, unit, sample, &mut |_| {}));
                watch.was(part);
            }
        }
        before = after;
    }
    Ok(())
}

/// Interpolates the readings of all units between one instant and the next.
fn between(before: &Instant, after: &Instant, part: u8) -> Instant {
    let share = f32::from(part) / f32::from(TIMES);
    let mut all = *after;
    for ((to, from), end) in all.iter_mut().zip(before).zip(after) {
        *to = Sample {
            time: from.time + (end.time - from.time) * u64::from(part) / u64::from(TIMES),
            specific_force: from.specific_force.lerp(&end.specific_force, share),
            angular_rate: from.angular_rate.lerp(&end.angular_rate, share),
        };
    }
    all
}
