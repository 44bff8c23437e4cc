//! Counts instructions while it plays the mission: QEMU, asked to by `-icount shift=N`, lets 2^N nanoseconds pass with
//! each, and the timer of the processor counts 25 MHz of that time. The printed times are nanoseconds.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::hint::black_box;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};
use footprint::{apply, corrections, dense, sample, save_into_a_full_bank};
use mission::nor::{BYTES, ERASED, Nor};
use mission::work_meter::{WorkMeter, WorkPart};
use mission::{MissionError, flight, spin};

static REDUNDANCY: &[u8] = include_bytes!("../../../../vectors/redundancy.json");
static SPIN: &[u8] = include_bytes!("../../../../vectors/spin.json");

/// While the timer counts one.
const NANOSECONDS: u64 = 40;

/// The timer counts down from here.
const RANGE: u32 = 0x00FF_FFFF;

/// Times that what is short is repeated.
const REPEATED: u32 = 10_000;

/// Counts instructions of each part, and reports them at once.
struct Counter {
    timer: SYST,
    out: HostStream,
    /// Last count of the timer; `None` if it came to its end meanwhile.
    last: Option<u32>,
    /// Suffix of the name of each part.
    suffix: &'static str,
}

impl WorkMeter for Counter {
    fn during<R>(&mut self, work: impl FnOnce() -> R) -> R {
        // It starts anew from the top.
        self.timer.clear_current();
        let before = SYST::get_current();
        let result = work();
        let after = SYST::get_current();
        self.last = (!self.timer.has_wrapped()).then(|| before.wrapping_sub(after) & RANGE);
        result
    }

    fn was(&mut self, part: WorkPart) {
        // Write errors are ignored here; the end of the mission reports them.
        let suffix = self.suffix;
        let _ = self.tell(format_args!("{part:?}{suffix}"), 1);
    }
}

impl Counter {
    fn new(mut timer: SYST, out: HostStream) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RANGE);
        timer.enable_counter();
        Self {
            timer,
            out,
            last: None,
            suffix: "",
        }
    }

    fn tell(&mut self, what: core::fmt::Arguments<'_>, times: u32) -> core::fmt::Result {
        match self.last {
            Some(counted) => writeln!(self.out, "{what} {times} {}", u64::from(counted) * NANOSECONDS),
            None => writeln!(self.out, "{what} {times} longer"),
        }
    }
}

/// The mission's own report is discarded here.
struct Silence;

impl Write for Silence {
    fn write_str(&mut self, _: &str) -> core::fmt::Result {
        Ok(())
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let counted = match (cortex_m::Peripherals::take(), hio::hstdout()) {
        (Some(peripherals), Ok(out)) => count(Counter::new(peripherals.SYST, out)).is_ok(),
        _ => false,
    };
    loop {
        debug::exit(if counted { EXIT_SUCCESS } else { EXIT_FAILURE });
    }
}

/// Reports the operations, line by line: their number, and the nanoseconds that they took.
fn count(mut counter: Counter) -> Result<(), MissionError> {
    // A loop of two instructions verifies the rate of the timer.
    counter.during(|| cortex_m::asm::delay(black_box(2 * REPEATED)));
    counter.tell(format_args!("check"), REPEATED)?;
    let (corrections, sample) = (corrections(), sample());
    counter.during(|| {
        for _ in 0..REPEATED {
            black_box(apply(black_box(&corrections), black_box(&sample)));
        }
    });
    counter.tell(format_args!("Apply"), REPEATED)?;
    let mut chip = [ERASED; BYTES];
    flight::first(REDUNDANCY, Nor::new(&mut chip), &mut counter, &mut Silence)?;
    flight::second(REDUNDANCY, Nor::new(&mut chip), &mut counter, &mut Silence)?;
    spin::spin(SPIN, &mut counter, &mut Silence)?;
    save_into_a_full_bank(&mut chip, &mut counter)?;
    counter.tell(format_args!("SaveIntoAFullBank"), 1)?;
    counter.suffix = "Dense";
    dense::fly(REDUNDANCY, &mut counter)
}
