//! A flight of a quadrotor, or drives of a vehicle, with several units on board: a primary, and secondaries at other places.
//!
//! The structure is rigid but for a small share of the vibration that each place has to itself. Truth is that of the
//! primary's place, in the primary's case frame; the motion of the carrier is that of this place too.

use nalgebra::{Rotation3, Vector3};
use rayon::prelude::*;
use serde::Deserialize;

use crate::simulate::attitude::roll_pitch_yaw;
use crate::simulate::carrier::{CarrierMotion, CarrierPlan};
use crate::simulate::quadrotor::Quadrotor;
use crate::simulate::scenario::{ScenarioError, check_samples, check_units, positive};
use crate::simulate::stream::{StreamPurpose, stream};
use crate::simulate::trajectory::{Trajectory, TrueMotion, earth_rate};
use crate::simulate::unit::{Conditions, UnitRecord, UnitSetup, record};
use crate::simulate::vehicle::Vehicle;
use crate::simulate::vibration::{VibrationLoop, VibrationSample, VibrationSettings};

/// Carrier of the units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Carrier {
    /// It flies.
    Quadrotor,
    /// It drives.
    Vehicle,
}

/// Everything a flight is made of; of a vehicle, its drives.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightScenario {
    /// Conditions that all units share.
    pub conditions: Conditions,
    /// Carrier of the units.
    pub carrier: Carrier,
    /// Plan of its motion.
    pub plan: CarrierPlan,
    /// Vibration while the motors run.
    pub vibration: VibrationSettings,
    /// Share of it while they do not: 1 for what is never still.
    pub vibration_at_rest: f64,
    /// Vibration that each place but the primary's has to itself, as a share of the common one.
    pub flexing: f64,
    /// Mounting of the primary.
    #[serde(rename = "mounting", deserialize_with = "roll_pitch_yaw")]
    pub case_from_body: Rotation3<f64>,
    /// Latitude, rad; `None` for an Earth that does not turn.
    pub latitude: Option<f64>,
    /// The primary first.
    pub units: Vec<UnitOnBoard>,
}

/// One unit on board.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitOnBoard {
    /// Grade, errors and mounting of the unit; its lever arm is from the primary.
    pub unit: UnitSetup,
    /// Vibration comes as the mean over this time, s: the sample period for a unit with a filter against what is faster
    /// than its samples, 0 for one without.
    pub averaging: f64,
}

/// The motion of the primary's place.
pub struct Flight {
    carrier_motion: Box<dyn CarrierMotion>,
    vibration: VibrationLoop,
    vibration_at_rest: f64,
    case_from_body: Rotation3<f64>,
    gravity: f64,
    earth_rate: Vector3<f64>,
}

/// Motion as a unit at another place feels it, but for its lever arm.
struct PlaceOnBoard<'a> {
    flight: &'a Flight,
    averaging: f64,
    flexing: f64,
    /// s by which the vibration is read apart from the common one, so that it has nothing to do with it.
    apart: f64,
}

/// A flight that was simulated.
pub struct SimulatedFlight {
    /// Truth of the motion.
    pub flight: Flight,
    /// Recordings of the units, in the order of the scenario.
    pub units: Vec<UnitRecord>,
}

/// Vibrations of two places are read so far apart, s.
const APART: f64 = 1.2345;

/// Plays a scenario.
///
/// # Errors
/// [`ScenarioError`] where a figure makes no sense.
pub fn simulate(scenario: &FlightScenario) -> Result<SimulatedFlight, ScenarioError> {
    let units = || scenario.units.iter().map(|each| &each.unit);
    check_units(units())?;
    positive("gravity, m/s^2,", scenario.plan.gravity)?;
    let flight = Flight::new(scenario);
    check_samples(flight.duration(), units())?;
    let units = scenario
        .units
        .par_iter()
        .enumerate()
        .map(|(number, UnitOnBoard { unit, averaging })| {
            let place = PlaceOnBoard {
                flight: &flight,
                averaging: *averaging,
                flexing: if number == 0 { 0.0 } else { scenario.flexing },
                apart: APART * number as f64,
            };
            record(&scenario.conditions, &place, unit, number as u64)
        })
        .collect();
    Ok(SimulatedFlight { flight, units })
}

impl Flight {
    fn new(scenario: &FlightScenario) -> Self {
        let streams = |purpose| stream(scenario.conditions.seed, 0, purpose);
        let random = &mut streams(StreamPurpose::Ride);
        let carrier_motion: Box<dyn CarrierMotion> = match scenario.carrier {
            Carrier::Quadrotor => Box::new(Quadrotor::new(&scenario.plan, random)),
            Carrier::Vehicle => Box::new(Vehicle::new(&scenario.plan, random)),
        };
        Self {
            carrier_motion,
            vibration: VibrationLoop::draw(&scenario.vibration, &mut streams(StreamPurpose::Vibration)),
            vibration_at_rest: scenario.vibration_at_rest,
            case_from_body: scenario.case_from_body,
            gravity: scenario.plan.gravity,
            earth_rate: scenario.latitude.map_or_else(Vector3::zeros, earth_rate),
        }
    }

    /// Motion of the carrier.
    pub fn carrier_motion(&self) -> &dyn CarrierMotion {
        self.carrier_motion.as_ref()
    }

    /// Rotation of the primary's case at time `t`, s: `level_from_case`, without vibration.
    pub fn level_from_case(&self, t: f64) -> Rotation3<f64> {
        self.carrier_motion.body_motion(t).angles.attitude().0 * self.case_from_body.inverse()
    }

    /// Velocity of the primary's place at time `t`, s, level frame, without vibration, m/s.
    pub fn velocity(&self, t: f64) -> Vector3<f64> {
        self.carrier_motion.body_motion(t).velocity
    }

    /// Truth at each of these times, s, vibration as its mean over `averaging` s.
    pub fn truths(&self, times: &[f64], averaging: f64) -> Vec<TrueMotion> {
        let at = |t: &f64| self.shaken_truth(*t, &self.shake(*t, averaging, 0.0, 0.0));
        times.par_iter().map(at).collect()
    }

    fn shaken_truth(&self, t: f64, shake: &VibrationSample) -> TrueMotion {
        let body = self.carrier_motion.body_motion(t);
        let (level_from_body, angular_motion) = body.angles.attitude();
        let to_body = |level: Vector3<f64>| level_from_body.inverse_transform_vector(&level);
        let force = to_body(body.acceleration + Vector3::z() * self.gravity) + shake.specific_force;
        let turn_rate = angular_motion.rate + shake.angular_rate;
        let to_case = |body: Vector3<f64>| self.case_from_body * body;
        TrueMotion {
            specific_force: to_case(force),
            angular_rate: to_case(turn_rate + to_body(self.earth_rate)),
            turn_rate: to_case(turn_rate),
            turn_acceleration: to_case(angular_motion.acceleration + shake.angular_acceleration),
        }
    }

    /// Vibration of a place that has `flexing` times that at time `apart` of the loop to itself.
    fn shake(&self, t: f64, averaging: f64, flexing: f64, apart: f64) -> VibrationSample {
        let running = self.carrier_motion.running(t);
        let swing = 1.0 - self.vibration_at_rest;
        let (envelope, slope) = (
            self.vibration_at_rest + swing * running.value(),
            swing * running.derivative(1),
        );
        if envelope == 0.0 {
            return VibrationSample::default();
        }
        let mut shake = self.vibration.mean(t, averaging);
        if flexing > 0.0 {
            shake = shake.plus(&self.vibration.mean(t + apart, averaging).scaled(flexing, 0.0));
        }
        shake.scaled(envelope, slope)
    }
}

impl Trajectory for Flight {
    fn truth(&self, t: f64) -> TrueMotion {
        self.shaken_truth(t, &self.shake(t, 0.0, 0.0, 0.0))
    }

    fn duration(&self) -> f64 {
        self.carrier_motion.duration()
    }
}

impl Trajectory for PlaceOnBoard<'_> {
    fn truth(&self, t: f64) -> TrueMotion {
        let shake = self.flight.shake(t, self.averaging, self.flexing, self.apart);
        self.flight.shaken_truth(t, &shake)
    }

    fn duration(&self) -> f64 {
        self.flight.duration()
    }
}

#[cfg(test)]
#[path = "flight_tests.rs"]
mod tests;
