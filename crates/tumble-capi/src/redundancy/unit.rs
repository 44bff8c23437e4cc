//! The units of a set, as they are built in.

use core::mem::MaybeUninit;

use tumble_core::redundancy::platform::{MountedUnit as Core, Range};
use tumble_core::redundancy::sensor::Axes;

use crate::code::{truth, unless_zero};
use crate::model::{matrix, rows, vector};
use crate::pointer::{Place, answer};
use crate::redundancy::choice::Threshold;
use crate::status::{Status, StatusResult};
use crate::version;

/// All six axes of a unit: bits 0 to 2 accelerometer, 3 to 5 gyroscope, x y z each.
pub const TUMBLE_AXES_ALL: u8 = 0x3F;

/// A unit as it is built in. Fill it with tumble_unit_defaults(), then change what is to be different.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Unit {
    /// Bytes of this struct, by which the library finds units that were not filled with defaults; not to be changed.
    pub size: u32,
    /// #TUMBLE_ABI; not to be changed.
    pub version: u32,
    /// Serial number, or another number that distinguishes it from other units for life: records carry it.
    pub identity: u64,
    /// Added to the time of its samples, which makes it that of the common clock, microseconds; 0.
    pub time_offset: i64,
    /// Nominal rotation from the primary's case frame to its axes, row by row; identity.
    pub sensor_from_primary: [[f32; 3]; 3],
    /// From the primary to it, m, primary's case frame; where `lever_arm_known`.
    pub lever_arm: [f32; 3],
    /// End of the accelerometer's range, m/s^2; 0 where nobody knows, the default.
    pub specific_force_range: f32,
    /// End of the gyroscope's range, rad/s; 0 where nobody knows, the default.
    pub angular_rate_range: f32,
    /// Its own threshold of the accelerometer's deviation, m/s^2; ::TUMBLE_THRESHOLD_KIND_OF_SETTINGS, the default.
    pub accelerometer_threshold: Threshold,
    /// Its own threshold of the gyroscope's deviation, rad/s; ::TUMBLE_THRESHOLD_KIND_OF_SETTINGS, the default.
    pub gyroscope_threshold: Threshold,
    /// True if the lever arm is given; else it is estimated, the default.
    pub lever_arm_known: MaybeUninit<bool>,
    /// Which axes it has, a bit each; #TUMBLE_AXES_ALL. Readings of other axes in a sample are ignored.
    pub axes: u8,
}

/// Fills in a unit of `size` bytes and a version of the layout; see tumble_unit_defaults().
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_unit_defaults_of(
    unit: *mut Unit,
    size: usize,
    version: u32,
    identity: u64,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let place = unsafe { Place::at(unit) };
    let checked = version::check::<Unit>(size, version);
    answer(place, checked.map(|()| Unit::of(&Core::new(identity))))
}

impl Unit {
    fn of(core: &Core<f32>) -> Self {
        let Axes(has) = core.axes;
        let own = |threshold: Option<_>| threshold.map_or_else(Threshold::of_settings, Threshold::of);
        let [force, rate] = core.thresholds.map(own);
        let bits = (0..).zip(has).map(|(bit, has)| u8::from(has) << bit);
        Self {
            size: version::size::<Self>(),
            version: version::TUMBLE_ABI,
            identity: core.identity,
            time_offset: core.time_offset,
            sensor_from_primary: rows(&core.sensor_from_primary),
            lever_arm: core.lever_arm.unwrap_or_default().into(),
            specific_force_range: core.range.specific_force.unwrap_or(0.0),
            angular_rate_range: core.range.angular_rate.unwrap_or(0.0),
            accelerometer_threshold: force,
            gyroscope_threshold: rate,
            lever_arm_known: MaybeUninit::new(core.lever_arm.is_some()),
            axes: bits.fold(0, |all, bit| all | bit),
        }
    }

    /// Converts it to the core's type; the core checks the mounting.
    #[inline(never)]
    pub fn in_core(&self) -> StatusResult<Core<f32>> {
        version::check::<Self>(self.size as usize, self.version)?;
        let ranges = [self.specific_force_range, self.angular_rate_range];
        let mounting = self.sensor_from_primary.as_flattened();
        let mut numbers = mounting.iter().chain(&ranges).chain(&self.lever_arm);
        if !numbers.all(|x| x.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        if self.axes > TUMBLE_AXES_ALL || ranges.iter().any(|range| *range < 0.0) {
            return Err(Status::TumbleErrorSetting);
        }
        Ok(Core {
            identity: self.identity,
            axes: Axes([0, 1, 2, 3, 4, 5].map(|bit| self.axes >> bit & 1 == 1)),
            range: Range {
                specific_force: unless_zero(self.specific_force_range),
                angular_rate: unless_zero(self.angular_rate_range),
            },
            time_offset: self.time_offset,
            sensor_from_primary: matrix(&self.sensor_from_primary),
            lever_arm: truth(self.lever_arm_known).then(|| vector(&self.lever_arm)),
            thresholds: [
                self.accelerometer_threshold.of_unit()?,
                self.gyroscope_threshold.of_unit()?,
            ],
        })
    }
}
