//! The movable platform on a microcontroller, as QEMU emulates them: plays the mission over the vectors that it reads from
//! the host, and resets itself between the first start and the second.
//!
//! Lines that begin with `device:` are about this device; the host reports all others too when it replays the mission.
#![no_std]
#![no_main]

mod console;
mod file;
mod host;
mod memory;
mod panic_handler;
mod processor;
mod proof;
mod stack;

use core::ffi::CStr;
use core::fmt::Write;
use core::mem::size_of;

use mission::nor::{BYTES, Nor};
use mission::units::UNITS;
use mission::{MissionError, flight, spin, temperature};
use tumble_core::model::Correction;
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::redundancy::platform::Platform;
use tumble_core::spin::machine::SpinMachine;
use tumble_store::flash::RecordStore;

use crate::console::Console;
use crate::file::FileError;
use crate::memory::{FILE, Memory};
use crate::stack::Stack;

/// Action after a start.
enum Next {
    Reset,
    Leave,
}

/// A file of vectors, by its name for the host and for people.
struct File(&'static CStr, &'static str);

const REDUNDANCY: File = File(c"vectors/redundancy.json", "vectors/redundancy.json");
const SPIN: File = File(c"vectors/spin.json", "vectors/spin.json");

/// Why the device cannot go on.
enum Why {
    File(FileError),
    Mission(MissionError),
}

/// That, and the file that was played.
struct PlatformFailure(Why, &'static str);

impl File {
    fn read<'r>(&self, room: &'r mut [u8]) -> Result<&'r [u8], PlatformFailure> {
        file::read(self.0, room).map_err(|why| PlatformFailure(Why::File(why), self.1))
    }

    fn failed(&self) -> impl Fn(MissionError) -> PlatformFailure {
        let name = self.1;
        move |why| PlatformFailure(Why::Mission(why), name)
    }
}

/// All that the device does, once its processor has started.
fn live() -> ! {
    let Some(mut out) = Console::open() else {
        host::leave(false)
    };
    let played = match memory::take() {
        Some(memory) => play(memory, &mut out),
        None => host::leave(false),
    };
    if let Err(failure) = &played {
        // A failure of this write cannot be reported.
        let _ = say(&mut out, failure);
    }
    out.flush();
    match played {
        Ok(Next::Reset) => processor::reset(),
        Ok(Next::Leave) => host::leave(true),
        Err(_) => host::leave(false),
    }
}

/// From one start to its end: records are in flash, or they are not.
fn play(memory: Memory, out: &mut Console) -> Result<Next, PlatformFailure> {
    let Memory { nor, start, file } = memory;
    proof::run(start);
    let mut stack = Stack::new();
    let vectors = REDUNDANCY.read(file)?;
    let next = fly(vectors, nor, start, &mut stack, out).map_err(REDUNDANCY.failed())?;
    if let Next::Leave = next {
        turn(SPIN.read(file)?, &mut stack, out).map_err(SPIN.failed())?;
    }
    Ok(next)
}

/// The first flight, before a reset; or the second, before the device is left.
fn fly(
    vectors: &[u8],
    nor: &mut [u8; BYTES],
    start: u32,
    stack: &mut Stack,
    out: &mut Console,
) -> Result<Next, MissionError> {
    writeln!(out, "device: start {start}")?;
    let stored = flight::has_records(vectors, Nor::new(nor))?;
    if !stored && start == 1 {
        flight::first(vectors, Nor::new(nor), stack, out)?;
        stack.tell(out)?;
        writeln!(out, "device: resets itself")?;
        return Ok(Next::Reset);
    }
    flight::second(vectors, Nor::new(nor), stack, out)?;
    flight::interrupted(vectors, Nor::new(nor), stack, out)?;
    Ok(Next::Leave)
}

/// The spin, and what all of it took.
fn turn(vectors: &[u8], stack: &mut Stack, out: &mut Console) -> Result<(), MissionError> {
    spin::spin(vectors, stack, out)?;
    temperature::temperature(out)?;
    stack.tell(out)?;
    states(out)?;
    Ok(())
}

/// Memory that callers of each part set aside: a monitor of three units that calibrates one at a time, one of two, the same
/// that only watch, its settings (which may lie in flash), a spin, a store with its flash driver, the corrections of both triads of a unit.
fn states(out: &mut Console) -> core::fmt::Result {
    for (what, bytes) in [
        ("Monitor", size_of::<Monitor<f32, UNITS, 1>>()),
        ("MonitorOfTwo", size_of::<Monitor<f32, 2, 1>>()),
        ("Watch", size_of::<Monitor<f32, UNITS, 0>>()),
        ("WatchOfTwo", size_of::<Monitor<f32, 2, 0>>()),
        ("Platform", size_of::<Platform<f32, UNITS>>()),
        ("SpinMachine", size_of::<SpinMachine<f32>>()),
        ("RecordStore", size_of::<RecordStore<Nor<'_>>>()),
        ("Corrections", size_of::<[Correction<f32>; 2]>()),
    ] {
        writeln!(out, "device: state {bytes} bytes: {what}")?;
    }
    Ok(())
}

/// Reports the reason why the mission cannot go on.
fn say(out: &mut Console, PlatformFailure(why, file): &PlatformFailure) -> core::fmt::Result {
    write!(out, "device: cannot go on: {file}: ")?;
    match why {
        Why::File(FileError::Missing) => {
            writeln!(
                out,
                "there is no such file; start QEMU in the folder that holds vectors/"
            )
        }
        Why::File(FileError::TooLong) => {
            writeln!(
                out,
                "longer than {FILE} bytes; make more room in the linker script and memory.rs"
            )
        }
        Why::Mission(why) => writeln!(out, "{why}"),
    }
}
