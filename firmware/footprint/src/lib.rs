//! Shared parts of all images: values that the compiler cannot know, and the calls that each part makes.
//!
//! An image with one part, less the empty one, shows what that part takes of flash. Everything of the part that a user
//! would call is called, with values that go through [`black_box`], so that nothing is worked out beforehand.
#![no_std]

pub mod dense;
#[path = "../../platform/src/panic_handler.rs"]
mod panic_handler;

use core::convert::Infallible;
use core::hint::black_box;

use mission::MissionError;
use mission::nor::{BYTES, ERASED, Nor};
use mission::units::UNITS;
use mission::work_meter::WorkMeter;
use nalgebra::{Matrix3, Vector3};
use tumble_core::model::{Correction, ErrorModel};
use tumble_core::redundancy::monitor::{Command, Monitor};
use tumble_core::redundancy::platform::{MountedUnit, Platform, PrimaryCalibration};
use tumble_core::redundancy::record::{Record, Storage};
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::RedundancySettings;
use tumble_core::sample::Sample;
use tumble_core::spin::machine::{SpinMachine, Wheels};
use tumble_core::spin::settings::SpinSettings;
use tumble_core::temperature::TemperatureDrift;
use tumble_store::flash::{RecordStore, Which, WriteLimit};
use tumble_store::record::StoredRecord;

/// Some sample.
pub fn sample() -> Sample<f32> {
    black_box(Sample {
        time: 0,
        specific_force: Vector3::zeros(),
        angular_rate: Vector3::zeros(),
    })
}

/// Corrections of both triads.
pub fn corrections() -> [Correction<f32>; 2] {
    let correction = Correction {
        matrix: Matrix3::identity(),
        bias: Vector3::zeros(),
    };
    black_box([correction; 2])
}

/// Corrects both triads of a sample.
pub fn apply([accelerometer, gyroscope]: &[Correction<f32>; 2], sample: &Sample<f32>) -> [Vector3<f32>; 2] {
    [
        accelerometer.apply(&sample.specific_force),
        gyroscope.apply(&sample.angular_rate),
    ]
}

/// Everything of a turntable calibration on a device.
pub fn use_apply() {
    let correction = || black_box(ErrorModel::<f32>::identity()).correction();
    if let (Ok(accelerometer), Ok(gyroscope)) = (correction(), correction()) {
        black_box(apply(&[accelerometer, gyroscope], &sample()));
    }
}

/// The same at a temperature.
pub fn use_temperature() {
    let drift = black_box(TemperatureDrift::<f32> {
        reference: 25.0,
        range: [-20.0, 70.0],
        bias: [Vector3::zeros(); 3],
        scale: [Vector3::zeros(); 3],
    });
    let correction = || black_box(ErrorModel::<f32>::identity()).correction();
    if let (Ok(accelerometer), Ok(gyroscope)) = (correction(), correction()) {
        let mut reading = sample();
        let degrees = black_box(30.0);
        reading.specific_force = drift.at_reference(&reading.specific_force, &accelerometer.bias, degrees);
        reading.angular_rate = drift.at_reference(&reading.angular_rate, &gyroscope.bias, degrees);
        black_box(apply(&[accelerometer, gyroscope], &reading));
    }
}

/// Everything of a spin.
pub fn use_spin() {
    let mut machine = SpinMachine::<f32>::new(&black_box(SpinSettings::default()));
    machine.start();
    while black_box(true) {
        black_box(machine.push(&sample(), black_box(Wheels::Unknown)));
        black_box(machine.tick(black_box(0)));
        black_box(machine.progress());
        black_box(machine.state());
    }
    let _ = black_box(machine.solve(None));
}

/// Everything of a redundant set with two secondaries.
pub fn use_redundancy() {
    let units: [MountedUnit<f32>; UNITS] = black_box(core::array::from_fn(|i| MountedUnit::new(i as u64)));
    let Ok(platform) = Platform::new(black_box(RedundancySettings::default()), calibration(), units) else {
        return;
    };
    let mut monitor = Monitor::<f32, UNITS, 1>::new();
    monitor.restore(&platform, &record(), &mut |event| {
        black_box(event);
    });
    let _ = black_box(monitor.restore_from(&platform, &mut Given, &mut |event| {
        black_box(event);
    }));
    monitor.command(black_box(Command::Evaluate));
    while black_box(true) {
        let unit = black_box(0);
        black_box(monitor.push(&platform, unit, &sample(), &mut |event| {
            black_box(event);
        }));
    }
}

/// Records that are simply there.
struct Given;

impl Storage<f32> for Given {
    type Error = Infallible;

    fn load(&mut self, _: u64, _: Sensor) -> Result<Option<Record<f32>>, Infallible> {
        Ok(black_box(Some(record())))
    }

    fn load_factory(&mut self, _: u64, _: Sensor) -> Result<Option<Record<f32>>, Infallible> {
        Ok(black_box(Some(record())))
    }

    fn save(&mut self, _: &Record<f32>) -> Result<(), Infallible> {
        Ok(())
    }
}

fn calibration() -> PrimaryCalibration<f32> {
    let model = || black_box(ErrorModel::identity());
    PrimaryCalibration::new(model(), model()).unwrap_or(PrimaryCalibration::none())
}

fn record() -> Record<f32> {
    black_box(Record::unknown(0, Sensor::Accelerometer))
}

/// Everything of records in flash; emulated flash is a part of it, as a driver would be.
pub fn use_store() {
    let mut chip = black_box([ERASED; BYTES]);
    let range = 0..black_box(BYTES as u32);
    let Ok(mut store) = RecordStore::new(Nor::new(&mut chip), range, black_box(WriteLimit::default())) else {
        return;
    };
    let (identity, sensor) = (black_box(0), black_box(Sensor::Gyroscope));
    let Ok(Some(record)) = store.in_force(identity, sensor) else {
        return;
    };
    let _ = black_box(store.save(black_box(0), &record));
    let _ = black_box(store.save_factory(black_box(0), &record));
    let _ = black_box(store.load(identity, sensor, black_box(Which::Factory)));
    let _ = black_box(store.roll_back(black_box(0), identity, sensor, black_box(Which::Previous)));
    let mut storage = store.at(black_box(0), black_box(None));
    let _ = black_box(Storage::<f32>::load(&mut storage, identity, sensor));
    let _ = black_box(Storage::<f32>::save(&mut storage, &record.record));
    let _ = black_box(store.erase());
}

/// Fills a bank, and watches the save that finds no room: the other bank is erased, takes what is of use, and the record.
///
/// # Errors
/// [`MissionError`].
pub fn save_into_a_full_bank<W: WorkMeter>(
    chip: &mut [u8; BYTES],
    watch: &mut W,
) -> Result<(), MissionError> {
    chip.fill(ERASED);
    let limit = WriteLimit {
        shortest_between: 0,
        at_once: 1,
    };
    let mut store = RecordStore::new(Nor::new(chip), 0..BYTES as u32, limit)?;
    let mut record = StoredRecord {
        record: record(),
        temperature: None,
    };
    // Two units with two sensors each, again and again.
    for number in 0..=store.entries() {
        record.record.identity = u64::from(number / 2 % 2);
        record.record.sensor = if number % 2 == 0 {
            Sensor::Accelerometer
        } else {
            Sensor::Gyroscope
        };
        record.record.sequence = number;
        watch.during(|| store.save(0, &record))?;
    }
    Ok(())
}
