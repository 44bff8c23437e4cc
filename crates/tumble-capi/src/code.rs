//! Enumerated values that come from C, where they may be any number.

use core::mem::MaybeUninit;

use crate::status::{Status, StatusResult};

/// An enumeration that C passes as a number of 32 bits.
///
/// # Safety
/// The type has `repr(u32)`, and its variants have the numbers from 0 to below `COUNT`.
pub unsafe trait Code: Copy {
    /// How many variants there are.
    const COUNT: u32;
}

/// What C means by a value.
pub fn code<E: Code>(given: MaybeUninit<E>) -> StatusResult<E> {
    const { assert!(size_of::<E>() == 4) };
    // SAFETY: of all 32 bit patterns, each is a u32.
    let number = unsafe { given.as_ptr().cast::<u32>().read() };
    if number < E::COUNT {
        // SAFETY: the number is that of a variant, as the trait says.
        Ok(unsafe { given.assume_init() })
    } else {
        Err(Status::TumbleErrorCode)
    }
}

/// What C means by a `bool`: anything but zero is true.
pub fn truth(given: MaybeUninit<bool>) -> bool {
    // SAFETY: a bool is one byte, and each pattern of it is a u8.
    unsafe { given.as_ptr().cast::<u8>().read() != 0 }
}

/// A figure of which zero says that there is none.
pub fn unless_zero<N: Default + PartialEq>(figure: N) -> Option<N> {
    (figure != N::default()).then_some(figure)
}
