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

/// What each part of the mission used at most, bytes.
pub struct Stack {
    most: [usize; WORK_PARTS.len()],
    last: usize,
    /// By anything at all, from the start of the stack.
    deepest: usize,
}

impl Stack {
    /// Nothing yet.
    pub fn new() -> Self {
        paint();
        Self {
            most: [0; WORK_PARTS.len()],
            last: 0,
            deepest: 0,
        }
    }

    /// Says what was used.
    pub fn tell(&mut self, out: &mut Console) -> core::fmt::Result {
        self.look();
        for (part, most) in WORK_PARTS.iter().zip(self.most).filter(|(_, most)| *most > 0) {
            writeln!(out, "device: stack {most} bytes: {part:?}")?;
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
        let before = paint();
        let result = call(work);
        let lowest = lowest_used();
        self.last = before.saturating_sub(lowest);
        result
    }

    fn was(&mut self, part: WorkPart) {
        for (known, most) in WORK_PARTS.iter().zip(&mut self.most) {
            if *known == part {
                *most = self.last.max(*most);
            }
        }
    }
}

/// In a frame of its own, so that all of it lies below what is painted.
#[inline(never)]
fn call<R>(work: impl FnOnce() -> R) -> R {
    work()
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
