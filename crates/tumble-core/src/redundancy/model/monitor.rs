//! The monitor of a redundant set: samples in, events out.

use super::bounds::{Bounds, LearntError};
use super::clock::Clock;
use super::error::{Parameters, SecondaryErrors};
use super::gather::{Gathering, LearningBlock};
use super::motion::MotionOfSet;
use super::own::{Others, Own, Reason};
use super::rest::{self, UnitRest};
use super::table::{
    AGREEING, BEGINS, BLOCK, BLOCK_SCALE, BLOCK_SECONDS, BOUNDS, COUNT, DWELL, EVIDENCE, HOP, LATE, RETURNS,
    SLOWEST, SYNCHRONISED, WAIT,
};
use super::test::{Exceedance, MotionMeans, PairComparison, PairTest, TestConditions, Timing};
use super::vibration::{self, Vibration};
use super::vote::{Named, Vote};
use super::window::{UnitWindow, UnitWindows};
use crate::real::{Real, real, seconds, whole_spans};
use crate::redundancy::components::{larger, smaller};
use crate::redundancy::optional_time::OptionalTime;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::redundancy::unit_set::{UnitSet, pairs};
use crate::sample::{CHANNELS, Sample};

crate::vocabulary! {
    /// Kind of an event of a set.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum SetEventKind<T: Real> {
        /// A unit is wrong.
        Unhealthy {
            /// Reason.
            reason: Reason,
            /// The deviation that shows it, where there is one.
            finding: Option<Exceedance<T>>,
            /// Units that are wrong by the same comparison, itself too.
            together: UnitSet,
        } = "unhealthy",
        /// A unit counts again.
        Healthy = "healthy",
        /// A unit disagrees with another, and none is known to be wrong.
        Disagree {
            /// The other unit.
            other: usize,
            /// The finding that shows it.
            finding: Exceedance<T>,
        } = "disagree",
        /// Two units that disagreed agree again.
        Agree {
            /// The other unit.
            other: usize,
            /// Sensor by which they disagreed.
            sensor: Sensor,
        } = "agree",
        /// The source changed.
        Selected {
            /// Reason.
            why: Selected,
        } = "selected",
    }
}

crate::vocabulary! {
    /// Reason for a source.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Selected {
        /// The first one.
        Start = "start",
        /// The one before failed, or a better one returned.
        Failed = "failed",
        /// No unit is left.
        NoneFit = "none fit",
    }
}

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetEvent<T: Real> {
    /// Microseconds of the common clock: the end of the window that shows it.
    pub time: u64,
    /// Unit concerned; `None` where no unit is left.
    pub unit: Option<usize>,
    /// Kind of the event.
    pub kind: SetEventKind<T>,
}

/// Receiver of events.
pub type ReportEvent<'a, T> = &'a mut dyn FnMut(&SetEvent<T>);

/// State of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Unit<T: Real> {
    windows: UnitWindows<T>,
    vibration: Vibration<T>,
    own: Own<T>,
    rest: UnitRest<T>,
    clock: Clock<T>,
    own_until: u64,
    agreed_since: u64,
}

/// State of one pair.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ComparedPair<T: Real> {
    test: PairTest<T>,
    disputing: u8,
}

/// One set of units, primary first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetMonitor<T: Real, const UNITS: usize>
where
    Units<UNITS>: UnitCount,
{
    units: [Unit<T>; UNITS],
    pairs: <Units<UNITS> as UnitCount>::OfPairs<ComparedPair<T>>,
    errors: <Units<UNITS> as UnitCount>::OfSecondaries<SecondaryErrors<T>>,
    motion: MotionMeans<T>,
    vote: Vote<T>,
    bounds: Bounds<T>,
    gathering: Gathering<T, UNITS>,
    waiting: Option<LearningBlock<T, UNITS>>,
    voted_out: UnitSet,
    beyond: UnitSet,
    has_learnt: bool,
    /// Units that disagree, and the sensor that shows it.
    dispute: Option<([usize; 2], Sensor)>,
    disputed_last: OptionalTime,
    source: Option<Option<u8>>,
    /// True if the clocks of secondaries are those of the units, and not the primary's.
    finds_delays: bool,
    /// Units that others found at fault, or that send nothing of use.
    left_out: UnitSet,
    /// Units of pairs that disagreed in the latest window.
    disputed: UnitSet,
    /// Time of the newest sample of any unit.
    newest: Option<u64>,
    /// Number of the first window, and of those since.
    first: u64,
    so_far: Option<u32>,
}

/// Readings of all units over a window.
pub struct CorrectedWindow<'a, T: Real, const UNITS: usize> {
    /// Number of the window: that of its middle in the grid of hops.
    pub number: u64,
    /// m/s^2 and rad/s, at the place of the primary, less the errors that are learnt; `None` where samples are missing.
    pub readings: &'a [Option<[T; CHANNELS]>; UNITS],
    /// Squared noise densities of the samples of each unit, (m/s^2)^2 s and (rad/s)^2 s.
    pub noise: [[T; 2]; UNITS],
    /// Units that count.
    pub active: UnitSet,
    /// Units that disagree with another, while none is known to be wrong.
    pub disputed: UnitSet,
    /// True if the set rests.
    pub is_rest: bool,
}

/// Receiver of windows.
pub type SeeWindow<'a, T, const UNITS: usize> = &'a mut dyn FnMut(&CorrectedWindow<'_, T, UNITS>);

/// All that one window shows.
struct Evaluated<'a, T: Real, const UNITS: usize> {
    now: u64,
    windows: &'a [UnitWindow<T>; UNITS],
    motion: &'a MotionOfSet<T>,
    is_rest: bool,
    has_begun: bool,
    /// Units that count.
    active: UnitSet,
}

impl<T: Real, const UNITS: usize> SetMonitor<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    /// Begins before the first sample, with units of one clock, or each of its own.
    pub fn new(finds_delays: bool) -> Self {
        let unit = Unit {
            windows: UnitWindows::new(),
            vibration: Vibration::new(),
            own: Own::new(),
            rest: UnitRest::new(),
            clock: Clock::new(),
            own_until: 0,
            agreed_since: 0,
        };
        let pair = ComparedPair {
            test: PairTest::new(),
            disputing: 0,
        };
        Self {
            units: [unit; UNITS],
            pairs: <Units<UNITS> as UnitCount>::filled_pairs(pair),
            errors: <Units<UNITS> as UnitCount>::filled(SecondaryErrors::uncalibrated()),
            motion: MotionMeans::new(),
            vote: Vote::new(),
            bounds: Bounds::new(BOUNDS.map(|limits| limits.map(real))),
            gathering: Gathering::new(),
            waiting: None,
            voted_out: UnitSet::default(),
            beyond: UnitSet::default(),
            has_learnt: false,
            dispute: None,
            disputed_last: OptionalTime::NONE,
            source: None,
            finds_delays,
            left_out: UnitSet::default(),
            disputed: UnitSet::default(),
            newest: None,
            first: 0,
            so_far: None,
        }
    }

    /// Returns whether two units disagree of which none is known to be wrong.
    pub fn is_disputed(&self) -> bool {
        self.dispute.is_some()
    }

    /// The last two units that count, where they disagree, and the sensor that shows it.
    pub fn two_disputed(&self) -> Option<([usize; 2], Sensor)> {
        let (_, sensor) = self.dispute?;
        let sound = self.sound();
        let mut units = sound.units();
        let pair = [units.next()?, units.next()?];
        (sound.count() == 2).then_some((pair, sensor))
    }

    /// Begins anew, in place, with units of one clock, or each of its own.
    pub fn reset(&mut self, finds_delays: bool) {
        self.restart_time();
        self.finds_delays = finds_delays;
        for errors in self.errors.as_mut() {
            *errors = SecondaryErrors::uncalibrated();
        }
        for pair in self.pairs.as_mut() {
            pair.test = PairTest::new();
        }
        self.bounds = Bounds::new(BOUNDS.map(|limits| limits.map(real)));
        self.voted_out = UnitSet::default();
        self.beyond = UnitSet::default();
        self.left_out = UnitSet::default();
        self.has_learnt = false;
        self.source = None;
    }

    /// Forgets all windows after a jump of the time of the set; errors, noise and decisions stay.
    pub fn restart_time(&mut self) {
        for unit in &mut self.units {
            unit.windows = UnitWindows::new();
            unit.vibration = Vibration::new();
            unit.own = Own::new();
            unit.rest = UnitRest::new();
            unit.clock = Clock::new();
            (unit.own_until, unit.agreed_since) = (0, 0);
        }
        for pair in self.pairs.as_mut() {
            pair.test.forget();
            pair.disputing = 0;
        }
        self.motion = MotionMeans::new();
        self.vote = Vote::new();
        self.gathering = Gathering::new();
        self.waiting = None;
        self.dispute = None;
        self.disputed_last = OptionalTime::NONE;
        self.disputed = UnitSet::default();
        (self.newest, self.first, self.so_far) = (None, 0, None);
    }

    /// Returns whether a unit samples too slowly for windows of 0.1 s.
    pub fn is_slow(&self) -> bool {
        self.units
            .iter()
            .any(|unit| unit.windows.interval() > real(SLOWEST))
    }

    /// Number of windows so far.
    pub fn windows(&self) -> u32 {
        self.so_far.unwrap_or(0)
    }

    /// Units that count, once the set has been compared for long enough to name one; none before.
    pub fn sound(&self) -> UnitSet {
        let windows = u64::from(self.windows());
        let now = (self.first + windows).saturating_mul(HOP);
        if windows.saturating_mul(HOP) < self.begins() {
            return UnitSet::default();
        }
        self.active(now)
    }

    /// Units of pairs that disagreed in the latest window.
    pub fn disputed(&self) -> UnitSet {
        self.disputed
    }

    /// Leaves out units that others found at fault, or that send nothing of use, and no others.
    pub fn leave_out(&mut self, units: UnitSet) {
        self.left_out = units;
    }

    /// Takes a unit for wrong that others named, until it has agreed with the rest for a while.
    pub fn exclude(&mut self, unit: usize) {
        self.voted_out.insert(unit);
        let now = (self.first + u64::from(self.windows())).saturating_mul(HOP);
        if let Some(unit) = self.units.get_mut(unit) {
            unit.agreed_since = now;
        }
    }

    /// Lets a unit count again that was wrong.
    pub fn readmit(&mut self, unit: usize) {
        self.voted_out.remove(unit);
        self.beyond.remove(unit);
    }

    /// us after the first window until units are compared.
    fn begins(&self) -> u64 {
        if self.finds_delays { SYNCHRONISED } else { BEGINS }
    }

    /// States the largest errors of a sound unit, m/s^2 and rad/s: of the primary at rest, and of any unit.
    pub fn set_limits(&mut self, limits: [[T; 2]; 2]) {
        self.bounds = Bounds::new(limits);
    }

    /// States the errors of a secondary, numbered from 1.
    pub fn set_errors(&mut self, unit: usize, errors: &SecondaryErrors<T>) {
        let secondary = unit.checked_sub(1);
        if let Some(place) = secondary.and_then(|secondary| self.errors.as_mut().get_mut(secondary)) {
            *place = *errors;
        }
        // Differences of pairs were taken beside other errors.
        for (pair, units) in self.pairs.as_mut().iter_mut().zip(pairs::<UNITS>()) {
            if units.contains(&unit) {
                pair.test.forget();
            }
        }
    }

    /// Errors of a secondary, numbered from 1; `None` where they are relative to a primary that is wrong.
    pub fn errors(&self, unit: usize) -> Option<&SecondaryErrors<T>> {
        let secondary = unit.checked_sub(1).filter(|_| !self.beyond.contains(0))?;
        self.errors.as_ref().get(secondary)
    }

    /// Takes a sample of a unit, in the axes of the primary, and reports what its windows show. Units may send in any order, up
    /// to 0.15 s behind one another.
    pub fn push(&mut self, number: usize, sample: &Sample<T>, report: ReportEvent<'_, T>) {
        self.push_seen(number, sample, report, &mut |_| {});
    }

    /// Takes a sample as [`Self::push`] does, and gives each window that it ends.
    pub fn push_seen(
        &mut self,
        number: usize,
        sample: &Sample<T>,
        report: ReportEvent<'_, T>,
        see: SeeWindow<'_, T, UNITS>,
    ) {
        let Some(unit) = self.units.get_mut(number) else {
            return;
        };
        let is_own = self.finds_delays && number > 0;
        let time = if is_own {
            unit.clock.corrected(sample.time)
        } else {
            sample.time
        };
        self.take_note_of_pause(time);
        if let Some(unit) = self.units.get_mut(number) {
            unit.windows.push(time, &sample.channels());
        }
        if self.so_far.is_none() {
            let (whole, left) = whole_spans(time, HOP);
            self.first = whole + 1 + u64::from(left > 0);
            self.so_far = Some(0);
        }
        // Nobody is ahead by more than the windows that units keep, but after a pause of all.
        while let Some(index) = self.next_window() {
            self.evaluate(index, report, see);
        }
    }

    /// Takes note of a pause of all units, in which none is silent by itself: nobody sent for half the time after which the quickest
    /// unit is late.
    fn take_note_of_pause(&mut self, time: u64) {
        let gap = self.newest.map_or(0, |newest| time.saturating_sub(newest));
        let gap = seconds::<T>(gap) * real(2.0);
        self.newest = self.newest.max(Some(time));
        // Nearly all samples come sooner than any unit is late.
        if gap <= real(LATE.0) {
            return;
        }
        let mut late_after = self.units.iter().map(|unit| unit.windows.late_after());
        let first = late_after.next().unwrap_or(T::zero());
        if gap > late_after.fold(first, smaller) {
            self.units.iter_mut().for_each(|unit| unit.windows.resume(time));
        }
    }

    /// The window that all units have ended, or for which none is waited any longer.
    fn next_window(&self) -> Option<u64> {
        let index = self.first + u64::from(self.so_far?);
        let newest = self.units.iter().filter_map(|unit| unit.windows.last()).max()?;
        // A window beyond the largest time never ends.
        let has_ended = (index + 1).checked_mul(HOP).is_some_and(|end| newest >= end);
        let all = self.units.iter().all(|unit| {
            let last = unit.windows.last().unwrap_or(0);
            unit.windows.has_ended(index) || newest >= last.saturating_add(WAIT)
        });
        (has_ended && all).then_some(index)
    }

    #[inline(never)]
    fn evaluate(&mut self, index: u64, report: ReportEvent<'_, T>, see: SeeWindow<'_, T, UNITS>) {
        let number = self.so_far.unwrap_or(0);
        let now = (index + 1).saturating_mul(HOP);
        let windows = core::array::from_fn(|unit| self.window_of(unit, index));
        let motion = MotionOfSet::of_set(&windows);
        let is_pause = !windows.iter().any(|window| window.is_whole);
        for (unit, window) in self.units.iter_mut().zip(&windows) {
            unit.own.take(&window.repeated, &motion);
            unit.vibration.take(window, &motion, number, is_pause);
        }
        self.take_delays(number, index, &windows);
        let is_rest = self.take_rest(&windows);
        let has_begun = now.saturating_sub(self.first.saturating_mul(HOP)) >= self.begins();
        if has_begun {
            self.look_at_own(now, number, (&windows, &motion), is_rest, report);
        }
        let at = Evaluated {
            now,
            windows: &windows,
            motion: &motion,
            is_rest,
            has_begun,
            active: self.active(now),
        };
        let readings = self.corrected(&at);
        let (worst, named) = self.compare(&at, &readings);
        if has_begun {
            self.look_at_vote(&at, named, &worst, report);
            self.look_at_dispute(&at, &worst, report);
            self.look_at_rest(&at, report);
            self.disputed = disputed(&at, &worst);
            self.reinstate(&at, &worst, report);
        }
        see(&CorrectedWindow {
            number: index,
            readings: &readings,
            noise: core::array::from_fn(|unit| self.noise_of(unit, &windows)),
            active: self.active(now),
            disputed: self.dispute.map_or(self.disputed, |(pair, _)| {
                UnitSet::of::<UNITS>(|unit| pair.contains(&unit))
            }),
            is_rest,
        });
        self.select(now, report);
        self.learn(&at, number, &worst, report);
        self.so_far = Some(number.saturating_add(1));
    }

    fn window_of(&self, unit: usize, index: u64) -> UnitWindow<T> {
        let unit = self.units.get(unit);
        unit.map_or(UnitWindows::new().of(index), |unit| unit.windows.of(index))
    }

    /// Finds delays of clocks, and forgets what pairs differed by before these were known.
    fn take_delays(&mut self, number: u32, index: u64, windows: &[UnitWindow<T>; UNITS]) {
        let before = self.timed();
        let mut units = self.units.iter_mut().zip(windows).filter(|_| self.finds_delays);
        if let Some((_, primary)) = units.next() {
            units.for_each(|(unit, window)| unit.clock.take(number, index, primary, window));
        }
        let became = self.timed().without(before);
        for (pair, [i, j]) in self.pairs.as_mut().iter_mut().zip(pairs::<UNITS>()) {
            if became.contains(i) || became.contains(j) {
                pair.test.forget();
            }
        }
    }

    /// Units of which the delay of the clock is known.
    fn timed(&self) -> UnitSet {
        let is_known = |unit: usize| self.units.get(unit).is_some_and(|unit| unit.clock.is_known());
        UnitSet::of::<UNITS>(|unit| unit == 0 || !self.finds_delays || is_known(unit))
    }

    fn take_rest(&mut self, windows: &[UnitWindow<T>; UNITS]) -> bool {
        rest::take(self.units.each_mut().map(|unit| &mut unit.rest), windows)
    }

    fn active(&self, now: u64) -> UnitSet {
        let is_so = |unit: usize| self.units.get(unit).is_some_and(|unit| now >= unit.own_until);
        UnitSet::of::<UNITS>(is_so)
            .without(self.voted_out)
            .without(self.left_out)
    }

    /// Names units by what their own samples show.
    fn look_at_own(
        &mut self,
        now: u64,
        number: u32,
        (windows, motion): (&[UnitWindow<T>; UNITS], &MotionOfSet<T>),
        is_rest: bool,
        report: ReportEvent<'_, T>,
    ) {
        let active = self.active(now);
        let [returns, _] = RETURNS;
        let mut scatter = [[T::zero(); 2]; UNITS];
        for (ratios, (unit, window)) in scatter.iter_mut().zip(self.units.iter().zip(windows)) {
            if window.is_whole {
                *ratios = unit.vibration.scatter_ratio(&window.scatter, is_rest);
            }
        }
        let others = Others {
            windows,
            late_after: &self.units.each_ref().map(|unit| unit.windows.late_after()),
            resolution: &self.units.each_ref().map(|unit| unit.windows.resolution()),
            motion,
            scatter: &scatter,
            is_rest,
            is_active: &core::array::from_fn(|unit| active.contains(unit)),
            windows_so_far: number.saturating_add(1),
        };
        for (number, unit) in self.units.iter_mut().enumerate() {
            for (reason, finding) in unit
                .own
                .faults(number, &unit.vibration, &others)
                .into_iter()
                .flatten()
            {
                if now >= unit.own_until && !self.voted_out.contains(number) {
                    report(&unhealthy(now, number, reason, finding));
                }
                unit.own_until = now.saturating_add(returns);
            }
        }
    }

    /// Squared noise densities of the samples of a unit.
    fn noise_of(&self, unit: usize, windows: &[UnitWindow<T>; UNITS]) -> [T; 2] {
        let interval = self
            .units
            .get(unit)
            .map_or(T::zero(), |unit| unit.windows.interval());
        let scatter = windows.get(unit).map_or([T::zero(); 2], |window| window.scatter);
        scatter.map(|scatter| scatter * interval)
    }

    /// Readings of all units in a window, less their errors.
    fn corrected(&self, at: &Evaluated<'_, T, UNITS>) -> [Option<[T; CHANNELS]>; UNITS] {
        let errors = self.errors_along(at.motion);
        let mut corrected = [None; UNITS];
        for (place, (window, errors)) in corrected.iter_mut().zip(at.windows.iter().zip(&errors)) {
            let mut values = window.reading;
            for (value, error) in values.iter_mut().zip(errors.as_flattened()) {
                *value -= *error;
            }
            *place = window.is_whole.then_some(values);
        }
        corrected
    }

    /// Compares all pairs over all scales: the largest ratio of each, and the unit that is named.
    fn compare(
        &mut self,
        at: &Evaluated<'_, T, UNITS>,
        readings: &[Option<[T; CHANNELS]>; UNITS],
    ) -> (
        <Units<UNITS> as UnitCount>::OfPairs<Exceedance<T>>,
        Option<Named<T>>,
    ) {
        let is_active = core::array::from_fn(|unit| at.active.contains(unit));
        let vibrations = self.units.each_ref().map(|unit| &unit.vibration);
        let shaking = vibration::of_set(vibrations, &is_active);
        let some = at.windows.iter().any(|window| window.is_whole);
        self.motion.take(at.motion, some);
        self.take_pairs(at, readings);
        let mut timing = self.units.each_ref().map(|unit| Timing {
            interval: unit.windows.interval(),
            delay_sigma: if self.finds_delays {
                unit.clock.sigma()
            } else {
                T::zero()
            },
        });
        if let [primary, ..] = timing.as_mut_slice() {
            primary.delay_sigma = T::zero();
        }
        let slow_force = *self.motion.over(COUNT - 1).0.force();
        let none = PairComparison {
            deviation: [[T::zero(); 3]; 2],
            ratio: [T::zero(); 2],
        };
        let mut compared = <Units<UNITS> as UnitCount>::filled_pairs(none);
        let mut worst = <Units<UNITS> as UnitCount>::filled_pairs(Exceedance::none());
        let mut named = None;
        for (scale, shaking) in shaking.into_iter().enumerate() {
            let (motion, bends) = self.motion.over(scale);
            let variances = self.variances(&motion);
            let conditions = TestConditions {
                scale,
                motion,
                bends,
                slow_force,
                shaking,
            };
            let tests = self.pairs.as_mut().iter_mut().zip(pairs::<UNITS>());
            let results = compared.as_mut().iter_mut().zip(worst.as_mut());
            for ((pair, [i, j]), (found, worst)) in tests.zip(results) {
                if let (Some(first), Some(second), Some(one), Some(other)) =
                    (variances.get(i), variances.get(j), timing.get(i), timing.get(j))
                {
                    *found = pair.test.compare(&conditions, [first, second], [one, other]);
                    for (sensor, (ratio, deviation)) in
                        SENSORS.into_iter().zip(found.ratio.iter().zip(&found.deviation))
                    {
                        if *ratio > worst.ratio {
                            *worst = Exceedance::of(*ratio, deviation, sensor, scale);
                        }
                    }
                }
            }
            if at.has_begun {
                named = self
                    .vote
                    .take::<UNITS>(scale, compared.as_ref(), at.active, named);
            }
        }
        (worst, named)
    }

    /// Adds what all pairs differ by in a window.
    fn take_pairs(&mut self, at: &Evaluated<'_, T, UNITS>, readings: &[Option<[T; CHANNELS]>; UNITS]) {
        let of = |unit: usize| readings.get(unit).and_then(Option::as_ref);
        for (pair, [i, j]) in self.pairs.as_mut().iter_mut().zip(pairs::<UNITS>()) {
            let both = of(i).zip(of(j)).map(|(first, second)| [first, second]);
            pair.test.take(both, at.motion);
        }
    }

    /// Errors of all units along a motion.
    fn errors_along(&self, motion: &MotionOfSet<T>) -> [[[T; 3]; 2]; UNITS] {
        let lever = motion.lever();
        let mut found = [[[T::zero(); 3]; 2]; UNITS];
        for (place, errors) in found.iter_mut().skip(1).zip(self.errors.as_ref()) {
            *place = errors.error(motion, &lever);
        }
        found
    }

    /// Variances of the errors of all units along a motion.
    fn variances(&self, motion: &MotionOfSet<T>) -> [[[T; 3]; 2]; UNITS] {
        let lever = motion.lever();
        let mut found = [[[T::zero(); 3]; 2]; UNITS];
        for (place, errors) in found.iter_mut().skip(1).zip(self.errors.as_ref()) {
            *place = errors.variance(motion, &lever);
        }
        found
    }

    #[inline(never)]
    fn look_at_vote(
        &mut self,
        at: &Evaluated<'_, T, UNITS>,
        named: Option<Named<T>>,
        worst: &<Units<UNITS> as UnitCount>::OfPairs<Exceedance<T>>,
        report: ReportEvent<'_, T>,
    ) {
        let Some(named) = named.filter(|_| at.active.count() > 2) else {
            return;
        };
        self.voted_out = self.voted_out.or(named.units);
        let rest = at.active.without(named.units);
        for unit in named.units.units() {
            let mut finding = named.finding;
            if named.units.count() > 1 {
                finding = Exceedance::none();
                let ratios = pairs::<UNITS>().zip(worst.as_ref());
                for ([i, j], own) in ratios {
                    let is_own = (i == unit && rest.contains(j)) || (j == unit && rest.contains(i));
                    if is_own && own.ratio > finding.ratio {
                        finding = *own;
                    }
                }
            }
            let kind = SetEventKind::Unhealthy {
                reason: Reason::OutOfFamily,
                finding: Some(finding),
                together: named.units,
            };
            report(&event(at.now, unit, kind));
        }
    }

    /// Reports the disagreement of units of which none is known to be wrong, and its end.
    fn look_at_dispute(
        &mut self,
        at: &Evaluated<'_, T, UNITS>,
        worst: &<Units<UNITS> as UnitCount>::OfPairs<Exceedance<T>>,
        report: ReportEvent<'_, T>,
    ) {
        let mut largest = T::zero();
        let [of_two, of_more] = DWELL;
        let dwell = if at.active.count() > 2 { of_more } else { of_two };
        let states = self.pairs.as_mut().iter_mut().zip(worst.as_ref());
        for ((pair, worst), [i, j]) in states.zip(pairs::<UNITS>()) {
            let ratio = if at.active.contain_both([i, j]) {
                worst.ratio
            } else {
                T::zero()
            };
            largest = larger(largest, ratio);
            pair.disputing = if ratio > T::one() {
                pair.disputing.saturating_add(1)
            } else {
                0
            };
            if pair.disputing >= dwell && self.dispute.is_none() {
                self.dispute = Some(([i, j], worst.sensor));
                let finding = *worst;
                report(&event(at.now, j, SetEventKind::Disagree { other: i, finding }));
            }
        }
        if largest > real(AGREEING) {
            self.disputed_last.replace(at.now);
        }
        let [_, settled] = RETURNS;
        let last = self.disputed_last.get();
        if last.is_none_or(|last| at.now - last > settled)
            && let Some(([other, unit], sensor)) = self.dispute.take()
        {
            report(&event(at.now, unit, SetEventKind::Agree { other, sensor }));
        }
    }

    /// Names one of two that disagree at rest where physics finds the other sound.
    fn look_at_rest(&mut self, at: &Evaluated<'_, T, UNITS>, report: ReportEvent<'_, T>) {
        let active = self.active(at.now);
        // A disagreement of motion alone, as of a scale, is none that a rest decides.
        let [lasts, _] = DWELL;
        let is_lasting = self.pairs.as_ref().iter().any(|pair| pair.disputing >= lasts);
        if !at.is_rest || !is_lasting || self.dispute.is_none() || active.count() != 2 {
            return;
        }
        let evidence = self.units.each_ref().map(|unit| unit.rest.evidence());
        if evidence.iter().any(Option::is_none) {
            return;
        }
        let mut two = active.units();
        let (Some(one), Some(other)) = (two.next(), two.next()) else {
            return;
        };
        let of = |unit: usize| evidence.get(unit).copied().flatten().unwrap_or(T::zero());
        let (wrong, sound) = if of(one) > of(other) {
            (one, other)
        } else {
            (other, one)
        };
        let [_, most, decided] = EVIDENCE.map(real::<T>);
        if of(wrong) - of(sound) > decided && of(sound) < most {
            self.voted_out.insert(wrong);
            let shift = self.units.get(wrong).and_then(|unit| unit.rest.shift());
            report(&unhealthy(at.now, wrong, Reason::Rest, shift));
        }
    }

    /// Lets a unit count again that agreed with all others for a while.
    fn reinstate(
        &mut self,
        at: &Evaluated<'_, T, UNITS>,
        worst: &<Units<UNITS> as UnitCount>::OfPairs<Exceedance<T>>,
        report: ReportEvent<'_, T>,
    ) {
        let sound = self.active(at.now);
        let [_, settled] = RETURNS;
        let voted_out = self.voted_out.without(self.beyond);
        for (number, unit) in self.units.iter_mut().enumerate() {
            let mut others = sound;
            others.insert(number);
            let ratios = pairs::<UNITS>().zip(worst.as_ref());
            let mut own = ratios.filter(|(pair, _)| pair.contains(&number) && others.contain_both(*pair));
            let first = own.next().map(|(_, finding)| finding.ratio);
            let largest = own.fold(first, |largest, (_, finding)| {
                largest.map(|most| larger(most, finding.ratio))
            });
            if largest.is_none_or(|largest| largest >= real(AGREEING)) {
                unit.agreed_since = at.now;
            }
            if voted_out.contains(number) && at.now - unit.agreed_since > settled {
                self.voted_out.remove(number);
                report(&event(at.now, number, SetEventKind::Healthy));
            }
        }
    }

    /// Takes the first unit without a fault as the source.
    #[allow(clippy::cast_possible_truncation)]
    fn select(&mut self, now: u64, report: ReportEvent<'_, T>) {
        let source = self.active(now).units().next();
        let chosen = Some(source.map(|unit| unit as u8));
        if self.source != chosen {
            let why = match (source, self.source) {
                (None, _) => Selected::NoneFit,
                (_, None) => Selected::Start,
                _ => Selected::Failed,
            };
            report(&SetEvent {
                time: now,
                unit: source,
                kind: SetEventKind::Selected { why },
            });
        }
        self.source = chosen;
    }

    /// Gathers the window, and ends a block.
    fn learn(
        &mut self,
        at: &Evaluated<'_, T, UNITS>,
        number: u32,
        worst: &<Units<UNITS> as UnitCount>::OfPairs<Exceedance<T>>,
        report: ReportEvent<'_, T>,
    ) {
        let judged = pairs::<UNITS>().zip(worst.as_ref());
        let judged = judged.filter(|(pair, _)| at.active.contain_both(*pair));
        let largest = judged.fold(T::zero(), |largest, (_, finding)| larger(largest, finding.ratio));
        // Before anything is learnt, an error within the threshold is a sound one.
        let limit = if self.has_learnt { real(AGREEING) } else { T::one() };
        // A unit with a large constant error still links the others to one another.
        let usable = at.active.or(self.beyond);
        let timed = self.timed();
        let block = &mut self.gathering.block;
        block.timed = block.timed.and(timed);
        block.is_calm &= largest < limit;
        block.active = block.active.and(usable);
        block.is_rest &= at.is_rest;
        block.is_motion &= !at.is_rest;
        self.gathering
            .take(number, at.windows, at.motion, usable, self.errors.as_ref());
        if number.saturating_add(1).is_multiple_of(BLOCK.into()) {
            self.end_block(at.now, report);
        }
    }

    /// Learns from the block before, where it and this one agreed.
    #[inline(never)]
    fn end_block(&mut self, now: u64, report: ReportEvent<'_, T>) {
        let done = self.gathering.end_block();
        let before = self.waiting.replace(done);
        let mut calm = UnitSet::default();
        let primary_counts = !self.voted_out.contains(0) || self.beyond.contains(0);
        if let Some(block) = &before
            && block.is_calm
            && done.is_calm
            && primary_counts
        {
            calm = block.active.and(done.active);
        }
        // Readings of other times are no errors, but where nothing moves.
        let is_timed = before.as_ref().filter(|block| !block.is_rest);
        let timed = is_timed.map_or(calm, |block| calm.and(block.timed));
        self.has_learnt |= timed.count() > 0;
        // A rest is known a second after it began.
        let was_motion = before.as_ref().is_some_and(|block| block.is_motion) && done.is_motion;
        // Noise of motion is none of a rest, which would let it fall.
        for (pair, units) in self.pairs.as_mut().iter_mut().zip(pairs::<UNITS>()) {
            pair.test.end_block(was_motion && calm.contain_both(units));
        }
        for (number, unit) in self.units.iter_mut().enumerate() {
            unit.own.end_block(calm.contains(number));
        }
        let Some(block) = before else {
            return;
        };
        self.update_errors(&block, timed);
        for (number, unit) in self.units.iter_mut().enumerate() {
            if calm.contains(number) {
                unit.rest.learn();
                unit.vibration.learn(block.is_rest, was_motion);
            }
        }
        self.hold_to_bounds(now, timed, block.is_rest, report);
    }

    /// Lets errors walk, adds a block to those of timed units, and moves the means of pairs along.
    fn update_errors(&mut self, block: &LearningBlock<T, UNITS>, timed: UnitSet) {
        let root_seconds = real::<T>(BLOCK_SECONDS).square_root();
        let mut moved = <Units<UNITS> as UnitCount>::filled(Parameters::zero());
        let secondaries = self.errors.as_mut().iter_mut().zip(moved.as_mut());
        for (secondary, (errors, before)) in secondaries.enumerate() {
            *before = *errors.mean();
            errors.walk(root_seconds);
            if timed.contains(secondary + 1) {
                block.inform(secondary, errors);
            }
            errors.update_mean();
        }
        for scale in 0..COUNT {
            let motion = self.motion.over(scale).0;
            let lever = motion.lever();
            let mut changes = [[[T::zero(); 3]; 2]; UNITS];
            let secondaries = self.errors.as_ref().iter().zip(moved.as_ref());
            for (change, (errors, before)) in changes.iter_mut().skip(1).zip(secondaries) {
                *change = errors.error(&motion, &lever);
                let old = before.error(&motion, &lever);
                let values = change.as_flattened_mut().iter_mut();
                values.zip(old.as_flattened()).for_each(|(new, old)| *new -= *old);
            }
            for (pair, [i, j]) in self.pairs.as_mut().iter_mut().zip(pairs::<UNITS>()) {
                if let (Some(first), Some(second)) = (changes.get(i), changes.get(j)) {
                    pair.test.shift(scale, [first, second]);
                }
            }
        }
    }

    /// Names the unit whose error is no sound unit's, by those without it.
    fn hold_to_bounds(&mut self, now: u64, timed: UnitSet, is_rest: bool, report: ReportEvent<'_, T>) {
        let active = self.active(now).and(timed);
        let motion = self.motion.over(BLOCK_SCALE).0;
        let (errors, variances) = (self.errors_along(&motion), self.variances(&motion));
        let errors: [_; UNITS] = core::array::from_fn(|unit| LearntError {
            error: errors[unit],
            variance: variances[unit],
        });
        let is_active = core::array::from_fn(|unit| active.contains(unit));
        if let Some((unit, finding)) = self.bounds.take(&errors, &is_active, is_rest) {
            self.voted_out.insert(unit);
            self.beyond.insert(unit);
            report(&unhealthy(now, unit, Reason::OutOfLimits, Some(finding)));
        }
    }
}

/// Units of pairs that count and disagree.
fn disputed<T: Real, const UNITS: usize>(
    at: &Evaluated<'_, T, UNITS>,
    worst: &<Units<UNITS> as UnitCount>::OfPairs<Exceedance<T>>,
) -> UnitSet
where
    Units<UNITS>: UnitCount,
{
    let mut units = UnitSet::default();
    for (pair, finding) in pairs::<UNITS>().zip(worst.as_ref()) {
        if finding.ratio > T::one() && at.active.contain_both(pair) {
            pair.into_iter().for_each(|unit| units.insert(unit));
        }
    }
    units
}

fn event<T: Real>(time: u64, unit: usize, kind: SetEventKind<T>) -> SetEvent<T> {
    SetEvent {
        time,
        unit: Some(unit),
        kind,
    }
}

fn unhealthy<T: Real>(time: u64, unit: usize, reason: Reason, finding: Option<Exceedance<T>>) -> SetEvent<T> {
    let mut together = UnitSet::default();
    together.insert(unit);
    let kind = SetEventKind::Unhealthy {
        reason,
        finding,
        together,
    };
    event(time, unit, kind)
}
