//! Power is cut in the middle of a word or of an erasure, and leaves cells that read one way for a whole boot and another
//! way in the next: no acknowledged record is lost, however often.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tumble_store::flash::{RecordStore, StoreError, Which};

use crate::common::history::{Stored, TRIADS, Triad, Update, load, make, numbered_of, open};
use crate::common::simulated::{Cut, Cuttable, Fault, Operation, Remains, Simulated};

/// A record that was to be stored, whether or not it was acknowledged, of a triad and kind.
#[derive(Clone)]
struct Promised {
    factory: bool,
    /// The last that was acknowledged, and all since whose storing was cut: any of them may be there.
    may_be: Vec<Option<Stored>>,
}

/// Guarantees given by the store for each triad of two units.
#[derive(Clone)]
struct Promises(Vec<((u64, Triad), Promised)>);

impl Promises {
    fn none() -> Self {
        let triads = (1..=2).flat_map(|unit| TRIADS.map(|triad| (unit, triad)));
        let kinds = triads.flat_map(|key| [(key, false), (key, true)]);
        let nothing = |factory| Promised {
            factory,
            may_be: vec![None],
        };
        Self(kinds.map(|(key, factory)| (key, nothing(factory))).collect())
    }

    /// Takes note of an update, which was acknowledged or cut.
    fn note(&mut self, update: &Update, acknowledged: bool) {
        let (record, of_factory) = match update {
            Update::Save(record) => (record, false),
            Update::SaveFactory(record) => (record, true),
            Update::SaveDrift(_) | Update::RollBack(..) => return,
        };
        for (key, promised) in &mut self.0 {
            if *key == record.key() && promised.factory == of_factory {
                if acknowledged {
                    promised.may_be.clear();
                }
                promised.may_be.push(Some(*record));
            }
        }
    }

    /// Returns a description of the first record lost.
    fn broken<F: Cuttable>(&self, store: &mut RecordStore<F>) -> Option<String> {
        self.0.iter().find_map(|(key, promised)| {
            let which = if promised.factory {
                Which::Factory
            } else {
                Which::Last
            };
            let found = load(store, *key, which);
            let kept = matches!(&found, Ok(found) if promised.may_be.contains(found));
            (!kept).then(|| {
                let may_be = &promised.may_be;
                format!("{which:?} of {key:?}: {found:?}, of {may_be:?}")
            })
        })
    }
}

/// A flash with what was promised of it.
#[derive(Clone)]
struct Device<F: Cuttable> {
    flash: F,
    promises: Promises,
    /// Number of the last record.
    number: u32,
    /// The last update, which may be tried again.
    last: Option<Update>,
}

impl<F: Cuttable> Device<F> {
    fn new(seed: u64) -> Self {
        Self {
            flash: F::seeded(2, seed),
            promises: Promises::none(),
            number: 0,
            last: None,
        }
    }

    /// A new update, or at times the last one again.
    fn update(&mut self, random: &mut Pcg64Mcg) -> Update {
        if let Some(last) = self.last.filter(|_| random.random_bool(0.2)) {
            return last;
        }
        self.number += 1;
        let triad = TRIADS[random.random_range(0..3)];
        let record = numbered_of(random.random_range(1..=2), triad, self.number);
        let update = if random.random_bool(0.1) {
            Update::SaveFactory(record)
        } else {
            Update::Save(record)
        };
        self.last = Some(update);
        update
    }

    /// A boot: some updates, with power cut in the last of them if so wanted. Gives what the boot before lost.
    fn boot(&mut self, random: &mut Pcg64Mcg, updates: usize, cut: bool) -> Option<String> {
        let updates: Vec<Update> = (0..updates).map(|_| self.update(random)).collect();
        let mut flash = self.flash.clone().back();
        let drawn = cut.then(|| draw_cut(&flash, random, &updates)).flatten();
        flash.cut_in(drawn);
        let cut_in = drawn.and(updates.len().checked_sub(1));
        let mut store = open(flash);
        let lost = self.promises.broken(&mut store);
        for (index, update) in updates.iter().enumerate() {
            let outcome = make(update, &mut store);
            let is_cut = cut_in == Some(index);
            let wanted = if is_cut {
                Err(StoreError::Flash(Fault::PowerCut))
            } else {
                Ok(())
            };
            assert_eq!(outcome, wanted, "{update:?}");
            self.promises.note(update, !is_cut);
        }
        self.flash = store.into_flash();
        lost
    }
}

/// A cut somewhere in the last of some updates, if it changes flash.
fn draw_cut<F: Cuttable>(flash: &F, random: &mut Pcg64Mcg, updates: &[Update]) -> Option<Cut> {
    let operations = |updates: &[Update]| {
        let mut store = open(flash.clone());
        updates
            .iter()
            .for_each(|update| make(update, &mut store).unwrap());
        store.into_flash().operations().to_vec()
    };
    let (_, before) = updates.split_last()?;
    let (first, all) = (operations(before).len(), operations(updates));
    let operations = &all[first..];
    let count = operations.len();
    if count == 0 {
        return None;
    }
    // The last operations of a turnover, of which there are few, as often as the many before.
    let which = if random.random_bool(0.5) {
        count - 1 - random.random_range(0..count.min(5))
    } else {
        random.random_range(0..count)
    };
    let remains = match operations[which] {
        Operation::Erase => F::ERASURES[random.random_range(0..F::ERASURES.len())],
        Operation::Write { bytes } => {
            let words = bytes / F::WRITE_SIZE;
            // The first and the last word are what a reader judges by.
            let word = [0, words - 1, random.random_range(0..words)][random.random_range(0..3)];
            Remains::MarginalAfter(word * F::WRITE_SIZE)
        }
    };
    let after = first + which;
    Some(Cut { after, remains })
}

/// Cuts power in so many boots, one after the other or with one between them, then boots without cuts; gives what is
/// lost.
fn fate<F: Cuttable>(device: &Device<F>, random: &mut Pcg64Mcg, cuts: usize) -> Option<String> {
    let mut device = device.clone();
    device.flash.reseed(random.random());
    let mut lost = None;
    for _ in 0..cuts {
        let updates = random.random_range(1..=2);
        lost = lost.or_else(|| device.boot(random, updates, true));
        if random.random_bool(0.2) {
            lost = lost.or_else(|| device.boot(random, 0, false));
        }
    }
    for _ in 0..4 {
        let updates = random.random_range(0..=2);
        lost = lost.or_else(|| device.boot(random, updates, false));
    }
    lost
}

/// Tries cuts on flash of all ages; gives how many lost something.
pub fn losses<F: Cuttable>(trials: usize, cuts: usize, seed: u64) -> usize {
    println!("seed {seed}");
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut lost = 0;
    let mut device = Device::<F>::new(seed);
    for trial in 0..trials {
        if trial % 20 == 0 {
            device = Device::new(seed + trial as u64);
            for _ in 0..random.random_range(0..30) {
                let updates = random.random_range(0..4);
                assert_eq!(device.boot(&mut random, updates, false), None);
            }
        }
        if let Some(what) = fate(&device, &mut random, cuts) {
            if lost < 5 {
                println!("trial {trial}: {what}");
            }
            lost += 1;
        }
    }
    lost
}

#[test]
fn pairs_of_cuts_that_leave_marginal_cells_lose_nothing() {
    let lost = [
        losses::<Simulated<1>>(1000, 2, 31),
        losses::<Simulated<4>>(1000, 2, 32),
        losses::<Simulated<8>>(1000, 2, 33),
        losses::<Simulated<32>>(1000, 2, 34),
    ];
    assert_eq!(lost, [0; 4]);
}

#[test]
fn cuts_upon_cuts_that_leave_marginal_cells_lose_nothing() {
    let lost = [
        losses::<Simulated<4>>(150, 12, 41),
        losses::<Simulated<32>>(150, 12, 42),
    ];
    assert_eq!(lost, [0; 2]);
}

#[test]
#[ignore = "takes minutes"]
fn long_sequences_of_cuts_with_marginal_cells_lose_nothing() {
    let lost = [
        losses::<Simulated<1>>(10_000, 20, 51),
        losses::<Simulated<4>>(10_000, 20, 52),
        losses::<Simulated<32>>(10_000, 20, 53),
    ];
    assert_eq!(lost, [0; 3]);
}

#[test]
#[ignore = "takes an hour"]
fn a_million_pairs_of_cuts_with_marginal_cells_lose_nothing() {
    let each = 250_000;
    let lost = std::thread::scope(|threads| {
        [
            threads.spawn(|| losses::<Simulated<1>>(each, 2, 300_000)),
            threads.spawn(|| losses::<Simulated<4>>(each, 2, 600_000)),
            threads.spawn(|| losses::<Simulated<8>>(each, 2, 900_000)),
            threads.spawn(|| losses::<Simulated<32>>(each, 2, 1_200_000)),
        ]
        .map(|thread| thread.join().expect("it ends"))
    });
    assert_eq!(lost, [0; 4]);
}

/// Flash of which the next save makes a bank, the number of its record, and the operations of that save.
fn about_to_turn_over() -> (Simulated<32>, u32, usize) {
    let mut flash = Simulated::<32>::seeded(2, 0);
    for number in 0.. {
        let mut store = open(flash.clone());
        make(&Update::Save(numbered_of(1, TRIADS[1], number)), &mut store).unwrap();
        let after = store.into_flash();
        if number > 0 && after.operations.contains(&Operation::Erase) {
            return (flash, number, after.operations.len());
        }
        flash = after.back();
    }
    unreachable!("banks are filled")
}

#[test]
fn a_bank_whose_erasure_was_cut_does_not_come_back() {
    let (full, number, operations) = about_to_turn_over();
    let save = |number| Update::Save(numbered_of(1, TRIADS[1], number));
    let cut_in = |flash: &Simulated<32>, number, after, remains| {
        let mut flash = flash.clone();
        flash.cut_in(Some(Cut { after, remains }));
        let mut store = open(flash);
        assert!(make(&save(number), &mut store).is_err());
        store.into_flash().back()
    };
    let (mut erasures, mut lost) = (0, 0);
    for seed in 0..300 {
        let mut flash = full.clone();
        flash.reseed(1000 * seed);
        // In the last word of the first entry after the copied ones, which may be read in this boot or not.
        let flash = cut_in(&flash, number, operations - 1, Remains::MarginalAfter(160));
        let mut trial = open(flash.clone());
        make(&save(number + 1), &mut trial).unwrap();
        if trial.into_flash().operations[0] == Operation::Erase {
            erasures += 1;
            let flash = cut_in(&flash, number + 1, 0, Remains::MarginalFront);
            let last = load(&mut open(flash), (1, TRIADS[1]), Which::Last).unwrap();
            let may_be = [number - 1, number, number + 1].map(|number| numbered_of(1, TRIADS[1], number));
            lost += u32::from(!last.is_some_and(|last| may_be.contains(&last)));
        }
    }
    assert!(erasures > 100 && lost == 0, "{erasures} erasures, {lost} lost");
}
