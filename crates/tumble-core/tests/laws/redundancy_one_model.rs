//! The redundant set by one model: its Gaussian, its means, and the set as a whole.

use nalgebra::{SMatrix, SVector, Vector3};
use proptest::prelude::*;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::model::error::{RateBlock, SecondaryErrors};
use tumble_core::redundancy::model::monitor::{SetEvent, SetEventKind, SetMonitor};
use tumble_core::redundancy::model::motion::{MOTION, MotionOfSet};
use tumble_core::redundancy::model::table::{BLOCK, HOP, SIGMAS, UNCALIBRATED, WALK};
use tumble_core::redundancy::model::triangle::InformationTriangle;
use tumble_core::redundancy::model::window::UnitWindows;
use tumble_core::redundancy::unit_count::{UnitCount, Units};
use tumble_core::sample::Sample;

use crate::common::Draws;

const N: usize = 4;
type Small<T> = InformationTriangle<T, N, 1, 14>;

fn textbook(sigmas: &[f64; N], rows: &[([f64; N], f64)]) -> (SMatrix<f64, N, N>, SVector<f64, N>) {
    let mut information = SMatrix::<f64, N, N>::zeros();
    let mut vector = SVector::<f64, N>::zeros();
    for (i, sigma) in sigmas.iter().enumerate() {
        information[(i, i)] = sigma.powi(-2);
    }
    for (a, y) in rows {
        let a = SVector::from(*a);
        information += a * a.transpose();
        vector += a * *y;
    }
    (information, vector)
}

fn triangle<T: Real>(sigmas: &[f64; N], rows: &[([f64; N], f64)]) -> Small<T> {
    let mut triangle = Small::independent(&[[T::zero()]; N], &sigmas.map(real));
    for (a, y) in rows {
        let [p, q, r, s] = a.map(real);
        triangle.add(&mut [p, q, r, s, real(*y)]);
    }
    triangle
}

proptest! {
    #[test]
    fn rows_on_a_triangle_are_batch_least_squares(
        sigmas in prop::array::uniform4(0.01..2.0_f64),
        rows in prop::collection::vec((prop::array::uniform4(-3.0..3.0_f64), -5.0..5.0_f64), 0..20),
        phi in prop::array::uniform4(-3.0..3.0_f64),
    ) {
        let (information, vector) = textbook(&sigmas, &rows);
        let covariance = information.try_inverse().expect("regular");
        let expected = covariance * vector;
        let wanted = (SVector::from(phi).transpose() * covariance * SVector::from(phi))[(0, 0)];
        let wide = triangle::<f64>(&sigmas, &rows);
        let narrow = triangle::<f32>(&sigmas, &rows);
        for i in 0..N {
            let scale = covariance[(i, i)].sqrt();
            prop_assert!((wide.solve()[i][0] - expected[i]).abs() < 1e-9 * (1.0 + expected[i].abs()));
            prop_assert!((f64::from(narrow.solve()[i][0]) - expected[i]).abs() < 0.01 * scale + 1e-4 * expected[i].abs());
        }
        prop_assert!((wide.variance(&mut phi.clone()) - wanted).abs() < 1e-9 * wanted.max(1e-9));
        let single = f64::from(narrow.variance(&mut phi.map(|x| x as f32)));
        prop_assert!((single - wanted).abs() < 1e-2 * wanted.max(1e-6), "{single} {wanted}");
    }

    #[test]
    fn a_walk_adds_to_one_variance_and_keeps_the_mean(
        sigmas in prop::array::uniform4(0.05..2.0_f64),
        rows in prop::collection::vec((prop::array::uniform4(-3.0..3.0_f64), -5.0..5.0_f64), 0..20),
        which in 0..N,
        sigma in 0.001..1.0_f64,
    ) {
        let before = triangle::<f64>(&sigmas, &rows);
        let mut after = before;
        after.walk(which, sigma, &mut [0.0; N + 1]);
        for i in 0..N {
            prop_assert!((after.solve()[i][0] - before.solve()[i][0]).abs() < 1e-8);
            for j in 0..N {
                let mut phi = [0.0; N];
                phi[i] += 1.0;
                phi[j] += 1.0;
                let grown = if i == which || j == which { if i == j { 4.0 } else { 1.0 } } else { 0.0 };
                let expected = before.variance(&mut phi.clone()) + grown * sigma * sigma;
                let found = after.variance(&mut phi);
                prop_assert!((found - expected).abs() < 1e-8 * (1.0 + expected), "{i} {j}: {found} {expected}");
            }
        }
    }

    #[test]
    fn triangles_of_two_halves_know_what_one_of_all_does(
        rows in prop::collection::vec((prop::array::uniform4(-3.0..3.0_f64), -5.0..5.0_f64), 2..20),
    ) {
        let sigmas = [0.5; N];
        let (first, second) = rows.split_at(rows.len() / 2);
        let mut part = Small::none();
        for (a, y) in second {
            let [p, q, r, s] = *a;
            part.add(&mut [p, q, r, s, *y]);
        }
        let mut joined = triangle::<f64>(&sigmas, first);
        joined.add_all(&part, &mut [0.0; N + 1]);
        let whole = triangle::<f64>(&sigmas, &rows);
        for i in 0..N {
            prop_assert!((joined.solve()[i][0] - whole.solve()[i][0]).abs() < 1e-9);
        }
    }
}

/// Motion of a body that turns and is pushed about, of which three units at a place read all.
struct Flight {
    noise: [f64; 2],
}

impl Flight {
    fn truth(time: f64) -> ([f64; 3], [f64; 3]) {
        let rate = [
            0.6 * (1.7 * time).sin() + 0.3 * (4.1 * time).cos(),
            0.5 * (1.3 * time).cos(),
            0.4 * (0.9 * time).sin(),
        ];
        let force = [
            1.5 * (0.8 * time).sin(),
            1.2 * (1.1 * time).cos(),
            9.8 + 2.0 * (0.7 * time).sin(),
        ];
        (force, rate)
    }

    fn sample<T: Real>(&self, time: u64, draws: &mut Draws, add: [[f64; 3]; 2]) -> Sample<T> {
        let (force, rate) = Self::truth(time as f64 * 1e-6);
        let mut of = |value: [f64; 3], noise: f64, add: [f64; 3]| {
            Vector3::from_fn(|i, _| {
                let drawn = draws.normal();
                real(value[i] + add[i] + noise * drawn)
            })
        };
        Sample {
            time,
            specific_force: of(force, self.noise[0], add[0]),
            angular_rate: of(rate, self.noise[1], add[1]),
        }
    }
}

/// Flies three units of 100 Hz for 30 s; the second has a fault from 20 s on, and errors of its own before.
fn flown<T: Real>(fault: [[f64; 3]; 2], finds_delays: bool) -> (Vec<SetEvent<T>>, SetMonitor<T, 3>) {
    let flight = Flight { noise: [0.03, 0.003] };
    let mut draws = Draws::new(7);
    let mut monitor = SetMonitor::<T, 3>::new(finds_delays);
    let mut events = Vec::new();
    for step in 0..3000_u64 {
        let time = 1_000_000 + step * 10_000;
        for unit in 0..3 {
            let mut add = [[0.0; 3]; 2];
            if unit == 1 {
                add = [[0.2, -0.1, 0.1], [0.01, 0.0, -0.01]];
                if step >= 2000 {
                    for (sum, fault) in add.as_flattened_mut().iter_mut().zip(fault.as_flattened()) {
                        *sum += *fault;
                    }
                }
            }
            let sample = flight.sample(time, &mut draws, add);
            monitor.push(unit, &sample, &mut |event| events.push(*event));
        }
    }
    (events, monitor)
}

/// Flies units of 100 Hz for 24 s, some of which have a fault from 20 s on.
fn flown_together<T: Real, const UNITS: usize>(faults: &[(usize, [[f64; 3]; 2])]) -> Vec<SetEvent<T>>
where
    Units<UNITS>: UnitCount,
{
    let flight = Flight { noise: [0.03, 0.003] };
    let mut draws = Draws::new(11);
    let mut monitor = SetMonitor::<T, UNITS>::new(true);
    let mut events = Vec::new();
    for step in 0..2400_u64 {
        let time = 1_000_000 + step * 10_000;
        for unit in 0..UNITS {
            let fault = faults.iter().find(|(faulty, _)| step >= 2000 && *faulty == unit);
            let add = fault.map_or([[0.0; 3]; 2], |(_, fault)| *fault);
            let sample = flight.sample(time, &mut draws, add);
            monitor.push(unit, &sample, &mut |event| events.push(*event));
        }
    }
    events
}

/// A step of one axis of both sensors, m/s^2 and a tenth of it in rad/s.
fn step_of(size: f64, axis: usize) -> [[f64; 3]; 2] {
    let along = |size: f64| core::array::from_fn(|i| if i == axis { size } else { 0.0 });
    [along(size), along(0.1 * size)]
}

/// Units that are named within a second, in order; no other event of an unhealthy unit.
fn named_at_once<T: Real>(events: &[SetEvent<T>]) -> Vec<usize> {
    let mut units: Vec<_> = named(events)
        .into_iter()
        .map(|(time, unit)| {
            assert!((21_000_000..22_000_000).contains(&time), "unit {unit} at {time}");
            unit
        })
        .collect();
    units.sort_unstable();
    units
}

#[test]
fn the_most_that_agree_name_all_others_of_five() {
    fn law<T: Real>() {
        for [one, other] in [[0, 1], [1, 3], [0, 4]] {
            for second in [step_of(1.0, 0), step_of(-1.0, 0), step_of(1.0, 2)] {
                let events = flown_together::<T, 5>(&[(one, step_of(1.0, 0)), (other, second)]);
                assert_eq!(named_at_once(&events), [one, other]);
                let source = events.iter().rev().find_map(|event| match event.kind {
                    SetEventKind::Selected { .. } => event.unit,
                    _ => None,
                });
                assert_eq!(source, (0..5).find(|unit| ![one, other].contains(unit)));
            }
        }
    }
    law::<f64>();
    law::<f32>();
}

#[test]
fn three_of_seven_are_named_by_four() {
    let faults = [(0, step_of(1.0, 0)), (2, step_of(-1.0, 1)), (5, step_of(1.0, 2))];
    assert_eq!(named_at_once(&flown_together::<f32, 7>(&faults)), [0, 2, 5]);
}

#[test]
fn no_unit_is_named_where_no_more_than_half_agree() {
    let faults = [(0, step_of(1.0, 0)), (1, step_of(-1.0, 1)), (2, step_of(1.0, 2))];
    let [one, other, third] = faults;
    assert_eq!(named(&flown_together::<f32, 4>(&[one, other])), []);
    assert_eq!(named(&flown_together::<f32, 5>(&[one, other, third])), []);
    assert_eq!(named(&flown_together::<f32, 6>(&[one, other, third])), []);
    assert_eq!(named(&flown_together::<f32, 6>(&[])), []);
}

fn named<T: Real>(events: &[SetEvent<T>]) -> Vec<(u64, usize)> {
    let of = |event: &SetEvent<T>| match event.kind {
        SetEventKind::Unhealthy { .. } => event.unit.map(|unit| (event.time, unit)),
        _ => None,
    };
    events.iter().filter_map(of).collect()
}

#[test]
fn sound_units_are_not_named_and_their_biases_are_learnt() {
    fn law<T: Real>() {
        let (events, monitor) = flown::<T>([[0.0; 3]; 2], true);
        assert_eq!(named(&events), []);
        let mean = monitor.errors(1).expect("a secondary").mean();
        let bias = |sensor: usize, axis: usize| {
            nalgebra::try_convert::<T, f64>(mean.rows[sensor][axis][3]).unwrap_or(f64::NAN)
        };
        for (axis, expected) in [0.01, 0.0, -0.01].into_iter().enumerate() {
            assert!(
                (bias(1, axis) - expected).abs() < 2e-3,
                "axis {axis}: {}",
                bias(1, axis)
            );
        }
    }
    law::<f64>();
    law::<f32>();
}

#[test]
fn the_unit_with_a_step_alone_is_named_within_a_second() {
    fn law<T: Real>() {
        for fault in [[[0.0; 3], [0.1, 0.0, 0.0]], [[0.0, 1.0, 0.0], [0.0; 3]]] {
            let (events, _) = flown::<T>(fault, true);
            let named = named(&events);
            assert_eq!(named.len(), 1, "{named:?}");
            let (time, unit) = named[0];
            assert_eq!(unit, 1);
            assert!((21_000_000..22_000_000).contains(&time), "{time}");
        }
    }
    law::<f64>();
    law::<f32>();
}

/// Rests for 8 s with three units of 100 Hz, then moves until 20 s; adds noise to the samples of the second from a time on, s.
fn rested<T: Real>(noisy_from: f64, noise: [f64; 2]) -> Vec<SetEvent<T>> {
    let quiet = Flight { noise: [0.02, 0.002] };
    let mut draws = Draws::new(9);
    let mut monitor = SetMonitor::<T, 3>::new(false);
    let mut events = Vec::new();
    for step in 0..2000_u64 {
        let seconds = step as f64 * 0.01;
        for unit in 0..3 {
            let time = 1_000_000 + step * 10_000;
            let mut sample: Sample<T> = quiet.sample(time, &mut draws, [[0.0; 3]; 2]);
            if seconds < 8.0 {
                let (force, rate) = Flight::truth(time as f64 * 1e-6);
                sample.specific_force -=
                    Vector3::from(force).map(real) - Vector3::new(0.0, 0.0, 9.80665).map(real);
                sample.angular_rate -= Vector3::from(rate).map(real);
            }
            if unit == 1 && seconds >= noisy_from {
                let [of_force, of_rate] = noise;
                sample.specific_force += Vector3::from_fn(|_, _| real(of_force * draws.normal()));
                sample.angular_rate += Vector3::from_fn(|_, _| real(of_rate * draws.normal()));
            }
            monitor.push(unit, &sample, &mut |event| events.push(*event));
        }
    }
    events
}

#[test]
fn a_unit_that_motion_alone_shakes_is_not_noisy() {
    // It has the widest filter: motion begins, and its samples scatter 15 times as much as at rest, those of others do not.
    assert_eq!(named(&rested::<f64>(8.0, [0.3, 0.03])), []);
    assert_eq!(named(&rested::<f32>(8.0, [0.3, 0.03])), []);
}

#[test]
fn noise_at_rest_is_named_within_two_seconds() {
    fn law<T: Real>() {
        let named = named(&rested::<T>(5.0, [0.0, 0.04]));
        let (time, unit) = named[0];
        assert_eq!(unit, 1);
        assert!((6_000_000..8_000_000).contains(&time), "{time}");
    }
    law::<f64>();
    law::<f32>();
}

#[test]
fn errors_of_forces_are_those_of_least_squares() {
    let mut draws = Draws::new(3);
    let mut errors = SecondaryErrors::<f64>::uncalibrated();
    let mut information = SMatrix::<f64, 15, 15>::zeros();
    let mut vector = SVector::<f64, 15>::zeros();
    for i in 0..15 {
        let sigma = match i {
            12.. => UNCALIBRATED.arm,
            3 | 7 | 11 => UNCALIBRATED.bias[0],
            _ => UNCALIBRATED.matrix,
        };
        information[(i, i)] = sigma.powi(-2);
    }
    for _ in 0..60 {
        let drawn: [f64; MOTION] = core::array::from_fn(|_| 3.0 * draws.normal());
        let motion = MotionOfSet::of_channels(&drawn);
        let lever = motion.lever();
        let difference: [f64; 3] = core::array::from_fn(|_| draws.normal());
        errors.add_force(motion.force(), &lever, &difference);
        for axis in 0..3 {
            let mut row = SVector::<f64, 15>::zeros();
            for k in 0..3 {
                row[4 * axis + k] = motion.force()[k];
                row[12 + k] = lever.0[axis][k];
            }
            row[4 * axis + 3] = 1.0;
            information += row * row.transpose() / SIGMAS[0].powi(2);
            vector += row * (difference[axis] / SIGMAS[0].powi(2));
        }
    }
    errors.update_mean();
    let expected = information.try_inverse().expect("regular") * vector;
    let mean = errors.mean();
    let found = mean.rows[0].as_flattened().iter().chain(&mean.arm);
    for (i, (found, expected)) in found.zip(expected.iter()).enumerate() {
        assert!((found - expected).abs() < 1e-9, "{i}: {found} {expected}");
    }
}

#[test]
fn hours_of_walks_and_blocks_keep_single_precision() {
    // Errors learnt in f32 stay within a tenth of a sigma of those learnt in f64.
    fn learnt<T: Real>() -> SecondaryErrors<T> {
        let mut draws = Draws::new(11);
        let mut errors = SecondaryErrors::<T>::uncalibrated();
        for _ in 0..3 * 3600 {
            let mut block = RateBlock::none();
            let rate: [T; 3] = core::array::from_fn(|_| real(0.5 * draws.normal()));
            for _ in 0..BLOCK / 2 {
                let difference = core::array::from_fn(|_| real(0.02 + 0.012 * draws.normal()));
                block.add(&rate, &difference);
            }
            errors.walk(T::one());
            errors.add_rates(&block);
        }
        errors.update_mean();
        errors
    }
    let (wide, narrow) = (learnt::<f64>(), learnt::<f32>());
    for axis in 0..3 {
        let found = f64::from(narrow.mean().rows[1][axis][3]);
        let expected = wide.mean().rows[1][axis][3];
        assert!(
            (found - expected).abs() < 0.1 * WALK[1] * 10.0,
            "axis {axis}: {found} {expected}"
        );
        assert!((expected - 0.02).abs() < 2e-3);
    }
}

#[test]
fn a_triangle_is_exact_for_straight_lines_of_samples() {
    let mut windows = UnitWindows::<f64>::new();
    for step in 0..400_u64 {
        let time = step * 7_000;
        let seconds = time as f64 * 1e-6;
        windows.push(time, &[seconds, 2.0, -seconds, 0.1 * seconds, 0.0, 1.0]);
    }
    for index in 30..50_u64 {
        let window = windows.of(index);
        if windows.has_ended(index + 4) {
            continue;
        }
        let middle = (index * HOP) as f64 * 1e-6;
        if window.is_whole {
            assert!((window.reading[0] - middle).abs() < 1e-9);
            assert!((window.change[0] - 1.0).abs() < 1e-9);
            assert!((window.change[1]).abs() < 1e-9);
        }
    }
}

#[test]
fn the_state_of_a_primary_and_two_secondaries_is_small() {
    let bytes = size_of::<SetMonitor<f32, 3>>();
    println!("{bytes} bytes");
    assert!(bytes <= 10_960, "{bytes} bytes");
}

#[test]
fn the_largest_times_end_no_window_for_ever() {
    for finds_delays in [false, true] {
        let mut monitor = SetMonitor::<f64, 3>::new(finds_delays);
        for time in [u64::MAX - HOP, u64::MAX - 1, u64::MAX] {
            for unit in 0..3 {
                let sample = Sample {
                    time,
                    specific_force: Vector3::new(0.0, 0.0, 9.8),
                    angular_rate: Vector3::zeros(),
                };
                monitor.push(unit, &sample, &mut |_| {});
            }
        }
    }
}
