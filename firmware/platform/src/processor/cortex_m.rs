//! Cortex-M, with a floating point unit or without.
#![allow(unsafe_code)]

use core::arch::asm;

use ::cortex_m::peripheral::SCB;
use ::cortex_m::register::msp;

use crate::host;

#[cortex_m_rt::entry]
fn start() -> ! {
    crate::live()
}

#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    host::leave(false)
}

/// Starts the device anew.
pub fn reset() -> ! {
    SCB::sys_reset()
}

/// Address of the top of the stack.
#[inline(always)]
pub fn stack_pointer() -> usize {
    msp::read() as usize
}

/// Asks the host to do something, and gives its answer.
///
/// # Safety
/// The argument is of the kind that the operation requires.
pub unsafe fn ask_host(operation: usize, argument: usize) -> usize {
    let answer;
    // SAFETY: stops the processor until the host, who takes and gives what these registers hold, lets it go on.
    unsafe { asm!("bkpt 0xAB", inout("r0") operation => answer, in("r1") argument) };
    answer
}
