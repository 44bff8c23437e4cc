//! The health of redundant units: hostile data harm nobody, healthy units are left alone, faults are found in time, and
//! the source does not flap.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::health::{Health, HealthFault, RefutedBy, Usable};
use tumble_core::redundancy::platform::Range;
use tumble_core::redundancy::selection::{Condition, Selection, SourceCandidate};
use tumble_core::redundancy::sensor::{Axes, SENSORS, Sensor};
use tumble_core::redundancy::settings::{HealthSettings, SelectionSettings};
use tumble_core::sample::{CHANNELS, Sample};

use crate::common::{Draws, cases};

const NO_RANGE: Range<f64> = Range {
    specific_force: None,
    angular_rate: None,
};

fn sample<T: Real>(time: u64, y: [f64; CHANNELS]) -> Sample<T> {
    let [fx, fy, fz, wx, wy, wz] = y.map(real);
    Sample {
        time,
        specific_force: Vector3::new(fx, fy, fz),
        angular_rate: Vector3::new(wx, wy, wz),
    }
}

fn range<T: Real>(of: Range<f64>) -> Range<T> {
    Range {
        specific_force: of.specific_force.map(real),
        angular_rate: of.angular_rate.map(real),
    }
}

/// One unit with its settings and time.
struct MountedUnit<T: Real> {
    health: Health<T>,
    settings: HealthSettings<T>,
    range: Range<T>,
    axes: Axes,
    time: u64,
    period: u64,
}

impl<T: Real> MountedUnit<T> {
    fn new(period: u64) -> Self {
        Self {
            health: Health::new(),
            settings: HealthSettings::default(),
            range: range(NO_RANGE),
            axes: Axes::ALL,
            time: 1_000_000,
            period,
        }
    }

    fn push(&mut self, y: [f64; CHANNELS]) -> Usable {
        self.time += self.period;
        self.health
            .push(&sample(self.time, y), &self.axes, &self.range, &self.settings)
    }
}

/// Anything that may happen to a unit.
#[derive(Clone, Debug)]
enum Act {
    Push(u64, [f64; CHANNELS]),
    Tick(u64),
    Contradict(bool, f64, f64),
    Clear(bool),
    Refute(bool, bool, f64),
    RestMean(bool, f64),
    ClockJumped,
    Restart(u64),
}

fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => -20.0..20.0_f64,
        1 => Just(160.0),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => prop::num::f64::ANY,
        1 => -1e38..1e38_f64,
    ]
}

fn act() -> impl Strategy<Value = Act> {
    let wait = || prop_oneof![8 => 0..20_000_u64, 1 => 0..2_000_000_u64, 1 => any::<u64>()];
    prop_oneof![
        12 => (wait(), prop::array::uniform6(wild())).prop_map(|(wait, y)| Act::Push(wait, y)),
        2 => wait().prop_map(Act::Tick),
        2 => (any::<bool>(), wild(), wild()).prop_map(|(sensor, apart, limit)| Act::Contradict(sensor, apart, limit)),
        2 => any::<bool>().prop_map(Act::Clear),
        2 => (any::<bool>(), any::<bool>(), wild()).prop_map(|(sensor, fit, by)| Act::Refute(sensor, fit, by)),
        1 => (any::<bool>(), wild()).prop_map(|(sensor, deviation)| Act::RestMean(sensor, deviation)),
        1 => Just(Act::ClockJumped),
        1 => any::<u64>().prop_map(Act::Restart),
    ]
}

fn of(accelerometer: bool) -> Sensor {
    if accelerometer {
        Sensor::Accelerometer
    } else {
        Sensor::Gyroscope
    }
}

/// Performs the act, and checks the report on a sample.
fn perform<T: Real>(unit: &mut MountedUnit<T>, act: &Act) -> Result<(), TestCaseError> {
    let settings = unit.settings;
    match *act {
        Act::Push(wait, y) => {
            unit.time = unit.time.saturating_add(wait);
            unit.period = 0;
            let usable = unit.push(y);
            for (sensor, usable) in SENSORS.into_iter().zip(usable) {
                let first = sensor.first_channel();
                let bad = (first..first + 3).any(|i| {
                    let limit = if i < 3 { 160.0 } else { 35.0 };
                    unit.axes.0[i] && (y[i].is_nan() || y[i].abs() >= limit)
                });
                prop_assert!(!(bad && usable), "{y:?} {usable}");
                prop_assert!(!usable || unit.axes.any(sensor));
            }
        }
        Act::Tick(wait) => unit.health.tick(unit.time.saturating_add(wait), &settings),
        Act::Contradict(sensor, apart, limit) => {
            let fault = HealthFault::OutOfFamily {
                sensor: of(sensor),
                apart: real(apart),
                limit: real(limit),
                scale: real(0.1),
                agreeing: 0b110,
            };
            unit.health.contradict(of(sensor), fault);
        }
        Act::Clear(sensor) => unit.health.clear(of(sensor)),
        Act::Refute(sensor, fit, deviation) => {
            let by = if fit { RefutedBy::Fit } else { RefutedBy::Rest };
            unit.health.refute(of(sensor), by, real(deviation), real(4.0));
        }
        Act::RestMean(sensor, deviation) => {
            let limit = settings.rest.of(of(sensor));
            unit.health.at_rest(of(sensor), real(deviation), limit);
        }
        Act::ClockJumped => unit.health.clock_jumped(unit.time),
        Act::Restart(time) => {
            unit.time = time;
            unit.health.restart_time(time);
        }
    }
    Ok(())
}

fn withstands<T: Real>(acts: &[Act], axes: [bool; CHANNELS]) -> Result<(), TestCaseError> {
    let mut unit = MountedUnit::<T>::new(0);
    unit.axes = Axes(axes);
    unit.range = range(Range {
        specific_force: Some(160.0),
        angular_rate: Some(35.0),
    });
    let mut seen = false;
    for act in acts {
        perform(&mut unit, act)?;
        seen |= matches!(act, Act::Push(..));
        let healthy = unit.health.healthy_since();
        prop_assert_eq!(healthy.is_some(), seen && unit.health.fault().is_none());
        prop_assert!(
            healthy.is_none_or(|since| since <= unit.time),
            "{healthy:?} {}",
            unit.time
        );
    }
    Ok(())
}

/// Motion, noise and resolution of a healthy unit, m/s^2 with a tenth of it in rad/s.
#[derive(Clone, Copy, Debug)]
struct Life {
    period: u64,
    noise: f64,
    /// Largest count of the converter, as a multiple of the noise.
    count: f64,
    amplitude: f64,
    /// Periods of the motion in a sample.
    frequency: f64,
    seed: u64,
}

fn life() -> impl Strategy<Value = Life> {
    let noise = prop_oneof![0.0005..0.01_f64, 0.01..1.0_f64, 1.0..10.0_f64];
    let amplitude = prop_oneof![Just(0.0), 0.1..20.0_f64, 20.0..300.0_f64];
    let shape = (
        prop_oneof![0.0..2.0_f64, 2.0..5.0_f64],
        amplitude,
        0.0001..0.12_f64,
    );
    (250..40_000_u64, noise, shape, any::<u64>()).prop_map(
        |(period, noise, (count, amplitude, frequency), seed)| Life {
            period,
            noise,
            count,
            amplitude,
            frequency,
            seed,
        },
    )
}

impl Life {
    fn reading(&self, i: u32, draws: &mut Draws) -> [f64; CHANNELS] {
        let angle = core::f64::consts::TAU * self.frequency * f64::from(i);
        // A count as large as a spike leaves and comes back as one.
        let count = (self.count * self.noise).min(10.0);
        core::array::from_fn(|channel| {
            let share = [1.0, -0.5, 0.3, 0.1, 0.05, -0.1][channel];
            let unit = if channel < 3 { 1.0 } else { 0.1 };
            let level = if channel == 2 { 9.8 } else { 0.0 };
            let y = level + self.amplitude * share * angle.sin() + unit * self.noise * draws.normal();
            if count > 0.0 {
                (y / (unit * count)).round() * unit * count
            } else {
                y
            }
        })
    }
}

/// Runs a healthy life for a while.
fn live<T: Real>(life: &Life, unit: &mut MountedUnit<T>, samples: u32, draws: &mut Draws) {
    for i in 0..samples {
        unit.push(life.reading(i, draws));
    }
}

fn is_left_alone<T: Real>(life: &Life) -> Result<(), TestCaseError> {
    let mut unit = MountedUnit::<T>::new(life.period);
    let mut draws = Draws::new(life.seed);
    let mut unused = 0;
    for i in 0..3_000 {
        let usable = unit.push(life.reading(i, &mut draws));
        unused += u32::from(usable != [true; 2]);
        prop_assert_eq!(unit.health.fault(), None, "sample {}", i);
    }
    prop_assert!(unused <= 20, "{unused}");
    prop_assert_eq!(unit.health.healthy_since(), Some(1_000_000 + life.period));
    Ok(())
}

/// Faults of readings.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ailment {
    Freezes(Sensor),
    Sticks(usize),
    Saturates(usize),
    NotANumber(usize),
    Spikes(usize),
}

fn ailment() -> impl Strategy<Value = Ailment> {
    prop_oneof![
        any::<bool>().prop_map(|sensor| Ailment::Freezes(of(sensor))),
        (0..CHANNELS).prop_map(Ailment::Sticks),
        (0..CHANNELS).prop_map(Ailment::Saturates),
        (0..CHANNELS).prop_map(Ailment::NotANumber),
        (0..CHANNELS).prop_map(Ailment::Spikes),
    ]
}

impl Ailment {
    fn spoil(&self, i: u32, y: &mut [f64; CHANNELS]) {
        match *self {
            Ailment::Freezes(sensor) => {
                let first = sensor.first_channel();
                y[first..first + 3].copy_from_slice(&[0.25, -0.5, 1.0]);
            }
            Ailment::Sticks(channel) => y[channel] = 0.25,
            Ailment::Saturates(channel) => y[channel] = if channel < 3 { -160.0 } else { 35.0 },
            Ailment::NotANumber(channel) => y[channel] = f64::NAN,
            Ailment::Spikes(channel) if i % 3 == 1 => y[channel] += if channel < 3 { -90.0 } else { 25.0 },
            Ailment::Spikes(_) => {}
        }
    }

    /// Samples within which it has to be found.
    fn limit(&self, period: u64) -> u64 {
        let settings = HealthSettings::<f64>::default();
        // Times are kept in ticks of 256 microseconds; one sample more to detect a fault and one to report it.
        let within = |time: u64, fewest: u64| (time.div_ceil(period)).max(fewest) + 2;
        match self {
            Ailment::Freezes(_) => within(settings.frozen, 17),
            Ailment::Sticks(_) => 45,
            Ailment::Saturates(_) | Ailment::NotANumber(_) => within(settings.saturated, 5),
            Ailment::Spikes(_) => 15,
        }
    }

    fn is(&self, fault: &HealthFault<impl Real>) -> bool {
        match (*self, *fault) {
            (Ailment::Freezes(sensor), HealthFault::Frozen { sensor: found, .. }) => found == sensor,
            (Ailment::Sticks(channel), HealthFault::Stuck { channel: found, .. })
            | (Ailment::Saturates(channel), HealthFault::Saturated { channel: found, .. })
            | (Ailment::NotANumber(channel), HealthFault::NotFinite { channel: found })
            | (Ailment::Spikes(channel), HealthFault::Spikes { channel: found, .. }) => {
                usize::from(found) == channel
            }
            _ => false,
        }
    }
}

fn is_found_and_forgiven<T: Real>(ailment: Ailment, period: u64, seed: u64) -> Result<(), TestCaseError> {
    let life = Life {
        period,
        noise: 0.5,
        count: 0.0,
        amplitude: 0.0,
        frequency: 0.0,
        seed,
    };
    let mut draws = Draws::new(seed);
    let mut unit = MountedUnit::<T>::new(period);
    unit.range = range(Range {
        specific_force: Some(160.0),
        angular_rate: Some(35.0),
    });
    live(&life, &mut unit, 100, &mut draws);
    let mut found = None;
    for i in 0..200 {
        let mut y = life.reading(i, &mut draws);
        ailment.spoil(i, &mut y);
        unit.push(y);
        if let (None, Some(fault)) = (found, unit.health.fault()) {
            prop_assert!(ailment.is(&fault), "{fault:?}");
            found = Some(u64::from(i));
        }
    }
    let limit = ailment.limit(period);
    prop_assert!(
        found.is_some_and(|found| found <= limit),
        "{found:?}, limit {limit} samples"
    );
    // Spikes are counted longest: twice 3.5 s.
    let longest = 7_100_000 + unit.settings.recovery;
    let needed = u32::try_from(longest / period + 2).unwrap_or(u32::MAX);
    live(&life, &mut unit, needed, &mut draws);
    prop_assert_eq!(unit.health.fault(), None);
    Ok(())
}

/// Health of a unit from one update to the next.
fn fates() -> impl Strategy<Value = Vec<(u64, [bool; 3])>> {
    prop::collection::vec(
        (1..30_000_u64, prop::array::uniform3(prop::bool::weighted(0.7))),
        1..300,
    )
}

struct Candidates {
    since: [Option<u64>; 3],
}

impl Candidates {
    fn at(&mut self, now: u64, healthy: [bool; 3]) -> [SourceCandidate<f32>; 3] {
        core::array::from_fn(|i| {
            let since = &mut self.since[i];
            *since = healthy[i].then(|| since.unwrap_or(now));
            SourceCandidate {
                healthy: healthy[i],
                condition: Condition::Silent,
                healthy_for: since.map_or(0, |since| now - since),
                calibrated: true,
                residual: 0.1,
            }
        })
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn no_bad_reading_is_used_and_a_unit_is_healthy_or_faulty(
        acts in prop::collection::vec(act(), 0..300), axes in prop::array::uniform6(prop::bool::weighted(0.8))
    ) {
        withstands::<f64>(&acts, axes)?;
        withstands::<f32>(&acts, axes)?;
    }

    #[test]
    fn faults_are_detected_in_time_named_and_cleared_when_over(
        ailment in ailment(), period in 500..16_000_u64, seed in any::<u64>()
    ) {
        is_found_and_forgiven::<f64>(ailment, period, seed)?;
        is_found_and_forgiven::<f32>(ailment, period, seed)?;
    }

    #[test]
    fn a_healthy_unit_raises_no_fault_at_any_rate_and_noise(life in life()) {
        is_left_alone::<f64>(&life)?;
        is_left_alone::<f32>(&life)?;
    }

    #[test]
    fn a_silent_unit_is_late_when_its_time_is_up_and_not_before(
        period in 500..50_000_u64, pause in 0..1_000_000_u64, seed in any::<u64>()
    ) {
        let life = Life { period, noise: 0.1, count: 0.0, amplitude: 0.0, frequency: 0.0, seed };
        let mut unit = MountedUnit::<f32>::new(period);
        live(&life, &mut unit, 100, &mut Draws::new(seed));
        unit.health.tick(unit.time + pause, &unit.settings);
        prop_assert_eq!(unit.health.fault().is_some(), pause > unit.settings.late);
        let late = unit.health.fault().is_none_or(|fault| matches!(fault, HealthFault::Late { .. }));
        prop_assert!(late);
    }

    #[test]
    fn health_comes_back_at_most_once_in_a_recovery(
        bad in prop::collection::vec(prop::bool::weighted(0.05), 2_000), period in 500..20_000_u64
    ) {
        let mut unit = MountedUnit::<f32>::new(period);
        let mut draws = Draws::new(1);
        let life = Life { period, noise: 0.1, count: 0.0, amplitude: 0.0, frequency: 0.0, seed: 1 };
        let (mut recoveries, mut ill) = (0, false);
        for (i, bad) in (0..).zip(bad) {
            let mut y = life.reading(i, &mut draws);
            if bad {
                y[4] = 1e3;
            }
            unit.push(y);
            let now_ill = unit.health.fault().is_some();
            recoveries += u64::from(ill && !now_ill);
            ill = now_ill;
        }
        prop_assert!(recoveries <= 2_000 * period / unit.settings.recovery);
    }

    #[test]
    fn a_failed_source_is_replaced_within_the_hold_and_not_oftener(
        fates in fates(), return_after in prop::option::of(25_000..200_000_u64)
    ) {
        let settings = SelectionSettings { return_after, ..SelectionSettings::default() };
        let mut selection = Selection::new();
        let mut candidates = Candidates { since: [None; 3] };
        let (mut now, mut ill_since, mut changes) = (0_u64, None, 0_u64);
        let start = fates.first().map_or(0, |(wait, _)| *wait);
        for (wait, healthy) in fates {
            now += wait;
            let before = selection.source();
            let set = candidates.at(now, healthy);
            let change = selection.update(now, &|unit| set.get(unit).copied(), &settings);
            prop_assert!(change.is_some() || selection.source() == before);
            changes += u64::from(change.is_some());
            let source = selection.source();
            let ill = source.is_some_and(|source| !healthy[source]);
            ill_since = match (ill, change) {
                (false, _) => None,
                (true, Some(_)) => Some(now),
                (true, None) => ill_since.or(Some(now)),
            };
            prop_assert!(ill_since.is_none_or(|since| now - since < settings.hold), "{source:?} since {ill_since:?}");
            prop_assert!(change.is_none() || !ill, "an ill unit was chosen");
            prop_assert!(source.is_some() || !healthy.contains(&true) || now - start < settings.hold);
        }
        prop_assert!(changes <= 2 * now / settings.hold + 2, "{changes} in {now}");
    }
}
