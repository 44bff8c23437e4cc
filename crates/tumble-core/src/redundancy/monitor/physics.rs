//! Physics first: at rest it says who is right before anybody else does, and takes back what others found.

use nalgebra::Vector3;

use crate::products::Length;
use crate::real::{Real, real};
use crate::redundancy::components::{difference, larger};
use crate::redundancy::evaluation::{Deviation, SecondaryAtRest};
use crate::redundancy::health::{Health, HealthFault};
use crate::redundancy::judgement::attribution::Proof;
use crate::redundancy::monitor::Monitor;
use crate::redundancy::platform::Platform;
use crate::redundancy::samples::history::RestMean;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::unit_set::UnitSet;

/// Share of what a secondary is off by that a primary may be which is believed beside it.
const MUCH_LESS: f64 = 0.5;

/// Share of drift within specification that is not trimmed: what a unit is off by as it is switched on may go again.
const UNTRIMMED: f64 = 0.25;

/// What a secondary is off by at a rest.
struct Off<T: Real> {
    /// Against what physics says, if that can be told of it.
    physics: Option<Deviation<T>>,
    /// Against the primary.
    primary: Deviation<T>,
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const WITNESSED: usize>
    Monitor<T, UNITS, AT_ONCE, WITNESSED>
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
        let mut reopened = false;
        for (sensor, deviation) in SENSORS.into_iter().zip(deviations) {
            let fault = self.health.first().and_then(|health| health.fault());
            let believed = fault.is_none_or(|fault| fault.is_judged());
            let Some(primary) = deviation.filter(|deviation| believed && !deviation.exceeds()) else {
                continue;
            };
            let mut contradicted = UnitSet::default();
            for number in 1..UNITS {
                let off = self.off_at_rest(platform, sensor, number, fewest);
                let Some(off) = off else { continue };
                if self.place(platform, sensor, number, &off, &primary, first) {
                    contradicted.insert(number);
                }
            }
            reopened |= self.reopen(platform, sensor, fewest, contradicted);
        }
        reopened
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
        primary: &Deviation<T>,
        first: bool,
    ) -> bool {
        let by_physics = off
            .physics
            .is_some_and(|own| own.exceeds() && primary.value < own.value * real(MUCH_LESS)); // judgement.md, eq. 25
        let (siblings, alike) = self.siblings(platform, sensor, number);
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
        if first || was_stale {
            let kept = platform.settings().health.tolerated.of(sensor) * real(UNTRIMMED);
            let apart = self.apart_from_primary(platform, sensor, number);
            if let Some(apart) = apart {
                let beyond = larger(T::zero(), T::one() - kept / larger(kept, apart.length()));
                self.judge.trim(sensor, number, &(apart * beyond));
            }
        }
        false
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
    fn apart_from_primary(
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
            health.absolve(sensor);
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
        if contradicted.count() == 0 || !self.judge.is_guilty(sensor, 0) {
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
        if (1..UNITS).any(against) {
            return false;
        }
        self.acquit(sensor, 0);
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
