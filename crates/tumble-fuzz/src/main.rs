//! `tumble-fuzz TARGET [--runs N] [--from SEED]` makes N runs, of seeds from SEED on; `--seed SEED` repeats one run, `--input
//! FILE` that of an input which `scripts/fuzz_guided.sh` found. Ends with 1 where anything was found.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use lexopt::prelude::*;

use tumble_fuzz::campaign::{catch_panics, outcome_of, runs};
use tumble_fuzz::draw::FuzzDraw;
use tumble_fuzz::target::FuzzTarget;

const USAGE: &str = "tumble-fuzz TARGET [--runs N] [--from SEED] | [--seed SEED] | [--input FILE]";

/// Arguments of the command.
struct Request {
    target: String,
    runs: u64,
    from: u64,
    /// The one run to be repeated.
    seed: Option<u64>,
    input: Option<PathBuf>,
}

fn request() -> Result<Request, lexopt::Error> {
    let mut asked = Request {
        target: String::new(),
        runs: 10_000_000,
        from: 1,
        seed: None,
        input: None,
    };
    let mut arguments = lexopt::Parser::from_env();
    while let Some(argument) = arguments.next()? {
        match argument {
            Value(target) => asked.target = target.string()?,
            Long("runs") => asked.runs = arguments.value()?.parse()?,
            Long("from") => asked.from = arguments.value()?.parse()?,
            Long("seed") => asked.seed = Some(arguments.value()?.parse()?),
            Long("input") => asked.input = Some(arguments.value()?.into()),
            _ => return Err(argument.unexpected()),
        }
    }
    Ok(asked)
}

/// Runs the target; returns the failures, a line each.
fn found(asked: &Request, target: &FuzzTarget) -> Result<Vec<String>, std::io::Error> {
    catch_panics();
    let run_of = |seed| target.run(FuzzDraw::new(seed));
    Ok(match (&asked.input, asked.seed) {
        (Some(path), _) => {
            let input = fs::read(path)?;
            let outcome = outcome_of(&|_| target.run(FuzzDraw::of_input(&input)), 0);
            let name = path.display();
            outcome
                .err()
                .map(|what| format!("--input {name}: {what}"))
                .into_iter()
                .collect()
        }
        (None, Some(seed)) => {
            let outcome = outcome_of(&run_of, seed);
            outcome
                .err()
                .map(|what| format!("--seed {seed}: {what}"))
                .into_iter()
                .collect()
        }
        (None, None) => runs(&asked.target, asked.from, asked.runs, run_of)
            .into_iter()
            .map(|failure| format!("--seed {}: {}", failure.seed, failure.what))
            .collect(),
    })
}

fn refusal(what: &str) -> ExitCode {
    eprintln!("{what}; {USAGE}");
    ExitCode::from(2)
}

fn main() -> ExitCode {
    let asked = match request() {
        Ok(asked) => asked,
        Err(error) => return refusal(&error.to_string()),
    };
    let Some(target) = FuzzTarget::named(&asked.target) else {
        let known = FuzzTarget::NAMES.join(", ");
        return refusal(&format!("unknown target {:?}; known are {known}", asked.target));
    };
    match found(&asked, &target) {
        Ok(found) => {
            found.iter().for_each(|line| println!("{} {line}", asked.target));
            println!("{}: {} failures", asked.target, found.len());
            ExitCode::from(u8::from(!found.is_empty()))
        }
        Err(error) => refusal(&error.to_string()),
    }
}
