//! Counts instructions while it plays the mission: QEMU, asked to by `-icount shift=N`, lets 2^N nanoseconds pass with
//! each, and the timer of the processor counts 25 MHz of that time. What is printed are nanoseconds.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::hint::black_box;
use core::mem::size_of;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};
use footprint::{UNITS, apply, corrections, sample};
use mission::nor::{BYTES, ERASED, Nor};
use mission::watch::{Phase, Watch};
use mission::{Trouble, flight, spin};
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::redundancy::platform::Platform;
use tumble_core::spin::machine::SpinMachine;
use tumble_store::flash::RecordStore;

static REDUNDANCY: &[u8] = include_bytes!("../../../../vectors/redundancy.json");
static SPIN: &[u8] = include_bytes!("../../../../vectors/spin.json");

/// While the timer counts one.
const NANOSECONDS: u64 = 40;

/// The timer counts down from here, and around.
const RANGE: u32 = 0x00FF_FFFF;

/// Times that what is short is repeated.
const REPEATED: u32 = 10_000;

/// Counts instructions of each part, and says so at once.
struct Counter {
    out: HostStream,
    last: u32,
}

impl Watch for Counter {
    fn during<R>(&mut self, work: impl FnOnce() -> R) -> R {
        let before = SYST::get_current();
        let result = work();
        self.last = before.wrapping_sub(SYST::get_current()) & RANGE;
        result
    }

    fn was(&mut self, phase: Phase) {
        // Where nobody listens, the end of the mission says so.
        let _ = writeln!(self.out, "{phase:?} 1 {}", u64::from(self.last) * NANOSECONDS);
    }
}

/// What the mission has to say is not of interest here.
struct Silence;

impl Write for Silence {
    fn write_str(&mut self, _: &str) -> core::fmt::Result {
        Ok(())
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let counted = match (cortex_m::Peripherals::take(), hio::hstdout()) {
        (Some(peripherals), Ok(out)) => count(peripherals.SYST, out).is_ok(),
        _ => false,
    };
    loop {
        debug::exit(if counted { EXIT_SUCCESS } else { EXIT_FAILURE });
    }
}

/// Says, line by line, what was done, how many times, and the nanoseconds that took; then bytes of states.
fn count(mut timer: SYST, out: HostStream) -> Result<(), Trouble> {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(RANGE);
    timer.clear_current();
    timer.enable_counter();
    let mut counter = Counter { out, last: 0 };
    // A loop of two instructions shows whether the timer counts what it is said to.
    counter.during(|| cortex_m::asm::delay(black_box(2 * REPEATED)));
    counter.tell("check", REPEATED)?;
    let (corrections, sample) = (corrections(), sample());
    counter.during(|| {
        for _ in 0..REPEATED {
            black_box(apply(&corrections, black_box(&sample)));
        }
    });
    counter.tell("Apply", REPEATED)?;
    let mut chip = [ERASED; BYTES];
    flight::first(REDUNDANCY, Nor::new(&mut chip), &mut counter, &mut Silence)?;
    flight::second(REDUNDANCY, Nor::new(&mut chip), &mut counter, &mut Silence)?;
    spin::spin(SPIN, &mut counter, &mut Silence)?;
    for (what, bytes) in [
        ("Monitor", size_of::<Monitor<f32, UNITS, 1>>()),
        ("Platform", size_of::<Platform<f32, UNITS>>()),
        ("SpinMachine", size_of::<SpinMachine<f32>>()),
        ("RecordStore", size_of::<RecordStore<Nor<'_>>>()),
        ("Corrections", size_of_val(&corrections)),
    ] {
        writeln!(counter.out, "bytes {what} {bytes}")?;
    }
    Ok(())
}

impl Counter {
    fn tell(&mut self, what: &str, times: u32) -> core::fmt::Result {
        writeln!(self.out, "{what} {times} {}", u64::from(self.last) * NANOSECONDS)
    }
}
