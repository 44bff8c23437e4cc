//! Services of the host for the device that it debugs: semihosting, which Arm wrote down and RISC-V took over.
#![allow(unsafe_code)]

use core::ffi::CStr;

use crate::processor::ask_host;

/// Numbers of the operations.
const OPEN: usize = 0x01;
const CLOSE: usize = 0x02;
const WRITE: usize = 0x05;
const READ: usize = 0x06;
const LEAVE: usize = 0x18;

/// Reasons to leave: the program came to its end, or an error within it.
const ENDED: usize = 0x20026;
const FAILED: usize = 0x20023;

/// Modes in which a file is opened.
#[derive(Clone, Copy)]
pub enum Mode {
    /// To read bytes.
    Read = 1,
    /// To write text anew.
    Write = 4,
}

/// A file of the host that is open.
pub struct HostFile(usize);

impl HostFile {
    /// Opens it; `None` where there is none.
    pub fn open(name: &CStr, mode: Mode) -> Option<Self> {
        let block = [name.as_ptr() as usize, mode as usize, name.to_bytes().len()];
        // SAFETY: the name and its length are those of a string; the host only reads it.
        let file = unsafe { ask_host(OPEN, block.as_ptr() as usize) };
        (file != usize::MAX).then_some(Self(file))
    }

    /// Reads from where it is; gives how many bytes of the room are left.
    pub fn read(&self, room: &mut [u8]) -> usize {
        let block = [self.0, room.as_mut_ptr() as usize, room.len()];
        // SAFETY: the host writes at most as many bytes, which are there and ours.
        unsafe { ask_host(READ, block.as_ptr() as usize) }
    }

    /// Writes; an error of the host cannot be reported to it.
    pub fn write(&self, bytes: &[u8]) {
        let block = [self.0, bytes.as_ptr() as usize, bytes.len()];
        // SAFETY: the host reads as many bytes, which are there.
        unsafe { ask_host(WRITE, block.as_ptr() as usize) };
    }

    /// Closes it.
    pub fn close(self) {
        let block = [self.0];
        // SAFETY: the file is open, and is not used any more.
        unsafe { ask_host(CLOSE, block.as_ptr() as usize) };
    }
}

/// Ends the program, well or not.
pub fn leave(well: bool) -> ! {
    let reason = if well { ENDED } else { FAILED };
    loop {
        // SAFETY: the argument is a number.
        unsafe { ask_host(LEAVE, reason) };
    }
}
