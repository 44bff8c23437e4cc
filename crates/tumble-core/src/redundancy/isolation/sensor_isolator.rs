//! Isolation of one kind of sensor over all units: means, decisions, disputes, and statistics learnt in health.

use nalgebra::Vector3;

use crate::products::{Length, squared, zeros};
use crate::real::{Real, count, real, tabulated};
use crate::redundancy::aiding::AidingEvidence;
use crate::redundancy::components::{difference, larger, smaller, sum};
use crate::redundancy::isolation::attribution::{Evidence, Ground, LeftAtRest, MountedSteps, Proof, by_step};
use crate::redundancy::isolation::delay::Delays;
use crate::redundancy::isolation::motion::{Strain, StrainMeans, Tolerance};
use crate::redundancy::isolation::noise::{UsualScatter, is_quiet, limit};
use crate::redundancy::isolation::odd_one::{DWELL, Finding, isolate};
use crate::redundancy::isolation::pair::{
    Comparison, Comparisons, Gains, Knowledge, Shown, shown, shown_mut,
};
use crate::redundancy::isolation::scales::{LatestShares, SCALES, SECONDS};
use crate::redundancy::isolation::shaking::LeftByVibration;
use crate::redundancy::isolation::turn::Turned;
use crate::redundancy::isolation::unit::SensorDeviation;
use crate::redundancy::isolation::warmth::Temperatures;
use crate::redundancy::isolation::{IsolationEvent, SetWindow, UnitEvidence, UnitReading};
use crate::redundancy::sensor::{SLOW_OFFSET, Sensor};
use crate::redundancy::unit_set::{UnitSet, pairs};

/// Uncertainties of the lever arm, m, and of the matrix, if unknown and if known for both units
/// (docs/theory/isolation.md, table 1).
const PLACE: [f32; 2] = [0.15, 0.005];
const MATRIX: [f32; 2] = [0.02, 0.002];

/// Scales over which pairs with an uncalibrated unit are compared: the error of a matrix persists as long as
/// the attitude.
const SCALES_UNCALIBRATED: usize = 2;

/// A pair learns while it is within this share of its thresholds and no disagreement occurred for these times,
/// s.
const LEARNS_WITHIN: f64 = 0.7;
const QUIET: f64 = 1.0;
const AFTER_DISAGREEMENT: f64 = 60.0;

/// Share of the thresholds within which a faulty unit must agree, and the time after which it is reinstated, s.
const REINSTATED_WITHIN: f64 = 0.5;
const REINSTATED_AFTER: f64 = 10.0;

/// Time of agreement after which a dispute ends, s: some faults show only in some motions.
const SETTLED_AFTER: f64 = 10.0;

/// Time after the beginning of a disagreement within which an own step must show, s.
const STEP_WITHIN: f64 = 0.6;

/// Largest difference of the accelerometer of an uncalibrated unit from gravity carried by its own gyroscope,
/// m/s^2.
const UNCALIBRATED_ERROR: f64 = 1.0;

/// Factor on the drift that remains without any one unit, up to which units may differ.
const SHARED: f64 = 2.0;

/// Scale over which units that begin in motion must agree.
const LONG: usize = 2;

/// Time without an odd one among three or more units after which two of them are examined alone, s.
const AMBIGUOUS_FOR: f64 = 2.0;

/// Share of its threshold above which a pair is checked against aiding measurements, if its difference exceeds
/// drift within specification. The second scale is the first one used: single windows are too short for aiding
/// measurements.
const AIDED_APART: f64 = 0.5;
/// Share of drift within specification, and twice the share of the threshold, above which aiding evidence
/// accumulates.
const DEPARTS: f64 = 0.6;
/// Factor on the worst ratio, which replaces the threshold in the isolation by aiding evidence.
const AIDED_SHARE: f64 = 0.75;
const AIDED_FROM: usize = 1;

/// Successive windows with the same finding, over one scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Streak {
    finding: Finding,
    windows: u8,
}

impl Streak {
    const NONE: Self = Self {
        finding: Finding::Agreement,
        windows: 0,
    };

    /// Adds a finding and returns whether it has lasted long enough.
    fn push(&mut self, finding: Finding, dwell: u8) -> bool {
        let same = match (self.finding, finding) {
            (Finding::Ambiguous(..), Finding::Ambiguous(..)) => true,
            (before, now) => before == now,
        };
        self.windows = if same { self.windows.saturating_add(1) } else { 1 };
        self.finding = finding;
        self.windows >= dwell
    }
}

/// Two units that disagree.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Dispute {
    units: [u8; 2],
    windows: u16,
    /// Windows since the two agree again.
    calm: u16,
}

impl Dispute {
    fn concerns(&self, unit: usize) -> bool {
        self.units.iter().any(|other| usize::from(*other) == unit)
    }
}

/// Isolator of one kind of sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SensorIsolator<T: Real, const UNITS: usize> {
    deviations: [SensorDeviation<T>; UNITS],
    scatters: [UsualScatter<T>; UNITS],
    strains: StrainMeans<T>,
    streaks: [Streak; SCALES],
    faulty: UnitSet,
    accepted: UnitSet,
    /// Windows in which a faulty unit has agreed with all others.
    reinstated: [u16; UNITS],
    /// Squared worst ratio of each unit with units that are not faulty.
    worst_squared: [T; UNITS],
    dispute: Option<Dispute>,
    evidence: Evidence<T>,
    /// Pair that the evidence concerns.
    evidence_of: [u8; 2],
    /// Windows since the last disagreement of any pair, and whether there was one.
    calm: u16,
    disagreed: bool,
    learnt: u16,
    windows: u16,
}

/// Factor on the squared change from sample to sample that gives the variance added by smooth motion, per axis:
/// a sixth, doubled because windows show only part of it.
const MOVED: f64 = 1.0 / 3.0;

/// Inputs of the isolation of one kind of sensor.
pub(super) struct Case<'a, T: Real, const UNITS: usize> {
    pub sensor: Sensor,
    pub window: &'a SetWindow<'a, T, UNITS>,
    /// For accelerometers: the isolator of gyroscopes, and the sums of their trims since their calibrations, rad/s.
    pub gyroscopes: Option<(&'a SensorIsolator<T, UNITS>, &'a [Vector3<T>; UNITS])>,
    pub evidence: &'a [UnitEvidence<T>; UNITS],
    pub aiding_evidence: Option<&'a AidingEvidence<T, UNITS>>,
    /// [`SensorIsolator::find_aided`], once there was an aiding measurement.
    pub find_aided: Option<FindAided<T, UNITS>>,
    /// Variance of the difference between accelerometers and carried gravity, `(m/s^2)^2`, after turns like the
    /// latest.
    pub usual_error: Option<T>,
    pub temperatures: &'a Temperatures<T, UNITS>,
    pub turned: &'a Turned<T>,
    /// Specific force of the set, m/s^2: at rest, gravity, upwards.
    pub force: Vector3<T>,
    /// Squared rate of change of the readings of the set, (m/s^3)^2 or (rad/s^2)^2.
    pub change: T,
    /// Units that may be compared, and those of them that are better known than uncalibrated ones.
    pub voters: UnitSet,
    pub known: UnitSet,
    pub delays: &'a Delays<T, UNITS>,
}

impl<T: Real, const UNITS: usize> Case<'_, T, UNITS> {
    fn unit(&self, number: usize) -> Option<&UnitReading<T>> {
        self.window.units.get(number)?.as_ref()
    }

    /// Scatter of a unit from sample to sample, m/s^2 or rad/s, minus the share of motion, which dominates in a
    /// slow unit.
    fn scatter(&self, reading: &UnitReading<T>) -> T {
        let scatter = *self.sensor.of(&reading.scatter);
        let moved = self.change * reading.interval * reading.interval * real(MOVED);
        larger(T::zero(), scatter * scatter - moved).square_root()
    }

    fn steps(&self, number: usize) -> Option<MountedSteps<'_, T>> {
        Some(MountedSteps {
            steps: self.sensor.of(self.window.steps.get(number)?.sensors()),
            sensor_from_primary: &self.window.mounted.get(number)?.sensor_from_primary,
        })
    }
}

type Emit<'a, T> = &'a mut dyn FnMut(IsolationEvent<T>);

/// Type of [`SensorIsolator::find_aided`]; a pointer keeps its code out of programs without aiding measurements.
pub(super) type FindAided<T, const UNITS: usize> =
    fn(&mut SensorIsolator<T, UNITS>, &Case<'_, T, UNITS>, &Comparisons<T, UNITS>, Emit<'_, T>);

impl<T: Real, const UNITS: usize> SensorIsolator<T, UNITS> {
    pub fn new() -> Self {
        Self {
            deviations: [SensorDeviation::new(); UNITS],
            scatters: [UsualScatter::new(); UNITS],
            strains: StrainMeans::new(),
            streaks: [Streak::NONE; SCALES],
            faulty: UnitSet::default(),
            accepted: UnitSet::default(),
            reinstated: [0; UNITS],
            worst_squared: [T::zero(); UNITS],
            dispute: None,
            evidence: Evidence::none(),
            evidence_of: [0; 2],
            calm: 0,
            disagreed: false,
            learnt: 0,
            windows: 0,
        }
    }

    pub fn is_faulty(&self, unit: usize) -> bool {
        self.faulty.contains(unit)
    }

    pub fn is_disputed(&self) -> bool {
        self.dispute.is_some()
    }

    pub fn is_disputed_with(&self, unit: usize) -> bool {
        let concerns = |dispute: &Dispute| dispute.concerns(unit);
        self.dispute.as_ref().is_some_and(concerns)
    }

    /// Squared worst ratio of a unit with units that are not faulty.
    pub fn worst_squared(&self, unit: usize) -> T {
        self.worst_squared.get(unit).copied().unwrap_or(T::zero())
    }

    /// Returns whether a unit departs from another by a share of drift within specification, or of their
    /// threshold.
    pub fn departs(&self, unit: usize, tolerated: T) -> bool {
        let mean = |unit: usize| self.deviations.get(unit)?.mean(AIDED_FROM);
        let others = (0..UNITS).filter(|other| *other != unit && !self.is_faulty(*other));
        let apart = others.filter_map(|other| Some((mean(unit)? - mean(other)?).length()));
        apart.fold(T::zero(), larger) > tolerated * real(DEPARTS)
            || self.worst_squared(unit) > real(DEPARTS * DEPARTS * 0.25)
    }

    /// Returns whether all pairs have agreed for long enough to learn from them.
    pub fn is_calm(&self, window: T) -> bool {
        let after = if self.disagreed { AFTER_DISAGREEMENT } else { QUIET };
        self.dispute.is_none() && window * count::<T>(self.calm.into()) >= real(after)
    }

    pub fn accepted(&self) -> UnitSet {
        self.accepted
    }

    pub fn recalibrated(&mut self, unit: usize) {
        self.accepted.insert(unit);
        if let Some(deviation) = self.deviations.get_mut(unit) {
            *deviation = SensorDeviation::new();
        }
        self.clear(unit);
    }

    pub fn accept(&mut self, sensor: Sensor, unit: usize) {
        if let Some(deviation) = self.deviations.get_mut(unit) {
            deviation.accept(sensor);
        }
        self.accepted.insert(unit);
        self.clear(unit);
    }

    pub fn withdraw_vote(&mut self, unit: usize) {
        self.accepted.remove(unit);
        self.begin_anew(unit);
    }

    pub fn begin_anew(&mut self, unit: usize) {
        self.clear(unit);
        // The median of the set now comes from other units.
        for deviation in &mut self.deviations {
            deviation.restart();
        }
    }

    pub fn trimmed(&mut self, sensor: Sensor, unit: usize, change: &Vector3<T>, anew: bool) {
        if let Some(deviation) = self.deviations.get_mut(unit) {
            if anew {
                deviation.begin_with(sensor, &Vector3::zeros());
            } else {
                deviation.trimmed(change);
            }
        }
        if anew {
            self.streaks = [Streak::NONE; SCALES];
        }
    }

    /// Difference of two units over the third scale.
    pub fn apart_for_long(&self, i: usize, j: usize) -> Option<T> {
        let mean = |unit: usize| self.deviations.get(unit)?.mean(LONG);
        Some(difference(mean(i)?, mean(j)?).length())
    }

    /// Deviation of a unit from the set in the window before the latest, minus its mean.
    pub fn beyond_before(&self, unit: usize) -> Option<Vector3<T>> {
        self.deviations.get(unit)?.beyond_before()
    }

    fn clear(&mut self, unit: usize) {
        self.evidence = Evidence::none();
        self.faulty.remove(unit);
        if self.is_disputed_with(unit) {
            self.dispute = None;
        }
        self.streaks = [Streak::NONE; SCALES];
    }

    pub fn restart_time(&mut self) {
        for deviation in &mut self.deviations {
            deviation.restart();
        }
        self.strains = StrainMeans::new();
        self.streaks = [Streak::NONE; SCALES];
        self.windows = 0;
        self.calm = 0;
    }

    /// Median of each axis over units that are not faulty.
    #[inline(never)]
    pub fn median_of<'a>(
        &self,
        units: UnitSet,
        measured: &dyn Fn(usize) -> Option<&'a Vector3<T>>,
    ) -> Option<Vector3<T>> {
        let [mut x, mut y, mut z] = [[T::zero(); UNITS]; 3];
        let mut found = 0_usize;
        for measured in units.without(self.faulty).units().filter_map(measured) {
            insert(&mut x, found, measured.x);
            insert(&mut y, found, measured.y);
            insert(&mut z, found, measured.z);
            found += 1;
        }
        Some(Vector3::new(
            middle(&x, found)?,
            middle(&y, found)?,
            middle(&z, found)?,
        ))
    }

    /// Updates the deviation of each unit from the median of the set. One copy of the code serves both kinds of
    /// sensor.
    #[inline(never)]
    pub fn take(
        &mut self,
        sensor: Sensor,
        window: &SetWindow<'_, T, UNITS>,
        measured: &Vector3<T>,
        strain: &Strain<T>,
    ) {
        self.windows = self.windows.saturating_add(1);
        let mut shares = LatestShares::of(window.length);
        self.strains.push(strain, shares.after(self.windows));
        for (deviation, unit) in self.deviations.iter_mut().zip(window.units) {
            if let Some(unit) = unit.as_ref().filter(|unit| *sensor.of(&unit.votes)) {
                let apart = difference(sensor.of(&unit.reading), measured);
                deviation.push(sensor, &apart, strain.vibration, &mut shares);
            } else {
                deviation.skip();
            }
        }
    }

    /// Compares all pairs, isolates faulty units, and learns from healthy ones. One copy of the code serves
    /// both kinds of sensor.
    #[inline(never)]
    pub fn isolate(&mut self, case: &Case<'_, T, UNITS>, shown: &mut [[Shown<T>; UNITS]], emit: Emit<'_, T>) {
        self.find_noisy(case, emit);
        // Here and not with the caller, on whose stack they would lie beneath every other call too.
        let comparisons = &mut Comparisons::none();
        let mut disagrees = self.compare(case, shown, T::zero(), comparisons);
        if disagrees {
            let shared = self.shared_drift(case);
            if shared > T::zero() {
                disagrees = self.compare(case, shown, shared, comparisons);
            }
        }
        self.find_odd(case, comparisons, disagrees, emit);
        if let Some(find) = case.find_aided {
            find(self, case, comparisons, emit);
        }
        self.settle_dispute(case, comparisons, emit);
        self.reinstate(case, comparisons, emit);
        self.learn(case, comparisons, shown, disagrees);
    }

    /// Square of the drift since their calibrations by which calibrated units differ, whichever unit is left
    /// out, by both kinds of sensor: a drift of all units is no fault (docs/theory/isolation.md, eq. 22).
    #[inline(never)]
    fn shared_drift(&self, case: &Case<'_, T, UNITS>) -> T {
        let voters = case.known.without(self.faulty);
        if voters.count() < 3 {
            return T::zero();
        }
        // Zero rates show the warming of a unit at any attitude; the deviation of an accelerometer contains matrix errors too.
        let per_rate = match case.sensor {
            Sensor::Accelerometer => {
                case.window.per_kelvin.specific_force / case.window.per_kelvin.angular_rate
            }
            Sensor::Gyroscope => T::zero(),
        };
        let per_rate = if per_rate.is_finite() { per_rate } else { T::zero() };
        let mut without = [T::zero(); UNITS];
        for [i, j] in pairs::<UNITS>().filter(|pair| voters.contain_both(*pair)) {
            let own = self.drifted_apart(case, case.sensor, [i, j], &|_| Some(zeros()));
            let by_rate = case.gyroscopes.map_or(T::zero(), |(isolator, trimmed)| {
                isolator.drifted_apart(case, Sensor::Gyroscope, [i, j], &|unit| {
                    trimmed.get(unit).copied()
                })
            });
            let apart = larger(own, by_rate * per_rate * per_rate);
            for (unit, most) in without.iter_mut().enumerate() {
                if unit != i && unit != j {
                    *most = larger(*most, apart);
                }
            }
        }
        let most = tabulated::<T>(*case.sensor.of(&SLOW_OFFSET));
        let shared = voters.units().filter_map(|unit| without.get(unit).copied());
        smaller(
            most * most,
            shared.fold(most * most, smaller) * real(SHARED * SHARED),
        ) // isolation.md, eq. 22
    }

    /// Square of the difference between the drifts of two calibrated units, with `taken_off` added to each; zero
    /// where either is unknown.
    fn drifted_apart(
        &self,
        case: &Case<'_, T, UNITS>,
        sensor: Sensor,
        [i, j]: [usize; 2],
        taken_off: &dyn Fn(usize) -> Option<Vector3<T>>,
    ) -> T {
        let drifted = |unit: usize| {
            let calibrated = case.unit(unit).is_some_and(|unit| *sensor.of(&unit.calibrated));
            let drifted = self.deviations.get(unit).filter(|_| calibrated)?.drifted()?;
            Some(sum(&drifted, &taken_off(unit)?))
        };
        let apart = drifted(i).zip(drifted(j));
        apart.map_or(T::zero(), |(a, b)| squared(&difference(&a, &b)))
    }

    /// Compares all pairs of voting units on each scale that both have filled; `shared` is the squared drift
    /// that all units share. Updates the worst ratio of each unit with known, healthy ones; returns whether any
    /// healthy pair disagrees.
    fn compare(
        &mut self,
        case: &Case<'_, T, UNITS>,
        shown: &[[Shown<T>; UNITS]],
        shared: T,
        comparisons: &mut Comparisons<T, UNITS>,
    ) -> bool {
        self.worst_squared = [T::zero(); UNITS];
        let voters = case.voters.without(self.faulty);
        let mut disagree = false;
        for [i, j] in pairs::<UNITS>() {
            let Some(comparison) = comparisons.of_mut([i, j]) else {
                continue;
            };
            comparison.clear();
            let units = case.unit(i).zip(case.unit(j));
            let Some((a, b)) = units.filter(|_| case.voters.contain_both([i, j])) else {
                continue;
            };
            self.compare_pair(case, [i, j], [a, b], (shown, shared), comparison);
            let worst = comparison.worst_squared();
            disagree |= worst > T::one() && voters.contain_both([i, j]);
            if !case.known.contain_both([i, j]) {
                continue;
            }
            for (unit, other) in [(i, j), (j, i)] {
                if let Some(most) = self
                    .worst_squared
                    .get_mut(unit)
                    .filter(|_| voters.contains(other))
                {
                    *most = larger(*most, worst);
                }
            }
        }
        disagree
    }

    fn compare_pair(
        &self,
        case: &Case<'_, T, UNITS>,
        [i, j]: [usize; 2],
        units: [&UnitReading<T>; 2],
        (all_shown, shared): (&[[Shown<T>; UNITS]], T),
        comparison: &mut Comparison<T>,
    ) {
        let sensor = case.sensor;
        let drifted = shared + case.temperatures.drifted(i, j, case.window.per_kelvin.of(sensor));
        let [a, b] = units;
        let calibrated = *sensor.of(&a.calibrated) && *sensor.of(&b.calibrated);
        let compared = if calibrated { SCALES } else { SCALES_UNCALIBRATED };
        let means = |unit: usize| {
            let means = self.deviations.get(unit)?.means();
            Some(means.get(..compared).unwrap_or(means))
        };
        let shaken = |unit: usize| {
            let deviation = self.deviations.get(unit);
            deviation.map_or(LeftByVibration::all(), SensorDeviation::shaken)
        };
        if let (Some(first), Some(second), Some(shown)) =
            (means(i), means(j), shown(all_shown, sensor, [i, j]))
        {
            comparison.fill(
                sensor,
                case.window.tolerated.of(sensor),
                (first, second),
                self.strains.scales(),
                &known(sensor, units, drifted, [shaken(i), shaken(j)]),
                shown,
            );
        }
    }

    /// Excludes units whose scatter exceeds the limit that the other units set.
    fn find_noisy(&mut self, case: &Case<'_, T, UNITS>, emit: Emit<'_, T>) {
        let sensor = case.sensor;
        for unit in case.known.units() {
            let scatter_of = |unit: usize| Some(case.scatter(case.unit(unit)?));
            let Some(scatter) = scatter_of(unit) else {
                continue;
            };
            if is_quiet(sensor, scatter) {
                self.scatters.get_mut(unit).map(UsualScatter::was_quiet);
                continue;
            }
            let others = case.known.without(self.faulty).units();
            let others = others.filter(|other| *other != unit);
            let usual_of = |unit: usize| {
                let rests = case.unit(unit)?.at_rest.is_some();
                self.scatters.get(unit)?.usual(rests, case.window.length)
            };
            let others = others.filter_map(|other| Some((scatter_of(other)?, usual_of(other)?)));
            let Some(usual) = usual_of(unit) else {
                self.scatters.get_mut(unit).map(UsualScatter::was_quiet);
                continue;
            };
            let Some(limit) = limit(sensor, usual, others, case.window.noise_ratio) else {
                self.scatters.get_mut(unit).map(UsualScatter::was_quiet);
                continue;
            };
            let noisy = self
                .scatters
                .get_mut(unit)
                .is_some_and(|scatters| scatters.is_noisy(scatter, limit));
            if noisy && self.exclude(unit) {
                emit(IsolationEvent::Noisy { unit, scatter, limit });
            }
        }
    }

    /// Isolates the unit without which the others agree, if any two disagree.
    fn find_odd(
        &mut self,
        case: &Case<'_, T, UNITS>,
        comparisons: &Comparisons<T, UNITS>,
        disagree: bool,
        emit: Emit<'_, T>,
    ) {
        if !disagree {
            self.streaks = [Streak::NONE; SCALES];
            return;
        }
        let voters = case.voters.without(self.faulty);
        self.disagreed = true;
        for scale in 0..SCALES {
            let squared = |[i, j]: [usize; 2]| comparisons.of(i, j)?.ratio_squared(scale);
            let finding = isolate::<T, UNITS>(voters, &squared);
            let dwell = DWELL.get(scale).copied().unwrap_or(u8::MAX);
            let lasted = self
                .streaks
                .get_mut(scale)
                .is_some_and(|streak| streak.push(finding, dwell));
            if !lasted {
                continue;
            }
            match finding {
                Finding::Agreement => {}
                Finding::Odd(unit) => {
                    self.find_out_of_family(usize::from(unit), scale, voters, comparisons, emit);
                }
                Finding::Ambiguous(i, j) => self.begin_dispute([i, j], scale, comparisons, emit),
            }
        }
    }

    /// Isolates the one unit that an aiding measurement contradicts, among units that differ by less than
    /// motion and calibrations may explain: among three or more, the one without which the others agree.
    pub fn find_aided(
        &mut self,
        case: &Case<'_, T, UNITS>,
        comparisons: &Comparisons<T, UNITS>,
        emit: Emit<'_, T>,
    ) {
        let Some(aiding_evidence) = case.aiding_evidence else {
            return;
        };
        let voters = case.known.without(self.faulty);
        for scale in AIDED_FROM..SCALES {
            if let Some((unit, proof)) = aided(aiding_evidence, case, voters, comparisons, scale)
                && self.exclude(unit)
            {
                self.end_dispute();
                emit(IsolationEvent::Isolated { unit, proof });
                return;
            }
        }
    }

    fn find_out_of_family(
        &mut self,
        unit: usize,
        scale: usize,
        voters: UnitSet,
        comparisons: &Comparisons<T, UNITS>,
        emit: Emit<'_, T>,
    ) {
        let agreeing = UnitSet::of::<UNITS>(|other| other != unit && voters.contains(other));
        let mut worst = None::<(usize, T)>;
        for other in (0..UNITS).filter(|other| agreeing.contains(*other)) {
            let pair = comparisons.of(unit, other);
            if let Some(squared) = pair.and_then(|pair| pair.ratio_squared(scale))
                && worst.is_none_or(|(_, worst)| squared > worst)
            {
                worst = Some((other, squared));
            }
        }
        let figures = worst.and_then(|(other, _)| comparisons.of(unit, other)?.figures(scale));
        if let Some(figures) = figures
            && self.exclude(unit)
        {
            self.end_dispute();
            emit(IsolationEvent::OutOfFamily {
                unit,
                figures,
                scale: seconds_of(scale),
                agreeing: agreeing.bits(),
            });
        }
    }

    fn begin_dispute(
        &mut self,
        units: [u8; 2],
        scale: usize,
        comparisons: &Comparisons<T, UNITS>,
        emit: Emit<'_, T>,
    ) {
        if self.dispute.is_some() {
            return;
        }
        let [i, j] = units.map(usize::from);
        let Some(figures) = comparisons.of(i, j).and_then(|pair| pair.figures(scale)) else {
            return;
        };
        if self.evidence_of != units {
            (self.evidence, self.evidence_of) = (Evidence::none(), units);
        }
        self.dispute = Some(Dispute {
            units,
            windows: 0,
            calm: 0,
        });
        emit(IsolationEvent::Disagree {
            units: [i, j],
            figures,
            scale: seconds_of(scale),
        });
    }

    /// Recent growth of the difference of two units: docs/theory/isolation.md, eq. 12.
    fn came_apart(&self, i: usize, j: usize) -> Option<Vector3<T>> {
        let (a, b) = (self.deviations.get(i)?, self.deviations.get(j)?);
        let now = difference(a.mean(0)?, b.mean(0)?);
        let before = a.mean(2).zip(b.mean(2));
        Some(before.map_or(now, |(a, b)| difference(&now, &difference(a, b))))
    }

    /// Searches evidence on a dispute; ends it when one unit is isolated or when both agree again.
    fn settle_dispute(
        &mut self,
        case: &Case<'_, T, UNITS>,
        comparisons: &Comparisons<T, UNITS>,
        emit: Emit<'_, T>,
    ) {
        let Some(mut dispute) = self.dispute else {
            self.evidence.fade(case.turned.news(case.window.length));
            return;
        };
        let units = dispute.units.map(usize::from);
        let [i, j] = units;
        dispute.windows = dispute.windows.saturating_add(1);
        let apart = comparisons
            .of(i, j)
            .is_some_and(|pair| pair.worst_squared() > T::one());
        dispute.calm = if apart { 0 } else { dispute.calm.saturating_add(1) };
        self.dispute = Some(dispute);
        let span = |windows: u16| case.window.length * count::<T>(windows.into());
        if span(dispute.calm) >= real(SETTLED_AFTER) {
            self.end_dispute();
            emit(IsolationEvent::Agree { units });
            return;
        }
        let lasting = span(dispute.windows);
        if let Some((unit, proof)) = self.attribute(&dispute, case, lasting)
            && self.exclude(unit)
        {
            self.end_dispute();
            emit(IsolationEvent::Isolated { unit, proof });
        }
    }

    /// Returns the unit isolated by the first kind of evidence that decides.
    fn attribute(
        &mut self,
        dispute: &Dispute,
        case: &Case<'_, T, UNITS>,
        lasting: T,
    ) -> Option<(usize, Proof<T>)> {
        let [i, j] = dispute.units.map(usize::from);
        let (a, b) = (case.evidence.get(i)?, case.evidence.get(j)?);
        let sensor = case.sensor;
        // The error of an uncalibrated unit moves with the platform, so each start of a motion looks like its
        // step.
        if lasting < real(STEP_WITHIN)
            && case.known.contain_both([i, j])
            && let Some(found) = self.by_step([i, j], case)
        {
            return Some(found);
        }
        if case.voters.without(self.faulty).count() > 2 && lasting < real(AMBIGUOUS_FOR) {
            return None;
        }
        let calibrated = |unit: usize| case.unit(unit).is_some_and(|unit| *sensor.of(&unit.calibrated));
        let calibrated = calibrated(i) && calibrated(j);
        if calibrated && let Some(found) = self.by_rest([i, j], case) {
            return Some(found);
        }
        if let Some(found) = case
            .aiding_evidence
            .and_then(|evidence| evidence.decides([i, j], true))
        {
            return Some(found);
        }
        let variance = if calibrated {
            case.usual_error?
        } else if case.known.contain_both([i, j]) {
            return None;
        } else {
            case.usual_error.unwrap_or(T::zero()) + real(UNCALIBRATED_ERROR * UNCALIBRATED_ERROR)
        };
        let news = case.turned.news(case.window.length);
        self.evidence
            .push(a.gravity.error(), b.gravity.error(), variance, news);
        self.decided([i, j], Ground::Gravity)
    }

    fn by_step(&self, [i, j]: [usize; 2], case: &Case<'_, T, UNITS>) -> Option<(usize, Proof<T>)> {
        let (first, second) = (case.steps(i)?, case.steps(j)?);
        let apart = self.came_apart(i, j)?;
        let found = by_step(&apart, &first, &second).map(|proof| (i, proof));
        found.or_else(|| by_step(&-apart, &second, &first).map(|proof| (j, proof)))
    }

    /// Adds the readings of both at this rest to the evidence and returns the unit that it isolates.
    fn by_rest(&mut self, [i, j]: [usize; 2], case: &Case<'_, T, UNITS>) -> Option<(usize, Proof<T>)> {
        let sensor = case.sensor;
        let left = |unit: usize| {
            let before = sensor.of(&case.evidence.get(unit)?.at_rest);
            Some(LeftAtRest {
                left: *sensor.of(&case.unit(unit)?.at_rest?) - before.usual,
                strays_squared: before.strays * before.strays,
            })
        };
        let (a, b) = (left(i)?, left(j)?);
        let mean = |unit: usize| self.deviations.get(unit)?.mean(1);
        let apart = mean(i)? - mean(j)?;
        let along = || apart.dot(&case.force) / case.force.length().max(real(1e-3));
        let along = (sensor == Sensor::Accelerometer).then(along);
        self.evidence.push_rest(sensor, &a, &b, along, &case.force);
        self.decided([i, j], Ground::Rest)
    }

    /// Returns the faulty unit of two, if the evidence decides.
    fn decided(&self, [i, j]: [usize; 2], ground: Ground) -> Option<(usize, Proof<T>)> {
        let (wrong, proof) = self.evidence.decides(ground)?;
        Some((if wrong == 0 { i } else { j }, proof))
    }

    pub fn end_dispute(&mut self) {
        self.dispute = None;
    }

    /// Excludes a unit; returns whether it was not faulty before.
    pub fn exclude(&mut self, unit: usize) -> bool {
        let before = self.is_faulty(unit);
        self.faulty.insert(unit);
        self.evidence = Evidence::none();
        if let Some(reinstated) = self.reinstated.get_mut(unit) {
            *reinstated = 0;
        }
        self.streaks = [Streak::NONE; SCALES];
        !before
    }

    /// Reinstates faulty units that have agreed with all others for long enough.
    fn reinstate(
        &mut self,
        case: &Case<'_, T, UNITS>,
        comparisons: &Comparisons<T, UNITS>,
        emit: Emit<'_, T>,
    ) {
        let faulty = self.faulty;
        // An uncalibrated unit may agree by chance for a while; only a calibrated one is reinstated.
        let calibrated = faulty.and(case.known);
        if calibrated.count() == 0 {
            return;
        }
        // The agreement of a unit whose clock drifts is no evidence.
        let late = case.delays.late(case.window.length);
        for unit in calibrated.without(late).units() {
            let Some(reinstated) = self.reinstated.get_mut(unit) else {
                continue;
            };
            let (mut compared, mut within) = (false, true);
            for other in (0..UNITS).filter(|other| *other != unit && !faulty.contains(*other)) {
                if let Some(pair) = comparisons.of(unit, other).filter(|pair| pair.is_some()) {
                    compared = true;
                    within &= pair.worst_squared() < real(REINSTATED_WITHIN * REINSTATED_WITHIN);
                }
            }
            let quiet = self.scatters.get(unit).is_none_or(|scatter| !scatter.was_noisy());
            *reinstated = if compared && within && quiet {
                reinstated.saturating_add(1)
            } else {
                0
            };
            if case.window.length * count::<T>((*reinstated).into()) >= real(REINSTATED_AFTER) {
                self.faulty.remove(unit);
                emit(IsolationEvent::Reinstated { unit });
            }
        }
    }

    fn learn(
        &mut self,
        case: &Case<'_, T, UNITS>,
        comparisons: &Comparisons<T, UNITS>,
        all_shown: &mut [[Shown<T>; UNITS]],
        disagrees: bool,
    ) {
        let window = case.window.length;
        self.calm = if disagrees { 0 } else { self.calm.saturating_add(1) };
        if !self.is_calm(window) {
            return;
        }
        self.disagreed = false;
        self.learnt = self.learnt.saturating_add(1);
        let gains = Gains::after(window * count::<T>(self.learnt.into()), window);
        let healthy = case.known.without(self.faulty);
        for [i, j] in pairs::<UNITS>().filter(|pair| healthy.contain_both(*pair)) {
            let pair = comparisons
                .of(i, j)
                .zip(shown_mut(all_shown, case.sensor, [i, j]));
            if let Some((comparison, shown)) = pair
                && comparison.worst_squared() < real(LEARNS_WITHIN * LEARNS_WITHIN)
            {
                shown.learn(case.sensor, comparison, &gains);
            }
        }
        for unit in healthy.units() {
            let within = self.worst_squared(unit) < real(LEARNS_WITHIN * LEARNS_WITHIN);
            let known = self.deviations.get_mut(unit).zip(self.scatters.get_mut(unit));
            let Some(((deviation, scatters), reading)) = known.zip(case.unit(unit)).filter(|_| within) else {
                continue;
            };
            deviation.follow(case.sensor, window);
            scatters.learn(case.scatter(reading), reading.at_rest.is_some(), window);
        }
    }
}

/// Isolates the unit that an aiding measurement contradicts over one scale (docs/theory/isolation.md, section
/// 12).
fn aided<T: Real, const UNITS: usize>(
    aiding_evidence: &AidingEvidence<T, UNITS>,
    case: &Case<'_, T, UNITS>,
    voters: UnitSet,
    comparisons: &Comparisons<T, UNITS>,
    scale: usize,
) -> Option<(usize, Proof<T>)> {
    let squared = |[i, j]: [usize; 2]| comparisons.of(i, j)?.ratio_squared(scale);
    let tolerated = case.window.tolerated.of(case.sensor);
    let drifted = |i: usize, j: usize| {
        let figures = comparisons.of(i, j).and_then(|pair| pair.figures(scale));
        figures.is_some_and(|figures| figures.apart > tolerated)
    };
    let voting = pairs::<UNITS>().filter(|pair| voters.contain_both(*pair));
    let worst = voting.filter_map(squared).fold(T::zero(), larger);
    if worst < real(AIDED_APART * AIDED_APART) {
        return None;
    }
    let by_the_worst = worst * real(AIDED_SHARE * AIDED_SHARE);
    match isolate::<T, UNITS>(voters, &|pair| Some(squared(pair)? / by_the_worst)) {
        Finding::Agreement => None,
        Finding::Odd(unit) => {
            let unit = usize::from(unit);
            let others = (0..UNITS).filter(|other| *other != unit && voters.contains(*other));
            let proof = aiding_evidence.contradicts(unit, others.clone())?;
            let mut apart = others.map(|other| drifted(unit.min(other), unit.max(other)));
            apart.any(|drifted| drifted).then_some((unit, proof))
        }
        Finding::Ambiguous(i, j) => {
            let [i, j] = [i, j].map(usize::from);
            let two = voters.count() == 2;
            aiding_evidence
                .decides([i, j], false)
                .filter(|_| two && drifted(i, j))
        }
    }
}

fn seconds_of<T: Real>(scale: usize) -> T {
    tabulated(SECONDS.get(scale).copied().unwrap_or(0.0))
}

/// Prior knowledge about two units (docs/theory/isolation.md, table 1).
fn known<T: Real>(
    sensor: Sensor,
    [a, b]: [&UnitReading<T>; 2],
    drifted: T,
    shaken: [LeftByVibration<T>; 2],
) -> Knowledge<T> {
    let [matrix_unknown, matrix_known] = MATRIX;
    let shown = *sensor.of(&a.matrix_shown) && *sensor.of(&b.matrix_shown);
    let matrix = tabulated::<T>(if shown { matrix_known } else { matrix_unknown });
    let [place_unknown, place_known] = PLACE;
    let (place_unknown, place_known) = (tabulated::<T>(place_unknown), tabulated::<T>(place_known));
    let place = |sigma: T| smaller(place_unknown, sigma);
    let places = place(a.place) * place(a.place) + place(b.place) * place(b.place);
    let interpolation = (a.interval * a.interval + b.interval * b.interval) / real(12.0);
    Knowledge {
        tolerance: Tolerance {
            place: places + place_known * place_known,
            matrix: matrix * matrix,
            interpolation: interpolation * interpolation,
        },
        residual: *sensor.of(&a.residual) + *sensor.of(&b.residual),
        uncertainty: *sensor.of(&a.uncertainty) + *sensor.of(&b.uncertainty),
        drifted,
        shaken,
    }
}

/// Inserts a value into the sorted first `found` values.
fn insert<T: Real, const UNITS: usize>(sorted: &mut [T; UNITS], found: usize, value: T) {
    let mut carried = value;
    for slot in sorted.iter_mut().take(found) {
        if carried < *slot {
            core::mem::swap(slot, &mut carried);
        }
    }
    if let Some(slot) = sorted.get_mut(found) {
        *slot = carried;
    }
}

/// Median of the first `found` values; `None` if there are none.
fn middle<T: Real, const UNITS: usize>(sorted: &[T; UNITS], found: usize) -> Option<T> {
    let (lower, upper) = (sorted.get(found.checked_sub(1)? / 2)?, sorted.get(found / 2)?);
    Some(*lower * real(0.5) + *upper * real(0.5))
}
