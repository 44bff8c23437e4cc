//! Files of the host.
#![allow(unsafe_code)]

use core::ffi::CStr;

use cortex_m_semihosting::{nr, syscall};

/// Why a file was not read.
#[derive(Clone, Copy)]
pub enum FileError {
    /// The host has none of this name.
    Missing,
    /// The room for it is too small.
    TooLong,
}

/// Reads a whole file.
///
/// # Errors
/// [`FileError`].
pub fn read<'r>(name: &CStr, room: &'r mut [u8]) -> Result<&'r [u8], FileError> {
    let (length, size) = (name.to_bytes().len(), room.len());
    // SAFETY: the name and its length are those of a string; the host only reads it.
    let file = unsafe { syscall!(OPEN, name.as_ptr(), nr::open::R_BINARY, length) };
    if file == usize::MAX {
        return Err(FileError::Missing);
    }
    // SAFETY: the host writes at most `size` bytes, which are there and ours.
    let left = unsafe { syscall!(READ, file, room.as_mut_ptr(), size) };
    // SAFETY: the file is open, and is not used any more.
    unsafe { syscall!(CLOSE, file) };
    // What is full may have been longer.
    let read = size.checked_sub(left).filter(|_| left > 0);
    read.and_then(|read| room.get(..read)).ok_or(FileError::TooLong)
}
