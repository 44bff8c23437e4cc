//! Files of the host.

use core::ffi::CStr;

use crate::host::{HostFile, Mode};

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
    let file = HostFile::open(name, Mode::Read).ok_or(FileError::Missing)?;
    let left = file.read(room);
    file.close();
    // A full buffer may hold only the start of a longer file.
    let read = room.len().checked_sub(left).filter(|_| left > 0);
    read.and_then(|read| room.get(..read)).ok_or(FileError::TooLong)
}
