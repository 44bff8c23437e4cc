//! A robot that stands still and then turns on the spot.

mod estimate;
mod settings;

use core::mem::MaybeUninit;

use tumble_core::spin::failure::SpinFailure as CoreFailure;
use tumble_core::spin::machine::{
    SpinEvent as CoreEvent, SpinMachine, SpinState as CoreState, Wheels as CoreWheels,
};

pub use crate::spin::estimate::{SpinEstimate, SpinTrueAngle, SpinValue, SpinVector, tumble_spin_solve};
pub use crate::spin::settings::{SpinSettings, tumble_spin_defaults_of};

use crate::code::{Code, code};
use crate::model::Sample;
use crate::pointer::{Place, Storage, answer, begin, change, look, read, view};
use crate::status::{Status, status};

/// Words of 8 bytes in the storage of a spin.
pub const TUMBLE_SPIN_WORDS: usize = 640;

/// Storage of a spin. The caller owns it and may put it anywhere; what is in it is the library's.
#[repr(C)]
pub struct Spin {
    /// Not to be touched.
    pub words: [u64; TUMBLE_SPIN_WORDS],
}

impl Storage for Spin {
    type State = SpinMachine<f32>;
    const MARK: u32 = u32::from_le_bytes(*b"TSpn");
}

/// State of the wheels.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wheels {
    /// The state is not known.
    Unknown,
    /// They stand still, and so does the robot.
    Stopped,
    /// At least one turns.
    Turning,
}

/// Where a spin is.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpinPhase {
    /// Not started.
    Idle,
    /// Waits for the robot to stand still, and gathers while it does.
    Still,
    /// Waits for the robot to turn on the spot, and gathers.
    Turn,
    /// It turned far enough, and is solved slice by slice: with each sample, or each call of tumble_spin_work().
    Solving,
    /// tumble_spin_solve() gives the result.
    Done,
    /// There is no result; a calibration from before stays.
    Failed,
}

/// Events of a spin.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpinEvent {
    /// Nothing to report.
    None,
    /// The robot has come to stand.
    StillBegan,
    /// It moved before it had stood long enough; waiting begins anew.
    StillBroken,
    /// It stood long enough: turn it now.
    StillDone,
    /// It has begun to turn.
    TurnBegan,
    /// It turned far enough and the result is there.
    Done,
    /// The spin failed; its state gives the reason.
    Failed,
}

/// Why a spin cannot be used.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpinFault {
    /// It can, or nothing is known yet.
    None,
    /// The robot never stood still long enough; `value`: how long was waited, s.
    NeverStill,
    /// There is no rest to take the bias from.
    NoRest,
    /// The robot did not turn; `value`: how far it turned all the same, rad.
    NoTurn,
    /// It turned less than asked before time ran out; `value`: how far, `limit`: how far was asked, rad.
    TurnedTooLittle,
    /// It rotated about other axes too; `value`: rate across the turning axis, `limit`: largest allowed, rad/s.
    NotOneAxis,
    /// It was lifted or dropped; `value`: change of the force along the axis, `limit`: largest allowed, m/s^2.
    Lifted,
    /// A sensor was at the end of its range; `channel`, and `value`: its reading, m/s^2 or rad/s.
    Saturated,
    /// The floor tilts too much; `value`: its tilt, `limit`: largest allowed, rad.
    FloorTooSteep,
    /// The robot turned too far from one sample to the next; `value`: samples a second, `limit`: fewest needed, Hz.
    SampleRateTooLow,
    /// Samples are missing while the robot turned; `value`: for how long, s.
    SamplesMissing,
    /// No more samples came; `value`: for how long, s.
    StreamStopped,
    /// The equations have no solution.
    Unsolvable,
}

/// Why a spin cannot be used, with the figures.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinFailure {
    /// Why.
    pub fault: SpinFault,
    /// 0 to 2 accelerometer, 3 to 5 gyroscope, x y z each; 0 where no channel is concerned.
    pub channel: u32,
    /// When, microseconds; 0 where that is not known.
    pub time: u64,
    /// Value with the meaning given by ::tumble_spin_fault; else 0.
    pub value: f32,
    /// Limit with the meaning given by ::tumble_spin_fault; else 0.
    pub limit: f32,
}

/// Where a spin is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinState {
    /// Where.
    pub phase: SpinPhase,
    /// Why it failed, if it did.
    pub failure: SpinFailure,
}

/// Progress of a spin.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SpinProgress {
    /// Time stood still, s.
    pub still: f32,
    /// Angle turned, both directions together, rad.
    pub turned: f32,
    /// Rate about the vertical over the block before, rad/s, counter-clockwise.
    pub rate: f32,
    /// True if the robot stood still over the block before.
    pub at_rest: bool,
}

/// Makes storage a spin that has not started. `size` is `sizeof(tumble_spin)`.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SETTING.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_init(
    spin: *mut Spin,
    size: usize,
    settings: *const SpinSettings,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let settings = unsafe { look(settings) };
    let machine = || Ok(SpinMachine::new(&settings?.in_core()?));
    // SAFETY: the same.
    status(unsafe { begin(spin, size, machine) })
}

/// Begins, or begins anew, with the next sample.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_start(spin: *mut Spin) -> Status {
    // SAFETY: the header requires it of all pointers.
    status(unsafe {
        change(spin, |machine| {
            machine.start();
            Ok(())
        })
    })
}

/// Takes in the next sample, with what the wheels did. Before the start, and after the end, samples are passed over; so
/// are those whose time is not later than of the one before, and those with each of which a slice of solving is done.
/// `event` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE;
/// ::TUMBLE_ERROR_NOT_FINITE if the sample is not, which is passed over and does no harm.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_push(
    spin: *mut Spin,
    sample: *const Sample,
    wheels: MaybeUninit<Wheels>,
    event: *mut SpinEvent,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (sample, place) = unsafe { (read(sample), Place::if_wanted(event)) };
    let work = |machine: &mut SpinMachine<f32>| {
        let (sample, place) = (sample?.in_core(), place?);
        let wheels = code(wheels)?.in_core();
        if !sample.is_finite() {
            return Err(Status::TumbleErrorNotFinite);
        }
        let happened = SpinEvent::of(machine.push(&sample, wheels));
        if let Some(place) = place {
            place.write(happened);
        }
        Ok(())
    };
    // SAFETY: the same.
    status(unsafe { change(spin, work) })
}

/// Advances a spin to `now`, microseconds of the unit's clock, so that it notices missing samples. `event` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_tick(spin: *mut Spin, now: u64, event: *mut SpinEvent) -> Status {
    // SAFETY: the header requires it of all pointers.
    let place = unsafe { Place::if_wanted(event) };
    let work = |machine: &mut SpinMachine<f32>| {
        let place = place?;
        let happened = SpinEvent::of(machine.tick(now));
        if let Some(place) = place {
            place.write(happened);
        }
        Ok(())
    };
    // SAFETY: the same.
    status(unsafe { change(spin, work) })
}

/// Does a slice of solving a spin that turned far enough, for those who would rather call it from an idle task than wait
/// for samples to do it; in any other phase it does nothing. `event` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_work(spin: *mut Spin, event: *mut SpinEvent) -> Status {
    // SAFETY: the header requires it of all pointers.
    let place = unsafe { Place::if_wanted(event) };
    let work = |machine: &mut SpinMachine<f32>| {
        let place = place?;
        let happened = SpinEvent::of(machine.work());
        if let Some(place) = place {
            place.write(happened);
        }
        Ok(())
    };
    // SAFETY: the same.
    status(unsafe { change(spin, work) })
}

/// Returns the state of a spin, and the reason if it failed.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_get_state(spin: *const Spin, state: *mut SpinState) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, found) = unsafe {
        (
            Place::at(state),
            view(spin, |machine| SpinState::of(machine.state())),
        )
    };
    answer(place, found)
}

/// Returns the progress of a spin.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_spin_get_progress(spin: *const Spin, progress: *mut SpinProgress) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, found) = unsafe { (Place::at(progress), view(spin, SpinMachine::progress)) };
    let found = found.map(|found| SpinProgress {
        still: found.still,
        turned: found.turned,
        rate: found.rate,
        at_rest: found.at_rest,
    });
    answer(place, found)
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Wheels {
    const COUNT: u32 = 3;
}

impl Wheels {
    fn in_core(self) -> CoreWheels {
        match self {
            Self::Unknown => CoreWheels::Unknown,
            Self::Stopped => CoreWheels::Stopped,
            Self::Turning => CoreWheels::Turning,
        }
    }
}

impl SpinEvent {
    fn of(event: Option<CoreEvent>) -> Self {
        match event {
            None => Self::None,
            Some(CoreEvent::StillBegan) => Self::StillBegan,
            Some(CoreEvent::StillBroken) => Self::StillBroken,
            Some(CoreEvent::StillDone) => Self::StillDone,
            Some(CoreEvent::SpinBegan) => Self::TurnBegan,
            Some(CoreEvent::Done) => Self::Done,
            Some(CoreEvent::Failed) => Self::Failed,
        }
    }
}

impl SpinState {
    fn of(state: &CoreState<f32>) -> Self {
        let (phase, failure) = match state {
            CoreState::Idle => (SpinPhase::Idle, None),
            CoreState::Still => (SpinPhase::Still, None),
            CoreState::Spin => (SpinPhase::Turn, None),
            CoreState::Solving => (SpinPhase::Solving, None),
            CoreState::Done => (SpinPhase::Done, None),
            CoreState::Failed(failure) => (SpinPhase::Failed, Some(failure)),
        };
        let failure = failure.map_or(SpinFailure::NONE, SpinFailure::of);
        Self { phase, failure }
    }
}

impl SpinFailure {
    /// Nothing failed.
    const NONE: Self = Self {
        fault: SpinFault::None,
        channel: 0,
        time: 0,
        value: 0.0,
        limit: 0.0,
    };

    fn new(fault: SpinFault, value: f32, limit: f32) -> Self {
        Self {
            fault,
            value,
            limit,
            ..Self::NONE
        }
    }

    fn at(self, time: u64) -> Self {
        Self { time, ..self }
    }

    /// Converts the core's type.
    pub fn of(failure: &CoreFailure<f32>) -> Self {
        let new = Self::new;
        match *failure {
            CoreFailure::NeverStill { waited } => new(SpinFault::NeverStill, waited, 0.0),
            CoreFailure::NoRest => new(SpinFault::NoRest, 0.0, 0.0),
            CoreFailure::NoTurn { turned } => new(SpinFault::NoTurn, turned, 0.0),
            CoreFailure::TurnedTooLittle { turned, wanted } => {
                new(SpinFault::TurnedTooLittle, turned, wanted)
            }
            CoreFailure::NotOneAxis { time, across, limit } => {
                new(SpinFault::NotOneAxis, across, limit).at(time)
            }
            CoreFailure::Lifted { time, change, limit } => new(SpinFault::Lifted, change, limit).at(time),
            CoreFailure::Saturated { time, channel, value } => Self {
                channel: u32::try_from(channel).unwrap_or(0),
                ..new(SpinFault::Saturated, value, 0.0).at(time)
            },
            CoreFailure::FloorTooSteep { tilt, limit } => new(SpinFault::FloorTooSteep, tilt, limit),
            CoreFailure::SampleRateTooLow { rate, needed } => new(SpinFault::SampleRateTooLow, rate, needed),
            CoreFailure::SamplesMissing { time, gap } => new(SpinFault::SamplesMissing, gap, 0.0).at(time),
            CoreFailure::StreamStopped { time, gap } => new(SpinFault::StreamStopped, gap, 0.0).at(time),
            CoreFailure::Unsolvable => new(SpinFault::Unsolvable, 0.0, 0.0),
        }
    }
}
