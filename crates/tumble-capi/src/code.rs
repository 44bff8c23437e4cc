//! Enumerated values that come from C, where they may be any number.

use core::mem::MaybeUninit;

use crate::status::{Status, StatusResult};

/// An enumeration that C passes as a number of 32 bits.
///
/// # Safety
/// The type has `repr(u32)`, and its variants have the numbers from 0 to below `COUNT`.
pub unsafe trait Code: Copy {
    /// Number of variants.
    const COUNT: u32;
}

/// Checks an enumeration value given by C.
pub fn code<E: Code>(given: MaybeUninit<E>) -> StatusResult<E> {
    const { assert!(size_of::<E>() == 4) };
    // SAFETY: of all 32 bit patterns, each is a u32.
    let number = unsafe { given.as_ptr().cast::<u32>().read() };
    if number < E::COUNT {
        // SAFETY: the number is that of a variant, by the contract of the trait.
        Ok(unsafe { given.assume_init() })
    } else {
        Err(Status::TumbleErrorCode)
    }
}

/// Interprets a `bool` given by C: anything but zero is true.
pub fn truth(given: MaybeUninit<bool>) -> bool {
    // SAFETY: a bool is one byte, and each pattern of it is a u8.
    unsafe { given.as_ptr().cast::<u8>().read() != 0 }
}

/// Returns a figure, or `None` for zero, which stands for no figure.
pub fn unless_zero<N: Default + PartialEq>(figure: N) -> Option<N> {
    (figure != N::default()).then_some(figure)
}
