//! Missions of a redundant set: rest, smooth motion at random, rest; and a monitor that is taken through them.

use core::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use tumble_core::gravity;
use tumble_core::model::ErrorModel;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::redundancy::monitor::event::{Event, EventKind};
use tumble_core::redundancy::output::Output;
use tumble_core::redundancy::platform::{MountedUnit, Platform, PrimaryCalibration};
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::{CollectionSettings, EvaluationSettings, RedundancySettings};
use tumble_core::redundancy::unit_count::{UnitCount, Units};
use tumble_core::sample::Sample;

use crate::common::{Draws, cast};

pub const SECOND: u64 = 1_000_000;
/// Where missions begin on the common clock, microseconds.
pub const START: u64 = 40 * SECOND;

/// One unit as it really is.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub errors: [ErrorModel<f64>; 2],
    /// From the primary to it, m.
    pub lever_arm: Vector3<f64>,
    /// From sample to sample, microseconds.
    pub period: u64,
    /// Phase of the time of its samples, microseconds.
    pub phase: u64,
    /// Standard deviation, m/s^2 and rad/s.
    pub noise: [f64; 2],
}

impl Part {
    /// Reads the truth, but for noise.
    pub fn exact() -> Self {
        Self {
            errors: [ErrorModel::identity(); 2],
            lever_arm: Vector3::zeros(),
            period: 10_000,
            phase: 0,
            noise: [0.01, 0.001],
        }
    }

    /// Reads what was not calibrated for long, somewhere else on the platform.
    pub fn aged() -> Self {
        let matrix = Matrix3::new(1.01, 0.004, -0.003, 0.002, 0.992, 0.005, -0.006, 0.003, 1.008);
        let model = |x, y, z| ErrorModel {
            matrix,
            bias: Vector3::new(x, y, z),
        };
        Self {
            errors: [model(0.3, -0.2, 0.25), model(0.02, -0.03, 0.015)],
            lever_arm: Vector3::new(0.06, -0.04, 0.02),
            ..Self::exact()
        }
    }

    /// The same with biases of its own.
    pub fn biased(mut self, specific_force: [f64; 3], angular_rate: [f64; 3]) -> Self {
        for (model, bias) in self.errors.iter_mut().zip([specific_force, angular_rate]) {
            model.bias = Vector3::from(bias);
        }
        self
    }
}

/// Phases of the platform's motion.
#[derive(Clone, Copy, Debug)]
pub enum Phase {
    Rest,
    /// Moves about all axes; the factor is on rates and specific forces alike.
    Free(f64),
    /// Turns about z alone.
    AboutZ,
    /// Vibrates, and goes nowhere.
    Shaken,
    /// Moves gently about all axes, and vibrates at 80 Hz by so much, m/s^2, and 0.03 of it in rad/s.
    Vibrating(f64),
}

/// Changes a sample at a time since the start, s; returns whether it arrives.
pub type Spoil = Box<dyn Fn(usize, f64, &mut Sample<f64>) -> bool>;

pub struct Mission {
    pub seed: u64,
    pub start: u64,
    pub phases: Vec<(f64, Phase)>,
    pub parts: Vec<Part>,
    pub spoil: Spoil,
}

pub type Arrivals = Vec<(usize, Sample<f64>)>;

impl Mission {
    /// Rests, moves for long enough to be calibrated, and rests.
    pub fn new(seed: u64, parts: &[Part]) -> Self {
        Self {
            seed,
            start: START,
            phases: vec![(2.5, Phase::Rest), (12.0, Phase::Free(1.0)), (3.0, Phase::Rest)],
            parts: parts.to_vec(),
            spoil: Box::new(|_, _, _| true),
        }
    }

    pub fn phases(mut self, phases: &[(f64, Phase)]) -> Self {
        self.phases = phases.to_vec();
        self
    }

    pub fn spoilt(mut self, spoil: impl Fn(usize, f64, &mut Sample<f64>) -> bool + 'static) -> Self {
        self.spoil = Box::new(spoil);
        self
    }

    /// The truth at the primary's place, s since the start: m/s^2 and rad/s.
    pub fn truth(&self, time: f64) -> [Vector3<f64>; 2] {
        let up = Vector3::z() * gravity::STANDARD;
        let mut begin = 0.0;
        for (duration, phase) in &self.phases {
            let passed = time - begin;
            if (0.0..*duration).contains(&passed) {
                let edge = (passed.min(duration - passed) / 0.5).clamp(0.0, 1.0);
                let [f, w] = self.motion(*phase, time);
                let share = edge * edge * (3.0 - 2.0 * edge);
                return [up + f * share, w * share];
            }
            begin += duration;
        }
        [up, Vector3::zeros()]
    }

    fn motion(&self, phase: Phase, time: f64) -> [Vector3<f64>; 2] {
        let mut draws = Draws::new(self.seed);
        let mut waves = |size: f64| {
            Vector3::from_fn(|axis, _| {
                (0..3_u32).fold(0.0, |sum, k| {
                    let shift = if axis == 0 { 0.0 } else { 0.07 };
                    let frequency = 0.3 + 0.28 * f64::from(k) + shift;
                    sum + size * (TAU * (frequency * time + draws.normal())).sin()
                })
            })
        };
        let (f, w) = (waves(2.0), waves(0.8));
        match phase {
            Phase::Rest => [Vector3::zeros(); 2],
            Phase::Free(size) => [f * size, w * size],
            Phase::AboutZ => [Vector3::zeros(), Vector3::z() * w.z],
            Phase::Vibrating(size) => {
                let shakes = size * (TAU * 80.0 * time).sin();
                [
                    f * 0.3 + Vector3::new(0.3, 0.2, 1.0) * shakes,
                    w * 0.3 + Vector3::new(0.03, 0.01, 0.0) * shakes,
                ]
            }
            Phase::Shaken => [Vector3::z() * (1.5 * (TAU * 37.0 * time).sin()), Vector3::zeros()],
        }
    }

    /// All samples in the order of their times.
    pub fn samples(&self) -> Arrivals {
        let duration: f64 = self.phases.iter().map(|(duration, _)| duration).sum();
        let mut draws = Draws::new(self.seed ^ 0x5eed);
        let mut arrivals = Vec::new();
        for (number, part) in self.parts.iter().enumerate() {
            let mut since = part.phase;
            while seconds(since) < duration {
                let mut sample = self.sample(part, since, &mut draws);
                if (self.spoil)(number, seconds(since), &mut sample) {
                    arrivals.push((since, number, sample));
                }
                since += part.period;
            }
        }
        arrivals.sort_by_key(|(since, number, _)| (*since, *number));
        arrivals
            .into_iter()
            .map(|(_, number, sample)| (number, sample))
            .collect()
    }

    fn sample(&self, part: &Part, since: u64, draws: &mut Draws) -> Sample<f64> {
        let (time, h) = (seconds(since), 1e-4);
        let [f, w] = self.truth(time);
        let rate = |time| self.truth(time)[1];
        let change = (rate(time + h) - rate(time - h)) / (2.0 * h);
        let arm = &part.lever_arm;
        let there = f + change.cross(arm) + w.cross(&w.cross(arm));
        let [accelerometer, gyroscope] = &part.errors;
        let [force_noise, rate_noise] = part.noise;
        Sample {
            time: self.start + since,
            specific_force: accelerometer.measure(&there) + draws.normals::<3>() * force_noise,
            angular_rate: gyroscope.measure(&w) + draws.normals::<3>() * rate_noise,
        }
    }
}

pub fn seconds(microseconds: u64) -> f64 {
    tumble_core::real::seconds(microseconds)
}

/// The defaults with shorter times, so that missions are short.
pub fn settings<T: Real>() -> RedundancySettings<T> {
    let defaults = RedundancySettings::default();
    RedundancySettings {
        evaluation: EvaluationSettings {
            rest_duration: SECOND,
            ..defaults.evaluation
        },
        collection: CollectionSettings {
            collect: 8 * SECOND,
            collect_timeout: 30 * SECOND,
            motion_timeout: 20 * SECOND,
            fewest_pairs: 100,
            ..defaults.collection
        },
        ..defaults
    }
}

/// Units as the parts are, lever arms known, mounted alike.
pub fn units<T: Real, const UNITS: usize>(parts: &[Part; UNITS]) -> [MountedUnit<T>; UNITS] {
    let mut identity = 10;
    parts.map(|part| {
        identity += 1;
        MountedUnit {
            lever_arm: Some(cast(&part.lever_arm)),
            ..MountedUnit::new(identity)
        }
    })
}

pub fn platform<T: Real, const UNITS: usize>(
    settings: RedundancySettings<T>,
    units: [MountedUnit<T>; UNITS],
) -> Platform<T, UNITS> {
    Platform::new(settings, PrimaryCalibration::none(), units).expect("settings and units are sound")
}

/// A monitor, and all its reports.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight<T: Real, const UNITS: usize, const AT_ONCE: usize = 2>
where
    Units<UNITS>: UnitCount,
{
    pub seed: u64,
    pub monitor: Monitor<T, UNITS, AT_ONCE>,
    pub events: Vec<Event<T>>,
    pub outputs: Vec<Output<T>>,
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize> Flight<T, UNITS, AT_ONCE>
where
    Units<UNITS>: UnitCount,
{
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            monitor: Monitor::new(),
            events: Vec::new(),
            outputs: Vec::new(),
        }
    }

    pub fn take(&mut self, platform: &Platform<T, UNITS>, arrivals: &[(usize, Sample<f64>)]) {
        for (number, sample) in arrivals {
            let sample = Sample {
                time: sample.time,
                specific_force: cast(&sample.specific_force),
                angular_rate: cast(&sample.angular_rate),
            };
            let events = &mut self.events;
            let output = self
                .monitor
                .push(platform, *number, &sample, &mut |event| events.push(event));
            self.outputs.extend(output);
        }
    }

    pub fn restore(&mut self, platform: &Platform<T, UNITS>, record: &Record<T>) {
        let events = &mut self.events;
        self.monitor
            .restore(platform, record, &mut |event| events.push(event));
    }

    pub fn told(&self, unit: usize, is: impl Fn(&EventKind<T>) -> bool) -> usize {
        let events = self.events.iter();
        events
            .filter(|event| event.unit == unit && is(&event.kind))
            .count()
    }

    /// Records adopted of a sensor of a unit.
    pub fn adopted(&self, unit: usize, wanted: Sensor) -> Vec<Record<T>> {
        let of_unit = self.events.iter().filter(|event| event.unit == unit);
        of_unit
            .filter_map(|event| match event.kind {
                EventKind::Adopted { record } if record.sensor == wanted => Some(record),
                _ => None,
            })
            .collect()
    }

    /// Unit and kind of every event.
    pub fn kinds(&self) -> Vec<(usize, String)> {
        self.events
            .iter()
            .map(|event| (event.unit, kind(&event.kind)))
            .collect()
    }

    /// Text that is printed where a law fails.
    pub fn story(&self) -> String {
        let mut story = format!("seed {}\n", self.seed);
        for event in &self.events {
            story += &format!("{} unit {} {:?}\n", event.time, event.unit, event.kind);
        }
        story
    }
}

/// The name of what happened, with sensors and reasons but without figures.
fn kind<T: Real>(what: &EventKind<T>) -> String {
    match what {
        EventKind::Refused { sensor, why } => {
            let why = format!("{why:?}");
            let end = why.find(['(', ' ']).unwrap_or(why.len());
            format!("Refused {sensor:?} {}", &why[..end])
        }
        EventKind::Withheld { .. }
        | EventKind::Abandoned { .. }
        | EventKind::Triggered { .. }
        | EventKind::Selected { .. } => {
            format!("{what:?}")
        }
        EventKind::Evaluated {
            sensor,
            check,
            deviation,
            threshold,
        } => {
            format!("Evaluated {sensor:?} {check:?} {}", deviation > threshold)
        }
        _ => {
            let what = format!("{what:?}");
            let end = what.find(' ').unwrap_or(what.len());
            what[..end].to_owned()
        }
    }
}

/// Takes a monitor through a mission.
pub fn fly<T: Real, const UNITS: usize>(platform: &Platform<T, UNITS>, mission: &Mission) -> Flight<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    let mut flight = Flight::new(mission.seed);
    flight.take(platform, &mission.samples());
    flight
}

/// Fails unless an event of a unit was reported, so many times where that is given.
macro_rules! assert_told {
    ($flight:expr, $unit:expr, $pattern:pat $(if $guard:expr)?) => {
        assert!($flight.told($unit, |kind| matches!(kind, $pattern $(if $guard)?)) > 0, "never {}\n{}",
            stringify!($pattern), $flight.story())
    };
    ($flight:expr, $unit:expr, $times:literal x $pattern:pat $(if $guard:expr)?) => {
        assert_eq!($flight.told($unit, |kind| matches!(kind, $pattern $(if $guard)?)), $times, "{}\n{}",
            stringify!($pattern), $flight.story())
    };
}
pub(crate) use assert_told;

/// Fails unless a record holds the errors of a part within 5 sigma, and sigma itself is small.
pub fn assert_holds<T: Real>(record: &Record<T>, part: &Part, seed: u64) {
    let [accelerometer, gyroscope] = &part.errors;
    let (truth, size) = match record.sensor {
        Sensor::Accelerometer => (accelerometer, 1.0),
        Sensor::Gyroscope => (gyroscope, 0.1),
    };
    let bias = record.model.bias.iter().zip(&truth.bias).zip(&record.bias_sigma);
    for ((found, truth), sigma) in bias {
        let allowed = (*sigma * real(5.0)).min(real(0.02 * size));
        assert!(
            (*found - real(*truth)).abs() <= allowed,
            "bias, seed {seed}: {record:?}"
        );
    }
    let matrix = record
        .model
        .matrix
        .iter()
        .zip(&truth.matrix)
        .zip(&record.matrix_sigma);
    for ((found, truth), sigma) in matrix {
        let allowed = (*sigma * real(5.0)).min(real(0.005));
        assert!(
            (*found - real(*truth)).abs() <= allowed,
            "matrix, seed {seed}: {record:?}"
        );
    }
}
