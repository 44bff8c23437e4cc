//! Two banks of flash, one in use. Entries are appended to it; when it is full, the other is erased, takes what is
//! still of use, and last its header, whose first whole copy puts it in use.
//!
//! So what a cut leaves half done is never looked at: half an entry has no checksum, half a bank no header. An erasure
//! that was cut may leave anything, even a bank that looks like the one it was, which by its sequence is not in use. A cut
//! between the two copies of a header leaves a bank in use with one of them: with the next record the other bank, which
//! gets both, takes its place.

use embedded_storage::nor_flash::NorFlash;

use crate::flash::entry::{ENTRY, ERASED, Entry, Key, Kind, PEEK, label};
use crate::flash::{LayoutError, StoreError};
use crate::record::CRC;

/// Bytes of one copy of a header. All sizes here are multiples of it, so flash may be written up to that many at once.
const COPY: u32 = 32;

/// Two copies, so that no single bit that changes takes a bank out of use.
const HEADER: u32 = 2 * COPY;

/// How a bank in use begins, and the version of what is described here.
const MAGIC: [u8; 4] = *b"TB\x01\xFF";

const ENTRY_BYTES: u32 = ENTRY as u32;

type Outcome<T, F> = Result<T, StoreError<<F as embedded_storage::nor_flash::ErrorType>::Error>>;

/// The bank in use.
#[derive(Clone, Copy)]
pub struct Bank {
    /// Where it starts.
    address: u32,
    /// Counts the banks that were put in use.
    sequence: u32,
    /// Both copies of its header are whole.
    safe: bool,
}

/// Both banks.
pub struct Banks<F: NorFlash> {
    pub flash: F,
    start: u32,
    /// Of one.
    bytes: u32,
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
        Ok(Self { flash, start, bytes })
    }

    /// Entries that a bank holds.
    pub fn slots(&self) -> u32 {
        (self.bytes - HEADER) / ENTRY_BYTES
    }

    /// Finds the bank in use: the younger of those that have a header.
    pub fn in_use(&mut self) -> Outcome<Option<Bank>, F> {
        let (first, second) = (self.header(self.start)?, self.header(self.start + self.bytes)?);
        Ok(match (first, second) {
            (Some(a), Some(b)) if b.sequence.wrapping_sub(a.sequence).cast_signed() > 0 => Some(b),
            (a, b) => a.or(b),
        })
    }

    /// Reads the header of the bank at an address: the first copy that is whole.
    fn header(&mut self, address: u32) -> Outcome<Option<Bank>, F> {
        let (first, second) = (self.copy(address)?, self.copy(address + COPY)?);
        Ok(first.or(second).map(|sequence| Bank {
            address,
            sequence,
            safe: first == second,
        }))
    }

    /// The sequence in a copy of a header, if it is whole.
    fn copy(&mut self, address: u32) -> Outcome<Option<u32>, F> {
        let mut bytes = Copy([0; COPY as usize]);
        self.flash
            .read(address, &mut bytes.0)
            .map_err(StoreError::Flash)?;
        Ok(sequence(&bytes))
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
        let (bank, slot) = match self.in_use()? {
            None => (self.begin(self.start, 0)?, 0),
            Some(bank) => match self.free(bank)? {
                slot if bank.safe && slot < self.slots() => (bank, slot),
                _ => self.turn_over(bank)?,
            },
        };
        self.write(bank.address, slot, entry)
    }

    /// The slot after the last that anything was written to, be it whole or not.
    fn free(&mut self, bank: Bank) -> Outcome<u32, F> {
        for slot in (0..self.slots()).rev() {
            if !self.entry(bank, slot)?.is_blank() {
                return Ok(slot + 1);
            }
        }
        Ok(0)
    }

    /// Puts the other bank in use, with all that is still of use; gives it and its first free slot.
    fn turn_over(&mut self, from: Bank) -> Outcome<(Bank, u32), F> {
        let mut kept = 0;
        for slot in 0..self.slots() {
            kept += u32::from(self.of_use(from, slot)?.is_some());
        }
        if kept >= self.slots() {
            return Err(StoreError::Full {
                entries: self.slots(),
            });
        }
        let address = if from.address == self.start {
            self.start + self.bytes
        } else {
            self.start
        };
        self.erase(address)?;
        let mut next = 0;
        for slot in 0..self.slots() {
            if let Some(entry) = self.of_use(from, slot)? {
                self.write(address, next, &entry)?;
                next += 1;
            }
        }
        Ok((self.commit(address, from.sequence)?, next))
    }

    /// Puts the bank at an address in use, empty.
    fn begin(&mut self, address: u32, before: u32) -> Outcome<Bank, F> {
        self.erase(address)?;
        self.commit(address, before)
    }

    /// Writes the header, after everything else.
    fn commit(&mut self, address: u32, before: u32) -> Outcome<Bank, F> {
        let bank = Bank {
            address,
            sequence: before.wrapping_add(1),
            safe: true,
        };
        for copy in [address, address + COPY] {
            let bytes = header_bytes(bank.sequence);
            self.flash.write(copy, &bytes.0).map_err(StoreError::Flash)?;
            let mut read = Copy([0; COPY as usize]);
            self.flash.read(copy, &mut read.0).map_err(StoreError::Flash)?;
            if read.0 != bytes.0 {
                return Err(StoreError::NotAsWritten);
            }
        }
        Ok(bank)
    }

    /// Erases the bank at an address.
    fn erase(&mut self, address: u32) -> Outcome<(), F> {
        self.flash
            .erase(address, address + self.bytes)
            .map_err(StoreError::Flash)
    }

    /// Forgets everything.
    pub fn erase_both(&mut self) -> Outcome<(), F> {
        // The bank that is not in use goes first: what it holds must not come back if power is cut between the two.
        let in_use = self.in_use()?.map_or(self.start, |bank| bank.address);
        let other = if in_use == self.start {
            self.start + self.bytes
        } else {
            self.start
        };
        self.erase(other)?;
        self.erase(in_use)
    }

    /// The entry in a slot, if it is whole and not followed by as many of its sensor and kind as are kept.
    fn of_use(&mut self, bank: Bank, slot: u32) -> Outcome<Option<Entry>, F> {
        let entry = self.entry(bank, slot)?;
        let Some((kind, key)) = label(&entry.0).filter(|_| entry.is_whole()) else {
            return Ok(None);
        };
        let mut later = 0;
        for slot in slot + 1..self.slots() {
            later += u32::from(self.entry_of(bank, slot, key, kind)?.is_some());
            if later == kind.kept() {
                return Ok(None);
            }
        }
        Ok(Some(entry))
    }

    /// The entry in a slot, if it is of a sensor and kind, and whole.
    fn entry_of(&mut self, bank: Bank, slot: u32, key: Key, kind: Kind) -> Outcome<Option<Entry>, F> {
        let mut peek = Copy([0; PEEK]);
        self.flash
            .read(self.address(bank, slot), &mut peek.0)
            .map_err(StoreError::Flash)?;
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
        self.flash
            .read(self.address(bank, slot), &mut entry.0)
            .map_err(StoreError::Flash)?;
        Ok(entry)
    }

    /// Writes an entry, and looks whether flash took it.
    fn write(&mut self, bank: u32, slot: u32, entry: &Entry) -> Outcome<(), F> {
        let address = bank + HEADER + slot * ENTRY_BYTES;
        self.flash.write(address, &entry.0).map_err(StoreError::Flash)?;
        let mut read = Entry::blank();
        self.flash.read(address, &mut read.0).map_err(StoreError::Flash)?;
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

fn header_bytes(sequence: u32) -> Copy {
    let mut bytes = [ERASED; COPY as usize];
    let [a, b, c, d] = MAGIC;
    let [e, f, g, h] = sequence.to_le_bytes();
    let covered = [a, b, c, d, e, f, g, h];
    let checksum = CRC.checksum(&covered).to_le_bytes();
    let all = covered.iter().chain(&checksum);
    bytes.iter_mut().zip(all).for_each(|(byte, value)| *byte = *value);
    Copy(bytes)
}

/// The sequence of a header, if it is one.
fn sequence(header: &Copy) -> Option<u32> {
    let [_, _, _, _, a, b, c, d, ..] = header.0;
    let sequence = u32::from_le_bytes([a, b, c, d]);
    (header.0 == header_bytes(sequence).0).then_some(sequence)
}
