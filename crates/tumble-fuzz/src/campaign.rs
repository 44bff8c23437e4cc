//! Many runs over all processors, each from its own seed.

use std::cell::Cell;
use std::io::{self, IsTerminal, Write as _};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Runs that a thread takes at once.
const CHUNK: u64 = 512;

/// Failures after which no more runs are begun.
const MOST_FAILURES: usize = 20;

/// One run: what is wrong, in a line.
pub type RunOutcome = Result<(), String>;

/// A run that failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FailedRun {
    /// All of the run follows from it.
    pub seed: u64,
    /// Description of the failure.
    pub what: String,
}

thread_local! {
    static PANIC: Cell<String> = const { Cell::new(String::new()) };
}

/// Keeps messages of panics for [`outcome_of`], instead of printing them.
pub fn catch_panics() {
    panic::set_hook(Box::new(|information| {
        PANIC.set(information.to_string().replace('\n', " "));
    }));
}

/// Makes one run; a panic is one of the things that may be wrong.
pub fn outcome_of(run: &impl Fn(u64) -> RunOutcome, seed: u64) -> RunOutcome {
    panic::catch_unwind(AssertUnwindSafe(|| run(seed))).unwrap_or_else(|_| Err(PANIC.take()))
}

/// Makes runs of seeds from `first` on; gives those that failed, by seed. Progress goes to standard error.
pub fn runs(name: &str, first: u64, count: u64, run: impl Fn(u64) -> RunOutcome + Sync) -> Vec<FailedRun> {
    let began = Instant::now();
    let (begun, done) = (AtomicU64::new(0), AtomicU64::new(0));
    let failures = Mutex::new(Vec::new());
    let failed = || {
        failures
            .lock()
            .expect("no thread panics while it holds this")
            .len()
    };
    let work = || {
        loop {
            let from = begun.fetch_add(CHUNK, Ordering::Relaxed);
            if from >= count || failed() >= MOST_FAILURES {
                return;
            }
            let to = count.min(from + CHUNK);
            for seed in (from..to).map(|run| first.wrapping_add(run)) {
                if let Err(what) = outcome_of(&run, seed) {
                    eprintln!("\r{name}: seed {seed}: {what}");
                    failures
                        .lock()
                        .expect("no thread panics while it holds this")
                        .push(FailedRun { seed, what });
                }
            }
            done.fetch_add(to - from, Ordering::Relaxed);
        }
    };
    thread::scope(|scope| {
        let threads = thread::available_parallelism().map_or(1, usize::from);
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        while !workers.iter().all(thread::ScopedJoinHandle::is_finished) {
            thread::sleep(Duration::from_millis(200));
            // In a log it would be a line for each look.
            if io::stderr().is_terminal() {
                progress(name, done.load(Ordering::Relaxed), count, began);
            }
        }
    });
    progress(name, done.into_inner(), count, began);
    eprintln!();
    let mut failures = failures.into_inner().expect("all threads have ended");
    failures.sort_by_key(|failure| failure.seed);
    failures
}

#[allow(clippy::cast_precision_loss)]
fn progress(name: &str, done: u64, count: u64, began: Instant) {
    let rate = done as f64 / began.elapsed().as_secs_f64();
    eprint!("\r{name}: {done} of {count} runs, {rate:.0} a second ");
    // A line that is not shown does no harm.
    let _ = io::stderr().flush();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_seed_runs_once_and_failures_and_panics_name_their_seed() {
        catch_panics();
        let seen = Mutex::new(Vec::new());
        let found = runs("test", 7, 2000, |seed| {
            seen.lock().unwrap().push(seed);
            assert!(seed != 1000, "here");
            if seed == 11 { Err("odd".to_owned()) } else { Ok(()) }
        });
        let mut seen = seen.into_inner().unwrap();
        seen.sort_unstable();
        assert_eq!(seen, (7..2007).collect::<Vec<_>>());
        let seeds: Vec<_> = found.iter().map(|failure| failure.seed).collect();
        assert_eq!(seeds, [11, 1000]);
        assert_eq!(found[0].what, "odd");
        assert!(found[1].what.contains("here"), "{}", found[1].what);
    }
}
