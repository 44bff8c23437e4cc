//! Statuses in words.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;

use crate::code::{Code, code};
use crate::status::Status;

/// Returns the meaning of a status in words. The text is constant, in ASCII, and the library's.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_strerror(status: MaybeUninit<Status>) -> *const c_char {
    #[cfg(feature = "reach-a-panic")]
    assert!(code(status).is_ok(), "no status");
    code(status).map_or(c"no status of this library", words).as_ptr()
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Status {
    const COUNT: u32 = Status::TumbleErrorNothingStored as u32 + 1;
}

fn words(status: Status) -> &'static CStr {
    match status {
        Status::TumbleOk => c"it was done",
        Status::TumbleErrorNull => c"a pointer is null",
        Status::TumbleErrorUnaligned => c"a pointer is not aligned as its type asks",
        Status::TumbleErrorSize => c"header and library disagree on a layout, or defaults were not filled in",
        Status::TumbleErrorNotInitialised => c"the storage was not initialised, or was overwritten since",
        Status::TumbleErrorBusy => c"a call that changes the same storage is under way",
        Status::TumbleErrorUnits => c"the library was built for another number of units",
        Status::TumbleErrorNoSuchUnit => c"there is no unit of this number",
        Status::TumbleErrorCode => c"an enumerated value is none of its kind",
        Status::TumbleErrorNotFinite => c"a number is not finite",
        Status::TumbleErrorSetting => c"a setting is out of its range",
        Status::TumbleErrorContradiction => c"settings contradict each other",
        Status::TumbleErrorSingular => c"a matrix has no inverse",
        Status::TumbleErrorLeftHanded => c"the axes of a triad form a left-handed set",
        Status::TumbleErrorPrimary => c"the primary has no axis, or is turned against itself",
        Status::TumbleErrorMounting => c"the matrix of a mounting is no rotation",
        Status::TumbleErrorSameIdentity => c"two units have the same identity",
        Status::TumbleErrorBegun => c"the primary's own calibration is taken before the first sample only",
        Status::TumbleErrorSpin => c"the spin cannot be used; the failure says why",
        Status::TumbleErrorNoRoom => c"the buffer is too small",
        Status::TumbleErrorTooShort => c"fewer bytes than any record has",
        Status::TumbleErrorNotARecord => c"the bytes are no record",
        Status::TumbleErrorCorrupt => c"the record is not as it was written",
        Status::TumbleErrorVersion => c"the record was written by a newer version of this library",
        Status::TumbleErrorPages => {
            c"the range of flash is not an even number of pages, each a multiple of 32 bytes"
        }
        Status::TumbleErrorBounds => c"the range of flash is empty or too far up",
        Status::TumbleErrorTooSmall => c"the range of flash is too small",
        Status::TumbleErrorNoDriver => c"a callback of the flash is missing",
        Status::TumbleErrorFlash => c"the driver of the flash reported errors",
        Status::TumbleErrorNotAsWritten => c"the flash is worn",
        Status::TumbleErrorTooSoon => c"flash would wear out; try again later",
        Status::TumbleErrorFull => c"too many units for the range of flash",
        Status::TumbleErrorNothingStored => c"there is no such record",
    }
}
