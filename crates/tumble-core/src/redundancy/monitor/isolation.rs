//! Inputs of the isolator, and consequences of its decisions.

use nalgebra::Vector3;

use crate::products::{Length, cross, zeros};
use crate::real::{Real, real, seconds};
use crate::redundancy::components::{difference, sum};
use crate::redundancy::evaluation::{Deviation, StoredCalibration, StoredCalibrations};
use crate::redundancy::health::{Health, HealthFault, RefutedBy};
use crate::redundancy::isolation::attribution::Precedence;
use crate::redundancy::isolation::{FaultIsolator, IsolationEvent, SetWindow, UnitReading};
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::{Monitor, Report, majority};
use crate::redundancy::output::lever_arm;
use crate::redundancy::platform::Platform;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::redundancy::unit_set::UnitSet;

/// Windows of rest after which readings count as evidence.
const RESTED: u32 = 16;

/// Share of the deviation of the primary at rest up to which a secondary is evidence against it.
const MUCH_LESS: f64 = 0.5;

/// Prior knowledge about all units.
struct Known<T: Real> {
    /// Units whose errors are known, by accelerometers and by gyroscopes.
    known: [UnitSet; 2],
    /// Units whose readings count.
    live: UnitSet,
    /// Length of a window, s.
    length: T,
}

/// Compensated angular rates of a unit over two windows, over the earlier one, and over the later one, rad/s.
type Rates<T> = [Vector3<T>; 3];

impl<T: Real, const UNITS: usize, const AT_ONCE: usize, const AIDED: usize> Monitor<T, UNITS, AT_ONCE, AIDED>
where
    Units<UNITS>: UnitCount,
{
    /// Isolates faulty units: compares all units over a window.
    #[inline(never)]
    pub(super) fn isolate(
        &mut self,
        platform: &Platform<T, UNITS>,
        window: u64,
        time: u64,
        report: Report<'_, T>,
    ) {
        if self.decides(platform) {
            return;
        }
        let settings = platform.settings();
        let span = self.window_length(platform);
        let length = seconds(span);
        let mut readings = [None; UNITS];
        self.readings(platform, window, length, &mut readings);
        let set = SetWindow {
            units: &readings,
            number: window,
            span,
            steps: &self.steps,
            mounted: platform.units(),
            length,
            gravity: settings.evaluation.gravity,
            noise_ratio: settings.health.noise_ratio,
            means_only: self.rest.is_awaited()
                && self
                    .stored
                    .of_secondaries()
                    .iter()
                    .flatten()
                    .any(|stored| stored.calibrated),
            tolerated: settings.health.tolerated,
            per_kelvin: settings.health.per_kelvin,
        };
        let (health, stored) = (&mut self.health, &mut self.stored);
        let (models, named) = (&mut self.majority, &mut self.named);
        let aiding_evidence = self
            .aiding_channel
            .first_mut()
            .and_then(|aiding_channel| aiding_channel.aiding_evidence.as_mut());
        let mut reinstated = None;
        self.isolator.look(&set, aiding_evidence, &mut |sensor, found| {
            let mut contradict = |unit: usize, fault: HealthFault<T>| {
                majority::contradict(stored, health, sensor, unit, &fault);
                // A decision between two units holds when a third one counts again.
                for model in models.as_mut() {
                    model.exclude(unit);
                }
                named.insert(unit);
            };
            match found {
                IsolationEvent::OutOfFamily {
                    unit,
                    figures,
                    scale,
                    agreeing,
                } => {
                    let (apart, limit) = (figures.apart, figures.threshold);
                    contradict(
                        unit,
                        HealthFault::OutOfFamily {
                            sensor,
                            apart,
                            limit,
                            scale,
                            agreeing,
                        },
                    );
                }
                IsolationEvent::Noisy { unit, scatter, limit } => {
                    contradict(
                        unit,
                        HealthFault::Noisy {
                            sensor,
                            scatter,
                            limit,
                        },
                    );
                }
                IsolationEvent::Isolated { unit, proof } => contradict(
                    unit,
                    HealthFault::Isolated {
                        sensor,
                        ground: proof.ground,
                        value: proof.value,
                        limit: proof.limit,
                    },
                ),
                IsolationEvent::ClockDrifts { unit, by, limit } => {
                    contradict(unit, HealthFault::Clock { by, limit })
                }
                IsolationEvent::Reinstated { unit } => {
                    reinstated = Some(unit);
                    if let Some((health, stored)) = health.get_mut(unit).zip(stored.get_mut(unit)) {
                        sensor.of_mut(stored).freed = false;
                        health.clear(sensor);
                    }
                }
                IsolationEvent::Disagree {
                    units: [unit, other],
                    figures,
                    scale,
                } => report(Event {
                    time,
                    unit,
                    kind: EventKind::Disagree {
                        sensor,
                        other,
                        apart: figures.apart,
                        limit: figures.threshold,
                        scale,
                    },
                }),
                IsolationEvent::Agree { units: [unit, other] } => report(Event {
                    time,
                    unit,
                    kind: EventKind::Agree { sensor, other },
                }),
            }
        });
        if let Some(unit) = reinstated {
            self.readmit(unit);
        }
    }

    /// Determines the readings of all units over a window, at the place of the primary; `None` for a unit
    /// without a comparable reading.
    #[inline(never)]
    fn readings(
        &self,
        platform: &Platform<T, UNITS>,
        window: u64,
        length: T,
        readings: &mut [Option<UnitReading<T>>; UNITS],
    ) {
        let known = SENSORS.map(|sensor| known(&self.isolator, &self.stored, sensor));
        let live = UnitSet::of::<UNITS>(|number| self.lives(number));
        let set = Known { known, live, length };
        let mut rates = [[zeros(); 3]; UNITS];
        let mut measured = UnitSet::default();
        for (number, (reading, rates)) in readings.iter_mut().zip(&mut rates).enumerate() {
            *reading = self.reading(platform, number, window, &set, rates);
            let turns = platform
                .units()
                .get(number)
                .is_some_and(|unit| unit.axes.complete(Sensor::Gyroscope));
            if reading.is_some() && turns {
                measured.insert(number);
            }
        }
        let [_, known_rates] = known;
        if let Some((rate, change)) = self.turning(&rates, known_rates.and(live).and(measured), length) {
            self.carry_to_primary(platform, &rate, &change, readings);
        }
    }

    /// Compensated reading of a unit over a window and the one before, at its own place.
    fn reading(
        &self,
        platform: &Platform<T, UNITS>,
        number: usize,
        window: u64,
        set: &Known<T>,
        rates: &mut Rates<T>,
    ) -> Option<UnitReading<T>> {
        let (unit, stored) = (platform.units().get(number)?, self.stored.get(number));
        let (before, means) = self.histories.get(number)?.pair(window)?;
        let triangle = before.triangle(means);
        let gyroscope = Sensor::Gyroscope;
        *rates = [
            gyroscope.triad(&triangle),
            gyroscope.triad(&before.mean),
            gyroscope.triad(&means.mean),
        ];
        self.compensate(platform, number, gyroscope, rates)?;
        let [rate, ..] = *rates;
        let mut force = [Sensor::Accelerometer.triad(&triangle)];
        self.compensate(platform, number, Sensor::Accelerometer, &mut force)?;
        let [force] = force;
        let votes = |sensor: Sensor| {
            let usable = *sensor.of(&before.usable) && *sensor.of(&means.usable);
            let live = set.live.contains(number) && !stored.is_some_and(|stored| sensor.of(stored).stale);
            usable && live && unit.axes.complete(sensor)
        };
        let uncertainty = |sensor: Sensor| {
            if sensor.of(&set.known).contains(number) {
                // A stored calibration may have aged by up to its trigger, until a rest shows the actual
                // ageing.
                let aged = if stored.is_some_and(|stored| sensor.of(stored).aged) {
                    platform
                        .settings()
                        .evaluation
                        .thresholds
                        .secondary
                        .of(sensor)
                        .least()
                } else {
                    T::zero()
                };
                return aged * aged;
            }
            let most = platform.settings().plausible_at_rest(sensor, false);
            most * most
        };
        let (mut calibrated, mut matrix_shown, mut residual) = ([true; 2], [true; 2], [T::zero(); 2]);
        if let Some([force, rate]) = stored {
            calibrated = [force.calibrated, rate.calibrated];
            matrix_shown = [force.matrix_shown, rate.matrix_shown];
            residual = [squared_residual(force), squared_residual(rate)];
        }
        let ([force_variance, rate_variance], [known_force, known_rate]) = (means.scatter, set.known);
        Some(UnitReading {
            reading: [force, rate],
            scatter: [force_variance.square_root(), rate_variance.square_root()],
            votes: SENSORS.map(votes),
            known: [known_force.contains(number), known_rate.contains(number)],
            calibrated,
            matrix_shown,
            place: match stored {
                Some([accelerometer, _]) if unit.lever_arm.is_none() => accelerometer.place_sigma,
                _ => T::zero(),
            },
            residual,
            uncertainty: SENSORS.map(uncertainty),
            interval: self.steps.get(number)?.interval() * set.length,
            at_rest: self.at_rest(platform, number),
        })
    }

    /// Angular rate, rad/s, and angular acceleration, rad/s^2, of the set over two windows: medians over known
    /// units. Under a triangle, the change of the mean rate is the mean angular acceleration
    /// (docs/theory/redundancy.md, eq. 3).
    fn turning(
        &self,
        rates: &[Rates<T>; UNITS],
        fit: UnitSet,
        length: T,
    ) -> Option<(Vector3<T>, Vector3<T>)> {
        let of_set = |choose: fn(&Rates<T>) -> &Vector3<T>| {
            self.isolator
                .set_rate(fit, &|number| Some(choose(rates.get(number)?)))
        };
        let now = of_set(|[_, _, now]| now)?;
        let before = of_set(|[_, before, _]| before)?;
        let over_both = of_set(|[both, ..]| both)?;
        let change = difference(&now, &before);
        Some((
            over_both,
            Vector3::new(change.x / length, change.y / length, change.z / length),
        ))
    }

    /// Subtracts the specific force that lever arms cause at an angular rate, rad/s, and its derivative
    /// `change`, rad/s^2.
    fn carry_to_primary(
        &self,
        platform: &Platform<T, UNITS>,
        rate: &Vector3<T>,
        change: &Vector3<T>,
        readings: &mut [Option<UnitReading<T>>; UNITS],
    ) {
        for ((number, unit), reading) in platform.units().iter().enumerate().zip(readings) {
            let Some(UnitReading {
                reading: [force, _], ..
            }) = reading
            else {
                continue;
            };
            let arm = lever_arm(unit, self.stored.get(number));
            let carried = sum(&cross(change, &arm), &cross(rate, &cross(rate, &arm)));
            *force = difference(force, &carried);
        }
    }

    /// Returns whether readings of a unit are compared: it is healthy, or its fault was found by comparison.
    pub(super) fn lives(&self, number: usize) -> bool {
        let lives = |health: &Health<T>| health.fault().is_none_or(|fault| fault.is_found_by_comparison());
        self.health.get(number).is_some_and(lives)
    }

    /// `|f| - g` and `|w|` of a unit over this rest, once the rest is long enough.
    fn at_rest(&self, platform: &Platform<T, UNITS>, number: usize) -> Option<[T; 2]> {
        self.rest_means
            .get(number)
            .filter(|at_rest| at_rest.windows() >= RESTED)?;
        self.at_rest_measured(platform, number)
    }

    /// `|f| - g` and `|w|` of a unit over this rest, of any length.
    pub(super) fn at_rest_measured(&self, platform: &Platform<T, UNITS>, number: usize) -> Option<[T; 2]> {
        let at_rest = self.rest_means.get(number)?;
        let measured =
            |sensor: Sensor| self.compensated(platform, number, sensor, &sensor.triad(at_rest.mean()));
        let force = measured(Sensor::Accelerometer)?.length() - platform.settings().evaluation.gravity;
        Some([force, measured(Sensor::Gyroscope)?.length()])
    }

    /// Marks the primary as faulty if it deviates at rest beside a calibrated secondary that does not.
    pub(super) fn hold_rest_against_primary(
        &mut self,
        platform: &Platform<T, UNITS>,
        deviations: &[Option<Deviation<T>>; 2],
    ) {
        for (sensor, deviation) in SENSORS.into_iter().zip(deviations) {
            let Some(deviation) = deviation.filter(Deviation::exceeds) else {
                continue;
            };
            let better = UnitSet::of::<UNITS>(|number| {
                let stored = self
                    .stored
                    .get(number)
                    .is_some_and(|stored| sensor.of(stored).calibrated);
                let fault = self.health.get(number).map(Health::fault);
                let healthy =
                    fault.is_some_and(|fault| fault.is_none_or(|fault| fault.yields_to(Precedence::Physics)));
                let off = self
                    .at_rest(platform, number)
                    .map(|at_rest| sensor.of(&at_rest).abs());
                let within = off
                    .is_some_and(|off| off < deviation.threshold && off < deviation.value * real(MUCH_LESS));
                number != 0 && stored && healthy && within
            });
            if better.count() == 0 {
                continue;
            }
            if let Some(health) = self.health.first_mut() {
                health.at_rest(sensor, deviation.value, deviation.threshold);
            }
            for number in better.units() {
                self.begin_anew(sensor, number);
            }
        }
    }

    /// Returns whether known units disagree. A dispute with an uncalibrated unit does not count, because its fit
    /// will resolve it.
    pub(super) fn is_contested(&self, sensor: Sensor) -> bool {
        let uncalibrated = |number| contradicts_as_uncalibrated(&self.isolator, &self.stored, sensor, number);
        self.is_disputed(sensor) && !(1..UNITS).any(uncalibrated)
    }

    /// Returns whether a deviation of a secondary cannot be a fault of the primary.
    pub(super) fn may_be_refuted(&self, sensor: Sensor, number: usize) -> bool {
        !self.isolator.is_disputed_with(sensor, number) && !self.is_named(sensor, 0)
    }

    /// Withdraws a fault of a sensor that comparison found.
    pub(super) fn begin_anew(&mut self, sensor: Sensor, number: usize) {
        if self.is_named(sensor, number) {
            self.isolator.begin_anew(sensor, number);
            self.clear_sensor(sensor, number);
            self.readmit(number);
        }
    }

    /// Accepts units that agree with a valid primary at this rest, and refutes units that differ by more than a
    /// calibration could explain.
    pub(super) fn accept_or_refute(&mut self, platform: &Platform<T, UNITS>) {
        for sensor in SENSORS {
            for number in 1..UNITS {
                let Some(stored) = self.stored.get(number) else {
                    continue;
                };
                let stored = sensor.of(stored);
                if !stored.apart.is_finite() {
                    continue;
                }
                if stored.agrees && !self.isolator.accepted(sensor).contains(number) {
                    self.isolator.accept(sensor, number);
                }
                let limit = platform.settings().plausible_at_rest(sensor, false);
                let may_be_refuted = self.may_be_refuted(sensor, number);
                if let Some(health) = self.health.get_mut(number)
                    && may_be_refuted
                {
                    health.refute(sensor, RefutedBy::Rest, stored.apart, limit);
                }
            }
        }
    }
}

/// Units whose errors are known: those that were calibrated against the primary or agreed with it, and those
/// with stored calibrations if there is more than one.
fn known<T: Real, const UNITS: usize>(
    isolator: &FaultIsolator<T, UNITS>,
    stored: &StoredCalibrations<T, UNITS>,
    sensor: Sensor,
) -> UnitSet
where
    Units<UNITS>: UnitCount,
{
    let calibrated = |number: usize| {
        stored
            .get(number)
            .is_some_and(|stored| sensor.of(stored).calibrated && !sensor.of(stored).stale)
    };
    let calibrated = UnitSet::of::<UNITS>(|number| number != 0 && calibrated(number));
    let known = isolator.accepted(sensor).or(UnitSet::PRIMARY);
    if calibrated.count() > 1 {
        known.or(calibrated)
    } else {
        known
    }
}

/// Returns whether an uncalibrated secondary contradicts another unit by more than a calibration could find.
pub(super) fn is_implausible<T: Real, const UNITS: usize>(
    isolator: &FaultIsolator<T, UNITS>,
    stored: &StoredCalibrations<T, UNITS>,
    number: usize,
) -> bool
where
    Units<UNITS>: UnitCount,
{
    let disputed = isolator.is_disputed(Sensor::Accelerometer) || isolator.is_disputed(Sensor::Gyroscope);
    let implausible = |sensor| contradicts_as_uncalibrated(isolator, stored, sensor, number);
    disputed && SENSORS.into_iter().any(implausible)
}

#[inline]
fn contradicts_as_uncalibrated<T: Real, const UNITS: usize>(
    isolator: &FaultIsolator<T, UNITS>,
    stored: &StoredCalibrations<T, UNITS>,
    sensor: Sensor,
    number: usize,
) -> bool
where
    Units<UNITS>: UnitCount,
{
    isolator.is_disputed_with(sensor, number) && !known(isolator, stored, sensor).contains(number)
}

/// Squared residual of a channel after calibration, `(m/s^2)^2` or `(rad/s)^2`.
fn squared_residual<T: Real>(stored: &StoredCalibration<T>) -> T {
    if stored.calibrated {
        stored.residual * stored.residual
    } else {
        T::zero()
    }
}
