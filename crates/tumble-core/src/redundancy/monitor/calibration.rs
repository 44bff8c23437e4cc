//! Calibration mode of one secondary: waits for motion, collects pairs, fits them, and has them judged.

use nalgebra::{Matrix3, Vector3};

use crate::products::{congruent, product};
use crate::real::{Real, SECOND, count, real, seconds, whole_spans};
use crate::redundancy::evaluation::StoredCalibration;
use crate::redundancy::fit::adoption::{AdoptionRefusal, FitCandidate, Following, Residuals, RestReadings};
use crate::redundancy::fit::joint_moments::JointMoments;
use crate::redundancy::fit::residual::{
    FORCE_LAYOUT, FORCE_PACKED, Layout, PairMoments, RATE_LAYOUT, RATE_PACKED,
};
use crate::redundancy::fit::rests::{RestWeighing, Rests, WeighedRests};
use crate::redundancy::fit::{Fit, FitProblem, PrimaryNoise};
use crate::redundancy::monitor::event::Abandoned;
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::samples::history::RestMean;
use crate::redundancy::samples::pair::{FORCE_CHANNELS, MotionPair, RATE_CHANNELS};
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::{CollectionSettings, RedundancySettings};
use crate::sample::CHANNELS;

/// Where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationPhase {
    /// The platform has not moved yet.
    WaitingForMotion,
    /// Pairs are taken while it moves.
    Collecting,
}

/// What was measured at the rest that triggered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestBefore<T: Real> {
    /// Means of the primary, as read.
    pub primary: [T; CHANNELS],
    /// Variance of its windows.
    pub variance: [T; CHANNELS],
    /// Means of the secondary, as read.
    pub secondary: [T; CHANNELS],
}

/// Means of both over the same rest, as read.
pub struct RestPair<'a, T: Real> {
    /// Of the primary.
    pub primary: &'a RestMean<T>,
    /// Of the secondary.
    pub secondary: &'a RestMean<T>,
    /// Sensors of the primary that were found valid at it, accelerometer first.
    pub valid: [bool; 2],
    /// How far siblings were from the primary just as this secondary was, m/s^2 and rad/s.
    pub shared: [T; 2],
}

/// Calibration mode of one secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationRun<T: Real> {
    secondary: usize,
    sensors: [bool; 2],
    phase: CalibrationPhase,
    since: u64,
    /// From which ages count.
    origin: u64,
    rest: RestBefore<T>,
    forces: Halves<T, FORCE_CHANNELS, FORCE_PACKED>,
    rates: Halves<T, RATE_CHANNELS, RATE_PACKED>,
    rests: [Rests<T>; 2],
    /// Whether it moved since the last rest that was taken.
    moved: bool,
    /// How far siblings were from the primary just as this secondary was, at the last rest, m/s^2 and rad/s.
    shared: [T; 2],
}

/// Pairs of even seconds, to be fitted, and of odd ones, held out.
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

    fn whole(&self) -> JointMoments<T, K, PACKED> {
        let mut whole = self.fitted;
        whole.merge(&self.held_out);
        whole
    }
}

/// What a step led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationProgress {
    /// Nothing new.
    GoesOn,
    /// There are enough pairs, or time is up and there are enough to try.
    Complete,
    /// Time is up.
    Abandoned(Abandoned),
}

/// Outcome for one sensor: what was found, how well it does, and whether it is adopted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOutcome<T: Real> {
    /// Fitted to all pairs.
    pub fit: Fit<T>,
    /// On held-out pairs.
    pub residuals: Residuals<T>,
    /// How far it has followed the primary with it.
    pub following: Following<T>,
    /// Whether it is adopted.
    pub verdict: Result<(), AdoptionRefusal<T>>,
}

impl<T: Real> CalibrationRun<T> {
    /// Waits for motion from `time` on.
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

    /// Takes in means at rest, once a rest, of sensors of which the primary is valid. What is `stored` must stay the same
    /// meanwhile.
    pub fn take_rest(
        &mut self,
        time: u64,
        unit: &MountedUnit<T>,
        rest: &RestPair<'_, T>,
        stored: &[StoredCalibration<T>; 2],
    ) {
        if !core::mem::replace(&mut self.moved, false) {
            return;
        }
        self.shared = rest.shared;
        let age = self.age(time);
        for ((sensor, rests), stored) in SENSORS.into_iter().zip(&mut self.rests).zip(stored) {
            if !sensor.of(&rest.valid) || !unit.axes.any(sensor) {
                continue;
            }
            let said = |mean: &RestMean<T>| sensor.triad(mean.mean());
            let noise = |mean: &RestMean<T>| {
                sensor.triad(&mean.variance()).sum() / (count::<T>(3) * count(mean.windows().max(1)))
            };
            let first = unit.sensor_from_primary * said(rest.primary);
            let beyond = said(rest.secondary) - stored.error.predict(&first);
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

    /// Where it is.
    pub fn phase(&self) -> CalibrationPhase {
        self.phase
    }

    /// Time since it was triggered, s.
    fn age(&self, time: u64) -> T {
        seconds(time.saturating_sub(self.origin))
    }

    fn calibrates(&self, sensor: Sensor) -> bool {
        *sensor.of(&self.sensors)
    }

    /// Takes in the primary's window, while nothing moved yet, and says whether it moves now.
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

    /// Takes in a pair; `usable` says which sensors of both may be used. What is `stored` must stay the same meanwhile.
    pub fn take(
        &mut self,
        time: u64,
        pair: &MotionPair<T>,
        usable: [bool; 2],
        stored: &[StoredCalibration<T>; 2],
    ) {
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

    /// Whether there is enough, or no time left.
    pub fn check(&self, time: u64, settings: &CollectionSettings<T>, window: u64) -> CalibrationProgress {
        let passed = time.saturating_sub(self.since);
        if self.phase == CalibrationPhase::WaitingForMotion {
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
        if pairs >= settings.fewest_pairs {
            CalibrationProgress::Complete
        } else {
            CalibrationProgress::Abandoned(Abandoned::TimedOut)
        }
    }

    /// Pairs taken of a sensor.
    pub fn pairs(&self, sensor: Sensor) -> u32 {
        match sensor {
            Sensor::Accelerometer => self.forces.pairs(),
            Sensor::Gyroscope => self.rates.pairs(),
        }
    }

    /// Fits one sensor and judges the fit. One that was `found_wrong` beside the others does not follow the primary, but them.
    ///
    /// # Errors
    /// [`AdoptionRefusal`] where there is no fit to be judged.
    pub fn conclude(
        &self,
        sensor: Sensor,
        unit: &MountedUnit<T>,
        stored: &StoredCalibration<T>,
        found_wrong: bool,
        settings: &RedundancySettings<T>,
    ) -> Result<FitOutcome<T>, AdoptionRefusal<T>> {
        let trial = Trial {
            sensor,
            unit,
            stored: &stored.error,
            followed: (stored.calibrated && !found_wrong).then_some(stored.followed),
            shared: *sensor.of(&self.shared),
            settings,
            rest: self.rest_pair(sensor, unit),
            noise: self.noise(sensor, unit, settings.window),
            rests: sensor.of(&self.rests),
        };
        match sensor {
            Sensor::Accelerometer => {
                let Halves { fitted, held_out } = &self.forces;
                trial.run(fitted, held_out, &self.forces.whole(), FORCE_LAYOUT)
            }
            Sensor::Gyroscope => {
                let Halves { fitted, held_out } = &self.rates;
                trial.run(fitted, held_out, &self.rates.whole(), RATE_LAYOUT)
            }
        }
    }

    fn rest_pair(&self, sensor: Sensor, unit: &MountedUnit<T>) -> RestReadings<T> {
        RestReadings {
            first: product(&unit.sensor_from_primary, &sensor.triad(&self.rest.primary)),
            second: sensor.triad(&self.rest.secondary),
        }
    }

    /// The primary's noise in a pair, from its windows at rest: two thirds of their variance in a triangle, and twice it
    /// in the difference of two.
    fn noise(&self, sensor: Sensor, unit: &MountedUnit<T>, window: u64) -> PrimaryNoise<T> {
        let turn = &unit.sensor_from_primary;
        let of = |sensor: Sensor| sensor.triad(&self.rest.variance);
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

/// A sensor whose pairs are complete.
struct Trial<'a, T: Real> {
    sensor: Sensor,
    unit: &'a MountedUnit<T>,
    stored: &'a RelativeError<T>,
    /// How far it has followed the primary; `None` where that does not count.
    followed: Option<Vector3<T>>,
    shared: T,
    settings: &'a RedundancySettings<T>,
    rest: RestReadings<T>,
    noise: PrimaryNoise<T>,
    rests: &'a Rests<T>,
}

impl<T: Real> Trial<'_, T> {
    fn run(
        &self,
        fitted: &dyn PairMoments<T>,
        held_out: &dyn PairMoments<T>,
        all: &dyn PairMoments<T>,
        layout: Layout,
    ) -> Result<FitOutcome<T>, AdoptionRefusal<T>> {
        let needed = self.settings.collection.fewest_pairs;
        let pairs = all.samples();
        if pairs < needed || fitted.samples() == 0 || held_out.samples() == 0 {
            return Err(AdoptionRefusal::TooFewPairs { pairs, needed });
        }
        let half = self.fit(fitted, layout, None)?;
        // Both halves hold every other second: what residuals have in common over a second shows between them.
        let times = half
            .disagreement(&self.fit(held_out, layout, None)?)
            .max(T::one());
        let motion = self.fit(all, layout, None)?;
        let (half, whole) = match self.weighed(all, layout, &motion, times)? {
            None => (half, motion),
            Some(rests) => (
                self.fit(fitted, layout, Some(rests))?,
                self.fit(all, layout, Some(rests))?,
            ),
        };
        let whole = whole.less_certain(times);
        let following = self.following(&whole, all);
        let candidate = FitCandidate {
            sensor: self.sensor,
            axes: *self.unit.axes.of(self.sensor),
            layout,
            half: &half,
            motion: &motion,
            whole: &whole,
            stored: self.stored,
            held_out,
            all,
            rest: &self.rest,
            following: &following,
        };
        let residuals = candidate.residuals();
        Ok(FitOutcome {
            fit: whole,
            residuals,
            following,
            verdict: candidate.judge(&residuals, self.settings),
        })
    }

    /// How far it would follow the primary (docs/theory/redundancy.md, eq. 20, 21).
    fn following(&self, fit: &Fit<T>, pairs: &dyn PairMoments<T>) -> Following<T> {
        let Some(before) = self.followed else {
            return Following::free();
        };
        let u = Vector3::from_fn(|j, _| pairs.mean_of(j));
        let shift = fit.error.predict(&u) - self.stored.predict(&u); // eq. 20
        Following {
            followed: self.rests.unsupported(self.sensor, &(before + shift)),
            shared: self.shared,
        }
    }

    /// What the rests count for; `None` where there are none, or none are wanted.
    fn weighed(
        &self,
        pairs: &dyn PairMoments<T>,
        layout: Layout,
        alone: &Fit<T>,
        times: T,
    ) -> Result<Option<WeighedRests<'_, T>>, AdoptionRefusal<T>> {
        if self.rests.number() == 0 || !self.settings.fit.fit_rests {
            return Ok(None);
        }
        let weighing = RestWeighing {
            problem: &self.problem(pairs, layout, None),
            alone,
            times,
            sensor: self.sensor,
            rests: self.rests,
        };
        let usual = self.fit(pairs, layout, Some(weighing.first()))?;
        Ok(Some(weighing.again(&usual)))
    }

    fn fit(
        &self,
        pairs: &dyn PairMoments<T>,
        layout: Layout,
        rests: Option<WeighedRests<'_, T>>,
    ) -> Result<Fit<T>, AdoptionRefusal<T>> {
        let problem = self.problem(pairs, layout, rests);
        problem.solve().ok_or(AdoptionRefusal::Unsolvable)
    }

    #[inline(never)]
    fn problem<'b>(
        &'b self,
        pairs: &'b dyn PairMoments<T>,
        layout: Layout,
        rests: Option<WeighedRests<'b, T>>,
    ) -> FitProblem<'b, T> {
        let settings = &self.settings.fit;
        let unknown_arm = self.sensor == Sensor::Accelerometer && self.unit.lever_arm.is_none();
        FitProblem {
            pairs,
            rests,
            layout,
            axes: *self.unit.axes.of(self.sensor),
            noise: self.noise,
            stored: self.stored,
            highest: settings.highest_rung,
            excitation: settings.excitation.of(self.sensor),
            lever_arm_excitation: unknown_arm.then_some(settings.excitation_lever_arm),
        }
    }
}
