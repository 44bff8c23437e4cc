//! Blocks of a second, from which errors are learnt once the next block has ended in agreement.

use super::error::{RateBlock, SecondaryErrors};
use super::motion::{Lever, MOTION, MotionOfSet};
use super::table::FORCE_WINDOWS;
use super::window::UnitWindow;
use crate::real::{Real, count};
use crate::redundancy::unit_count::{UnitCount, Units};
use crate::redundancy::unit_set::UnitSet;

/// Windows from one to the next whose angular rates count as independent.
const OTHER_RATE: u32 = 2;
/// Means of specific force in a block.
const FORCES: usize = 2;

/// Mean of specific forces over some windows, of units that were whole.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ForceMean<T: Real, const UNITS: usize> {
    force: [T; 3],
    lever: Lever<T>,
    /// Secondary minus primary, m/s^2, without what is not linear in the parameters.
    difference: [[T; 3]; UNITS],
    whole: UnitSet,
}

/// Sums of a mean.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ForceSums<T: Real, const UNITS: usize> {
    motion: [T; MOTION],
    reading: [[T; 3]; UNITS],
    whole: UnitSet,
    windows: u8,
}

/// One block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearningBlock<T: Real, const UNITS: usize>
where
    Units<UNITS>: UnitCount,
{
    rates: <Units<UNITS> as UnitCount>::OfSecondaries<RateBlock<T>>,
    forces: [Option<ForceMean<T, UNITS>>; FORCES],
    /// All pairs agreed.
    pub is_calm: bool,
    /// Units that counted throughout.
    pub active: UnitSet,
    /// Units of which the delay of the clock was known throughout.
    pub timed: UnitSet,
    /// The set was at rest throughout.
    pub is_rest: bool,
    /// It was at no time known to be.
    pub is_motion: bool,
}

/// The block that goes on, and the sums of its next mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gathering<T: Real, const UNITS: usize>
where
    Units<UNITS>: UnitCount,
{
    /// The block.
    pub block: LearningBlock<T, UNITS>,
    sums: ForceSums<T, UNITS>,
}

impl<T: Real, const UNITS: usize> LearningBlock<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    /// Begins without information.
    pub fn new() -> Self {
        Self {
            rates: <Units<UNITS> as UnitCount>::filled(RateBlock::none()),
            forces: [None; FORCES],
            is_calm: true,
            active: UnitSet::of::<UNITS>(|_| true),
            timed: UnitSet::of::<UNITS>(|_| true),
            is_rest: true,
            is_motion: true,
        }
    }

    /// Adds what the block shows of one secondary.
    pub fn inform(&self, secondary: usize, errors: &mut SecondaryErrors<T>) {
        if let Some(rates) = self.rates.as_ref().get(secondary) {
            errors.add_rates(rates);
        }
        let unit = secondary + 1;
        for mean in self
            .forces
            .iter()
            .flatten()
            .filter(|mean| mean.whole.contain_both([0, unit]))
        {
            if let Some(difference) = mean.difference.get(unit) {
                errors.add_force(&mean.force, &mean.lever, difference);
            }
        }
    }
}

impl<T: Real, const UNITS: usize> Gathering<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    /// Begins the first block.
    pub fn new() -> Self {
        Self {
            block: LearningBlock::new(),
            sums: ForceSums::new(),
        }
    }

    /// Takes a window: its number since the first, the motion of the set, units from which to learn, and their errors
    /// (docs/theory/set.md, eq. 8).
    pub fn take(
        &mut self,
        number: u32,
        windows: &[UnitWindow<T>; UNITS],
        motion: &MotionOfSet<T>,
        usable: UnitSet,
        errors: &[SecondaryErrors<T>],
    ) {
        let whole = UnitSet::of::<UNITS>(|unit| windows.get(unit).is_some_and(|window| window.is_whole));
        if number.is_multiple_of(OTHER_RATE) {
            self.take_rates(windows, motion, usable.and(whole));
        }
        self.sums.take(windows, motion, whole);
        if self.sums.windows >= FORCE_WINDOWS {
            let mean = self.sums.mean(usable, errors);
            self.sums = ForceSums::new();
            if let Some(place) = self.block.forces.iter_mut().find(|place| place.is_none()) {
                *place = Some(mean);
            }
        }
    }

    fn take_rates(&mut self, windows: &[UnitWindow<T>; UNITS], motion: &MotionOfSet<T>, usable: UnitSet) {
        let [primary, secondaries @ ..] = windows.as_slice() else {
            return;
        };
        let [_, _, _, x, y, z] = primary.reading;
        let blocks = self.block.rates.as_mut().iter_mut();
        for (secondary, (block, window)) in blocks.zip(secondaries).enumerate() {
            if usable.contain_both([0, secondary + 1]) {
                let [_, _, _, a, b, c] = window.reading;
                block.add(motion.rate(), &[a - x, b - y, c - z]);
            }
        }
    }

    /// Ends the block and begins the next.
    pub fn end_block(&mut self) -> LearningBlock<T, UNITS> {
        let done = self.block;
        self.block = LearningBlock::new();
        done
    }
}

impl<T: Real, const UNITS: usize> ForceSums<T, UNITS> {
    fn new() -> Self {
        Self {
            motion: [T::zero(); MOTION],
            reading: [[T::zero(); 3]; UNITS],
            whole: UnitSet::of::<UNITS>(|_| true),
            windows: 0,
        }
    }

    fn take(&mut self, windows: &[UnitWindow<T>; UNITS], motion: &MotionOfSet<T>, whole: UnitSet) {
        for (sum, value) in self.motion.iter_mut().zip(motion.channels()) {
            *sum += value;
        }
        for (sums, window) in self.reading.iter_mut().zip(windows) {
            sums.iter_mut()
                .zip(&window.reading)
                .for_each(|(sum, value)| *sum += *value);
        }
        self.whole = self.whole.and(whole);
        self.windows += 1;
    }

    fn mean(&self, usable: UnitSet, errors: &[SecondaryErrors<T>]) -> ForceMean<T, UNITS> {
        let share = T::one() / count(self.windows.into());
        let motion = MotionOfSet::of_channels(&self.motion.map(|sum| sum * share));
        let lever = motion.lever();
        let mut difference = self.reading.map(|sums| sums.map(|sum| sum * share));
        if let [primary, secondaries @ ..] = difference.as_mut_slice() {
            for (values, errors) in secondaries.iter_mut().zip(errors) {
                let curved = errors.bilinear(&lever);
                for ((value, of_primary), curved) in values.iter_mut().zip(&*primary).zip(curved) {
                    *value = *value - *of_primary - curved;
                }
            }
        }
        ForceMean {
            force: *motion.force(),
            lever,
            difference,
            whole: self.whole.and(usable),
        }
    }
}
