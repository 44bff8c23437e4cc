//! Power is cut wherever it can be; then the old or the new record is there, whole, and so are all others.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tumble_core::redundancy::sensor::Sensor;
use tumble_store::flash::StoreError;

use crate::common::history::{Model, Update, drawn, make, numbered, open};
use crate::common::simulated::{Cut, ERASURES, Fault, Operation, Remains, Simulated};

/// All that a cut in an operation may leave.
fn remains<const WORD: usize>(operation: Operation) -> Vec<Remains> {
    match operation {
        Operation::Erase => ERASURES.to_vec(),
        Operation::Write { bytes } => {
            let torn = (0..bytes).step_by(WORD).map(Remains::TornAfter);
            (0..=bytes).map(Remains::Bytes).chain(torn).collect()
        }
    }
}

/// Makes an update with power cut in it, then looks at what is there; panics if that is neither the old nor the new.
fn cut_in<const WORD: usize>(flash: &Simulated<WORD>, old: &Model, new: &Model, update: &Update, cut: Cut) {
    let mut flash = flash.clone();
    flash.cut = Some(cut);
    let mut store = open(flash);
    assert_eq!(
        make(update, &mut store),
        Err(StoreError::Flash(Fault::PowerCut)),
        "{cut:?}"
    );
    let mut store = open(store.into_flash().back());
    let found = new.read(&mut store);
    assert!(
        found == *new || found == old.read_keys(new),
        "{update:?}, {cut:?}: {found:#?}"
    );
    let later = Update::Save(numbered(1, Sensor::Gyroscope, 1_000_000).into());
    make(&later, &mut store).expect("writing works again");
    let mut model = found;
    model.make(&later);
    assert_eq!(model.read(&mut store), model, "after {update:?}, {cut:?}");
}

/// Makes updates, and from one of them on cuts power everywhere; gives how many cuts there were, and turnovers.
fn cut_everywhere<const WORD: usize>(
    pages: usize,
    units: u64,
    from: u32,
    to: u32,
    seed: u64,
) -> (usize, usize) {
    println!("seed {seed}");
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let (mut flash, mut model) = (Simulated::<WORD>::new(pages), Model::default());
    let (mut cuts, mut turnovers) = (0, 0);
    for number in 0..to {
        let update = drawn(&mut random, units, number);
        let mut new = model.clone();
        new.make(&update);
        let mut store = open(flash.clone());
        make(&update, &mut store).unwrap();
        assert_eq!(new.read(&mut store), new, "{update:?}");
        let after = store.into_flash();
        let operations = after.operations.iter().enumerate().filter(|_| number >= from);
        for (done, operation) in operations {
            turnovers += usize::from(*operation == Operation::Erase);
            for remains in remains::<WORD>(*operation) {
                cut_in(&flash, &model, &new, &update, Cut { after: done, remains });
                cuts += 1;
            }
        }
        (flash, model) = (after.back(), new);
    }
    (cuts, turnovers)
}

impl Model {
    /// The same model, with an entry for each sensor that another has.
    fn read_keys(&self, other: &Model) -> Model {
        let mut model = self.clone();
        for key in other.0.keys() {
            model.0.entry(*key).or_default();
        }
        model
    }
}

/// Cuts power everywhere in the first updates of erased flash, and in those about the first turnover.
fn prove<const WORD: usize>(units: u64, seed: u64) {
    let (cuts, erasures) = cut_everywhere::<WORD>(2, units, 0, 2, seed);
    assert!(cuts > 300 && erasures == 1, "{cuts} cuts, {erasures} erasures");
    let (cuts, erasures) = cut_everywhere::<WORD>(2, units, 19, 26, seed);
    assert!(cuts > 3000 && erasures >= 1, "{cuts} cuts, {erasures} erasures");
}

#[test]
fn a_cut_leaves_the_old_or_new_record_with_words_of_1_byte() {
    prove::<1>(2, 11);
}

#[test]
fn a_cut_leaves_the_old_or_new_record_with_words_of_4_bytes() {
    prove::<4>(3, 12);
}

#[test]
fn a_cut_leaves_the_old_or_new_record_with_words_of_32_bytes() {
    prove::<32>(3, 13);
}

#[test]
#[ignore = "takes an hour"]
fn a_cut_in_long_sequences_leaves_the_old_or_the_new_record() {
    for seed in 100..102 {
        cut_everywhere::<1>(2, 3, 0, 300, seed);
        cut_everywhere::<4>(4, 7, 0, 300, seed);
        cut_everywhere::<8>(2, 2, 0, 300, seed);
        cut_everywhere::<32>(4, 5, 0, 300, seed);
    }
}

/// Updates under a power supply that fails again and again, also in what puts right what the failure before left.
fn cut_again_and_again<const WORD: usize>(pages: usize, units: u64, updates: u32, seed: u64) {
    println!("seed {seed}");
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let (mut flash, mut model) = (Simulated::<WORD>::new(pages), Model::default());
    for number in 0..updates {
        let update = drawn(&mut random, units, number);
        let mut new = model.clone();
        new.make(&update);
        let mut trial = open(flash.clone());
        make(&update, &mut trial).unwrap();
        let operations = trial.into_flash().operations;
        let mut store = open(flash);
        if !operations.is_empty() && random.random_bool(0.6) {
            let after = random.random_range(0..operations.len());
            let all = remains::<WORD>(operations[after]);
            let remains = all[random.random_range(0..all.len())];
            let mut flash = store.into_flash();
            flash.cut = Some(Cut { after, remains });
            store = open(flash);
            assert!(make(&update, &mut store).is_err());
        } else {
            make(&update, &mut store).unwrap();
        }
        let mut store = open(store.into_flash().back());
        let found = new.read(&mut store);
        assert!(
            found == new || found == model.read_keys(&new),
            "update {number}, {update:?}: {found:#?}"
        );
        (flash, model) = (store.into_flash(), found);
    }
}

#[test]
fn cuts_upon_cuts_leave_the_old_or_the_new_record() {
    cut_again_and_again::<1>(2, 3, 500, 21);
    cut_again_and_again::<4>(4, 5, 500, 22);
    cut_again_and_again::<8>(2, 2, 500, 23);
    cut_again_and_again::<32>(2, 3, 500, 24);
}

#[test]
#[ignore = "takes an hour"]
fn repeated_cuts_in_long_sequences_leave_the_old_or_new_record() {
    for seed in 200..204 {
        cut_again_and_again::<1>(2, 3, 50_000, seed);
        cut_again_and_again::<8>(6, 6, 50_000, seed);
    }
}
