//! Flash that answers reads with errors, words that die and a bus that fails at times: no acknowledged record is lost.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tumble_core::redundancy::sensor::{SENSORS, Sensor};
use tumble_store::flash::{RecordStore, StoreError};

use crate::common::ecc::{Bus, Defect, Ecc};
use crate::common::history::{Model, TRIADS, UNLIMITED, Update, drawn, make, numbered, numbered_of, open};
use crate::common::simulated::{Cut, Cuttable, Fault, Operation, PAGE, Remains};
use crate::marginal::losses;

#[test]
fn half_programmed_words_that_answer_with_errors_lose_nothing() {
    let lost = [losses::<Ecc<8>>(2000, 1, 61), losses::<Ecc<32>>(2000, 1, 62)];
    assert_eq!(lost, [0; 2]);
}

#[test]
fn cuts_upon_cuts_in_flash_with_ecc_lose_nothing() {
    let lost = [losses::<Ecc<8>>(150, 12, 71), losses::<Ecc<32>>(150, 12, 72)];
    assert_eq!(lost, [0; 2]);
}

#[test]
#[ignore = "takes minutes"]
fn long_sequences_of_cuts_in_flash_with_ecc_lose_nothing() {
    let lost = [
        losses::<Ecc<8>>(50_000, 2, 81),
        losses::<Ecc<32>>(50_000, 2, 82),
        losses::<Ecc<8>>(5_000, 20, 83),
        losses::<Ecc<32>>(5_000, 20, 84),
    ];
    assert_eq!(lost, [0; 4]);
}

#[test]
fn what_a_cut_first_erasure_leaves_proves_no_bank() {
    let save = |number| Update::Save(numbered_of(1, TRIADS[2], number));
    let cut_in = |mut flash: Ecc<32>, number, after, remains| {
        flash.cut_in(Some(Cut { after, remains }));
        let mut store = open(flash);
        assert!(make(&save(number), &mut store).is_err());
        store.into_flash().back()
    };
    let mut erasures = 0;
    for seed in 0..2000 {
        // In the header of the first bank, which is read in some boots.
        let flash = cut_in(Ecc::seeded(2, seed), 1, 1, Remains::MarginalAfter(0));
        let mut trial = open(flash.clone());
        make(&save(2), &mut trial).unwrap();
        if trial.into_flash().operations()[0] == Operation::Erase {
            erasures += 1;
            let flash = cut_in(flash, 2, 0, Remains::Marginal);
            assert_eq!(make(&save(3), &mut open(flash)), Ok(()), "seed {seed}");
        }
    }
    assert!(erasures > 100, "{erasures} erasures");
}

/// A defect somewhere in a flash: of a word, and which.
fn draw_defect<const WORD: usize>(random: &mut Pcg64Mcg) -> (usize, Defect) {
    let defect = match random.random_range(0..5) {
        0 => Defect::Unreadable,
        1 => Defect::TakesNothing,
        2 => Defect::FailsToProgram,
        _ => {
            let bit = 1 << random.random_range(0..8);
            Defect::Stuck(random.random_range(0..WORD), bit, random.random())
        }
    };
    (random.random_range(0..2 * PAGE / WORD), defect)
}

/// Saves records of three sensors in flash with defects, for as long as it takes to use both banks twice; returns how many
/// trials could not save or lost something.
fn failures<const WORD: usize>(trials: usize, defects: usize, seed: u64) -> usize {
    println!("seed {seed}");
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut failed = 0;
    for trial in 0..trials {
        let mut flash = Ecc::<WORD>::seeded(2, random.random());
        flash.defects = (0..defects).map(|_| draw_defect::<WORD>(&mut random)).collect();
        let defects = flash.defects.clone();
        let (mut store, mut model) = (open(flash), Model::default());
        let lost = (0..70).find_map(|number| {
            if random.random_bool(0.1) {
                store = reopened(&mut store);
            }
            let triad = TRIADS[random.random_range(0..3)];
            let record = numbered_of(random.random_range(1..=2), triad, number);
            let update = if number < 3 {
                Update::SaveFactory(record)
            } else {
                Update::Save(record)
            };
            let outcome = make(&update, &mut store);
            model.make(&update);
            (outcome.is_err() || model.read(&mut store) != model).then_some((number, outcome))
        });
        if let Some(what) = lost {
            println!("trial {trial}: {what:?}, {defects:?}");
            failed += 1;
        }
    }
    failed
}

/// The same flash after a start.
fn reopened<const WORD: usize>(store: &mut RecordStore<Ecc<WORD>>) -> RecordStore<Ecc<WORD>> {
    let empty = open(Ecc::<WORD>::seeded(2, 0));
    open(std::mem::replace(store, empty).into_flash().back())
}

#[test]
fn dead_words_and_stuck_bits_are_passed_over() {
    let failed = [
        failures::<4>(100, 1, 91),
        failures::<8>(100, 1, 92),
        failures::<32>(100, 1, 93),
    ];
    assert_eq!(failed, [0; 3]);
}

#[test]
#[ignore = "takes minutes"]
fn two_thousand_dead_words_and_stuck_bits_are_passed_over() {
    let failed = [
        failures::<4>(2000, 1, 94),
        failures::<8>(2000, 1, 95),
        failures::<32>(2000, 1, 96),
    ];
    assert_eq!(failed, [0; 3]);
}

/// A used store and what is in it.
fn used(seed: u64) -> (Ecc<8>, Model) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let (mut store, mut model) = (open(Ecc::<8>::seeded(2, seed)), Model::default());
    for number in 0..40 {
        let update = drawn(&mut random, 2, number);
        make(&update, &mut store).unwrap();
        model.make(&update);
    }
    (store.into_flash().back(), model)
}

#[test]
fn reads_that_fail_in_passing_lose_no_record() {
    let (mut flash, mut model) = used(1);
    flash.bus = Bus::FailsOnceIn(100);
    let mut store = open(flash);
    for number in 100..400 {
        let update = Update::Save(numbered(1, Sensor::Gyroscope, number).into());
        make(&update, &mut store).unwrap();
        model.make(&update);
        assert_eq!(model.read(&mut store), model);
    }
}

#[test]
fn flash_that_stops_answering_is_an_error_and_no_empty_store() {
    let (flash, model) = used(2);
    for stops_after in 0..60 {
        let mut flash = flash.clone();
        flash.bus = Bus::FailsFrom(flash.calls.get()[0] + stops_after);
        let mut store = open(flash);
        let saved = store.save(0, &numbered(1, Sensor::Gyroscope, 1000));
        let mut flash = store.into_flash();
        assert!(!matches!(saved, Err(StoreError::NotAsWritten)));
        let fault = matches!(saved, Err(StoreError::Flash(Fault::Misused(_))));
        assert!(fault || saved.is_ok());
        flash.bus = Bus::Sound;
        let mut new = model.clone();
        new.make(&Update::Save(numbered(1, Sensor::Gyroscope, 1000).into()));
        let found = new.read(&mut open(flash.back()));
        assert!(found == model || found == new, "after {stops_after} reads");
    }
}

#[test]
fn the_previous_records_make_room_before_the_store_is_full() {
    let mut store = open(Ecc::<8>::seeded(2, 3));
    let entries = store.entries();
    for number in 0..3 * entries {
        let identity = u64::from(number % (entries - 1));
        store
            .save(0, &numbered(identity, Sensor::Gyroscope, number))
            .unwrap();
    }
    for identity in 0..u64::from(entries - 1) {
        let found = store.in_force(identity, Sensor::Gyroscope).unwrap().unwrap();
        assert_eq!(
            u64::from(found.record.sequence) % u64::from(entries - 1),
            identity
        );
    }
}

/// Saves records in sectors of 128 KiB, each after a start or all in one boot; gives the most reads of a save, and of one
/// that makes a bank.
fn most_reads(starts: bool) -> [usize; 2] {
    const SECTOR: u32 = 128 * 1024;
    let open = |flash| RecordStore::new(flash, 0..2 * SECTOR, UNLIMITED).unwrap();
    let flash = Ecc::<32>::new(2 * SECTOR as usize, 4);
    let calls = flash.calls.clone();
    let mut store = open(flash);
    for (identity, sensor) in (1..=3).flat_map(|identity| SENSORS.map(|sensor| (identity, sensor))) {
        store.save_factory(0, &numbered(identity, sensor, 0)).unwrap();
    }
    let mut most = [0; 2];
    for number in 1..1500 {
        if starts {
            store = open(store.into_flash());
        }
        let [reads, erasures] = calls.get();
        let record = numbered(u64::from(number % 3) + 1, SENSORS[number as usize % 2], number);
        store.save(0, &record).unwrap();
        let makes_a_bank = usize::from(calls.get()[1] > erasures);
        most[makes_a_bank] = most[makes_a_bank].max(calls.get()[0] - reads);
    }
    most
}

#[test]
fn a_save_into_a_sector_of_128_kib_takes_few_reads() {
    let [most, most_of_a_bank] = most_reads(false);
    println!("reads of a save: {most}, of one that makes a bank: {most_of_a_bank}");
    assert!(most < 40 && most_of_a_bank < 1500);
    let [most, most_of_a_bank] = most_reads(true);
    println!("the same after a start: {most} and {most_of_a_bank}");
    assert!(most < 150 && most_of_a_bank < 1600);
}
