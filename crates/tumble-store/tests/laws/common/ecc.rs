//! Flash with an error-correcting code in each word, as STM32 L4 and G4 have it (words of 8 bytes) and H7 (32 bytes):
//! a word in which power was cut, or that died, answers reads with an error. A word is programmed once; clearing all of it
//! again is allowed with words of 8 bytes, and leaves an unreadable word with those of 32 (ST RM0351 3.3.7, RM0433 4.3.9).

use std::cell::Cell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::rc::Rc;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::common::simulated::{Cut, Cuttable, Fault, Operation, PAGE, Remains};

/// Contents of a word.
#[derive(Clone, Copy, PartialEq)]
enum Word<const WORD: usize> {
    Erased,
    Holds([u8; WORD]),
    /// Power was cut in it: each boot reads it in a way of its own.
    Between([u8; WORD], [u8; WORD]),
}

/// Fault of a word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Defect {
    /// Reads of it answer with an error.
    Unreadable,
    /// It reads as erased, whatever was written.
    TakesNothing,
    /// Writing it fails with an error, and leaves what was there.
    FailsToProgram,
    /// A bit of it always reads so: byte, mask, value.
    Stuck(usize, u8, bool),
}

/// Reads that fail although the words are sound.
#[derive(Clone, Copy, PartialEq)]
pub enum Bus {
    Sound,
    /// One read in so many.
    FailsOnceIn(u32),
    /// All reads from that one on.
    FailsFrom(usize),
}

#[derive(Clone)]
pub struct Ecc<const WORD: usize> {
    words: Vec<Word<WORD>>,
    /// Bytes that words in which power was cut read as in this boot; `None` with an error.
    boot: BTreeMap<usize, Option<[u8; WORD]>>,
    pub defects: BTreeMap<usize, Defect>,
    pub bus: Bus,
    pub operations: Vec<Operation>,
    /// Calls of `read` and of `erase`, together with those of its clones.
    pub calls: Rc<Cell<[usize; 2]>>,
    cut: Option<Cut>,
    random: Pcg64Mcg,
}

impl<const WORD: usize> Ecc<WORD> {
    const BLANK: [u8; WORD] = [0xFF; WORD];

    /// Erased flash.
    pub fn new(bytes: usize, seed: u64) -> Self {
        Self {
            words: vec![Word::Erased; bytes / WORD],
            boot: BTreeMap::new(),
            defects: BTreeMap::new(),
            bus: Bus::Sound,
            operations: Vec::new(),
            calls: Rc::default(),
            cut: None,
            random: Pcg64Mcg::seed_from_u64(seed),
        }
    }

    fn bytes(word: Word<WORD>) -> [u8; WORD] {
        match word {
            Word::Erased => Self::BLANK,
            Word::Holds(bytes) | Word::Between(bytes, _) => bytes,
        }
    }

    /// Leaves a word between what it held and what it was to hold.
    fn tear(&mut self, at: usize, wanted: [u8; WORD]) {
        self.words[at] = Word::Between(Self::bytes(self.words[at]), wanted);
        self.draw(at);
    }

    /// Draws what a torn word reads as in this boot: mostly an error, at times either content, seldom neither.
    fn draw(&mut self, at: usize) {
        let Word::Between(old, new) = self.words[at] else {
            return;
        };
        let reads = match self.random.random_range(0..10) {
            0..5 => None,
            5 | 6 => Some(old),
            7 | 8 => Some(new),
            _ => Some(std::array::from_fn(|_| self.random.random())),
        };
        self.boot.insert(at, reads);
    }

    /// Bytes that a word reads as.
    fn word(&self, at: usize) -> Option<[u8; WORD]> {
        let read = match self.words[at] {
            Word::Between(..) => self.boot.get(&at).copied().flatten(),
            word => Some(Self::bytes(word)),
        };
        match self.defects.get(&at) {
            Some(Defect::Unreadable) => None,
            Some(Defect::TakesNothing) => Some(Self::BLANK),
            Some(Defect::Stuck(byte, mask, set)) => read.map(|mut bytes| {
                bytes[*byte] = if *set {
                    bytes[*byte] | mask
                } else {
                    bytes[*byte] & !mask
                };
                bytes
            }),
            _ => read,
        }
    }

    fn is_off(&self, operations: usize) -> bool {
        self.cut.is_some_and(|cut| operations > cut.after + 1)
    }

    fn remains(&self) -> Option<Remains> {
        let now = self.cut.filter(|cut| self.operations.len() == cut.after + 1);
        now.map(|cut| cut.remains)
    }

    /// Programs a word; returns whether the flash took it.
    fn program(&mut self, at: usize, bytes: [u8; WORD]) -> bool {
        if self.defects.get(&at) == Some(&Defect::FailsToProgram) {
            return false;
        }
        match self.words[at] {
            Word::Erased => self.words[at] = Word::Holds(bytes),
            _ if bytes == [0; WORD] && WORD == 8 => self.words[at] = Word::Holds(bytes),
            // No check, but a code of two contents at once: what was programmed over does not read as erased again.
            Word::Between(..) if bytes == [0; WORD] => {
                self.words[at] = Word::Between([0; WORD], [0; WORD]);
                self.boot.insert(at, None);
            }
            _ => return false,
        }
        true
    }

    fn part(bytes: &[u8], word: usize) -> [u8; WORD] {
        bytes[word * WORD..][..WORD].try_into().unwrap()
    }

    fn range(from: usize, to: usize) -> Range<usize> {
        from / WORD..to / WORD
    }
}

impl<const WORD: usize> Cuttable for Ecc<WORD> {
    const ERASURES: &[Remains] = &[Remains::Marginal, Remains::Bytes(0), Remains::Erased];

    fn seeded(pages: usize, seed: u64) -> Self {
        Self::new(pages * PAGE, seed)
    }

    fn reseed(&mut self, seed: u64) {
        self.random = Pcg64Mcg::seed_from_u64(seed);
    }

    fn back(mut self) -> Self {
        self.cut = None;
        self.operations.clear();
        (0..self.words.len()).for_each(|at| self.draw(at));
        self
    }

    fn cut_in(&mut self, cut: Option<Cut>) {
        self.cut = cut;
    }

    fn operations(&self) -> &[Operation] {
        &self.operations
    }
}

impl<const WORD: usize> ErrorType for Ecc<WORD> {
    type Error = Fault;
}

impl<const WORD: usize> ReadNorFlash for Ecc<WORD> {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Fault> {
        check_read(self, offset, bytes.len()).map_err(Fault::Misused)?;
        if self.is_off(self.operations.len() + 1) {
            return Err(Fault::PowerCut);
        }
        let [count, erasures] = self.calls.get();
        self.calls.set([count + 1, erasures]);
        let unreadable = Err(Fault::Misused(NorFlashErrorKind::Other));
        let fails = match self.bus {
            Bus::Sound => false,
            Bus::FailsOnceIn(reads) => self.random.random_range(0..reads) == 0,
            Bus::FailsFrom(first) => count >= first,
        };
        if fails {
            return unreadable;
        }
        let first = offset as usize / WORD;
        for (place, part) in bytes.chunks_mut(WORD).enumerate() {
            match self.word(first + place) {
                Some(word) => part.copy_from_slice(&word),
                None => return unreadable,
            }
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.words.len() * WORD
    }
}

impl<const WORD: usize> NorFlash for Ecc<WORD> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Fault> {
        check_erase(self, from, to).map_err(Fault::Misused)?;
        self.operations.push(Operation::Erase);
        if self.is_off(self.operations.len()) {
            return Err(Fault::PowerCut);
        }
        let [reads, erasures] = self.calls.get();
        self.calls.set([reads, erasures + 1]);
        let remains = self.remains();
        for at in Self::range(from as usize, to as usize) {
            // Before it sets cells, an erasure clears all of them.
            let way = self.random.random_range(0..4);
            match (remains, way) {
                (None | Some(Remains::Erased), _) | (Some(Remains::Marginal), 0) => {
                    self.words[at] = Word::Erased
                }
                (Some(Remains::Marginal), 1) => self.tear(at, Self::BLANK),
                (Some(Remains::Marginal), 2) => self.tear(at, [0; WORD]),
                _ => {}
            }
        }
        remains.map_or(Ok(()), |_| Err(Fault::PowerCut))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Fault> {
        check_write(self, offset, bytes.len()).map_err(Fault::Misused)?;
        self.operations.push(Operation::Write { bytes: bytes.len() });
        if self.is_off(self.operations.len()) {
            return Err(Fault::PowerCut);
        }
        let whole = match self.remains() {
            Some(Remains::MarginalAfter(done)) => done / WORD,
            _ => bytes.len() / WORD,
        };
        let first = offset as usize / WORD;
        for word in 0..whole {
            if !self.program(first + word, Self::part(bytes, word)) {
                return Err(Fault::Misused(NorFlashErrorKind::Other));
            }
        }
        if whole < bytes.len() / WORD {
            self.tear(first + whole, Self::part(bytes, whole));
        }
        self.remains().map_or(Ok(()), |_| Err(Fault::PowerCut))
    }
}
