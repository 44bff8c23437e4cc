use super::*;
use crate::simulate::stream::{StreamPurpose, stream};

fn samples() -> RecordedSamples {
    let row = |i: usize| [i as f64, 10.0 + i as f64, -(i as f64)];
    RecordedSamples {
        time: (0..100).map(|i| i as f64 * 0.1).collect(),
        arrival: (0..100).map(|i| i as f64 * 0.1 + 0.02).collect(),
        accelerometer: (0..100).map(row).collect(),
        gyroscope: (0..100).map(row).collect(),
        temperature: vec![25.0; 100],
    }
}

fn spoiled(fault: InjectedFault) -> RecordedSamples {
    let mut samples = samples();
    fault.spoil(&mut samples, |t| t, &mut stream(1, 0, StreamPurpose::Faults));
    samples
}

#[test]
fn a_stuck_axis_repeats_its_reading_and_spares_the_others() {
    let stuck = spoiled(InjectedFault::Stuck {
        channels: Channels::Gyroscope,
        axis: 1,
        start: 4.95,
    });
    assert!(stuck.gyroscope[50..].iter().all(|row| row[1] == 59.0));
    assert_eq!(stuck.gyroscope[80][0], 80.0);
    assert_eq!(stuck.accelerometer, samples().accelerometer);
}

#[test]
fn a_gap_removes_its_samples_from_every_column() {
    let gap = spoiled(InjectedFault::Gap {
        start: 1.95,
        end: 2.95,
    });
    assert_eq!(gap.len(), 90);
    assert_eq!(gap.accelerometer[20], [30.0, 40.0, -30.0]);
    assert_eq!(gap.temperature.len(), 90);
    assert!((gap.time[20] - gap.time[19] - 1.1).abs() < 1e-12);
}

#[test]
fn doubled_samples_have_the_same_time_twice() {
    let doubled = spoiled(InjectedFault::Doubled {
        start: 0.95,
        end: 1.95,
    });
    assert_eq!(doubled.len(), 110);
    assert_eq!(doubled.time[10], doubled.time[11]);
}

#[test]
fn time_goes_backwards_once() {
    let back = spoiled(InjectedFault::ClockJump {
        start: 4.95,
        size: -1.0,
    });
    assert_eq!(back.time.windows(2).filter(|pair| pair[1] < pair[0]).count(), 1);
}

#[test]
fn numbers_are_missing_only_in_their_window_and_axis() {
    let fault = InjectedFault::Nan {
        channels: Channels::Accelerometer,
        axis: 2,
        start: 0.95,
        end: 1.45,
    };
    let missing = spoiled(fault);
    assert_eq!(
        missing
            .accelerometer
            .iter()
            .flatten()
            .filter(|v| v.is_nan())
            .count(),
        5
    );
    assert!(missing.accelerometer[10][2].is_nan() && missing.accelerometer[14][2].is_nan());
}

#[test]
fn a_window_outside_the_recording_spoils_nothing() {
    assert_eq!(
        spoiled(InjectedFault::Gap {
            start: 50.0,
            end: 60.0
        }),
        samples()
    );
    assert_eq!(spoiled(InjectedFault::Gap { start: 5.0, end: 4.0 }), samples());
    let stuck = InjectedFault::Stuck {
        channels: Channels::Gyroscope,
        axis: 0,
        start: 50.0,
    };
    assert_eq!(spoiled(stuck), samples());
}

#[test]
fn sign_order_unit_and_range_change_as_named() {
    assert_eq!(
        spoiled(InjectedFault::LeftHanded { axis: 1 }).gyroscope[3],
        [3.0, -13.0, -3.0]
    );
    assert_eq!(
        spoiled(InjectedFault::SwappedAxes {
            axis: 0,
            other_axis: 1
        })
        .accelerometer[3],
        [13.0, 3.0, -3.0]
    );
    let unit = InjectedFault::WrongUnit {
        channels: Channels::Gyroscope,
        size: 2.0,
    };
    assert_eq!(spoiled(unit).gyroscope[3], [6.0, 26.0, -6.0]);
    let limit = InjectedFault::Saturated {
        channels: Channels::Accelerometer,
        size: 20.0,
        start: f64::NEG_INFINITY,
        end: f64::INFINITY,
    };
    assert_eq!(spoiled(limit).accelerometer[50], [20.0, 20.0, -20.0]);
}

#[test]
fn a_unit_slips_at_its_time_and_stays_there() {
    let moved = InjectedFault::Moved {
        start: 3.0,
        axis: 2,
        size: 0.1,
    };
    assert_eq!(moved.slip(2.9), None);
    assert!((moved.slip(3.0).unwrap().angle() - 0.1).abs() < 1e-12);
}

#[test]
fn a_frozen_unit_repeats_all_readings_until_the_fault_ends() {
    let frozen = spoiled(InjectedFault::Frozen {
        start: 1.95,
        end: 2.95,
    });
    let before = samples();
    for (rows, whole) in [
        (&frozen.accelerometer, &before.accelerometer),
        (&frozen.gyroscope, &before.gyroscope),
    ] {
        assert!(rows[20..30].iter().all(|row| *row == whole[19]));
        assert_eq!(rows[..20], whole[..20]);
        assert_eq!(rows[30..], whole[30..]);
    }
    assert_eq!(frozen.time, before.time);
}

#[test]
fn spikes_strike_the_first_and_some_other_readings_of_one_axis() {
    let spiky = spoiled(InjectedFault::Spikes {
        channels: Channels::Gyroscope,
        axis: 2,
        start: 1.95,
        end: 9.95,
        size: 300.0,
    });
    let before = samples();
    let struck: Vec<usize> = (0..100)
        .filter(|&i| spiky.gyroscope[i] != before.gyroscope[i])
        .collect();
    assert_eq!(struck[0], 20);
    assert!((2..20).contains(&struck.len()), "{struck:?}");
    for i in struck {
        assert_eq!((spiky.gyroscope[i][2] - before.gyroscope[i][2]).abs(), 300.0);
        assert_eq!(spiky.gyroscope[i][..2], before.gyroscope[i][..2]);
    }
    assert_eq!(spiky.accelerometer, before.accelerometer);
}

#[test]
fn late_samples_keep_their_times_and_those_after_them_wait() {
    let late = spoiled(InjectedFault::Late {
        start: 1.95,
        end: 2.95,
        size: 0.35,
    });
    let before = samples();
    assert_eq!(late.time, before.time);
    assert!((late.arrival[20] - before.arrival[20] - 0.35).abs() < 1e-12);
    assert!((late.arrival[31] - late.arrival[29]).abs() < 1e-12);
    assert_eq!(late.arrival[..20], before.arrival[..20]);
    assert_eq!(late.arrival[34..], before.arrival[34..]);
}

/// Rows of zeros at times 0, 0.1 s ..., stirred by a fault.
fn stirred(fault: InjectedFault, of: Channels) -> Vec<[f64; 3]> {
    let mut rows = vec![[0.0; 3]; 2000];
    let mut random = stream(1, 0, StreamPurpose::Faults);
    fault.disturb(of, &mut rows, |index| index as f64 * 0.1, &mut random);
    rows
}

#[test]
fn a_bias_ramps_or_steps_and_stays_and_spares_the_other_triad() {
    let moves = |to| InjectedFault::Bias {
        channels: Channels::Accelerometer,
        axis: 1,
        start: 10.0,
        end: to,
        size: 0.5,
    };
    let drifted = stirred(moves(20.0), Channels::Accelerometer);
    assert_eq!(drifted[99], [0.0; 3]);
    assert!((drifted[150][1] - 0.25).abs() < 1e-12);
    assert!(drifted[200..].iter().all(|row| *row == [0.0, 0.5, 0.0]));
    let jumped = stirred(moves(10.0), Channels::Accelerometer);
    assert_eq!((jumped[99][1], jumped[101][1]), (0.0, 0.5));
    assert_eq!(stirred(moves(20.0), Channels::Gyroscope), vec![[0.0; 3]; 2000]);
}

#[test]
fn noise_grows_to_its_scatter_and_stays() {
    let fault = InjectedFault::Noise {
        channels: Channels::Gyroscope,
        start: 20.0,
        end: 100.0,
        size: 0.3,
    };
    let rows = stirred(fault, Channels::Gyroscope);
    assert!(rows[..200].iter().all(|row| *row == [0.0; 3]));
    let scatter = |rows: &[[f64; 3]]| {
        let sum: f64 = rows.iter().flatten().map(|value| value * value).sum();
        (sum / (3 * rows.len()) as f64).sqrt()
    };
    assert!((scatter(&rows[1000..]) / 0.3 - 1.0).abs() < 4.0 / 6000.0_f64.sqrt());
    assert!(scatter(&rows[200..600]) < 0.1);
}
