//! Evidence of aiding measurements against units, and trust in the measurements.

use nalgebra::Vector3;

use crate::real::{Real, real, seconds, tabulated};
use crate::redundancy::aiding::navigation::{
    Aided, AidedHeading, Innovation, Navigation, NavigationStep, candidates,
};
use crate::redundancy::aiding::track::{EARLY, LATE};
use crate::redundancy::aiding::{Aiding, AidingRejection};
use crate::redundancy::isolation::UnitReading;
use crate::redundancy::isolation::attribution::{DECIDES, Ground, Proof};
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::ForceAndRate;

/// Time constants with which evidence is forgotten, s: while a unit departs from others, and while it does not.
const REMEMBERED: f32 = 60.0;
const FORGOTTEN: f32 = 2.0;

/// Largest evidence that accumulates, so that later evidence can revise a decision.
const MOST: f64 = 15.0;

/// Misfit, sigmas, above which a measurement that fits no unit is rejected.
const FITS_NONE: f64 = 4.0;

/// Measurements over which misfits are averaged, and largest mean misfit, sigmas, of a unit that fits.
const AVERAGED: f64 = 20.0;
const FITS: f64 = 0.75;

/// Mean square misfit of the best unit, sigmas squared, above which trust in aiding measurements is lost, and
/// below which it is regained after a number of measurements.
const DISTRUSTED: f32 = 5.0;
const TRUSTED: f32 = 2.5;
const TRUSTED_AFTER: u16 = 25;

/// Measurements without trust after which the estimation restarts.
const ANEW_AFTER: u16 = 150;

/// Usual mean square misfit: number of measurements of its average, and its largest value.
const USUAL_OVER: f64 = 1000.0;
const USUAL_MOST: f64 = 9.0;

/// Time without a measurement after which integration is no longer used, s.
const SILENT: f64 = 10.0;

/// Time for which a score is valid, s; time of one independent score, s; and the largest evidence of one.
const SCORE_COUNTS: f64 = 1.5;
const SCORE_SPAN: f64 = 5.0;
const SCORE_MOST: f64 = 1.5;

/// Number of measured quantities: the axes of a velocity, and a heading.
const MEASURED: usize = 4;
const HEADING: usize = 3;

/// Change of the trust in aiding measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Trust<T: Real> {
    /// The measurement contradicts all units: mean square misfit of the best unit, and its limit.
    Lost { misfit: T, limit: T },
    /// The measurement fits again.
    Regained,
}

/// State of the set in a window, for the comparison with aiding measurements.
pub(crate) struct AidingWindow<'a, T: Real, const UNITS: usize> {
    pub units: &'a [Option<UnitReading<T>>; UNITS],
    /// Median reading of the set, m/s^2 and rad/s.
    pub measured: [&'a Vector3<T>; 2],
    /// Zero rate of the set at its last rest, rad/s.
    pub resting_rate: &'a Vector3<T>,
    /// True if a sensor of a unit is faulty, accelerometer first.
    pub faulty: [[bool; 2]; UNITS],
    /// True if it departs from any other unit.
    pub departs: [[bool; 2]; UNITS],
    /// True if no units disagree, so that usual values may be learnt.
    pub calm: bool,
    /// Number of the window, and its length, microseconds and s.
    pub number: u64,
    pub span: u64,
    pub length: T,
    /// m/s^2.
    pub gravity: T,
    pub tolerated: ForceAndRate<T>,
}

/// Evidence of aiding measurements against one sensor of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SensorEvidence<T: Real> {
    /// Logarithm of the likelihood ratio: fault of the sensor over fault of the set.
    evidence: T,
    /// Mean misfit with the sensor in place of that of the set, of each measured quantity, sigmas.
    misfit: [T; MEASURED],
}

/// Trust in aiding measurements of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Confidence<T: Real> {
    /// Mean square misfit of the best unit, sigmas squared: the usual one, and the recent one in units of the
    /// usual.
    usual: T,
    lately: T,
    trusted: bool,
    /// True if the latest misfit allows trust, and the number of successive measurements that agree on it.
    fit: bool,
    streak: u16,
    /// True if the loss of trust was reported.
    reported: bool,
}

impl<T: Real> Confidence<T> {
    fn new() -> Self {
        Self {
            usual: T::one(),
            lately: T::one(),
            trusted: false,
            fit: false,
            streak: 0,
            reported: false,
        }
    }

    /// Learns the usual misfit.
    fn learn(&mut self, best: T) {
        let square = best * best * self.usual;
        self.usual += (square - self.usual) / real(USUAL_OVER);
        self.usual = self.usual.max(T::one()).min(real(USUAL_MOST));
    }

    /// Updates the trust with a misfit of the best unit, sigmas, and returns a change of it.
    fn trust(&mut self, best: T) -> Option<Trust<T>> {
        let most = real::<T>(FITS_NONE + 1.0);
        let square = best.min(most) * best.min(most);
        self.lately += (square - self.lately) / real(AVERAGED);
        let limit = tabulated::<T>(if self.trusted { DISTRUSTED } else { TRUSTED });
        let fits = self.lately <= limit;
        self.streak = if fits == self.fit {
            self.streak.saturating_add(1)
        } else {
            1
        };
        self.fit = fits;
        let misfit = self.lately;
        match (self.trusted, fits) {
            (true, true) => None,
            // The absence of trust from the beginning is reported too.
            (false, false) if self.streak < ANEW_AFTER || self.reported => None,
            (false, true) if self.streak < TRUSTED_AFTER => None,
            (_, false) => {
                self.trusted = false;
                self.reported = true;
                Some(Trust::Lost { misfit, limit })
            }
            (false, true) => {
                self.trusted = true;
                core::mem::take(&mut self.reported).then_some(Trust::Regained)
            }
        }
    }

    /// Returns whether the estimation must restart after a long time without trust.
    fn begins_anew(&mut self) -> bool {
        let lost = !self.trusted && !self.fit && self.streak >= ANEW_AFTER;
        if lost {
            self.streak = 0;
        }
        lost
    }
}

/// Evidence of all aiding measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AidingEvidence<T: Real, const UNITS: usize> {
    navigation: Option<Navigation<T, UNITS>>,
    /// Number of the latest window, and length of a window, microseconds.
    number: u64,
    span: u64,
    against: [[SensorEvidence<T>; 2]; UNITS],
    /// Score of each unit, and its age, s.
    scores: [Option<(T, T)>; UNITS],
    /// Time since the latest velocity, s.
    silent: T,
    calm: bool,
    /// Trust in velocities, and in headings.
    of_velocity: Confidence<T>,
    of_heading: Confidence<T>,
}

impl<T: Real, const UNITS: usize> AidingEvidence<T, UNITS> {
    pub fn new() -> Self {
        let nothing = SensorEvidence {
            evidence: T::zero(),
            misfit: [T::zero(); MEASURED],
        };
        Self {
            navigation: None,
            number: 0,
            span: 1,
            against: [[nothing; 2]; UNITS],
            scores: [None; UNITS],
            silent: real(f64::INFINITY),
            calm: false,
            of_velocity: Confidence::new(),
            of_heading: Confidence::new(),
        }
    }

    /// Advances by a window.
    pub fn advance(&mut self, around: &AidingWindow<'_, T, UNITS>) {
        let follows = around.number == self.number.saturating_add(1);
        (self.number, self.span, self.calm) = (around.number, around.span.max(1), around.calm);
        self.silent += around.length;
        let in_use = self.silent <= real(SILENT);
        self.navigation = self.navigation.filter(|_| follows && in_use);
        if in_use {
            self.navigate(around);
        }
        self.weigh_scores(around.length);
        self.forget(around);
    }

    fn navigate(&mut self, around: &AidingWindow<'_, T, UNITS>) {
        let [force, _] = around.measured;
        let rests = around.units.iter().flatten().any(|unit| unit.at_rest.is_some());
        let deviations: [[Vector3<T>; 2]; UNITS] = core::array::from_fn(|number| {
            SENSORS.map(|sensor| {
                let unit = around.units.get(number).and_then(Option::as_ref);
                let faulty = around.faulty.get(number).is_none_or(|faulty| *sensor.of(faulty));
                let unit = unit.filter(|unit| *sensor.of(&unit.votes) && !faulty);
                unit.map_or(Vector3::zeros(), |unit| {
                    sensor.of(&unit.reading) - *sensor.of(&around.measured)
                })
            })
        });
        let start = || Navigation::start(force, around.resting_rate, rests, &around.tolerated);
        let navigation = self.navigation.get_or_insert_with(start);
        for (sensor, number) in candidates::<UNITS>() {
            let is_faulty = |number: usize| around.faulty.get(number).is_none_or(|faulty| *sensor.of(faulty));
            if is_faulty(number) {
                navigation.leave_out(sensor, number, |other| !is_faulty(other));
            }
        }
        navigation.advance(&NavigationStep {
            measured: around.measured,
            deviations: &deviations,
            length: around.length,
            gravity: around.gravity,
            rests,
        });
    }

    /// Reduces the evidence, fast while a unit does not depart from the others: differences of healthy units
    /// are no evidence.
    fn forget(&mut self, around: &AidingWindow<'_, T, UNITS>) {
        let units = self.against.iter_mut().zip(&around.faulty).zip(&around.departs);
        for ((against, faulty), gathers) in units {
            for ((against, faulty), gathers) in against.iter_mut().zip(faulty).zip(gathers) {
                let over = tabulated::<T>(if *gathers { REMEMBERED } else { FORGOTTEN });
                against.evidence = if *faulty {
                    T::zero()
                } else {
                    against.evidence - against.evidence * (around.length / over)
                };
            }
        }
    }

    /// Adds the evidence of scores while they are valid.
    fn weigh_scores(&mut self, window: T) {
        for (score, against) in self.scores.iter_mut().zip(&mut self.against) {
            let Some((value, age)) = score else { continue };
            *age += window;
            if *age > real(SCORE_COUNTS) {
                *score = None;
                continue;
            }
            let beyond = (*value - T::one()) * real(0.5);
            let added = beyond.max(T::zero()).min(real(SCORE_MOST)) * (window / real(SCORE_SPAN)); // isolation.md, eq. 22
            for against in against {
                against.evidence = (against.evidence + added).min(real(MOST));
            }
        }
    }

    /// Processes an aiding measurement of a time, microseconds of the common clock.
    pub fn take(&mut self, time: u64, aiding: &Aiding<T>) -> Result<Option<Trust<T>>, AidingRejection> {
        match aiding {
            Aiding::Score { unit, value } => {
                if let Some(score) = self.scores.get_mut(*unit) {
                    *score = Some((*value, T::zero()));
                }
                Ok(None)
            }
            Aiding::Velocity { value, sigma } | Aiding::BodyVelocity { value, sigma } => {
                let level = matches!(aiding, Aiding::Velocity { .. });
                self.measure(time, |aiding_evidence, navigation, windows| {
                    let aided = Aided {
                        value: *value,
                        sigma: *sigma,
                        windows,
                        length: seconds(aiding_evidence.span),
                    };
                    aiding_evidence.take_velocity(navigation, &aided, level)
                })
            }
            Aiding::Heading { value, sigma } => self.measure(time, |aiding_evidence, navigation, windows| {
                let aided = AidedHeading {
                    value: *value,
                    sigma: *sigma,
                    windows,
                };
                aiding_evidence.take_heading(navigation, &aided)
            }),
        }
    }

    /// Processes a measurement of a time; the first measurement starts the integration.
    fn measure(
        &mut self,
        time: u64,
        take: impl FnOnce(&mut Self, &mut Navigation<T, UNITS>, T) -> Option<Trust<T>>,
    ) -> Result<Option<Trust<T>>, AidingRejection> {
        let Some(mut navigation) = self.navigation else {
            self.silent = T::zero();
            return Ok(None);
        };
        let windows = self.windows_ago(time)?;
        self.silent = T::zero();
        let change = take(self, &mut navigation, windows);
        let lost = self.of_velocity.begins_anew();
        self.navigation = Some(navigation).filter(|navigation| navigation.is_finite() && !lost);
        Ok(change)
    }

    fn take_velocity(
        &mut self,
        navigation: &mut Navigation<T, UNITS>,
        aided: &Aided<T>,
        level: bool,
    ) -> Option<Trust<T>> {
        if level {
            navigation.begin_along_level(aided);
        } else {
            navigation.begin_along_primary(aided);
        }
        let worst = self.compare_velocity(navigation, aided, level)?;
        self.trust(Sensor::Accelerometer, worst)
    }

    fn take_heading(
        &mut self,
        navigation: &mut Navigation<T, UNITS>,
        aided: &AidedHeading<T>,
    ) -> Option<Trust<T>> {
        let innovation = navigation.along_heading(aided, self.calm)?;
        let best = self.weigh(navigation, &innovation, HEADING);
        if best.abs() < real(FITS_NONE) {
            navigation.update(&innovation);
        }
        let change = self.trust(Sensor::Gyroscope, best.abs());
        if self.of_heading.begins_anew() {
            navigation.forget_north();
        }
        change
    }

    /// Returns the age of a time in windows.
    fn windows_ago(&self, time: u64) -> Result<T, AidingRejection> {
        let now = self
            .number
            .saturating_mul(self.span)
            .saturating_add(self.span / 2);
        let span = |microseconds: u64| seconds::<T>(microseconds) / seconds(self.span);
        let (late, early) = (now.saturating_sub(time), time.saturating_sub(now));
        if late > self.span.saturating_mul(LATE) {
            Err(AidingRejection::Late)
        } else if early > self.span.saturating_mul(EARLY) {
            Err(AidingRejection::Early)
        } else {
            Ok(span(late) - span(early))
        }
    }

    /// Compares a velocity with the prediction of each unit, axis by axis; returns the largest misfit of the
    /// best unit, sigmas.
    fn compare_velocity(
        &mut self,
        navigation: &mut Navigation<T, UNITS>,
        aided: &Aided<T>,
        level: bool,
    ) -> Option<T> {
        let mut worst = None;
        for (place, axis) in [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().enumerate() {
            let innovation = if level {
                navigation.along_level(&axis, aided)
            } else {
                navigation.along_primary(&axis, aided)
            };
            let Some(innovation) = innovation else { continue };
            let best = self.weigh(navigation, &innovation, place);
            if best.abs() < real(FITS_NONE) {
                navigation.update(&innovation);
            }
            worst = Some(best.abs().max(worst.unwrap_or(T::zero())));
        }
        worst
    }

    /// Compares one measured quantity with all predictions and returns the misfit of the best unit, sigmas.
    fn weigh(&mut self, navigation: &Navigation<T, UNITS>, innovation: &Innovation<T>, place: usize) -> T {
        // Common errors of the gyroscopes, drift and the bias error of the filter, change a velocity as much as
        // their differences do; accelerometers do not affect a heading.
        let (confidence, concerned) = if place == HEADING {
            (&mut self.of_heading, Sensor::Gyroscope)
        } else {
            (&mut self.of_velocity, Sensor::Accelerometer)
        };
        let sigma = (innovation.variance * confidence.usual).square_root();
        let of_set = innovation.of_set / sigma;
        let mut best = of_set;
        let misfits: [[T; 2]; UNITS] = core::array::from_fn(|unit| {
            SENSORS.map(|sensor| of_set - navigation.share(innovation, sensor, unit) / sigma)
        });
        for own in misfits.iter().flatten() {
            if own.abs() < best.abs() {
                best = *own;
            }
        }
        let (fits_any, most) = (best.abs() < real(FITS_NONE), real::<T>(FITS_NONE + 1.0));
        for (sensor, unit) in candidates::<UNITS>() {
            let against = self.against.get_mut(unit).map(|against| sensor.of_mut(against));
            let own = misfits.get(unit).map(|misfits| *sensor.of(misfits));
            let Some((against, own)) = against.zip(own) else {
                continue;
            };
            let own_within = own.max(-most).min(most);
            if let Some(misfit) = against.misfit.get_mut(place) {
                *misfit += (own_within - *misfit) / real(AVERAGED);
            }
            if fits_any && confidence.trusted && sensor == concerned {
                let set_within = of_set.max(-most).min(most);
                let added = (own_within * own_within - set_within * set_within) * real(0.5); // isolation.md, eq. 20
                against.evidence = (against.evidence + added).max(real(-MOST)).min(real(MOST));
            }
        }
        if self.calm && confidence.trusted && fits_any {
            confidence.learn(best);
        }
        best
    }

    /// Trust in the measurements that are evidence on a sensor: velocities for accelerometers, headings for
    /// gyroscopes.
    fn confidence(&mut self, sensor: Sensor) -> &mut Confidence<T> {
        match sensor {
            Sensor::Accelerometer => &mut self.of_velocity,
            Sensor::Gyroscope => &mut self.of_heading,
        }
    }

    /// Updates the trust in the measurements that are evidence on a sensor by the misfit of the best unit,
    /// sigmas; discards their evidence when trust is lost.
    fn trust(&mut self, sensor: Sensor, misfit: T) -> Option<Trust<T>> {
        let confidence = self.confidence(sensor);
        let before = confidence.trusted;
        let change = confidence.trust(misfit);
        if before && !confidence.trusted {
            for against in &mut self.against {
                sensor.of_mut(against).evidence = T::zero();
            }
        }
        change
    }

    fn against(&self, sensor: Sensor, unit: usize) -> Option<&SensorEvidence<T>> {
        self.against.get(unit).map(|against| sensor.of(against))
    }

    /// Returns whether a sensor of a unit fits the aiding measurements.
    fn fits(&self, sensor: Sensor, unit: usize) -> bool {
        let limit = real::<T>(FITS);
        self.against(sensor, unit)
            .is_some_and(|against| against.misfit.iter().all(|misfit| misfit.abs() < limit))
    }

    /// Returns the faulty one of two units, if the evidence decides; without a dispute the threshold is
    /// doubled.
    pub fn decides(
        &self,
        sensor: Sensor,
        [first, second]: [usize; 2],
        disputed: bool,
    ) -> Option<(usize, Proof<T>)> {
        let of = |unit: usize| self.against(sensor, unit).map(|against| against.evidence);
        let apart = of(first)? - of(second)?;
        let (wrong, right) = if apart > T::zero() {
            (first, second)
        } else {
            (second, first)
        };
        let limit = real::<T>(DECIDES) * tabulated(if disputed { 1.0 } else { 2.0 });
        let proof = proof(apart.abs(), limit).filter(|_| self.fits(sensor, right))?;
        Some((wrong, proof))
    }

    /// Returns the evidence if it is against a unit and in favour of all others.
    pub fn contradicts(
        &self,
        sensor: Sensor,
        unit: usize,
        mut others: impl Iterator<Item = usize>,
    ) -> Option<Proof<T>> {
        let own = self.against(sensor, unit)?.evidence;
        let least = others.try_fold(own, |least, other| {
            let evidence = self
                .against(sensor, other)
                .filter(|_| self.fits(sensor, other))?
                .evidence;
            Some(least.min(own - evidence))
        })?;
        proof(least, real(2.0 * DECIDES))
    }
}

fn proof<T: Real>(value: T, limit: T) -> Option<Proof<T>> {
    (value > limit).then_some(Proof {
        ground: Ground::Aiding,
        value,
        limit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_above_their_expectation_alone_are_evidence() {
        for (value, is_evidence) in [(0.5, false), (1.0, false), (3.0, true)] {
            let mut evidence = AidingEvidence::<f64, 2>::new();
            let taken = evidence.take(0, &Aiding::Score { unit: 1, value });
            assert_eq!(taken, Ok(None));
            evidence.weigh_scores(0.05);
            for sensor in 0..2 {
                assert_eq!(evidence.against[0][sensor].evidence, 0.0);
                assert_eq!(evidence.against[1][sensor].evidence > 0.0, is_evidence, "{value}");
            }
        }
    }
}
