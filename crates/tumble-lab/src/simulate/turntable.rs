//! A whole turntable session: one reference and any number of targets on one structure.

use core::fmt;

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::simulate::fault::Fault;
use crate::simulate::motion::{Motion, Table};
use crate::simulate::stream::{Purpose, stream};
use crate::simulate::unit::{ClockSetup, Conditions, Mounting, Unit, UnitRecord, record};

/// Everything a session is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// What is the same for all units.
    pub conditions: Conditions,
    /// The table and where it goes.
    pub table: Table,
    /// The structure that reference and targets share, `case_from_table`.
    pub mounting: Mounting,
    /// The unit the others are held against.
    pub reference: Unit,
    /// The units to be calibrated.
    pub targets: Vec<Unit>,
}

/// A session that was simulated.
#[derive(Clone, Debug)]
pub struct Session {
    /// Mounting of the shared structure.
    pub case_from_table: Rotation3<f64>,
    /// Truth of the motion.
    pub motion: Motion,
    /// The reference.
    pub reference: UnitRecord,
    /// The targets, in the order of the scenario.
    pub targets: Vec<UnitRecord>,
}

impl Session {
    /// Rotation vector of `case_from_table`, rad.
    pub fn mounting(&self) -> Vector3<f64> {
        UnitQuaternion::from_rotation_matrix(&self.case_from_table).scaled_axis()
    }
}

/// Why a scenario cannot be played.
#[derive(Clone, Debug, PartialEq)]
pub enum ScenarioError {
    /// There is no pose.
    NoPose,
    /// `up` of this pose is not a direction.
    NoDirection {
        /// Index of the pose.
        pose: usize,
    },
    /// A figure is not positive.
    NotPositive {
        /// What it is, with its unit.
        what: &'static str,
        /// What was found.
        found: f64,
    },
    /// A figure is negative or not finite.
    Negative {
        /// What it is, with its unit.
        what: &'static str,
        /// What was found.
        found: f64,
    },
    /// The samples do not fit into memory.
    TooLong {
        /// Samples of one unit.
        samples: f64,
    },
    /// A fault names an axis beyond the third.
    NoSuchAxis {
        /// What was found.
        found: usize,
    },
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPose => write!(f, "there is no pose to turn to"),
            Self::NoDirection { pose } => write!(f, "up of pose {} is not a unit vector", pose + 1),
            Self::NotPositive { what, found } => write!(f, "{what} has to be positive, found {found}"),
            Self::Negative { what, found } => write!(f, "{what} must not be negative, found {found}"),
            Self::TooLong { samples } => write!(f, "{samples:.3e} samples a unit do not fit into memory"),
            Self::NoSuchAxis { found } => write!(f, "a fault names axis {found}, there are 0, 1 and 2"),
        }
    }
}

impl core::error::Error for ScenarioError {}

/// Most samples of one unit; one takes 72 bytes.
const MOST_SAMPLES: f64 = 1e8;

/// Plays a scenario.
///
/// # Errors
/// [`ScenarioError`] where a figure makes no sense.
pub fn simulate(scenario: &Scenario) -> Result<Session, ScenarioError> {
    check(scenario)?;
    let mut random = stream(scenario.conditions.seed, 0, Purpose::Table);
    let case_from_table = scenario.mounting.rotation(&mut random);
    let motion = Motion::new(&scenario.table, case_from_table, &mut random);
    check_samples(motion.duration(), scenario.units())?;
    let units: Vec<&Unit> = scenario.units().collect();
    let mut records: Vec<UnitRecord> = units
        .par_iter()
        .enumerate()
        .map(|(number, unit)| record(&scenario.conditions, &motion, unit, number as u64))
        .collect();
    let targets = records.split_off(1);
    let reference = records.swap_remove(0);
    Ok(Session {
        case_from_table,
        motion,
        reference,
        targets,
    })
}

impl Scenario {
    fn units(&self) -> impl Iterator<Item = &Unit> + Clone {
        core::iter::once(&self.reference).chain(&self.targets)
    }
}

fn check(scenario: &Scenario) -> Result<(), ScenarioError> {
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

/// Checks figures and faults of units.
pub(crate) fn check_units<'a>(
    units: impl IntoIterator<Item = &'a Unit> + Clone,
) -> Result<(), ScenarioError> {
    units.clone().into_iter().try_for_each(check_unit)?;
    let faults = || units.clone().into_iter().flat_map(|unit| &unit.faults);
    faults()
        .filter_map(scale_factor)
        .try_for_each(|factor| positive("factor of a scale fault", factor))?;
    faults().flat_map(axes).try_for_each(|axis| match axis {
        0..=2 => Ok(()),
        found => Err(ScenarioError::NoSuchAxis { found }),
    })
}

fn check_unit(unit: &Unit) -> Result<(), ScenarioError> {
    positive("sample rate, Hz,", unit.rate)?;
    for triad in [&unit.grade.accelerometer, &unit.grade.gyroscope] {
        positive("range of a triad", triad.range)?;
        not_negative("noise density of a triad", triad.noise_density)?;
        not_negative("bias instability of a triad", triad.bias_instability)?;
        not_negative("quantisation of a triad", triad.quantisation)?;
    }
    if let ClockSetup::Given(clock) = unit.clock {
        positive("rate of a clock", 1.0 + clock.skew)?;
    }
    Ok(())
}

/// Checks that what all units record fits into memory.
pub(crate) fn check_samples<'a>(
    duration: f64,
    units: impl IntoIterator<Item = &'a Unit>,
) -> Result<(), ScenarioError> {
    let fastest = units.into_iter().map(|unit| unit.rate).fold(0.0, f64::max);
    let samples = duration * fastest;
    if samples > MOST_SAMPLES {
        return Err(ScenarioError::TooLong { samples });
    }
    Ok(())
}

pub(crate) fn positive(what: &'static str, found: f64) -> Result<(), ScenarioError> {
    let holds = found > 0.0 && found.is_finite();
    if holds {
        Ok(())
    } else {
        Err(ScenarioError::NotPositive { what, found })
    }
}

fn not_negative(what: &'static str, found: f64) -> Result<(), ScenarioError> {
    let holds = found >= 0.0 && found.is_finite();
    if holds {
        Ok(())
    } else {
        Err(ScenarioError::Negative { what, found })
    }
}

fn scale_factor(fault: &Fault) -> Option<f64> {
    match *fault {
        Fault::Scale { factor, .. } => Some(factor),
        _ => None,
    }
}

fn axes(fault: &Fault) -> Vec<usize> {
    match *fault {
        Fault::Scale { axis, .. }
        | Fault::Stuck { axis, .. }
        | Fault::Moved { axis, .. }
        | Fault::NotANumber { axis, .. }
        | Fault::Spikes { axis, .. }
        | Fault::BiasMoves { axis, .. }
        | Fault::LeftHanded { axis } => vec![axis],
        Fault::SwappedAxes { first, second } => vec![first, second],
        _ => vec![],
    }
}

#[cfg(test)]
#[path = "turntable_tests.rs"]
mod tests;
