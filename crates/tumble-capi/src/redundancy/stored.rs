//! Records that a redundant set takes from a store.

use core::ffi::c_void;

use tumble_core::redundancy::platform::PrimaryCalibration;
use tumble_core::redundancy::record::Storage as CoreStorage;
use tumble_core::redundancy::sensor::SENSORS;
use tumble_store::flash::{RecordStore, StoreError};

use crate::flash::DriverError;
use crate::pointer::change;
use crate::redundancy::event::{Listener, OnEvent};
use crate::redundancy::{Redundancy, Watched};
use crate::status::{Status, StatusResult, status};
use crate::store::{Store, error_of};

/// Takes all records in force from a store, as after a reset: those of the secondaries, and those of the primary as its own
/// calibration unless tumble_redundancy_init() was given one. `on_event` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, of the monitor or the store; the first
/// of tumble_store_load(), or ::TUMBLE_ERROR_BEGUN of a record of the primary, and the other records were taken all the
/// same. That nothing is stored is no error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_restore_from(
    redundancy: *mut Redundancy,
    store: *mut Store,
    on_event: OnEvent,
    context: *mut c_void,
) -> Status {
    let listener = Listener { on_event, context };
    let work = |watched: &mut Watched| {
        let restore = |store: &mut _| {
            let mut now = RecordStore::at(store, 0, None);
            let primary = watched.calibrate_primary_from(&mut now, &listener);
            let Watched { platform, monitor } = watched;
            let secondaries = monitor
                .restore_from(platform, &mut now, &mut |event| listener.tell(&event))
                .map_err(|error| error_of(&error));
            primary.and(secondaries)
        };
        // SAFETY: the header requires it of all pointers.
        unsafe { change(store, restore) }
    };
    // SAFETY: the same.
    status(unsafe { change(redundancy, work) })
}

impl Watched {
    /// Takes what is stored of the primary, unless a calibration was given.
    fn calibrate_primary_from<S: CoreStorage<f32, Error = StoreError<DriverError>>>(
        &mut self,
        store: &mut S,
        listener: &Listener,
    ) -> StatusResult {
        if *self.platform.calibration() != PrimaryCalibration::none() {
            return Ok(());
        }
        let mut outcome = Ok(());
        for sensor in SENSORS {
            let taken = match store.load(self.primary(), sensor) {
                Ok(Some(record)) => self.calibrate_primary(&record, listener),
                Ok(None) => Ok(()),
                Err(error) => Err(error_of(&error)),
            };
            outcome = outcome.and(taken);
        }
        outcome
    }
}
