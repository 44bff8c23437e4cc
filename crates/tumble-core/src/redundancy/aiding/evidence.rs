//! Evidence of aiding measurements against units, and trust in the measurements.

use nalgebra::Vector3;

use crate::real::{Real, count, real, seconds, tabulated};
use crate::redundancy::aiding::course::CourseLikelihood;
use crate::redundancy::aiding::navigation::{Aided, AidedHeading, Innovation, Navigation, NavigationStep};
use crate::redundancy::aiding::track::{EARLY, LATE};
use crate::redundancy::aiding::{Aiding, AidingRejection};
use crate::redundancy::isolation::attribution::{Ground, Proof};
use crate::redundancy::unit_set::UnitSet;

/// Time constants with which evidence is forgotten, s: while a unit departs from others, and while it does not.
const REMEMBERED: f32 = 60.0;
const FORGOTTEN: f32 = 0.4;

/// Largest evidence that accumulates, so that later evidence can revise a decision.
const MOST: f64 = 15.0;

/// Misfit of an axis, sigmas, above which a measurement fits no unit, and its squares over one, two and three axes: of one chance.
const FITS_NONE: f64 = 4.0;
const BEYOND: [f32; 3] = [16.0, 19.3, 22.1];

/// Measurements over which misfits are averaged, and largest mean misfit, sigmas, of a unit that fits.
const AVERAGED: f64 = 20.0;
const FITS: f64 = 0.75;

/// Mean square misfit of the best unit, sigmas squared, above which trust in aiding measurements is lost, and
/// below which it is regained after a number of measurements.
const DISTRUSTED: f32 = 5.0;
const TRUSTED: f32 = 2.5;
const TRUSTED_AFTER: u16 = 10;

/// Measurements without trust after which the filters restart: where they never fitted, and where they did.
const ANEW_AFTER: [u16; 2] = [30, 150];

/// Usual mean square misfit of a unit: number of measurements of its average, and its largest value.
const USUAL_OVER: f64 = 20.0;
const USUAL_MOST: f64 = 9.0;

/// Times the usual mean square misfit of the best unit beyond which a filter goes on from the state of that one, while units agree.
const STRAYED: f64 = 2.0;

/// Logarithm of the likelihood ratio of two units that decides where they dispute: one decision in 400 is wrong. It is twice as
/// much where nothing but the measurements speaks. The wrong unit is isolated at 14 of 924 faults on recorded flights with 5, at 6
/// with 6 and at 4 with 8, and none at 28, 37 and 53.
const DECIDES: f64 = 6.0;

/// Largest evidence of one measurement: one alone decides nothing.
const OF_ONE: f64 = 3.5;

/// Time without a measurement after which integration is no longer used, s.
const SILENT: f64 = 10.0;

/// Time for which a score is valid, s; time of one independent score, s; and the largest evidence of one.
const SCORE_COUNTS: f64 = 1.5;
const SCORE_SPAN: f64 = 5.0;
const SCORE_MOST: f64 = 1.5;

/// Axes of a velocity.
const AXES: usize = 3;

/// Change of the trust in aiding measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Trust<T: Real> {
    /// The measurement contradicts all units: mean square misfit of the best unit, and its limit.
    Lost { misfit: T, limit: T },
    /// The measurement fits again.
    Regained,
}

/// Trust in aiding measurements of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Confidence<T: Real> {
    /// Recent mean square misfit of the best unit, sigmas squared.
    lately: T,
    trusted: bool,
    /// True if it was since the filters began: from then on a measurement that fits no unit changes nothing.
    has_trusted: bool,
    /// True if the latest misfit allows trust, and the number of successive measurements that agree on it.
    fit: bool,
    streak: u16,
    /// True if the loss of trust was reported.
    reported: bool,
}

impl<T: Real> Confidence<T> {
    fn new() -> Self {
        Self {
            lately: T::one(),
            trusted: false,
            has_trusted: false,
            fit: false,
            streak: 0,
            reported: false,
        }
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
            (false, false) if self.streak < self.anew_after() || self.reported => None,
            (false, true) if self.streak < TRUSTED_AFTER => None,
            (_, false) => {
                self.trusted = false;
                self.reported = true;
                Some(Trust::Lost { misfit, limit })
            }
            (false, true) => {
                (self.trusted, self.has_trusted) = (true, true);
                core::mem::take(&mut self.reported).then_some(Trust::Regained)
            }
        }
    }

    fn anew_after(&self) -> u16 {
        let [never, since] = ANEW_AFTER;
        if self.has_trusted { since } else { never }
    }

    /// Returns whether the estimation must restart after a long time without trust.
    fn begins_anew(&mut self) -> bool {
        let lost = !self.trusted && !self.fit && self.streak >= self.anew_after();
        if lost {
            self.streak = 0;
            self.has_trusted = false;
        }
        lost
    }
}

/// Reading of a unit over a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AidedReading<T: Real> {
    /// Specific force, m/s^2, and angular rate, rad/s, at the place and in the axes of the primary, with known errors corrected.
    pub reading: [Vector3<T>; 2],
    /// Squared noise densities of its samples, (m/s^2)^2 s and (rad/s)^2 s.
    pub noise: [T; 2],
}

/// State of the set in a window, for the comparison with aiding measurements.
pub(crate) struct AidingWindow<T: Real, const UNITS: usize> {
    /// Reading of each unit; `None` where it has none.
    pub readings: [Option<AidedReading<T>>; UNITS],
    /// Units that were found at fault.
    pub faulty: UnitSet,
    /// Units that depart from another: evidence against the others is soon forgotten.
    pub departing: UnitSet,
    /// True if no units disagree, so that usual values may be learnt.
    pub is_calm: bool,
    /// True if the set rests.
    pub rests: bool,
    /// Number of the window, and its length, microseconds and s.
    pub number: u64,
    pub span: u64,
    pub length: T,
    /// m/s^2.
    pub gravity: T,
}

/// Misfit of a unit with one measurement.
#[derive(Clone, Copy)]
struct AidedMisfit<T: Real> {
    /// Misfit of each axis that was compared, sigmas, and the sum of their squares.
    of_axes: [T; AXES],
    sum: T,
    axes: u8,
}

impl<T: Real> AidedMisfit<T> {
    fn none() -> Self {
        Self {
            of_axes: [T::zero(); AXES],
            sum: T::zero(),
            axes: 0,
        }
    }

    fn push(&mut self, axis: usize, sigmas: T) {
        if let Some(place) = self.of_axes.get_mut(axis) {
            *place = sigmas;
        }
        self.sum += sigmas * sigmas;
        self.axes += 1;
    }
}

/// Usual and recent misfits of a unit with measurements of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
struct UsualMisfit<T: Real> {
    /// Mean square of an axis in health, sigmas squared.
    usual: T,
    /// Recent means of each axis, sigmas.
    recent: [T; AXES],
}

impl<T: Real> UsualMisfit<T> {
    fn new() -> Self {
        Self {
            usual: T::one(),
            recent: [T::zero(); AXES],
        }
    }

    /// Adds a misfit to the recent ones.
    fn follow(&mut self, misfit: &AidedMisfit<T>) {
        let most = real::<T>(FITS_NONE + 1.0);
        for (recent, sigmas) in self.recent.iter_mut().zip(&misfit.of_axes) {
            let within = (*sigmas / self.usual.square_root()).max(-most).min(most);
            *recent += (within - *recent) / real(AVERAGED);
        }
    }

    /// Learns what is usual.
    fn learn(&mut self, misfit: &AidedMisfit<T>) {
        let square = (misfit.sum / count(misfit.axes.into())).min(real(USUAL_MOST));
        self.usual = (self.usual + (square - self.usual) / real(USUAL_OVER)).max(T::one());
    }

    /// Returns whether a misfit is one of health.
    fn explains(&self, misfit: &AidedMisfit<T>) -> bool {
        let limit = usize::from(misfit.axes)
            .checked_sub(1)
            .and_then(|axes| BEYOND.get(axes));
        limit.is_some_and(|limit| misfit.sum < self.usual * tabulated(*limit))
    }

    fn fits(&self) -> bool {
        self.recent.iter().all(|recent| recent.abs() < real(FITS))
    }
}

/// The hypothesis that a unit is right.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hypothesis<T: Real> {
    navigation: Option<Navigation<T>>,
    /// Latest reading, which goes on where there is none.
    held: Option<AidedReading<T>>,
    /// Logarithm of the likelihood ratio: of the best unit over this one.
    against: T,
    of_velocity: UsualMisfit<T>,
    of_heading: UsualMisfit<T>,
    /// Score, and its age, s.
    score: Option<(T, T)>,
}

/// Quantity that is measured.
#[derive(Clone, Copy, PartialEq)]
enum Quantity {
    Velocity,
    Heading,
}

impl<T: Real> Hypothesis<T> {
    fn new() -> Self {
        Self {
            navigation: None,
            held: None,
            against: T::zero(),
            of_velocity: UsualMisfit::new(),
            of_heading: UsualMisfit::new(),
            score: None,
        }
    }

    fn of(&mut self, quantity: Quantity) -> &mut UsualMisfit<T> {
        match quantity {
            Quantity::Velocity => &mut self.of_velocity,
            Quantity::Heading => &mut self.of_heading,
        }
    }

    /// Advances by a window, with the reading before where there is none.
    fn advance(&mut self, reading: Option<AidedReading<T>>, around: &NavigationWindow<T>) {
        self.held = reading.or(self.held);
        let Some(AidedReading { reading, noise }) = &self.held else {
            return;
        };
        let Some(navigation) = &mut self.navigation else {
            self.begin();
            return;
        };
        navigation.advance(&NavigationStep {
            reading,
            noise,
            length: around.length,
            gravity: around.gravity,
            rests: around.rests,
        });
        if !navigation.is_finite() {
            self.navigation = None;
        }
    }

    /// Begins level by the latest reading.
    #[cold]
    #[inline(never)]
    fn begin(&mut self) {
        if let Some(AidedReading {
            reading: [force, _], ..
        }) = &self.held
        {
            self.navigation = Some(Navigation::start(force));
        }
    }

    /// Begins with the first velocity, and goes on with the search for its course.
    #[inline(never)]
    fn begin_velocity(&mut self, aided: &Aided<T>, level: bool) {
        if let Some(navigation) = &mut self.navigation {
            if level {
                navigation.begin_along_level(aided);
            } else {
                navigation.begin_along_primary(aided);
            }
        }
    }

    /// Innovation along an axis of a velocity, where it can be compared.
    fn along(&self, axis: usize, aided: &Aided<T>, level: bool) -> Option<Innovation<T>> {
        let navigation = self.navigation.as_ref()?;
        if level {
            navigation.along_level(axis, aided)
        } else {
            navigation.along_primary(axis, aided)
        }
    }

    /// Updates the state with a velocity, axis by axis.
    #[inline(never)]
    fn update_velocity(&mut self, aided: &Aided<T>, level: bool) -> AidedMisfit<T> {
        let mut misfit = AidedMisfit::none();
        for axis in 0..AXES {
            let innovation = self.along(axis, aided, level);
            if let Some((innovation, navigation)) = innovation.zip(self.navigation.as_mut()) {
                navigation.update(&innovation);
                misfit.push(axis, innovation.sigmas());
            }
        }
        misfit
    }

    /// Compares a heading with the prediction, once its reference direction is known.
    fn compare_heading(&mut self, aided: &AidedHeading<T>, is_calm: bool) -> Option<AidedMisfit<T>> {
        let navigation = self.navigation.as_mut()?;
        let innovation = navigation.along_heading(aided, is_calm)?;
        navigation.update(&innovation);
        let mut misfit = AidedMisfit::none();
        misfit.push(0, innovation.sigmas());
        self.of_heading.follow(&misfit);
        Some(misfit)
    }
}

/// Conditions of all units in a window.
struct NavigationWindow<T: Real> {
    length: T,
    gravity: T,
    rests: bool,
}

/// Evidence of all aiding measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AidingEvidence<T: Real, const UNITS: usize> {
    /// Number of the latest window, and length of a window, microseconds.
    number: u64,
    span: u64,
    hypotheses: [Hypothesis<T>; UNITS],
    /// Units that were at fault in the latest window.
    faulty: UnitSet,
    /// Time since the latest velocity or heading, s.
    silent: T,
    is_calm: bool,
    /// Trust in velocities, and in headings.
    of_velocity: Confidence<T>,
    of_heading: Confidence<T>,
}

impl<T: Real, const UNITS: usize> AidingEvidence<T, UNITS> {
    pub fn new() -> Self {
        Self {
            number: 0,
            span: 1,
            hypotheses: [Hypothesis::new(); UNITS],
            faulty: UnitSet::default(),
            silent: real(f64::INFINITY),
            is_calm: false,
            of_velocity: Confidence::new(),
            of_heading: Confidence::new(),
        }
    }

    /// Advances by a window.
    pub fn advance(&mut self, around: &AidingWindow<T, UNITS>) {
        let follows = around.number == self.number.saturating_add(1);
        (self.number, self.span, self.is_calm) = (around.number, around.span.max(1), around.is_calm);
        self.faulty = around.faulty;
        self.silent += around.length;
        let in_use = self.silent <= real(SILENT);
        if !follows || !in_use {
            self.forget_state();
        }
        let common = NavigationWindow {
            length: around.length,
            gravity: around.gravity,
            rests: around.rests,
        };
        for (number, (hypothesis, reading)) in self.hypotheses.iter_mut().zip(&around.readings).enumerate() {
            if in_use {
                hypothesis.advance(*reading, &common);
            }
            weigh_score(hypothesis, around.length);
            let (over, most) = if around.departing.contains(number) {
                (REMEMBERED, MOST)
            } else {
                (FORGOTTEN, OF_ONE)
            };
            let left = T::one() - around.length / tabulated(over);
            hypothesis.against = (hypothesis.against * left).min(real(most));
            if around.faulty.contains(number) {
                hypothesis.against = T::zero();
            }
        }
    }

    fn forget_state(&mut self) {
        for hypothesis in &mut self.hypotheses {
            (hypothesis.navigation, hypothesis.held) = (None, None);
        }
    }

    /// Processes an aiding measurement of a time, microseconds of the common clock.
    pub fn take(&mut self, time: u64, aiding: &Aiding<T>) -> Result<Option<Trust<T>>, AidingRejection> {
        if let Aiding::Score { unit, value } = aiding {
            if let Some(hypothesis) = self.hypotheses.get_mut(*unit) {
                hypothesis.score = Some((*value, T::zero()));
            }
            return Ok(None);
        }
        let has_begun = self.hypotheses.iter().any(|each| each.navigation.is_some());
        // The first measurement starts the integration.
        let windows = if has_begun {
            self.windows_ago(time)?
        } else {
            T::zero()
        };
        self.silent = T::zero();
        if !has_begun {
            return Ok(None);
        }
        Ok(match aiding {
            Aiding::Velocity { value, sigma } | Aiding::BodyVelocity { value, sigma } => {
                let aided = Aided {
                    value: *value,
                    sigma: *sigma,
                    windows,
                    length: seconds(self.span),
                };
                self.take_velocity(&aided, matches!(aiding, Aiding::Velocity { .. }))
            }
            Aiding::Heading { value, sigma } => self.take_heading(&AidedHeading {
                value: *value,
                sigma: *sigma,
                windows,
            }),
            Aiding::Score { .. } => None,
        })
    }

    fn take_velocity(&mut self, aided: &Aided<T>, level: bool) -> Option<Trust<T>> {
        for hypothesis in &mut self.hypotheses {
            hypothesis.begin_velocity(aided, level);
        }
        // Before any update: a measurement that fits no unit changes nothing, once they fit.
        let beforehand = self.misfits(aided, level);
        let sound = self.hypotheses.iter().zip(&beforehand).enumerate();
        let mut sound = sound.filter(|(number, _)| !self.faulty.contains(*number));
        let fits_any = sound.any(|(_, (hypothesis, misfit))| hypothesis.of_velocity.explains(misfit));
        let mut misfits = beforehand;
        if fits_any || !self.of_velocity.has_trusted {
            misfits = self
                .hypotheses
                .each_mut()
                .map(|hypothesis| hypothesis.update_velocity(aided, level));
        }
        for (hypothesis, misfit) in self.hypotheses.iter_mut().zip(&misfits) {
            hypothesis.of_velocity.follow(misfit);
        }
        let misfits = misfits.map(|misfit| Some(misfit).filter(|misfit| misfit.axes > 0));
        self.choose_course();
        let change = self.weigh(Quantity::Velocity, &misfits)?;
        if self.is_calm {
            self.join_state();
        }
        if self.of_velocity.begins_anew() {
            self.forget_state();
        }
        change
    }

    /// Misfits of all units with a velocity, before any update.
    #[inline(never)]
    fn misfits(&self, aided: &Aided<T>, level: bool) -> [AidedMisfit<T>; UNITS] {
        self.hypotheses.each_ref().map(|hypothesis| {
            let mut misfit = AidedMisfit::none();
            for axis in 0..AXES {
                if let Some(innovation) = hypothesis.along(axis, aided, level) {
                    misfit.push(axis, innovation.sigmas());
                }
            }
            misfit
        })
    }

    fn take_heading(&mut self, aided: &AidedHeading<T>) -> Option<Trust<T>> {
        let is_calm = self.is_calm;
        let misfits = self
            .hypotheses
            .each_mut()
            .map(|hypothesis| hypothesis.compare_heading(aided, is_calm));
        let change = self.weigh(Quantity::Heading, &misfits)?;
        if self.of_heading.begins_anew() {
            let navigations = self
                .hypotheses
                .iter_mut()
                .filter_map(|each| each.navigation.as_mut());
            navigations.for_each(Navigation::forget_north);
        }
        change
    }

    /// While units agree there is one state, and a filter that strayed from it goes on from that of the best unit.
    #[inline(never)]
    fn join_state(&mut self) -> Option<()> {
        let mut best = None;
        for (number, each) in self.hypotheses.iter().enumerate() {
            let usual = each.of_velocity.usual;
            let counts = each.navigation.is_some() && !self.faulty.contains(number);
            if counts && best.is_none_or(|(_, least)| usual < least) {
                best = Some((number, usual));
            }
        }
        let (best, least) = best?;
        let best = self.hypotheses.get(best)?;
        let (navigation, of_velocity) = (best.navigation, best.of_velocity);
        let is_strayed = |each: &&mut Hypothesis<T>| each.of_velocity.usual > least * real(STRAYED);
        for strayed in self.hypotheses.iter_mut().filter(is_strayed) {
            (strayed.navigation, strayed.of_velocity) = (navigation, of_velocity);
            strayed.against = T::zero();
        }
        Some(())
    }

    /// Ends the search for the course, which is one for all units, once it is known.
    #[inline(never)]
    fn choose_course(&mut self) {
        let (mut of_all, mut moving) = (CourseLikelihood::none(), None);
        for (number, hypothesis) in self.hypotheses.iter().enumerate() {
            let search = hypothesis.navigation.as_ref().and_then(Navigation::course_search);
            if let Some(search) = search.filter(|_| !self.faulty.contains(number)) {
                of_all.add(search.likelihood());
                moving = Some(search.moving());
            }
        }
        if let Some((course, variance)) = moving.and_then(|moving| of_all.found(moving)) {
            let navigations = self
                .hypotheses
                .iter_mut()
                .filter_map(|each| each.navigation.as_mut());
            navigations.for_each(|navigation| navigation.choose_course(course, variance));
        }
    }

    /// Adds the evidence of a measurement against each unit, and returns a change of trust; `None` where no unit is compared.
    #[allow(clippy::option_option)]
    #[inline(never)]
    fn weigh(
        &mut self,
        quantity: Quantity,
        misfits: &[Option<AidedMisfit<T>>; UNITS],
    ) -> Option<Option<Trust<T>>> {
        let faulty = self.faulty;
        let confidence = match quantity {
            Quantity::Velocity => &mut self.of_velocity,
            Quantity::Heading => &mut self.of_heading,
        };
        let (mut least, mut mean, mut fits_any) = (None, None, false);
        let compared = self.hypotheses.iter_mut().zip(misfits).enumerate();
        for (_, (hypothesis, misfit)) in compared.filter(|(number, _)| !faulty.contains(*number)) {
            if let Some(misfit) = misfit {
                let usual = hypothesis.of(quantity).usual;
                fits_any |= hypothesis.of(quantity).explains(misfit);
                least = smallest(least, misfit.sum / usual);
                mean = smallest(mean, misfit.sum / usual / count(misfit.axes.into()));
            }
        }
        let (least, mean) = least.zip(mean)?;
        let counts = fits_any && confidence.trusted;
        for (hypothesis, misfit) in self.hypotheses.iter_mut().zip(misfits) {
            let Some(misfit) = misfit else { continue };
            if counts {
                let beyond = (misfit.sum / hypothesis.of(quantity).usual - least) * real(0.5); // set.md, eq. 34
                let added = beyond.max(T::zero()).min(real(OF_ONE));
                hypothesis.against = (hypothesis.against + added).min(real(MOST));
            }
            if self.is_calm && (fits_any || !confidence.has_trusted) {
                hypothesis.of(quantity).learn(misfit);
            }
        }
        let before = confidence.trusted;
        let change = confidence.trust(mean.square_root());
        if before && !confidence.trusted {
            for hypothesis in &mut self.hypotheses {
                hypothesis.against = T::zero();
            }
        }
        Some(change)
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

    /// Returns whether a unit fits the aiding measurements.
    fn fits(&self, unit: usize) -> bool {
        self.hypotheses
            .get(unit)
            .is_some_and(|each| each.of_velocity.fits() && each.of_heading.fits())
    }

    /// Returns the faulty one of two units, if the evidence decides; without a dispute the threshold is
    /// doubled.
    pub fn decides(&self, [first, second]: [usize; 2], disputed: bool) -> Option<(usize, Proof<T>)> {
        let of = |unit: usize| self.hypotheses.get(unit).map(|hypothesis| hypothesis.against);
        let apart = of(first)? - of(second)?;
        let (wrong, right) = if apart > T::zero() {
            (first, second)
        } else {
            (second, first)
        };
        let limit = real::<T>(DECIDES) * tabulated(if disputed { 1.0 } else { 2.0 });
        let proof = proof(apart.abs(), limit).filter(|_| self.fits(right))?;
        Some((wrong, proof))
    }

    /// Returns the evidence if it is against a unit and in favour of all others.
    pub fn contradicts(&self, unit: usize, mut others: impl Iterator<Item = usize>) -> Option<Proof<T>> {
        let own = self.hypotheses.get(unit)?.against;
        let least = others.try_fold(own, |least, other| {
            let evidence = self.hypotheses.get(other).filter(|_| self.fits(other))?.against;
            Some(least.min(own - evidence))
        })?;
        proof(least, real(2.0 * DECIDES))
    }
}

/// Adds the evidence of a score while it is valid.
fn weigh_score<T: Real>(hypothesis: &mut Hypothesis<T>, window: T) {
    let Some((value, age)) = &mut hypothesis.score else {
        return;
    };
    *age += window;
    if *age > real(SCORE_COUNTS) {
        hypothesis.score = None;
        return;
    }
    let beyond = (*value - T::one()) * real(0.5);
    let added = beyond.max(T::zero()).min(real(SCORE_MOST)) * (window / real(SCORE_SPAN)); // set.md, eq. 35
    hypothesis.against = (hypothesis.against + added).min(real(MOST));
}

fn smallest<T: Real>(least: Option<T>, value: T) -> Option<T> {
    Some(least.map_or(value, |least| least.min(value)))
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
            let [first, second] = &mut evidence.hypotheses;
            weigh_score(first, 0.05);
            weigh_score(second, 0.05);
            assert_eq!(first.against, 0.0);
            assert_eq!(second.against > 0.0, is_evidence, "{value}");
        }
    }
}
