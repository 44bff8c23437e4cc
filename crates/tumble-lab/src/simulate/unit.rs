//! One unit on the table: how it is built, its clock, and its recording of the motion.

use nalgebra::{Rotation3, Vector3};
use rand::RngExt;
use serde::Deserialize;

use crate::simulate::fault::{Channels, InjectedFault, RecordedSamples};
use crate::simulate::grade::SensorGrade;
use crate::simulate::noise::{flicker, white};
use crate::simulate::sensor::{Geometry, REFERENCE_TEMPERATURE, TriadErrors, quantised};
use crate::simulate::stream::{RandomStream, StreamPurpose, direction, normal_vector, stream};
use crate::simulate::trajectory::{Trajectory, TrueMotion};

/// A rotation given, or drawn.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "needs an angle or three numbers")]
pub enum RotationSetup {
    /// Rotation vector, rad.
    Given(Vector3<f64>),
    /// By this angle, rad, about an axis drawn uniformly over the sphere.
    Angle(f64),
}

impl RotationSetup {
    /// The rotation; `stream` moves on by the same amount either way.
    pub fn rotation(&self, stream: &mut RandomStream) -> Rotation3<f64> {
        let axis = direction(stream);
        match self {
            RotationSetup::Given(vector) => Rotation3::new(*vector),
            RotationSetup::Angle(angle) => Rotation3::new(axis * *angle),
        }
    }
}

/// A unit's clock against that of the session: `own = t + offset + skew t`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockTruth {
    /// s.
    pub offset: f64,
    /// Seconds gained in a second.
    pub skew: f64,
    /// First sample, in sample periods after the start of the session.
    pub phase: f64,
}

impl ClockTruth {
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

/// Origins of a unit's clock.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ClockSetup {
    /// This one.
    Given(ClockTruth),
    /// This offset and skew, phase uniform.
    Unphased {
        /// s.
        offset: f64,
        /// Seconds gained in a second.
        skew: f64,
    },
    /// Offset uniform within `offset` s either way, skew normal with that sigma, phase uniform.
    Drawn {
        /// s.
        offset: f64,
        /// Seconds gained in a second, 1 sigma.
        skew: f64,
    },
}

impl ClockSetup {
    fn clock(&self, stream: &mut RandomStream) -> ClockTruth {
        match *self {
            ClockSetup::Given(clock) => clock,
            ClockSetup::Unphased { offset, skew } => ClockTruth {
                offset,
                skew,
                phase: stream.random(),
            },
            ClockSetup::Drawn { offset, skew } => ClockTruth {
                offset: offset * (2.0 * stream.random::<f64>() - 1.0),
                skew: skew * normal_vector(stream).x,
                phase: stream.random(),
            },
        }
    }
}

/// Change of the bias of a triad since it left the factory.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "needs a multiple or three numbers")]
pub enum Ageing {
    /// This, unit of the triad.
    Given(Vector3<f64>),
    /// Normal, with this multiple of the grade's turn-on bias as its sigma on each axis.
    Drawn(f64),
}

impl Ageing {
    /// None.
    pub const NONE: Self = Self::Drawn(0.0);

    fn bias(&self, turn_on_bias: f64, stream: &mut RandomStream) -> Vector3<f64> {
        let drawn = normal_vector(stream);
        match *self {
            Ageing::Given(bias) => bias,
            Ageing::Drawn(multiple) => drawn * (multiple * turn_on_bias),
        }
    }
}

/// One unit as it is built and mounted.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitSetup {
    /// Grade of the unit.
    pub grade: SensorGrade,
    /// Geometric errors: those of the grade, or none.
    pub geometry: Geometry,
    /// Samples a second, Hz, by its own clock.
    pub rate: f64,
    /// Its package against the case of the reference.
    pub package_from_case: RotationSetup,
    /// Biases of accelerometers and gyroscopes, m/s^2 and rad/s, where they are not to be drawn.
    pub biases: [Option<Vector3<f64>>; 2],
    /// Change of their biases since, for accelerometers and gyroscopes.
    pub ageing: [Ageing; 2],
    /// Its place against the turning centre, m, case frame.
    pub lever_arm: Vector3<f64>,
    /// Its clock.
    pub clock: ClockSetup,
    /// Time from the measurement of a sample until it is at hand, s.
    pub latency: f64,
    /// Faults that are injected into it.
    pub faults: Vec<InjectedFault>,
}

/// Temperature over the session: `start + rise (1 - exp(-t / time_constant))`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
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

/// Conditions that all units of a session share.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditions {
    /// All that is random follows from it.
    pub seed: u64,
    /// Temperature of all units.
    pub warming: Warming,
    /// True if noise has bias instability beside its white part.
    pub bias_instability: bool,
    /// True if outputs come in steps.
    pub quantisation: bool,
    /// True if gyroscopes respond to specific force.
    pub g_sensitivity: bool,
}

/// Truth of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitTruth {
    /// Errors of the accelerometers.
    pub accelerometer: TriadErrors,
    /// Errors of the gyroscopes.
    pub gyroscope: TriadErrors,
    /// Mounting of the package, but for the alignment of the triads in it.
    pub package_from_case: Rotation3<f64>,
    /// Change of their biases since the factory, m/s^2 and rad/s.
    pub ageing: [Vector3<f64>; 2],
    /// Clock against the session's.
    pub clock: ClockTruth,
    /// Mean over the recording of what the accelerometer bias moved by (bias instability and temperature), m/s^2.
    pub accelerometer_drift: Vector3<f64>,
    /// The same of the gyroscope, rad/s.
    pub gyroscope_drift: Vector3<f64>,
}

/// One unit: what it recorded and what is true of it.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitRecord {
    /// Samples that it recorded.
    pub samples: RecordedSamples,
    /// Truth of the unit.
    pub truth: UnitTruth,
}

/// Streams of white noise and of bias instability.
const ACCELEROMETER_NOISE: [StreamPurpose; 2] = [
    StreamPurpose::AccelerometerWhite,
    StreamPurpose::AccelerometerFlicker,
];
const GYROSCOPE_NOISE: [StreamPurpose; 2] = [StreamPurpose::GyroscopeWhite, StreamPurpose::GyroscopeFlicker];

/// Draws a unit and lets it record the motion; `number` 0 is the reference.
pub fn record(
    conditions: &Conditions,
    motion: &impl Trajectory,
    unit: &UnitSetup,
    number: u64,
) -> UnitRecord {
    let streams = |purpose| stream(conditions.seed, number, purpose);
    let (package_from_case, [mut accelerometer, mut gyroscope]) =
        unit.draw(conditions, &mut streams(StreamPurpose::Geometry));
    let ageing = unit.age(
        [&mut accelerometer, &mut gyroscope],
        &mut streams(StreamPurpose::Ageing),
    );
    let clock = unit.clock.clock(&mut streams(StreamPurpose::Clock));
    let count = clock.count(unit.rate, motion.duration());
    let noise = |triad, purposes: [StreamPurpose; 2]| noise(triad, unit.rate, count, purposes.map(streams));
    let (mut forces, force_flicker) = noise(&accelerometer, ACCELEROMETER_NOISE);
    let (mut rates, rate_flicker) = noise(&gyroscope, GYROSCOPE_NOISE);
    let mut faults = streams(StreamPurpose::Faults);
    let session_time = |index| clock.session_time(unit.rate, index);
    for fault in &unit.faults {
        fault.disturb(Channels::Accelerometer, &mut forces, session_time, &mut faults);
        fault.disturb(Channels::Gyroscope, &mut rates, session_time, &mut faults);
    }
    let triads = [&accelerometer, &gyroscope];
    let (mut samples, mean_warmth) = unit.readings(conditions, motion, &clock, triads, [forces, rates]);
    for fault in &unit.faults {
        fault.spoil(&mut samples, |t| clock.own(t), &mut faults);
    }
    let truth = UnitTruth {
        accelerometer_drift: force_flicker + accelerometer.temperature_coefficient * mean_warmth,
        gyroscope_drift: rate_flicker + gyroscope.temperature_coefficient * mean_warmth,
        accelerometer,
        gyroscope,
        package_from_case,
        ageing,
        clock,
    };
    UnitRecord { samples, truth }
}

/// Noise of a triad, row by row, and the mean of its bias instability.
fn noise(
    triad: &TriadErrors,
    rate: f64,
    count: usize,
    [mut white_stream, mut flicker_stream]: [RandomStream; 2],
) -> (Vec<[f64; 3]>, Vector3<f64>) {
    let mut rows = white(triad.noise_density, rate, count, &mut white_stream);
    let mut mean = Vector3::zeros();
    if triad.bias_instability > 0.0 {
        for channel in 0..3 {
            let series = flicker(triad.bias_instability, count, &mut flicker_stream);
            mean[channel] = series.iter().sum::<f64>() / count.max(1) as f64;
            rows.iter_mut()
                .zip(&series)
                .for_each(|(row, value)| row[channel] += value);
        }
    }
    (rows, mean)
}

impl UnitSetup {
    /// Draws the mounting of its package, and accelerometers and gyroscopes with their errors.
    fn draw(&self, conditions: &Conditions, stream: &mut RandomStream) -> (Rotation3<f64>, [TriadErrors; 2]) {
        let package = self.package_from_case.rotation(stream);
        let mut triads = [&self.grade.accelerometer, &self.grade.gyroscope]
            .map(|grade| TriadErrors::draw(grade, self.geometry, &package, stream));
        for (triad, bias) in triads.iter_mut().zip(self.biases) {
            triad.model.bias = bias.unwrap_or(triad.model.bias);
        }
        for fault in &self.faults {
            if let InjectedFault::Scale { channels, axis, size } = *fault {
                triads[channels as usize]
                    .model
                    .matrix
                    .row_mut(axis)
                    .scale_mut(size);
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
        (package, triads)
    }

    /// Moves the biases on by what the unit has aged, and gives that.
    fn age(&self, triads: [&mut TriadErrors; 2], stream: &mut RandomStream) -> [Vector3<f64>; 2] {
        let turn_on = [&self.grade.accelerometer, &self.grade.gyroscope].map(|grade| grade.turn_on_bias);
        let aged = core::array::from_fn(|i| self.ageing[i].bias(turn_on[i], stream));
        for (triad, bias) in triads.into_iter().zip(aged) {
            triad.model.bias += bias;
        }
        aged
    }

    /// Computes the readings of the triads for the motion, and the mean temperature above the reference one, K.
    ///
    /// Rows of specific force and angular rate begin as noise and become readings.
    fn readings(
        &self,
        conditions: &Conditions,
        motion: &impl Trajectory,
        clock: &ClockTruth,
        [accelerometer, gyroscope]: [&TriadErrors; 2],
        [mut forces, mut rates]: [Vec<[f64; 3]>; 2],
    ) -> (RecordedSamples, f64) {
        let count = forces.len();
        let (mut time, mut arrival) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut temperatures = Vec::with_capacity(count);
        let mut warmth_sum = 0.0;
        for (index, (force, rate)) in forces.iter_mut().zip(&mut rates).enumerate() {
            let t = clock.session_time(self.rate, index);
            let truth = self.felt(motion.truth(t), t);
            let temperature = conditions.warming.temperature(t);
            let warmth = temperature - REFERENCE_TEMPERATURE;
            let f = &truth.specific_force;
            *force = accelerometer.reading(f, f, warmth, &Vector3::from(*force)).into();
            *rate = gyroscope
                .reading(&truth.angular_rate, f, warmth, &Vector3::from(*rate))
                .into();
            time.push(clock.own_time(self.rate, index));
            arrival.push(t + self.latency);
            temperatures.push(quantised(temperature, self.grade.temperature_step));
            warmth_sum += warmth;
        }
        let samples = RecordedSamples {
            time,
            arrival,
            accelerometer: forces,
            gyroscope: rates,
            temperature: temperatures,
        };
        (samples, warmth_sum / count.max(1) as f64)
    }

    /// Truth where the unit sits and as it has slipped by session time `t`.
    ///
    /// Away from the turning centre the table's acceleration is felt: `f + alpha x r + w x (w x r)`.
    fn felt(&self, truth: TrueMotion, t: f64) -> TrueMotion {
        let (arm, w) = (&self.lever_arm, &truth.turn_rate);
        let pull = truth.turn_acceleration.cross(arm) + w.cross(&w.cross(arm));
        let placed = TrueMotion {
            specific_force: truth.specific_force + pull,
            ..truth
        };
        let slips = self.faults.iter().filter_map(|fault| fault.slip(t));
        slips.fold(placed, |truth, slip| TrueMotion {
            specific_force: slip * truth.specific_force,
            angular_rate: slip * truth.angular_rate,
            ..truth
        })
    }
}
