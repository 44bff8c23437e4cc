//! How a robot is to spin, and how that is judged.

use core::mem::MaybeUninit;

use tumble_core::spin::settings::SpinSettings as Core;
use tumble_core::stillness::StillnessSettings;

use crate::code::truth;
use crate::pointer::{Place, answer};
use crate::status::{Status, StatusResult};

/// How to spin, and how to judge it. Fill it with tumble_spin_defaults(), then change what is to be different.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinSettings {
    /// How long to stand still, microseconds; 5 000 000.
    pub still: u64,
    /// How long to wait until the robot has stood still, microseconds; 60 000 000. Longer than `still`.
    pub still_timeout: u64,
    /// How long to wait for the turn to be made, microseconds; 120 000 000.
    pub spin_timeout: u64,
    /// Longest pause in the samples, microseconds; 250 000.
    pub longest_gap: u64,
    /// Length of the blocks over which samples are averaged, microseconds; 200 000.
    pub block: u64,
    /// Shortest stop after the first rest that is counted as a rest, microseconds; 1 000 000.
    pub shortest_stop: u64,
    /// Gravity, m/s^2; 9.80665.
    pub gravity: f32,
    /// How far to turn, both directions together, rad; 4 pi.
    pub turn: f32,
    /// Speed to turn at, rad/s; 1. It is not judged: it is what a robot may be told.
    pub rate: f32,
    /// Largest floor tilt, rad; 10 degrees.
    pub largest_floor_tilt: f32,
    /// 1-sigma of the gyroscope's scale error about the turning axis, before anything is known of it, no unit; 0.01.
    pub scale_sigma: f32,
    /// Bias instability of the accelerometer, m/s^2; 0 where it is not known or does not matter.
    pub specific_force_instability: f32,
    /// Bias instability of the gyroscope, rad/s; 0 where it is not known or does not matter.
    pub angular_rate_instability: f32,
    /// End of the accelerometer's range, m/s^2; 0 where nobody knows.
    pub specific_force_range: f32,
    /// End of the gyroscope's range, rad/s; 0 where nobody knows.
    pub angular_rate_range: f32,
    /// Upward part of the Earth's rotation, rad/s; 0 where the latitude is not known.
    pub earth_rate_up: f32,
    /// Largest change of the force along the turning axis, m/s^2; 0.5.
    pub largest_lift: f32,
    /// Largest rate across the turning axis, rad/s; 0.1.
    pub largest_rate_across: f32,
    /// Largest rate across the turning axis as a share of the rate about it; 0.05.
    pub largest_share_across: f32,
    /// Largest plausible bias of the gyroscope, rad/s; 0.5. A robot that seems to turn faster does not stand still.
    pub largest_rate_bias: f32,
    /// Largest turn from one sample to the next, rad; 0.25.
    pub largest_step: f32,
    /// Largest scatter of specific force at which a robot may stand still, m/s^2; 2.
    pub largest_specific_force_scatter: f32,
    /// Largest scatter of angular rate at which a robot may stand still, rad/s; 0.2.
    pub largest_angular_rate_scatter: f32,
    /// How much larger than the noise floor the variance of a quiet block may be, ratio; 4.
    pub variance_ratio: f32,
    /// Scatter of specific force below which a block is quiet whatever the floor, m/s^2; 0.005.
    pub smallest_specific_force_scatter: f32,
    /// Scatter of angular rate below which a block is quiet whatever the floor, rad/s; 0.0003.
    pub smallest_angular_rate_scatter: f32,
    /// How far the specific force of a block may stray from its rest besides noise, m/s^2; 0.005.
    pub specific_force_drift: f32,
    /// How far the angular rate of a block may stray from its rest besides noise, rad/s; 0.0005.
    pub angular_rate_drift: f32,
    /// How many sigma of the mean a block may stray besides; 6.
    pub sigmas: f32,
    /// Take the floor for level, as the published estimator does; false.
    pub level_floor: MaybeUninit<bool>,
}

/// Fills settings with their defaults.
///
/// Errors: ::TUMBLE_ERROR_NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_defaults(settings: *mut SpinSettings) -> Status {
    // SAFETY: as the header asks of all pointers.
    let place = unsafe { Place::at(settings) };
    answer(place, Ok(SpinSettings::of(&Core::default())))
}

impl SpinSettings {
    fn of(core: &Core<f32>) -> Self {
        let (stillness, scatter) = (&core.stillness, core.largest_scatter);
        Self {
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
            specific_force_instability: core.bias_instability.0,
            angular_rate_instability: core.bias_instability.1,
            specific_force_range: core.specific_force_range.unwrap_or(0.0),
            angular_rate_range: core.angular_rate_range.unwrap_or(0.0),
            earth_rate_up: core.earth_rate_up,
            largest_lift: core.largest_lift,
            largest_rate_across: core.largest_rate_across,
            largest_share_across: core.largest_share_across,
            largest_rate_bias: core.largest_rate_bias,
            largest_step: core.largest_step,
            largest_specific_force_scatter: scatter.0,
            largest_angular_rate_scatter: scatter.1,
            variance_ratio: stillness.variance_ratio,
            smallest_specific_force_scatter: stillness.smallest_specific_force_scatter,
            smallest_angular_rate_scatter: stillness.smallest_angular_rate_scatter,
            specific_force_drift: stillness.specific_force_drift,
            angular_rate_drift: stillness.angular_rate_drift,
            sigmas: stillness.sigmas,
            level_floor: MaybeUninit::new(core.level_floor),
        }
    }

    /// As the core has them, if they can be meant.
    pub fn in_core(&self) -> StatusResult<Core<f32>> {
        self.check()?;
        Ok(Core {
            gravity: self.gravity,
            still: self.still,
            turn: self.turn,
            rate: self.rate,
            level_floor: truth(self.level_floor),
            largest_floor_tilt: self.largest_floor_tilt,
            scale_sigma: self.scale_sigma,
            bias_instability: (self.specific_force_instability, self.angular_rate_instability),
            specific_force_range: known(self.specific_force_range),
            angular_rate_range: known(self.angular_rate_range),
            still_timeout: self.still_timeout,
            spin_timeout: self.spin_timeout,
            longest_gap: self.longest_gap,
            block: self.block,
            shortest_stop: self.shortest_stop,
            earth_rate_up: self.earth_rate_up,
            largest_lift: self.largest_lift,
            largest_rate_across: self.largest_rate_across,
            largest_share_across: self.largest_share_across,
            largest_rate_bias: self.largest_rate_bias,
            largest_step: self.largest_step,
            largest_scatter: (
                self.largest_specific_force_scatter,
                self.largest_angular_rate_scatter,
            ),
            stillness: StillnessSettings {
                variance_ratio: self.variance_ratio,
                smallest_specific_force_scatter: self.smallest_specific_force_scatter,
                smallest_angular_rate_scatter: self.smallest_angular_rate_scatter,
                specific_force_drift: self.specific_force_drift,
                angular_rate_drift: self.angular_rate_drift,
                sigmas: self.sigmas,
            },
        })
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
        let times = [
            self.still,
            self.still_timeout,
            self.spin_timeout,
            self.longest_gap,
            self.block,
        ];
        let mut numbers = positive.iter().chain(&not_negative).chain([&self.earth_rate_up]);
        if !numbers.all(|x| x.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        let sound = positive.iter().all(|x| *x > 0.0)
            && not_negative.iter().all(|x| *x >= 0.0)
            && times.iter().all(|time| *time > 0)
            && self.still < self.still_timeout;
        if sound {
            Ok(())
        } else {
            Err(Status::TumbleErrorSetting)
        }
    }
}

/// A figure of which zero says that nobody knows it.
pub fn known(figure: f32) -> Option<f32> {
    (figure != 0.0).then_some(figure)
}
