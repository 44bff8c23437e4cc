//! Flash that changed by itself: never a panic, never a record that nobody wrote, and afterwards it can be written
//! again.

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tumble_core::redundancy::sensor::Sensor;
use tumble_store::flash::Which;

use crate::common::history::{
    Kept, Model, Stored, Triad, Update, drawn, drift_of, load, make, numbered, numbered_drift, open,
};
use crate::common::sign;
use crate::common::simulated::{Cut, Operation, PAGE, Remains, Simulated};

/// Flash after many updates, what is stored in it, and all that ever was.
fn used(seed: u64) -> (Simulated<4>, Model, Vec<Stored>) {
    println!("seed {seed}");
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let (mut store, mut model) = (open(Simulated::<4>::new(2)), Model::default());
    let mut all = Vec::new();
    for number in 0..60 {
        let update = drawn(&mut random, 3, number);
        if let Update::Save(record) | Update::SaveFactory(record) = update {
            all.push(record);
        }
        make(&update, &mut store).unwrap();
        model.make(&update);
    }
    (store.into_flash().back(), model, all)
}

/// Reads whatever can be read; panics at a record that nobody wrote for that sensor. Gives how many sensors answer
/// otherwise than they should.
fn read_all(flash: &Simulated<4>, model: &Model, all: &[Stored]) -> usize {
    let mut store = open(flash.clone());
    let mut others = 0;
    for (key, kept) in &model.0 {
        let mut found = Kept::default();
        for (which, place) in [
            (Which::Last, &mut found.last),
            (Which::Previous, &mut found.previous),
            (Which::Factory, &mut found.factory),
        ] {
            let Ok(record) = load(&mut store, *key, which) else {
                continue;
            };
            *place = record;
            let Some(record) = record else { continue };
            assert!(all.contains(&record), "a record that nobody wrote: {record:?}");
            assert_eq!(record.key(), *key);
        }
        found.drift = drift_of(&mut store, *key).unwrap_or(None);
        let written = |drift| match *key {
            (identity, Triad::Of(sensor)) => {
                (0..60).any(|n| numbered_drift(identity, sensor, n).drift == drift)
            }
            (_, Triad::Magnetometer) => false,
        };
        assert!(
            found.drift.is_none_or(written),
            "a drift that nobody wrote: {:?}",
            found.drift
        );
        others += usize::from(found != *kept);
    }
    others
}

/// Saves a record in damaged flash, which has to work.
fn write_again(flash: &Simulated<4>) {
    let mut store = open(flash.clone().back());
    let record = numbered(1, Sensor::Gyroscope, 1_000_000);
    store.save(0, &record).unwrap();
    assert_eq!(store.in_force(1, Sensor::Gyroscope), Ok(Some(record)));
}

/// The page in use: the one whose header has the higher sequence.
fn page_in_use(flash: &Simulated<4>) -> usize {
    let sequence = |page: usize| u32::from_le_bytes(flash.memory[page * PAGE + 4..][..4].try_into().unwrap());
    usize::from(sequence(1) > sequence(0))
}

#[test]
fn a_single_changed_bit_costs_nothing() {
    let (flash, model, all) = used(1);
    assert_eq!(read_all(&flash, &model, &all), 0);
    // All of the headers; every third byte of the page in use, and of the other one, which is not read, fewer.
    let in_use = page_in_use(&flash);
    let is_tried = |byte: &usize| {
        let step = if byte / PAGE == in_use { 3 } else { 16 };
        byte % PAGE < 64 || byte.is_multiple_of(step)
    };
    for byte in (0..flash.memory.len()).filter(is_tried) {
        for bit in 0..8 {
            let mut flash = flash.clone();
            flash.memory[byte] ^= 1 << bit;
            assert_eq!(read_all(&flash, &model, &all), 0, "bit {bit} of byte {byte}");
            if byte % 16 == 0 {
                write_again(&flash);
            }
        }
    }
}

#[test]
fn a_changed_bit_is_corrected_when_its_entry_is_copied() {
    let (flash, mut model, _) = used(3);
    let entry = (0..21)
        .map(|slot| page_in_use(&flash) * PAGE + 64 + 192 * slot)
        .find(|start| flash.memory[*start] == b'F')
        .expect("a record is the factory's");
    let updates = (1000..1021).map(|number| Update::Save(numbered(1, Sensor::Gyroscope, number).into()));
    let updates: Vec<Update> = updates.collect();
    updates.iter().for_each(|update| model.make(update));
    for bit in (0..8 * 192).step_by(5) {
        let mut flash = flash.clone();
        let erasures = flash.erasures.clone();
        flash.memory[entry + bit / 8] ^= 1 << (bit % 8);
        let mut store = open(flash);
        for update in &updates {
            make(update, &mut store).unwrap();
        }
        assert_eq!(model.read(&mut store), model, "bit {bit}");
        assert_ne!(store.into_flash().erasures, erasures);
    }
}

#[test]
fn a_header_cut_between_its_copies_is_open_to_one_bit() {
    let first = numbered(1, Sensor::Gyroscope, 1);
    let mut flash = Simulated::<4>::new(2);
    flash.cut = Some(Cut {
        after: 2,
        remains: Remains::Bytes(0),
    });
    let mut store = open(flash);
    store.save(0, &first).unwrap_err();
    let flash = store.into_flash();
    let header = Operation::Write { bytes: 32 };
    assert_eq!(flash.operations, [Operation::Erase, header, header]);
    let mut store = open(flash.back());
    store.save(0, &first).unwrap();
    let flash = store.into_flash();
    for (byte, bit) in (0..flash.memory.len()).flat_map(|byte| (0..8).map(move |bit| (byte, bit))) {
        if byte % PAGE < 64 {
            let mut flash = flash.clone();
            flash.memory[byte] ^= 1 << bit;
            assert_eq!(open(flash).in_force(1, Sensor::Gyroscope), Ok(Some(first)));
        }
    }
}

#[test]
fn damage_of_any_kind_gives_no_record_that_nobody_wrote() {
    let (flash, model, all) = used(2);
    let mut random = Pcg64Mcg::seed_from_u64(3);
    for trial in 0..1000 {
        let mut flash = flash.clone();
        let size = flash.memory.len();
        let start = random.random_range(0..size);
        let end = random.random_range(start..=size);
        let memory = &mut flash.memory;
        match trial % 6 {
            0 => random.fill_bytes(&mut memory[start..end]),
            1 => random.fill_bytes(&mut memory[..PAGE]),
            2 => memory[start..].fill(0xFF),
            3 => memory[start..end].fill(0),
            4 => {
                let to = random.random_range(0..=size - (end - start));
                memory.copy_within(start..end, to);
            }
            _ => memory[start..end]
                .iter_mut()
                .for_each(|byte| *byte ^= 1 << random.random_range(0..8)),
        }
        read_all(&flash, &model, &all);
        write_again(&flash);
    }
}

#[test]
fn a_whole_record_under_another_sensors_name_is_not_returned() {
    let mut store = open(Simulated::<4>::new(2));
    store.save(0, &numbered(7, Sensor::Gyroscope, 1)).unwrap();
    let mut flash = store.into_flash();
    let entry = &mut flash.memory[64..64 + 192];
    entry[4] = 8;
    sign(entry);
    assert!(open(flash).in_force(8, Sensor::Gyroscope).is_err());
}
