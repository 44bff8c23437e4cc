//! Settings for C. Made by scripts/write_settings.py from crates/tumble-lab/src/setting_table.rs and the
//! defaults of the core; edit those instead.

use core::mem::MaybeUninit;

use tumble_core::spin::settings::SpinSettings as Core;

use crate::code::{code, truth, unless_zero};
use crate::grade::Grade;
use crate::pointer::{Place, answer};
use crate::status::{Status, StatusResult};
use crate::version;

/// Settings of a spin. Fill it with tumble_spin_defaults(), or with tumble_spin_defaults_for_grade() for
/// a unit of another grade than consumer, then change what is to be different.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinSettings {
    /// Bytes of this struct, by which the library finds settings that were not filled with defaults; not to be changed.
    pub size: u32,
    /// #TUMBLE_ABI; not to be changed.
    pub version: u32,
    /// Time to stand still. Default: 5 000 000 microseconds.
    pub still: u64,
    /// Longest wait until the robot has stood still. Longer than `still`. Default: 60 000 000 microseconds.
    pub still_timeout: u64,
    /// Longest wait for the turn. Default: 120 000 000 microseconds.
    pub spin_timeout: u64,
    /// Longest pause in the samples. Default: 250 000 microseconds.
    pub longest_gap: u64,
    /// Length of the blocks over which samples are averaged. Default: 200 000 microseconds.
    pub block: u64,
    /// Shortest stop after the first rest that is counted as a rest. Default: 1 000 000 microseconds.
    pub shortest_stop: u64,
    /// Local gravity. Default: 9.80665 m/s^2.
    pub gravity: f32,
    /// Angle to turn, both directions together. Default: 12.56637 rad.
    pub turn: f32,
    /// Speed to turn at, which a robot may be asked for; no limit depends on it. Default: 1 rad/s.
    pub rate: f32,
    /// Largest floor tilt. Default: 0.1745329 rad.
    pub largest_floor_tilt: f32,
    /// 1-sigma of the gyroscope's scale error about the turning axis, before anything is known of it.
    /// Default: 0.01.
    pub scale_sigma: f32,
    /// Bias instability of the accelerometer; that of a consumer grade where none is stated. Default:
    /// 0.0005314598 m/s^2.
    pub specific_force_instability: f32,
    /// Bias instability of the gyroscope; that of a consumer grade where none is stated. Default:
    /// 3.357221e-05 rad/s.
    pub angular_rate_instability: f32,
    /// End of the accelerometer's range. Default: 0 m/s^2, not known.
    pub specific_force_range: f32,
    /// End of the gyroscope's range. Default: 0 rad/s, not known.
    pub angular_rate_range: f32,
    /// Upward part of the Earth's rotation; 0 where the latitude is not known. Default: 0 rad/s.
    pub earth_rate_up: f32,
    /// Largest change of the force along the turning axis. Default: 0.5 m/s^2.
    pub largest_lift: f32,
    /// Largest rate across the turning axis. Default: 0.1 rad/s.
    pub largest_rate_across: f32,
    /// Largest rate across the turning axis as a share of the rate about it. Default: 0.05.
    pub largest_share_across: f32,
    /// Largest plausible bias of the gyroscope. A robot that seems to turn faster does not stand still.
    /// Default: 0.5 rad/s.
    pub largest_rate_bias: f32,
    /// Largest turn from one sample to the next. Default: 0.25 rad.
    pub largest_step: f32,
    /// Largest scatter of specific force at which a robot may stand still. Default: 2 m/s^2.
    pub largest_specific_force_scatter: f32,
    /// Largest scatter of angular rate at which a robot may stand still. Default: 0.2 rad/s.
    pub largest_angular_rate_scatter: f32,
    /// Largest ratio of the variance of a quiet block to the noise floor. Default: 4.
    pub variance_ratio: f32,
    /// Scatter of specific force below which a block is quiet whatever the floor. Default: 0.005 m/s^2.
    pub smallest_specific_force_scatter: f32,
    /// Scatter of angular rate below which a block is quiet whatever the floor. Default: 0.0003 rad/s.
    pub smallest_angular_rate_scatter: f32,
    /// Largest deviation of the specific force of a block from its rest besides noise. Default: 0.005 m/s^2.
    pub specific_force_drift: f32,
    /// Largest deviation of the angular rate of a block from its rest besides noise. Default: 0.0005 rad/s.
    pub angular_rate_drift: f32,
    /// Further deviation of the mean of a block, in sigmas. Default: 6.
    pub sigmas: f32,
    /// Take the floor for level, as the published estimator does. Default: false.
    pub level_floor: MaybeUninit<bool>,
}

/// Fills settings of `size` bytes and a version of the layout with their defaults for a unit of a grade; see
/// tumble_spin_defaults() and tumble_spin_defaults_for_grade().
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_CODE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_defaults_of(
    settings: *mut SpinSettings,
    size: usize,
    version: u32,
    grade: MaybeUninit<Grade>,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let place = unsafe { Place::at(settings) };
    let checked = version::check::<SpinSettings>(size, version);
    let grade = checked.and_then(|()| code(grade));
    answer(
        place,
        grade.map(|grade| SpinSettings::of(&Core::for_grade(grade.in_core()))),
    )
}

impl SpinSettings {
    pub(super) fn of(core: &Core<f32>) -> Self {
        Self {
            size: version::size::<Self>(),
            version: version::TUMBLE_ABI,
            still: core.still,
            still_timeout: core.still_timeout,
            spin_timeout: core.spin_timeout,
            longest_gap: core.longest_gap,
            block: core.block,
            shortest_stop: core.shortest_stop,
            gravity: core.gravity,
            turn: core.turn,
            rate: core.rate,
            largest_floor_tilt: core.largest_floor_tilt,
            scale_sigma: core.scale_sigma,
            specific_force_instability: core.specific_force_instability,
            angular_rate_instability: core.angular_rate_instability,
            specific_force_range: core.specific_force_range.unwrap_or_default(),
            angular_rate_range: core.angular_rate_range.unwrap_or_default(),
            earth_rate_up: core.earth_rate_up,
            largest_lift: core.largest_lift,
            largest_rate_across: core.largest_rate_across,
            largest_share_across: core.largest_share_across,
            largest_rate_bias: core.largest_rate_bias,
            largest_step: core.largest_step,
            largest_specific_force_scatter: core.largest_specific_force_scatter,
            largest_angular_rate_scatter: core.largest_angular_rate_scatter,
            variance_ratio: core.stillness.variance_ratio,
            smallest_specific_force_scatter: core.stillness.smallest_specific_force_scatter,
            smallest_angular_rate_scatter: core.stillness.smallest_angular_rate_scatter,
            specific_force_drift: core.stillness.specific_force_drift,
            angular_rate_drift: core.stillness.angular_rate_drift,
            sigmas: core.stillness.sigmas,
            level_floor: MaybeUninit::new(core.level_floor),
        }
    }

    /// Converts them to the core's type, if they are within their bounds.
    #[inline(never)]
    pub fn in_core(&self) -> StatusResult<Core<f32>> {
        version::check::<Self>(self.size as usize, self.version)?;
        self.check()?;
        self.put_into(Core::default())
    }

    fn put_into(&self, mut core: Core<f32>) -> StatusResult<Core<f32>> {
        core.still = self.still;
        core.still_timeout = self.still_timeout;
        core.spin_timeout = self.spin_timeout;
        core.longest_gap = self.longest_gap;
        core.block = self.block;
        core.shortest_stop = self.shortest_stop;
        core.gravity = self.gravity;
        core.turn = self.turn;
        core.rate = self.rate;
        core.largest_floor_tilt = self.largest_floor_tilt;
        core.scale_sigma = self.scale_sigma;
        core.specific_force_instability = self.specific_force_instability;
        core.angular_rate_instability = self.angular_rate_instability;
        core.specific_force_range = unless_zero(self.specific_force_range);
        core.angular_rate_range = unless_zero(self.angular_rate_range);
        core.earth_rate_up = self.earth_rate_up;
        core.largest_lift = self.largest_lift;
        core.largest_rate_across = self.largest_rate_across;
        core.largest_share_across = self.largest_share_across;
        core.largest_rate_bias = self.largest_rate_bias;
        core.largest_step = self.largest_step;
        core.largest_specific_force_scatter = self.largest_specific_force_scatter;
        core.largest_angular_rate_scatter = self.largest_angular_rate_scatter;
        core.stillness.variance_ratio = self.variance_ratio;
        core.stillness.smallest_specific_force_scatter = self.smallest_specific_force_scatter;
        core.stillness.smallest_angular_rate_scatter = self.smallest_angular_rate_scatter;
        core.stillness.specific_force_drift = self.specific_force_drift;
        core.stillness.angular_rate_drift = self.angular_rate_drift;
        core.stillness.sigmas = self.sigmas;
        core.level_floor = truth(self.level_floor);
        Ok(core)
    }

    fn check(&self) -> StatusResult {
        let positive = [
            self.gravity,
            self.turn,
            self.rate,
            self.largest_floor_tilt,
            self.scale_sigma,
            self.largest_lift,
            self.largest_rate_across,
            self.largest_share_across,
            self.largest_rate_bias,
            self.largest_step,
            self.largest_specific_force_scatter,
            self.largest_angular_rate_scatter,
            self.variance_ratio,
        ];
        let not_negative = [
            self.specific_force_instability,
            self.angular_rate_instability,
            self.specific_force_range,
            self.angular_rate_range,
            self.smallest_specific_force_scatter,
            self.smallest_angular_rate_scatter,
            self.specific_force_drift,
            self.angular_rate_drift,
            self.sigmas,
        ];
        let free = [self.earth_rate_up];
        let times = [
            self.still,
            self.still_timeout,
            self.spin_timeout,
            self.longest_gap,
            self.block,
        ];
        let mut numbers = positive.iter().chain(&not_negative).chain(&free);
        if !numbers.all(|number| number.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        let sound = positive.iter().all(|number| *number > 0.0)
            && not_negative.iter().all(|number| *number >= 0.0)
            && times.iter().all(|time| *time > 0)
            && self.still_timeout > self.still;
        if sound {
            Ok(())
        } else {
            Err(Status::TumbleErrorSetting)
        }
    }
}
