//! What the monitor hands to the judge, and what becomes of its verdicts.

use nalgebra::Vector3;

use crate::products::{Length, cross};
use crate::real::{Real, real, seconds};
use crate::redundancy::evaluation::{Deviation, StoredCalibration};
use crate::redundancy::health::{Health, HealthFault, RefutedBy};
use crate::redundancy::judgement::{Judge, Judgement, SetWindow, UnitReading};
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::{Monitor, Report};
use crate::redundancy::output::lever_arm;
use crate::redundancy::platform::Platform;
use crate::redundancy::samples::pair::TwoWindows;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::sample::CHANNELS;

/// Rest after which what units say at it is held against them, windows.
const RESTED: u32 = 16;

/// Share of the primary's deviation at rest that a secondary may have to be held against it.
const MUCH_LESS: f64 = 0.5;

impl<T: Real, const UNITS: usize, const AT_ONCE: usize> Monitor<T, UNITS, AT_ONCE> {
    /// Has all units judged over a window.
    pub(super) fn judge(
        &mut self,
        platform: &Platform<T, UNITS>,
        window: u64,
        time: u64,
        report: Report<'_, T>,
    ) {
        let settings = platform.settings();
        let readings = self.readings(platform, window);
        let set = SetWindow {
            units: &readings,
            number: window,
            span: settings.window,
            steps: &self.steps,
            mounted: platform.units(),
            length: seconds(settings.window),
            gravity: settings.evaluation.gravity,
            noise_ratio: settings.health.noise_ratio,
            tolerated: settings.health.tolerated,
        };
        let health = &mut self.health;
        self.judge.look(&set, &mut |sensor, judgement| {
            let mut contradict = |unit: usize, fault| {
                if let Some(health) = health.get_mut(unit) {
                    health.contradict(sensor, fault);
                }
            };
            match judgement {
                Judgement::OutOfFamily {
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
                Judgement::Noisy { unit, scatter, limit } => {
                    contradict(
                        unit,
                        HealthFault::Noisy {
                            sensor,
                            scatter,
                            limit,
                        },
                    );
                }
                Judgement::Blamed { unit, proof } => contradict(
                    unit,
                    HealthFault::Blamed {
                        sensor,
                        ground: proof.ground,
                        value: proof.value,
                        limit: proof.limit,
                    },
                ),
                Judgement::Redeemed { unit } => {
                    if let Some(health) = health.get_mut(unit) {
                        health.absolve(sensor);
                    }
                }
                Judgement::Disagree {
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
                Judgement::Agree { units: [unit, other] } => report(Event {
                    time,
                    unit,
                    kind: EventKind::Agree { sensor, other },
                }),
            }
        });
    }

    /// What each unit says over a window, at the primary's place; `None` for one that said nothing or cannot be compared.
    fn readings(&self, platform: &Platform<T, UNITS>, window: u64) -> [Option<UnitReading<T>>; UNITS] {
        let said = core::array::from_fn(|number| self.triangle(platform, number, window));
        let turning = self.turning(platform, window, &said);
        core::array::from_fn(|number| {
            let [f, w] = said.get(number).copied().flatten()?;
            let (unit, stored) = (platform.units().get(number)?, self.stored.get(number)?);
            let (before, means) = self.histories.get(number)?.pair(window)?;
            let arm = lever_arm(unit, stored);
            let carried = turning.map_or(Vector3::zeros(), |(rate, change)| {
                cross(&change, &arm) + cross(&rate, &cross(&rate, &arm))
            });
            let lives = self.lives(number);
            let of_sensors = |fact: &dyn Fn(Sensor) -> bool| SENSORS.map(fact);
            let known = of_sensors(&|sensor| self.is_known(sensor, number));
            Some(UnitReading {
                reading: [f - carried, w],
                scatter: means.scatter.map(|variance| variance.square_root()),
                votes: of_sensors(&|sensor| {
                    lives
                        && *sensor.of(&before.usable)
                        && *sensor.of(&means.usable)
                        && unit.axes.complete(sensor)
                }),
                known,
                calibrated: of_sensors(&|sensor| number == 0 || sensor.of(stored).calibrated),
                matrix_shown: of_sensors(&|sensor| number == 0 || sensor.of(stored).matrix_shown),
                place: if number == 0 || unit.lever_arm.is_some() {
                    T::zero()
                } else {
                    Sensor::Accelerometer.of(stored).place_sigma
                },
                residual: SENSORS.map(|sensor| squared_residual(sensor.of(stored))),
                unfound: SENSORS.map(|sensor| {
                    let most = platform.settings().plausible_at_rest(sensor, false);
                    if *sensor.of(&known) {
                        T::zero()
                    } else {
                        most * most
                    }
                }),
                interval: self.steps.get(number)?.interval() * seconds(platform.settings().window),
                at_rest: self.at_rest(platform, number),
            })
        })
    }

    /// Specific force, m/s^2, and angular rate, rad/s, of a unit over two windows, at its own place.
    fn triangle(&self, platform: &Platform<T, UNITS>, number: usize, window: u64) -> Option<[Vector3<T>; 2]> {
        let (before, means) = self.histories.get(number)?.pair(window)?;
        let triangle = before.triangle(means);
        let said = |sensor: Sensor| self.compensated(platform, number, sensor, &sensor.triad(&triangle));
        Some([said(Sensor::Accelerometer)?, said(Sensor::Gyroscope)?])
    }

    /// Angular rate, rad/s, and angular acceleration, rad/s^2, of the set over two windows: medians over what is known of the
    /// units. Under a triangle, the change of the mean rate is the mean angular acceleration (docs/theory/redundancy.md, eq. 3).
    fn turning(
        &self,
        platform: &Platform<T, UNITS>,
        window: u64,
        said: &[Option<[Vector3<T>; 2]>; UNITS],
    ) -> Option<(Vector3<T>, Vector3<T>)> {
        let fit = |number: usize| self.is_known(Sensor::Gyroscope, number) && self.lives(number);
        let rate = |number: usize, of: &dyn Fn(TwoWindows<'_, T>) -> [T; CHANNELS]| {
            let means = of(self.histories.get(number)?.pair(window)?);
            let rate = Sensor::Gyroscope.triad(&means);
            self.compensated(platform, number, Sensor::Gyroscope, &rate)
        };
        let of_set = |rate: &dyn Fn(usize) -> Option<Vector3<T>>| {
            self.judge
                .set_rate(|number| fit(number).then(|| rate(number)).flatten())
        };
        let now = of_set(&|number| rate(number, &|(_, now)| now.mean))?;
        let before = of_set(&|number| rate(number, &|(before, _)| before.mean))?;
        let over_both = of_set(&|number| said.get(number)?.map(|[_, rate]| rate))?;
        Some((
            over_both,
            (now - before) / seconds::<T>(platform.settings().window),
        ))
    }

    /// Whether what a unit says counts, but for what is found here.
    fn lives(&self, number: usize) -> bool {
        let lives = |health: &Health<T>| health.fault().is_none_or(|fault| fault.is_judged());
        self.health.get(number).is_some_and(lives)
    }

    fn is_known(&self, sensor: Sensor, number: usize) -> bool {
        is_known(&self.judge, &self.stored, sensor, number)
    }

    /// `|f| - g` and `|w|` of a unit over this rest.
    fn at_rest(&self, platform: &Platform<T, UNITS>, number: usize) -> Option<[T; 2]> {
        let at_rest = self
            .rest_means
            .get(number)
            .filter(|at_rest| at_rest.windows() >= RESTED)?;
        let said = |sensor: Sensor| self.compensated(platform, number, sensor, &sensor.triad(at_rest.mean()));
        let force = said(Sensor::Accelerometer)?.length() - platform.settings().evaluation.gravity;
        Some([force, said(Sensor::Gyroscope)?.length()])
    }

    /// A primary that deviates at rest, beside a calibrated secondary that does not, is wrong by itself.
    pub(super) fn hold_rest_against_primary(
        &mut self,
        platform: &Platform<T, UNITS>,
        deviations: &[Option<Deviation<T>>; 2],
    ) {
        for (sensor, deviation) in SENSORS.into_iter().zip(deviations) {
            let Some(deviation) = deviation.filter(Deviation::exceeds) else {
                continue;
            };
            let better = (1..UNITS).any(|number| {
                let stored = self
                    .stored
                    .get(number)
                    .is_some_and(|stored| sensor.of(stored).calibrated);
                let healthy = self.health.get(number).is_some_and(Health::is_sound);
                let off = self
                    .at_rest(platform, number)
                    .map(|at_rest| sensor.of(&at_rest).abs());
                let within = off
                    .is_some_and(|off| off < deviation.threshold && off < deviation.value * real(MUCH_LESS));
                stored && healthy && within
            });
            if let Some(health) = self.health.first_mut().filter(|_| better) {
                health.at_rest(sensor, deviation.value, deviation.threshold);
            }
        }
    }

    /// Lets units in that agreed with a valid primary at this rest, and holds against others that they cannot be what they
    /// are said to be.
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
                if stored.agrees && !self.judge.is_accepted(sensor, number) {
                    self.judge.accept(sensor, number);
                }
                let limit = platform.settings().plausible_at_rest(sensor, false);
                if let Some(health) = self.health.get_mut(number)
                    && may_be_refuted(&self.judge, sensor, number)
                {
                    health.refute(sensor, RefutedBy::Rest, stored.apart, limit);
                }
            }
        }
    }
}

/// Whether what is held against a secondary cannot be the primary's fault.
pub(super) fn may_be_refuted<T: Real, const UNITS: usize>(
    judge: &Judge<T, UNITS>,
    sensor: Sensor,
    number: usize,
) -> bool {
    !judge.is_disputed_with(sensor, number) && !judge.is_guilty(sensor, 0)
}

/// Whether enough is known of a unit for what it says to count: it was calibrated against the primary or agreed with it, or it
/// comes calibrated and so does another beside it.
pub(super) fn is_known<T: Real, const UNITS: usize>(
    judge: &Judge<T, UNITS>,
    stored: &[[StoredCalibration<T>; 2]; UNITS],
    sensor: Sensor,
    number: usize,
) -> bool {
    let calibrated = |stored: &[StoredCalibration<T>; 2]| sensor.of(stored).calibrated;
    let comes_calibrated = stored.get(number).is_some_and(calibrated)
        && stored.iter().skip(1).filter(|stored| calibrated(stored)).count() > 1;
    number == 0 || comes_calibrated || judge.is_accepted(sensor, number)
}

/// Whether units disagree that are both known. What a stranger contradicts is not calibrated by either: its fit says what it is.
pub(super) fn is_contested<T: Real, const UNITS: usize>(
    judge: &Judge<T, UNITS>,
    stored: &[[StoredCalibration<T>; 2]; UNITS],
    sensor: Sensor,
) -> bool {
    let stranger = |number| contradicts_as_stranger(judge, stored, sensor, number);
    judge.is_disputed(sensor) && !(1..UNITS).any(stranger)
}

/// Whether a secondary was never calibrated and contradicts another unit by more than calibration could find.
pub(super) fn is_strange<T: Real, const UNITS: usize>(
    judge: &Judge<T, UNITS>,
    stored: &[[StoredCalibration<T>; 2]; UNITS],
    number: usize,
) -> bool {
    let strange = |sensor| contradicts_as_stranger(judge, stored, sensor, number);
    SENSORS.into_iter().any(strange)
}

fn contradicts_as_stranger<T: Real, const UNITS: usize>(
    judge: &Judge<T, UNITS>,
    stored: &[[StoredCalibration<T>; 2]; UNITS],
    sensor: Sensor,
    number: usize,
) -> bool {
    judge.is_disputed_with(sensor, number) && !is_known(judge, stored, sensor, number)
}

/// Squared residual of a channel that a calibration leaves, `(m/s^2)^2` or `(rad/s)^2`.
fn squared_residual<T: Real>(stored: &StoredCalibration<T>) -> T {
    if stored.calibrated {
        stored.residual * stored.residual
    } else {
        T::zero()
    }
}
