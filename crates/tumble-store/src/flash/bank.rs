//! Two banks of flash, one in use. Entries are appended to it; when it is full, the other is erased, takes what is
//! still of use, then its header, and last the entry that did not fit, which puts it in use.
//!
//! So what a cut leaves half done is never relied on: half an entry has no checksum, half a bank no header, and an
//! erasure may leave anything, even a bank that looks like the one it was. A word in which power was cut may besides
//! read one way for a whole boot and another way in the next, so that nothing is taken for written because it reads
//! so. What was begun proves what was finished before it, in the same boot:
//!
//! - a header, that all copied entries were written;
//! - anything after the copied entries, that both copies of the header were. Without it the older bank stays in use,
//!   which holds the same;
//! - an entry, that the one in the slot before it was: between those of two boots a slot is cleared, since the first
//!   that reads as erased may be where power was cut.
//!
//! Thereby only the last word that was written in a boot can be marginal, and none is written over but to clear it.

use embedded_storage::nor_flash::NorFlash;

use crate::flash::entry::{ENTRY, ERASED, Entry, Key, Kind, PEEK, label};
use crate::flash::{LayoutError, StoreError};
use crate::record::checksum;

/// Bytes of one copy of a header. All sizes here are multiples of it, so flash may be written up to that many at once.
const COPY: u32 = 32;

/// Two copies, so that no single bit that changes takes a bank out of use.
const HEADER: u32 = 2 * COPY;

/// How a header begins, and the version of what is described here.
const MAGIC: [u8; 4] = *b"TB\x02\xFF";

/// The same of version 1, which did not say what was copied.
const MAGIC_1: [u8; 4] = *b"TB\x01\xFF";

/// The checksum of no entries.
const NO_CONTENT: u32 = 0;

const ENTRY_BYTES: u32 = ENTRY as u32;

type Outcome<T, F> = Result<T, StoreError<<F as embedded_storage::nor_flash::ErrorType>::Error>>;

/// A bank with a header.
#[derive(Clone, Copy)]
pub struct Bank {
    /// Where it starts.
    address: u32,
    header: Header,
}

/// What a header says.
#[derive(Clone, Copy)]
struct Header {
    /// Counts the banks that were made.
    sequence: u32,
    /// Entries that were copied from the bank before.
    copied: u32,
    /// Checksum of them.
    content: u32,
}

/// Both banks.
pub struct Banks<F: NorFlash> {
    pub flash: F,
    start: u32,
    /// Of one.
    bytes: u32,
    /// The slot after the last that was written since the start, which is known to be erased.
    free: Option<u32>,
}

/// An entry, and which of its bank it is.
pub struct Found {
    pub slot: u32,
    pub entry: Entry,
}

impl<F: NorFlash> Banks<F> {
    pub fn new(flash: F, start: u32, end: u32) -> Result<Self, LayoutError> {
        let page = u32::try_from(F::ERASE_SIZE).map_err(|_| LayoutError::NotWholePages)?;
        let capacity = u64::try_from(flash.capacity()).unwrap_or(u64::MAX);
        let copy = COPY as usize;
        if !(copy.is_multiple_of(F::WRITE_SIZE) && copy.is_multiple_of(F::READ_SIZE)) {
            return Err(LayoutError::WordsNotSupported);
        }
        if start >= end || u64::from(end) > capacity {
            return Err(LayoutError::OutOfBounds);
        }
        let bytes = (end - start) / 2;
        if page == 0 || !start.is_multiple_of(page) || !bytes.is_multiple_of(page) || bytes * 2 != end - start
        {
            return Err(LayoutError::NotWholePages);
        }
        if bytes < HEADER + 4 * ENTRY_BYTES {
            return Err(LayoutError::TooSmall);
        }
        Ok(Self {
            flash,
            start,
            bytes,
            free: None,
        })
    }

    /// Entries that a bank holds.
    pub fn slots(&self) -> u32 {
        (self.bytes - HEADER) / ENTRY_BYTES
    }

    /// Finds the bank in use: the younger, if it is known to be whole.
    pub fn in_use(&mut self) -> Outcome<Option<Bank>, F> {
        Ok(match self.by_age()? {
            (older, Some(younger)) if older.is_none() || self.goes_on(younger)? => Some(younger),
            (older, _) => older,
        })
    }

    /// The banks that have a header; a single one as the younger.
    fn by_age(&mut self) -> Outcome<(Option<Bank>, Option<Bank>), F> {
        let (first, second) = (self.bank(self.start)?, self.bank(self.start + self.bytes)?);
        Ok(match (first, second) {
            (Some(a), Some(b)) if b.follows(&a) => (first, second),
            (Some(_), Some(_)) => (second, first),
            _ => (None, first.or(second)),
        })
    }

    /// Reads the header of the bank at an address: the first copy that is whole.
    fn bank(&mut self, address: u32) -> Outcome<Option<Bank>, F> {
        let (first, second) = (self.copy(address)?, self.copy(address + COPY)?);
        Ok(first.or(second).map(|header| Bank { address, header }))
    }

    /// A copy of a header, if it is whole.
    fn copy(&mut self, address: u32) -> Outcome<Option<Header>, F> {
        let mut bytes = Copy([0; COPY as usize]);
        self.read(address, &mut bytes.0)?;
        Ok(Header::of(&bytes))
    }

    /// Whether an entry that was not copied is whole.
    fn holds_appended(&mut self, bank: Bank) -> Outcome<bool, F> {
        for slot in bank.header.copied..self.slots() {
            if self.entry(bank, slot)?.is_whole() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Whether a bank can be relied on: something was appended, which proves its header written, and no erasure was begun
    /// since, which leaves neither that nor what was copied.
    fn goes_on(&mut self, bank: Bank) -> Outcome<bool, F> {
        Ok(self.holds_appended(bank)?
            || self.first_blank(bank)? > bank.header.copied && self.is_intact(bank)?)
    }

    /// Whether the entries that were copied to a bank are as they were.
    fn is_intact(&mut self, bank: Bank) -> Outcome<bool, F> {
        let mut content = NO_CONTENT;
        for slot in 0..bank.header.copied.min(self.slots()) {
            content = with_entry(content, &self.entry(bank, slot)?);
        }
        Ok(content == bank.header.content)
    }

    /// Whether what was found can be relied on in boots to come: it was copied, or the last of this boot, or another was
    /// appended after it in its own.
    pub fn is_firm(&mut self, bank: Bank, found: &Found) -> Outcome<bool, F> {
        let next = found.slot + 1;
        let known = found.slot < bank.header.copied || self.free == Some(next);
        Ok(known || next < self.slots() && self.entry(bank, next)?.is_whole())
    }

    /// Finds the last whole entry of a sensor before a slot.
    pub fn last_before(&mut self, bank: Bank, end: u32, key: Key, kind: Kind) -> Outcome<Option<Found>, F> {
        for slot in (0..end).rev() {
            if let Some(entry) = self.entry_of(bank, slot, key, kind)? {
                return Ok(Some(Found { slot, entry }));
            }
        }
        Ok(None)
    }

    /// Appends an entry to the bank in use, or puts one in use.
    pub fn append(&mut self, entry: &Entry) -> Outcome<(), F> {
        // Whatever fails from here on, what is free is not known any more.
        let known = self.free.take();
        let (address, slot) = self.place(known)?;
        self.write(address, slot, entry)?;
        self.free = Some(slot + 1);
        Ok(())
    }

    /// Where the next entry goes: the address of a bank, and a slot.
    fn place(&mut self, known: Option<u32>) -> Outcome<(u32, u32), F> {
        let (older, younger) = self.by_age()?;
        let Some(bank) = younger else {
            self.erase(self.start)?;
            self.commit(self.start, Header::first())?;
            return Ok((self.start, 0));
        };
        if !self.goes_on(bank)? {
            return self.turn_over(older.unwrap_or(bank));
        }
        let free = match known {
            Some(slot) => slot,
            None => self.first_untouched(bank)?,
        };
        if free < self.slots() {
            Ok((bank.address, free))
        } else {
            self.turn_over(bank)
        }
    }

    /// The slot after the last that anything was written to, be it whole or not.
    fn first_blank(&mut self, bank: Bank) -> Outcome<u32, F> {
        for slot in (0..self.slots()).rev() {
            if !self.entry(bank, slot)?.is_blank() {
                return Ok(slot + 1);
            }
        }
        Ok(0)
    }

    /// The first slot of a bank after a start that nothing was written to, however marginal: first the last one that
    /// was written to is made to read so in all boots, then the one after it, where power may have been cut.
    fn first_untouched(&mut self, bank: Bank) -> Outcome<u32, F> {
        let free = self.first_blank(bank)?;
        if let Some(last) = free.checked_sub(1) {
            self.mark(bank, last)?;
        }
        if free >= self.slots() {
            return Ok(free);
        }
        self.mark(bank, free)?;
        Ok(free + 1)
    }

    /// Clears the first part of a slot that reads as erased: over a marginal word that is all that may be written.
    fn mark(&mut self, bank: Bank, slot: u32) -> Outcome<(), F> {
        let start = self.address(bank, slot);
        for address in (start..start + ENTRY_BYTES).step_by(COPY as usize) {
            let mut part = Copy([0; COPY as usize]);
            self.read(address, &mut part.0)?;
            if part.0 == [ERASED; COPY as usize] {
                return self.put(address, &Copy([0; COPY as usize]));
            }
        }
        Ok(())
    }

    /// Makes the other bank, with all that is still of use; gives its address and its first free slot.
    fn turn_over(&mut self, from: Bank) -> Outcome<(u32, u32), F> {
        let mut kept = 0;
        for slot in 0..self.slots() {
            kept += u32::from(self.of_use(from, slot)?.is_some());
        }
        if kept >= self.slots() {
            return Err(StoreError::Full {
                entries: self.slots(),
            });
        }
        let address = self.other(from.address);
        self.erase(address)?;
        let mut next = 0;
        let mut content = NO_CONTENT;
        for slot in 0..self.slots() {
            if let Some(entry) = self.of_use(from, slot)? {
                self.write(address, next, &entry)?;
                content = with_entry(content, &entry);
                next += 1;
            }
        }
        let header = Header {
            sequence: from.header.sequence.wrapping_add(1),
            copied: next,
            content,
        };
        self.commit(address, header)?;
        Ok((address, next))
    }

    /// Writes the header, after everything that it speaks for.
    fn commit(&mut self, address: u32, header: Header) -> Outcome<(), F> {
        let bytes = header.bytes();
        self.put(address, &bytes)?;
        self.put(address + COPY, &bytes)
    }

    /// Writes a copy of a header, or as many bytes, and looks whether flash took them.
    fn put(&mut self, address: u32, bytes: &Copy) -> Outcome<(), F> {
        self.flash.write(address, &bytes.0).map_err(StoreError::Flash)?;
        let mut read = Copy([ERASED; COPY as usize]);
        self.read(address, &mut read.0)?;
        if read.0 == bytes.0 {
            Ok(())
        } else {
            Err(StoreError::NotAsWritten)
        }
    }

    fn read(&mut self, address: u32, bytes: &mut [u8]) -> Outcome<(), F> {
        self.flash.read(address, bytes).map_err(StoreError::Flash)
    }

    /// The address of the other bank.
    fn other(&self, address: u32) -> u32 {
        if address == self.start {
            self.start + self.bytes
        } else {
            self.start
        }
    }

    /// Erases the bank at an address.
    fn erase(&mut self, address: u32) -> Outcome<(), F> {
        self.flash
            .erase(address, address + self.bytes)
            .map_err(StoreError::Flash)
    }

    /// Forgets everything.
    pub fn erase_both(&mut self) -> Outcome<(), F> {
        self.free = None;
        // The bank that is not in use goes first: what it holds must not come back if power is cut between the two.
        let in_use = self.in_use()?.map_or(self.start, |bank| bank.address);
        self.erase(self.other(in_use))?;
        self.erase(in_use)
    }

    /// The entry in a slot, if it is whole and not followed by as many of its sensor and kind as are kept.
    fn of_use(&mut self, bank: Bank, slot: u32) -> Outcome<Option<Entry>, F> {
        let entry = self.entry(bank, slot)?;
        let Some((kind, key)) = label(&entry.0).filter(|_| entry.is_whole()) else {
            return Ok(None);
        };
        let (mut later, mut before) = (0, entry.clone());
        for slot in slot + 1..self.slots() {
            let Some(next) = self.entry_of(bank, slot, key, kind)? else {
                continue;
            };
            // One that was written again, for it to be firm, stands for both.
            if next != before {
                later += 1;
                before = next;
            } else if later == 0 {
                return Ok(None);
            }
            if later == kind.kept() {
                return Ok(None);
            }
        }
        Ok(Some(entry))
    }

    /// The entry in a slot, if it is of a sensor and kind, and whole.
    fn entry_of(&mut self, bank: Bank, slot: u32, key: Key, kind: Kind) -> Outcome<Option<Entry>, F> {
        let mut peek = Copy([0; PEEK]);
        self.read(self.address(bank, slot), &mut peek.0)?;
        if label(&peek.0) != Some((kind, key)) {
            return Ok(None);
        }
        // What was read first may have been read wrongly.
        let entry = self.entry(bank, slot)?;
        let is_it = entry.is_whole() && label(&entry.0) == Some((kind, key));
        Ok(is_it.then_some(entry))
    }

    fn entry(&mut self, bank: Bank, slot: u32) -> Outcome<Entry, F> {
        let mut entry = Entry::blank();
        self.read(self.address(bank, slot), &mut entry.0)?;
        Ok(entry)
    }

    /// Writes an entry, and looks whether flash took it.
    fn write(&mut self, bank: u32, slot: u32, entry: &Entry) -> Outcome<(), F> {
        let address = bank + HEADER + slot * ENTRY_BYTES;
        self.flash.write(address, &entry.0).map_err(StoreError::Flash)?;
        let mut read = Entry::blank();
        self.read(address, &mut read.0)?;
        if read == *entry {
            Ok(())
        } else {
            Err(StoreError::NotAsWritten)
        }
    }

    fn address(&self, bank: Bank, slot: u32) -> u32 {
        bank.address + HEADER + slot * ENTRY_BYTES
    }
}

/// A copy of a header, or as many bytes, aligned for drivers that move whole words.
#[repr(align(4))]
struct Copy([u8; COPY as usize]);

impl Bank {
    /// Whether it was made after another.
    fn follows(&self, other: &Self) -> bool {
        let ahead = self.header.sequence.wrapping_sub(other.header.sequence);
        ahead.cast_signed() > 0
    }
}

impl Header {
    /// Of the first bank, to which nothing is copied.
    fn first() -> Self {
        Self::of_version_1([1, 0, 0, 0])
    }

    fn of_version_1(sequence: [u8; 4]) -> Self {
        Self {
            sequence: u32::from_le_bytes(sequence),
            copied: 0,
            content: NO_CONTENT,
        }
    }

    /// What a copy says, if it is whole.
    fn of(copy: &Copy) -> Option<Self> {
        let ([magic, sequence, copied, content, ..], _) = copy.0.as_chunks::<4>() else {
            return None;
        };
        let header = Self {
            sequence: u32::from_le_bytes(*sequence),
            copied: u32::from_le_bytes(*copied),
            content: u32::from_le_bytes(*content),
        };
        if *magic == MAGIC_1 {
            let whole = copy.0 == signed([MAGIC_1, *sequence]).0;
            return whole.then(|| Self::of_version_1(*sequence));
        }
        (copy.0 == header.bytes().0).then_some(header)
    }

    fn bytes(&self) -> Copy {
        let numbers = [self.sequence, self.copied, self.content].map(u32::to_le_bytes);
        let [sequence, copied, content] = numbers;
        signed([MAGIC, sequence, copied, content])
    }
}

/// The checksum of entries and one more, of which one that is not whole has none.
fn with_entry(content: u32, entry: &Entry) -> u32 {
    let signature = entry.signature().unwrap_or_default();
    checksum([content.to_le_bytes(), signature].as_flattened())
}

/// Words with their checksum.
fn signed<const N: usize>(words: [[u8; 4]; N]) -> Copy {
    let covered = words.as_flattened();
    let signature = checksum(covered).to_le_bytes();
    let mut bytes = [ERASED; COPY as usize];
    let all = covered.iter().chain(&signature);
    bytes.iter_mut().zip(all).for_each(|(byte, value)| *byte = *value);
    Copy(bytes)
}
