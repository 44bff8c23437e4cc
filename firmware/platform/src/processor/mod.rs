//! Parts that differ from processor to processor: the start, the reset, the stack pointer, and the request to the host.
//!
//! Each module has the same functions; the linker script beside it places memory: `memory.x`, `riscv.x`. Both define
//! `_stack_start`, from which the stack grows down, and the places of [`crate::memory`].

#[cfg(target_arch = "arm")]
mod cortex_m;
#[cfg(target_arch = "arm")]
pub use cortex_m::{ask_host, reset, stack_pointer};

#[cfg(target_arch = "riscv32")]
mod riscv;
#[cfg(target_arch = "riscv32")]
pub use riscv::{ask_host, reset, stack_pointer};
