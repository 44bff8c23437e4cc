//! Cost of one `push` of the redundancy monitor, beside a copy of the sample in memory: `cargo bench --bench push_cost`
//! prints a JSON line for each number of units and each precision. Copy and push are measured in turn, again
//! and again, so that what slows the machine down slows both.

use std::hint::black_box;
use std::time::Instant;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use tumble_core::gravity::STANDARD;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::redundancy::platform::{MountedUnit, Platform, PrimaryCalibration};
use tumble_core::redundancy::settings::RedundancySettings;
use tumble_core::redundancy::unit_count::{UnitCount, Units};
use tumble_core::sample::Sample;

const ROUNDS: u32 = 31;
const SAMPLES: u32 = 20_000;
const PERIOD: u64 = 5_000;

fn main() {
    for_precision::<f32>("f32");
    for_precision::<f64>("f64");
}

fn for_precision<T: Real>(name: &str) {
    cost::<T, 2>(name);
    cost::<T, 3>(name);
    cost::<T, 4>(name);
    cost::<T, 5>(name);
    cost::<T, 6>(name);
    cost::<T, 7>(name);
    cost::<T, 8>(name);
}

/// Samples at 200 Hz of units that rest for ten seconds, then move for ten, over and over.
fn readings<T: Real>() -> Vec<Sample<T>> {
    let mut random = Pcg64::seed_from_u64(7);
    (0..SAMPLES)
        .map(|i| {
            let seconds = f64::from(i) * 0.005;
            let moving = if seconds % 20.0 < 10.0 { 0.0 } else { 1.0 };
            let mut noisy = |size: f64, value: f64| real::<T>(value + random.random_range(-size..size));
            let sway = |phase: f64| moving * (3.0 * seconds + phase).sin();
            Sample {
                time: u64::from(i) * PERIOD,
                specific_force: Vector3::new(
                    noisy(0.03, 3.0 * sway(0.0)),
                    noisy(0.03, 3.0 * sway(1.0)),
                    noisy(0.03, STANDARD + 3.0 * sway(2.0)),
                ),
                angular_rate: Vector3::new(
                    noisy(0.003, sway(3.0)),
                    noisy(0.003, sway(4.0)),
                    noisy(0.003, sway(5.0)),
                ),
            }
        })
        .collect()
}

#[allow(clippy::cast_precision_loss)]
fn cost<T: Real, const UNITS: usize>(precision: &str)
where
    Units<UNITS>: UnitCount,
{
    let samples = readings::<T>();
    let units = core::array::from_fn(|i| MountedUnit::new(i as u64 + 1));
    let platform: Platform<T, UNITS> =
        Platform::new(RedundancySettings::default(), PrimaryCalibration::none(), units)
            .expect("settings by default suit units by default");
    let (mut copies, mut pushes) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        copies.push(copied(&samples));
        pushes.push(pushed(&platform, &samples));
    }
    let ratios = copies
        .iter()
        .zip(&pushes)
        .map(|(copy, push)| push / copy)
        .collect();
    println!(
        "{{\"precision\": \"{precision}\", \"secondaries\": {}, \"push\": {:.2}, \"copy\": {:.3}, \"ratio\": {:.2}}}",
        UNITS - 1,
        median(pushes),
        median(copies),
        median(ratios)
    );
}

/// Nanoseconds to copy one sample.
fn copied<T: Real>(samples: &[Sample<T>]) -> f64 {
    let mut place = samples[0];
    let begun = Instant::now();
    for sample in samples {
        place.clone_from(black_box(sample));
        black_box(&mut place);
    }
    begun.elapsed().as_secs_f64() * 1e9 / f64::from(SAMPLES)
}

/// Nanoseconds to push one sample of one unit; all units in turn.
fn pushed<T: Real, const UNITS: usize>(platform: &Platform<T, UNITS>, samples: &[Sample<T>]) -> f64
where
    Units<UNITS>: UnitCount,
{
    let mut monitor: Monitor<T, UNITS, 1> = Monitor::new();
    let mut told = 0_u32;
    let mut calls = 0_u32;
    let begun = Instant::now();
    for sample in samples {
        for number in 0..UNITS {
            black_box(monitor.push(platform, number, black_box(sample), &mut |_| told += 1));
            calls += 1;
        }
    }
    let passed = begun.elapsed().as_secs_f64();
    assert!(told > 0, "units that rest and move make the monitor say so");
    passed * 1e9 / f64::from(calls)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
