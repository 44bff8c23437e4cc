//! Calibration of one secondary: waits for motion, collects pairs, and passes them to the fit.

use nalgebra::Matrix3;

use crate::products::{congruent, product};
use crate::real::{Real, SECOND, count, real, seconds, whole_spans};
use crate::redundancy::evaluation::StoredCalibration;
use crate::redundancy::fit::adoption::RestReadings;
use crate::redundancy::fit::joint_moments::{JointMoments, Merged};
use crate::redundancy::fit::residual::{FORCE_LAYOUT, FORCE_PACKED, PairMoments, RATE_LAYOUT, RATE_PACKED};
use crate::redundancy::fit::rests::Rests;
use crate::redundancy::fit::{Fit, PrimaryNoise};
use crate::redundancy::monitor::event::Abandoned;
use crate::redundancy::monitor::trial::{Trial, TrialData, TrialEnd};
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::samples::history::RestMean;
use crate::redundancy::samples::pair::{FORCE_CHANNELS, MotionPair, RATE_CHANNELS};
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::settings::{CollectionSettings, RedundancySettings};
use crate::sample::CHANNELS;

/// Phase of the calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CalibrationPhase<T: Real> {
    /// The platform has not moved yet.
    WaitingForMotion,
    /// Pairs are collected in motion.
    Collecting,
    /// The pairs are complete: a sensor is being fitted.
    Fitting(Sensor, Trial<T>),
}

/// Measurements at the rest that triggered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestBefore<T: Real> {
    /// Raw means of the primary.
    pub primary: [T; CHANNELS],
    /// Variance of the windows of the primary.
    pub variance: [T; CHANNELS],
    /// Raw means of the secondary.
    pub secondary: [T; CHANNELS],
}

impl<T: Real> RestBefore<T> {
    fn readings(&self, sensor: Sensor, unit: &MountedUnit<T>) -> RestReadings<T> {
        RestReadings {
            first: product(&unit.sensor_from_primary, &sensor.triad(&self.primary)),
            second: sensor.triad(&self.secondary),
        }
    }

    /// Noise of the primary in a pair, from its windows at rest: two thirds of their variance in a triangle,
    /// and twice their variance in the difference of two.
    #[inline(never)]
    fn noise(&self, sensor: Sensor, unit: &MountedUnit<T>, window: u64) -> PrimaryNoise<T> {
        let turn = &unit.sensor_from_primary;
        let of = |sensor: Sensor| sensor.triad(&self.variance);
        let length = seconds::<T>(window);
        PrimaryNoise {
            reading: congruent(
                turn,
                &Matrix3::from_diagonal(&(of(sensor) * real::<T>(2.0 / 3.0))),
            ), // redundancy.md, eq. 10: N
            angular_acceleration: of(Sensor::Gyroscope) * (real::<T>(2.0) / (length * length)), // redundancy.md, eq. 10: 2 v / h^2
        }
    }
}

/// Raw means of both units over the same rest.
pub struct RestPair<'a, T: Real> {
    /// Mean of the primary.
    pub primary: &'a RestMean<T>,
    /// Mean of the secondary.
    pub secondary: &'a RestMean<T>,
    /// Sensors of the primary that were valid at this rest, accelerometer first.
    pub valid: [bool; 2],
    /// Difference from the primary that siblings share with this secondary, m/s^2 and rad/s.
    pub shared: [T; 2],
}

/// Calibration of one secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationRun<T: Real> {
    secondary: usize,
    sensors: [bool; 2],
    phase: CalibrationPhase<T>,
    since: u64,
    /// Time from which ages count.
    origin: u64,
    rest: RestBefore<T>,
    forces: Halves<T, FORCE_CHANNELS, FORCE_PACKED>,
    rates: Halves<T, RATE_CHANNELS, RATE_PACKED>,
    rests: [Rests<T>; 2],
    /// True if the platform moved since the last stored rest.
    moved: bool,
    /// Difference from the primary that siblings shared with this secondary at the last rest, m/s^2 and rad/s.
    shared: [T; 2],
}

/// Pairs of even seconds, which are fitted, and of odd ones, which are held out.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Halves<T: Real, const K: usize, const PACKED: usize> {
    fitted: JointMoments<T, K, PACKED>,
    held_out: JointMoments<T, K, PACKED>,
}

impl<T: Real, const K: usize, const PACKED: usize> Halves<T, K, PACKED> {
    fn new() -> Self {
        Self {
            fitted: JointMoments::new(),
            held_out: JointMoments::new(),
        }
    }

    fn push(&mut self, second: u64, channels: &[T; K]) {
        if second.is_multiple_of(2) {
            self.fitted.push(channels);
        } else {
            self.held_out.push(channels);
        }
    }

    fn pairs(&self) -> u32 {
        self.fitted.samples().saturating_add(self.held_out.samples())
    }

    fn merged(&self) -> Merged<'_, T, K, PACKED> {
        Merged::of(&self.fitted, &self.held_out)
    }
}

/// Progress of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationProgress {
    /// The phase continues.
    GoesOn,
    /// There are enough pairs, or time is up and there are enough to try.
    Complete,
    /// Time is up.
    Abandoned(Abandoned),
}

impl<T: Real> CalibrationRun<T> {
    /// Starts to wait for motion at `time`.
    pub fn new(secondary: usize, sensors: [bool; 2], time: u64, rest: RestBefore<T>) -> Self {
        Self {
            secondary,
            sensors,
            phase: CalibrationPhase::WaitingForMotion,
            since: time,
            origin: time,
            rest,
            forces: Halves::new(),
            rates: Halves::new(),
            rests: [Rests::new(); 2],
            moved: true,
            shared: [T::zero(); 2],
        }
    }

    /// Adds means at rest, once per rest, of sensors for which the primary is valid. `stored` must not change
    /// during a calibration.
    pub fn take_rest(
        &mut self,
        time: u64,
        unit: &MountedUnit<T>,
        rest: &RestPair<'_, T>,
        stored: &[StoredCalibration<T>; 2],
    ) {
        if self.is_fitting() || !core::mem::replace(&mut self.moved, false) {
            return;
        }
        self.shared = rest.shared;
        let age = self.age(time);
        for ((sensor, rests), stored) in SENSORS.into_iter().zip(&mut self.rests).zip(stored) {
            if !sensor.of(&rest.valid) || !unit.axes.any(sensor) {
                continue;
            }
            let measured = |mean: &RestMean<T>| sensor.triad(mean.mean());
            let noise = |mean: &RestMean<T>| {
                sensor.triad(&mean.variance()).sum() / (count::<T>(3) * count(mean.windows().max(1)))
            };
            let first = unit.sensor_from_primary * measured(rest.primary);
            let beyond = measured(rest.secondary) - stored.error.predict(&first);
            rests.push(age, &first, &beyond, noise(rest.primary) + noise(rest.secondary));
        }
    }

    /// Number of the secondary.
    pub fn secondary(&self) -> usize {
        self.secondary
    }

    /// Sensors that are to be calibrated, accelerometer first.
    pub fn sensors(&self) -> [bool; 2] {
        self.sensors
    }

    /// Returns whether the platform has not moved yet.
    pub fn waits_for_motion(&self) -> bool {
        matches!(self.phase, CalibrationPhase::WaitingForMotion)
    }

    /// Returns whether the pairs are complete and a fit is under way.
    pub fn is_fitting(&self) -> bool {
        self.fitted_sensor().is_some()
    }

    fn fitted_sensor(&self) -> Option<Sensor> {
        match &self.phase {
            CalibrationPhase::Fitting(sensor, _) => Some(*sensor),
            _ => None,
        }
    }

    /// Time since it was triggered, s.
    fn age(&self, time: u64) -> T {
        seconds(time.saturating_sub(self.origin))
    }

    fn calibrates(&self, sensor: Sensor) -> bool {
        *sensor.of(&self.sensors)
    }

    /// Compares a window of the primary with the rest and returns whether the platform moves now.
    pub fn watch(&mut self, time: u64, mean: &[T; CHANNELS], settings: &CollectionSettings<T>) -> bool {
        let moved = |sensor: Sensor| {
            let apart = sensor.squared_distance(mean, &self.rest.primary);
            let limit = settings.motion.of(sensor);
            apart >= limit * limit
        };
        let moves = SENSORS.into_iter().any(moved);
        if moves {
            self.phase = CalibrationPhase::Collecting;
            self.since = time;
        }
        moves
    }

    /// Adds a pair while collecting; `usable` marks sensors that are usable in both units. `stored` must not
    /// change during a calibration.
    pub fn take(
        &mut self,
        time: u64,
        pair: &MotionPair<T>,
        usable: [bool; 2],
        stored: &[StoredCalibration<T>; 2],
    ) {
        if !matches!(self.phase, CalibrationPhase::Collecting) {
            return;
        }
        self.moved = true;
        let second = whole_spans(time, SECOND).0;
        let age = self.age(time);
        let [accelerometer, gyroscope] = usable;
        let [force, rate] = stored;
        if accelerometer && self.calibrates(Sensor::Accelerometer) {
            self.forces.push(second, &pair.forces(age, &force.error));
        }
        if gyroscope && self.calibrates(Sensor::Gyroscope) {
            self.rates.push(second, &pair.rates(age, &rate.error));
        }
    }

    /// Checks for enough pairs and for the end of time.
    pub fn check(
        &self,
        time: u64,
        settings: &CollectionSettings<T>,
        (window, fewest): (u64, u32),
    ) -> CalibrationProgress {
        let passed = time.saturating_sub(self.since);
        if self.is_fitting() {
            return CalibrationProgress::GoesOn;
        }
        if self.waits_for_motion() {
            let late = passed > settings.motion_timeout;
            return if late {
                CalibrationProgress::Abandoned(Abandoned::NoMotion)
            } else {
                CalibrationProgress::GoesOn
            };
        }
        let sensors = SENSORS.into_iter().filter(|sensor| self.calibrates(*sensor));
        let pairs = sensors.map(|sensor| self.pairs(sensor)).min().unwrap_or(0);
        if u64::from(pairs).saturating_mul(window) >= settings.collect {
            return CalibrationProgress::Complete;
        }
        if passed <= settings.collect_timeout {
            return CalibrationProgress::GoesOn;
        }
        if pairs >= fewest {
            CalibrationProgress::Complete
        } else {
            CalibrationProgress::Abandoned(Abandoned::TimedOut)
        }
    }

    /// Number of pairs of a sensor.
    pub fn pairs(&self, sensor: Sensor) -> u32 {
        match sensor {
            Sensor::Accelerometer => self.forces.pairs(),
            Sensor::Gyroscope => self.rates.pairs(),
        }
    }

    /// Ends the collection and starts the fit of the next sensor, the accelerometer first; returns whether
    /// there is one.
    pub fn fit_next(&mut self, stored: &[StoredCalibration<T>; 2]) -> bool {
        let left = match self.phase {
            CalibrationPhase::Fitting(Sensor::Accelerometer, _) => [false, true],
            CalibrationPhase::Fitting(Sensor::Gyroscope, _) => [false; 2],
            _ => [true; 2],
        };
        let next = SENSORS
            .into_iter()
            .find(|sensor| *sensor.of(&left) && self.calibrates(*sensor));
        if let Some(sensor) = next {
            self.phase = CalibrationPhase::Fitting(sensor, Trial::new(&sensor.of(stored).error));
        }
        next.is_some()
    }

    /// Takes the next step of a fit, whose last step writes `found`; returns the outcome of a sensor after its
    /// last fit. A sensor that comparison `found_wrong` follows the primary without bound.
    #[inline(never)]
    pub fn fit_on<'f>(
        &mut self,
        (primary, unit): (Axes, &MountedUnit<T>),
        stored: &[StoredCalibration<T>; 2],
        found_wrong: [bool; 2],
        settings: &RedundancySettings<T>,
        window: u64,
        found: &'f mut Fit<T>,
    ) -> Option<(Sensor, TrialEnd<'f, T>)> {
        let sensor = self.fitted_sensor()?;
        let stored = sensor.of(stored);
        let (forces, rates) = (self.forces.merged(), self.rates.merged());
        let (fitted, held_out, all, layout): (
            &dyn PairMoments<T>,
            &dyn PairMoments<T>,
            &dyn PairMoments<T>,
            _,
        ) = match sensor {
            Sensor::Accelerometer => (&self.forces.fitted, &self.forces.held_out, &forces, FORCE_LAYOUT),
            Sensor::Gyroscope => (&self.rates.fitted, &self.rates.held_out, &rates, RATE_LAYOUT),
        };
        let follows = stored.calibrated && !sensor.of(&found_wrong);
        let data = TrialData {
            sensor,
            unit,
            primary,
            stored: &stored.error,
            followed: follows.then_some(stored.followed),
            shared: *sensor.of(&self.shared),
            settings,
            rest: self.rest.readings(sensor, unit),
            fewest: settings.fewest_pairs(window),
            noise: self.rest.noise(sensor, unit, window),
            rests: sensor.of(&self.rests),
            fitted,
            held_out,
            all,
            layout,
        };
        let CalibrationPhase::Fitting(_, trial) = &mut self.phase else {
            return None;
        };
        let outcome = trial.go_on(&data, found).transpose();
        outcome.map(|outcome| (sensor, outcome))
    }
}
