//! Chooses the mutant that a process runs: `scripts/mutants.py` puts this into a copy of the core.

use core::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::io::Write;

const UNREAD: usize = usize::MAX;
const NONE: usize = usize::MAX - 1;
const NOTING: usize = usize::MAX - 2;

static CHOSEN: AtomicUsize = AtomicUsize::new(UNREAD);
static REACHED: [AtomicBool; 4096] = [const { AtomicBool::new(false) }; 4096];

/// True where the process runs the mutant of this number.
#[inline]
pub fn is_active(mutant: usize) -> bool {
    match CHOSEN.load(Relaxed) {
        UNREAD => {
            CHOSEN.store(chosen(), Relaxed);
            is_active(mutant)
        }
        NOTING => note(mutant),
        chosen => chosen == mutant,
    }
}

/// The number in the environment, if any.
#[cold]
fn chosen() -> usize {
    if std::env::var_os("TUMBLE_MUTANTS_REACHED").is_some() {
        return NOTING;
    }
    std::env::var("TUMBLE_MUTANT").map_or(NONE, |number| number.parse().expect("a number"))
}

/// Makes a process note again which mutants it reaches from here on.
pub fn forget() {
    for each in &REACHED {
        each.store(false, Relaxed);
    }
}

/// Adds a mutant to the file of those whose function was entered.
#[cold]
fn note(mutant: usize) -> bool {
    if !REACHED[mutant].load(Relaxed) && !REACHED[mutant].swap(true, Relaxed) {
        let path = std::env::var_os("TUMBLE_MUTANTS_REACHED").expect("a path");
        let file = std::fs::File::options().append(true).create(true).open(path);
        std::writeln!(file.expect("a file"), "{mutant}").expect("space");
    }
    false
}
