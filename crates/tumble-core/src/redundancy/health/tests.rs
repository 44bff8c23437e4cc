extern crate std;

use std::vec::Vec;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Dxsm;

use super::*;
use crate::redundancy::leaky;
use crate::redundancy::settings::RedundancySettings;
use crate::redundancy::settings::validate::SettingError;

const PERIOD: u64 = 5_000;
const RANGE: Range<f32> = Range {
    specific_force: Some(160.0),
    angular_rate: Some(35.0),
};

/// A unit at rest that sends samples with noise.
struct Bench {
    health: Health<f32>,
    settings: HealthSettings<f32>,
    axes: Axes,
    draws: Pcg64Dxsm,
    time: u64,
}

impl Bench {
    fn new() -> Self {
        Self {
            health: Health::new(),
            settings: HealthSettings::default(),
            axes: Axes::ALL,
            draws: Pcg64Dxsm::seed_from_u64(1),
            time: 1_000_000,
        }
    }

    /// Unit that has been healthy for a second.
    fn running() -> Self {
        let mut bench = Self::new();
        bench.run(200, |_, _| {});
        assert_eq!(bench.health.healthy_since(), Some(1_000_000 + PERIOD));
        bench
    }

    fn noise(&mut self) -> f32 {
        self.draws.sample(StandardNormal)
    }

    fn push(&mut self, corrupt: impl Fn(&mut Sample<f32>)) -> Usable {
        self.time += PERIOD;
        let force = Vector3::from_fn(|_, _| 0.02 * self.noise());
        let rate = Vector3::from_fn(|_, _| 0.002 * self.noise());
        let mut sample = Sample {
            time: self.time,
            specific_force: Vector3::new(0.0, 0.0, 9.81) + force,
            angular_rate: rate,
        };
        corrupt(&mut sample);
        self.axes.blank(&mut sample);
        self.health.push(&sample, &self.axes, &RANGE, &self.settings)
    }

    fn run(&mut self, samples: usize, corrupt: impl Fn(usize, &mut Sample<f32>)) -> Vec<Usable> {
        (0..samples)
            .map(|i| self.push(|sample| corrupt(i, sample)))
            .collect()
    }

    /// Seconds until a fault is found.
    fn time_to_fault(&mut self, corrupt: impl Fn(usize, &mut Sample<f32>)) -> f32 {
        let start = self.time;
        for i in 0..2_000 {
            self.push(|sample| corrupt(i, sample));
            if self.health.fault().is_some() {
                return seconds(self.time - start);
            }
        }
        f32::INFINITY
    }
}

fn left_at_once(time: f32, limit: f32) -> bool {
    let period: f32 = seconds(PERIOD);
    time <= limit + 2.0 * period && time > 0.3 * limit
}

#[test]
fn a_unit_without_a_first_sample_becomes_late() {
    let mut health = Health::<f32>::new();
    let settings = HealthSettings::default();
    health.tick(7_000_000, &settings);
    assert_eq!((health.fault(), health.healthy_since()), (None, None));
    // The unit may be a slow one.
    health.tick(7_300_000, &settings);
    assert_eq!(health.fault(), None);
    health.tick(7_300_001, &settings);
    assert!(matches!(health.fault(), Some(HealthFault::Late { pause }) if pause > 0.3));
}

#[test]
fn a_unit_after_a_pause_is_healthy_again_after_the_recovery() {
    let mut bench = Bench::running();
    let paused = bench.time;
    bench.health.tick(paused + 100_000, &bench.settings.clone());
    assert_eq!(bench.health.fault(), None);
    bench.health.tick(paused + 130_000, &bench.settings.clone());
    assert_eq!(bench.health.fault(), Some(HealthFault::Late { pause: 0.13 }));
    bench.time += 150_000;
    bench.run(90, |_, _| {});
    assert!(bench.health.fault().is_some());
    bench.run(20, |_, _| {});
    let since = bench.health.healthy_since().unwrap();
    assert!(since > paused + 600_000 && since < paused + 700_000);
}

#[test]
fn a_pause_shows_in_the_samples_without_a_tick() {
    let mut bench = Bench::running();
    bench.time += 200_000;
    bench.push(|_| {});
    assert!(matches!(bench.health.fault(), Some(HealthFault::Late { .. })));
}

#[test]
fn after_a_pause_a_reading_may_be_anywhere() {
    let mut bench = Bench::running();
    bench.time += 200_000;
    assert_eq!(bench.push(|sample| sample.specific_force.x = 90.0), [true; 2]);
    bench.health.restart_time(5_000_000);
    bench.time = 5_000_000;
    assert_eq!(bench.push(|sample| sample.specific_force.x = -90.0), [true; 2]);
}

#[test]
fn a_frozen_sensor_is_found_in_time_and_excluded() {
    for sensor in SENSORS {
        let mut bench = Bench::running();
        let freeze = |_: usize, sample: &mut Sample<f32>| match sensor {
            Sensor::Accelerometer => sample.specific_force = Vector3::new(0.1, 0.2, 9.7),
            Sensor::Gyroscope => sample.angular_rate = Vector3::zeros(),
        };
        let found = bench.time_to_fault(freeze);
        assert!(left_at_once(found, 0.1), "{sensor:?} {found}");
        assert!(matches!(
            bench.health.fault(),
            Some(HealthFault::Frozen { sensor: found, duration }) if found == sensor && duration > 0.09
        ));
        let usable = bench.run(1, freeze)[0];
        assert_eq!(usable, SENSORS.map(|other| other != sensor));
        bench.run(200, |_, _| {});
        assert_eq!(bench.health.fault(), None);
    }
}

#[test]
fn an_axis_that_is_stuck_while_the_others_move_is_found() {
    let mut bench = Bench::running();
    let shake = |i: usize, sample: &mut Sample<f32>| {
        sample.specific_force.z += if i.is_multiple_of(2) { 0.5 } else { -0.5 };
        sample.specific_force.y = 0.25;
    };
    let found = bench.time_to_fault(shake);
    assert!(found < 0.2, "{found}");
    assert_eq!(
        bench.health.fault(),
        Some(HealthFault::Stuck {
            channel: 1,
            value: 0.25
        })
    );
}

#[test]
fn axes_that_repeat_at_rest_because_they_are_coarse_are_healthy() {
    let mut bench = Bench::running();
    bench.run(20_000, |_, sample| {
        sample.specific_force = sample.specific_force.map(|x| (x / 0.04).round() * 0.04);
        sample.specific_force.x = 0.0;
        sample.specific_force.y = 0.08;
        sample.angular_rate = sample.angular_rate.map(|x| (x / 0.002).round() * 0.002);
        sample.angular_rate.z = 0.002;
    });
    assert_eq!(bench.health.fault(), None);
    assert!(bench.health.healthy_since().unwrap() < 1_100_000);
}

/// Readings quantised to steps of a multiple of the noise.
fn coarse(sample: &mut Sample<f32>, counts: f32) {
    let round = |x: f32, step: f32| (x / step).round() * step;
    sample.specific_force = sample.specific_force.map(|x| round(x, 0.02 * counts));
    sample.angular_rate = sample.angular_rate.map(|x| round(x, 0.002 * counts));
}

#[test]
fn a_unit_whose_noise_is_below_a_count_is_not_frozen_at_rest() {
    for counts in [2.0, 3.0, 5.0, 10.0, 40.0] {
        let mut bench = Bench::new();
        let moves = |i: usize, sample: &mut Sample<f32>| {
            let motion = (i as f32 * 0.05).sin();
            sample.specific_force += Vector3::new(1.0, -2.0, 3.0) * motion;
            sample.angular_rate += Vector3::new(0.5, 0.3, -0.4) * motion;
            coarse(sample, counts);
        };
        for _ in 0..4 {
            bench.health.set_surroundings(Surroundings::Motion, 0);
            bench.run(377, moves);
            // Another unit shows it, or this one itself.
            bench.health.set_surroundings(Surroundings::Rest, 0);
            bench.run(8_000, |_, sample| coarse(sample, counts));
        }
        assert_eq!(bench.health.fault(), None, "{counts}");
        assert!(bench.health.healthy_since().unwrap() < 1_100_000, "{counts}");
    }
}

#[test]
fn readings_that_always_repeated_at_rest_are_not_frozen() {
    for counts in [2.0, 3.0] {
        let mut bench = Bench::new();
        bench.run(60_000, |_, sample| coarse(sample, counts));
        assert_eq!(bench.health.fault(), None, "{counts}");
    }
}

#[test]
fn a_unit_that_never_changed_is_frozen_unless_others_rest() {
    let freeze = |_: usize, sample: &mut Sample<f32>| {
        sample.specific_force = Vector3::new(0.01, 0.02, 9.8);
        sample.angular_rate = Vector3::new(0.001, 0.002, 0.003);
    };
    let mut bench = Bench::new();
    bench.health.set_surroundings(Surroundings::Rest, 0);
    bench.run(1_000, freeze);
    assert_eq!(bench.health.fault(), None);
    let mut bench = Bench::new();
    let found = bench.time_to_fault(freeze);
    assert!(found < 1.0, "{found}");
    assert!(matches!(bench.health.fault(), Some(HealthFault::Frozen { .. })));
}

#[test]
fn a_unit_that_freezes_at_rest_is_found_once_others_move() {
    let mut bench = Bench::running();
    let freeze = |_: usize, sample: &mut Sample<f32>| {
        sample.specific_force = Vector3::new(0.01, 0.02, 9.8);
        sample.angular_rate = Vector3::new(0.001, 0.002, 0.003);
    };
    bench.health.set_surroundings(Surroundings::Rest, 0);
    bench.run(400, freeze);
    assert_eq!(bench.health.fault(), None);
    bench.health.set_surroundings(Surroundings::Motion, 0);
    let found = bench.time_to_fault(freeze);
    assert!(left_at_once(found, 0.1), "{found}");
    assert!(matches!(bench.health.fault(), Some(HealthFault::Frozen { .. })));
}

#[test]
fn repetition_at_the_largest_reading_ends_the_range() {
    for (stated, end) in [(Some(35.0), 34.85_f32), (Some(35.0), 17.4), (None, 8.7)] {
        let mut bench = Bench::running();
        let range = Range {
            angular_rate: stated,
            ..RANGE
        };
        let turn = |i: usize, sample: &mut Sample<f32>| {
            let rate = 1.3 * end * (i as f32 * 0.02).sin();
            sample.angular_rate.z = (sample.angular_rate.z + rate).clamp(-end, end);
        };
        let mut unused = 0;
        for i in 0..2_000 {
            bench.time += PERIOD;
            let mut sample = Sample {
                time: bench.time,
                specific_force: Vector3::from_fn(|_, _| 0.02 * bench.noise()),
                angular_rate: Vector3::from_fn(|_, _| 0.002 * bench.noise()),
            };
            turn(i, &mut sample);
            let usable = bench.health.push(&sample, &Axes::ALL, &range, &bench.settings);
            let at_end = sample.angular_rate.z.abs() >= 0.9995 * end;
            unused += u32::from(usable == [true, false]);
            assert!(usable == [true, !at_end] || i < 200, "{i}: {usable:?}");
        }
        let fault = bench.health.fault();
        assert!(
            matches!(fault, Some(HealthFault::Saturated { channel: 5, .. })),
            "{stated:?} {end} {unused}: {fault:?}"
        );
    }
}

#[test]
fn a_reading_larger_than_any_before_extends_the_range() {
    let mut bench = Bench::running();
    bench.run(20, |_, sample| sample.angular_rate.z = 17.0);
    bench.run(20, |i, sample| sample.angular_rate.z = 18.0 + 0.1 * i as f32);
    let usable = bench.run(200, |_, sample| sample.angular_rate.z += 16.999);
    assert_eq!(usable[199], [true; 2]);
    assert_eq!(bench.health.fault(), None);
}

#[test]
fn gravity_along_a_coarse_axis_is_no_end_of_the_range() {
    let mut bench = Bench::new();
    bench.run(4_000, |i, sample| {
        sample.specific_force.x += 5.0 * (i as f32 * 0.05).sin();
        sample.specific_force = sample.specific_force.map(|x| (x / 0.15).round() * 0.15);
    });
    assert_eq!(bench.health.fault(), None);
}

/// Every second sample repeats the one before.
fn doubled(bench: &mut Bench, samples: usize) {
    held(bench, samples, 2);
}

/// Each reading comes so many times.
fn held(bench: &mut Bench, samples: usize, times: usize) {
    let mut before = None;
    for i in 0..samples {
        bench.time += PERIOD;
        let fresh = Sample {
            time: bench.time,
            specific_force: Vector3::new(0.0, 0.0, 9.81) + Vector3::from_fn(|_, _| 0.02 * bench.noise()),
            angular_rate: Vector3::from_fn(|_, _| 0.002 * bench.noise()),
        };
        let measured = before.filter(|_| i % times != 0).unwrap_or(fresh);
        before = Some(measured);
        let sample = Sample {
            time: bench.time,
            ..measured
        };
        let usable = bench.health.push(&sample, &Axes::ALL, &RANGE, &bench.settings);
        assert_eq!(usable, [true; 2]);
        assert!(bench.health.is_live());
    }
}

#[test]
fn a_unit_is_faulty_while_it_sends_each_reading_twice() {
    let mut bench = Bench::running();
    doubled(&mut bench, 50);
    assert_eq!(bench.health.fault(), None);
    doubled(&mut bench, 30);
    assert_eq!(bench.health.fault(), Some(HealthFault::Duplicated));
    bench.run(300, |_, _| {});
    assert_eq!(bench.health.fault(), None);
}

#[test]
fn a_unit_that_repeats_each_reading_for_a_while_is_faulty() {
    for times in [2, 3, 5, 8] {
        let mut bench = Bench::running();
        held(&mut bench, 64 + times, times);
        assert_eq!(
            bench.health.fault(),
            Some(HealthFault::Duplicated),
            "{times} times"
        );
        bench.run(300, |_, _| {});
        assert_eq!(bench.health.fault(), None);
    }
}

#[test]
fn a_unit_that_stalls_now_and_then_is_healthy() {
    let mut bench = Bench::running();
    for _ in 0..20 {
        held(&mut bench, 8, 8);
        bench.run(40, |_, _| {});
        assert_eq!(bench.health.fault(), None);
    }
}

#[test]
fn a_unit_that_is_read_oftener_than_it_measures_is_healthy() {
    let mut bench = Bench::new();
    doubled(&mut bench, 10_000);
    assert_eq!(bench.health.fault(), None);
    let mut bench = Bench::new();
    for _ in 0..2_000 {
        // A sensor of 500 Hz is read at 600 Hz.
        doubled(&mut bench, 2);
        bench.run(4, |_, _| {});
    }
    assert_eq!(bench.health.fault(), None);
}

#[test]
fn a_pause_of_all_that_is_excused_makes_nobody_late() {
    let mut bench = Bench::running();
    bench.time += 150_000;
    bench.health.excuse(145_000);
    bench.push(|_| {});
    assert_eq!(bench.health.fault(), None);
    bench.time += 150_000;
    bench.health.excuse(40_000);
    bench.push(|_| {});
    assert!(matches!(bench.health.fault(), Some(HealthFault::Late { .. })));
}

#[test]
fn only_a_unit_with_the_readings_of_another_is_a_copy() {
    let mut bench = Bench::running();
    for _ in 0..200 {
        bench.health.compare(Some(1));
        bench.health.compare(None);
        bench.health.compare(None);
    }
    assert_eq!(bench.health.fault(), None);
    for _ in 0..40 {
        bench.health.compare(Some(1));
    }
    assert_eq!(bench.health.fault(), Some(HealthFault::Copy { of: 0b10 }));
}

#[test]
fn a_sensor_of_one_axis_may_repeat_three_times_as_long() {
    let mut bench = Bench::running();
    bench.axes = Axes([false, false, true, true, true, true]);
    let found = bench.time_to_fault(|_, sample| sample.specific_force = Vector3::new(f32::NAN, 1.0, 9.7));
    assert!(left_at_once(found, 0.3) && found > 0.2, "{found}");
}

#[test]
fn channels_that_a_unit_does_not_have_are_not_looked_at() {
    let mut bench = Bench::new();
    bench.axes = Axes([false, false, true, false, false, false]);
    let usable = bench.run(1_000, |_, sample| {
        sample.specific_force.x = f32::NAN;
        sample.specific_force.y = 1_000.0;
        sample.angular_rate = Vector3::new(0.0, f32::INFINITY, 100.0);
    });
    assert_eq!(bench.health.fault(), None);
    assert!(usable.iter().all(|usable| *usable == [true, false]));
}

#[test]
fn one_bad_sample_is_not_used_and_excludes_nobody() {
    let bad: [fn(&mut Sample<f32>); 4] = [
        |sample| sample.specific_force.y = f32::NAN,
        |sample| sample.specific_force.y = f32::NEG_INFINITY,
        |sample| sample.specific_force.y = -160.0,
        |sample| sample.specific_force.y = 60.0,
    ];
    for corrupt in bad {
        let mut bench = Bench::running();
        assert_eq!(bench.push(corrupt), [false, true]);
        for usable in bench.run(500, |_, _| {}) {
            assert_eq!(usable, [true; 2]);
            assert_eq!(bench.health.fault(), None);
        }
    }
}

#[test]
fn a_channel_at_the_end_of_its_range_is_found_in_its_time() {
    let mut bench = Bench::running();
    let found = bench.time_to_fault(|_, sample| sample.angular_rate.z = -35.0);
    assert!(left_at_once(found, 0.05), "{found}");
    assert_eq!(
        bench.health.fault(),
        Some(HealthFault::Saturated {
            channel: 5,
            value: -35.0
        })
    );
}

#[test]
fn frequent_readings_of_nan_are_found_between_good_ones() {
    let mut bench = Bench::running();
    let found = bench.time_to_fault(|i, sample| {
        if i.is_multiple_of(2) {
            sample.specific_force.x = f32::NAN;
        }
    });
    assert!(found < 0.2, "{found}");
    assert_eq!(bench.health.fault(), Some(HealthFault::NotFinite { channel: 0 }));
}

#[test]
fn spikes_exclude_when_they_come_often_and_are_never_used() {
    let mut bench = Bench::running();
    let corrupt = |i: usize, sample: &mut Sample<f32>| {
        if i % 40 == 7 {
            sample.angular_rate.x += 20.0;
        }
    };
    let usable = bench.run(200, corrupt);
    for (i, usable) in usable.into_iter().enumerate() {
        assert_eq!(usable, [true, i % 40 != 7], "{i}");
    }
    assert!(matches!(
        bench.health.fault(),
        Some(HealthFault::Spikes { channel: 3, value }) if (value - 20.0).abs() < 0.1
    ));
    for i in 0..1_000_u32 {
        bench.push(|sample| {
            if i.is_multiple_of(150) {
                sample.angular_rate.x = -20.0;
            }
        });
        assert!(
            bench.health.fault().is_some(),
            "spikes every 0.75 s keep it excluded"
        );
    }
    bench.run(1_000, |_, _| {});
    assert_eq!(bench.health.fault(), None);
}

#[test]
fn a_change_beyond_all_measure_does_not_hide_later_spikes() {
    let mut bench = Bench::running();
    bench.run(3, |_, sample| sample.angular_rate.x = f32::MAX);
    bench.run(3, |_, sample| sample.angular_rate.x = f32::MIN);
    bench.run(200, |_, _| {});
    let found = bench.time_to_fault(|i, sample| {
        if i % 4 == 1 {
            sample.angular_rate.x = 30.0;
        }
    });
    assert!(found < 0.1, "{found}");
}

#[test]
fn a_step_is_no_spike_and_used_from_its_second_reading_on() {
    let mut bench = Bench::running();
    for _ in 0..20 {
        let usable = bench.run(10, |_, sample| sample.specific_force.x += 80.0);
        assert_eq!(usable[0], [false, true]);
        assert_eq!(usable[1..], [[true; 2]; 9]);
        bench.run(10, |_, _| {});
    }
    assert_eq!(bench.health.fault(), None);
}

const FOUND: HealthFault<f32> = HealthFault::OutOfFamily {
    sensor: Sensor::Accelerometer,
    apart: 1.5,
    limit: 0.1,
    scale: 0.1,
    agreeing: 0b110,
};

#[test]
fn a_contradicted_unit_stays_faulty_until_it_is_cleared() {
    let mut bench = Bench::running();
    bench.health.contradict(Sensor::Accelerometer, FOUND);
    bench.run(1000, |_, _| {});
    assert_eq!(bench.health.fault(), Some(FOUND));
    bench.health.clear(Sensor::Gyroscope);
    bench.run(1000, |_, _| {});
    assert_eq!(bench.health.fault(), Some(FOUND));
    bench.health.clear(Sensor::Accelerometer);
    bench.run(1000, |_, _| {});
    assert_eq!(bench.health.fault(), None);
}

#[test]
fn a_calibration_may_correct_contradictions_and_nothing_else() {
    let mut bench = Bench::running();
    assert!(bench.health.may_be_calibrated());
    bench.health.contradict(Sensor::Accelerometer, FOUND);
    assert!(bench.health.may_be_calibrated());
    bench.health.clear(Sensor::Accelerometer);
    bench.health.at_rest(Sensor::Accelerometer, 1.6, 1.5);
    assert!(!bench.health.may_be_calibrated());
}

#[test]
fn a_unit_refuted_at_rest_stays_so_until_a_later_rest() {
    let mut bench = Bench::running();
    bench
        .health
        .refute(Sensor::Accelerometer, RefutedBy::Rest, 3.9, 4.0);
    assert_eq!(bench.health.fault(), None);
    bench
        .health
        .refute(Sensor::Accelerometer, RefutedBy::Rest, f32::NAN, 4.0);
    assert!(matches!(bench.health.fault(), Some(HealthFault::Refuted { .. })));
    bench.run(1000, |_, _| {});
    assert!(matches!(bench.health.fault(), Some(HealthFault::Refuted { .. })));
    bench
        .health
        .refute(Sensor::Accelerometer, RefutedBy::Rest, 0.1, 4.0);
    bench.run(1000, |_, _| {});
    assert_eq!(bench.health.fault(), None);
}

#[test]
fn a_unit_refuted_by_a_fit_stays_so_until_an_adoption() {
    let mut bench = Bench::running();
    bench.health.refute(Sensor::Gyroscope, RefutedBy::Fit, 2.0, 0.1);
    bench
        .health
        .refute(Sensor::Gyroscope, RefutedBy::Rest, 0.001, 1.0);
    bench.run(1000, |_, _| {});
    assert!(matches!(bench.health.fault(), Some(HealthFault::Refuted { .. })));
    bench.health.calibrated(Sensor::Gyroscope);
    bench.run(1000, |_, _| {});
    assert_eq!(bench.health.fault(), None);
}

#[test]
fn what_a_rest_has_shown_only_a_later_rest_clears() {
    let mut bench = Bench::running();
    let settings = bench.settings;
    bench
        .health
        .at_rest(Sensor::Gyroscope, 0.19, settings.rest.angular_rate);
    assert_eq!(bench.health.fault(), None);
    bench
        .health
        .at_rest(Sensor::Gyroscope, 0.3, settings.rest.angular_rate);
    bench
        .health
        .at_rest(Sensor::Accelerometer, 0.1, settings.rest.specific_force);
    bench.health.clock_jumped(bench.time);
    bench.run(10_000, |_, _| {});
    let found = HealthFault::ImplausibleAtRest {
        sensor: Sensor::Gyroscope,
        deviation: 0.3,
        limit: 0.2,
    };
    assert_eq!(bench.health.fault(), Some(found));
    bench
        .health
        .at_rest(Sensor::Gyroscope, 0.01, settings.rest.angular_rate);
    bench.run(1, |_, _| {});
    assert_eq!(bench.health.fault(), None);
    bench
        .health
        .at_rest(Sensor::Accelerometer, f32::NAN, settings.rest.specific_force);
    assert!(bench.health.fault().is_some());
}

#[test]
fn a_jumped_clock_is_reported_until_the_recovery_is_over() {
    let mut bench = Bench::running();
    bench.health.clock_jumped(bench.time);
    bench.run(99, |_, _| {});
    assert_eq!(bench.health.fault(), Some(HealthFault::ClockJumped));
    bench.run(2, |_, _| {});
    assert_eq!(bench.health.fault(), None);
}

type Spoil = fn(&mut HealthSettings<f32>);

#[test]
fn settings_that_cannot_be_meant_are_refused_by_name() {
    let good = RedundancySettings::<f32>::default();
    assert_eq!(good.validate(), Ok(()));
    let cases: [(&str, SettingError, Spoil); 5] = [
        ("late", SettingError::NotPositive, |s| s.late = 0),
        ("spike_angular_rate", SettingError::NotPositive, |s| {
            s.spike.angular_rate = f32::NAN
        }),
        ("rest_specific_force", SettingError::NotPositive, |s| {
            s.rest.specific_force = f32::INFINITY;
        }),
        ("noise_ratio", SettingError::AlwaysExceeded, |s| {
            s.noise_ratio = 1.0
        }),
        ("frozen", SettingError::TooLong(leaky::LONGEST / 3), |s| {
            s.frozen = 3_000_000
        }),
    ];
    for (setting, error, corrupt) in cases {
        let mut settings = good;
        corrupt(&mut settings.health);
        let refused = settings.validate().unwrap_err();
        assert_eq!((refused.setting, refused.error), (setting, error));
    }
}

#[test]
fn a_unit_takes_a_hundred_and_sixty_bytes_at_most() {
    assert!(size_of::<Health<f32>>() <= 160, "{}", size_of::<Health<f32>>());
}
