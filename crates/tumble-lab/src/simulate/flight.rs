//! A mission of a quadrotor or a vehicle with several units on board: a primary, and secondaries at other places.
//!
//! The structure is rigid but for a small share of the vibration that each place has to itself. Truth is that of the
//! primary's place, in the primary's case frame; the course the ride takes is the primary's.

use nalgebra::{Rotation3, Vector3};
use rayon::prelude::*;

use crate::simulate::motion::{Course, Truth, earth_rate};
use crate::simulate::quadrotor::Quadrotor;
use crate::simulate::ride::{Manner, Ride};
use crate::simulate::stream::{Purpose, stream};
use crate::simulate::turntable::{ScenarioError, check_samples, check_units, positive};
use crate::simulate::unit::{Conditions, Unit, UnitRecord, record};
use crate::simulate::vehicle::Vehicle;
use crate::simulate::vibration::{Shake, Shaking, Vibration};

/// What carries the units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// It flies.
    Quadrotor,
    /// It drives.
    Vehicle,
}

/// Everything a mission is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Mission {
    /// What is the same for all units.
    pub conditions: Conditions,
    /// What carries them.
    pub carrier: Carrier,
    /// How it moves.
    pub manner: Manner,
    /// Vibration while the motors run.
    pub shaking: Shaking,
    /// Share of it while they do not: 1 for what is never still.
    pub shaking_at_rest: f64,
    /// Vibration that each place but the primary's has to itself, as a share of the common one.
    pub flexing: f64,
    /// Mounting of the primary.
    pub case_from_body: Rotation3<f64>,
    /// Latitude, rad; `None` for an Earth that does not turn.
    pub latitude: Option<f64>,
    /// The primary first.
    pub units: Vec<OnBoard>,
}

/// One unit on board.
#[derive(Clone, Debug, PartialEq)]
pub struct OnBoard {
    /// How it is built and mounted; its lever arm is from the primary.
    pub unit: Unit,
    /// Vibration comes as the mean over this time, s: the sample period for a unit with a filter against what is faster
    /// than its samples, 0 for one without.
    pub averaging: f64,
}

/// The motion of the primary's place.
pub struct Flight {
    ride: Box<dyn Ride>,
    vibration: Vibration,
    shaking_at_rest: f64,
    case_from_body: Rotation3<f64>,
    gravity: f64,
    earth_rate: Vector3<f64>,
}

/// Motion as a unit at another place feels it, but for its lever arm.
struct Elsewhere<'a> {
    flight: &'a Flight,
    averaging: f64,
    flexing: f64,
    /// s by which the vibration is read apart from the common one, so that it has nothing to do with it.
    apart: f64,
}

/// A mission that was simulated.
pub struct Flown {
    /// Truth of the motion.
    pub flight: Flight,
    /// What the units recorded, in the order of the mission.
    pub units: Vec<UnitRecord>,
}

/// Vibrations of two places are read so far apart, s.
const APART: f64 = 1.2345;

/// Plays a mission.
///
/// # Errors
/// [`ScenarioError`] where a figure makes no sense.
pub fn simulate(mission: &Mission) -> Result<Flown, ScenarioError> {
    let units = || mission.units.iter().map(|each| &each.unit);
    check_units(units())?;
    positive("gravity, m/s^2,", mission.manner.gravity)?;
    let flight = Flight::new(mission);
    check_samples(flight.duration(), units())?;
    let units = mission
        .units
        .par_iter()
        .enumerate()
        .map(|(number, OnBoard { unit, averaging })| {
            let place = Elsewhere {
                flight: &flight,
                averaging: *averaging,
                flexing: if number == 0 { 0.0 } else { mission.flexing },
                apart: APART * number as f64,
            };
            record(&mission.conditions, &place, unit, number as u64)
        })
        .collect();
    Ok(Flown { flight, units })
}

impl Flight {
    fn new(mission: &Mission) -> Self {
        let streams = |purpose| stream(mission.conditions.seed, 0, purpose);
        let random = &mut streams(Purpose::Ride);
        let ride: Box<dyn Ride> = match mission.carrier {
            Carrier::Quadrotor => Box::new(Quadrotor::new(&mission.manner, random)),
            Carrier::Vehicle => Box::new(Vehicle::new(&mission.manner, random)),
        };
        Self {
            ride,
            vibration: Vibration::draw(&mission.shaking, &mut streams(Purpose::Vibration)),
            shaking_at_rest: mission.shaking_at_rest,
            case_from_body: mission.case_from_body,
            gravity: mission.manner.gravity,
            earth_rate: mission.latitude.map_or_else(Vector3::zeros, earth_rate),
        }
    }

    /// What it does and when.
    pub fn ride(&self) -> &dyn Ride {
        self.ride.as_ref()
    }

    /// Rotation of the primary's case at time `t`, s: `level_from_case`, without vibration.
    pub fn level_from_case(&self, t: f64) -> Rotation3<f64> {
        self.ride.moved(t).angles.attitude().0 * self.case_from_body.inverse()
    }

    /// Velocity of the primary's place at time `t`, s, level frame, without vibration, m/s.
    pub fn velocity(&self, t: f64) -> Vector3<f64> {
        self.ride.moved(t).velocity
    }

    /// Truth at each of these times, s, vibration as its mean over `averaging` s.
    pub fn truths(&self, times: &[f64], averaging: f64) -> Vec<Truth> {
        let at = |t: &f64| self.shaken_truth(*t, &self.shake(*t, averaging, 0.0, 0.0));
        times.par_iter().map(at).collect()
    }

    fn shaken_truth(&self, t: f64, shake: &Shake) -> Truth {
        let moved = self.ride.moved(t);
        let (level_from_body, spin) = moved.angles.attitude();
        let to_body = |level: Vector3<f64>| level_from_body.inverse_transform_vector(&level);
        let force = to_body(moved.acceleration + Vector3::z() * self.gravity) + shake.specific_force;
        let turn_rate = spin.rate + shake.angular_rate;
        let to_case = |body: Vector3<f64>| self.case_from_body * body;
        Truth {
            specific_force: to_case(force),
            angular_rate: to_case(turn_rate + to_body(self.earth_rate)),
            turn_rate: to_case(turn_rate),
            turn_acceleration: to_case(spin.acceleration + shake.angular_acceleration),
        }
    }

    /// Vibration of a place that has `flexing` times that at time `apart` of the loop to itself.
    fn shake(&self, t: f64, averaging: f64, flexing: f64, apart: f64) -> Shake {
        let running = self.ride.running(t);
        let swing = 1.0 - self.shaking_at_rest;
        let (envelope, slope) = (
            self.shaking_at_rest + swing * running.value(),
            swing * running.derivative(1),
        );
        if envelope == 0.0 {
            return Shake::default();
        }
        let mut shake = self.vibration.mean(t, averaging);
        if flexing > 0.0 {
            shake = shake.plus(&self.vibration.mean(t + apart, averaging).scaled(flexing, 0.0));
        }
        shake.scaled(envelope, slope)
    }
}

impl Course for Flight {
    fn truth(&self, t: f64) -> Truth {
        self.shaken_truth(t, &self.shake(t, 0.0, 0.0, 0.0))
    }

    fn duration(&self) -> f64 {
        self.ride.duration()
    }
}

impl Course for Elsewhere<'_> {
    fn truth(&self, t: f64) -> Truth {
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
