//! Physics first: at rest it says who is right before anybody else does, and takes back what others found.

use nalgebra::Vector3;

use crate::products::Length;
use crate::real::{Real, count, real, seconds};
use crate::redundancy::components::{difference, scaled, sum};
use crate::redundancy::evaluation::{Deviation, SecondaryAtRest, across};
use crate::redundancy::health::{Health, HealthFault};
use crate::redundancy::judgement::attribution::Proof;
use crate::redundancy::monitor::Monitor;
use crate::redundancy::platform::Platform;
use crate::redundancy::samples::history::RestMean;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::unit_set::UnitSet;

/// Share of what a secondary is off by that a primary may be which is believed beside it.
const MUCH_LESS: f64 = 0.5;

/// What a secondary is off by at a rest.
struct Off<T: Real> {
    /// Against what physics says, if that can be told of it.
    physics: Option<Deviation<T>>,
    /// Against the primary.
    primary: Deviation<T>,
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize>
    Monitor<T, UNITS, AT_ONCE, AIDED>
{
    /// Lets a primary that is right at rest say which secondaries are stale, and which are only trimmed
    /// (docs/theory/judgement.md, section 14). Says whether a verdict upon the primary was taken back.
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
            let believed = fault.is_none_or(|fault| fault.is_judged());
            let Some(primary) = deviation.filter(|deviation| believed && !deviation.exceeds()) else {
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

    /// What calibrated units may have drifted by since the latest rest.
    fn drift_on(&mut self) {
        let Some(passed) = self.rest.since_latest(self.clock.now().unwrap_or(0)) else {
            return;
        };
        let passed = seconds::<T>(passed);
        for stored in self.stored.iter_mut().skip(1) {
            for (sensor, stored) in SENSORS.into_iter().zip(stored) {
                stored.drift(sensor, passed);
            }
        }
    }

    /// Where no rest comes, a secondary that was never calibrated is known once it has said in motion what the primary says, to
    /// within its trigger.
    pub(super) fn accept_in_motion(&mut self, platform: &Platform<T, UNITS>) {
        let thresholds = &platform.settings().evaluation.thresholds.secondary;
        for sensor in SENSORS {
            let most = thresholds.of(sensor).least();
            for number in 1..UNITS {
                let known = self.judge.accepted(sensor).contains(number)
                    || self
                        .stored
                        .get(number)
                        .is_none_or(|stored| sensor.of(stored).calibrated);
                let sound = |number: usize| self.health.get(number).is_some_and(Health::is_sound);
                let apart = self.judge.apart_for_long(sensor, [0, number]);
                if !known && sound(0) && sound(number) && apart.is_some_and(|apart| apart < most) {
                    self.judge.accept(sensor, number);
                }
            }
        }
    }

    /// What a calibrated secondary is off by at this rest.
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

    /// Makes a secondary stale, or known again, or trims it; says whether physics speaks against it (eq. 25).
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
            .is_some_and(|own| own.exceeds() && primary.value < own.value * real(MUCH_LESS)); // judgement.md, eq. 25
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

    /// What calibrated secondaries say beyond the primary at this rest, on average, as far as physics does not say that the
    /// primary is right: across gravity. Zero where there are not two of them.
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

    /// Brings what a calibrated secondary says to what the primary says at this rest, as far as it can be known from one
    /// (docs/theory/judgement.md, eq. 27).
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
        if !(fresh || anew) || !sound || self.judge.is_disputed(sensor) {
            return None;
        }
        let apart = self.apart_from_primary(platform, sensor, number)?;
        // What all share is the primary's own drift; of what was stored before, all of it is likelier to be theirs.
        let apart = if anew { apart } else { difference(&apart, common) };
        let stored = sensor.of_mut(self.stored.get_mut(number)?);
        let change = stored.trim(sensor, &apart);
        self.judge.trimmed(sensor, number, &change, anew);
        Some(())
    }

    /// Whether other calibrated secondaries are from the primary as this one is, by more than any calibration could find.
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

    /// Whether there are other calibrated secondaries, and whether all of them say what this one does.
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

    /// What a secondary says at this rest beyond the primary, in its axes, m/s^2 or rad/s.
    pub(super) fn apart_from_primary(
        &self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        number: usize,
    ) -> Option<Vector3<T>> {
        let said = |number: usize| {
            let at_rest = self.rest_means.get(number).filter(|rest| rest.windows() > 0)?;
            self.compensated(platform, number, sensor, &sensor.triad(at_rest.mean()))
        };
        let apart = difference(&said(number)?, &said(0)?);
        Some(platform.primary_axes().present(sensor, &apart))
    }

    fn make_stale(&mut self, sensor: Sensor, number: usize, freed: bool) -> Option<()> {
        let (stored, health) = (self.stored.get_mut(number)?, self.health.get_mut(number)?);
        let stored = sensor.of_mut(stored);
        stored.freed |= freed;
        if !stored.stale {
            stored.stale = true;
            self.judge.disown(sensor, number);
            health.clear(sensor);
            self.rest.triggered(number);
        }
        Some(())
    }

    /// Takes back a verdict upon the primary by units that physics speaks against, and names them, where nobody else contradicts
    /// it.
    fn reopen(
        &mut self,
        platform: &Platform<T, UNITS>,
        sensor: Sensor,
        fewest: u64,
        contradicted: UnitSet,
    ) -> bool {
        if contradicted.count() == 0 || !self.judge.is_faulty(sensor, 0) {
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
        // Who differs from the primary only where physics says nothing is outnumbered by those that physics contradicts.
        if UnitSet::of::<UNITS>(|number| number != 0 && against(number)).count() >= contradicted.count() {
            return false;
        }
        self.begin_anew(sensor, 0);
        for number in contradicted.units() {
            let off = self.off_at_rest(platform, sensor, number, fewest);
            let own = off.and_then(|off| off.physics);
            if let Some((own, health)) = own.zip(self.health.get_mut(number)) {
                let Proof { ground, value, limit } = Proof::at_rest(sensor, own.value);
                health.contradict(
                    sensor,
                    HealthFault::Blamed {
                        sensor,
                        ground,
                        value,
                        limit,
                    },
                );
            }
        }
        true
    }
}
