//! Estimates of a spin.

use core::mem::MaybeUninit;

use tumble_core::redundancy::record::Record as CoreRecord;
use tumble_core::redundancy::sensor::Sensor as CoreSensor;
use tumble_core::spin::estimate::{ScalarEstimate, SpinEstimate as Core, TrueAngle, VectorEstimate};
use tumble_core::spin::machine::SpinMachine;

use crate::code::{code, truth, unless_zero};
use crate::model::vector;
use crate::pointer::{Place, change, look};
use crate::record::{Record, Sensor};
use crate::spin::{Spin, SpinFailure};
use crate::status::{Status, StatusResult, status};

/// A number with its 1-sigma.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinValue {
    /// The number.
    pub value: f32,
    /// 1-sigma of it.
    pub sigma: f32,
    /// True if the spin shows it; if not, the numbers mean nothing.
    pub observed: MaybeUninit<bool>,
}

/// Three numbers with their 1-sigma.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinVector {
    /// The numbers, x y z.
    pub value: [f32; 3],
    /// 1-sigma of each.
    pub sigma: [f32; 3],
    /// True if the spin shows them; if not, the numbers mean nothing.
    pub observed: MaybeUninit<bool>,
}

/// Angles truly turned, from dock to dock or from wheel odometry.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinTrueAngle {
    /// Clockwise, rad, positive; 0 where it is not known.
    pub clockwise: f32,
    /// Counter-clockwise, rad, positive; 0 where it is not known.
    pub counter_clockwise: f32,
    /// 1-sigma of each, rad.
    pub sigma: f32,
}

/// Everything a spin shows. Vectors are in the case frame.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinEstimate {
    /// Accelerometer bias by the method of choice, m/s^2.
    pub accelerometer_bias: SpinVector,
    /// Gyroscope bias, rad/s.
    pub gyroscope_bias: SpinVector,
    /// Covariance of both, accelerometer first: (m/s^2)^2, (rad/s)^2, and their product.
    pub covariance: [[f32; 6]; 6],
    /// Accelerometer bias whatever the floor, m/s^2.
    pub level_free: SpinVector,
    /// Accelerometer bias if the floor is level, m/s^2.
    pub published: SpinVector,
    /// True if the level-free bias is the one to use.
    pub level_free_is_default: MaybeUninit<bool>,
    /// Turning axis, upwards, unit length.
    pub up: [f32; 3],
    /// Roll of the IMU against the floor, rad, positive with the left side up.
    pub roll: SpinValue,
    /// Pitch of the IMU against the floor, rad, positive with the front down.
    pub pitch: SpinValue,
    /// Tilt of the floor, rad.
    pub floor_tilt: SpinValue,
    /// Uphill, rad counter-clockwise from forward, at the heading of the first rest.
    pub uphill_bearing: SpinValue,
    /// From the turning axis to the IMU, across the axis, m.
    pub lever_arm: SpinVector,
    /// Scale error of the gyroscope about the axis, no unit.
    pub scale: SpinValue,
    /// Rate about the axis while the robot seemed to stand still, rad/s.
    pub slow_turn: SpinValue,
    /// That rate is significant, and was subtracted from the gyroscope bias.
    pub turned_while_still: MaybeUninit<bool>,
    /// Angle turned clockwise, rad, positive.
    pub clockwise: f32,
    /// Angle turned counter-clockwise, rad, positive.
    pub counter_clockwise: f32,
    /// Time at rest, s.
    pub resting_time: f32,
    /// Samples at rest and turning.
    pub samples: u32,
    /// Sum of squared normalised residuals of the model against free harmonics.
    pub chi_square: f32,
    /// Its degrees of freedom.
    pub degrees_of_freedom: u32,
}

/// Solves for all that was seen so far: the result when the phase is ::TUMBLE_SPIN_PHASE_DONE. `true_angle` and `failure`
/// may be null. When done, and without a true angle, it was solved already; else all of it is solved within
/// this call, which takes long (docs/how-to/c.md). Slices of solving that were under way begin anew.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY; ::TUMBLE_ERROR_NOT_FINITE,
/// ::TUMBLE_ERROR_SETTING of the true angle; ::TUMBLE_ERROR_SPIN where nothing is observable, and `failure` gives the
/// reason.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_solve(
    spin: *mut Spin,
    true_angle: *const SpinTrueAngle,
    estimate: *mut SpinEstimate,
    failure: *mut SpinFailure,
) -> Status {
    let told = (!true_angle.is_null()).then_some(true_angle);
    // SAFETY: the header requires it of all pointers.
    let true_angle = told.map(|told| unsafe { look(told) }.and_then(SpinTrueAngle::in_core));
    // SAFETY: the same.
    let (place, why) = unsafe { (Place::at(estimate), Place::if_wanted(failure)) };
    status((|| {
        let (true_angle, place, why) = (true_angle.transpose()?, place?, why?);
        let solve = |machine: &mut SpinMachine<f32>| {
            let solved =
                machine.solve_in_place(true_angle.as_ref(), |found| place.write(SpinEstimate::of(found)));
            solved.map_err(|failed| {
                if let Some(why) = why {
                    why.write(SpinFailure::of(&failed));
                }
                Status::TumbleErrorSpin
            })
        };
        // SAFETY: the same.
        unsafe { change(spin, solve) }
    })())
}

/// Makes a record of the bias that a spin showed of a sensor of the unit `identity`: M is that of a sensor without error,
/// and sigmas of what a spin does not show are infinite. It is the first of its sensor, `sequence` 1, at a temperature that
/// nobody knows; both may be written before it is kept.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_CODE; ::TUMBLE_ERROR_SPIN if the spin does not show this bias;
/// ::TUMBLE_ERROR_NOT_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_record_from_spin(
    record: *mut Record,
    identity: u64,
    sensor: MaybeUninit<Sensor>,
    estimate: *const SpinEstimate,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, estimate) = unsafe { (Place::at(record), look(estimate)) };
    status((|| {
        let (place, estimate, sensor) = (place?, estimate?, code(sensor)?.in_core());
        let bias = estimate.bias(sensor);
        if !truth(bias.observed) {
            return Err(Status::TumbleErrorSpin);
        }
        if !bias.value.iter().chain(&bias.sigma).all(|x| x.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        let shown = CoreRecord::of_bias(identity, sensor, &vector(&bias.value), &vector(&bias.sigma));
        place.write(Record::of(&shown, None));
        Ok(())
    })())
}

impl SpinTrueAngle {
    fn in_core(&self) -> StatusResult<TrueAngle<f32>> {
        let numbers = [self.clockwise, self.counter_clockwise, self.sigma];
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        if numbers.iter().any(|x| *x < 0.0) || self.sigma == 0.0 {
            return Err(Status::TumbleErrorSetting);
        }
        Ok(TrueAngle {
            clockwise: unless_zero(self.clockwise),
            counter_clockwise: unless_zero(self.counter_clockwise),
            sigma: self.sigma,
        })
    }
}

impl SpinEstimate {
    fn bias(&self, sensor: CoreSensor) -> &SpinVector {
        match sensor {
            CoreSensor::Accelerometer => &self.accelerometer_bias,
            CoreSensor::Gyroscope => &self.gyroscope_bias,
        }
    }

    fn of(found: &Core<f32>) -> Self {
        Self {
            accelerometer_bias: SpinVector::of(found.accelerometer_bias()),
            gyroscope_bias: SpinVector::of(&found.gyroscope_bias),
            covariance: found.covariance.transpose().into(),
            level_free: SpinVector::of(&found.level_free),
            published: SpinVector::of(&found.level_floor),
            level_free_is_default: MaybeUninit::new(found.level_free_is_default),
            up: found.up.into(),
            roll: SpinValue::of(&found.roll),
            pitch: SpinValue::of(&found.pitch),
            floor_tilt: SpinValue::of(&found.floor_tilt),
            uphill_bearing: SpinValue::of(&found.uphill_bearing),
            lever_arm: SpinVector::of(&found.lever_arm),
            scale: SpinValue::of(&found.scale),
            slow_turn: SpinValue::of(&found.slow_turn),
            turned_while_still: MaybeUninit::new(found.turned_while_still),
            clockwise: found.turned.clockwise.angle,
            counter_clockwise: found.turned.counter_clockwise.angle,
            resting_time: found.resting_time,
            samples: found.samples,
            chi_square: found.chi_square,
            degrees_of_freedom: found.degrees_of_freedom,
        }
    }
}

impl SpinValue {
    fn of(value: &ScalarEstimate<f32>) -> Self {
        Self {
            value: value.value,
            sigma: value.sigma,
            observed: MaybeUninit::new(value.is_known()),
        }
    }
}

impl SpinVector {
    fn of(bias: &VectorEstimate<f32>) -> Self {
        Self {
            value: bias.value.into(),
            sigma: bias.sigma.into(),
            observed: MaybeUninit::new(bias.observed),
        }
    }
}
