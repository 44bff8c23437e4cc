//! Hostile input by the million for all that a device runs. `tumble-fuzz TARGET [--runs N] [--from SEED]` makes N runs,
//! of seeds from SEED on; `--seed SEED` repeats one run. Ends with 1 where anything was found.
//!
//! 1. `draw`: numbers, times and bytes, the worst of them more often than chance would have it.
//! 2. `campaign`: many runs over all processors, and what failed.
//! 3. `record`, `monitor`, `spin`: what is fed to each, and what has to hold.
//!
//! The interface for C is called by a program in C, in `calls/`; `scripts/fuzz_calls.sh` builds and runs it.

mod campaign;
mod draw;
mod mission;
mod monitor;
mod record;
mod settings;
mod spin;

use std::process::ExitCode;

use lexopt::prelude::*;

use crate::campaign::{FailedRun, RunOutcome, catch_panics, outcome_of, runs};

const TARGETS: [&str; 3] = ["record", "monitor", "spin"];

/// What is asked for.
struct Request {
    target: String,
    runs: u64,
    from: u64,
    /// The one run to be repeated.
    seed: Option<u64>,
}

fn request() -> Result<Request, lexopt::Error> {
    let mut asked = Request {
        target: String::new(),
        runs: 10_000_000,
        from: 1,
        seed: None,
    };
    let mut arguments = lexopt::Parser::from_env();
    while let Some(argument) = arguments.next()? {
        match argument {
            Value(target) => asked.target = target.string()?,
            Long("runs") => asked.runs = arguments.value()?.parse()?,
            Long("from") => asked.from = arguments.value()?.parse()?,
            Long("seed") => asked.seed = Some(arguments.value()?.parse()?),
            _ => return Err(argument.unexpected()),
        }
    }
    Ok(asked)
}

fn fuzz(asked: &Request, run: impl Fn(u64) -> RunOutcome + Sync) -> Vec<FailedRun> {
    catch_panics();
    match asked.seed {
        None => runs(&asked.target, asked.from, asked.runs, run),
        Some(seed) => match outcome_of(&run, seed) {
            Ok(()) => Vec::new(),
            Err(what) => vec![FailedRun { seed, what }],
        },
    }
}

fn main() -> ExitCode {
    let asked = match request() {
        Ok(asked) if TARGETS.contains(&asked.target.as_str()) => asked,
        Ok(asked) => {
            let known = TARGETS.join(", ");
            eprintln!("unknown target {:?}; known are {known}", asked.target);
            return ExitCode::from(2);
        }
        Err(error) => {
            eprintln!("{error}; tumble-fuzz TARGET [--runs N] [--from SEED] | [--seed SEED]");
            return ExitCode::from(2);
        }
    };
    let failures = match asked.target.as_str() {
        "record" => fuzz(&asked, record::run),
        "monitor" => {
            let scenes = monitor::MonitorScenes::new();
            fuzz(&asked, |seed| scenes.run(seed))
        }
        _ => {
            let scenes = spin::Scenes::new();
            fuzz(&asked, |seed| scenes.run(seed))
        }
    };
    for FailedRun { seed, what } in &failures {
        println!("{} --seed {seed}: {what}", asked.target);
    }
    println!("{}: {} failures", asked.target, failures.len());
    ExitCode::from(u8::from(!failures.is_empty()))
}
