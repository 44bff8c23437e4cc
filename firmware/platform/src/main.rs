//! The movable platform on a Cortex-M4F, as QEMU emulates one: plays the mission over the vectors that it reads from
//! the host, and resets itself between the first start and the second.
//!
//! Lines that begin with `device:` are about this device; all others the host says too when it replays the mission.
#![no_std]
#![no_main]

mod console;
mod file;
mod memory;
mod never;
mod proof;
mod stack;

use core::fmt::Write;
use core::mem::size_of;

use cortex_m::peripheral::SCB;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use mission::nor::Nor;
use mission::units::UNITS;
use mission::{Trouble, flight, spin};
use tumble_core::model::Correction;
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::redundancy::platform::Platform;
use tumble_core::redundancy::record::Record;
use tumble_core::spin::machine::SpinMachine;
use tumble_store::flash::RecordStore;

use crate::console::Console;
use crate::memory::Memory;
use crate::stack::Stack;

/// What is done after a start.
enum Next {
    Reset,
    Leave,
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(mut out) = Console::open() else {
        leave(EXIT_FAILURE)
    };
    let lived = match memory::take() {
        Some(memory) => live(memory, &mut out),
        None => leave(EXIT_FAILURE),
    };
    if let Err(trouble) = &lived {
        // Nobody is left to be told if this fails too.
        let _ = say(&mut out, trouble);
    }
    out.flush();
    match lived {
        Ok(Next::Reset) => SCB::sys_reset(),
        Ok(Next::Leave) => leave(EXIT_SUCCESS),
        Err(_) => leave(EXIT_FAILURE),
    }
}

/// From one start to its end: records are in flash, or they are not.
fn live(memory: Memory, out: &mut Console) -> Result<Next, Trouble> {
    let Memory { nor, start, file } = memory;
    writeln!(out, "device: start {start}")?;
    proof::run(start);
    let mut stack = Stack::new();
    let vectors = file::read(c"vectors/redundancy.json", file).ok_or(Trouble::Vectors("file"))?;
    let stored = flight::has_records(vectors, Nor::new(nor))?;
    if !stored && start == 1 {
        flight::first(vectors, Nor::new(nor), &mut stack, out)?;
        stack.tell(out)?;
        writeln!(out, "device: resets itself")?;
        return Ok(Next::Reset);
    }
    flight::second(vectors, Nor::new(nor), &mut stack, out)?;
    let vectors = file::read(c"vectors/spin.json", file).ok_or(Trouble::Vectors("file"))?;
    spin::spin(vectors, &mut stack, out)?;
    stack.tell(out)?;
    sizes(out)?;
    Ok(Next::Leave)
}

/// Memory that callers of each part set aside.
fn sizes(out: &mut Console) -> core::fmt::Result {
    for (what, bytes) in [
        (
            "Monitor of three units, one calibrated at a time",
            size_of::<Monitor<f32, UNITS, 1>>(),
        ),
        (
            "Platform of three units, may lie in flash",
            size_of::<Platform<f32, UNITS>>(),
        ),
        ("SpinMachine", size_of::<SpinMachine<f32>>()),
        (
            "RecordStore, flash driver included",
            size_of::<RecordStore<Nor<'_>>>(),
        ),
        ("Record", size_of::<Record<f32>>()),
        ("Correction of a triad", size_of::<Correction<f32>>()),
    ] {
        writeln!(out, "device: memory {bytes} bytes: {what}")?;
    }
    Ok(())
}

/// Says why the mission cannot go on.
fn say(out: &mut Console, trouble: &Trouble) -> core::fmt::Result {
    let what = match trouble {
        Trouble::Vectors("file") => "QEMU has to be started where vectors/ is",
        Trouble::Vectors(name) => name,
        Trouble::Platform(_) => "the set of units contradicts itself",
        Trouble::Layout(_) => "no records fit into the flash",
        Trouble::Store(_) => "a record was not stored or not read",
        Trouble::Silenced => "nobody listens",
    };
    writeln!(out, "device: cannot go on: {what}")
}

fn leave(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}

#[cortex_m_rt::exception]
#[allow(unsafe_code)]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    leave(EXIT_FAILURE)
}
