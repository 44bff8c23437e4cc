//! RISC-V of 32 bits, on QEMU's `virt`.
#![allow(unsafe_code)]

use core::arch::{asm, global_asm};
use core::ptr::write_volatile;

use crate::host;

// The host put code, constants and initial values where they belong; what is to be zero, nobody did.
global_asm!(
    ".section .start, \"ax\"",
    ".global _start",
    "_start:",
    ".option push",
    ".option norelax",
    "la gp, __global_pointer$",
    ".option pop",
    "la sp, _stack_start",
    "la t0, {trap}",
    "csrw mtvec, t0",
    "la t0, _zeros_begin",
    "la t1, _zeros_end",
    "1: bgeu t0, t1, 2f",
    "sw zero, 0(t0)",
    "addi t0, t0, 4",
    "j 1b",
    "2: call {live}",
    trap = sym on_trap,
    live = sym live,
);

extern "C" fn live() -> ! {
    crate::live()
}

// The processor aligns the address of the trap handler to four bytes, and takes the lowest bits for the mode.
global_asm!(
    ".balign 4",
    ".global tumble_trap",
    "tumble_trap:",
    "j {failed}",
    failed = sym failed,
);

extern "C" fn failed() -> ! {
    host::leave(false)
}

unsafe extern "C" {
    #[link_name = "tumble_trap"]
    safe fn on_trap() -> !;
}

/// QEMU's register that ends or resets the machine, and the word that resets it.
const TEST: *mut u32 = 0x0010_0000 as *mut u32;
const RESET: u32 = 0x7777;

/// Starts the device anew.
pub fn reset() -> ! {
    loop {
        // SAFETY: a register of the machine, where nothing of ours lies.
        unsafe { write_volatile(TEST, RESET) };
    }
}

/// Address of the top of the stack.
#[inline(always)]
pub fn stack_pointer() -> usize {
    let pointer;
    // SAFETY: reads a register.
    unsafe { asm!("mv {}, sp", out(reg) pointer, options(nomem, nostack, preserves_flags)) };
    pointer
}

/// Asks the host to do something, and gives its answer.
///
/// # Safety
/// The argument is of the kind that the operation requires.
#[inline(never)]
pub unsafe fn ask_host(operation: usize, argument: usize) -> usize {
    let answer;
    // SAFETY: stops the processor until the host, who takes and gives what these registers hold, lets it go on. It knows its
    // call by the two instructions around, uncompressed and in one page, which do nothing.
    unsafe {
        asm!(
            ".balign 16",
            ".option push",
            ".option norvc",
            "slli x0, x0, 0x1f",
            "ebreak",
            "srai x0, x0, 7",
            ".option pop",
            inout("a0") operation => answer,
            in("a1") argument,
        );
    }
    answer
}
