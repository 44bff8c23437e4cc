//! Replays the mission on the host, and compares it with the report of a device.
//!
//!     mission replay VECTORS             prints the report expected of the device
//!     mission compare VECTORS REPORT     prints a device's report, and compares it line by line

mod replay;
mod story;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Why there is no comparison: one line.
struct HostError(String);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match words.as_slice() {
        ["replay", vectors] => replay::replay(Path::new(vectors)).map(|said| {
            print!("{said}");
            ExitCode::SUCCESS
        }),
        ["compare", vectors, said] => compare(Path::new(vectors), &PathBuf::from(said)),
        _ => Err(HostError(
            "usage: mission replay VECTORS, or: mission compare VECTORS REPORT".into(),
        )),
    };
    outcome.unwrap_or_else(|HostError(why)| {
        eprintln!("mission: {why}");
        ExitCode::from(2)
    })
}

/// Prints the report, and fails where the device and the host differ.
fn compare(vectors: &Path, said: &Path) -> Result<ExitCode, HostError> {
    let read = std::fs::read_to_string(said);
    let device = read.map_err(|error| HostError(format!("{}: {error}", said.display())))?;
    let host = replay::replay(vectors)?;
    story::tell(&device);
    let (device, host): (Vec<&str>, Vec<&str>) = (story::shared(&device).collect(), host.lines().collect());
    let longest = device.len().max(host.len());
    let differs = (0..longest).find(|line| device.get(*line) != host.get(*line));
    let Some(line) = differs else {
        let numbers: usize = host.iter().map(|line| line.matches('#').count()).sum();
        println!(
            "Device and host agree in all {longest} lines, {numbers} numbers in them bit for bit, and in the checksums of all outputs."
        );
        return Ok(ExitCode::SUCCESS);
    };
    println!("Device and host differ, first in line {}:", line + 1);
    println!("  device  {}", device.get(line).unwrap_or(&"says nothing more"));
    println!("  host    {}", host.get(line).unwrap_or(&"says nothing more"));
    Ok(ExitCode::FAILURE)
}
