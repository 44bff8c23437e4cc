//! A whole turntable session: one reference and any number of targets on one structure.

use core::fmt;

use nalgebra::{Rotation3, Vector3};
use rand::RngExt;
use rayon::prelude::*;

use crate::simulate::fault::{Channels, Fault, Samples};
use crate::simulate::grade::Grade;
use crate::simulate::motion::{Motion, Rest, Table, Truth};
use crate::simulate::sensor::{Geometry, Noise, REFERENCE_TEMPERATURE, Triad, quantised};
use crate::simulate::stream::{Purpose, Stream, direction, normal_vector, stream};

/// A rotation given, or drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mounting {
    /// Rotation vector, rad.
    Given(Vector3<f64>),
    /// By this angle, rad, about an axis drawn uniformly over the sphere.
    Angle(f64),
}

impl Mounting {
    fn rotation(&self, stream: &mut Stream) -> Rotation3<f64> {
        let axis = direction(stream);
        match self {
            Mounting::Given(vector) => Rotation3::new(*vector),
            Mounting::Angle(angle) => Rotation3::new(axis * *angle),
        }
    }
}

/// A unit's clock against that of the session: `own = t + offset + skew t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// s.
    pub offset: f64,
    /// Seconds gained in a second.
    pub skew: f64,
    /// First sample, in sample periods after the start of the session.
    pub phase: f64,
}

impl Clock {
    /// The clock of the session itself.
    pub const SESSION: Self = Self {
        offset: 0.0,
        skew: 0.0,
        phase: 0.0,
    };

    /// Own time at session time `t`, s.
    pub fn own(&self, t: f64) -> f64 {
        t + self.offset + self.skew * t
    }
}

/// How a unit comes by its clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClockSetup {
    /// This one.
    Given(Clock),
    /// Offset uniform within `offset` s either way, skew normal with that sigma, phase uniform.
    Drawn {
        /// s.
        offset: f64,
        /// Seconds gained in a second, 1 sigma.
        skew: f64,
    },
}

impl ClockSetup {
    fn clock(&self, stream: &mut Stream) -> Clock {
        match *self {
            ClockSetup::Given(clock) => clock,
            ClockSetup::Drawn { offset, skew } => Clock {
                offset: offset * (2.0 * stream.random::<f64>() - 1.0),
                skew: skew * normal_vector(stream).x,
                phase: stream.random(),
            },
        }
    }
}

/// One unit as it is built and mounted.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// How good it is.
    pub grade: Grade,
    /// Whether it has the geometric errors of its grade.
    pub geometry: Geometry,
    /// Samples a second, Hz, by its own clock.
    pub rate: f64,
    /// Its package against the case of the reference.
    pub package_from_case: Mounting,
    /// Its place against the turning centre, m, case frame.
    pub lever_arm: Vector3<f64>,
    /// Its clock.
    pub clock: ClockSetup,
    /// What is wrong with it.
    pub faults: Vec<Fault>,
}

/// Temperature over the session: `start + rise (1 - exp(-t / time_constant))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warming {
    /// degC.
    pub start: f64,
    /// K.
    pub rise: f64,
    /// s.
    pub time_constant: f64,
}

impl Warming {
    fn temperature(&self, t: f64) -> f64 {
        if self.rise == 0.0 {
            self.start
        } else {
            self.start - self.rise * libm::expm1(-t / self.time_constant)
        }
    }
}

/// Everything a session is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// All that is random follows from it.
    pub seed: u64,
    /// The table and where it goes.
    pub table: Table,
    /// The structure that reference and targets share, `case_from_table`.
    pub mounting: Mounting,
    /// Temperature of all units.
    pub warming: Warming,
    /// Whether noise has bias instability beside its white part.
    pub bias_instability: bool,
    /// Whether outputs come in steps.
    pub quantisation: bool,
    /// The unit the others are held against.
    pub reference: Unit,
    /// The units to be calibrated.
    pub targets: Vec<Unit>,
}

/// What is true of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitTruth {
    /// Errors of the accelerometers.
    pub accelerometer: Triad,
    /// Errors of the gyroscopes.
    pub gyroscope: Triad,
    /// Clock against the session's.
    pub clock: Clock,
    /// Mean over the recording of what the accelerometer bias moved by (bias instability and temperature), m/s^2.
    pub accelerometer_drift: Vector3<f64>,
    /// The same of the gyroscope, rad/s.
    pub gyroscope_drift: Vector3<f64>,
}

/// One unit: what it recorded and what is true of it.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitRecord {
    /// What it recorded.
    pub samples: Samples,
    /// What is true of it.
    pub truth: UnitTruth,
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

/// Most samples of one unit.
const MOST_SAMPLES: f64 = 1e9;

/// Plays a scenario.
///
/// # Errors
/// [`ScenarioError`] where a figure makes no sense.
pub fn simulate(scenario: &Scenario) -> Result<Session, ScenarioError> {
    check(scenario)?;
    let mut random = stream(scenario.seed, 0, Purpose::Table);
    let case_from_table = scenario.mounting.rotation(&mut random);
    let motion = Motion::new(&scenario.table, case_from_table, &mut random);
    let samples = motion.duration() * scenario.rates().fold(0.0, f64::max);
    if samples > MOST_SAMPLES {
        return Err(ScenarioError::TooLong { samples });
    }
    let units: Vec<&Unit> = core::iter::once(&scenario.reference)
        .chain(&scenario.targets)
        .collect();
    let mut records: Vec<UnitRecord> = units
        .par_iter()
        .enumerate()
        .map(|(number, unit)| record(scenario, &motion, unit, number as u64))
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
    fn units(&self) -> impl Iterator<Item = &Unit> {
        core::iter::once(&self.reference).chain(&self.targets)
    }

    fn rates(&self) -> impl Iterator<Item = f64> {
        self.units().map(|unit| unit.rate)
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
    positive("time constant of warming, s,", scenario.warming.time_constant)?;
    not_negative("error of the table, rad,", table.error)?;
    scenario.units().try_for_each(check_unit)?;
    let faults = scenario.units().flat_map(|unit| &unit.faults);
    faults.flat_map(axes).try_for_each(|axis| match axis {
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

fn positive(what: &'static str, found: f64) -> Result<(), ScenarioError> {
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

fn axes(fault: &Fault) -> Vec<usize> {
    match *fault {
        Fault::Scale { axis, .. }
        | Fault::Stuck { axis, .. }
        | Fault::Moved { axis, .. }
        | Fault::NotANumber { axis, .. }
        | Fault::LeftHanded { axis } => vec![axis],
        Fault::SwappedAxes { first, second } => vec![first, second],
        _ => vec![],
    }
}

/// One unit with its errors drawn, ready to be sampled.
struct Sampler<'a> {
    unit: &'a Unit,
    motion: &'a Motion,
    warming: &'a Warming,
    accelerometer: Triad,
    gyroscope: Triad,
    clock: Clock,
}

fn record(scenario: &Scenario, motion: &Motion, unit: &Unit, number: u64) -> UnitRecord {
    let sampler = Sampler::draw(scenario, motion, unit, number);
    let (mut samples, accelerometer_drift, gyroscope_drift) =
        sampler.sample(|purpose| stream(scenario.seed, number, purpose));
    for fault in &unit.faults {
        fault.spoil(&mut samples, |t| sampler.clock.own(t));
    }
    let truth = UnitTruth {
        accelerometer: sampler.accelerometer,
        gyroscope: sampler.gyroscope,
        clock: sampler.clock,
        accelerometer_drift,
        gyroscope_drift,
    };
    UnitRecord { samples, truth }
}

impl<'a> Sampler<'a> {
    fn draw(scenario: &'a Scenario, motion: &'a Motion, unit: &'a Unit, number: u64) -> Self {
        let mut random = stream(scenario.seed, number, Purpose::Geometry);
        let package = unit.package_from_case.rotation(&mut random);
        let mut accelerometer = Triad::draw(&unit.grade.accelerometer, unit.geometry, &package, &mut random);
        let mut gyroscope = Triad::draw(&unit.grade.gyroscope, unit.geometry, &package, &mut random);
        for fault in &unit.faults {
            if let Fault::Scale {
                channels,
                axis,
                factor,
            } = *fault
            {
                let triad = match channels {
                    Channels::Accelerometer => &mut accelerometer,
                    Channels::Gyroscope => &mut gyroscope,
                };
                triad.model.matrix.row_mut(axis).scale_mut(factor);
            }
        }
        for triad in [&mut accelerometer, &mut gyroscope] {
            triad.bias_instability *= f64::from(u8::from(scenario.bias_instability));
            triad.quantisation *= f64::from(u8::from(scenario.quantisation));
        }
        let clock = unit
            .clock
            .clock(&mut stream(scenario.seed, number, Purpose::Clock));
        Self {
            unit,
            motion,
            warming: &scenario.warming,
            accelerometer,
            gyroscope,
            clock,
        }
    }

    /// The readings, and the mean drift of accelerometer and gyroscope.
    fn sample(&self, streams: impl Fn(Purpose) -> Stream) -> (Samples, Vector3<f64>, Vector3<f64>) {
        let count = self.count();
        let mut samples = Samples::with_capacity(count);
        let noise = |triad: &Triad, white: Purpose, flicker: Purpose| {
            Noise::new(triad, self.unit.rate, count, streams(white), streams(flicker))
        };
        let mut force_noise = noise(
            &self.accelerometer,
            Purpose::AccelerometerWhite,
            Purpose::AccelerometerFlicker,
        );
        let mut rate_noise = noise(
            &self.gyroscope,
            Purpose::GyroscopeWhite,
            Purpose::GyroscopeFlicker,
        );
        let (mut force_drift, mut rate_drift) = (Vector3::zeros(), Vector3::zeros());
        let slips = self
            .unit
            .faults
            .iter()
            .any(|fault| matches!(fault, Fault::Moved { .. }));
        for index in 0..count {
            let t = self.time(index);
            let mut truth = self.at_lever_arm(self.motion.truth(t));
            if slips {
                truth = self.slipped(truth, t);
            }
            let temperature = self.warming.temperature(t);
            let warmth = temperature - REFERENCE_TEMPERATURE;
            let (force_flicker, rate_flicker) = (force_noise.flicker(), rate_noise.flicker());
            let force = &truth.specific_force;
            let y = self
                .accelerometer
                .reading(force, force, warmth, &(force_noise.white() + force_flicker));
            let w = self.gyroscope.reading(
                &truth.angular_rate,
                force,
                warmth,
                &(rate_noise.white() + rate_flicker),
            );
            samples.time.push(self.own_time(index));
            samples.accelerometer.push(y.into());
            samples.gyroscope.push(w.into());
            samples
                .temperature
                .push(quantised(temperature, self.unit.grade.temperature_step));
            force_drift += force_flicker + self.accelerometer.temperature_coefficient * warmth;
            rate_drift += rate_flicker + self.gyroscope.temperature_coefficient * warmth;
        }
        let count = count.max(1) as f64;
        (samples, force_drift / count, rate_drift / count)
    }

    /// Samples within the session.
    fn count(&self) -> usize {
        let first = self.clock.phase / self.unit.rate;
        let periods = (self.motion.duration() - first) * (1.0 + self.clock.skew) * self.unit.rate;
        if periods < 0.0 { 0 } else { periods as usize + 1 }
    }

    /// Session time of a sample: its own clock ticks evenly, and gains by the skew.
    fn time(&self, index: usize) -> f64 {
        (self.clock.phase + index as f64 / (1.0 + self.clock.skew)) / self.unit.rate
    }

    fn own_time(&self, index: usize) -> f64 {
        self.clock.own(self.clock.phase / self.unit.rate) + index as f64 / self.unit.rate
    }

    /// Away from the turning centre the table's acceleration is felt: `f + alpha x r + w x (w x r)`.
    fn at_lever_arm(&self, truth: Truth) -> Truth {
        let arm = &self.unit.lever_arm;
        let w = &truth.turn_rate;
        let specific_force =
            truth.specific_force + truth.turn_acceleration.cross(arm) + w.cross(&w.cross(arm));
        Truth {
            specific_force,
            ..truth
        }
    }

    /// Truth as a unit meets it that has slipped in its mounting.
    fn slipped(&self, truth: Truth, t: f64) -> Truth {
        let slips = self.unit.faults.iter().filter_map(|fault| fault.slip(t));
        slips.fold(truth, |truth, slip| Truth {
            specific_force: slip * truth.specific_force,
            angular_rate: slip * truth.angular_rate,
            ..truth
        })
    }
}

/// Truth of a rest for whoever checks an estimate: true specific force and angular rate in the case frame.
pub fn truth_at_rest(session: &Session, rest: &Rest) -> Truth {
    session.motion.at_rest(&rest.level_from_table)
}

#[cfg(test)]
#[path = "turntable_tests.rs"]
mod tests;
