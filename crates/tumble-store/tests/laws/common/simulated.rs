//! NOR flash as its data sheets describe it, with a power supply that can be cut.

use std::ops::Range;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Bytes of a page.
pub const PAGE: usize = 4096;

/// State of flash after a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remains {
    /// So many bytes of the write are there.
    Bytes(usize),
    /// The same, and the word after them holds anything that clearing bits of it can give.
    TornAfter(usize),
    /// The same, and the cells of the word after them are marginal: each boot reads them in its own way.
    MarginalAfter(usize),
    /// The first half of the pages is erased.
    ErasedFront,
    /// The last half is.
    ErasedBack,
    /// All bits are cleared, as chips do before they erase.
    Cleared,
    /// Any bit may be set already.
    SomeSet,
    /// Anything.
    Anything,
    /// All is erased, but the flash did not report success.
    Erased,
    /// All cells that were to be set are marginal.
    Marginal,
    /// Those of the first half of the pages are, the last half is as it was.
    MarginalFront,
    /// Those of the last half are, the first half is as it was.
    MarginalBack,
}

/// States that a cut erasure may leave.
pub const ERASURES: [Remains; 7] = [
    Remains::Bytes(0),
    Remains::ErasedFront,
    Remains::ErasedBack,
    Remains::Cleared,
    Remains::SomeSet,
    Remains::Anything,
    Remains::Erased,
];

/// The same, where cells may also be left marginal.
pub const MARGINAL_ERASURES: [Remains; 6] = [
    Remains::Marginal,
    Remains::MarginalFront,
    Remains::MarginalBack,
    Remains::Bytes(0),
    Remains::ErasedFront,
    Remains::ErasedBack,
];

/// A change of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    Write { bytes: usize },
    Erase,
}

/// Where power is cut.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Operations that are done before.
    pub after: usize,
    pub remains: Remains,
}

/// Flash that writes `WORD` bytes at once.
#[derive(Clone)]
pub struct Simulated<const WORD: usize> {
    pub memory: Vec<u8>,
    /// Bits that are neither set nor cleared: they read one way for a whole boot, and are drawn anew at the next.
    marginal: Vec<u8>,
    /// Words written since they were erased, which must not be written again.
    written: Vec<bool>,
    pub operations: Vec<Operation>,
    pub erasures: Vec<u32>,
    pub cut: Option<Cut>,
    /// A bit that cannot be cleared any more: address and mask.
    pub worn: Option<(usize, u8)>,
    /// Bits that are read wrongly once, the next time: address and mask.
    pub misread: Option<(usize, u8)>,
    seed: u64,
}

/// Why the flash did not do it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    PowerCut,
    Misused(NorFlashErrorKind),
}

impl NorFlashError for Fault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Fault::PowerCut => NorFlashErrorKind::Other,
            Fault::Misused(kind) => *kind,
        }
    }
}

/// Flash whose power may be cut, and what a cut may leave of it.
pub trait Cuttable: NorFlash<Error = Fault> + Clone {
    /// Erased flash, whose cuts leave other things than those of another seed.
    fn seeded(pages: usize, seed: u64) -> Self;

    /// Lets cuts and marginal cells fall out otherwise from now on.
    fn reseed(&mut self, seed: u64);

    /// The same flash when power is back.
    fn back(self) -> Self;

    /// Cuts power in an operation to come.
    fn cut_in(&mut self, cut: Option<Cut>);

    /// Operations since power is back.
    fn operations(&self) -> &[Operation];

    /// States that a cut erasure may leave.
    const ERASURES: &[Remains];
}

impl<const WORD: usize> Cuttable for Simulated<WORD> {
    const ERASURES: &[Remains] = &MARGINAL_ERASURES;

    fn seeded(pages: usize, seed: u64) -> Self {
        let mut flash = Self::new(pages);
        flash.reseed(seed);
        flash
    }

    fn reseed(&mut self, seed: u64) {
        self.seed = seed;
    }

    fn back(self) -> Self {
        Self::back(self)
    }

    fn cut_in(&mut self, cut: Option<Cut>) {
        self.cut = cut;
    }

    fn operations(&self) -> &[Operation] {
        &self.operations
    }
}

impl<const WORD: usize> Simulated<WORD> {
    /// Erased flash.
    pub fn new(pages: usize) -> Self {
        Self {
            memory: vec![0xFF; pages * PAGE],
            marginal: vec![0; pages * PAGE],
            written: vec![false; pages * PAGE / WORD],
            operations: Vec::new(),
            erasures: vec![0; pages],
            cut: None,
            worn: None,
            misread: None,
            seed: 0,
        }
    }

    /// The same flash when power is back. Torn words that read as erased count as not written: a store cannot
    /// distinguish them.
    pub fn back(mut self) -> Self {
        self.cut = None;
        self.draw_marginal();
        self.operations.clear();
        for (written, word) in self.written.iter_mut().zip(self.memory.chunks(WORD)) {
            *written = word.iter().any(|byte| *byte != 0xFF);
        }
        self
    }

    /// Determines how an operation ends: whole, or with the remains of a cut now or before.
    fn remains(&self) -> Result<Option<Remains>, Fault> {
        match self.cut {
            Some(cut) if self.operations.len() > cut.after + 1 => Err(Fault::PowerCut),
            Some(cut) if self.operations.len() == cut.after + 1 => Ok(Some(cut.remains)),
            _ => Ok(None),
        }
    }

    fn random(&mut self) -> Pcg64Mcg {
        self.seed += 1;
        Pcg64Mcg::seed_from_u64(self.seed)
    }

    /// Chooses how marginal cells read from now on: a word of them often as if it had been written whole, or not at all.
    fn draw_marginal(&mut self) {
        let mut random = self.random();
        for (word, marginal) in self.memory.chunks_mut(WORD).zip(self.marginal.chunks(WORD)) {
            if marginal.iter().all(|mask| *mask == 0) {
                continue;
            }
            let way = random.random_range(0..3);
            for (byte, mask) in word.iter_mut().zip(marginal) {
                let set = [0x00, 0xFF, random.random::<u8>()][way];
                *byte = *byte & !mask | set & mask;
            }
        }
    }

    /// Leaves the bits that were to be cleared by a write, or to be set by an erasure, in between.
    fn leave_marginal(&mut self, offset: usize, bits: impl IntoIterator<Item = u8>) {
        for (mask, bits) in self.marginal[offset..].iter_mut().zip(bits) {
            *mask |= bits;
        }
    }

    /// Erases bytes.
    fn set(&mut self, bytes: Range<usize>) {
        self.memory[bytes.clone()].fill(0xFF);
        self.marginal[bytes].fill(0);
    }

    /// Erases bytes half-way.
    fn half_set(&mut self, bytes: Range<usize>) {
        let cleared: Vec<u8> = self.memory[bytes.clone()].iter().map(|byte| !byte).collect();
        self.leave_marginal(bytes.start, cleared);
    }

    fn put(&mut self, offset: usize, bytes: &[u8]) {
        for (place, byte) in (offset..).zip(bytes) {
            let stuck = self
                .worn
                .filter(|(worn, _)| *worn == place)
                .map_or(0, |(_, mask)| mask);
            self.memory[place] &= byte | stuck;
            // A cell that is cleared is; one that is to stay set stays what it is.
            self.marginal[place] &= byte;
        }
    }
}

impl<const WORD: usize> ErrorType for Simulated<WORD> {
    type Error = Fault;
}

impl<const WORD: usize> ReadNorFlash for Simulated<WORD> {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Fault> {
        check_read(self, offset, bytes.len()).map_err(Fault::Misused)?;
        let off = self.cut.is_some_and(|cut| self.operations.len() > cut.after);
        if off {
            return Err(Fault::PowerCut);
        }
        bytes.copy_from_slice(&self.memory[offset as usize..][..bytes.len()]);
        let read = offset as usize..offset as usize + bytes.len();
        if let Some((place, mask)) = self.misread.take_if(|(place, _)| read.contains(place)) {
            bytes[place - read.start] ^= mask;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.memory.len()
    }
}

impl<const WORD: usize> NorFlash for Simulated<WORD> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Fault> {
        check_erase(self, from, to).map_err(Fault::Misused)?;
        self.operations.push(Operation::Erase);
        let remains = self.remains()?;
        let mut random = self.random();
        let pages = from as usize..to as usize;
        self.written[pages.start / WORD..pages.end / WORD].fill(false);
        self.erasures[pages.start / PAGE..pages.end / PAGE]
            .iter_mut()
            .for_each(|count| *count += 1);
        let middle = usize::midpoint(pages.start, pages.end);
        let (front, back) = (pages.start..middle, middle..pages.end);
        match remains {
            None | Some(Remains::Erased) => self.set(pages),
            Some(Remains::ErasedFront) => self.set(front),
            Some(Remains::ErasedBack) => self.set(back),
            Some(Remains::Cleared) => self.memory[pages].fill(0),
            Some(Remains::SomeSet) => self.memory[pages]
                .iter_mut()
                .for_each(|byte| *byte |= random.random::<u8>()),
            Some(Remains::Anything) => random.fill_bytes(&mut self.memory[pages]),
            Some(Remains::Marginal) => self.half_set(pages),
            Some(Remains::MarginalFront) => self.half_set(front),
            Some(Remains::MarginalBack) => self.half_set(back),
            Some(Remains::Bytes(_) | Remains::TornAfter(_) | Remains::MarginalAfter(_)) => {}
        }
        remains.map_or(Ok(()), |_| Err(Fault::PowerCut))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Fault> {
        check_write(self, offset, bytes.len()).map_err(Fault::Misused)?;
        self.operations.push(Operation::Write { bytes: bytes.len() });
        let remains = self.remains()?;
        let offset = offset as usize;
        let words = offset / WORD..(offset + bytes.len()) / WORD;
        for written in &mut self.written[words] {
            assert!(!*written, "a word is written twice");
            *written = true;
        }
        match remains {
            None => self.put(offset, bytes),
            Some(Remains::Bytes(done)) => self.put(offset, &bytes[..done]),
            Some(Remains::TornAfter(done)) => {
                self.put(offset, &bytes[..done]);
                let mut random = self.random();
                let torn: Vec<u8> = bytes[done..].iter().take(WORD).map(|_| random.random()).collect();
                self.put(offset + done, &torn);
            }
            Some(Remains::MarginalAfter(done)) => {
                self.put(offset, &bytes[..done]);
                let rest = offset + done..offset + bytes.len().min(done + WORD);
                let to_clear: Vec<u8> = self.memory[rest]
                    .iter()
                    .zip(&bytes[done..])
                    .map(|(held, wanted)| held & !wanted)
                    .collect();
                self.leave_marginal(offset + done, to_clear);
            }
            Some(other) => unreachable!("{other:?} is of an erasure"),
        }
        remains.map_or(Ok(()), |_| Err(Fault::PowerCut))
    }
}
