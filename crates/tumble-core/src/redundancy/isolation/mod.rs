//! Fault isolation: one sequential test on all pairs of units, over four scales of time, at rest and in motion.
//!
//! In every window all units are compared, each converted to the place and axes of the primary. A pair
//! disagrees when its difference exceeds what drift within specification, noise, motion and the uncertainty of
//! its calibrations explain together. Among three or more units, the faulty one is that without which the
//! others agree. Between two, evidence from each unit alone decides; without such evidence the faulty unit
//! cannot be isolated.
//!
//! Derivation: docs/theory/isolation.md.

pub mod attribution;
mod delay;
mod motion;
mod noise;
mod odd_one;
mod pair;
mod scales;
mod sensor_isolator;
mod shaking;
mod turn;
mod unit;
mod warmth;

pub use pair::Disagreement;

use nalgebra::Vector3;

use crate::products::{squared, zeros};
use crate::real::{Real, count, real};
use crate::redundancy::aiding::{AidedReading, AidingEvidence, AidingWindow};
use crate::redundancy::components::{difference, follow, set_all, smaller, sum};
use crate::redundancy::isolation::attribution::Proof;
use crate::redundancy::isolation::delay::Delays;
use crate::redundancy::isolation::motion::SetMotion;
use crate::redundancy::isolation::pair::ShownByPairs;
use crate::redundancy::isolation::sensor_isolator::{FindAided, SensorIsolator};
use crate::redundancy::isolation::turn::{Turned, UsualError};
use crate::redundancy::isolation::unit::CarriedGravity;
use crate::redundancy::isolation::warmth::Temperatures;
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::samples::steps::UnitSteps;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::ForceAndRate;
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::redundancy::unit_set::UnitSet;

/// Reading of a unit over a window, at the place and in the axes of the primary, with all known errors
/// corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitReading<T: Real> {
    /// Specific force, m/s^2, and angular rate, rad/s.
    pub reading: [Vector3<T>; 2],
    /// Standard deviation of white noise and vibration from sample to sample, m/s^2 and rad/s.
    pub scatter: [T; 2],
    /// True if the sensor may be compared.
    pub votes: [bool; 2],
    /// True if the errors of the sensor are known well enough to predict its readings. An uncalibrated unit is
    /// compared only for differences that no calibration explains, and nothing is learnt from it.
    pub known: [bool; 2],
    /// True if the sensor was calibrated.
    pub calibrated: [bool; 2],
    /// True if motion showed all directions of the calibration.
    pub matrix_shown: [bool; 2],
    /// Sigma of its lever arm, m; infinite where it is not known.
    pub place: T,
    /// Residual of a channel that its calibration leaves on pairs, squared, `(m/s^2)^2` and `(rad/s)^2`.
    pub residual: [T; 2],
    /// Square of the largest error that a calibration could find in an uncalibrated unit; zero for other units.
    pub uncertainty: [T; 2],
    /// Sample interval, s.
    pub interval: T,
    /// `|f| - g`, m/s^2, and `|w|`, rad/s, over this rest; `None` in motion, and until the rest has lasted.
    pub at_rest: Option<[T; 2]>,
}

impl<T: Real> UnitReading<T> {
    /// Returns whether a sensor may be compared.
    pub fn votes(&self, sensor: Sensor) -> bool {
        *sensor.of(&self.votes)
    }

    /// Returns whether a sensor may be compared and is better known than that of an uncalibrated unit.
    pub fn is_known(&self, sensor: Sensor) -> bool {
        self.votes(sensor) && *sensor.of(&self.known)
    }
}

/// A window of the whole set.
pub struct SetWindow<'a, T: Real, const UNITS: usize> {
    /// Readings; `None` for a unit without a reading in this window.
    pub units: &'a [Option<UnitReading<T>>; UNITS],
    /// Changes from sample to sample of each unit, in its own axes.
    pub steps: &'a [UnitSteps<T>; UNITS],
    /// Mounting of each unit.
    pub mounted: &'a [MountedUnit<T>; UNITS],
    /// Number of the window on the common clock.
    pub number: u64,
    /// Length of the window, microseconds.
    pub span: u64,
    /// Length of the window, s.
    pub length: T,
    /// Magnitude of gravity, m/s^2.
    pub gravity: T,
    /// Drift within specification, m/s^2 and rad/s.
    pub tolerated: ForceAndRate<T>,
    /// Drift of the bias of an axis, m/s^2 and rad/s a kelvin.
    pub per_kelvin: ForceAndRate<T>,
    /// Ratio of the scatter of a unit to the scatter expected from the other units above which the unit is
    /// excluded.
    pub noise_ratio: T,
    /// True if only means are updated, because checks against physics come first at rest.
    pub means_only: bool,
}

/// Finding of the isolator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IsolationEvent<T: Real> {
    /// This unit is wrong: the others agree without it.
    OutOfFamily {
        /// Number of the unit.
        unit: usize,
        /// Its worst pair.
        figures: Disagreement<T>,
        /// Time scale on which the deviation shows, s.
        scale: T,
        /// Units that agree with each other, one bit each.
        agreeing: u8,
    },
    /// This unit is noisier than before, compared with the others.
    Noisy {
        /// Number of the unit.
        unit: usize,
        /// Scatter, m/s^2 or rad/s.
        scatter: T,
        /// Largest scatter that is accepted.
        limit: T,
    },
    /// This unit is the faulty one of two that disagree.
    Isolated {
        /// Number of the unit.
        unit: usize,
        /// Evidence that decided.
        proof: Proof<T>,
    },
    /// The delay of this unit grows: its clock drifts.
    ClockDrifts {
        /// Number of the unit.
        unit: usize,
        /// Growth of its delay since it was first measured, s, without its sign.
        by: T,
        /// Largest growth that is accepted, s.
        limit: T,
    },
    /// Two units disagree, and no evidence yet isolates the faulty one.
    Disagree {
        /// Their numbers.
        units: [usize; 2],
        /// Difference and threshold.
        figures: Disagreement<T>,
        /// Time scale on which the disagreement shows, s.
        scale: T,
    },
    /// Two units agree again.
    Agree {
        /// Their numbers.
        units: [usize; 2],
    },
    /// A unit that was excluded has agreed with all others for long enough.
    Reinstated {
        /// Number of the unit.
        unit: usize,
    },
}

/// Evidence kept of each unit that is compared with the unit itself.
#[derive(Clone, Copy, Debug, PartialEq)]
struct UnitEvidence<T: Real> {
    gravity: CarriedGravity<T>,
    /// Mean output of the gyroscope at rest, rad/s: its zero rate.
    resting_rate: Vector3<T>,
    at_rest: [RestInHealth<T>; 2],
    /// Number of rests over which each mean was taken, up to [`USUAL_RESTS`].
    taken: [u8; 2],
    /// True if the unit was at rest in the previous window.
    rests: bool,
}

impl<T: Real> UnitEvidence<T> {
    fn none() -> Self {
        Self {
            gravity: CarriedGravity::new(),
            resting_rate: zeros(),
            at_rest: [RestInHealth::unknown(); 2],
            taken: [0; 2],
            rests: false,
        }
    }
}

/// Usual reading of a sensor at rest while it is healthy: `|f| - g`, m/s^2, or `|w|`, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RestInHealth<T: Real> {
    /// Mean over the latest rests; zero before the first, where physics alone predicts the reading.
    usual: T,
    /// Largest deviation from that mean in other attitudes.
    strays: T,
}

/// Rests over which the mean is taken.
const USUAL_RESTS: u8 = 8;

/// Share of the largest deviation that remains after another rest; many rests are in the same attitude.
const STRAYED_BEFORE: f64 = 0.99;

impl<T: Real> RestInHealth<T> {
    /// Prediction from physics alone.
    fn unknown() -> Self {
        Self {
            usual: T::zero(),
            strays: T::zero(),
        }
    }

    /// Updates mean, deviation and number of rests with the reading of another rest.
    fn learn(&mut self, measured: T, rests: &mut u8) {
        self.strays = (measured - self.usual)
            .abs()
            .max(self.strays * real(STRAYED_BEFORE));
        *rests = rests.saturating_add(1).min(USUAL_RESTS);
        self.usual += (measured - self.usual) / count((*rests).into());
    }
}

/// Isolates faulty units: compares a set of `UNITS` units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultIsolator<T: Real, const UNITS: usize>
where
    Units<UNITS>: UnitCount,
{
    motion: SetMotion<T>,
    shown: ShownByPairs<T, UNITS>,
    sensors: [SensorIsolator<T, UNITS>; 2],
    evidence: [UnitEvidence<T>; UNITS],
    /// Mean angular rate of the set over rests in health, rad/s: its zero rate.
    resting_rate: Vector3<T>,
    /// Angle by which the set turned recently, rad, and the error of carried gravity that such turns cause.
    turned: Turned<T>,
    usual_error: UsualError<T>,
    temperatures: Temperatures<T, UNITS>,
    delays: Delays<T, UNITS>,
    /// Sum of the trims of each gyroscope since its calibration, rad/s: a measure of its warming.
    trimmed: [Vector3<T>; UNITS],
}

/// Ratio of a difference to its threshold above which neither unit of a pair is trusted.
const DOUBTED: f64 = 0.9;

impl<T: Real, const UNITS: usize> Default for FaultIsolator<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const UNITS: usize> FaultIsolator<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    /// Creates an isolator that has received no window.
    pub fn new() -> Self {
        Self {
            motion: SetMotion::new(),
            shown: ShownByPairs::new(),
            sensors: [SensorIsolator::new(); 2],
            evidence: [UnitEvidence::none(); UNITS],
            resting_rate: zeros(),
            turned: Turned::not(),
            usual_error: UsualError::unknown(),
            temperatures: Temperatures::unknown(),
            delays: Delays::unknown(),
            trimmed: [zeros(); UNITS],
        }
    }

    /// Resets all to a new isolator, in place.
    pub(crate) fn reset(&mut self) {
        let Self {
            motion,
            shown,
            sensors,
            evidence,
            resting_rate,
            turned,
            usual_error,
            temperatures,
            delays,
            trimmed,
        } = self;
        *motion = SetMotion::new();
        *shown = ShownByPairs::new();
        set_all(sensors, SensorIsolator::new());
        set_all(evidence, UnitEvidence::none());
        *resting_rate = zeros();
        *turned = Turned::not();
        *usual_error = UsualError::unknown();
        *temperatures = Temperatures::unknown();
        *delays = Delays::unknown();
        set_all(trimmed, zeros());
    }

    /// Stores the temperature of a unit, degC; NaN where it is unknown.
    pub(crate) fn set_temperature(&mut self, unit: usize, value: T) {
        self.temperatures.set(unit, value);
    }

    /// Resets the statistics of a sensor whose calibration was replaced.
    pub fn recalibrated(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).recalibrated(unit);
        self.temperatures.calibrated(unit);
        self.trim(sensor, unit, None);
        self.shown.forget(unit);
        let primary = self.evidence.first().copied();
        if let Some((evidence, primary)) = self.evidence.get_mut(unit).zip(primary) {
            *sensor.of_mut(&mut evidence.at_rest) = RestInHealth::unknown();
            *sensor.of_mut(&mut evidence.taken) = 0;
            // A calibrated unit reads what the primary reads. Its earlier readings are no evidence on its calibration.
            let is_comparable = Sensor::Accelerometer.of(&self.sensors).accepted().contains(unit);
            evidence.gravity = if is_comparable {
                primary.gravity
            } else {
                CarriedGravity::new()
            };
            if sensor == Sensor::Gyroscope {
                evidence.resting_rate = primary.resting_rate;
            }
        }
    }

    /// Withdraws the vote of a sensor until it is calibrated: a check against physics found it faulty.
    pub(crate) fn withdraw_vote(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).withdraw_vote(unit);
    }

    /// Marks a sensor as faulty that others found so.
    pub(crate) fn exclude(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).exclude(unit);
    }

    /// Ends disputes and forgets means, as others decide from now on, or did so far.
    pub(crate) fn leave(&mut self) {
        self.restart_time();
        self.sensors.iter_mut().for_each(SensorIsolator::end_dispute);
    }

    /// Resets the evidence on a sensor that a check against physics has cleared.
    pub(crate) fn begin_anew(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).begin_anew(unit);
    }

    /// Adjusts the means of a calibrated sensor whose correction changes by `change`, m/s^2 or rad/s, beside a
    /// primary that agrees with physics.
    pub(crate) fn trimmed(&mut self, sensor: Sensor, unit: usize, change: &Vector3<T>, anew: bool) {
        sensor
            .of_mut(&mut self.sensors)
            .trimmed(sensor, unit, change, anew);
        if anew {
            self.temperatures.calibrated(unit);
        }
        if let Some(evidence) = self
            .evidence
            .get_mut(unit)
            .filter(|_| sensor == Sensor::Gyroscope)
        {
            evidence.resting_rate = difference(&evidence.resting_rate, change);
        }
        self.trim(sensor, unit, Some(change).filter(|_| !anew));
    }

    /// Counts what was taken off a gyroscope since its calibration, or begins anew.
    fn trim(&mut self, sensor: Sensor, unit: usize, change: Option<&Vector3<T>>) {
        if let Some(trimmed) = self.trimmed.get_mut(unit).filter(|_| sensor == Sensor::Gyroscope) {
            *trimmed = change.map_or(zeros(), |change| sum(trimmed, change));
        }
    }

    /// Difference of two units over ten seconds, m/s^2 or rad/s; `None` until both have readings for that long.
    pub(crate) fn apart_for_long(&self, sensor: Sensor, [i, j]: [usize; 2]) -> Option<T> {
        sensor.of(&self.sensors).apart_for_long(i, j)
    }

    /// Gives a vote to an uncalibrated unit that agrees with the primary; its remaining error is no fault.
    pub fn accept(&mut self, sensor: Sensor, unit: usize) {
        sensor.of_mut(&mut self.sensors).accept(sensor, unit);
        self.temperatures.calibrated(unit);
        self.trim(sensor, unit, None);
    }

    /// Uncalibrated units that have a vote.
    pub(crate) fn accepted(&self, sensor: Sensor) -> UnitSet {
        sensor.of(&self.sensors).accepted()
    }

    /// Median of the angular rates of units that are not faulty, in the axes of the primary, rad/s.
    pub fn set_rate<'a>(
        &self,
        units: UnitSet,
        rate: &dyn Fn(usize) -> Option<&'a Vector3<T>>,
    ) -> Option<Vector3<T>> {
        let [_, isolator] = &self.sensors;
        isolator.median_of(units, rate)
    }

    /// Resets all means after a jump of the time of the set; decisions stay.
    pub fn restart_time(&mut self) {
        self.motion = SetMotion::new();
        self.delays = Delays::unknown();
        self.sensors.iter_mut().for_each(SensorIsolator::restart_time);
    }

    /// Returns whether a sensor of a unit was found faulty and has not been reinstated.
    pub fn is_faulty(&self, sensor: Sensor, unit: usize) -> bool {
        sensor.of(&self.sensors).is_faulty(unit)
    }

    /// Returns whether units disagree without evidence that isolates the faulty one.
    pub fn is_disputed(&self, sensor: Sensor) -> bool {
        sensor.of(&self.sensors).is_disputed()
    }

    /// Returns whether a unit is one of two that disagree.
    pub fn is_disputed_with(&self, sensor: Sensor, unit: usize) -> bool {
        sensor.of(&self.sensors).is_disputed_with(unit)
    }

    /// Returns whether the difference of a unit from another is near or above its threshold while no unit is
    /// faulty.
    pub fn is_doubted(&self, sensor: Sensor, unit: usize) -> bool {
        sensor.of(&self.sensors).worst_squared(unit) > real(DOUBTED * DOUBTED)
    }

    /// Compares the units over the next window, and with aiding measurements once there are any; reports each
    /// finding.
    pub(crate) fn look(
        &mut self,
        window: &SetWindow<'_, T, UNITS>,
        aiding_evidence: Option<&mut AidingEvidence<T, UNITS>>,
        emit: &mut dyn FnMut(Sensor, IsolationEvent<T>),
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
        let measured = SENSORS.map(|sensor| {
            let measured = |unit: usize| Some(sensor.of(&window.units.get(unit)?.as_ref()?.reading));
            sensor.of(&self.sensors).median_of(*sensor.of(&known), &measured)
        });
        let [Some(f), Some(w)] = measured else { return };
        let vibration = SENSORS.map(|sensor| self.vibration(sensor, window.units));
        let acceleration = self.motion.acceleration(&w, window.length);
        let strains = self.motion.push(&[f, w], vibration, window.length);
        self.carry_gravity(window);
        self.turned
            .push(&difference(&w, &self.resting_rate), window.length);
        let aiding_evidence = aiding_evidence.map(|aiding_evidence| {
            self.update_aiding(aiding_evidence, window);
            &*aiding_evidence
        });
        let find_aided = aiding_evidence.map(|_| SensorIsolator::find_aided as FindAided<T, UNITS>);
        let usual_error = self.usual_error.variance(&self.turned);
        for sensor in SENSORS {
            let measured = match sensor {
                Sensor::Accelerometer => &f,
                Sensor::Gyroscope => &w,
            };
            let [accelerometers, gyroscopes] = &mut self.sensors;
            let (isolator, gyroscopes) = match sensor {
                Sensor::Accelerometer => (accelerometers, Some((&*gyroscopes, &self.trimmed))),
                Sensor::Gyroscope => (gyroscopes, None),
            };
            isolator.take(sensor, window, measured, sensor.of(&strains));
            if window.means_only {
                continue;
            }
            let case = sensor_isolator::Case {
                sensor,
                window,
                gyroscopes,
                evidence: &self.evidence,
                aiding_evidence,
                find_aided,
                usual_error,
                temperatures: &self.temperatures,
                turned: &self.turned,
                force: f,
                change: sensor.of(&strains).change(),
                voters: *sensor.of(&voters),
                known: *sensor.of(&known),
                delays: &self.delays,
            };
            isolator.isolate(&case, self.shown.all(), &mut |found| emit(sensor, found));
        }
        if let Some(acceleration) = acceleration.filter(|_| !window.means_only) {
            self.find_late(window, &acceleration, emit);
        }
        self.learn(window, &w);
        for (evidence, unit) in self.evidence.iter_mut().zip(window.units) {
            evidence.rests = unit.as_ref().is_some_and(|unit| unit.at_rest.is_some());
        }
    }

    /// Finds the unit whose clock drifts: its gyroscope deviates from the set in proportion to angular acceleration
    /// (docs/theory/isolation.md, eq. 23).
    #[inline(never)]
    fn find_late(
        &mut self,
        window: &SetWindow<'_, T, UNITS>,
        acceleration: &Vector3<T>,
        emit: &mut dyn FnMut(Sensor, IsolationEvent<T>),
    ) {
        let [_, gyroscopes] = &mut self.sensors;
        let calibrated = |number: usize| {
            let unit = window.units.get(number).and_then(Option::as_ref);
            unit.is_some_and(|unit| *Sensor::Gyroscope.of(&unit.calibrated))
        };
        let beyond = |number: usize| gyroscopes.beyond_before(number).filter(|_| calibrated(number));
        self.delays.push(acceleration, &beyond, window.length);
        if let Some(grown) = self.delays.drifting(window.length)
            && gyroscopes.exclude(grown.unit)
        {
            gyroscopes.end_dispute();
            emit(
                Sensor::Gyroscope,
                IsolationEvent::ClockDrifts {
                    unit: grown.unit,
                    by: grown.by,
                    limit: grown.limit,
                },
            );
        }
    }

    /// Updates the aiding evidence with the window.
    #[inline(never)]
    fn update_aiding(
        &self,
        aiding_evidence: &mut AidingEvidence<T, UNITS>,
        window: &SetWindow<'_, T, UNITS>,
    ) {
        let of_any = |is_so: &dyn Fn(Sensor, usize) -> bool| {
            UnitSet::of::<UNITS>(|unit| SENSORS.into_iter().any(|sensor| is_so(sensor, unit)))
        };
        let departs = |sensor: Sensor, unit: usize| {
            let isolator = sensor.of(&self.sensors);
            isolator.departs(unit, window.tolerated.of(sensor))
        };
        let readings = window.units.each_ref().map(|unit| {
            let unit = unit.as_ref().filter(|unit| unit.votes == [true; 2])?;
            Some(AidedReading {
                reading: unit.reading,
                noise: unit.scatter.map(|scatter| scatter * scatter * unit.interval),
            })
        });
        let surroundings = AidingWindow {
            readings,
            faulty: of_any(&|sensor, unit| self.is_faulty(sensor, unit)),
            departing: of_any(&departs),
            is_calm: self
                .sensors
                .iter()
                .all(|isolator| isolator.is_calm(window.length)),
            rests: window.units.iter().flatten().any(|unit| unit.at_rest.is_some()),
            number: window.number,
            span: window.span,
            length: window.length,
            gravity: window.gravity,
        };
        aiding_evidence.advance(&surroundings);
    }

    /// Carries the gravity of each unit by its own gyroscope.
    fn carry_gravity(&mut self, window: &SetWindow<'_, T, UNITS>) {
        let usual = self.motion.usual();
        let size = squared(usual).square_root();
        let up = if size > T::zero() {
            usual / size
        } else {
            Vector3::z()
        };
        for (evidence, unit) in self.evidence.iter_mut().zip(window.units) {
            let Some(unit) = unit else { continue };
            let [f, w] = &unit.reading;
            if unit.at_rest.is_some() {
                follow(&mut evidence.resting_rate, w, window.length);
            }
            let turning = difference(w, &evidence.resting_rate);
            evidence
                .gravity
                .push(f, &turning, &up, window.gravity, window.length);
        }
    }

    /// Learns the usual statistics of healthy units, while none disagree.
    fn learn(&mut self, window: &SetWindow<'_, T, UNITS>, rate: &Vector3<T>) {
        if window.means_only
            || self
                .sensors
                .iter()
                .any(|isolator| !isolator.is_calm(window.length))
        {
            return;
        }
        let mut rests = false;
        for (number, (evidence, unit)) in self.evidence.iter_mut().zip(window.units).enumerate() {
            let Some(unit) = unit else { continue };
            let learns =
                |sensor: Sensor| unit.is_known(sensor) && !sensor.of(&self.sensors).is_faulty(number);
            let Some(at_rest) = &unit.at_rest else {
                if learns(Sensor::Accelerometer) {
                    let square = squared(evidence.gravity.error()) * real(0.5);
                    self.usual_error.learn(square, &self.turned, window.length);
                }
                continue;
            };
            for sensor in SENSORS.into_iter().filter(|sensor| learns(*sensor)) {
                if !evidence.rests {
                    let rests = sensor.of_mut(&mut evidence.taken);
                    sensor
                        .of_mut(&mut evidence.at_rest)
                        .learn(*sensor.of(at_rest), rests);
                }
                rests = true;
            }
        }
        if rests {
            follow(&mut self.resting_rate, rate, window.length);
        }
    }

    /// Second smallest variance of scatter, or the smaller one of two units: a unit that shakes alone shows no
    /// vibration of the set.
    #[inline(never)]
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
