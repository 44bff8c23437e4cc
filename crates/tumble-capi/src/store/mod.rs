//! The records of many units in flash.

#[cfg(feature = "magnetometer")]
pub mod magnetometer;

use core::mem::MaybeUninit;

use tumble_store::flash::{
    LayoutError, RecordStore, Saved, StoreError, Which as CoreWhich, WriteLimit as CoreLimit,
};

use crate::code::{Code, code};
use crate::flash::{Driver, DriverError, Flash, WORD};
use crate::pointer::{Place, Storage, answer, begin, change, read, view};
use crate::record::{Record, Sensor, decode_error, encode_error};
use crate::status::{Status, StatusResult, status};
#[cfg(feature = "temperature")]
use crate::temperature::{DriftRecord, TemperatureDrift};

/// Words of 8 bytes in the storage of a store.
pub const TUMBLE_STORE_WORDS: usize = 14;

/// Storage of a store. The caller owns it and may put it anywhere; what is in it is the library's.
#[repr(C)]
pub struct Store {
    /// Not to be touched.
    pub words: [u64; TUMBLE_STORE_WORDS],
}

impl Storage for Store {
    type State = RecordStore<Driver>;
    const MARK: u32 = u32::from_le_bytes(*b"TSto");
}

/// Limit on the wear of flash.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct WriteLimit {
    /// Time between two writes in the long run, microseconds; 0 sets no limit. 600 000 000 where none is given.
    pub shortest_between: u64,
    /// Writes that may follow each other at once; 0 counts as 1. 16 where none is given.
    pub at_once: u32,
}

/// Which of the records of a sensor.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The one in force: the last that was adopted, else the one from the factory.
    InForce,
    /// The last that was adopted.
    Last,
    /// The one adopted before.
    Previous,
    /// The one from the factory.
    Factory,
}

/// Makes storage a store in the `length` bytes of flash from the address `start` on: an even number of pages, at least
/// two. The driver is copied; nothing is read or written yet. `size` is `sizeof(tumble_store)`. `limit` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_NO_DRIVER, ::TUMBLE_ERROR_PAGES,
/// ::TUMBLE_ERROR_BOUNDS, ::TUMBLE_ERROR_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_init(
    store: *mut Store,
    size: usize,
    flash: *const Flash,
    start: u32,
    length: u32,
    limit: *const WriteLimit,
) -> Status {
    let given = (!limit.is_null()).then_some(limit);
    // SAFETY: the header requires it of all pointers.
    let limit = given.map(|limit| unsafe { read(limit) });
    // SAFETY: the same.
    let flash = unsafe { read(flash) };
    let state = || {
        let limit = limit
            .transpose()?
            .map_or(CoreLimit::default(), |limit| CoreLimit {
                shortest_between: limit.shortest_between,
                at_once: limit.at_once,
            });
        open(flash?, start, length, limit)
    };
    // SAFETY: the same.
    status(unsafe { begin(store, size, state) })
}

/// Returns the number of records there is room for: three of each sensor of each unit stay, and its drift, and the more
/// room there is beside them, the less often flash is erased. Where there is none, the previous ones are dropped.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_get_entries(store: *const Store, entries: *mut u32) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, found) = unsafe { (Place::at(entries), view(store, RecordStore::entries)) };
    answer(place, found)
}

/// Reads one of the records of a sensor of a unit.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE,
/// ::TUMBLE_ERROR_NOTHING_STORED, ::TUMBLE_ERROR_FLASH; ::TUMBLE_ERROR_VERSION, if a newer library wrote it, and all other
/// errors of tumble_record_decode().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_load(
    store: *mut Store,
    identity: u64,
    sensor: MaybeUninit<Sensor>,
    which: MaybeUninit<Which>,
    record: *mut Record,
) -> Status {
    let find = |store: &mut RecordStore<Driver>| {
        let sensor = code(sensor)?.in_core();
        Ok(match code(which)?.in_core() {
            None => store.in_force(identity, sensor),
            Some(which) => store.load(identity, sensor, which),
        })
    };
    // SAFETY: the header requires it of all pointers.
    unsafe { load(store, record, find, Record::of_stored) }
}

/// Puts a record in force; the one adopted before it stays as the previous one. If it is in force already, nothing is
/// written, unless it was the last to be written before a reset: power may have been cut in it. Whenever that happens,
/// the old or the new record reads back whole. `now` is microseconds of any clock that does not go back. `wait`, which may be null, is how long to wait after ::TUMBLE_ERROR_TOO_SOON, microseconds.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY; ::TUMBLE_ERROR_CODE,
/// ::TUMBLE_ERROR_NOT_FINITE of the record; ::TUMBLE_ERROR_TOO_SOON, ::TUMBLE_ERROR_FULL: the old one is in force;
/// ::TUMBLE_ERROR_FLASH, ::TUMBLE_ERROR_NOT_AS_WRITTEN: the old or the new one is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_save(
    store: *mut Store,
    now: u64,
    record: *const Record,
    wait: *mut u64,
) -> Status {
    let save = |store: &mut RecordStore<Driver>, record: &_| store.save(now, record);
    // SAFETY: the header requires it of all pointers.
    unsafe { keep(store, record, wait, Record::in_store, save) }
}

/// Keeps a record as the factory's; it is in force until another is saved. Everything else is as of tumble_store_save().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_save_factory(
    store: *mut Store,
    now: u64,
    record: *const Record,
    wait: *mut u64,
) -> Status {
    let save = |store: &mut RecordStore<Driver>, record: &_| store.save_factory(now, record);
    // SAFETY: the header requires it of all pointers.
    unsafe { keep(store, record, wait, Record::in_store, save) }
}

/// Reads what temperature does to a sensor of a unit. Calibrations that are adopted leave it as it is.
///
/// Errors: as of tumble_store_load().
#[cfg(feature = "temperature")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_load_drift(
    store: *mut Store,
    identity: u64,
    sensor: MaybeUninit<Sensor>,
    drift: *mut TemperatureDrift,
) -> Status {
    let find = |store: &mut RecordStore<Driver>| Ok(store.drift(identity, code(sensor)?.in_core()));
    // SAFETY: the header requires it of all pointers.
    unsafe { load(store, drift, find, TemperatureDrift::of) }
}

/// Keeps what temperature does to a sensor, in place of what was kept of that before. Everything else is as of
/// tumble_store_save().
#[cfg(feature = "temperature")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_save_drift(
    store: *mut Store,
    now: u64,
    drift: *const DriftRecord,
    wait: *mut u64,
) -> Status {
    let save = |store: &mut RecordStore<Driver>, drift: &_| store.save_drift(now, drift);
    // SAFETY: the header requires it of all pointers.
    unsafe { keep(store, drift, wait, DriftRecord::in_store, save) }
}

/// Puts the previous or the factory's record in force again; what was in force becomes the previous one. `record` is it
/// then; it may be null, and so may `wait`. Give the record to tumble_redundancy_restore() to put it in use.
///
/// Errors: as of tumble_store_load() and tumble_store_save().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_roll_back(
    store: *mut Store,
    now: u64,
    identity: u64,
    sensor: MaybeUninit<Sensor>,
    to: MaybeUninit<Which>,
    record: *mut Record,
    wait: *mut u64,
) -> Status {
    let roll_back =
        |store: &mut RecordStore<Driver>, to| Ok(store.roll_back(now, identity, code(sensor)?.in_core(), to));
    // SAFETY: the header requires it of all pointers.
    unsafe { restore(store, to, record, wait, roll_back, Record::of_stored) }
}

/// Forgets all records, those of the factory too.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_FLASH.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_erase(store: *mut Store) -> Status {
    // SAFETY: the header requires it of all pointers.
    status(unsafe { change(store, |store| store.erase().map_err(|error| error_of(&error))) })
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Which {
    const COUNT: u32 = 4;
}

impl Which {
    /// `None`: the one in force.
    fn in_core(self) -> Option<CoreWhich> {
        match self {
            Self::InForce => None,
            Self::Last => Some(CoreWhich::Last),
            Self::Previous => Some(CoreWhich::Previous),
            Self::Factory => Some(CoreWhich::Factory),
        }
    }
}

fn open(flash: Flash, start: u32, length: u32, limit: CoreLimit) -> StatusResult<RecordStore<Driver>> {
    let end = start.checked_add(length).ok_or(Status::TumbleErrorBounds)?;
    let driver = Driver::new(flash, end).ok_or(Status::TumbleErrorNoDriver)?;
    let words = usize::try_from(flash.page).is_ok_and(|page| page.is_multiple_of(WORD));
    // A page of no bytes divides nothing.
    let whole = start.checked_rem(flash.page) == Some(0) && (length / 2).checked_rem(flash.page) == Some(0);
    if !(words && whole && length.is_multiple_of(2)) {
        return Err(Status::TumbleErrorPages);
    }
    RecordStore::new(driver, start..end, limit).map_err(|error| match error {
        LayoutError::NotWholePages | LayoutError::WordsNotSupported => Status::TumbleErrorPages,
        LayoutError::OutOfBounds => Status::TumbleErrorBounds,
        LayoutError::TooSmall => Status::TumbleErrorTooSmall,
    })
}

/// Outcome of a call of the store.
type Outcome<T> = Result<T, StoreError<DriverError>>;

/// Reads a record of one of the store's kinds, and writes it as C has it.
///
/// # Safety
/// The pointers satisfy the header.
unsafe fn load<S, C>(
    store: *mut Store,
    record: *mut C,
    find: impl FnOnce(&mut RecordStore<Driver>) -> StatusResult<Outcome<Option<S>>>,
    in_c: impl FnOnce(&S) -> C,
) -> Status {
    // SAFETY: the same is asked of the caller.
    let place = unsafe { Place::at(record) };
    let work = |store: &mut RecordStore<Driver>| {
        let place = place?;
        let found = find(store)?.map_err(|error| error_of(&error))?;
        place.write(in_c(&found.ok_or(Status::TumbleErrorNothingStored)?));
        Ok(())
    };
    // SAFETY: the same.
    status(unsafe { change(store, work) })
}

/// Writes a record in one of the store's ways.
///
/// # Safety
/// The pointers satisfy the header.
unsafe fn keep<C: Copy, S>(
    store: *mut Store,
    record: *const C,
    wait: *mut u64,
    in_store: impl FnOnce(&C) -> StatusResult<S>,
    save: impl FnOnce(&mut RecordStore<Driver>, &S) -> Outcome<Saved>,
) -> Status {
    // SAFETY: the same is asked of the caller.
    let (record, wait) = unsafe { (read(record), Place::if_wanted(wait)) };
    let work = |store: &mut RecordStore<Driver>| {
        let (record, wait) = (in_store(&record?)?, wait?);
        written(save(store, &record), wait).map(|_| ())
    };
    // SAFETY: the same.
    status(unsafe { change(store, work) })
}

/// Puts an earlier record in force again, and writes it as C has it where that is wanted.
///
/// # Safety
/// The pointers satisfy the header.
unsafe fn restore<S, C>(
    store: *mut Store,
    to: MaybeUninit<Which>,
    record: *mut C,
    wait: *mut u64,
    roll_back: impl FnOnce(&mut RecordStore<Driver>, CoreWhich) -> StatusResult<Outcome<S>>,
    in_c: impl FnOnce(&S) -> C,
) -> Status {
    // SAFETY: the same is asked of the caller.
    let (place, wait) = unsafe { (Place::if_wanted(record), Place::if_wanted(wait)) };
    let work = |store: &mut RecordStore<Driver>| {
        let (place, wait) = (place?, wait?);
        let to = code(to)?.in_core().ok_or(Status::TumbleErrorCode)?;
        let found = written(roll_back(store, to)?, wait)?;
        if let Some(place) = place {
            place.write(in_c(&found));
        }
        Ok(())
    };
    // SAFETY: the same.
    status(unsafe { change(store, work) })
}

fn written<T>(outcome: Outcome<T>, wait: Option<Place<u64>>) -> StatusResult<T> {
    outcome.map_err(|error| {
        if let (StoreError::TooSoon { wait: time }, Some(place)) = (&error, wait) {
            place.write(*time);
        }
        error_of(&error)
    })
}

/// Why the store did not do it.
pub fn error_of(error: &StoreError<DriverError>) -> Status {
    match *error {
        StoreError::Flash(DriverError) => Status::TumbleErrorFlash,
        StoreError::NotAsWritten => Status::TumbleErrorNotAsWritten,
        StoreError::Encode(error) => encode_error(error),
        StoreError::Decode(error) => decode_error(error),
        StoreError::TooSoon { .. } => Status::TumbleErrorTooSoon,
        StoreError::Full { .. } => Status::TumbleErrorFull,
        StoreError::NothingStored(_) => Status::TumbleErrorNothingStored,
    }
}
