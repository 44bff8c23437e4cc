//! Settings for C. Made by scripts/write_settings.py from crates/tumble-lab/src/setting_table.rs and the
//! defaults of the core; edit those instead.

use core::mem::MaybeUninit;

use tumble_core::redundancy::settings::RedundancySettings as Core;

use crate::code::{code, truth, unless_zero};
use crate::pointer::{Place, answer};
use crate::record::FitModel;
use crate::redundancy::choice::{Adoption, Data, Gate, Scope, Threshold};
use crate::status::{Status, StatusResult};
use crate::version;

/// Settings of the monitor of a redundant set. Fill it with tumble_redundancy_defaults(), then change
/// what is to be different; names are those of the settings file that `tumble redundancy` reads on a
/// workstation.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RedundancySettings {
    /// Bytes of this struct, by which the library finds settings that were not filled with defaults; not to be changed.
    pub size: u32,
    /// #TUMBLE_ABI; not to be changed.
    pub version: u32,
    /// Length of the windows over which all units are averaged, whatever their rates; a whole part of 1 s.
    /// Default: 50 000 microseconds.
    pub window: u64,
    /// Rest that is let pass before readings count. Default: 500 000 microseconds.
    pub rest_settle: u64,
    /// Rest over which readings are averaged before units are evaluated. Longer than `window`. Default:
    /// 2 000 000 microseconds.
    pub rest_duration: u64,
    /// Calibrate what deviates at a rest once so much time has passed. Longer than `rest_duration`. Default:
    /// 600 000 000 microseconds; 0: on command only.
    pub evaluate_every: u64,
    /// Longest wait for motion; then the calibration is abandoned. Longer than `window`. Default: 300 000 000
    /// microseconds.
    pub motion_timeout: u64,
    /// Motion to be collected. Longer than `window`. Default: 30 000 000 microseconds.
    pub collect: u64,
    /// Longest time for collecting; then what there is has to do, or the calibration is abandoned. Longer
    /// than `collect`. Default: 300 000 000 microseconds.
    pub collect_timeout: u64,
    /// Time without a sample after which a unit is late. Default: 100 000 microseconds.
    pub late: u64,
    /// Time in which all axes of a sensor repeat their readings, and 16 readings at least, until it is
    /// frozen; three times that for a sensor of one axis. Default: 100 000 microseconds.
    pub frozen: u64,
    /// Time at the end of its range, or without finite numbers, that a sensor may spend; forgiven slowly.
    /// Default: 50 000 microseconds.
    pub saturated: u64,
    /// Time in which nothing may have been wrong until a unit is healthy again. Default: 500 000
    /// microseconds.
    pub recovery: u64,
    /// Time a source has to be unhealthy before another takes over. Default: 20 000 microseconds.
    pub hold: u64,
    /// Health to be proven by the primary before it takes over again. Longer than `hold`. Default: 0
    /// microseconds, on command only.
    pub return_after: u64,
    /// Scatter of specific force, and change of its mean, below which a unit is at rest. Default: 0.1 m/s^2.
    pub rest_specific_force_scatter: f32,
    /// Scatter of angular rate, and change of its mean, below which a unit is at rest. Default: 0.02 rad/s.
    pub rest_angular_rate_scatter: f32,
    /// Deviation at rest of a primary without a calibration of its own up to which secondaries are calibrated
    /// relative to it, where they deviate as well. Default: 0.8 m/s^2.
    pub uncalibrated_specific_force: f32,
    /// Deviation at rest of a primary without a calibration of its own up to which secondaries are calibrated
    /// relative to it, where they deviate as well. Default: 0.1 rad/s.
    pub uncalibrated_angular_rate: f32,
    /// Deviation of a secondary's accelerometer above which its calibration is triggered. Default: fixed, 0.1
    /// m/s^2.
    pub secondary_accelerometer_threshold: Threshold,
    /// Deviation of a secondary's gyroscope above which its calibration is triggered. Default: fixed, 0.01
    /// rad/s.
    pub secondary_gyroscope_threshold: Threshold,
    /// Deviation of the primary's accelerometer above which it is invalid. Default: fixed, 0.1 m/s^2.
    pub primary_accelerometer_threshold: Threshold,
    /// Deviation of the primary's gyroscope above which it is invalid. Default: fixed, 0.01 rad/s.
    pub primary_gyroscope_threshold: Threshold,
    /// Local gravity. Default: 9.80665 m/s^2.
    pub gravity: f32,
    /// Change of the primary's mean specific force since the rest that counts as motion. Larger than
    /// `rest_specific_force_scatter`. Default: 0.5 m/s^2.
    pub motion_specific_force: f32,
    /// Change of the primary's mean angular rate since the rest that counts as motion. Larger than
    /// `rest_angular_rate_scatter`. Default: 0.2 rad/s.
    pub motion_angular_rate: f32,
    /// Standard deviation of specific force along a direction from which on the matrix is fitted along it.
    /// Default: 0.5 m/s^2.
    pub excitation_specific_force: f32,
    /// Standard deviation of angular rate along a direction from which on the matrix is fitted along it.
    /// Default: 0.2 rad/s.
    pub excitation_angular_rate: f32,
    /// Specific force for each metre of lever arm, root mean square, from which on the lever arm is fitted.
    /// Default: 2 1/s^2.
    pub excitation_lever_arm: f32,
    /// Share by which its residual on held-out pairs has to be smaller than the stored one's. Default: 0.02.
    pub improvement: f32,
    /// Largest bias of an accelerometer. Larger than `tolerated_specific_force`. Default: 3 m/s^2.
    pub largest_specific_force_bias: f32,
    /// Largest bias of a gyroscope. Larger than `tolerated_angular_rate`. Default: 1 rad/s.
    pub largest_angular_rate_bias: f32,
    /// Largest deviation of a scale factor from one. Default: 0.1.
    pub largest_scale_error: f32,
    /// Largest misalignment beside the nominal mounting. Default: 0.1 rad.
    pub largest_misalignment: f32,
    /// Longest lever arm. Default: 1 m.
    pub largest_lever_arm: f32,
    /// Largest drift of an accelerometer while pairs were collected. Default: 0.1 m/s^2.
    pub largest_specific_force_drift: f32,
    /// Largest drift of a gyroscope while pairs were collected. Default: 0.01 rad/s.
    pub largest_angular_rate_drift: f32,
    /// Largest residual of an accelerometer on held-out pairs, root mean square. Default: 0.5 m/s^2.
    pub largest_specific_force_residual: f32,
    /// Largest residual of a gyroscope on held-out pairs, root mean square. Default: 0.05 rad/s.
    pub largest_angular_rate_residual: f32,
    /// Largest shift by which calibrations of an accelerometer may follow the primary where no rest proves it
    /// right. Default: 0.15 m/s^2.
    pub largest_followed_specific_force: f32,
    /// Largest shift by which calibrations of a gyroscope may follow the primary where no rest proves it
    /// right. Default: 0.015 rad/s.
    pub largest_followed_angular_rate: f32,
    /// Specific force that leaves by more, and is back with the next sample, is a spike. Default: 40 m/s^2.
    pub spike_specific_force: f32,
    /// Angular rate that leaves by more, and is back with the next sample, is a spike. Default: 10 rad/s.
    pub spike_angular_rate: f32,
    /// Drift of specific force that is within specification: a difference of two units that is none. Default:
    /// 0.05 m/s^2.
    pub tolerated_specific_force: f32,
    /// Drift of angular rate that is within specification: a difference of two units that is none. Default:
    /// 0.0075 rad/s.
    pub tolerated_angular_rate: f32,
    /// Drift of specific force of an axis with temperature, of units whose logs or samples state one.
    /// Default: 0.00196 m/s^2/K.
    pub drift_per_kelvin_specific_force: f32,
    /// Drift of angular rate of an axis with temperature, of units whose logs or samples state one. Default:
    /// 0.00026 rad/s/K.
    pub drift_per_kelvin_angular_rate: f32,
    /// Scatter of a unit, as a multiple of that expected from the others, beyond which it is noisy. Default:
    /// 9.
    pub noise_ratio: f32,
    /// Deviation of specific force from gravity at rest that no error of a working unit explains. Default:
    /// 1.5 m/s^2.
    pub rest_specific_force: f32,
    /// Angular rate at rest that no error of a working unit explains. Default: 0.2 rad/s.
    pub rest_angular_rate: f32,
    /// Fewest pairs with which a fit is tried when time is up. Default: 200.
    pub fewest_pairs: u32,
    /// Take deviations from compensated data or from raw data, with thresholds to match. Default:
    /// ::TUMBLE_DATA_COMPENSATED.
    pub data: MaybeUninit<Data>,
    /// Trigger on the secondary alone, with both sensors of the primary valid, or each with its own kind.
    /// Default: ::TUMBLE_GATE_WHOLE_PRIMARY.
    pub gate: MaybeUninit<Gate>,
    /// Calibrate both sensors of a secondary, or only the one that deviates. Default:
    /// ::TUMBLE_SCOPE_ALL_SENSORS.
    pub scope: MaybeUninit<Scope>,
    /// Largest model that may be fitted: the largest up to it that the motion shows is used. Default:
    /// ::TUMBLE_FIT_MODEL_AFFINE_AND_LEVER_ARM.
    pub largest_fit_model: MaybeUninit<FitModel>,
    /// Replace what is stored where the fit is plausible and better, or by each calibration. Default:
    /// ::TUMBLE_ADOPTION_IF_BETTER.
    pub adoption: MaybeUninit<Adoption>,
    /// Evaluate the first rest after the start. Default: true.
    pub evaluate_after_start: MaybeUninit<bool>,
    /// Compare a secondary also with a valid primary, axis by axis: the norm is blind across gravity.
    /// Default: true.
    pub vector_check: MaybeUninit<bool>,
    /// Fit to means at rests at which the primary is valid as well as to pairs in motion. Default: true.
    pub fit_rests: MaybeUninit<bool>,
    /// Select only secondaries that have a stored error. Default: false.
    pub calibrated_only: MaybeUninit<bool>,
}

/// Fills settings of `size` bytes and a version of the layout with their defaults; see tumble_redundancy_defaults().
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_defaults_of(
    settings: *mut RedundancySettings,
    size: usize,
    version: u32,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let place = unsafe { Place::at(settings) };
    let checked = version::check::<RedundancySettings>(size, version);
    answer(place, checked.map(|()| RedundancySettings::of(&Core::default())))
}

impl RedundancySettings {
    pub(super) fn of(core: &Core<f32>) -> Self {
        Self {
            size: version::size::<Self>(),
            version: version::TUMBLE_ABI,
            window: core.window,
            rest_settle: core.evaluation.rest_settle,
            rest_duration: core.evaluation.rest_duration,
            evaluate_every: core.evaluation.evaluate_every.unwrap_or_default(),
            motion_timeout: core.collection.motion_timeout,
            collect: core.collection.collect,
            collect_timeout: core.collection.collect_timeout,
            late: core.health.late,
            frozen: core.health.frozen,
            saturated: core.health.saturated,
            recovery: core.health.recovery,
            hold: core.selection.hold,
            return_after: core.selection.return_after.unwrap_or_default(),
            rest_specific_force_scatter: core.evaluation.thresholds.rest_scatter.specific_force,
            rest_angular_rate_scatter: core.evaluation.thresholds.rest_scatter.angular_rate,
            uncalibrated_specific_force: core.evaluation.uncalibrated.specific_force,
            uncalibrated_angular_rate: core.evaluation.uncalibrated.angular_rate,
            secondary_accelerometer_threshold: Threshold::of(
                core.evaluation.thresholds.secondary.accelerometer,
            ),
            secondary_gyroscope_threshold: Threshold::of(core.evaluation.thresholds.secondary.gyroscope),
            primary_accelerometer_threshold: Threshold::of(core.evaluation.thresholds.primary.accelerometer),
            primary_gyroscope_threshold: Threshold::of(core.evaluation.thresholds.primary.gyroscope),
            gravity: core.evaluation.gravity,
            motion_specific_force: core.collection.motion.specific_force,
            motion_angular_rate: core.collection.motion.angular_rate,
            excitation_specific_force: core.fit.excitation.specific_force,
            excitation_angular_rate: core.fit.excitation.angular_rate,
            excitation_lever_arm: core.fit.excitation_lever_arm,
            improvement: core.adoption.improvement,
            largest_specific_force_bias: core.adoption.bias.specific_force,
            largest_angular_rate_bias: core.adoption.bias.angular_rate,
            largest_scale_error: core.adoption.largest_scale_error,
            largest_misalignment: core.adoption.largest_misalignment,
            largest_lever_arm: core.adoption.largest_lever_arm,
            largest_specific_force_drift: core.adoption.drift.specific_force,
            largest_angular_rate_drift: core.adoption.drift.angular_rate,
            largest_specific_force_residual: core.adoption.residual.specific_force,
            largest_angular_rate_residual: core.adoption.residual.angular_rate,
            largest_followed_specific_force: core.adoption.followed.specific_force,
            largest_followed_angular_rate: core.adoption.followed.angular_rate,
            spike_specific_force: core.health.spike.specific_force,
            spike_angular_rate: core.health.spike.angular_rate,
            tolerated_specific_force: core.health.tolerated.specific_force,
            tolerated_angular_rate: core.health.tolerated.angular_rate,
            drift_per_kelvin_specific_force: core.health.per_kelvin.specific_force,
            drift_per_kelvin_angular_rate: core.health.per_kelvin.angular_rate,
            noise_ratio: core.health.noise_ratio,
            rest_specific_force: core.health.rest.specific_force,
            rest_angular_rate: core.health.rest.angular_rate,
            fewest_pairs: core.collection.fewest_pairs,
            data: MaybeUninit::new(Data::of(core.evaluation.data)),
            gate: MaybeUninit::new(Gate::of(core.evaluation.gate)),
            scope: MaybeUninit::new(Scope::of(core.collection.scope)),
            largest_fit_model: MaybeUninit::new(FitModel::of(core.fit.largest_fit_model)),
            adoption: MaybeUninit::new(Adoption::of(core.adoption.adoption)),
            evaluate_after_start: MaybeUninit::new(core.evaluation.evaluate_after_start),
            vector_check: MaybeUninit::new(core.evaluation.vector_check),
            fit_rests: MaybeUninit::new(core.fit.fit_rests),
            calibrated_only: MaybeUninit::new(core.selection.calibrated_only),
        }
    }

    /// Converts them to the core's type; the core checks them for contradictions.
    #[inline(never)]
    pub fn in_core(&self) -> StatusResult<Core<f32>> {
        version::check::<Self>(self.size as usize, self.version)?;

        self.put_into(Core::default())
    }

    fn put_into(&self, mut core: Core<f32>) -> StatusResult<Core<f32>> {
        core.window = self.window;
        core.evaluation.rest_settle = self.rest_settle;
        core.evaluation.rest_duration = self.rest_duration;
        core.evaluation.evaluate_every = unless_zero(self.evaluate_every);
        core.collection.motion_timeout = self.motion_timeout;
        core.collection.collect = self.collect;
        core.collection.collect_timeout = self.collect_timeout;
        core.health.late = self.late;
        core.health.frozen = self.frozen;
        core.health.saturated = self.saturated;
        core.health.recovery = self.recovery;
        core.selection.hold = self.hold;
        core.selection.return_after = unless_zero(self.return_after);
        core.evaluation.thresholds.rest_scatter.specific_force = self.rest_specific_force_scatter;
        core.evaluation.thresholds.rest_scatter.angular_rate = self.rest_angular_rate_scatter;
        core.evaluation.uncalibrated.specific_force = self.uncalibrated_specific_force;
        core.evaluation.uncalibrated.angular_rate = self.uncalibrated_angular_rate;
        core.evaluation.thresholds.secondary.accelerometer =
            self.secondary_accelerometer_threshold.in_core()?;
        core.evaluation.thresholds.secondary.gyroscope = self.secondary_gyroscope_threshold.in_core()?;
        core.evaluation.thresholds.primary.accelerometer = self.primary_accelerometer_threshold.in_core()?;
        core.evaluation.thresholds.primary.gyroscope = self.primary_gyroscope_threshold.in_core()?;
        core.evaluation.gravity = self.gravity;
        core.collection.motion.specific_force = self.motion_specific_force;
        core.collection.motion.angular_rate = self.motion_angular_rate;
        core.fit.excitation.specific_force = self.excitation_specific_force;
        core.fit.excitation.angular_rate = self.excitation_angular_rate;
        core.fit.excitation_lever_arm = self.excitation_lever_arm;
        core.adoption.improvement = self.improvement;
        core.adoption.bias.specific_force = self.largest_specific_force_bias;
        core.adoption.bias.angular_rate = self.largest_angular_rate_bias;
        core.adoption.largest_scale_error = self.largest_scale_error;
        core.adoption.largest_misalignment = self.largest_misalignment;
        core.adoption.largest_lever_arm = self.largest_lever_arm;
        core.adoption.drift.specific_force = self.largest_specific_force_drift;
        core.adoption.drift.angular_rate = self.largest_angular_rate_drift;
        core.adoption.residual.specific_force = self.largest_specific_force_residual;
        core.adoption.residual.angular_rate = self.largest_angular_rate_residual;
        core.adoption.followed.specific_force = self.largest_followed_specific_force;
        core.adoption.followed.angular_rate = self.largest_followed_angular_rate;
        core.health.spike.specific_force = self.spike_specific_force;
        core.health.spike.angular_rate = self.spike_angular_rate;
        core.health.tolerated.specific_force = self.tolerated_specific_force;
        core.health.tolerated.angular_rate = self.tolerated_angular_rate;
        core.health.per_kelvin.specific_force = self.drift_per_kelvin_specific_force;
        core.health.per_kelvin.angular_rate = self.drift_per_kelvin_angular_rate;
        core.health.noise_ratio = self.noise_ratio;
        core.health.rest.specific_force = self.rest_specific_force;
        core.health.rest.angular_rate = self.rest_angular_rate;
        core.collection.fewest_pairs = self.fewest_pairs;
        core.evaluation.data = code(self.data)?.in_core();
        core.evaluation.gate = code(self.gate)?.in_core();
        core.collection.scope = code(self.scope)?.in_core();
        core.fit.largest_fit_model = code(self.largest_fit_model)?.in_core();
        core.adoption.adoption = code(self.adoption)?.in_core();
        core.evaluation.evaluate_after_start = truth(self.evaluate_after_start);
        core.evaluation.vector_check = truth(self.vector_check);
        core.fit.fit_rests = truth(self.fit_rests);
        core.selection.calibrated_only = truth(self.calibrated_only);
        Ok(core)
    }
}
