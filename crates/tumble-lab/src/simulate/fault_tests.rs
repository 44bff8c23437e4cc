use super::*;
use crate::simulate::stream::{Purpose, stream};

fn samples() -> Samples {
    let row = |i: usize| [i as f64, 10.0 + i as f64, -(i as f64)];
    Samples {
        time: (0..100).map(|i| i as f64 * 0.1).collect(),
        arrival: (0..100).map(|i| i as f64 * 0.1 + 0.02).collect(),
        accelerometer: (0..100).map(row).collect(),
        gyroscope: (0..100).map(row).collect(),
        temperature: vec![25.0; 100],
    }
}

fn spoiled(fault: Fault) -> Samples {
    let mut samples = samples();
    fault.spoil(&mut samples, |t| t, &mut stream(1, 0, Purpose::Faults));
    samples
}

#[test]
fn a_stuck_axis_repeats_the_reading_before_the_fault_and_leaves_the_others_alone() {
    let stuck = spoiled(Fault::Stuck {
        channels: Channels::Gyroscope,
        axis: 1,
        from: 4.95,
    });
    assert!(stuck.gyroscope[50..].iter().all(|row| row[1] == 59.0));
    assert_eq!(stuck.gyroscope[80][0], 80.0);
    assert_eq!(stuck.accelerometer, samples().accelerometer);
}

#[test]
fn a_gap_removes_its_samples_from_every_column() {
    let gap = spoiled(Fault::Gap { from: 1.95, to: 2.95 });
    assert_eq!(gap.len(), 90);
    assert_eq!(gap.accelerometer[20], [30.0, 40.0, -30.0]);
    assert_eq!(gap.temperature.len(), 90);
    assert!((gap.time[20] - gap.time[19] - 1.1).abs() < 1e-12);
}

#[test]
fn doubled_samples_have_the_same_time_twice() {
    let doubled = spoiled(Fault::Doubled { from: 0.95, to: 1.95 });
    assert_eq!(doubled.len(), 110);
    assert_eq!(doubled.time[10], doubled.time[11]);
}

#[test]
fn time_goes_backwards_once() {
    let back = spoiled(Fault::ClockJump { at: 4.95, by: -1.0 });
    assert_eq!(back.time.windows(2).filter(|pair| pair[1] < pair[0]).count(), 1);
}

#[test]
fn numbers_are_missing_only_in_their_window_and_axis() {
    let fault = Fault::NotANumber {
        channels: Channels::Accelerometer,
        axis: 2,
        from: 0.95,
        to: 1.45,
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
    assert_eq!(spoiled(Fault::Gap { from: 50.0, to: 60.0 }), samples());
    assert_eq!(spoiled(Fault::Gap { from: 5.0, to: 4.0 }), samples());
    let stuck = Fault::Stuck {
        channels: Channels::Gyroscope,
        axis: 0,
        from: 50.0,
    };
    assert_eq!(spoiled(stuck), samples());
}

#[test]
fn sign_order_unit_and_range_change_as_named() {
    assert_eq!(
        spoiled(Fault::LeftHanded { axis: 1 }).gyroscope[3],
        [3.0, -13.0, -3.0]
    );
    assert_eq!(
        spoiled(Fault::SwappedAxes { first: 0, second: 1 }).accelerometer[3],
        [13.0, 3.0, -3.0]
    );
    let unit = Fault::WrongUnit {
        channels: Channels::Gyroscope,
        factor: 2.0,
    };
    assert_eq!(spoiled(unit).gyroscope[3], [6.0, 26.0, -6.0]);
    let limit = Fault::Saturated {
        channels: Channels::Accelerometer,
        limit: 20.0,
        from: f64::NEG_INFINITY,
        to: f64::INFINITY,
    };
    assert_eq!(spoiled(limit).accelerometer[50], [20.0, 20.0, -20.0]);
}

#[test]
fn a_unit_slips_at_its_time_and_stays_there() {
    let moved = Fault::Moved {
        at: 3.0,
        axis: 2,
        angle: 0.1,
    };
    assert_eq!(moved.slip(2.9), None);
    assert!((moved.slip(3.0).unwrap().angle() - 0.1).abs() < 1e-12);
}

#[test]
fn a_frozen_unit_repeats_every_reading_before_the_fault_and_goes_on_after_it() {
    let frozen = spoiled(Fault::Frozen { from: 1.95, to: 2.95 });
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
fn spikes_strike_the_first_reading_and_some_others_of_one_axis_by_their_size() {
    let spiky = spoiled(Fault::Spikes {
        channels: Channels::Gyroscope,
        axis: 2,
        from: 1.95,
        to: 9.95,
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
    let late = spoiled(Fault::Late {
        from: 1.95,
        to: 2.95,
        by: 0.35,
    });
    let before = samples();
    assert_eq!(late.time, before.time);
    assert!((late.arrival[20] - before.arrival[20] - 0.35).abs() < 1e-12);
    assert!((late.arrival[31] - late.arrival[29]).abs() < 1e-12);
    assert_eq!(late.arrival[..20], before.arrival[..20]);
    assert_eq!(late.arrival[34..], before.arrival[34..]);
}

/// Rows of zeros at times 0, 0.1 s ..., stirred by a fault.
fn stirred(fault: Fault, of: Channels) -> Vec<[f64; 3]> {
    let mut rows = vec![[0.0; 3]; 2000];
    let mut random = stream(1, 0, Purpose::Faults);
    fault.stir(of, &mut rows, |index| index as f64 * 0.1, &mut random);
    rows
}

#[test]
fn a_bias_moves_evenly_or_at_once_and_stays_and_leaves_the_other_triad_alone() {
    let moves = |to| Fault::BiasMoves {
        channels: Channels::Accelerometer,
        axis: 1,
        from: 10.0,
        to,
        by: 0.5,
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
    let fault = Fault::Noise {
        channels: Channels::Gyroscope,
        from: 20.0,
        to: 100.0,
        sigma: 0.3,
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
