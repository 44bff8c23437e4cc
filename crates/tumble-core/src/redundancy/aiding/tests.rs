extern crate std;

use std::vec::Vec;

use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::redundancy::draws::{Draw, sound_reading};
use crate::redundancy::isolation::attribution::Ground;
use crate::redundancy::isolation::{FaultIsolator, IsolationEvent, SetWindow, UnitReading};
use crate::redundancy::monitor::Monitor;
use crate::redundancy::monitor::event::EventKind;
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::samples::steps::UnitSteps;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::ForceAndRate;
use crate::redundancy::unit_count::{UnitCount, Units};

const SPAN: u64 = 50_000;
const H: f64 = 0.05;
const GRAVITY: f64 = 9.80665;
const SIGMA: f64 = 0.3;

/// Motion of a set that rests for 12 s and then moves, in the level frame.
fn motion(t: f64) -> (Rotation3<f64>, Vector3<f64>, Vector3<f64>) {
    let swell = ((t - 12.0) / 8.0).clamp(0.0, 1.0);
    let ease = swell * swell * (3.0 - 2.0 * swell);
    let slope = if swell > 0.0 && swell < 1.0 {
        6.0 * swell * (1.0 - swell) / 8.0
    } else {
        0.0
    };
    let (rates, sizes) = ([0.35, 0.27, 0.61], [5.0, 6.0, 1.5]);
    let wave = Vector3::from_fn(|i, _| sizes[i] * (rates[i] * t + i as f64).sin());
    let steep = Vector3::from_fn(|i, _| sizes[i] * rates[i] * (rates[i] * t + i as f64).cos());
    let (velocity, acceleration) = (wave * ease, steep * ease + wave * slope);
    let lean = |x: f64| 0.3 * ease * x;
    let attitude = Rotation3::from_euler_angles(
        lean((0.8 * t).sin()),
        lean((0.55 * t).cos()),
        0.7 + 2.0 * lean((0.2 * t).sin() + 0.1 * t),
    );
    (attitude, velocity, acceleration)
}

/// Specific force and angular rate under the triangle over two windows, the second of which ends at `t`.
fn felt(t: f64) -> [Vector3<f64>; 2] {
    let parts = 10_i32;
    let step = H / f64::from(parts);
    let (mut f, mut w, mut sum) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for k in -parts..=parts {
        let at = t - H + f64::from(k) * step;
        let weight = 1.0 - f64::from(k.abs()) / f64::from(parts);
        let (attitude, _, acceleration) = motion(at);
        let turn = motion(at - 5e-4).0.inverse() * motion(at + 5e-4).0;
        f += attitude.inverse() * (acceleration + Vector3::z() * GRAVITY) * weight;
        w += turn.scaled_axis() * (weight / 1e-3);
        sum += weight;
    }
    [f / sum, w / sum]
}

/// Finding on a set of N, with its time.
#[derive(Debug, PartialEq)]
enum Found {
    Isolated(usize, Sensor),
    OutOfFamily(usize, Sensor),
    Disagree(usize, usize),
    Lost,
    Regained,
}

/// Velocity of an aiding measurement at a time.
type Measures = fn(f64, Vector3<f64>) -> Aiding<f64>;

struct Flight<const N: usize> {
    seed: u64,
    until: f64,
    /// Errors of a unit at a time.
    fault: fn(usize, f64) -> [Vector3<f64>; 2],
    /// Velocity of the aiding measurement at a time; NaN where there is none.
    measures: Measures,
    /// Time of the simulation, s.
    latency: f64,
}

fn velocity(value: Vector3<f64>) -> Aiding<f64> {
    Aiding::Velocity {
        value,
        sigma: Vector3::repeat(SIGMA),
    }
}

fn reading(f: Vector3<f64>, w: Vector3<f64>) -> Option<UnitReading<f64>> {
    Some(sound_reading(f, w))
}

fn resting() -> [Option<UnitReading<f64>>; 2] {
    [reading(Vector3::z() * GRAVITY, Vector3::zeros()); 2]
}

fn process<const N: usize>(
    aiding_evidence: &mut Option<AidingEvidence<f64, N>>,
    time: f64,
    measured: &Aiding<f64>,
) -> Result<Option<Trust<f64>>, AidingRejection> {
    measured.check(N)?;
    aiding_evidence
        .get_or_insert_with(AidingEvidence::new)
        .take((time * 1e6) as u64, measured)
}

fn look<const N: usize>(
    isolator: &mut FaultIsolator<f64, N>,
    aiding_evidence: &mut Option<AidingEvidence<f64, N>>,
    number: u64,
    units: &[Option<UnitReading<f64>>; N],
    emit: &mut dyn FnMut(Sensor, IsolationEvent<f64>),
) where
    Units<N>: UnitCount,
{
    let window = SetWindow {
        units,
        steps: &[UnitSteps::none(); N],
        mounted: &core::array::from_fn(|unit| MountedUnit::new(unit as u64)),
        number,
        span: SPAN,
        length: H,
        gravity: GRAVITY,
        noise_ratio: 9.0,
        means_only: false,
        per_kelvin: ForceAndRate {
            specific_force: 0.0,
            angular_rate: 0.0,
        },
        tolerated: ForceAndRate {
            specific_force: 0.05,
            angular_rate: 0.0075,
        },
    };
    isolator.look(&window, aiding_evidence.as_mut(), emit);
}

impl<const N: usize> Flight<N>
where
    Units<N>: UnitCount,
{
    fn fly(&self) -> Vec<(f64, Found)> {
        let (mut isolator, mut aiding_evidence) = (FaultIsolator::<f64, N>::new(), None);
        let mut draw = Draw(self.seed);
        let mut found = Vec::new();
        // Without an aiding measurement no evidence is stored.
        for k in 1..(self.until / H) as u64 {
            let t = (k + 1) as f64 * H;
            let [f, w] = felt(t);
            let units: [Option<UnitReading<f64>>; N] = core::array::from_fn(|i| {
                let [df, dw] = (self.fault)(i, t);
                let measured = reading(f + draw.vector(0.004) + df, w + draw.vector(0.0003) + dw)?;
                Some(UnitReading {
                    at_rest: (t < 12.0).then_some([0.0; 2]),
                    ..measured
                })
            });
            look(
                &mut isolator,
                &mut aiding_evidence,
                k,
                &units,
                &mut |sensor, event| {
                    let what = match event {
                        IsolationEvent::Isolated { unit, proof } if proof.ground == Ground::Aiding => {
                            Found::Isolated(unit, sensor)
                        }
                        IsolationEvent::OutOfFamily { unit, .. } => Found::OutOfFamily(unit, sensor),
                        IsolationEvent::Disagree { units: [i, j], .. } => Found::Disagree(i, j),
                        _ => return,
                    };
                    found.push((t, what));
                },
            );
            if k % 4 == 0 {
                let at = t - self.latency;
                let measured = (self.measures)(at, motion(at).1 + draw.vector(SIGMA));
                match process(&mut aiding_evidence, at, &measured) {
                    Ok(None) | Err(_) => {}
                    Ok(Some(Trust::Lost { .. })) => found.push((t, Found::Lost)),
                    Ok(Some(Trust::Regained)) => found.push((t, Found::Regained)),
                }
            }
        }
        found
    }
}

fn sound(_: usize, _: f64) -> [Vector3<f64>; 2] {
    [Vector3::zeros(); 2]
}

/// Drift of unit 1 from 100 s on, per second.
fn ramp(unit: usize, t: f64, slope: f64) -> Vector3<f64> {
    let size = if unit == 1 {
        slope * (t - 100.0).max(0.0)
    } else {
        0.0
    };
    Vector3::new(0.6, -0.64, 0.48) * size
}

fn force_drifts(unit: usize, t: f64) -> [Vector3<f64>; 2] {
    [ramp(unit, t, 0.01), Vector3::zeros()]
}

fn rate_drifts(unit: usize, t: f64) -> [Vector3<f64>; 2] {
    [Vector3::zeros(), ramp(unit, t, 0.0015)]
}

fn truthful(_: f64, v: Vector3<f64>) -> Aiding<f64> {
    velocity(v)
}

fn flight<const N: usize>(seed: u64) -> Flight<N>
where
    Units<N>: UnitCount,
{
    Flight {
        seed,
        until: 150.0,
        fault: sound,
        measures: truthful,
        latency: 0.15,
    }
}

fn blamed(found: &[(f64, Found)]) -> Vec<(usize, Sensor)> {
    let each = found.iter().filter_map(|(_, found)| match found {
        Found::Isolated(unit, sensor) | Found::OutOfFamily(unit, sensor) => Some((*unit, *sensor)),
        _ => None,
    });
    each.collect()
}

#[test]
fn an_aiding_isolates_the_drifting_accelerometer_of_two() {
    for seed in 0..4 {
        let found = Flight::<2> {
            fault: force_drifts,
            ..flight(seed)
        }
        .fly();
        assert_eq!(
            blamed(&found).first(),
            Some(&(1, Sensor::Accelerometer)),
            "seed {seed}: {found:?}"
        );
    }
}

#[test]
fn a_velocity_isolates_no_sound_gyroscope() {
    for seed in 0..4 {
        let found = Flight::<2> {
            fault: rate_drifts,
            ..flight(seed)
        }
        .fly();
        let of_sound = |found: &(f64, Found)| matches!(found, (_, Found::Isolated(0, _)));
        assert!(!found.iter().any(of_sound), "seed {seed}: {found:?}");
    }
}

#[test]
fn wheels_isolate_the_drifting_one_of_two() {
    for seed in 0..4 {
        let found = Flight::<2> {
            fault: force_drifts,
            measures: |t, v| {
                let (attitude, ..) = motion(t);
                Aiding::BodyVelocity {
                    value: attitude.inverse() * v,
                    sigma: Vector3::repeat(SIGMA),
                }
            },
            ..flight(seed)
        }
        .fly();
        let first = blamed(&found).first().copied();
        assert_eq!(first, Some((1, Sensor::Accelerometer)), "seed {seed}: {found:?}");
    }
}

#[test]
fn a_climb_rate_isolates_the_unit_drifting_vertically() {
    for seed in 0..4 {
        let found = Flight::<2> {
            fault: |unit, t| [Vector3::z() * ramp(unit, t, 0.02).norm(), Vector3::zeros()],
            measures: |_, v| Aiding::Velocity {
                value: Vector3::new(f64::NAN, f64::NAN, v.z),
                sigma: Vector3::new(f64::INFINITY, f64::INFINITY, SIGMA),
            },
            ..flight(seed)
        }
        .fly();
        let first = blamed(&found).first().copied();
        assert_eq!(first, Some((1, Sensor::Accelerometer)), "seed {seed}: {found:?}");
    }
}

#[test]
fn scores_isolate_the_unit_whose_estimator_disagrees() {
    for seed in 0..4 {
        let found = Flight::<2> {
            fault: force_drifts,
            measures: |t, _| Aiding::Score {
                unit: 1,
                value: if t > 110.0 { 6.0 } else { 1.0 },
            },
            ..flight(seed)
        }
        .fly();
        let first = blamed(&found).first().copied();
        assert_eq!(first, Some((1, Sensor::Accelerometer)), "seed {seed}: {found:?}");
    }
}

const HEADING_SIGMA: f64 = 0.05;

/// Heading of the primary, with noise like that of a velocity, plus an error.
fn heading(t: f64, v: Vector3<f64>, beyond: f64) -> Aiding<f64> {
    let ahead = motion(t).0 * Vector3::x();
    let noise = (v - motion(t).1).x / SIGMA * HEADING_SIGMA;
    Aiding::Heading {
        // The reference direction is arbitrary.
        value: ahead.y.atan2(ahead.x) + 2.5 + noise + beyond,
        sigma: HEADING_SIGMA,
    }
}

/// Drift of a gyroscope about the vertical, which neither rest nor gravity shows in motion.
fn yaw_drifts(unit: usize, t: f64) -> [Vector3<f64>; 2] {
    let size = if unit == 1 {
        0.0015 * (t - 100.0).max(0.0)
    } else {
        0.0
    };
    [Vector3::zeros(), motion(t).0.inverse() * Vector3::z() * size]
}

#[test]
fn a_heading_isolates_the_gyroscope_drifting_about_the_vertical() {
    for seed in 0..8 {
        let flown = |measures: Measures| {
            Flight::<2> {
                fault: yaw_drifts,
                measures,
                ..flight(seed)
            }
            .fly()
        };
        let (with, without) = (flown(|t, v| heading(t, v, 0.0)), flown(truthful));
        assert_eq!(
            blamed(&with).first(),
            Some(&(1, Sensor::Gyroscope)),
            "seed {seed}: {with:?}"
        );
        let of_sound = |(unit, _): &(usize, Sensor)| *unit == 0;
        assert!(!blamed(&without).iter().any(of_sound), "seed {seed}: {without:?}");
    }
}

#[test]
fn a_heading_that_is_disturbed_excludes_no_sound_unit() {
    // Iron that passes, iron that comes ever nearer, and a needle that sticks; alone and beside a different
    // fault.
    let disturbances: [Measures; 3] = [
        |t, v| heading(t, v, if t > 90.0 && t % 20.0 < 6.0 { 0.6 } else { 0.0 }),
        |t, v| heading(t, v, if t > 100.0 { -0.02 * (t - 100.0) } else { 0.0 }),
        |t, v| heading(t.min(95.0), v - motion(t).1 + motion(t.min(95.0)).1, 0.0),
    ];
    for seed in 0..4 {
        for (number, measures) in disturbances.into_iter().enumerate() {
            let alone = Flight::<2> {
                measures,
                ..flight(seed)
            }
            .fly();
            assert_eq!(blamed(&alone), [], "seed {seed}, disturbance {number}: {alone:?}");
            let beside = Flight::<2> {
                measures,
                fault: yaw_drifts,
                ..flight(seed)
            }
            .fly();
            let wrong = blamed(&beside).contains(&(0, Sensor::Gyroscope));
            assert!(!wrong, "seed {seed}, disturbance {number}: {beside:?}");
        }
    }
}

/// Faults of an aiding measurement from 60 s on, and the expectation that no unit fits it for long.
const LIES: [(Measures, bool); 6] = [
    // The velocity drifts away, fast and slowly.
    (
        |t, v| velocity(v + Vector3::new(0.7, 0.5, 0.2) * (0.3 * (t - 60.0).max(0.0))),
        false,
    ),
    (
        |t, v| velocity(v + Vector3::new(0.7, 0.5, 0.2) * (0.02 * (t - 60.0).max(0.0))),
        false,
    ),
    // The velocity repeats for ever.
    (
        |t, v| velocity(if t < 60.0 { v } else { Vector3::new(1.0, 2.0, 0.3) }),
        true,
    ),
    // Reflections are single and lasting.
    (
        |t, v| velocity(v + Vector3::new(4.0, 3.0, 0.0) * f64::from(t > 60.0 && t % 1.0 < 0.3)),
        false,
    ),
    (
        |t, v| velocity(v + Vector3::new(4.0, 3.0, 0.0) * f64::from(t > 60.0 && t % 20.0 < 8.0)),
        true,
    ),
    // The error is ten times the stated sigma.
    (|t, v| velocity(v + (v - motion(t).1) * 9.0), false),
];

#[test]
fn an_aiding_that_lies_excludes_no_sound_unit() {
    for seed in 0..2 {
        for (number, (measures, contradicts_all)) in LIES.into_iter().enumerate() {
            let two = Flight::<2> {
                measures,
                ..flight(seed)
            }
            .fly();
            let three = Flight::<3> {
                measures,
                ..flight(seed)
            }
            .fly();
            for found in [two, three] {
                assert_eq!(blamed(&found), [], "seed {seed}, lie {number}: {found:?}");
                let lost = found.iter().any(|(_, found)| *found == Found::Lost);
                assert!(lost || !contradicts_all, "seed {seed}, lie {number}");
            }
        }
    }
}

/// Unit that is blamed first beside an aiding measurement that is wrong for a while, of four seeds and both kinds of drift.
fn blamed_beside(measures: Measures) -> Vec<Option<usize>> {
    let drifts = [force_drifts, rate_drifts].into_iter();
    let flown = drifts.flat_map(|fault| {
        (0..4).map(move |seed| {
            let found = Flight::<2> {
                fault,
                measures,
                ..flight(seed)
            }
            .fly();
            blamed(&found).first().map(|(unit, _)| *unit)
        })
    });
    flown.collect()
}

#[test]
fn a_glitch_as_a_fault_begins_names_no_sound_unit() {
    let found = blamed_beside(|t, v| {
        velocity(v + Vector3::new(4.0, 3.0, 0.0) * f64::from((100.0..103.0).contains(&t)))
    });
    assert!(found.iter().all(|unit| *unit == Some(1)), "{found:?}");
}

#[test]
fn a_glitch_against_a_drift_seldom_names_the_sound_unit() {
    // For as long as units drift apart, by four sigmas, and along the drift: the worst there is.
    let found = blamed_beside(|t, v| {
        velocity(v - Vector3::new(1.2, -1.3, 1.0) * f64::from((103.0..108.0).contains(&t)))
    });
    let wrong = found.iter().filter(|unit| **unit == Some(0)).count();
    assert!(wrong <= 2, "{found:?}");
}

#[test]
fn a_faulty_aiding_is_trusted_again_once_it_fits() {
    let found = Flight::<2> {
        measures: |t, v| velocity(if (60.0..70.0).contains(&t) { v * -1.0 } else { v }),
        ..flight(1)
    }
    .fly();
    let trust: Vec<_> = found.iter().map(|(_, found)| found).collect();
    assert!(
        matches!(trust[..], [Found::Lost, .., Found::Regained]),
        "{found:?}"
    );
}

#[test]
fn an_aiding_that_comes_seconds_late_or_early_is_left_out() {
    let flown = |latency: f64| {
        let mut rejections = Vec::new();
        let (mut isolator, mut aiding_evidence) = (FaultIsolator::<f64, 2>::new(), None);
        for k in 1..400 {
            let t = (k + 1) as f64 * H;
            look(&mut isolator, &mut aiding_evidence, k, &resting(), &mut |_, _| {});
            let at = (t - latency).max(0.0);
            if let Err(why) = process(&mut aiding_evidence, at, &velocity(Vector3::zeros())) {
                rejections.push(why);
            }
        }
        rejections
    };
    assert_eq!(flown(0.9), []);
    assert!(flown(3.0).len() > 300 && flown(3.0).iter().all(|why| *why == AidingRejection::Late));
    assert!(flown(-0.5).len() > 300 && flown(-0.5).iter().all(|why| *why == AidingRejection::Early));
}

#[test]
fn what_an_aiding_cannot_mean_is_left_out() {
    let zero = Vector3::zeros();
    let of = |value, sigma| Aiding::Velocity { value, sigma }.check(2);
    let sigma = Vector3::repeat(SIGMA);
    assert_eq!(of(zero, sigma), Ok(()));
    for axis in 0..3 {
        let with = |mut v: Vector3<f64>, x: f64| {
            v[axis] = x;
            v
        };
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(of(with(zero, x), sigma), Err(AidingRejection::NotFinite));
            assert_eq!(of(with(zero, x), with(sigma, f64::INFINITY)), Ok(()));
        }
        assert_eq!(of(zero, with(sigma, f64::NAN)), Err(AidingRejection::NotFinite));
        for x in [0.0, -0.3] {
            assert_eq!(of(zero, with(sigma, x)), Err(AidingRejection::NoSigma));
        }
    }
    assert_eq!(
        of(zero, Vector3::repeat(f64::INFINITY)),
        Err(AidingRejection::NoSigma)
    );
    let heading = |value, sigma| Aiding::Heading { value, sigma }.check(2);
    assert_eq!(heading(7.0, 0.1), Ok(()));
    assert_eq!(heading(f64::NAN, 0.1), Err(AidingRejection::NotFinite));
    assert_eq!(heading(0.0, 0.0), Err(AidingRejection::NoSigma));
    assert_eq!(heading(0.0, f64::INFINITY), Err(AidingRejection::NoSigma));
    let score = |unit, value| Aiding::Score { unit, value }.check(2);
    assert_eq!(score(1, 0.0), Ok(()));
    assert_eq!(score(2, 1.0), Err(AidingRejection::NoSuchUnit));
    assert_eq!(score(0, f64::NAN), Err(AidingRejection::NotFinite));
    assert_eq!(score(0, -0.1), Err(AidingRejection::NegativeScore));
}

#[test]
fn rejected_aidings_are_counted_and_reported_once() {
    let mut monitor = Monitor::<f64, 2, 1, 1>::new();
    let mut reported = Vec::new();
    for time in 0..10 {
        for value in [Vector3::repeat(f64::NAN), Vector3::zeros()] {
            monitor.aiding(time * 200_000, &velocity(value), &mut |event| {
                reported.push(event.kind)
            });
        }
    }
    let why = AidingRejection::NotFinite;
    assert_eq!(reported, [EventKind::AidingLeftOut { why }]);
    assert_eq!(monitor.aiding_measurements_left_out(), 10);
}
