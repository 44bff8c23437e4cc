//! The redundant set whose readings are played: a primary and two secondaries.

use nalgebra::Vector3;
use tumble_core::products::diagonal;
use tumble_core::real::real;
use tumble_core::redundancy::platform::{MountedUnit, Platform, PrimaryCalibration};
use tumble_core::redundancy::settings::RedundancySettings;
use tumble_core::sample::{CHANNELS, Sample};

use crate::MissionError;
use crate::vectors::{Cases, VectorCounts, VectorRows};

/// A primary and two secondaries.
pub const UNITS: usize = 3;

/// Serial numbers of the units.
const IDENTITIES: [u64; UNITS] = [0x7001, 0x7002, 0x7003];

/// Time of the first sample, microseconds.
const START: u64 = 1_000_000;

/// Error of the second secondary relative to the first, beside being mounted upside down, in steps.
const OFF: VectorCounts = [1_500, -900, 700, -800, 600, 400];

/// Signs of the channels of a unit that is turned by half a turn about x.
const UPSIDE_DOWN: VectorCounts = [1, -1, -1, 1, -1, -1];

/// The set as it is built.
///
/// # Errors
/// [`MissionError`] where the vectors lack a setting, or the set contradicts itself.
pub fn platform(cases: &Cases<'_>) -> Result<Platform<f32, UNITS>, MissionError> {
    let mut settings = RedundancySettings::default();
    settings.evaluation.rest_duration = cases.seconds("rest_duration_s")?;
    settings.collection.collect = cases.seconds("collect_s")?;
    let mut units = IDENTITIES.map(MountedUnit::new);
    let [_, _, second] = &mut units;
    second.sensor_from_primary = diagonal(1.0, -1.0, -1.0);
    Ok(Platform::new(settings, PrimaryCalibration::none(), units)?)
}

/// Readings of all units at one instant, in the order of their numbers.
pub type Instant = [Sample<f32>; UNITS];

/// The readings of the set, instant by instant, as often as they are asked for one after the other.
#[derive(Clone)]
pub struct UnitReadings<'f> {
    primary: VectorRows<'f>,
    secondary: VectorRows<'f>,
    steps: [f32; 2],
    interval: u64,
    time: u64,
}

impl<'f> UnitReadings<'f> {
    /// From the beginning.
    ///
    /// # Errors
    /// [`MissionError::Vectors`] where something is missing.
    pub fn new(cases: &Cases<'f>) -> Result<Self, MissionError> {
        Ok(Self {
            primary: cases.rows("primary_counts")?,
            secondary: cases.rows("secondary_counts")?,
            steps: [
                real(cases.number("force_step")?),
                real(cases.number("rate_step")?),
            ],
            interval: cases.microseconds("interval_us")?,
            time: START,
        })
    }

    /// The same once more, with time going on.
    pub fn again(&self, cases: &Cases<'f>) -> Result<Self, MissionError> {
        Ok(Self {
            time: self.time,
            ..Self::new(cases)?
        })
    }
}

impl Iterator for UnitReadings<'_> {
    type Item = Result<Instant, MissionError>;

    fn next(&mut self) -> Option<Self::Item> {
        let (primary, secondary) = match (self.primary.next()?, self.secondary.next()?) {
            (Ok(primary), Ok(secondary)) => (primary, secondary),
            (Err(why), _) | (_, Err(why)) => return Some(Err(why)),
        };
        let time = self.time;
        self.time = time.saturating_add(self.interval);
        let sample = |counts: &VectorCounts| sample(time, counts, self.steps);
        Some(Ok([
            sample(&primary),
            sample(&secondary),
            sample(&upside_down(&secondary)),
        ]))
    }
}

/// Readings of the second secondary for those of the first.
fn upside_down(counts: &VectorCounts) -> VectorCounts {
    let mut turned = *counts;
    for (count, (sign, off)) in turned.iter_mut().zip(UPSIDE_DOWN.iter().zip(OFF)) {
        *count = count.wrapping_mul(*sign).wrapping_add(off);
    }
    turned
}

/// A sample in SI units; `steps` are those of specific force, m/s^2, and of angular rate, rad/s.
#[allow(clippy::cast_precision_loss)]
pub fn sample(time: u64, counts: &VectorCounts, [force, rate]: [f32; 2]) -> Sample<f32> {
    const _: () = assert!(CHANNELS == 6);
    let [fx, fy, fz, wx, wy, wz] = counts.map(|count| count as f32);
    Sample {
        time,
        specific_force: Vector3::new(fx, fy, fz) * force,
        angular_rate: Vector3::new(wx, wy, wz) * rate,
    }
}
