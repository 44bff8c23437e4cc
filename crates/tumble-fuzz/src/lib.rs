//! Hostile input for all that a device runs, by seeds or by bytes that something chooses that sees which code they reach.
//!
//! 1. [`draw`]: numbers, times and bytes, the worst of them more often than chance would have it.
//! 2. [`target`]: code that is fed with them; `record`, `monitor` and `spin` state what has to hold.
//! 3. [`campaign`]: many runs over all processors, and what failed.
//!
//! The interface for C is called by a program in C, in `calls/`; `scripts/fuzz_calls.sh` builds and runs it.

pub mod campaign;
pub mod draw;
mod mission;
mod monitor;
mod record;
mod settings;
mod spin;
pub mod target;
