//! Events that the monitor reports.

use core::ffi::c_void;
use core::ptr::{from_ref, null};

use tumble_core::redundancy::fit::adoption::AdoptionRefusal;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::event::{Check as CoreCheck, Event as Core, EventKind as CoreKind};
use tumble_core::redundancy::sensor::Sensor as CoreSensor;

use crate::record::{FitModel, Record};
use crate::redundancy::reason::Reason;

/// Kinds of events.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// The platform came to rest.
    RestBegan,
    /// It moves again.
    RestEnded,
    /// A deviation of a sensor at rest was compared with its threshold: `check`; `value` and `limit`, m/s^2 or rad/s.
    Evaluated,
    /// A sensor deviates but is not calibrated: `reason`.
    Withheld,
    /// Calibration mode of these sensors: waiting for motion.
    Triggered,
    /// Pairs are collected from now on.
    MotionBegan,
    /// A fit was made: `fit_model`, `directions`, `pairs`; `value`: residual on held-out pairs, root mean square, `limit`: the
    /// same with what is stored, m/s^2 or rad/s.
    Fitted,
    /// It replaces what was stored: `record`, to be kept by whoever keeps records.
    Adopted,
    /// A calibration was refused: `reason`; `value` and `limit` in the unit of the reason, or `pairs` and `limit`.
    Refused,
    /// Calibration mode ended without a fit: `reason`.
    Abandoned,
    /// A unit failed: `reason`; `channel`, `value` and `limit` with the meaning given by the reason.
    Unhealthy,
    /// A unit is in health again.
    Healthy,
    /// It contradicts another unit, `units`, and nobody knows yet which is wrong: they are `value` apart over `scale` s, and may
    /// be `limit`, m/s^2 or rad/s.
    Disagree,
    /// It agrees with that unit again: `units`.
    Agree,
    /// An aiding measurement was left out: `reason`; reported once for each.
    AidingLeftOut,
    /// An aiding measurement contradicts all units, and decides nothing until it fits again: mean square misfit `value`
    /// with the unit that fits best, in sigmas, above `limit`.
    AidingDistrusted,
    /// It fits again.
    AidingTrusted,
    /// The source of the output is this unit now: `reason`.
    Selected,
    /// There is no source any more: no unit is fit.
    NoneSelected,
    /// A stored record was taken: `sequence`.
    Restored,
    /// A stored record was not taken: `reason`.
    RecordRejected,
    /// The common clock jumped: `by`. Windows begin anew.
    TimeJumped,
    /// All units are at the ends of their ranges, and none of them is the cause: sensor.
    AllSaturated,
}

/// Ways in which a deviation is taken.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// None was.
    None,
    /// Magnitude of specific force against gravity, or of angular rate against zero.
    Norm,
    /// Difference to a valid primary.
    Vector,
}

/// One event. Fields that do not belong to its kind are zero, false or null.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Event {
    /// Microseconds of the common clock.
    pub time: u64,
    /// Jump of the clock, microseconds.
    pub by: i64,
    /// The record adopted. It is the library's, and there until the callback returns. Its temperature is NaN, since the
    /// monitor does not know it: fill it in before it is saved, if it is known.
    pub record: *const Record,
    /// Kind of the event.
    pub kind: EventKind,
    /// Why.
    pub reason: Reason,
    /// The unit it concerns; 0, the primary, also where it concerns all.
    pub unit: u32,
    /// Way in which a deviation was taken.
    pub check: Check,
    /// Model that was fitted.
    pub fit_model: FitModel,
    /// Pairs fitted to and held out together.
    pub pairs: u32,
    /// Count of the calibrations of the sensor.
    pub sequence: u32,
    /// A figure.
    pub value: f32,
    /// Limit for the value.
    pub limit: f32,
    /// Time over which a contradiction between units shows, s.
    pub scale: f32,
    /// 0 to 2 accelerometer, 3 to 5 gyroscope, x y z each.
    pub channel: u8,
    /// Directions of motion along which the matrix was fitted.
    pub directions: u8,
    /// Other units, a bit each, the primary's the lowest: of ::TUMBLE_REASON_OUT_OF_FAMILY those that agree with each other,
    /// of ::TUMBLE_EVENT_KIND_DISAGREE and ::TUMBLE_EVENT_KIND_AGREE the other one.
    pub units: u8,
    /// True if the event concerns the accelerometer.
    pub accelerometer: bool,
    /// True if the event concerns the gyroscope.
    pub gyroscope: bool,
}

/// Receives an event, from within the call that made it happen, with the `context` given there. It may use other
/// storage, but none that this call works with, which is answered by ::TUMBLE_ERROR_BUSY: not the monitor, nor, of
/// tumble_redundancy_restore_from(), the store. It has to return, neither by `longjmp` nor by an exception.
pub type OnEvent = Option<unsafe extern "C" fn(context: *mut c_void, event: *const Event)>;

/// Receiver of events.
pub struct Listener {
    /// If anybody.
    pub on_event: OnEvent,
    /// Pointer that is passed to the callback.
    pub context: *mut c_void,
}

impl Listener {
    /// Reports an event.
    pub fn tell(&self, event: &Core<f32>) {
        let Some(on_event) = self.on_event else { return };
        let record = match &event.kind {
            CoreKind::Adopted { record } => Some(Record::of(record, None)),
            _ => None,
        };
        let mut told = Event::of(event);
        told.record = record.as_ref().map_or(null(), from_ref);
        // SAFETY: the caller gave both for this, and what they point to lives until the call returns.
        unsafe { on_event(self.context, &raw const told) }
    }
}

/// A unit among units.
fn bit(unit: usize) -> u8 {
    u32::try_from(unit)
        .ok()
        .and_then(|unit| 1_u8.checked_shl(unit))
        .unwrap_or(0)
}

impl Event {
    const NOTHING: Self = Self {
        time: 0,
        by: 0,
        record: null(),
        kind: EventKind::RestBegan,
        reason: Reason::None,
        unit: 0,
        check: Check::None,
        fit_model: FitModel::Offset,
        pairs: 0,
        sequence: 0,
        value: 0.0,
        limit: 0.0,
        scale: 0.0,
        channel: 0,
        directions: 0,
        units: 0,
        accelerometer: false,
        gyroscope: false,
    };

    fn of(event: &Core<f32>) -> Self {
        Self {
            time: event.time,
            unit: u32::try_from(event.unit).unwrap_or(0),
            ..Self::of_kind(&event.kind)
        }
    }

    fn of_kind(kind: &CoreKind<f32>) -> Self {
        let of = |kind| Self {
            kind,
            ..Self::NOTHING
        };
        match *kind {
            CoreKind::RestBegan => of(EventKind::RestBegan),
            CoreKind::RestEnded => of(EventKind::RestEnded),
            CoreKind::Evaluated {
                sensor,
                check,
                deviation,
                threshold,
            } => Self {
                check: Check::of(check),
                ..of(EventKind::Evaluated)
                    .sensor(sensor)
                    .figures(deviation, threshold)
            },
            CoreKind::Withheld { sensor, why } => of(EventKind::Withheld)
                .sensor(sensor)
                .because(Reason::of_withheld(why)),
            CoreKind::Triggered {
                sensors: [accelerometer, gyroscope],
            } => Self {
                accelerometer,
                gyroscope,
                ..of(EventKind::Triggered)
            },
            CoreKind::MotionBegan => of(EventKind::MotionBegan),
            CoreKind::Fitted {
                sensor,
                fit_model,
                directions,
                pairs,
                residual,
                residual_before,
            } => Self {
                fit_model: FitModel::of(fit_model),
                directions,
                pairs,
                ..of(EventKind::Fitted)
                    .sensor(sensor)
                    .figures(residual, residual_before)
            },
            CoreKind::Adopted { ref record } => Self {
                sequence: record.sequence,
                ..of(EventKind::Adopted).sensor(record.sensor)
            },
            CoreKind::Refused { sensor, why } => of(EventKind::Refused).sensor(sensor).refused(&why),
            CoreKind::Abandoned { why } => of(EventKind::Abandoned).because(Reason::of_abandoned(why)),
            CoreKind::Unhealthy { fault } => of(EventKind::Unhealthy).failed(&fault),
            CoreKind::Healthy => of(EventKind::Healthy),
            CoreKind::Disagree {
                sensor,
                other,
                apart,
                limit,
                scale,
            } => Self {
                scale,
                units: bit(other),
                ..of(EventKind::Disagree).sensor(sensor).figures(apart, limit)
            },
            CoreKind::Agree { sensor, other } => Self {
                units: bit(other),
                ..of(EventKind::Agree).sensor(sensor)
            },
            CoreKind::AidingLeftOut { why } => of(EventKind::AidingLeftOut).because(Reason::of_left_out(why)),
            CoreKind::AidingDistrusted { misfit, limit } => {
                of(EventKind::AidingDistrusted).figures(misfit, limit)
            }
            CoreKind::AidingTrusted => of(EventKind::AidingTrusted),
            CoreKind::Selected { reason } => of(EventKind::Selected).because(Reason::of_selection(reason)),
            CoreKind::NoneSelected => of(EventKind::NoneSelected).because(Reason::NoneFit),
            CoreKind::Restored { sensor, sequence } => Self {
                sequence,
                ..of(EventKind::Restored).sensor(sensor)
            },
            CoreKind::RecordRejected { sensor, why } => of(EventKind::RecordRejected)
                .sensor(sensor)
                .because(Reason::of_rejected(why)),
            CoreKind::TimeJumped { by } => Self {
                by,
                ..of(EventKind::TimeJumped)
            },
            CoreKind::AllSaturated { sensor } => of(EventKind::AllSaturated).sensor(sensor),
        }
    }

    fn sensor(self, sensor: CoreSensor) -> Self {
        Self {
            accelerometer: sensor == CoreSensor::Accelerometer,
            gyroscope: sensor == CoreSensor::Gyroscope,
            ..self
        }
    }

    fn because(self, reason: Reason) -> Self {
        Self { reason, ..self }
    }

    fn figures(self, value: f32, limit: f32) -> Self {
        Self { value, limit, ..self }
    }

    fn refused(self, why: &AdoptionRefusal<f32>) -> Self {
        let refused = self.because(Reason::of_refusal(why.reason()));
        match *why {
            AdoptionRefusal::Unsolvable => refused,
            AdoptionRefusal::TooFewPairs { pairs, needed } => Self {
                pairs,
                #[allow(clippy::cast_precision_loss)] // Nobody asks for more pairs than a float counts.
                limit: needed as f32,
                ..refused
            },
            AdoptionRefusal::Exceeds(_, excess) => refused.figures(excess.value, excess.limit),
        }
    }

    fn failed(self, fault: &HealthFault<f32>) -> Self {
        let found = fault.figures();
        let of_channel = |channel: u8| CoreSensor::of_channel(channel.into());
        let sensor = found.sensor.or(found.channel.map(of_channel));
        Self {
            reason: Reason::of_fault(fault),
            value: found.value.unwrap_or(self.value),
            limit: found.limit.unwrap_or(self.limit),
            scale: found.scale.unwrap_or(self.scale),
            channel: found.channel.unwrap_or(self.channel),
            units: found.agreeing.unwrap_or(self.units),
            accelerometer: sensor == Some(CoreSensor::Accelerometer),
            gyroscope: sensor == Some(CoreSensor::Gyroscope),
            ..self
        }
    }
}

impl Check {
    fn of(check: CoreCheck) -> Self {
        match check {
            CoreCheck::Norm => Self::Norm,
            CoreCheck::Vector => Self::Vector,
        }
    }
}
