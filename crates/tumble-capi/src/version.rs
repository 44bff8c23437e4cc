//! Version of the library, and of the layout of what it shares with its caller.

use core::ffi::c_char;
use core::mem::size_of;

use crate::status::{Status, StatusResult};

/// Version of the layout of all types here, and of the meaning of their fields. A library of another is refused: by all
/// calls that are given a size, with ::TUMBLE_ERROR_SIZE.
pub const TUMBLE_ABI: u32 = 1;

const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");

/// Returns the version of the library, to be compared with #TUMBLE_VERSION of the header. The text is constant, in ASCII,
/// and the library's.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_version() -> *const c_char {
    VERSION.as_ptr().cast()
}

/// Returns the version of the layout of the library's types, to be compared with #TUMBLE_ABI of the header.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_abi() -> u32 {
    TUMBLE_ABI
}

/// Size of a type that is shared, as it states it itself.
pub const fn size<T>() -> u32 {
    // No such type has as many bytes.
    size_of::<T>() as u32
}

/// Checks that a caller has a type in the layout of this library.
pub fn check<T>(size: usize, version: u32) -> StatusResult {
    if size == size_of::<T>() && version == TUMBLE_ABI {
        Ok(())
    } else {
        Err(Status::TumbleErrorSize)
    }
}
