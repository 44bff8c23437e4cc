//! How a redundant set is to behave.

use core::mem::MaybeUninit;

use tumble_core::redundancy::settings::thresholds::Thresholds;
use tumble_core::redundancy::settings::{
    AdoptionSettings, CollectionSettings, EvaluationSettings, FitSettings, ForceAndRate, HealthSettings,
    RedundancySettings as Core, SelectionSettings,
};

use crate::code::{code, truth};
use crate::pointer::{Place, answer};
use crate::record::Rung;
use crate::redundancy::choice::{Data, Gate, Scope, Threshold};
use crate::status::{Status, StatusResult};

/// How a redundant set watches, calibrates and replaces its units. Fill it with tumble_redundancy_defaults(), then change
/// what is to be different; names are those of the settings file that `tumble redundancy` reads on a workstation.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RedundancySettings {
    /// Length of a window, over which samples are averaged, microseconds; 50 000. A whole part of a second.
    pub window: u64,
    /// Rest that is let pass before readings count, microseconds; 500 000.
    pub rest_settle: u64,
    /// Rest over which readings are averaged before units are evaluated, microseconds; 2 000 000.
    pub rest_duration: u64,
    /// Time after which a rest is evaluated again, microseconds; 600 000 000. 0: on command only.
    pub evaluate_every: u64,
    /// Longest wait for motion, microseconds; 300 000 000.
    pub motion_timeout: u64,
    /// Motion to be collected, microseconds; 30 000 000.
    pub collect: u64,
    /// Longest time for collecting, microseconds; 600 000 000.
    pub collect_timeout: u64,
    /// Time without a sample after which a unit is late, microseconds; 100 000.
    pub late: u64,
    /// Time in which all axes of a sensor repeat their readings until it is frozen, microseconds; 100 000.
    pub frozen: u64,
    /// Time that a sensor may spend at the end of its range, or without numbers, microseconds; 50 000.
    pub saturated: u64,
    /// Time out of family, or too noisy, after which a unit is unhealthy, microseconds; 500 000.
    pub family_time: u64,
    /// Time in which nothing may have been wrong until a unit is healthy again, microseconds; 500 000.
    pub recovery: u64,
    /// Time that a source has to be unhealthy before another takes over, microseconds; 20 000.
    pub hold: u64,
    /// Health to be proven by the primary before it takes over again, microseconds; 0: on command only, the default.
    pub return_after: u64,
    /// Scatter of specific force, and change of its mean, below which a unit is at rest, m/s^2; 0.1.
    pub first_threshold: f32,
    /// Scatter of angular rate, and change of its mean, below which a unit is at rest, rad/s; 0.02.
    pub second_threshold: f32,
    /// Deviation of a secondary's accelerometer above which it wants calibrating; fixed, 0.1 m/s^2.
    pub third_threshold: Threshold,
    /// Deviation of a secondary's gyroscope above which it wants calibrating; fixed, 0.01 rad/s.
    pub fourth_threshold: Threshold,
    /// Deviation of the primary's accelerometer above which it is invalid; fixed, 0.1 m/s^2.
    pub fifth_threshold: Threshold,
    /// Deviation of the primary's gyroscope above which it is invalid; fixed, 0.01 rad/s.
    pub sixth_threshold: Threshold,
    /// Local gravity, m/s^2; 9.80665.
    pub gravity: f32,
    /// Change of the primary's mean specific force since the rest that counts as motion, m/s^2; 0.5.
    pub motion_specific_force: f32,
    /// Change of the primary's mean angular rate since the rest that counts as motion, rad/s; 0.2.
    pub motion_angular_rate: f32,
    /// Standard deviation of specific force along a direction from which on the matrix is fitted along it, m/s^2; 0.5.
    pub excitation_specific_force: f32,
    /// Standard deviation of angular rate along a direction from which on the matrix is fitted along it, rad/s; 0.2.
    pub excitation_angular_rate: f32,
    /// Specific force for each metre of lever arm, root mean square, from which on that is fitted, m/s^2 per m; 2.
    pub excitation_lever_arm: f32,
    /// Share by which the residual on held-out pairs has to be smaller than the stored one's; 0.02.
    pub improvement: f32,
    /// Largest bias of an accelerometer, m/s^2; 3.
    pub largest_specific_force_bias: f32,
    /// Largest bias of a gyroscope, rad/s; 1.
    pub largest_angular_rate_bias: f32,
    /// Largest deviation of a scale factor from one; 0.1.
    pub largest_scale_error: f32,
    /// Largest misalignment beside the nominal mounting, rad; 0.1.
    pub largest_misalignment: f32,
    /// Longest lever arm, m; 1.
    pub largest_lever_arm: f32,
    /// Largest drift of an accelerometer while pairs were collected, m/s^2; 0.1.
    pub largest_specific_force_drift: f32,
    /// Largest drift of a gyroscope while pairs were collected, rad/s; 0.01.
    pub largest_angular_rate_drift: f32,
    /// Largest residual of an accelerometer on held-out pairs, root mean square, m/s^2; 0.5.
    pub largest_specific_force_residual: f32,
    /// Largest residual of a gyroscope on held-out pairs, root mean square, rad/s; 0.05.
    pub largest_angular_rate_residual: f32,
    /// Specific force that leaves by more, and is back with the next sample, is a spike, m/s^2; 40.
    pub spike_specific_force: f32,
    /// Angular rate that leaves by more, and is back with the next sample, is a spike, rad/s; 10.
    pub spike_angular_rate: f32,
    /// Distance from the median of the units beyond which specific force is out of family, m/s^2; 1.
    pub family_specific_force: f32,
    /// Distance from the median of the units beyond which angular rate is out of family, rad/s; 0.1.
    pub family_angular_rate: f32,
    /// Scatter of a unit, as a multiple of the median of all, beyond which it is noisy; 5.
    pub noise_ratio: f32,
    /// Deviation of specific force from gravity at rest that no error of a working unit explains, m/s^2; 1.5.
    pub rest_specific_force: f32,
    /// Angular rate at rest that no error of a working unit explains, rad/s; 0.2.
    pub rest_angular_rate: f32,
    /// Fewest pairs with which a fit is tried when time is up; 200.
    pub fewest_pairs: u32,
    /// Which data deviations are taken from; ::TUMBLE_DATA_COMPENSATED.
    pub data: MaybeUninit<Data>,
    /// Whose deviations count; ::TUMBLE_GATE_WHOLE_PRIMARY.
    pub gate: MaybeUninit<Gate>,
    /// What is calibrated; ::TUMBLE_SCOPE_ALL_SENSORS.
    pub scope: MaybeUninit<Scope>,
    /// Top of the ladder; ::TUMBLE_RUNG_AFFINE_AND_LEVER_ARM.
    pub highest_rung: MaybeUninit<Rung>,
    /// Whether the first rest is evaluated; true.
    pub evaluate_after_start: MaybeUninit<bool>,
    /// Whether a secondary is also compared with a valid primary, axis by axis; true.
    pub vector_check: MaybeUninit<bool>,
    /// Whether secondaries without a stored error are passed over; false.
    pub calibrated_only: MaybeUninit<bool>,
}

/// Fills settings with their defaults.
///
/// Errors: ::TUMBLE_ERROR_NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_defaults(settings: *mut RedundancySettings) -> Status {
    // SAFETY: as the header asks of all pointers.
    let place = unsafe { Place::at(settings) };
    answer(place, Ok(RedundancySettings::of(&Core::default())))
}

impl RedundancySettings {
    fn of(core: &Core<f32>) -> Self {
        let (evaluation, collection, fit) = (&core.evaluation, &core.collection, &core.fit);
        let (adoption, health, selection) = (&core.adoption, &core.health, &core.selection);
        let thresholds = &evaluation.thresholds;
        Self {
            window: core.window,
            rest_settle: evaluation.settle,
            rest_duration: evaluation.duration,
            evaluate_every: evaluation.every.unwrap_or(0),
            motion_timeout: collection.motion_timeout,
            collect: collection.collect,
            collect_timeout: collection.collect_timeout,
            late: health.late,
            frozen: health.frozen,
            saturated: health.saturated,
            family_time: health.family_time,
            recovery: health.recovery,
            hold: selection.hold,
            return_after: selection.return_after.unwrap_or(0),
            first_threshold: thresholds.first,
            second_threshold: thresholds.second,
            third_threshold: Threshold::of(thresholds.third),
            fourth_threshold: Threshold::of(thresholds.fourth),
            fifth_threshold: Threshold::of(thresholds.fifth),
            sixth_threshold: Threshold::of(thresholds.sixth),
            gravity: evaluation.gravity,
            motion_specific_force: collection.motion.specific_force,
            motion_angular_rate: collection.motion.angular_rate,
            excitation_specific_force: fit.excitation.specific_force,
            excitation_angular_rate: fit.excitation.angular_rate,
            excitation_lever_arm: fit.lever_arm_excitation,
            improvement: adoption.improvement,
            largest_specific_force_bias: adoption.bias.specific_force,
            largest_angular_rate_bias: adoption.bias.angular_rate,
            largest_scale_error: adoption.scale,
            largest_misalignment: adoption.misalignment,
            largest_lever_arm: adoption.lever_arm,
            largest_specific_force_drift: adoption.drift.specific_force,
            largest_angular_rate_drift: adoption.drift.angular_rate,
            largest_specific_force_residual: adoption.residual.specific_force,
            largest_angular_rate_residual: adoption.residual.angular_rate,
            spike_specific_force: health.spike.specific_force,
            spike_angular_rate: health.spike.angular_rate,
            family_specific_force: health.family.specific_force,
            family_angular_rate: health.family.angular_rate,
            noise_ratio: health.noise_ratio,
            rest_specific_force: health.rest.specific_force,
            rest_angular_rate: health.rest.angular_rate,
            fewest_pairs: collection.fewest_pairs,
            data: MaybeUninit::new(Data::of(evaluation.data)),
            gate: MaybeUninit::new(Gate::of(evaluation.gate)),
            scope: MaybeUninit::new(Scope::of(collection.scope)),
            highest_rung: MaybeUninit::new(Rung::of(fit.highest_rung)),
            evaluate_after_start: MaybeUninit::new(evaluation.after_start_up),
            vector_check: MaybeUninit::new(evaluation.vector_check),
            calibrated_only: MaybeUninit::new(selection.calibrated_only),
        }
    }

    /// As the core has them; whether they contradict each other the core finds out.
    pub fn in_core(&self) -> StatusResult<Core<f32>> {
        Ok(Core {
            window: self.window,
            evaluation: self.evaluation()?,
            collection: self.collection()?,
            fit: FitSettings {
                highest_rung: code(self.highest_rung)?.in_core(),
                excitation: both(self.excitation_specific_force, self.excitation_angular_rate),
                lever_arm_excitation: self.excitation_lever_arm,
            },
            adoption: self.adoption(),
            health: self.health(),
            selection: SelectionSettings {
                hold: self.hold,
                return_after: unless_zero(self.return_after),
                calibrated_only: truth(self.calibrated_only),
            },
        })
    }

    fn evaluation(&self) -> StatusResult<EvaluationSettings<f32>> {
        Ok(EvaluationSettings {
            thresholds: Thresholds {
                first: self.first_threshold,
                second: self.second_threshold,
                third: self.third_threshold.in_core()?,
                fourth: self.fourth_threshold.in_core()?,
                fifth: self.fifth_threshold.in_core()?,
                sixth: self.sixth_threshold.in_core()?,
            },
            gravity: self.gravity,
            settle: self.rest_settle,
            duration: self.rest_duration,
            after_start_up: truth(self.evaluate_after_start),
            every: unless_zero(self.evaluate_every),
            data: code(self.data)?.in_core(),
            vector_check: truth(self.vector_check),
            gate: code(self.gate)?.in_core(),
        })
    }

    fn collection(&self) -> StatusResult<CollectionSettings<f32>> {
        Ok(CollectionSettings {
            scope: code(self.scope)?.in_core(),
            motion: both(self.motion_specific_force, self.motion_angular_rate),
            motion_timeout: self.motion_timeout,
            collect: self.collect,
            collect_timeout: self.collect_timeout,
            fewest_pairs: self.fewest_pairs,
        })
    }

    fn adoption(&self) -> AdoptionSettings<f32> {
        AdoptionSettings {
            improvement: self.improvement,
            bias: both(self.largest_specific_force_bias, self.largest_angular_rate_bias),
            scale: self.largest_scale_error,
            misalignment: self.largest_misalignment,
            lever_arm: self.largest_lever_arm,
            drift: both(self.largest_specific_force_drift, self.largest_angular_rate_drift),
            residual: both(
                self.largest_specific_force_residual,
                self.largest_angular_rate_residual,
            ),
        }
    }

    fn health(&self) -> HealthSettings<f32> {
        HealthSettings {
            late: self.late,
            frozen: self.frozen,
            saturated: self.saturated,
            spike: both(self.spike_specific_force, self.spike_angular_rate),
            family: both(self.family_specific_force, self.family_angular_rate),
            family_time: self.family_time,
            noise_ratio: self.noise_ratio,
            rest: both(self.rest_specific_force, self.rest_angular_rate),
            recovery: self.recovery,
        }
    }
}

fn both(specific_force: f32, angular_rate: f32) -> ForceAndRate<f32> {
    ForceAndRate {
        specific_force,
        angular_rate,
    }
}

fn unless_zero(time: u64) -> Option<u64> {
    (time != 0).then_some(time)
}
