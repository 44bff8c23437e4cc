//! Magnetometers in flash.

use core::mem::MaybeUninit;

use tumble_store::flash::RecordStore;

use crate::code::code;
use crate::flash::Driver;
use crate::magnetometer::MagnetometerRecord;
use crate::status::Status;
use crate::store::{Store, Which, keep, load, restore};

/// Reads one of the records of the magnetometer of a unit.
///
/// Errors: as of tumble_store_load().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_load_magnetometer(
    store: *mut Store,
    identity: u64,
    which: MaybeUninit<Which>,
    record: *mut MagnetometerRecord,
) -> Status {
    let find = |store: &mut RecordStore<Driver>| {
        Ok(match code(which)?.in_core() {
            None => store.magnetometer_in_force(identity),
            Some(which) => store.load_magnetometer(identity, which),
        })
    };
    // SAFETY: the header requires it of all pointers.
    unsafe { load(store, record, find, MagnetometerRecord::of) }
}

/// Puts a record of a magnetometer in force; the one adopted before it stays as the previous one. Everything else is as of
/// tumble_store_save().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_save_magnetometer(
    store: *mut Store,
    now: u64,
    record: *const MagnetometerRecord,
    wait: *mut u64,
) -> Status {
    let save = |store: &mut RecordStore<Driver>, record: &_| store.save_magnetometer(now, record);
    // SAFETY: the header requires it of all pointers.
    unsafe { keep(store, record, wait, MagnetometerRecord::in_store, save) }
}

/// Keeps a record of a magnetometer as the factory's; it is in force until another is saved. Everything else is as of
/// tumble_store_save().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_save_factory_magnetometer(
    store: *mut Store,
    now: u64,
    record: *const MagnetometerRecord,
    wait: *mut u64,
) -> Status {
    let save = |store: &mut RecordStore<Driver>, record: &_| store.save_factory_magnetometer(now, record);
    // SAFETY: the header requires it of all pointers.
    unsafe { keep(store, record, wait, MagnetometerRecord::in_store, save) }
}

/// Puts the previous or the factory's record of a magnetometer in force again; what was in force becomes the previous one.
/// `record` is it then; it may be null, and so may `wait`.
///
/// Errors: as of tumble_store_load() and tumble_store_save().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_store_roll_back_magnetometer(
    store: *mut Store,
    now: u64,
    identity: u64,
    to: MaybeUninit<Which>,
    record: *mut MagnetometerRecord,
    wait: *mut u64,
) -> Status {
    let roll_back = |store: &mut RecordStore<Driver>, to| Ok(store.roll_back_magnetometer(now, identity, to));
    // SAFETY: the header requires it of all pointers.
    unsafe { restore(store, to, record, wait, roll_back, MagnetometerRecord::of) }
}
