//! A spin: one unit on a wheeled robot that stands, turns on the spot and drives, with known truth.

use nalgebra::Vector3;
use serde::Deserialize;
use tumble_core::spin::axis::tilt;

use crate::simulate::scenario::{ScenarioError, check_samples, check_units};
use crate::simulate::stream::{StreamPurpose, stream};
use crate::simulate::trajectory::Trajectory;
use crate::simulate::unit::{Conditions, UnitRecord, UnitSetup, record};
use crate::simulate::wheeled_robot::{RobotMotion, RobotPlan, reported_bearing};

/// Everything a spin is made of.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpinScenario {
    /// Seed and temperature.
    pub conditions: Conditions,
    /// The robot, the floors and what happens.
    pub plan: RobotPlan,
    /// The unit on the robot; its lever arm, m, is forward, left and up from the turning axis.
    pub unit: UnitSetup,
}

/// A spin that was simulated.
#[derive(Clone, Debug)]
pub struct SimulatedSpin {
    /// Truth of the motion.
    pub motion: RobotMotion,
    /// Recording of the unit.
    pub unit: UnitRecord,
    /// Turning axis upwards across the floor, unit length, case frame.
    pub up: Vector3<f64>,
    /// Roll and pitch of the mounting, rad, as results state them.
    pub roll_pitch: (f64, f64),
    /// Uphill of the first floor, rad, as results state it.
    pub uphill_bearing: f64,
    /// The unit from the turning axis, across it, m, case frame.
    pub lever_arm: Vector3<f64>,
}

/// Number of the unit among the random streams: the robot has no reference, which would be 0.
const UNIT: u64 = 1;

/// Plays a scenario.
///
/// # Errors
/// [`ScenarioError`] where a figure makes no sense.
pub fn simulate(scenario: &SpinScenario) -> Result<SimulatedSpin, ScenarioError> {
    let SpinScenario {
        conditions,
        plan,
        unit,
    } = scenario;
    check_units([unit])?;
    let motion = RobotMotion::new(
        plan.clone(),
        &mut stream(conditions.seed, UNIT, StreamPurpose::Floor),
    );
    check_samples(motion.duration(), [unit])?;
    let unit = UnitSetup {
        lever_arm: plan.case_from_floor * unit.lever_arm,
        ..unit.clone()
    };
    let up = plan.case_from_floor * Vector3::z();
    Ok(SimulatedSpin {
        unit: record(conditions, &motion, &unit, UNIT),
        motion,
        up,
        roll_pitch: tilt(&up),
        uphill_bearing: reported_bearing(&plan.case_from_floor, plan.floor.uphill),
        lever_arm: unit.lever_arm - up * up.dot(&unit.lever_arm),
    })
}
