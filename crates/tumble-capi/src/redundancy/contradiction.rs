//! Settings that contradict each other, in words.

use core::ffi::c_char;

use tumble_core::redundancy::settings::validate::{InvalidSetting, SettingError};

use crate::pointer::look;
use crate::redundancy::settings::RedundancySettings;
use crate::status::{Status, status};

/// Checks settings for contradictions, with each other or in themselves, and describes the first in words: in the
/// `size` bytes at `text`, which the caller owns, ending in a zero byte and cut off where there is no room. Without a
/// contradiction they begin with that zero byte, also after ::TUMBLE_OK. `text` may be null.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_CONTRADICTION.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_redundancy_check(
    settings: *const RedundancySettings,
    text: *mut c_char,
    size: usize,
) -> Status {
    // SAFETY: the header requires it of all pointers.
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
