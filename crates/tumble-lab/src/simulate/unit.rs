//! One unit on the table: how it is built, its clock, and its recording of the motion.

use nalgebra::{Rotation3, Vector3};
use rand::RngExt;

use crate::simulate::fault::{Fault, Samples};
use crate::simulate::grade::Grade;
use crate::simulate::motion::{Motion, Truth};
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
    /// The rotation; `stream` moves on by the same amount either way.
    pub fn rotation(&self, stream: &mut Stream) -> Rotation3<f64> {
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

    /// Session time of a sample, s: the clock ticks evenly by itself, and gains by its skew.
    fn session_time(&self, rate: f64, index: usize) -> f64 {
        (self.phase + index as f64 / (1.0 + self.skew)) / rate
    }

    /// Time stamp of a sample, s.
    fn own_time(&self, rate: f64, index: usize) -> f64 {
        self.own(self.phase / rate) + index as f64 / rate
    }

    /// Samples in a session.
    fn count(&self, rate: f64, duration: f64) -> usize {
        let periods = (duration * rate - self.phase) * (1.0 + self.skew);
        if periods < 0.0 { 0 } else { periods as usize + 1 }
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

/// What is the same for all units of a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// All that is random follows from it.
    pub seed: u64,
    /// Temperature of all units.
    pub warming: Warming,
    /// Whether noise has bias instability beside its white part.
    pub bias_instability: bool,
    /// Whether outputs come in steps.
    pub quantisation: bool,
    /// Whether gyroscopes respond to specific force.
    pub g_sensitivity: bool,
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

/// Draws a unit and lets it record the motion; `number` 0 is the reference.
pub fn record(conditions: &Conditions, motion: &Motion, unit: &Unit, number: u64) -> UnitRecord {
    let streams = |purpose| stream(conditions.seed, number, purpose);
    let [accelerometer, gyroscope] = unit.draw(conditions, &mut streams(Purpose::Geometry));
    let clock = unit.clock.clock(&mut streams(Purpose::Clock));
    let count = clock.count(unit.rate, motion.duration());
    let noise = |triad, white, flicker| Noise::new(triad, unit.rate, count, streams(white), streams(flicker));
    let mut force_channels = Channel::new(
        &accelerometer,
        noise(
            &accelerometer,
            Purpose::AccelerometerWhite,
            Purpose::AccelerometerFlicker,
        ),
    );
    let mut rate_channels = Channel::new(
        &gyroscope,
        noise(&gyroscope, Purpose::GyroscopeWhite, Purpose::GyroscopeFlicker),
    );
    let mut samples = Samples::with_capacity(count);
    for index in 0..count {
        let t = clock.session_time(unit.rate, index);
        let truth = unit.felt(motion.truth(t), t);
        let temperature = conditions.warming.temperature(t);
        let warmth = temperature - REFERENCE_TEMPERATURE;
        let force = &truth.specific_force;
        samples.time.push(clock.own_time(unit.rate, index));
        samples
            .accelerometer
            .push(force_channels.next(force, force, warmth));
        samples
            .gyroscope
            .push(rate_channels.next(&truth.angular_rate, force, warmth));
        samples
            .temperature
            .push(quantised(temperature, unit.grade.temperature_step));
    }
    let truth = UnitTruth {
        accelerometer_drift: force_channels.mean_drift(count),
        gyroscope_drift: rate_channels.mean_drift(count),
        accelerometer,
        gyroscope,
        clock,
    };
    unit.faults
        .iter()
        .for_each(|fault| fault.spoil(&mut samples, |t| clock.own(t)));
    UnitRecord { samples, truth }
}

impl Unit {
    /// Accelerometers and gyroscopes with their errors.
    fn draw(&self, conditions: &Conditions, stream: &mut Stream) -> [Triad; 2] {
        let package = self.package_from_case.rotation(stream);
        let mut triads = [&self.grade.accelerometer, &self.grade.gyroscope]
            .map(|grade| Triad::draw(grade, self.geometry, &package, stream));
        for fault in &self.faults {
            if let Fault::Scale {
                channels,
                axis,
                factor,
            } = *fault
            {
                triads[channels as usize]
                    .model
                    .matrix
                    .row_mut(axis)
                    .scale_mut(factor);
            }
        }
        for triad in &mut triads {
            let switch = |on: bool, value: &mut f64| *value = if on { *value } else { 0.0 };
            switch(conditions.bias_instability, &mut triad.bias_instability);
            switch(conditions.quantisation, &mut triad.quantisation);
            triad
                .g_sensitivity
                .iter_mut()
                .for_each(|value| switch(conditions.g_sensitivity, value));
        }
        triads
    }

    /// Truth where the unit sits and as it has slipped by session time `t`.
    ///
    /// Away from the turning centre the table's acceleration is felt: `f + alpha x r + w x (w x r)`.
    fn felt(&self, truth: Truth, t: f64) -> Truth {
        let (arm, w) = (&self.lever_arm, &truth.turn_rate);
        let pull = truth.turn_acceleration.cross(arm) + w.cross(&w.cross(arm));
        let placed = Truth {
            specific_force: truth.specific_force + pull,
            ..truth
        };
        let slips = self.faults.iter().filter_map(|fault| fault.slip(t));
        slips.fold(placed, |truth, slip| Truth {
            specific_force: slip * truth.specific_force,
            angular_rate: slip * truth.angular_rate,
            ..truth
        })
    }
}

/// Three channels at work.
struct Channel<'a> {
    triad: &'a Triad,
    noise: Noise,
    drift: Vector3<f64>,
}

impl<'a> Channel<'a> {
    fn new(triad: &'a Triad, noise: Noise) -> Self {
        let drift = Vector3::zeros();
        Self { triad, noise, drift }
    }

    fn next(&mut self, u: &Vector3<f64>, f: &Vector3<f64>, warmth: f64) -> [f64; 3] {
        let flicker = self.noise.flicker();
        self.drift += flicker + self.triad.temperature_coefficient * warmth;
        self.triad
            .reading(u, f, warmth, &(self.noise.white() + flicker))
            .into()
    }

    fn mean_drift(&self, count: usize) -> Vector3<f64> {
        self.drift / count.max(1) as f64
    }
}
