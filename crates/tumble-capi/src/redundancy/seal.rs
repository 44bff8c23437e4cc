//! Settings that were checked on another machine: a device needs no code for that.

use core::mem::offset_of;
use core::slice;

use tumble_store::checksum::checksum;

use crate::model::Calibration;
#[cfg(feature = "settings_check")]
use crate::pointer::{Place, answer, look};
use crate::redundancy::settings::RedundancySettings;
use crate::redundancy::unit::Unit;
use crate::redundancy::{Redundancy, init};
use crate::status::{Status, status};

/// Checks settings as tumble_redundancy_check() does, and returns the seal with which tumble_redundancy_init_sealed() accepts
/// the same settings. Call it on a host, and give both to the device as constants.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_CONTRADICTION.
#[cfg(feature = "settings_check")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_seal(
    settings: *const RedundancySettings,
    seal: *mut u32,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, settings) = unsafe { (Place::at(seal), look(settings)) };
    let seal = settings.and_then(|settings| {
        let checked = settings.in_core()?.validate();
        checked.map_err(|_| Status::TumbleErrorContradiction)?;
        Ok(sealed(settings))
    });
    answer(place, seal)
}

/// Makes storage a monitor as tumble_redundancy_init() does, with settings that tumble_redundancy_seal() has checked: they are
/// refused as ::TUMBLE_ERROR_CONTRADICTION where `seal` is not theirs. A library without the check of settings has this
/// call alone.
///
/// Errors: those of tumble_redundancy_init().
///
/// cbindgen:ptrs-as-arrays=[[units; ]]
#[allow(rustdoc::broken_intra_doc_links)] // The line above is for cbindgen.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_init_sealed(
    redundancy: *mut Redundancy,
    size: usize,
    settings: *const RedundancySettings,
    seal: u32,
    calibration: *const Calibration,
    units: *const Unit,
    count: usize,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    status(unsafe { init(redundancy, size, settings, Some(seal), calibration, units, count) })
}

/// Seal of settings: the CRC-32 of their bytes, without those behind the last.
pub(super) fn sealed(settings: &RedundancySettings) -> u32 {
    let bytes = offset_of!(RedundancySettings, calibrated_only) + size_of_val(&settings.calibrated_only);
    // SAFETY: the largest fields come first, so that nothing lies between them, and the caller has written all.
    let bytes = unsafe { slice::from_raw_parts((&raw const *settings).cast::<u8>(), bytes) };
    checksum(0, bytes)
}
