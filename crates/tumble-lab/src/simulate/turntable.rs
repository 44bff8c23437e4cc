//! A whole turntable session: one reference and any number of targets on one structure.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde::Deserialize;

use crate::simulate::scenario::{ScenarioError, check_samples, check_units, not_negative, positive};
use crate::simulate::stream::{StreamPurpose, stream};
use crate::simulate::table::{Table, TableMotion};
use crate::simulate::unit::{Conditions, RotationSetup, UnitRecord, UnitSetup, record};

/// Everything a session is made of.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurntableScenario {
    /// Conditions that all units share.
    pub conditions: Conditions,
    /// The table and where it goes.
    pub table: Table,
    /// The structure that reference and targets share, `case_from_table`.
    pub mounting: RotationSetup,
    /// The unit the others are held against.
    pub reference: UnitSetup,
    /// The units to be calibrated.
    pub targets: Vec<UnitSetup>,
}

/// A session that was simulated.
#[derive(Clone, Debug)]
pub struct SimulatedTurntable {
    /// Mounting of the shared structure.
    pub case_from_table: Rotation3<f64>,
    /// Truth of the motion.
    pub motion: TableMotion,
    /// The reference.
    pub reference: UnitRecord,
    /// The targets, in the order of the scenario.
    pub targets: Vec<UnitRecord>,
}

impl SimulatedTurntable {
    /// Rotation vector of `case_from_table`, rad.
    pub fn mounting(&self) -> Vector3<f64> {
        UnitQuaternion::from_rotation_matrix(&self.case_from_table).scaled_axis()
    }
}

/// Plays a scenario.
///
/// # Errors
/// [`ScenarioError`] where a figure makes no sense.
pub fn simulate(scenario: &TurntableScenario) -> Result<SimulatedTurntable, ScenarioError> {
    check(scenario)?;
    let mut random = stream(scenario.conditions.seed, 0, StreamPurpose::Table);
    let case_from_table = scenario.mounting.rotation(&mut random);
    let motion = TableMotion::new(&scenario.table, case_from_table, &mut random);
    check_samples(motion.duration(), scenario.units())?;
    let units: Vec<&UnitSetup> = scenario.units().collect();
    let mut records: Vec<UnitRecord> = units
        .par_iter()
        .enumerate()
        .map(|(number, unit)| record(&scenario.conditions, &motion, unit, number as u64))
        .collect();
    let targets = records.split_off(1);
    let reference = records.swap_remove(0);
    Ok(SimulatedTurntable {
        case_from_table,
        motion,
        reference,
        targets,
    })
}

impl TurntableScenario {
    fn units(&self) -> impl Iterator<Item = &UnitSetup> + Clone {
        core::iter::once(&self.reference).chain(&self.targets)
    }
}

fn check(scenario: &TurntableScenario) -> Result<(), ScenarioError> {
    let table = &scenario.table;
    if table.poses.is_empty() {
        return Err(ScenarioError::NoPose);
    }
    // Half the digits: a direction read from a file is good enough.
    let is_unit = |up: &Vector3<f64>| (up.norm() - 1.0).abs() < 1e-8;
    if let Some(pose) = table.poses.iter().position(|pose| !is_unit(&pose.up)) {
        return Err(ScenarioError::NoDirection { pose });
    }
    positive("time at rest, s,", table.rest_duration)?;
    positive("rate of the table, rad/s,", table.limits.rate)?;
    positive("acceleration of the table, rad/s^2,", table.limits.acceleration)?;
    positive("gravity, m/s^2,", table.gravity)?;
    positive(
        "time constant of warming, s,",
        scenario.conditions.warming.time_constant,
    )?;
    not_negative("error of the table, rad,", table.error)?;
    check_units(scenario.units())
}

#[cfg(test)]
#[path = "turntable_tests.rs"]
mod tests;
