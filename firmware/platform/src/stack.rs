//! Measures the stack by painting: what lies below the stack pointer gets a pattern, and what has lost it was used.
#![allow(unsafe_code)]

use core::fmt::Write;
use core::ptr::{addr_of, read_volatile, write_volatile};

use mission::work_meter::{WORK_PARTS, WorkMeter, WorkPart};

use crate::console::Console;
use crate::processor::stack_pointer;

/// Bytes that are painted, from the start of the stack down.
const DEPTH: usize = 64 * 1024;

const PAINT: u32 = 0xA5C3_5A3C;

const WORD: usize = size_of::<u32>();

unsafe extern "C" {
    /// Where the stack starts; it grows down from there.
    static _stack_start: u32;
}

/// Largest use of stack by a part.
#[derive(Clone, Copy, Default)]
struct PartStack {
    bytes: usize,
    /// Address of the function that did it, whose stack can also be bounded from the image.
    function: usize,
}

/// Largest use of stack by each part of the mission.
pub struct Stack {
    most: [PartStack; WORK_PARTS.len()],
    last: PartStack,
    /// By anything at all, from the start of the stack, bytes.
    deepest: usize,
}

impl Stack {
    /// Nothing yet.
    pub fn new() -> Self {
        paint();
        Self {
            most: [PartStack::default(); WORK_PARTS.len()],
            last: PartStack::default(),
            deepest: 0,
        }
    }

    /// Reports the largest use of stack.
    pub fn tell(&mut self, out: &mut Console) -> core::fmt::Result {
        self.look();
        let used = WORK_PARTS.iter().zip(self.most);
        for (part, PartStack { bytes, function }) in used.filter(|(_, most)| most.bytes > 0) {
            writeln!(
                out,
                "device: stack {bytes} bytes: {part:?}, by the function at {function:#x}"
            )?;
        }
        let of = if self.deepest >= DEPTH { "at least " } else { "" };
        writeln!(
            out,
            "device: stack {of}{} bytes: all, states and words included",
            self.deepest
        )
    }

    fn look(&mut self) {
        self.deepest = self.deepest.max(start() - lowest_used());
    }
}

impl WorkMeter for Stack {
    #[inline(never)]
    fn during<R>(&mut self, work: impl FnOnce() -> R) -> R {
        self.look();
        let function = address(&work);
        let before = paint();
        let result = call(work);
        let bytes = before.saturating_sub(lowest_used());
        self.last = PartStack { bytes, function };
        result
    }

    fn was(&mut self, part: WorkPart) {
        for (known, most) in WORK_PARTS.iter().zip(&mut self.most) {
            if *known == part && self.last.bytes > most.bytes {
                *most = self.last;
            }
        }
    }
}

/// In a frame of its own, so that all of it lies below what is painted.
#[inline(never)]
fn call<R, W: FnOnce() -> R>(work: W) -> R {
    work()
}

/// Where the function is that calls this work.
fn address<R, W: FnOnce() -> R>(_: &W) -> usize {
    call::<R, W> as fn(W) -> R as usize
}

/// Address where the stack starts.
fn start() -> usize {
    addr_of!(_stack_start) as usize
}

/// Paints what lies below the stack pointer of the caller; gives that.
#[inline(always)]
fn paint() -> usize {
    let pointer = stack_pointer();
    let mut at = start() - DEPTH;
    while at < pointer {
        // SAFETY: between the end of the stack and its pointer, where nothing lives: there are no interrupts, and this loop
        // calls nothing.
        unsafe { write_volatile(at as *mut u32, PAINT) };
        at += WORD;
    }
    pointer
}

/// The lowest address that lost its paint.
fn lowest_used() -> usize {
    let mut at = start() - DEPTH;
    // SAFETY: addresses of the stack, which is memory throughout.
    while at < start() && unsafe { read_volatile(at as *const u32) } == PAINT {
        at += WORD;
    }
    at
}
