//! Memory that a reset leaves as it was: the flash, and how often the device was started.
#![allow(unsafe_code)]

use core::ptr::{addr_of_mut, read_volatile, write_volatile};
use core::sync::atomic::{AtomicBool, Ordering};

use mission::nor::{BYTES, ERASED};

/// Most bytes of a file of vectors.
pub const FILE: usize = 256 * 1024;

/// All of it.
pub struct Memory {
    /// Contents of the flash.
    pub nor: &'static mut [u8; BYTES],
    /// Number of this start since power came on, from 1.
    pub start: u32,
    /// Room for a file.
    pub file: &'static mut [u8; FILE],
}

/// Number of starts of the device, and a word that is not there when power comes on.
#[repr(C)]
#[derive(Clone, Copy)]
struct Starts {
    known: u32,
    count: u32,
}

const KNOWN: u32 = 0x5475_6d62;

// Places that the linker script sets aside, and nothing else is linked to.
unsafe extern "C" {
    static mut _nor_flash: [u8; BYTES];
    static mut _starts: Starts;
    static mut _file: [u8; FILE];
}

/// Gives it, once.
pub fn take() -> Option<Memory> {
    static TAKEN: AtomicBool = AtomicBool::new(false);
    // Not exchanged in one step, which the smallest processors cannot: there are no threads.
    if TAKEN.load(Ordering::Relaxed) {
        return None;
    }
    TAKEN.store(true, Ordering::Relaxed);
    // SAFETY: the linker script places these in memory of the board, apart from each other and from all else, and the lines above
    // see to it that the references are the only ones. Any bytes are valid in all of them.
    let (nor, starts, file) = unsafe {
        let starts = addr_of_mut!(_starts);
        let before = read_volatile(starts);
        let count = if before.known == KNOWN { before.count } else { 0 };
        let now = Starts {
            known: KNOWN,
            count: count.wrapping_add(1),
        };
        write_volatile(starts, now);
        (
            &mut *addr_of_mut!(_nor_flash),
            now.count,
            &mut *addr_of_mut!(_file),
        )
    };
    if starts == 1 {
        // Chips leave the factory erased.
        nor.fill(ERASED);
    }
    Some(Memory {
        nor,
        start: starts,
        file,
    })
}
