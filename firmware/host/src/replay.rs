//! The mission as the device plays it, with a reset between the first start and the second.

use std::path::Path;

use mission::nor::{BYTES, ERASED, Nor};
use mission::work_meter::Nobody;
use mission::{MissionError, flight, spin, temperature};

use crate::HostError;

/// Report of the whole mission.
pub fn replay(vectors: &Path) -> Result<String, HostError> {
    let [redundancy, robot] = ["redundancy.json", "spin.json"].map(|name| vectors.join(name));
    let flown = read(&redundancy)?;
    let spun = read(&robot)?;
    let mut said = String::new();
    let of = |path: &Path| {
        let path = path.display().to_string();
        move |why: MissionError| HostError(format!("{path}: {why}"))
    };
    let mut memory = [ERASED; BYTES];
    flight::first(&flown, Nor::new(&mut memory), &mut Nobody, &mut said).map_err(of(&redundancy))?;
    flight::second(&flown, Nor::new(&mut memory), &mut Nobody, &mut said).map_err(of(&redundancy))?;
    flight::interrupted(&flown, Nor::new(&mut memory), &mut Nobody, &mut said).map_err(of(&redundancy))?;
    spin::spin(&spun, &mut Nobody, &mut said).map_err(of(&robot))?;
    temperature::temperature(&mut said).map_err(of(&robot))?;
    Ok(said)
}

fn read(path: &Path) -> Result<Vec<u8>, HostError> {
    std::fs::read(path).map_err(|error| HostError(format!("{}: {error}", path.display())))
}
