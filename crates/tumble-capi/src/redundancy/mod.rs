//! A primary that keeps its secondaries calibrated, and a secondary that takes over when the primary fails.

#[cfg(feature = "aiding")]
mod aiding;
mod choice;
#[cfg(feature = "settings_check")]
mod contradiction;
mod event;
mod reason;
mod seal;
mod settings;
#[cfg(feature = "records")]
mod stored;
mod unit;

use core::ffi::c_void;
use core::mem::MaybeUninit;
use core::slice;

use tumble_core::model::ErrorModel as CoreModel;
use tumble_core::redundancy::evaluation::primary_factory_error;
use tumble_core::redundancy::monitor::event::{
    Event as CoreEvent, EventKind as CoreEventKind, RecordRejection,
};
use tumble_core::redundancy::monitor::{Command as CoreCommand, Monitor};
use tumble_core::redundancy::platform::{
    MountedUnit as CoreUnit, Platform, PlatformError, PrimaryCalibration, check_units,
};
use tumble_core::redundancy::record::Record as CoreRecord;
use tumble_core::redundancy::sensor::Sensor as CoreSensor;
use tumble_core::redundancy::settings::RedundancySettings as CoreSettings;
use tumble_core::redundancy::unit_count::MAJORITY;

#[cfg(feature = "aiding")]
pub use crate::redundancy::aiding::{Aiding, AidingKind};
pub use crate::redundancy::choice::{Adoption, Data, Gate, Scope, Threshold, ThresholdKind};
#[cfg(feature = "settings_check")]
pub use crate::redundancy::contradiction::tumble_redundancy_check;
pub use crate::redundancy::event::{Check, Event, EventKind, OnEvent};
pub use crate::redundancy::reason::Reason;
pub use crate::redundancy::seal::tumble_redundancy_init_sealed;
#[cfg(feature = "settings_check")]
pub use crate::redundancy::seal::tumble_redundancy_seal;
pub use crate::redundancy::settings::{RedundancySettings, tumble_redundancy_defaults_of};
#[cfg(feature = "records")]
pub use crate::redundancy::stored::tumble_redundancy_restore_from;
pub use crate::redundancy::unit::{TUMBLE_AXES_ALL, Unit, tumble_unit_defaults_of};

use crate::code::{Code, code};
use crate::model::{Calibration, Sample, rows};
use crate::pointer::{Place, Storage, answer, begin_in_place, change, look, read, view};
use crate::record::{Record, Sensor};
use crate::redundancy::event::Listener;
use crate::redundancy::seal::sealed;
use crate::status::{Status, StatusResult, status};

/// Units that the library was built for.
pub const UNITS: usize = units(option_env!("TUMBLE_UNITS"));

/// Words of 8 bytes in the storage of a monitor.
pub const TUMBLE_REDUNDANCY_WORDS: usize = 118
    + 171 * UNITS
    + 4 * UNITS * UNITS
    + TUMBLE_MAJORITY_WORDS
    + TUMBLE_CALIBRATION_WORDS
    + TUMBLE_AIDING_WORDS;

/// Words for the model by which units judge one another, two beside aiding measurements; `cbindgen.toml` has them for C.
pub const TUMBLE_MAJORITY_WORDS: usize = if MAJORITY == 1 {
    60 + 255 * UNITS + 121 * UNITS * UNITS / 2
} else {
    0
};

/// Words for a calibration under way; `cbindgen.toml` has them for C.
pub const TUMBLE_CALIBRATION_WORDS: usize = if cfg!(feature = "calibration") { 305 } else { 0 };

/// Words for aiding measurements; `cbindgen.toml` has them for C.
pub const TUMBLE_AIDING_WORDS: usize = if cfg!(feature = "aiding") {
    8 + 111 * UNITS
} else {
    0
};

/// Value of `output.source` and result of `tumble_redundancy_get_source()` where there is no source.
pub const TUMBLE_NO_SOURCE: u32 = u32::MAX;

/// Flag of an output: its source is known to be wrong, or does not measure an axis of the primary, and no other unit
/// can replace it.
pub const TUMBLE_OUTPUT_DEGRADED: u32 = 1;

/// Storage of a monitor. The caller owns it and may put it anywhere; what is in it is the library's.
#[repr(C)]
pub struct Redundancy {
    /// Not to be touched.
    pub words: [u64; TUMBLE_REDUNDANCY_WORDS],
}

/// Secondaries that are calibrated at a time.
const AT_ONCE: usize = cfg!(feature = "calibration") as usize;

/// Sets that receive aiding measurements.
const AIDED: usize = cfg!(feature = "aiding") as usize;

/// A monitor and the set that it watches.
pub struct Watched {
    platform: Platform<f32, UNITS>,
    monitor: Monitor<f32, UNITS, AT_ONCE, AIDED>,
}

impl Storage for Redundancy {
    type State = Watched;
    const MARK: u32 = u32::from_le_bytes(*b"TRed");
}

/// Commands to a monitor.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Evaluate at the next rest, or at this one.
    Evaluate,
    /// Take the primary for the source again, if it is in health.
    ReturnToPrimary,
}

/// Output of the set, from whichever source: at the primary's place, in its case frame, with its own calibration
/// applied.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Output {
    /// Microseconds of the common clock.
    pub time: u64,
    /// Specific force, m/s^2; not a number along axes that the source does not measure.
    pub specific_force: [f32; 3],
    /// Angular rate, rad/s; not a number about axes that the source does not measure.
    pub angular_rate: [f32; 3],
    /// The unit it comes from, 0 the primary; #TUMBLE_NO_SOURCE if this sample makes no output, and nothing else counts.
    pub source: u32,
    /// Flags of the output: 0, or #TUMBLE_OUTPUT_DEGRADED.
    pub flags: u32,
}

/// Stored error of one sensor of a unit. For the primary it is its own calibration, against the truth.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Knowledge {
    /// M, row by row, in the sensor's own axes beside its nominal mounting: close to identity. For the primary it is as
    /// given.
    pub matrix: [[f32; 3]; 3],
    /// b, m/s^2 or rad/s.
    pub bias: [f32; 3],
    /// From the primary, m, primary's case frame.
    pub lever_arm: [f32; 3],
    /// Root mean square residual of a channel on held-out pairs, m/s^2 or rad/s; zero before the first calibration.
    pub residual: f32,
    /// Error of the first calibration, or of the record from the factory, from which thresholds of the kind
    /// ::TUMBLE_THRESHOLD_KIND_FACTORY_BY_MARGIN are counted, m/s^2 or rad/s; zero before.
    pub factory: f32,
    /// Its difference to a valid primary at the last rest, m/s^2 or rad/s; infinite before.
    pub apart: f32,
    /// Counts the calibrations; zero before the first, and of the primary.
    pub sequence: u32,
    /// True if a calibration is stored.
    pub calibrated: bool,
    /// True if that difference was within the threshold.
    pub agrees: bool,
}

/// Makes storage a monitor of `count` units, the primary first. `size` is `sizeof(tumble_redundancy)`; `count` is
/// #TUMBLE_UNITS. `calibration` is the primary's own, with which the output is calibrated whoever is its source; null:
/// its readings are taken for the truth. All that is given is copied.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_UNITS, ::TUMBLE_ERROR_CODE,
/// ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SETTING, ::TUMBLE_ERROR_CONTRADICTION, ::TUMBLE_ERROR_SINGULAR,
/// ::TUMBLE_ERROR_PRIMARY, ::TUMBLE_ERROR_MOUNTING, ::TUMBLE_ERROR_SAME_IDENTITY.
///
/// cbindgen:ptrs-as-arrays=[[units; ]]
#[allow(rustdoc::broken_intra_doc_links)] // The line above is for cbindgen.
#[cfg(feature = "settings_check")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_init(
    redundancy: *mut Redundancy,
    size: usize,
    settings: *const RedundancySettings,
    calibration: *const Calibration,
    units: *const Unit,
    count: usize,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    status(unsafe { init(redundancy, size, settings, None, calibration, units, count) })
}

/// Takes in the next sample of a unit, in its own frame and clock. Samples of different units may come in any order as
/// long as none is more than a window behind the others. Hand readings that are no numbers in as they
/// are: the monitor detects them. `on_event` and `output` may be null. A calibration whose pairs are complete is fitted in steps, one
/// with each of about 14 samples.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_NO_SUCH_UNIT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_push(
    redundancy: *mut Redundancy,
    unit: u32,
    sample: *const Sample,
    on_event: OnEvent,
    context: *mut c_void,
    output: *mut Output,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (sample, place) = unsafe { (read(sample), Place::if_wanted(output)) };
    let listener = Listener { on_event, context };
    let work = |watched: &mut Watched| {
        let (sample, place, number) = (sample?.in_core(), place?, number(unit)?);
        let Watched { platform, monitor } = watched;
        let said = monitor.push(platform, number, &sample, &mut |event| listener.tell(&event));
        if let Some(place) = place {
            place.write(said.map_or(Output::NONE, |said| Output {
                time: said.time,
                specific_force: said.specific_force.into(),
                angular_rate: said.angular_rate.into(),
                source: source(Some(said.source)),
                flags: u32::from(said.degraded) * TUMBLE_OUTPUT_DEGRADED,
            }));
        }
        Ok(())
    };
    // SAFETY: the same.
    status(unsafe { change(redundancy, work) })
}

/// Takes in an aiding measurement of the motion of the set at `time`, microseconds of the common clock: the time at
/// which it was measured, up to a second ago, not that at which it came. It settles which of two units is wrong that
/// disagree. A measurement that cannot be used is left out, and ::TUMBLE_EVENT_KIND_AIDING_LEFT_OUT gives the reason.
/// `on_event` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE,
/// ::TUMBLE_ERROR_NO_SUCH_UNIT of a score.
#[cfg(feature = "aiding")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_aiding(
    redundancy: *mut Redundancy,
    time: u64,
    aiding: *const Aiding,
    on_event: OnEvent,
    context: *mut c_void,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let aiding = unsafe { read(aiding) };
    let listener = Listener { on_event, context };
    let work = |watched: &mut Watched| {
        let aiding = aiding?.in_core()?;
        watched
            .monitor
            .aiding(time, &aiding, &mut |event| listener.tell(&event));
        Ok(())
    };
    // SAFETY: the same.
    status(unsafe { change(redundancy, work) })
}

/// Takes in how warm a unit is, degC, from its next sample on; NaN where nobody knows. Call it before tumble_redundancy_push()
/// where the temperature changed. Units that are warmer or colder than they were when they were calibrated may differ by more.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_NO_SUCH_UNIT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_set_temperature(
    redundancy: *mut Redundancy,
    unit: u32,
    temperature: f32,
) -> Status {
    let work = |watched: &mut Watched| {
        watched.monitor.set_temperature(number(unit)?, temperature);
        Ok(())
    };
    // SAFETY: as the header asks of all pointers.
    status(unsafe { change(redundancy, work) })
}

/// Asks for something, from now on.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_command(
    redundancy: *mut Redundancy,
    command: MaybeUninit<Command>,
) -> Status {
    let work = |watched: &mut Watched| {
        watched.monitor.command(match code(command)? {
            Command::Evaluate => CoreCommand::Evaluate,
            Command::ReturnToPrimary => CoreCommand::ReturnToPrimary,
        });
        Ok(())
    };
    // SAFETY: the header requires it of all pointers.
    status(unsafe { change(redundancy, work) })
}

/// Returns the unit from which the output comes; #TUMBLE_NO_SOURCE if from none.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_get_source(
    redundancy: *const Redundancy,
    unit: *mut u32,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, found) = unsafe {
        (
            Place::at(unit),
            view(redundancy, |watched| source(watched.monitor.source())),
        )
    };
    answer(place, found)
}

/// Returns the stored error of a sensor of a unit, the primary or a secondary.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_NO_SUCH_UNIT,
/// ::TUMBLE_ERROR_CODE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_get_stored(
    redundancy: *const Redundancy,
    unit: u32,
    sensor: MaybeUninit<Sensor>,
    stored: *mut Knowledge,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, found) = unsafe {
        (
            Place::at(stored),
            view(redundancy, |watched| Knowledge::of(watched, unit, code(sensor)?)),
        )
    };
    answer(place, found.flatten())
}

/// Takes a stored record; an event reports whether it was accepted. After a reset, give it before the first sample.
/// After tumble_store_roll_back(), at any time: a calibration of that unit that is under way is abandoned. That of the
/// primary, which relates its readings to the truth, becomes its own calibration of that sensor; it is taken before the
/// first sample only. `on_event` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE,
/// ::TUMBLE_ERROR_BEGUN.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_restore(
    redundancy: *mut Redundancy,
    record: *const Record,
    on_event: OnEvent,
    context: *mut c_void,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let record = unsafe { read(record) };
    let listener = Listener { on_event, context };
    let work = |watched: &mut Watched| {
        let record = record?.in_store()?.record;
        if record.identity == watched.primary() {
            return watched.calibrate_primary(&record, &listener);
        }
        let Watched { platform, monitor } = watched;
        monitor.restore(platform, &record, &mut |event| listener.tell(&event));
        Ok(())
    };
    // SAFETY: the same.
    status(unsafe { change(redundancy, work) })
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Command {
    const COUNT: u32 = 2;
}

impl Output {
    const NONE: Self = Self {
        time: 0,
        specific_force: [0.0; 3],
        angular_rate: [0.0; 3],
        source: TUMBLE_NO_SOURCE,
        flags: 0,
    };
}

impl Watched {
    /// Begins with a platform of these parts.
    fn begin(&mut self, parts: &Parts) {
        // They were checked.
        let _ = self
            .platform
            .set(&parts.settings, &parts.calibration, &parts.units);
        self.monitor.reset();
    }

    /// Identity of the primary.
    fn primary(&self) -> u64 {
        let [primary, ..] = self.platform.units();
        primary.identity
    }

    /// Takes a record of the primary for its own calibration.
    fn calibrate_primary(&mut self, record: &CoreRecord<f32>, listener: &Listener) -> StatusResult {
        if self.monitor.has_begun() {
            return Err(Status::TumbleErrorBegun);
        }
        let sensor = record.sensor;
        let kind = match self.platform.calibration().with_record(record) {
            Some(calibration) => {
                self.platform.set_calibration(calibration);
                let sequence = record.sequence;
                CoreEventKind::Restored { sensor, sequence }
            }
            None => CoreEventKind::RecordRejected {
                sensor,
                why: if record.is_finite() {
                    RecordRejection::Implausible
                } else {
                    RecordRejection::NotFinite
                },
            },
        };
        listener.tell(&CoreEvent {
            time: 0,
            unit: 0,
            kind,
        });
        Ok(())
    }
}

impl Knowledge {
    fn of(watched: &Watched, unit: u32, sensor: Sensor) -> StatusResult<Self> {
        if unit == 0 {
            return Ok(Self::of_primary(watched, sensor.in_core()));
        }
        let both = watched.monitor.stored(number(unit)?);
        let [accelerometer, gyroscope] = both.ok_or(Status::TumbleErrorNoSuchUnit)?;
        let stored = match sensor {
            Sensor::Accelerometer => accelerometer,
            Sensor::Gyroscope => gyroscope,
        };
        Ok(Self {
            matrix: rows(&stored.error.matrix),
            bias: stored.error.bias.into(),
            lever_arm: stored.error.lever_arm.into(),
            residual: stored.residual,
            factory: stored.factory,
            apart: stored.apart,
            sequence: stored.sequence,
            calibrated: stored.calibrated,
            agrees: stored.agrees,
        })
    }

    /// It is not apart from itself.
    fn of_primary(watched: &Watched, sensor: CoreSensor) -> Self {
        let calibration = watched.platform.calibration();
        let model = calibration.model(sensor);
        let settings = &watched.platform.settings().evaluation;
        Self {
            matrix: rows(&model.matrix),
            bias: model.bias.into(),
            lever_arm: [0.0; 3],
            residual: calibration.residual(sensor),
            factory: primary_factory_error(sensor, &watched.platform.primary_axes(), calibration, settings),
            apart: 0.0,
            sequence: 0,
            calibrated: *model != CoreModel::identity(),
            agrees: true,
        }
    }
}

/// Makes storage a monitor, with settings that it checks, or that bear this seal of a check elsewhere.
///
/// # Safety
/// The same as the header asks of tumble_redundancy_init().
unsafe fn init(
    redundancy: *mut Redundancy,
    size: usize,
    settings: *const RedundancySettings,
    seal: Option<u32>,
    calibration: *const Calibration,
    units: *const Unit,
    count: usize,
) -> StatusResult {
    // Before all else, since the size of the storage goes with it.
    if count != UNITS {
        return Err(Status::TumbleErrorUnits);
    }
    let given = (!calibration.is_null()).then_some(calibration);
    // SAFETY: the same is asked of the caller.
    let calibration = given.map(|calibration| unsafe { look(calibration) });
    // SAFETY: the same.
    let (settings, first) = unsafe { (look(settings), look(units)) };
    let prepare = || {
        let (settings, calibration) = (settings?, calibration.transpose()?);
        first?;
        // SAFETY: the same, and there are as many as the caller states.
        let units = unsafe { slice::from_raw_parts(units, UNITS) };
        Parts::of(settings, seal, calibration, units)
    };
    let write = |parts: Parts, watched: *mut Watched| {
        // SAFETY: the place is that of a state, of which zeros are a value, as a test holds.
        let watched = unsafe {
            watched.write_bytes(0, 1);
            &mut *watched
        };
        watched.begin(&parts);
    };
    // SAFETY: the same.
    unsafe { begin_in_place(redundancy, size, prepare, write) }
}

/// Number of units that the environment asks for; three where it does not.
const fn units(asked: Option<&str>) -> usize {
    let Some(text) = asked else { return 3 };
    let digits = text.as_bytes();
    assert!(
        digits.len() == 1 && digits[0] >= b'2' && digits[0] <= b'8',
        "TUMBLE_UNITS is 2 to 8"
    );
    (digits[0] - b'0') as usize
}

fn number(unit: u32) -> StatusResult<usize> {
    let number = usize::try_from(unit).ok().filter(|number| *number < UNITS);
    number.ok_or(Status::TumbleErrorNoSuchUnit)
}

fn source(unit: Option<usize>) -> u32 {
    unit.and_then(|unit| u32::try_from(unit).ok())
        .unwrap_or(TUMBLE_NO_SOURCE)
}

/// Parts of a platform, which are checked.
struct Parts {
    settings: CoreSettings<f32>,
    calibration: PrimaryCalibration<f32>,
    units: [CoreUnit<f32>; UNITS],
}

impl Parts {
    fn of(
        settings: &RedundancySettings,
        seal: Option<u32>,
        calibration: Option<&Calibration>,
        units: &[Unit],
    ) -> StatusResult<Self> {
        // First, as settings of another layout may be shorter than what a seal covers.
        let in_core = settings.in_core()?;
        if seal.is_some_and(|seal| seal != sealed(settings)) {
            return Err(Status::TumbleErrorContradiction);
        }
        let mut parts = Self {
            settings: in_core,
            calibration: own_calibration(calibration)?,
            units: [CoreUnit::new(0); UNITS],
        };
        for (place, unit) in parts.units.iter_mut().zip(units) {
            *place = unit.in_core()?;
        }
        if seal.is_none() && parts.settings.validate().is_err() {
            return Err(Status::TumbleErrorContradiction);
        }
        check_units(&parts.settings, &parts.units).map_err(platform_error)?;
        Ok(parts)
    }
}

// Its stack is not under that of others.
#[inline(never)]
fn own_calibration(given: Option<&Calibration>) -> StatusResult<PrimaryCalibration<f32>> {
    let Some(given) = given else {
        return Ok(PrimaryCalibration::none());
    };
    PrimaryCalibration::new(given.accelerometer.in_core()?, given.gyroscope.in_core()?)
        .ok_or(Status::TumbleErrorSingular)
}

fn platform_error(error: PlatformError) -> Status {
    match error {
        PlatformError::Settings(_) => Status::TumbleErrorContradiction,
        PlatformError::TooFewUnits => Status::TumbleErrorUnits,
        PlatformError::Primary => Status::TumbleErrorPrimary,
        PlatformError::Mounting(_) => Status::TumbleErrorMounting,
        PlatformError::Threshold(_) => Status::TumbleErrorContradiction,
        PlatformError::SameIdentity(_) => Status::TumbleErrorSameIdentity,
    }
}

#[cfg(test)]
mod tests {
    use core::mem::zeroed;

    use super::*;

    /// Text of all that a state holds, cut into pieces: two states are compared by it, since NaN equals nothing.
    struct Text([u8; 64 * 1024], usize);

    impl core::fmt::Write for Text {
        fn write_str(&mut self, text: &str) -> core::fmt::Result {
            for byte in text.bytes() {
                *self.0.get_mut(self.1).ok_or(core::fmt::Error)? = byte;
                self.1 += 1;
            }
            Ok(())
        }
    }

    fn text(monitor: &Monitor<f32, UNITS, AT_ONCE, AIDED>) -> Text {
        let mut text = Text([0; 64 * 1024], 0);
        core::fmt::Write::write_fmt(&mut text, format_args!("{monitor:?}")).expect("room");
        text
    }

    #[test]
    fn a_monitor_begun_on_zeros_is_a_new_one() {
        // SAFETY: this is what is tried: where zeros are no value, it panics.
        let mut watched = unsafe { zeroed::<Watched>() };
        watched.monitor.reset();
        let (begun, new) = (text(&watched.monitor), text(&Monitor::new()));
        assert_eq!(begun.1, new.1);
        assert!(begun.1 > 1000 && begun.0 == new.0);
    }
}
