//! What differs from processor to processor: the start, the reset, the pointer of the stack, and how the host is asked.
//!
//! Each module has the same functions; where memory is, the linker script beside it says: `memory.x`, `riscv.x`.
//! Both define `_stack_start`, from which the stack grows down, and the places of [`crate::memory`].

#[cfg(target_arch = "arm")]
mod cortex_m;
#[cfg(target_arch = "arm")]
pub use cortex_m::{ask_host, reset, stack_pointer};

#[cfg(target_arch = "riscv32")]
mod riscv;
#[cfg(target_arch = "riscv32")]
pub use riscv::{ask_host, reset, stack_pointer};
