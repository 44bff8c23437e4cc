//! Checks against physics at rest, which precede all comparisons of units and can reverse their results.

use nalgebra::Vector3;

use crate::products::Length;
use crate::real::{Real, count, real, seconds};
use crate::redundancy::components::{difference, scaled, sum};
use crate::redundancy::evaluation::{Deviation, SecondaryAtRest, across};
use crate::redundancy::health::{Health, HealthFault};
use crate::redundancy::isolation::attribution::Proof;
use crate::redundancy::monitor::Monitor;
use crate::redundancy::platform::Platform;
use crate::redundancy::samples::history::RestMean;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::redundancy::unit_set::UnitSet;

/// Share of the deviation of a secondary below which the primary is trusted beside it.
const MUCH_LESS: f64 = 0.5;

/// Deviations of a secondary at a rest.
struct Off<T: Real> {
    /// Deviation from physics, if it can be determined.
    physics: Option<Deviation<T>>,
    /// Deviation from the primary.
    primary: Deviation<T>,
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Uses a primary that agrees with physics at rest to mark secondaries as stale or to trim them
    /// (docs/theory/isolation.md, section 14). Returns whether a fault of the primary was withdrawn.
    #[inline(never)]
    pub(super) fn apply_physics(
        &mut self,
        platform: &Platform<T, UNITS>,
        fewest: u64,
        deviations: &[Option<Deviation<T>>; 2],
    ) -> bool {
        if deviations.iter().any(Option::is_none) {
            return false;
        }
        let first = self.rest.meet();
        self.drift_on();
        let mut reopened = false;
        for (sensor, deviation) in SENSORS.into_iter().zip(deviations) {
            let fault = self.health.first().and_then(|health| health.fault());
            let trusted = fault.is_none_or(|fault| fault.is_found_by_comparison());
            let Some(primary) = deviation.filter(|deviation| trusted && !deviation.exceeds()) else {
                continue;
            };
            let common = self.common_across(platform, sensor);
            let mut contradicted = UnitSet::default();
            for number in 1..UNITS {
                let off = self.off_at_rest(platform, sensor, number, fewest);
                let Some(off) = off else { continue };
                if self.place(platform, sensor, number, &off, (&primary, &common), first) {
                    contradicted.insert(number);
                }
            }
            reopened |= self.reopen(platform, sensor, fewest, contradicted);
        }
        reopened
    }

    /// Adds the drift that calibrated units may have had since the latest rest.
    fn drift_on(&mut self) {
        let Some(passed) = self.rest.since_latest(self.clock.now().unwrap_or(0)) else {
            return;
        };
        let passed = seconds::<T>(passed);
        for stored in self.stored.of_secondaries_mut() {
            for (sensor, stored) in SENSORS.into_iter().zip(stored) {
                stored.drift(sensor, passed);
            }
        }
    }

    /// Accepts an uncalibrated secondary without a rest, if it agrees with the primary in motion to within its
    /// trigger.
    pub(super) fn accept_in_motion(&mut self, platform: &Platform<T, UNITS>) {
        let thresholds = &platform.settings().evaluation.thresholds.secondary;
        for sensor in SENSORS {
            let most = thresholds.of(sensor).least();
            for number in 1..UNITS {
                let known = self.isolator.accepted(sensor).contains(number)
                    || self
                        .stored
                        .get(number)
                        .is_none_or(|stored| sensor.of(stored).calibrated);
                let sound = |number: usize| self.health.get(number).is_some_and(Health::is_sound);
                let apart = self.isolator.apart_for_long(sensor, [0, number]);
                if !known && sound(0) && sound(number) && apart.is_some_and(|apart| apart < most) {
                    self.isolator.accept(sensor, number);
                }
            }
        }
    }

    /// Deviations of a calibrated secondary at this rest.
    fn off_at_rest(
        &self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        number: usize,
        fewest: u64,
    ) -> Option<Off<T>> {
        let (unit, stored) = (platform.units().get(number)?, self.stored.get(number)?);
        let rested = |at_rest: &&RestMean<T>| u64::from(at_rest.windows()) >= fewest.max(1);
        let at_rest = self.rest_means.get(number).filter(rested)?;
        let primary = self.rest_means.first()?.mean();
        let stored = sensor.of(stored);
        let comparable = platform.comparable(unit);
        if !stored.calibrated || !comparable.complete(sensor) {
            return None;
        }
        let secondary = SecondaryAtRest {
            sensor,
            unit,
            mean: sensor.triad(at_rest.mean()),
            stored,
            calibration: platform.calibration(),
            comparable: &comparable,
            up: None,
        };
        let settings = &platform.settings().evaluation;
        Some(Off {
            physics: secondary.norm(settings),
            primary: secondary.vector(&sensor.triad(primary), settings),
        })
    }

    /// Marks a secondary as stale, or as known again, or trims it; returns whether physics contradicts it (eq.
    /// 25).
    fn place(
        &mut self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        number: usize,
        off: &Off<T>,
        (primary, common): (&Deviation<T>, &Vector3<T>),
        first: bool,
    ) -> bool {
        let by_physics = off
            .physics
            .is_some_and(|own| own.exceeds() && primary.value < own.value * real(MUCH_LESS)); // isolation.md, eq. 18
        let (siblings, alike) = self.siblings(platform, sensor, number);
        let alike = alike || self.is_shared(platform, sensor, number);
        let by_primary = first && off.primary.exceeds() && !(siblings && alike);
        if by_physics || by_primary {
            self.make_stale(sensor, number, by_physics || siblings);
            return by_physics;
        }
        if off.primary.exceeds() {
            return false;
        }
        let stale = self
            .stored
            .get_mut(number)
            .map(|stored| &mut sensor.of_mut(stored).stale);
        let was_stale = stale.is_some_and(core::mem::take);
        self.trim(platform, (sensor, number), common, first || was_stale);
        false
    }

    /// Mean difference of calibrated secondaries from the primary at this rest, perpendicular to gravity, where
    /// physics cannot confirm the primary. Zero for fewer than two secondaries.
    fn common_across(&self, platform: &Platform<T, UNITS>, sensor: Sensor) -> Vector3<T> {
        let (mut total, mut number_of) = (Vector3::zeros(), 0_u32);
        for number in 1..UNITS {
            let sound = self.health.get(number).is_some_and(Health::is_sound);
            let stored = self.stored.get(number).map(|stored| sensor.of(stored));
            let known = stored.is_some_and(|stored| stored.calibrated && !stored.stale);
            let apart = self
                .apart_from_primary(platform, sensor, number)
                .filter(|_| sound && known);
            if let Some(apart) = apart {
                total = sum(&total, &apart);
                number_of += 1;
            }
        }
        let up = self
            .rest_means
            .first()
            .map(|at_rest| sensor.triad(at_rest.mean()));
        match (sensor, up) {
            (Sensor::Accelerometer, Some(up)) if number_of > 1 => {
                across(&scaled(&total, T::one() / count(number_of)), &up)
            }
            _ => Vector3::zeros(),
        }
    }

    /// Trims a calibrated secondary to the primary at this rest, as far as one rest allows
    /// (docs/theory/isolation.md, eq. 20).
    fn trim(
        &mut self,
        platform: &Platform<T, UNITS>,
        (sensor, number): (Sensor, usize),
        common: &Vector3<T>,
        anew: bool,
    ) -> Option<()> {
        let fresh = self.rest.is_fresh();
        let sound = [0, number]
            .iter()
            .all(|unit| self.health.get(*unit).is_some_and(Health::is_sound));
        if !(fresh || anew) || !sound || self.is_disputed(sensor) {
            return None;
        }
        let apart = self.apart_from_primary(platform, sensor, number)?;
        // The common difference is drift of the primary; after a restart it is more likely that of the
        // secondaries.
        let apart = if anew { apart } else { difference(&apart, common) };
        let stored = sensor.of_mut(self.stored.get_mut(number)?);
        let change = stored.trim(sensor, &apart);
        self.isolator.trimmed(sensor, number, &change, anew);
        Some(())
    }

    /// Returns whether other calibrated secondaries differ from the primary as this one does, by more than any
    /// calibration could find.
    pub(super) fn is_shared(&self, platform: &Platform<T, UNITS>, sensor: Sensor, number: usize) -> bool {
        let own = self.apart_from_primary(platform, sensor, number);
        let calibrated = |number: usize| {
            self.stored
                .get(number)
                .is_some_and(|stored| sensor.of(stored).calibrated)
        };
        let least = platform.settings().plausible_at_rest(sensor, false);
        let Some(own) = own.filter(|own| calibrated(number) && own.length() > least) else {
            return false;
        };
        let alike = |other: usize| {
            let apart = self.apart_from_primary(platform, sensor, other);
            other != number
                && calibrated(other)
                && apart
                    .is_some_and(|apart| difference(&own, &apart).length() < own.length() * real(MUCH_LESS))
        };
        (1..UNITS).any(alike)
    }

    /// Returns whether there are other calibrated secondaries, and whether all of them agree with this one.
    fn siblings(&self, platform: &Platform<T, UNITS>, sensor: Sensor, number: usize) -> (bool, bool) {
        let tolerated = platform.settings().health.tolerated.of(sensor);
        let own = self.apart_from_primary(platform, sensor, number);
        let (mut any, mut alike) = (false, true);
        for other in (1..UNITS).filter(|other| *other != number) {
            let calibrated = self
                .stored
                .get(other)
                .is_some_and(|stored| sensor.of(stored).calibrated);
            let apart = self
                .apart_from_primary(platform, sensor, other)
                .filter(|_| calibrated);
            if let Some((own, apart)) = own.zip(apart) {
                any = true;
                alike &= difference(&own, &apart).length() <= tolerated;
            }
        }
        (any, alike)
    }

    /// Difference of a secondary from the primary at this rest, in the axes of the primary, m/s^2 or rad/s.
    pub(super) fn apart_from_primary(
        &self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        number: usize,
    ) -> Option<Vector3<T>> {
        let measured = |number: usize| {
            let at_rest = self.rest_means.get(number).filter(|rest| rest.windows() > 0)?;
            self.compensated(platform, number, sensor, &sensor.triad(at_rest.mean()))
        };
        let apart = difference(&measured(number)?, &measured(0)?);
        Some(platform.primary_axes().present(sensor, &apart))
    }

    fn make_stale(&mut self, sensor: Sensor, number: usize, freed: bool) -> Option<()> {
        let (stored, health) = (self.stored.get_mut(number)?, self.health.get_mut(number)?);
        let stored = sensor.of_mut(stored);
        stored.freed |= freed;
        if !stored.stale {
            stored.stale = true;
            self.isolator.withdraw_vote(sensor, number);
            health.clear(sensor);
            self.rest.triggered(number);
        }
        Some(())
    }

    /// Withdraws a fault of the primary found by units that physics contradicts, and marks those as faulty,
    /// unless other units contradict the primary as well.
    fn reopen(
        &mut self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        fewest: u64,
        contradicted: UnitSet,
    ) -> bool {
        if contradicted.count() == 0 || !self.is_named(sensor, 0) {
            return false;
        }
        let against = |number: usize| {
            let off = self.off_at_rest(platform, sensor, number, fewest);
            let known = self
                .stored
                .get(number)
                .is_some_and(|stored| !sensor.of(stored).stale);
            off.is_some_and(|off| known && off.primary.exceeds())
        };
        // Units that contradict the primary where physics cannot decide are outnumbered by those that physics
        // contradicts.
        if UnitSet::of::<UNITS>(|number| number != 0 && against(number)).count() >= contradicted.count() {
            return false;
        }
        self.begin_anew(sensor, 0);
        for number in contradicted.units() {
            let off = self.off_at_rest(platform, sensor, number, fewest);
            let own = off.and_then(|off| off.physics);
            if let Some(own) = own {
                let Proof { ground, value, limit } = Proof::at_rest(sensor, own.value);
                let fault = HealthFault::Isolated {
                    sensor,
                    ground,
                    value,
                    limit,
                };
                self.mark_wrong(number, &fault);
            }
        }
        true
    }
}
