//! What aiding measurements say against units, and whether they can be believed.

use nalgebra::Vector3;

use crate::real::{Real, real, seconds, tabulated};
use crate::redundancy::aiding::navigation::{Aided, AidedHeading, Innovation, Navigation, Step, candidates};
use crate::redundancy::aiding::track::{EARLY, LATE};
use crate::redundancy::aiding::{Aiding, AidingRejection};
use crate::redundancy::judgement::UnitReading;
use crate::redundancy::judgement::attribution::{DECIDES, Ground, Proof};
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::ForceAndRate;

/// Time for which evidence is remembered, s: while a unit departs from others, and while it does not.
const REMEMBERED: f32 = 60.0;
const FORGOTTEN: f32 = 2.0;

/// Most that is gathered: what is certain may be revised.
const MOST: f64 = 15.0;

/// Sigmas beyond which a measurement fits nobody, and is left out.
const FITS_NOBODY: f64 = 4.0;

/// Measurements over which misfits are averaged, and mean misfit, sigmas, of one who fits.
const AVERAGED: f64 = 20.0;
const FITS: f64 = 0.75;

/// Mean square misfit of the best, sigmas squared, from which on an aiding measurement is not believed, and below which it is, once it has been
/// so for a number of measurements.
const DISTRUSTED: f32 = 5.0;
const TRUSTED: f32 = 2.5;
const TRUSTED_AFTER: u16 = 25;

/// Measurements without trust after which all begins anew.
const ANEW_AFTER: u16 = 150;

/// Usual mean square of misfits: learnt over so many measurements, at most so much.
const USUAL_OVER: f64 = 1000.0;
const USUAL_MOST: f64 = 9.0;

/// Silence after which what was integrated is worth nothing, s.
const SILENT: f64 = 10.0;

/// A score counts for so long, s; a span of it that is one observation, s, and the most that this may say.
const SCORE_COUNTS: f64 = 1.5;
const SCORE_SPAN: f64 = 5.0;
const SCORE_MOST: f64 = 1.5;

/// Numbers that aiding measurements measure: the axes of a velocity, and a heading.
const MEASURED: usize = 4;
const HEADING: usize = 3;

/// Whether an aiding measurement is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Trust<T: Real> {
    /// It contradicts all units: mean square misfit of the best of them, and what it had to exceed.
    Lost { misfit: T, limit: T },
    /// It fits again.
    Regained,
}

/// A window of the set, as an aiding measurement needs it.
pub(crate) struct Surroundings<'a, T: Real, const UNITS: usize> {
    pub units: &'a [Option<UnitReading<T>>; UNITS],
    /// What the set says, m/s^2 and rad/s.
    pub said: [&'a Vector3<T>; 2],
    /// What the set turned by at its last rest, rad/s.
    pub resting_rate: &'a Vector3<T>,
    /// Of each unit, accelerometer first: whether it is at fault.
    pub faulty: [[bool; 2]; UNITS],
    /// Whether it departs from any other.
    pub departs: [[bool; 2]; UNITS],
    /// Whether nobody disagrees, so that what is usual may be learnt.
    pub calm: bool,
    /// Number of the window, and the length of one, microseconds and s.
    pub number: u64,
    pub span: u64,
    pub length: T,
    /// m/s^2.
    pub gravity: T,
    pub tolerated: ForceAndRate<T>,
}

/// What is held against one sensor of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Testified<T: Real> {
    /// Logarithm of the ratio of likelihoods that it is wrong, against that the set is.
    evidence: T,
    /// Mean misfit with it in place of the set's, of each number that is measured, sigmas.
    misfit: [T; MEASURED],
}

/// Whether what aiding measurements of one kind say can be used.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Confidence<T: Real> {
    /// Mean square misfit of the best, sigmas squared: usually, and lately in units of that.
    usual: T,
    lately: T,
    trusted: bool,
    /// Whether the latest measurement left it fit to be, and how many in succession did or did not.
    fit: bool,
    streak: u16,
    /// Whether it was said that there is none.
    told: bool,
}

impl<T: Real> Confidence<T> {
    fn new() -> Self {
        Self {
            usual: T::one(),
            lately: T::one(),
            trusted: false,
            fit: false,
            streak: 0,
            told: false,
        }
    }

    /// Learns what misfits usually are.
    fn learn(&mut self, best: T) {
        let square = best * best * self.usual;
        self.usual += (square - self.usual) / real(USUAL_OVER);
        self.usual = self.usual.max(T::one()).min(real(USUAL_MOST));
    }

    /// Whether aiding measurements are believed, after a misfit of the best, sigmas.
    fn trust(&mut self, best: T) -> Option<Trust<T>> {
        let most = real::<T>(FITS_NOBODY + 1.0);
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
            // One that was never believed is told of as well.
            (false, false) if self.streak < ANEW_AFTER || self.told => None,
            (false, true) if self.streak < TRUSTED_AFTER => None,
            (_, false) => {
                self.trusted = false;
                self.told = true;
                Some(Trust::Lost { misfit, limit })
            }
            (false, true) => {
                self.trusted = true;
                core::mem::take(&mut self.told).then_some(Trust::Regained)
            }
        }
    }

    /// Whether all begins anew, after so long without trust; it is then sought from the start.
    fn begins_anew(&mut self) -> bool {
        let lost = !self.trusted && !self.fit && self.streak >= ANEW_AFTER;
        if lost {
            self.streak = 0;
        }
        lost
    }
}

/// What aiding measurements have said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AidingEvidence<T: Real, const UNITS: usize> {
    navigation: Option<Navigation<T, UNITS>>,
    /// Number of the latest window, and the length of one, microseconds.
    number: u64,
    span: u64,
    against: [[Testified<T>; 2]; UNITS],
    /// Score of each unit, and the time since it was given, s.
    scores: [Option<(T, T)>; UNITS],
    /// Since the latest velocity, s.
    silent: T,
    calm: bool,
    /// Those of velocity, and of heading.
    of_velocity: Confidence<T>,
    of_heading: Confidence<T>,
}

impl<T: Real, const UNITS: usize> AidingEvidence<T, UNITS> {
    pub fn new() -> Self {
        let nothing = Testified {
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

    /// Goes on over a window.
    pub fn advance(&mut self, around: &Surroundings<'_, T, UNITS>) {
        let follows = around.number == self.number.saturating_add(1);
        (self.number, self.span, self.calm) = (around.number, around.span.max(1), around.calm);
        self.silent += around.length;
        let listens = self.silent <= real(SILENT);
        self.navigation = self.navigation.filter(|_| follows && listens);
        if listens {
            self.navigate(around);
        }
        self.weigh_scores(around.length);
        self.forget(around);
    }

    fn navigate(&mut self, around: &Surroundings<'_, T, UNITS>) {
        let [force, _] = around.said;
        let rests = around.units.iter().flatten().any(|unit| unit.at_rest.is_some());
        let deviations: [[Vector3<T>; 2]; UNITS] = core::array::from_fn(|number| {
            SENSORS.map(|sensor| {
                let unit = around.units.get(number).and_then(Option::as_ref);
                let faulty = around.faulty.get(number).is_none_or(|faulty| *sensor.of(faulty));
                let unit = unit.filter(|unit| *sensor.of(&unit.votes) && !faulty);
                unit.map_or(Vector3::zeros(), |unit| {
                    sensor.of(&unit.reading) - *sensor.of(&around.said)
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
        navigation.advance(&Step {
            said: around.said,
            deviations: &deviations,
            length: around.length,
            gravity: around.gravity,
            rests,
        });
    }

    /// Evidence fades, fast while a unit does not depart from the others: what sound units differ by is nothing to testify of.
    fn forget(&mut self, around: &Surroundings<'_, T, UNITS>) {
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

    /// Scores of units' own estimators, as long as they are new.
    fn weigh_scores(&mut self, window: T) {
        for (score, against) in self.scores.iter_mut().zip(&mut self.against) {
            let Some((value, age)) = score else { continue };
            *age += window;
            if *age > real(SCORE_COUNTS) {
                *score = None;
                continue;
            }
            let beyond = (*value - T::one()) * real(0.5);
            let said = beyond.max(T::zero()).min(real(SCORE_MOST)) * (window / real(SCORE_SPAN)); // judgement.md, eq. 22
            for against in against {
                against.evidence = (against.evidence + said).min(real(MOST));
            }
        }
    }

    /// Takes in what an aiding measurement says of a time, microseconds of the common clock.
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

    /// Takes in a measurement of a time; the one that is heard first begins the integration.
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
        let worst = self.listen(navigation, aided, level)?;
        self.trust(Sensor::Accelerometer, worst)
    }

    fn take_heading(
        &mut self,
        navigation: &mut Navigation<T, UNITS>,
        aided: &AidedHeading<T>,
    ) -> Option<Trust<T>> {
        let innovation = navigation.along_heading(aided, self.calm)?;
        let best = self.weigh(navigation, &innovation, HEADING);
        if best.abs() < real(FITS_NOBODY) {
            navigation.update(&innovation);
        }
        let change = self.trust(Sensor::Gyroscope, best.abs());
        if self.of_heading.begins_anew() {
            navigation.forget_north();
        }
        change
    }

    /// How many windows ago a time was.
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

    /// Holds a velocity against what each unit makes of it, axis by axis; gives the largest misfit of the best, sigmas.
    fn listen(&mut self, navigation: &mut Navigation<T, UNITS>, aided: &Aided<T>, level: bool) -> Option<T> {
        let mut worst = None;
        for (place, axis) in [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().enumerate() {
            let innovation = if level {
                navigation.along_level(&axis, aided)
            } else {
                navigation.along_primary(&axis, aided)
            };
            let Some(innovation) = innovation else { continue };
            let best = self.weigh(navigation, &innovation, place);
            if best.abs() < real(FITS_NOBODY) {
                navigation.update(&innovation);
            }
            worst = Some(best.abs().max(worst.unwrap_or(T::zero())));
        }
        worst
    }

    /// Takes in one number that was measured, and gives the misfit of the best, sigmas.
    fn weigh(&mut self, navigation: &Navigation<T, UNITS>, innovation: &Innovation<T>, place: usize) -> T {
        // What gyroscopes of two units share, drift and the error of the filter's own bias, moves a velocity as much as what they
        // differ by; what accelerometers say moves no heading.
        let (confidence, speaks_of) = if place == HEADING {
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
        let (fits_somebody, most) = (best.abs() < real(FITS_NOBODY), real::<T>(FITS_NOBODY + 1.0));
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
            if fits_somebody && confidence.trusted && sensor == speaks_of {
                let set_within = of_set.max(-most).min(most);
                let said = (own_within * own_within - set_within * set_within) * real(0.5); // judgement.md, eq. 20
                against.evidence = (against.evidence + said).max(real(-MOST)).min(real(MOST));
            }
        }
        if self.calm && confidence.trusted && fits_somebody {
            confidence.learn(best);
        }
        best
    }

    /// What is known of the measurements that speak of a sensor: velocities of accelerometers, headings of gyroscopes.
    fn confidence(&mut self, sensor: Sensor) -> &mut Confidence<T> {
        match sensor {
            Sensor::Accelerometer => &mut self.of_velocity,
            Sensor::Gyroscope => &mut self.of_heading,
        }
    }

    /// Trusts measurements that speak of a sensor by the misfit of the best, sigmas; what they said is dropped where trust is
    /// lost.
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

    fn against(&self, sensor: Sensor, unit: usize) -> Option<&Testified<T>> {
        self.against.get(unit).map(|against| sensor.of(against))
    }

    /// Whether a unit's sensor fits what the aiding measurement says.
    fn fits(&self, sensor: Sensor, unit: usize) -> bool {
        let limit = real::<T>(FITS);
        self.against(sensor, unit)
            .is_some_and(|against| against.misfit.iter().all(|misfit| misfit.abs() < limit))
    }

    /// The wrong one of two units, where it is decided; of two that are not in dispute, it takes twice as much.
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

    /// Whether it speaks against a unit, and for all others.
    pub fn speaks_against(
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
