//! Records that the store keeps, refuses and spares.

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tumble_core::model::ErrorModel;
use tumble_core::real::Real;
use tumble_core::redundancy::platform::PrimaryCalibration;
use tumble_core::redundancy::record::{Record, RecordPart, Storage};
use tumble_core::redundancy::sensor::Sensor;
use tumble_store::flash::{RecordStore, Saved, StoreError, Which, WriteLimit};
use tumble_store::record::{DecodeError, EncodeError, Field, StoredRecord};

use crate::common::history::{Model, Update, drawn, make, numbered, open, whole};
use crate::common::simulated::{Operation, Simulated};
use crate::common::{NEWER, sign};

const UNIT: u64 = 5;
const SENSOR: Sensor = Sensor::Accelerometer;

#[test]
fn the_store_does_what_a_plain_model_does() {
    for seed in 1..=5 {
        println!("seed {seed}");
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let (mut store, mut model) = (open(Simulated::<4>::new(4)), Model::default());
        for number in 0..400 {
            let update = drawn(&mut random, 6, number);
            make(&update, &mut store).unwrap();
            model.make(&update);
            if random.random_bool(0.1) {
                store = open(store.into_flash().back());
            }
            assert_eq!(model.read(&mut store), model, "{update:?}");
        }
    }
}

#[test]
fn erased_flash_and_flash_full_of_something_else_hold_no_record() {
    for filling in [0xFF, 0x00, 0x54] {
        let mut flash = Simulated::<4>::new(2);
        flash.memory.fill(filling);
        let mut store = open(flash.back());
        assert_eq!(store.in_force(UNIT, SENSOR), Ok(None));
        let record = numbered(UNIT, SENSOR, 1);
        assert_eq!(store.save(0, &record), Ok(Saved::Written));
        assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(record)));
    }
}

#[test]
fn the_factory_record_is_in_force_until_another_is_adopted() {
    let mut store = open(Simulated::<4>::new(2));
    let [factory, adopted] = [1, 2].map(|number| numbered(UNIT, SENSOR, number));
    store.save_factory(0, &factory).unwrap();
    assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(factory)));
    assert_eq!(store.load(UNIT, SENSOR, Which::Last), Ok(None));
    store.save(0, &adopted).unwrap();
    assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(adopted)));
    assert_eq!(store.load(UNIT, SENSOR, Which::Factory), Ok(Some(factory)));
}

#[test]
fn rolling_back_restores_a_record_and_can_be_undone() {
    let mut store = open(Simulated::<4>::new(2));
    let [factory, first, second] = [1, 2, 3].map(|number| numbered(UNIT, SENSOR, number));
    let nothing = |which| Err(StoreError::NothingStored(which));
    assert_eq!(
        store.roll_back(0, UNIT, SENSOR, Which::Factory),
        nothing(Which::Factory)
    );
    store.save_factory(0, &factory).unwrap();
    store.save(0, &first).unwrap();
    assert_eq!(
        store.roll_back(0, UNIT, SENSOR, Which::Previous),
        nothing(Which::Previous)
    );
    store.save(0, &second).unwrap();
    for (to, wanted) in [
        (Which::Previous, first),
        (Which::Previous, second),
        (Which::Factory, factory),
        (Which::Previous, second),
    ] {
        assert_eq!(store.roll_back(0, UNIT, SENSOR, to), Ok(wanted));
        assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(wanted)));
    }
    assert_eq!(store.load(UNIT, SENSOR, Which::Factory), Ok(Some(factory)));
}

#[test]
fn nothing_is_written_if_the_record_is_in_force_already() {
    let mut store = open(Simulated::<4>::new(2));
    let record = numbered(UNIT, SENSOR, 1);
    store.save_factory(0, &record).unwrap();
    assert_eq!(store.save_factory(0, &record), Ok(Saved::AlreadyThere));
    // Power may have been cut in the last entry of a boot, so that another follows it.
    store.save(0, &numbered(UNIT + 1, SENSOR, 2)).unwrap();
    let before = store.into_flash().back();
    let mut store = open(before.clone());
    assert_eq!(store.save(0, &record), Ok(Saved::AlreadyThere));
    assert_eq!(store.save_factory(0, &record), Ok(Saved::AlreadyThere));
    assert_eq!(store.roll_back(0, UNIT, SENSOR, Which::Factory), Ok(record));
    assert_eq!(store.into_flash().operations, before.operations);
}

#[test]
fn a_record_saved_again_after_a_start_keeps_the_previous_one() {
    let [first, second] = [1, 2].map(|number| numbered(UNIT, SENSOR, number));
    let mut store = open(Simulated::<4>::new(2));
    store.save(0, &first).unwrap();
    store.save(0, &second).unwrap();
    for boot in 0..30 {
        store = open(store.into_flash().back());
        store.save(0, &second).unwrap();
        let previous = store.load(UNIT, SENSOR, Which::Previous);
        assert_eq!(previous, Ok(Some(first)), "boot {boot}");
    }
}

#[test]
fn writes_beyond_the_limit_are_refused_until_their_time() {
    let limit = WriteLimit {
        shortest_between: 1000,
        at_once: 2,
    };
    let flash = Simulated::<4>::new(2);
    let range = whole(&flash);
    let mut store = RecordStore::new(flash, range, limit).unwrap();
    let mut number = 0;
    let mut save = |now| {
        number += 1;
        store.save(now, &numbered(UNIT, SENSOR, number))
    };
    let too_soon = |wait| Err(StoreError::TooSoon { wait });
    assert_eq!(
        [save(5000), save(5000)],
        [Ok(Saved::Written); 2],
        "as many as are allowed at once"
    );
    assert_eq!(save(5000), too_soon(1000));
    assert_eq!(save(5999), too_soon(1));
    assert_eq!(save(6000), Ok(Saved::Written));
    assert_eq!(save(6000), too_soon(1000));
    assert_eq!([save(9000), save(9000)], [Ok(Saved::Written); 2]);
    assert_eq!(save(9000), too_soon(1000));
    assert_eq!(
        save(100),
        too_soon(1000),
        "a clock that was set back costs no more than one wait"
    );
    assert_eq!(save(1100), Ok(Saved::Written));
}

#[test]
fn a_refused_write_changes_nothing_and_a_repeat_costs_nothing() {
    let flash = Simulated::<4>::new(2);
    let range = whole(&flash);
    let limit = WriteLimit {
        shortest_between: u64::MAX,
        at_once: 1,
    };
    let mut store = RecordStore::new(flash, range, limit).unwrap();
    let [record, other] = [1, 2].map(|number| numbered(UNIT, SENSOR, number));
    store.save(0, &record).unwrap();
    assert_eq!(store.save(u64::MAX - 1, &record), Ok(Saved::AlreadyThere));
    assert!(matches!(store.save(1, &other), Err(StoreError::TooSoon { .. })));
    assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(record)));
    let mut once = open(Simulated::<4>::new(2));
    once.save(0, &record).unwrap();
    let (flash, once) = (store.into_flash(), once.into_flash());
    assert_eq!((flash.memory, flash.operations), (once.memory, once.operations));
}

#[test]
fn ten_thousand_updates_wear_all_pages_alike() {
    let mut store = open(Simulated::<4>::new(2));
    for number in 0..10_000 {
        let identity = u64::from(number % 3);
        store.save(0, &numbered(identity, SENSOR, number)).unwrap();
    }
    // The flash itself makes sure that no word is written twice between two erasures.
    let flash = store.into_flash();
    println!("erasures of each page: {:?}", flash.erasures);
    let [first, second] = flash.erasures[..] else {
        panic!("two pages")
    };
    assert!(first.abs_diff(second) <= 1);
    // 21 entries to a page, of which two of each of the three sensors are copied: 15 new ones to an erasure.
    assert_eq!(first + second, 10_000_u32.div_ceil(15));
    let bytes = |operation: &Operation| {
        if let Operation::Write { bytes } = operation {
            *bytes
        } else {
            0
        }
    };
    let written: usize = flash.operations.iter().map(bytes).sum();
    println!("bytes written for each record: {}", written / 10_000);
}

#[test]
fn too_many_units_are_refused_and_all_others_stay() {
    let mut store = open(Simulated::<4>::new(2));
    let entries = store.entries();
    assert_eq!(entries, 21);
    let mut model = Model::default();
    for identity in 0..u64::from(entries) {
        let update = Update::Save(numbered(identity, SENSOR, 1).into());
        make(&update, &mut store).unwrap();
        model.make(&update);
    }
    let full = Err(StoreError::Full { entries });
    assert_eq!(store.save(0, &numbered(99, SENSOR, 1)), full);
    assert_eq!(store.save(0, &numbered(0, SENSOR, 2)), full);
    assert_eq!(model.read(&mut store), model);
}

#[test]
fn a_save_refused_for_lack_of_room_spares_the_write_limit() {
    let flash = Simulated::<4>::new(2);
    let range = whole(&flash);
    let limit = WriteLimit {
        shortest_between: 1000,
        at_once: 1,
    };
    let mut store = RecordStore::new(flash, range, limit).unwrap();
    let entries = store.entries();
    for identity in 0..u64::from(entries) {
        let saved = store.save(1000 * identity, &numbered(identity, SENSOR, 1));
        assert_eq!(saved, Ok(Saved::Written));
    }
    let now = 1000 * u64::from(entries);
    let record = numbered(99, SENSOR, 1);
    for _ in 0..3 {
        assert_eq!(store.save(now, &record), Err(StoreError::Full { entries }));
    }
    store.erase().unwrap();
    assert_eq!(store.save(now, &record), Ok(Saved::Written));
    let next = store.save(now, &numbered(99, SENSOR, 2));
    assert_eq!(
        next,
        Err(StoreError::TooSoon { wait: 1000 }),
        "what is written counts"
    );
}

#[test]
fn an_entry_with_a_bit_that_is_not_taken_is_passed_over() {
    let mut store = open(Simulated::<4>::new(2));
    let [old, new] = [1, 2].map(|number| numbered(UNIT, SENSOR, number));
    store.save(0, &old).unwrap();
    let mut flash = store.into_flash();
    let second_entry = 64 + 192;
    flash.worn = Some((second_entry + 12, 0x01));
    let mut store = open(flash);
    assert_eq!(store.save(0, &new), Ok(Saved::Written));
    assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(new)));
    assert_eq!(store.load(UNIT, SENSOR, Which::Previous), Ok(Some(old)));
    let mut store = open(store.into_flash().back());
    assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(new)));
}

#[test]
fn an_identity_misread_once_gives_no_unit_the_record_of_another() {
    let mut store = open(Simulated::<4>::new(2));
    let record = numbered(UNIT, SENSOR, 1);
    store.save(0, &record).unwrap();
    let mut flash = store.into_flash();
    let identity = 64 + 4;
    flash.misread = Some((identity, 0x01));
    let mut store = open(flash);
    assert_eq!(store.in_force(UNIT ^ 1, SENSOR), Ok(None));
    assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(record)));
}

#[test]
fn a_record_of_a_newer_version_outlasts_turnovers() {
    let mut store = open(Simulated::<1>::new(2));
    store.save(0, &numbered(UNIT, SENSOR, 1)).unwrap();
    let mut flash = store.into_flash();
    let entry = &mut flash.memory[64..64 + 192];
    let length = usize::from(entry[1]);
    let record = &mut entry[12..12 + length];
    let found = NEWER;
    record[2] = found;
    sign(record);
    sign(entry);
    let mut store = open(flash.back());
    let newer = Err(StoreError::Decode(DecodeError::UnknownVersion { found }));
    for number in 0..100 {
        assert_eq!(store.in_force(UNIT, SENSOR), newer);
        store.save(0, &numbered(UNIT + 1, SENSOR, number)).unwrap();
    }
    let own = numbered(UNIT, SENSOR, 3);
    assert_eq!(store.save(0, &own), Ok(Saved::Written));
    assert_eq!(store.in_force(UNIT, SENSOR), Ok(Some(own)));
}

#[test]
fn what_cannot_be_a_record_is_not_stored() {
    let mut store = open(Simulated::<4>::new(2));
    let mut record = numbered(UNIT, SENSOR, 1);
    record.record.model.bias[1] = f32::NAN;
    let wanted = Err(StoreError::Encode(EncodeError::NotFinite(Field::Numbers(
        RecordPart::Bias,
    ))));
    assert_eq!(store.save(0, &record), wanted);
    assert!(store.into_flash().operations.is_empty());
}

#[test]
fn all_is_forgotten_when_it_is_erased() {
    let mut store = open(Simulated::<4>::new(2));
    for number in 0..50 {
        store.save(0, &numbered(UNIT, SENSOR, number)).unwrap();
    }
    store.erase().unwrap();
    assert_eq!(store.in_force(UNIT, SENSOR), Ok(None));
    let flash = store.into_flash();
    assert!(flash.memory.iter().all(|byte| *byte == 0xFF));
}

#[test]
fn the_count_of_banks_starts_again_from_zero_when_it_is_full() {
    let mut store = open(Simulated::<4>::new(2));
    let mut model = Model::default();
    let mut save = |store: &mut RecordStore<Simulated<4>>, number| {
        let update = Update::Save(numbered(UNIT, SENSOR, number).into());
        make(&update, store).unwrap();
        model.make(&update);
        assert_eq!(model.read(store), model, "record {number}");
    };
    save(&mut store, 0);
    let mut flash = store.into_flash();
    for copy in [0, 32] {
        let header = &mut flash.memory[copy..copy + 20];
        header[4..8].copy_from_slice(&(u32::MAX - 1).to_le_bytes());
        sign(header);
    }
    let mut store = open(flash.back());
    (1..100).for_each(|number| save(&mut store, number));
    assert!(store.into_flash().erasures.iter().sum::<u32>() > 4);
}

/// Saves and loads as the monitor of a redundant set does.
fn through_storage<T: Real>(record: &Record<T>) -> Option<Record<T>> {
    let mut store = open(Simulated::<4>::new(2));
    let mut storage = store.at(0, Some(25.0));
    Storage::<T>::save(&mut storage, record).unwrap();
    let loaded = storage.load(record.identity, record.sensor).unwrap();
    let stored = store.in_force(record.identity, record.sensor).unwrap().unwrap();
    assert_eq!(stored.temperature, Some(25.0));
    loaded
}

#[test]
fn it_stores_for_monitors_of_single_and_double_precision() {
    let single = numbered(UNIT, SENSOR, 1).record;
    assert_eq!(through_storage::<f32>(&single), Some(single));
    let mut double: Record<f64> = numbered(UNIT, SENSOR, 1).record_in();
    double.model.bias[2] = 0.1;
    let loaded = through_storage::<f64>(&double).unwrap();
    assert_eq!(loaded.model.bias[2], f64::from(0.1_f32));
    double.model.bias[2] = loaded.model.bias[2];
    assert_eq!(loaded, double);
}

#[test]
fn the_primarys_record_returns_from_flash_with_its_residual() {
    let mut store = open(Simulated::<4>::new(2));
    let none = PrimaryCalibration::<f32>::stored(UNIT, &mut store.at(0, None)).unwrap();
    assert_eq!(none, None);
    let record = Record {
        model: ErrorModel {
            matrix: Matrix3::identity() * 1.01,
            bias: Vector3::new(0.1, -0.2, 0.3),
        },
        residual: 0.004,
        ..numbered(UNIT, SENSOR, 1).record_in::<f32>()
    };
    store.save_factory(0, &StoredRecord::of(&record, None)).unwrap();
    let found = PrimaryCalibration::<f32>::stored(UNIT, &mut store.at(0, None)).unwrap();
    let found = found.expect("there is one");
    assert_eq!(found.model(SENSOR), &record.model);
    assert_eq!(found.residual(SENSOR), 0.004);
    assert_eq!(found.model(Sensor::Gyroscope), &ErrorModel::identity());
    let gone = PrimaryCalibration::<f32>::stored(UNIT + 1, &mut store.at(0, None)).unwrap();
    assert_eq!(gone, None);
}
