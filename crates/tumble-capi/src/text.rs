//! Statuses and contradictions in words.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;

use tumble_core::redundancy::settings::validate::{InvalidSetting, SettingError};

use crate::code::{Code, code};
use crate::pointer::look;
use crate::redundancy::RedundancySettings;
use crate::status::{Status, status};

/// Says in words what a status means. The text is constant, in ASCII, and the library's.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_strerror(status: MaybeUninit<Status>) -> *const c_char {
    #[cfg(feature = "reach-a-panic")]
    assert!(code(status).is_ok(), "no status");
    code(status).map_or(c"no status of this library", words).as_ptr()
}

/// Looks for settings that contradict each other, or themselves, and says in words which: in the `size` bytes at `text`,
/// which are the caller's, ending in a zero byte and cut off where there is no room. Where there is nothing to be said, they
/// begin with that zero byte, also after ::TUMBLE_OK. `text` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_CONTRADICTION.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_check(
    settings: *const RedundancySettings,
    text: *mut c_char,
    size: usize,
) -> Status {
    // SAFETY: as the header asks of all pointers.
    let settings = unsafe { look(settings) };
    let mut text = Text {
        // Where nobody wants words there is no room for any.
        room: if text.is_null() { 0 } else { size },
        next: text,
    };
    text.end();
    status((|| {
        let contradiction = settings?.in_core()?.validate();
        contradiction.map_err(|found| {
            text.invalid_setting(&found);
            Status::TumbleErrorContradiction
        })
    })())
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
        Status::TumbleErrorSize => c"header and library disagree on the size of the storage",
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
        Status::TumbleErrorPrimary => c"the primary lacks an axis, or is turned against itself",
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
        Status::TumbleErrorFlash => c"the driver of the flash reported an error",
        Status::TumbleErrorNotAsWritten => c"the flash is worn, or was not erased",
        Status::TumbleErrorTooSoon => c"flash would wear out; try again later",
        Status::TumbleErrorFull => c"too many units for the range of flash",
        Status::TumbleErrorNothingStored => c"there is no such record",
    }
}

/// Room of the caller's for words.
struct Text {
    next: *mut c_char,
    room: usize,
}

impl Text {
    fn invalid_setting(&mut self, found: &InvalidSetting) {
        self.put(found.setting);
        match found.error {
            SettingError::NotPositive => self.put(" has to be a number above 0"),
            SettingError::NotAShare => self.put(" has to be a share, from 0 up to below 1"),
            SettingError::AlwaysExceeded => self.put(" would always be exceeded"),
            SettingError::NoLastError => self.put(" refers to a last error that there is none of"),
            SettingError::ShorterThan(other) => self.than(" has to be longer than ", other),
            SettingError::SmallerThan(other) => self.than(" has to be larger than ", other),
            SettingError::MoreThanFit(other) => self.than(": not that many windows fit into ", other),
            SettingError::TooLong(_) => self.put(" is longer than time is kept count of"),
            SettingError::NotAPartOfASecond => self.put(" has to divide a second"),
        }
    }

    fn than(&mut self, words: &str, other: &str) {
        self.put(words);
        self.put(other);
    }

    fn put(&mut self, words: &str) {
        for byte in words.bytes() {
            if self.room < 2 {
                break;
            }
            // SAFETY: there is room for this byte and for the zero that ends the text.
            unsafe {
                self.next.write(byte.cast_signed() as c_char);
                self.next = self.next.add(1);
            }
            self.room -= 1;
        }
        self.end();
    }

    fn end(&mut self) {
        if self.room > 0 {
            // SAFETY: there is room for it.
            unsafe { self.next.write(0) };
        }
    }
}
