//! Files of the host.
#![allow(unsafe_code)]

use core::ffi::CStr;

use cortex_m_semihosting::{nr, syscall};

/// Reads a whole file; `None` where the host has none of this name, or `room` is too small.
pub fn read<'r>(name: &CStr, room: &'r mut [u8]) -> Option<&'r [u8]> {
    let (length, size) = (name.to_bytes().len(), room.len());
    // SAFETY: the name and its length are those of a string; the host only reads it.
    let file = unsafe { syscall!(OPEN, name.as_ptr(), nr::open::R_BINARY, length) };
    if file == usize::MAX {
        return None;
    }
    // SAFETY: the host writes at most `size` bytes, which are there and ours.
    let left = unsafe { syscall!(READ, file, room.as_mut_ptr(), size) };
    // SAFETY: the file is open, and is not used any more.
    unsafe { syscall!(CLOSE, file) };
    // What is full may have been longer.
    let read = size.checked_sub(left).filter(|_| left > 0)?;
    room.get(..read)
}
