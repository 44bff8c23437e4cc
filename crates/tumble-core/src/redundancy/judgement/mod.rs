//! Who is wrong: one sequential test on all pairs of units, over four scales of time, at rest and in motion.
//!
//! Every window, all units are compared as the primary would read, at its place. A pair disagrees when it is farther apart
//! than drift within specification, noise, motion and the uncertainty of its calibrations explain together. Of three
//! units and more, the one is at fault without which the others agree; of two, what each says against itself decides, or
//! nobody can know.
//!
//! Derivation: docs/theory/judgement.md.

pub mod attribution;
mod isolation;
mod motion;
mod noise;
mod pair;
mod scales;
mod sensor_judge;
mod shaking;
mod turn;
mod unit;
mod warmth;

pub use pair::Disagreement;
pub(crate) use unit::SLOW_OFFSET;

use nalgebra::Vector3;

use crate::products::{squared, zeros};
use crate::real::{Real, count, real};
use crate::redundancy::aiding::{AidingEvidence, Surroundings};
use crate::redundancy::components::{difference, follow, smaller};
use crate::redundancy::judgement::attribution::Proof;
use crate::redundancy::judgement::motion::SetMotion;
use crate::redundancy::judgement::pair::ShownByPairs;
use crate::redundancy::judgement::sensor_judge::{FindAided, SensorJudge};
use crate::redundancy::judgement::turn::{Turned, UsualError};
use crate::redundancy::judgement::unit::CarriedGravity;
use crate::redundancy::judgement::warmth::Temperatures;
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::samples::steps::UnitSteps;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::ForceAndRate;
use crate::redundancy::unit_set::UnitSet;

/// What a unit says over a window, as the primary would at its place, with everything taken off that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitReading<T: Real> {
    /// Specific force, m/s^2, and angular rate, rad/s.
    pub reading: [Vector3<T>; 2],
    /// Standard deviation of white noise and vibration from sample to sample, m/s^2 and rad/s.
    pub scatter: [T; 2],
    /// Whether each sensor may be compared.
    pub votes: [bool; 2],
    /// Whether enough is known of each to expect what it says. An uncalibrated unit is compared for what no calibration explains, and
    /// nothing is learnt from it.
    pub known: [bool; 2],
    /// Whether each was calibrated: what it is known by.
    pub calibrated: [bool; 2],
    /// Whether motion showed all directions of each calibration.
    pub matrix_shown: [bool; 2],
    /// Sigma of its lever arm, m; infinite where it is not known.
    pub place: T,
    /// Residual of a channel that its calibration leaves on pairs, squared, `(m/s^2)^2` and `(rad/s)^2`.
    pub residual: [T; 2],
    /// Of an uncalibrated unit, square of all that a calibration could find; zero of others.
    pub unfound: [T; 2],
    /// From sample to sample, s.
    pub interval: T,
    /// `|f| - g`, m/s^2, and `|w|`, rad/s, over this rest; `None` in motion, and until the rest has lasted.
    pub at_rest: Option<[T; 2]>,
}

impl<T: Real> UnitReading<T> {
    /// Whether a sensor may be compared.
    pub fn votes(&self, sensor: Sensor) -> bool {
        *sensor.of(&self.votes)
    }

    /// Whether a sensor may be compared, and more is known of it than of an uncalibrated unit.
    pub fn is_known(&self, sensor: Sensor) -> bool {
        self.votes(sensor) && *sensor.of(&self.known)
    }
}

/// A window of the whole set.
pub struct SetWindow<'a, T: Real, const UNITS: usize> {
    /// `None` for a unit that said nothing.
    pub units: &'a [Option<UnitReading<T>>; UNITS],
    /// Changes from sample to sample of each unit, in its own axes.
    pub steps: &'a [UnitSteps<T>; UNITS],
    /// How each is built in.
    pub mounted: &'a [MountedUnit<T>; UNITS],
    /// Its number on the common clock, and the length of one, microseconds.
    pub number: u64,
    /// Microseconds.
    pub span: u64,
    /// The same, s.
    pub length: T,
    /// Magnitude of gravity, m/s^2.
    pub gravity: T,
    /// Drift within specification, m/s^2 and rad/s.
    pub tolerated: ForceAndRate<T>,
    /// Drift of the bias of an axis, m/s^2 and rad/s a kelvin.
    pub per_kelvin: ForceAndRate<T>,
    /// Scatter of a unit over what the others make one expect that excludes it.
    pub noise_ratio: T,
    /// Whether means are taken only: physics has the first word, at rest.
    pub means_only: bool,
}

/// What the judge finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Judgement<T: Real> {
    /// This unit is wrong: the others agree without it.
    OutOfFamily {
        /// Number of the unit.
        unit: usize,
        /// Its worst pair.
        figures: Disagreement<T>,
        /// Time over which it shows, s.
        scale: T,
        /// Units that agree with each other, a bit each.
        agreeing: u8,
    },
    /// This unit is noisier than it was beside the others.
    Noisy {
        /// Number of the unit.
        unit: usize,
        /// Scatter, m/s^2 or rad/s.
        scatter: T,
        /// What it may be.
        limit: T,
    },
    /// Of two units that disagree, this one is wrong.
    Blamed {
        /// Number of the unit.
        unit: usize,
        /// What proves it.
        proof: Proof<T>,
    },
    /// Two units disagree, and nobody knows yet which is wrong.
    Disagree {
        /// Their numbers.
        units: [usize; 2],
        /// How far apart.
        figures: Disagreement<T>,
        /// Time over which it shows, s.
        scale: T,
    },
    /// They agree again.
    Agree {
        /// Their numbers.
        units: [usize; 2],
    },
    /// A unit that was wrong has agreed with all others for long enough.
    Reinstated {
        /// Number of the unit.
        unit: usize,
    },
}

/// What is kept of a unit to hold against itself.
#[derive(Clone, Copy, Debug, PartialEq)]
struct UnitEvidence<T: Real> {
    gravity: CarriedGravity<T>,
    /// What its gyroscope says at rest, rad/s: no turning.
    resting_rate: Vector3<T>,
    at_rest: [RestInHealth<T>; 2],
    /// Whether it was at rest in the window before.
    rests: bool,
}

/// What a sensor of a unit says at rest in health: `|f| - g`, m/s^2, or `|w|`, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RestInHealth<T: Real> {
    /// Over the latest rests; zero before any: physics alone.
    usual: T,
    /// How far it strays from that, in other attitudes.
    strays: T,
    rests: u8,
}

/// Rests over which it is taken.
const USUAL_RESTS: u8 = 8;

/// Share of how far it strays that is left after another rest; many are in the same attitude.
const STRAYED_BEFORE: f64 = 0.99;

impl<T: Real> RestInHealth<T> {
    /// Physics alone.
    fn unknown() -> Self {
        Self {
            usual: T::zero(),
            strays: T::zero(),
            rests: 0,
        }
    }

    /// Takes in what it says at another rest.
    fn learn(&mut self, said: T) {
        self.strays = (said - self.usual).abs().max(self.strays * real(STRAYED_BEFORE));
        self.rests = self.rests.saturating_add(1).min(USUAL_RESTS);
        self.usual += (said - self.usual) / count(self.rests.into());
    }
}

/// Judges a set of `UNITS` units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judge<T: Real, const UNITS: usize> {
    motion: SetMotion<T>,
    shown: ShownByPairs<T, UNITS>,
    sensors: [SensorJudge<T, UNITS>; 2],
    evidence: [UnitEvidence<T>; UNITS],
    /// Angular rate of the set at the last rest in health, rad/s: what is no turning.
    resting_rate: Vector3<T>,
    /// How far the set has turned lately, rad, and what that makes accelerometers say beyond carried gravity.
    turned: Turned<T>,
    usual_error: UsualError<T>,
    temperatures: Temperatures<T, UNITS>,
}

/// Share of what a pair may be apart from which on nobody follows either of the two.
const DOUBTED: f64 = 0.9;

impl<T: Real, const UNITS: usize> Default for Judge<T, UNITS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const UNITS: usize> Judge<T, UNITS> {
    /// Nothing seen.
    pub fn new() -> Self {
        let unit = UnitEvidence {
            gravity: CarriedGravity::new(),
            resting_rate: zeros(),
            at_rest: [RestInHealth::unknown(); 2],
            rests: false,
        };
        Self {
            motion: SetMotion::new(),
            shown: ShownByPairs::new(),
            sensors: [SensorJudge::new(); 2],
            evidence: [unit; UNITS],
            resting_rate: zeros(),
            turned: Turned::not(),
            usual_error: UsualError::unknown(),
            temperatures: Temperatures::unknown(),
        }
    }

    /// Takes in how warm a unit is, degC; not a number where nobody knows.
    pub(crate) fn set_temperature(&mut self, unit: usize, value: T) {
        self.temperatures.set(unit, value);
    }

    /// What a unit says has another meaning from now on: it was calibrated.
    pub fn recalibrated(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).recalibrated(unit);
        self.temperatures.calibrated(unit);
        self.shown.forget(unit);
        if let Some(evidence) = self.evidence.get_mut(unit) {
            *sensor.of_mut(&mut evidence.at_rest) = RestInHealth::unknown();
        }
    }

    /// What a unit says counts for nothing until it is calibrated: physics found it off.
    pub(crate) fn disown(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).disown(unit);
    }

    /// Physics spoke for a unit: what others found of it does not hold.
    pub(crate) fn begin_anew(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).begin_anew(unit);
    }

    /// So much more is taken off what a calibrated unit says from now on, m/s^2 or rad/s, beside a primary that physics found
    /// right.
    pub(crate) fn trimmed(&mut self, sensor: Sensor, unit: usize, change: &Vector3<T>, anew: bool) {
        sensor
            .of_mut(&mut self.sensors)
            .trimmed(sensor, unit, change, anew);
        if anew {
            self.temperatures.calibrated(unit);
        }
    }

    /// How far a unit is from another over ten seconds, m/s^2 or rad/s; `None` until it has said something for as long.
    pub(crate) fn apart_for_long(&self, sensor: Sensor, [i, j]: [usize; 2]) -> Option<T> {
        sensor.of(&self.sensors).apart_for_long(i, j)
    }

    /// A unit that was never calibrated was found to agree with the primary: it has a vote from now on, and what it is off
    /// by is no fault.
    pub fn accept(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).accept(sensor, unit);
        self.temperatures.calibrated(unit);
    }

    /// Units that have that vote.
    pub(crate) fn accepted(&self, sensor: Sensor) -> UnitSet {
        sensor.of(&self.sensors).accepted()
    }

    /// Median over units of angular rates as the primary would read them, rad/s; of those that are not at fault.
    pub fn set_rate<'a>(
        &self,
        units: UnitSet,
        rate: &dyn Fn(usize) -> Option<&'a Vector3<T>>,
    ) -> Option<Vector3<T>> {
        let [_, judge] = &self.sensors;
        judge.median_of(units, rate)
    }

    /// The time of the set jumped: means begin anew, verdicts stay.
    pub fn restart_time(&mut self) {
        self.motion = SetMotion::new();
        self.sensors.iter_mut().for_each(SensorJudge::restart_time);
    }

    /// Whether a sensor of a unit was found wrong and has not been reinstated.
    pub fn is_faulty(&self, sensor: Sensor, unit: usize) -> bool {
        sensor.of(&self.sensors).is_faulty(unit)
    }

    /// Whether units disagree of which nobody knows yet who is wrong.
    pub fn is_disputed(&self, sensor: Sensor) -> bool {
        sensor.of(&self.sensors).is_disputed()
    }

    /// Whether a unit is one of two that disagree.
    pub fn is_disputed_with(&self, sensor: Sensor, unit: usize) -> bool {
        sensor.of(&self.sensors).is_disputed_with(unit)
    }

    /// Whether others contradict a unit, or nearly so, though nobody was found wrong.
    pub fn is_doubted(&self, sensor: Sensor, unit: usize) -> bool {
        sensor.of(&self.sensors).worst_squared(unit) > real(DOUBTED * DOUBTED)
    }

    /// Examines the next window, beside aiding measurements once there were any, and reports what it finds.
    pub(crate) fn look(
        &mut self,
        window: &SetWindow<'_, T, UNITS>,
        aiding_evidence: Option<&mut AidingEvidence<T, UNITS>>,
        tell: &mut dyn FnMut(Sensor, Judgement<T>),
    ) {
        let [mut voters, mut known] = [[UnitSet::default(); 2]; 2];
        for (number, unit) in window.units.iter().enumerate() {
            let Some(unit) = unit else { continue };
            for sensor in SENSORS {
                if unit.votes(sensor) {
                    sensor.of_mut(&mut voters).insert(number);
                }
                if unit.is_known(sensor) {
                    sensor.of_mut(&mut known).insert(number);
                }
            }
        }
        let said = SENSORS.map(|sensor| {
            let said = |unit: usize| Some(sensor.of(&window.units.get(unit)?.as_ref()?.reading));
            sensor.of(&self.sensors).median_of(*sensor.of(&known), &said)
        });
        let [Some(f), Some(w)] = said else { return };
        let vibration = SENSORS.map(|sensor| self.vibration(sensor, window.units));
        let strains = self.motion.push(&[f, w], vibration, window.length);
        self.carry_gravity(window);
        self.turned
            .push(&difference(&w, &self.resting_rate), window.length);
        let aiding_evidence = aiding_evidence.map(|aiding_evidence| {
            self.hear(aiding_evidence, window, [&f, &w]);
            &*aiding_evidence
        });
        let find_aided = aiding_evidence.map(|_| SensorJudge::find_aided as FindAided<T, UNITS>);
        for sensor in SENSORS {
            let said = match sensor {
                Sensor::Accelerometer => &f,
                Sensor::Gyroscope => &w,
            };
            let judge = sensor.of_mut(&mut self.sensors);
            judge.take(sensor, window, said, sensor.of(&strains));
            if window.means_only {
                continue;
            }
            let case = sensor_judge::Case {
                sensor,
                window,
                evidence: &self.evidence,
                aiding_evidence,
                find_aided,
                usual_error: self.usual_error.variance(&self.turned),
                temperatures: &self.temperatures,
                turned: &self.turned,
                force: f,
                change: sensor.of(&strains).change(),
                voters: *sensor.of(&voters),
                known: *sensor.of(&known),
            };
            judge.judge(&case, &mut self.shown, &mut |judgement| tell(sensor, judgement));
        }
        self.learn(window, &w);
        for (evidence, unit) in self.evidence.iter_mut().zip(window.units) {
            evidence.rests = unit.as_ref().is_some_and(|unit| unit.at_rest.is_some());
        }
    }

    /// What the aiding measurement makes of the window.
    fn hear(
        &self,
        aiding_evidence: &mut AidingEvidence<T, UNITS>,
        window: &SetWindow<'_, T, UNITS>,
        said: [&Vector3<T>; 2],
    ) {
        let sensors = &self.sensors;
        let surroundings = Surroundings {
            units: window.units,
            said,
            resting_rate: &self.resting_rate,
            faulty: core::array::from_fn(|unit| SENSORS.map(|sensor| sensor.of(sensors).is_faulty(unit))),
            departs: core::array::from_fn(|unit| {
                SENSORS.map(|sensor| sensor.of(sensors).departs(unit, window.tolerated.of(sensor)))
            }),
            calm: sensors.iter().all(|judge| judge.is_calm(window.length)),
            number: window.number,
            span: window.span,
            length: window.length,
            gravity: window.gravity,
            tolerated: window.tolerated,
        };
        aiding_evidence.advance(&surroundings);
    }

    /// Each unit's own gyroscope carries its gravity.
    fn carry_gravity(&mut self, window: &SetWindow<'_, T, UNITS>) {
        for (evidence, unit) in self.evidence.iter_mut().zip(window.units) {
            let Some(unit) = unit else { continue };
            let [f, w] = &unit.reading;
            if unit.at_rest.is_some() {
                follow(&mut evidence.resting_rate, w, window.length);
            }
            let turning = difference(w, &evidence.resting_rate);
            evidence.gravity.push(f, &turning, window.gravity, window.length);
        }
    }

    /// What health looks like, while nobody disagrees.
    fn learn(&mut self, window: &SetWindow<'_, T, UNITS>, rate: &Vector3<T>) {
        if window.means_only || self.sensors.iter().any(|judge| !judge.is_calm(window.length)) {
            return;
        }
        let mut rests = false;
        for (number, (evidence, unit)) in self.evidence.iter_mut().zip(window.units).enumerate() {
            let Some(unit) = unit else { continue };
            let learns =
                |sensor: Sensor| unit.is_known(sensor) && !sensor.of(&self.sensors).is_faulty(number);
            let Some(at_rest) = &unit.at_rest else {
                if learns(Sensor::Accelerometer) {
                    let square = squared(evidence.gravity.error()) / real(3.0);
                    self.usual_error.learn(square, &self.turned, window.length);
                }
                continue;
            };
            for sensor in SENSORS.into_iter().filter(|sensor| learns(*sensor)) {
                if !evidence.rests {
                    sensor.of_mut(&mut evidence.at_rest).learn(*sensor.of(at_rest));
                }
                rests = true;
            }
        }
        if rests {
            follow(&mut self.resting_rate, rate, window.length);
        }
    }

    /// The second smallest variance, or of two units the smaller: one that shakes alone is no vibration of the set.
    fn vibration(&self, sensor: Sensor, units: &[Option<UnitReading<T>>; UNITS]) -> T {
        let mut least = [real::<T>(f64::INFINITY); 2];
        let mut voters = 0_u8;
        for unit in units.iter().flatten().filter(|unit| unit.is_known(sensor)) {
            voters = voters.saturating_add(1);
            let scatter = *sensor.of(&unit.scatter);
            let [first, second] = least;
            least = if scatter < first {
                [scatter, first]
            } else {
                [first, smaller(second, scatter)]
            };
        }
        let [first, second] = least;
        let vibration = match voters {
            0 => T::zero(),
            1 | 2 => first,
            _ => second,
        };
        vibration * vibration
    }
}

#[cfg(test)]
mod tests;
