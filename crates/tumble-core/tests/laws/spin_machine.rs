//! The procedure on a device: what it waits for, what it refuses, and that nothing makes it panic.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_core::sample::Sample;
use tumble_core::spin::compensation::Compensation;
use tumble_core::spin::failure::SpinFailure;
use tumble_core::spin::machine::{SpinEvent, SpinMachine, SpinState, Wheels};
use tumble_core::spin::settings::SpinSettings;

use crate::common::{Draws, cases};
use crate::spin_stream::{Truth, narrowed};

const NOISE: (f64, f64) = (0.02, 0.002);

fn run(
    stream: &[Sample<f64>],
    settings: &SpinSettings<f32>,
    wheels: impl Fn(u64) -> Wheels,
) -> (SpinMachine<f32>, Vec<SpinEvent>) {
    let mut machine = SpinMachine::new(settings);
    machine.start();
    let events = narrowed::<f32>(stream)
        .filter_map(|sample| machine.push(&sample, wheels(sample.time)))
        .collect();
    (machine, events)
}

fn unknown(_: u64) -> Wheels {
    Wheels::Unknown
}

fn two_turns() -> Truth {
    Truth {
        turns: vec![2.0],
        still: 7.0,
        ..Truth::usual()
    }
}

fn failure(stream: &[Sample<f64>]) -> SpinFailure<f32> {
    match run(stream, &SpinSettings::default(), unknown).0.state() {
        SpinState::Failed(failure) => *failure,
        state => panic!("{state:?}"),
    }
}

#[test]
fn a_good_spin_goes_from_still_to_done_and_compensates() {
    let truth = two_turns();
    let (machine, events) = run(&truth.stream(NOISE, 3.0, 1), &SpinSettings::default(), unknown);
    assert_eq!(
        events,
        [
            SpinEvent::StillBegan,
            SpinEvent::StillDone,
            SpinEvent::SpinBegan,
            SpinEvent::Done
        ]
    );
    let estimate = machine.solve(None).unwrap();
    let compensation = Compensation::updated(&Compensation::none(), &estimate);
    let resting: Vec<_> = narrowed::<f32>(&truth.stream(NOISE, 0.0, 2)).take(500).collect();
    let mean = resting
        .iter()
        .map(|sample| compensation.apply(sample).angular_rate)
        .sum::<Vector3<f32>>()
        / 500.0;
    assert!(mean.norm() < 1e-3, "{mean:?}");
}

#[test]
fn bias_instability_given_while_it_solves_is_used() {
    let sigma = |told: SpinState<f32>| {
        let mut machine = SpinMachine::<f32>::new(&SpinSettings::default());
        machine.start();
        for sample in narrowed(&two_turns().stream(NOISE, 3.0, 1)) {
            if *machine.state() == told {
                machine.know_bias_instability(0.01, 0.001);
                break;
            }
            machine.push(&sample, Wheels::Unknown);
        }
        for _ in 0..100 {
            machine.work();
        }
        assert_eq!(*machine.state(), SpinState::Done);
        machine.solve(None).unwrap().gyroscope_bias.sigma
    };
    assert_eq!(sigma(SpinState::Solving), sigma(SpinState::Done));
}

#[test]
fn before_it_is_started_it_takes_nothing_in() {
    let mut machine = SpinMachine::<f32>::new(&SpinSettings::default());
    for sample in narrowed(&two_turns().stream(NOISE, 0.0, 1)) {
        assert_eq!(machine.push(&sample, Wheels::Unknown), None);
    }
    assert_eq!(*machine.state(), SpinState::Idle);
}

/// Events where standing still is broken once and the spin ends well.
const BROKEN_ONCE: [SpinEvent; 6] = [
    SpinEvent::StillBegan,
    SpinEvent::StillBroken,
    SpinEvent::StillBegan,
    SpinEvent::StillDone,
    SpinEvent::SpinBegan,
    SpinEvent::Done,
];

#[test]
fn moved_while_still_it_waits_anew() {
    let mut stream = Truth {
        still: 12.0,
        ..two_turns()
    }
    .stream(NOISE, 3.0, 1);
    for sample in &mut stream[300..330] {
        sample.angular_rate.x += 0.3;
        sample.specific_force.y += 1.0;
    }
    let (_, events) = run(&stream, &SpinSettings::default(), unknown);
    assert_eq!(events, BROKEN_ONCE);
}

#[test]
fn samples_missing_while_still_it_waits_anew_and_goes_on() {
    let mut stream = Truth {
        still: 12.0,
        ..two_turns()
    }
    .stream(NOISE, 3.0, 1);
    stream.drain(300..360);
    let (_, events) = run(&stream, &SpinSettings::default(), unknown);
    assert_eq!(events, BROKEN_ONCE);
}

#[test]
fn never_still_it_fails_in_time() {
    let mut draws = Draws::new(3);
    let shaken: Vec<_> = two_turns()
        .stream(NOISE, 80.0, 1)
        .into_iter()
        .map(|sample| Sample {
            specific_force: sample.specific_force
                + draws.normals::<3>()
                    * if sample.time / 1_000_000 % 2 == 0 {
                        3.0
                    } else {
                        0.0
                    },
            ..sample
        })
        .collect();
    assert!(matches!(failure(&shaken), SpinFailure::NeverStill { .. }));
}

#[test]
fn turned_less_than_asked_it_fails_in_time() {
    let stream = Truth {
        turns: vec![1.0],
        ..two_turns()
    }
    .stream(NOISE, 125.0, 1);
    let SpinFailure::TurnedTooLittle { turned, .. } = failure(&stream) else {
        panic!()
    };
    assert!((turned - core::f32::consts::TAU).abs() < 0.05, "{turned}");
}

#[test]
fn lifted_picked_up_or_turned_too_fast_for_its_samples_it_fails() {
    let good = two_turns().stream(NOISE, 0.0, 1);
    let spoilt = |change: &dyn Fn(&mut Sample<f64>)| {
        let mut stream = good.clone();
        stream[1000..1050].iter_mut().for_each(change);
        failure(&stream)
    };
    assert!(matches!(
        spoilt(&|s| s.specific_force.z += 2.0),
        SpinFailure::Lifted { .. }
    ));
    assert!(matches!(
        spoilt(&|s| s.angular_rate.x += 0.5),
        SpinFailure::NotOneAxis { .. }
    ));
    let sparse: Vec<_> = Truth {
        rate: 3.0,
        ..two_turns()
    }
    .stream(NOISE, 0.0, 1)
    .into_iter()
    .step_by(10)
    .collect();
    assert!(matches!(failure(&sparse), SpinFailure::SampleRateTooLow { .. }));
    let mut torn = good.clone();
    torn.drain(1000..1100);
    assert!(matches!(failure(&torn), SpinFailure::SamplesMissing { .. }));
}

#[test]
fn a_saturated_sensor_fails_and_a_single_spike_does_not() {
    let settings = SpinSettings {
        specific_force_range: Some(19.6),
        ..SpinSettings::default()
    };
    for (samples, fails) in [(1, false), (5, true)] {
        let mut stream = two_turns().stream(NOISE, 3.0, 1);
        stream[1000..1000 + samples]
            .iter_mut()
            .for_each(|s| s.specific_force.x = 19.61);
        let (machine, _) = run(&stream, &settings, unknown);
        let failed = matches!(
            machine.state(),
            SpinState::Failed(SpinFailure::Saturated { channel: 0, .. })
        );
        assert_eq!(failed, fails, "{:?}", machine.state());
    }
}

#[test]
fn a_floor_beyond_the_limit_fails_with_its_tilt() {
    let truth = Truth {
        floor_tilt: 12_f64.to_radians(),
        ..two_turns()
    };
    let SpinFailure::FloorTooSteep { tilt, .. } = failure(&truth.stream(NOISE, 3.0, 1)) else {
        panic!()
    };
    assert!((tilt.to_degrees() - 12.0).abs() < 0.1, "{tilt}");
}

#[test]
fn an_interrupted_stream_fails_and_keeps_the_old_compensation() {
    let mut stream = two_turns().stream(NOISE, 0.0, 1);
    stream.truncate(1200);
    let (mut machine, _) = run(&stream, &SpinSettings::default(), unknown);
    assert_eq!(machine.tick(12_100_000), None);
    assert_eq!(machine.tick(13_000_000), Some(SpinEvent::Failed));
    assert!(matches!(
        machine.state(),
        SpinState::Failed(SpinFailure::StreamStopped { .. })
    ));
    assert_eq!(machine.tick(14_000_000), None);
}

#[test]
fn a_bias_above_any_gate_and_uneven_wheels_still_calibrate() {
    for truth in [
        Truth {
            gyroscope_bias: Vector3::new(0.3, -0.2, 0.25),
            accelerometer_bias: Vector3::new(2.0, -1.0, 1.5),
            ..two_turns()
        },
        Truth {
            uneven: (0.5, 1.3),
            ..two_turns()
        },
    ] {
        let (machine, _) = run(&truth.stream(NOISE, 3.0, 4), &SpinSettings::default(), unknown);
        let found = machine.solve(None).unwrap();
        assert_eq!(*machine.state(), SpinState::Done);
        let error = found.level_free.value.map(f64::from) - truth.accelerometer_bias;
        assert!(error.norm() < 0.01, "{error:?}");
    }
}

#[test]
fn wheels_that_turn_are_no_rest_however_steady_the_robot_turns() {
    let truth = Truth {
        slow_turn: 0.02,
        floor_tilt: 0.0,
        still: 20.0,
        ..two_turns()
    };
    let stream = truth.stream(NOISE, 0.0, 1);
    let (_, fooled) = run(&stream, &SpinSettings::default(), unknown);
    assert!(fooled.contains(&SpinEvent::StillDone));
    let (machine, told) = run(&stream, &SpinSettings::default(), |_| Wheels::Turning);
    assert_eq!(told, []);
    assert_eq!(*machine.state(), SpinState::Still);
    // Vibration of a running fan is no motion where the wheels are reported as still.
    let mut draws = Draws::new(1);
    let mut shaken = two_turns().stream(NOISE, 3.0, 1);
    shaken
        .iter_mut()
        .filter(|s| s.time / 200_000 % 2 == 0)
        .for_each(|s| s.specific_force += draws.normals::<3>());
    let stopped = |time: u64| {
        if time < 6_500_000 {
            Wheels::Stopped
        } else {
            Wheels::Unknown
        }
    };
    let (_, events) = run(&shaken, &SpinSettings::default(), stopped);
    assert!(events.contains(&SpinEvent::StillDone), "{events:?}");
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn no_stream_however_hostile_makes_it_panic(
        seed in any::<u64>(), kinds in prop::collection::vec(0_u8..9, 400..1200), still in 0_u64..2_000_000
    ) {
        let settings = SpinSettings::<f32> { still, turn: 1.0, ..SpinSettings::default() };
        let mut machine = SpinMachine::new(&settings);
        machine.start();
        let mut draws = Draws::new(seed);
        let mut time = 0_u64;
        for kind in kinds {
            let scale = match kind { 0 => f32::MAX, 1 => f32::NAN, 2 => 1e-38, 3 => f32::INFINITY, 4 => 0.0, _ => 1.0 };
            time = match kind { 5 => time / 2, 6 => time.saturating_add(u64::MAX / 3), _ => time.saturating_add(10_000) };
            let draw = |draws: &mut Draws| draws.normals::<3>().map(|x| x as f32) * scale;
            let sample = Sample { time, specific_force: draw(&mut draws), angular_rate: draw(&mut draws) };
            let wheels = match kind % 3 { 0 => Wheels::Stopped, 1 => Wheels::Turning, _ => Wheels::Unknown };
            machine.push(&sample, wheels);
            // Any outcome is a number, or an error that gives its reason.
            let _ = machine.solve(None);
            machine.tick(time);
            if matches!(machine.state(), SpinState::Done | SpinState::Failed(_)) {
                machine.start();
            }
        }
    }
}
