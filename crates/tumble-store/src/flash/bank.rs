//! Two banks of flash, one in use. Entries are appended to it; when it is full, the other is erased, takes what is
//! still of use, then its header, and last the entry that did not fit, which puts it in use.
//!
//! So what a cut leaves half done is never relied on: half an entry has no checksum, half a bank no header, and an
//! erasure may leave anything, even a bank that looks like the one it was. A word in which power was cut may besides
//! read one way for a whole boot and another way in the next, so that nothing is taken for written because it reads so.
//! Each later write proves the one before it complete, in the same boot:
//!
//! - a header, that all copied entries were written;
//! - anything after the copied entries, that both copies of the header were. Without it the older bank stays in use,
//!   which holds the same;
//! - an entry, that the one in the slot before it was: between those of two boots a slot is cleared, since the first
//!   that reads as erased may be where power was cut.
//!
//! Thereby only the last word that was written in a boot can be marginal, and none is written over but to clear it.

use embedded_storage::nor_flash::{ErrorType, NorFlash};

use crate::checksum::{CHECKSUM, checksum, sign};
use crate::flash::entry::{ENTRY, ERASED, Entry, HEAD, Label};
use crate::flash::{LayoutError, StoreError};

/// Bytes of one copy of a header. All sizes here are multiples of it, so flash may be written up to that many at once.
const COPY: u32 = 32;

/// Two copies, so that no single bit that changes takes a bank out of use.
const HEADER: u32 = 2 * COPY;

/// Magic bytes of a header, with the version of the layout described here.
const MAGIC: [u8; 4] = *b"TB\x02\xFF";

/// Magic bytes of version 1, whose headers lack the checksum of copied entries.
const MAGIC_1: [u8; 4] = *b"TB\x01\xFF";

/// The checksum of no entries.
const NO_CONTENT: u32 = 0;

const ENTRY_BYTES: u32 = ENTRY as u32;

/// Result of reading flash.
type Seen<T, F> = Result<T, <F as ErrorType>::Error>;

/// Result of writing flash.
type Done<T, F> = Result<T, StoreError<<F as ErrorType>::Error>>;

/// A bank with a header.
#[derive(Clone, Copy)]
pub struct Bank {
    /// Where it starts.
    address: u32,
    header: Header,
}

/// Contents of a header.
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
    /// Size of one bank, in bytes.
    bytes: u32,
    /// The slot after the last that was written since the start, which is known to be erased.
    free: Option<u32>,
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
    pub fn in_use(&mut self) -> Seen<Option<Bank>, F> {
        Ok(match self.by_age()? {
            (older, Some(younger)) if older.is_none() || self.goes_on(&younger)? => Some(younger),
            (older, _) => older,
        })
    }

    /// The banks that have a header; a single one as the younger.
    fn by_age(&mut self) -> Seen<(Option<Bank>, Option<Bank>), F> {
        let (first, second) = (self.bank(self.start)?, self.bank(self.start + self.bytes)?);
        Ok(match (first, second) {
            (Some(a), Some(b)) if b.follows(&a) => (first, second),
            (Some(_), Some(_)) => (second, first),
            _ => (None, first.or(second)),
        })
    }

    /// Reads the header of the bank at an address: the first copy that is whole.
    fn bank(&mut self, address: u32) -> Seen<Option<Bank>, F> {
        let header = match self.copy(address)? {
            None => self.copy(address + COPY)?,
            first => first,
        };
        Ok(header.map(|header| Bank { address, header }))
    }

    /// A copy of a header, if it is whole.
    fn copy(&mut self, address: u32) -> Seen<Option<Header>, F> {
        let mut bytes = Copy::blank();
        self.read(address, &mut bytes.0)?;
        Ok(Header::of(&bytes))
    }

    /// Checks whether an entry that was not copied is whole.
    fn holds_appended(&mut self, bank: &Bank) -> Seen<bool, F> {
        for slot in bank.header.copied..self.slots() {
            if self.is_whole(bank, slot)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Checks whether a bank is reliable: an appended entry proves its header written, and excludes an erasure begun
    /// since, which would leave neither that entry nor the copied ones.
    fn goes_on(&mut self, bank: &Bank) -> Seen<bool, F> {
        Ok(self.holds_appended(bank)?
            || self.first_blank(bank)? > bank.header.copied && self.is_intact(bank)?)
    }

    /// Checks that the entries copied to a bank are unchanged.
    #[inline(never)]
    fn is_intact(&mut self, bank: &Bank) -> Seen<bool, F> {
        let (mut content, mut entry) = (NO_CONTENT, Entry::blank());
        for slot in 0..bank.header.copied.min(self.slots()) {
            self.fetch(bank, slot, &mut entry)?;
            content = with_entry(content, &entry);
        }
        Ok(content == bank.header.content)
    }

    /// Checks whether the entry in a slot stays readable in later boots: it was copied, or is the last of this boot, or
    /// another was appended after it in its own boot.
    pub fn is_firm(&mut self, bank: &Bank, slot: u32) -> Seen<bool, F> {
        let next = slot + 1;
        if slot < bank.header.copied || self.free == Some(next) {
            return Ok(true);
        }
        Ok(next < self.slots() && self.is_whole(bank, next)?)
    }

    /// Checks that the entry in a slot is as it was written.
    fn is_whole(&mut self, bank: &Bank, slot: u32) -> Seen<bool, F> {
        let mut entry = Entry::blank();
        self.fetch(bank, slot, &mut entry)?;
        Ok(entry.is_whole())
    }

    /// Finds the last whole entry of a sensor before a slot, and its slot.
    pub fn last_before(
        &mut self,
        bank: &Bank,
        end: u32,
        label: Label,
        entry: &mut Entry,
    ) -> Seen<Option<u32>, F> {
        for slot in (0..end).rev() {
            if self.fetch_of(bank, slot, label, entry)? {
                return Ok(Some(slot));
            }
        }
        Ok(None)
    }

    /// Appends an entry to the bank in use, or puts one in use.
    pub fn append(&mut self, entry: &Entry) -> Done<(), F> {
        // Whatever fails from here on, what is free is not known any more.
        let known = self.free.take();
        let (address, slot) = self.place(known)?;
        self.write(address, slot, entry)?;
        self.free = Some(slot + 1);
        Ok(())
    }

    /// Where the next entry goes: the address of a bank, and a slot.
    fn place(&mut self, known: Option<u32>) -> Done<(u32, u32), F> {
        let (older, younger) = self.by_age()?;
        let Some(bank) = younger else {
            self.erase(self.start)?;
            self.commit(self.start, Header::first())?;
            return Ok((self.start, 0));
        };
        if !self.goes_on(&bank)? {
            return self.turn_over(&older.unwrap_or(bank));
        }
        let free = match known {
            Some(slot) => slot,
            None => self.first_untouched(&bank)?,
        };
        if free < self.slots() {
            Ok((bank.address, free))
        } else {
            self.turn_over(&bank)
        }
    }

    /// The slot after the last that anything was written to, be it whole or not.
    fn first_blank(&mut self, bank: &Bank) -> Seen<u32, F> {
        let mut entry = Entry::blank();
        for slot in (0..self.slots()).rev() {
            self.fetch(bank, slot, &mut entry)?;
            if !entry.is_blank() {
                return Ok(slot + 1);
            }
        }
        Ok(0)
    }

    /// The first slot of a bank after a start that nothing was written to, however marginal: first the last one that
    /// was written to is made to read so in all boots, then the one after it, where power may have been cut.
    fn first_untouched(&mut self, bank: &Bank) -> Done<u32, F> {
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
    fn mark(&mut self, bank: &Bank, slot: u32) -> Done<(), F> {
        let start = self.address(bank, slot);
        for address in (start..start + ENTRY_BYTES).step_by(COPY as usize) {
            let mut part = Copy::blank();
            self.read(address, &mut part.0)?;
            if part == Copy::blank() {
                return self.put(address, &Copy([0; COPY as usize]));
            }
        }
        Ok(())
    }

    /// Makes the other bank, with all that is still of use; gives its address and its first free slot.
    fn turn_over(&mut self, from: &Bank) -> Done<(u32, u32), F> {
        let (mut kept, mut entry) = (0, Entry::blank());
        for slot in 0..self.slots() {
            kept += u32::from(self.is_of_use(from, slot, &mut entry)?);
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
            if self.is_of_use(from, slot, &mut entry)? {
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
    fn commit(&mut self, address: u32, header: Header) -> Done<(), F> {
        let bytes = header.bytes(MAGIC);
        self.put(address, &bytes)?;
        self.put(address + COPY, &bytes)
    }

    /// Writes a copy of a header, or as many bytes, and looks whether flash took them.
    fn put(&mut self, address: u32, bytes: &Copy) -> Done<(), F> {
        self.flash.write(address, &bytes.0)?;
        let mut read = Copy::blank();
        self.read(address, &mut read.0)?;
        if read == *bytes {
            Ok(())
        } else {
            Err(StoreError::NotAsWritten)
        }
    }

    #[inline(never)]
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> Seen<(), F> {
        self.flash.read(address, bytes)
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
    #[inline(never)]
    fn erase(&mut self, address: u32) -> Seen<(), F> {
        self.flash.erase(address, address + self.bytes)
    }

    /// Forgets everything.
    pub fn erase_both(&mut self) -> Seen<(), F> {
        self.free = None;
        // The bank that is not in use goes first: what it holds must not come back if power is cut between the two.
        let in_use = self.in_use()?.map_or(self.start, |bank| bank.address);
        self.erase(self.other(in_use))?;
        self.erase(in_use)
    }

    /// Reads a slot; returns whether its entry is whole and not followed by as many of its sensor and kind as are kept.
    fn is_of_use(&mut self, bank: &Bank, slot: u32, entry: &mut Entry) -> Seen<bool, F> {
        self.fetch(bank, slot, entry)?;
        let label = entry.label().filter(|_| entry.is_whole());
        let Some((label, kind)) = label.and_then(|label| Some((label, label.kind()?))) else {
            return Ok(false);
        };
        let (mut later, mut before, mut next) = (0, entry.clone(), Entry::blank());
        for slot in slot + 1..self.slots() {
            if !self.fetch_of(bank, slot, label, &mut next)? {
                continue;
            }
            // One that was written again, for it to be firm, stands for both.
            if next != before {
                later += 1;
                before.0 = next.0;
            } else if later == 0 {
                return Ok(false);
            }
            if later == kind.kept() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Reads a slot if its entry has this label; returns whether it has, and is whole.
    fn fetch_of(&mut self, bank: &Bank, slot: u32, label: Label, entry: &mut Entry) -> Seen<bool, F> {
        let mut peek = Copy::blank();
        let first = peek.0.get_mut(..HEAD.next_multiple_of(F::READ_SIZE));
        self.read(self.address(bank, slot), first.unwrap_or_default())?;
        if peek.0.first_chunk().map(Label::read) != Some(label) {
            return Ok(false);
        }
        // The first read may have been wrong.
        self.fetch(bank, slot, entry)?;
        Ok(entry.is_whole() && entry.label() == Some(label))
    }

    /// Reads a slot.
    fn fetch(&mut self, bank: &Bank, slot: u32, entry: &mut Entry) -> Seen<(), F> {
        self.read(self.address(bank, slot), &mut entry.0)
    }

    /// Writes an entry, and looks whether flash took it.
    fn write(&mut self, bank: u32, slot: u32, entry: &Entry) -> Done<(), F> {
        let address = bank + HEADER + slot * ENTRY_BYTES;
        self.flash.write(address, &entry.0)?;
        let mut read = Entry::blank();
        self.read(address, &mut read.0)?;
        if read == *entry {
            Ok(())
        } else {
            Err(StoreError::NotAsWritten)
        }
    }

    fn address(&self, bank: &Bank, slot: u32) -> u32 {
        bank.address + HEADER + slot * ENTRY_BYTES
    }
}

/// A copy of a header, or as many bytes, aligned for drivers that move whole words.
#[derive(PartialEq, Eq)]
#[repr(align(4))]
struct Copy([u8; COPY as usize]);

impl Copy {
    /// Header of a page to which nothing was written.
    fn blank() -> Self {
        Self([ERASED; COPY as usize])
    }
}

impl Bank {
    /// Checks whether this header was made after another.
    fn follows(&self, other: &Self) -> bool {
        let ahead = self.header.sequence.wrapping_sub(other.header.sequence);
        ahead.cast_signed() > 0
    }
}

impl Header {
    /// Header of the first bank, to which nothing is copied.
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

    /// Reads a copy of a header, if it is whole.
    fn of(copy: &Copy) -> Option<Self> {
        let ([magic, sequence, copied, content, ..], _) = copy.0.as_chunks::<4>() else {
            return None;
        };
        let header = match *magic {
            MAGIC => Self {
                sequence: u32::from_le_bytes(*sequence),
                copied: u32::from_le_bytes(*copied),
                content: u32::from_le_bytes(*content),
            },
            MAGIC_1 => Self::of_version_1(*sequence),
            _ => return None,
        };
        (*copy == header.bytes(*magic)).then_some(header)
    }

    /// A copy of it. In version 1 the checksum follows the sequence.
    fn bytes(&self, magic: [u8; 4]) -> Copy {
        let numbers = [self.sequence, self.copied, self.content].map(u32::to_le_bytes);
        let [sequence, copied, content] = numbers;
        let covered = if magic == MAGIC_1 { 2 } else { 4 };
        let mut copy = Copy::blank();
        let words = [magic, sequence, copied, content].into_iter().take(covered);
        let places = copy.0.as_chunks_mut().0.iter_mut();
        places.zip(words).for_each(|(place, word)| *place = word);
        copy.0.get_mut(..4 * covered + CHECKSUM).and_then(sign);
        copy
    }
}

/// The checksum of entries and one more, of which one that is not whole has none.
fn with_entry(content: u32, entry: &Entry) -> u32 {
    let signature = entry.signature().unwrap_or_default();
    checksum(0, [content.to_le_bytes(), signature].as_flattened())
}
