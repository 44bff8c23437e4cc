//! Two banks of flash, one in use. Entries are appended to it; when it is full, the other is erased, takes what is
//! still of use, then its header, and last the entry that did not fit, which puts it in use.
//!
//! So what a cut leaves half done is never relied on: half an entry has no checksum, half a bank no header, and an
//! erasure may leave anything, even a bank that looks like the one it was. A word in which power was cut may besides
//! read one way for a whole boot and another way in the next, or not at all, so that nothing is taken for written
//! because it reads so. Each later write proves the one before it complete, in the same boot:
//!
//! - a header, that all copied entries were written;
//! - an entry after the copied ones, or a part of a slot that was cleared, that a copy of the header was. Without them the
//!   older bank stays in use, which holds the same. It stays so too if there is one entry alone and copied ones are not
//!   whole: that one was marginal, and in a boot that did not read it, the younger bank was to be erased;
//! - an entry, that the one in the slot before it was: between those of two boots a slot is cleared, since the first
//!   that reads as erased may be where power was cut.
//!
//! Thereby only the last word that was written in a boot can be marginal, and none is written over but to clear it.
//!
//! A slot with a word that does not take what is written is passed over, and cleared where it can be, so that it never
//! reads as erased again.

use embedded_storage::nor_flash::NorFlash;

use crate::checksum::CHECKSUM;
use crate::flash::entry::{ENTRY, Entry, HEAD, Label};
use crate::flash::header::{COPY, Copy, HEADER, Header, NO_CONTENT, NO_ENTRY, with_entry};
use crate::flash::useful::Slots;
use crate::flash::words::{Done, FlashWords, Seen};
use crate::flash::{LayoutError, StoreError};

const ENTRY_BYTES: u32 = ENTRY as u32;

/// Slots in a row that may be passed over: where that many fail, it is the flash that does.
const PASSED: u32 = 8;

/// A bank with a header.
#[derive(Clone, Copy)]
pub struct Bank {
    /// Where it starts.
    address: u32,
    header: Header,
}

/// A slot to write to, and all after it, in a bank.
#[derive(Clone, Copy)]
struct Free {
    bank: Bank,
    slot: u32,
}

/// Both banks.
pub struct Banks<F: NorFlash> {
    words: FlashWords<F>,
    /// The slot after the last that was written since the start, which is known to be erased.
    free: Option<u32>,
    /// The slot after the last that reads as written to, in the bank at an address.
    end: Option<(u32, u32)>,
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
            words: FlashWords::new(flash, [start, start + bytes]),
            free: None,
            end: None,
        })
    }

    pub fn into_flash(self) -> F {
        self.words.flash
    }

    /// Entries that a bank holds.
    pub fn slots(&self) -> u32 {
        (self.bytes() - HEADER) / ENTRY_BYTES
    }

    /// Size of one bank, in bytes.
    fn bytes(&self) -> u32 {
        let [first, second] = self.words.banks;
        second - first
    }

    /// Finds the bank in use: the younger, if it is known to be whole.
    pub fn in_use(&mut self) -> Seen<Option<Bank>, F> {
        Ok(match self.by_age()? {
            (older, Some(younger)) if older.is_none() || self.is_proven(&younger)? => Some(younger),
            (older, _) => older,
        })
    }

    /// The banks that have a header; a single one as the younger.
    fn by_age(&mut self) -> Seen<(Option<Bank>, Option<Bank>), F> {
        let [first, second] = self.words.banks;
        let (first, second) = (self.bank(first)?, self.bank(second)?);
        Ok(match (first, second) {
            (Some(a), Some(b)) if b.header.follows(&a.header) => (first, second),
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
        self.words.read(address, &mut bytes.0)?;
        Ok(Header::of(&bytes))
    }

    /// Checks whether what stands after the copied entries proves the header of a bank written, and no erasure begun since.
    /// One entry alone may be marginal: in a boot that did not read it, half of the bank may have been erased. A cleared part
    /// may be of an erasure. So they prove nothing unless the copied entries are whole, of which there are some for a part.
    #[inline(never)]
    fn is_proven(&mut self, bank: &Bank) -> Seen<bool, F> {
        if self.free.is_some() {
            return Ok(true);
        }
        let (mut entry, mut appended, mut marked) = (Entry::blank(), 0, false);
        for slot in bank.header.copied..self.end(bank)? {
            if self.fetch(bank, slot, &mut entry)? {
                appended += 1;
            } else {
                marked |= entry.is_marked();
            }
            if appended == 2 {
                return Ok(true);
            }
        }
        let may_be_proof = appended == 1 || (marked && bank.header.copied > 0);
        Ok(may_be_proof && self.holds_copied(bank, &mut entry)?)
    }

    /// Checks whether the entries that were copied to a bank are as they were then; each is read to `entry`.
    fn holds_copied(&mut self, bank: &Bank, entry: &mut Entry) -> Seen<bool, F> {
        let mut content = NO_CONTENT;
        for slot in 0..bank.header.copied.min(self.slots()) {
            content = with_entry(content, self.signature(bank, slot, entry)?);
        }
        Ok(content == bank.header.content)
    }

    /// Signature of the entry in a slot, which is read to `entry`, or of none.
    fn signature(&mut self, bank: &Bank, slot: u32, entry: &mut Entry) -> Seen<[u8; CHECKSUM], F> {
        let is_whole = self.fetch(bank, slot, entry)?;
        Ok(if is_whole { entry.signature() } else { NO_ENTRY })
    }

    /// Checks whether the entry in a slot stays readable in later boots: it was copied, or is the last of this boot, or
    /// another was appended after it in its own boot.
    pub fn is_firm(&mut self, bank: &Bank, slot: u32) -> Seen<bool, F> {
        let next = slot + 1;
        if slot < bank.header.copied || self.free == Some(next) {
            return Ok(true);
        }
        Ok(next < self.slots() && self.fetch(bank, next, &mut Entry::blank())?)
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

    /// A slot after the last that was written to, with as few more as can be. It is looked for once in a boot, by halves,
    /// since banks may be long and slots are used in order.
    #[inline(never)]
    pub fn end(&mut self, bank: &Bank) -> Seen<u32, F> {
        if let Some((_, end)) = self.end.filter(|(address, _)| *address == bank.address) {
            return Ok(end);
        }
        let (mut end, mut unused) = (0, self.slots());
        while end < unused {
            let middle = u32::midpoint(end, unused);
            if self.is_blank_from(bank, middle)? {
                unused = middle;
            } else {
                end = middle + 1;
            }
        }
        self.end = Some((bank.address, end));
        Ok(end)
    }

    /// Checks that nothing was written to a slot, nor to those after it, for as many as may be passed over.
    fn is_blank_from(&mut self, bank: &Bank, slot: u32) -> Seen<bool, F> {
        for slot in (slot..self.slots()).take(PASSED as usize) {
            if !self.is_blank(bank, slot)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Appends an entry to the bank in use, or puts one in use.
    pub fn append(&mut self, entry: &Entry) -> Done<(), F> {
        // Whatever fails from here on, what is free is not known any more.
        let known = self.free.take();
        let appended = self.append_from(known, entry);
        self.free = appended.as_ref().ok().map(|free| free.slot);
        self.end = appended.as_ref().ok().map(|free| (free.bank.address, free.slot));
        appended.map(|_| ())
    }

    /// Appends an entry from a slot on, if one is known; gives what is free after it.
    fn append_from(&mut self, known: Option<u32>, entry: &Entry) -> Done<Free, F> {
        let mut free = self.place(known)?;
        let mut taken = self.write_from(free, entry)?;
        if taken.is_none() {
            free = self.turn_over(&free.bank)?;
            taken = self.write_from(free, entry)?;
        }
        let slot = taken.ok_or(StoreError::NotAsWritten)? + 1;
        Ok(Free { slot, ..free })
    }

    /// Where the next entry goes, if there is room for it.
    fn place(&mut self, known: Option<u32>) -> Done<Free, F> {
        let (older, younger) = self.by_age()?;
        let Some(bank) = younger else {
            let [first, _] = self.words.banks;
            self.erase(first)?;
            return self.commit(first, Header::first(), 0);
        };
        if let Some(slot) = known {
            return Ok(Free { bank, slot });
        }
        if !self.is_proven(&bank)? {
            return self.turn_over(&older.unwrap_or(bank));
        }
        let slot = self.first_untouched(&bank)?;
        Ok(Free { bank, slot })
    }

    /// Writes an entry to the first slot that takes it, from one on; gives that slot, or `None` where the bank ends.
    #[inline(never)]
    fn write_from(&mut self, free: Free, entry: &Entry) -> Done<Option<u32>, F> {
        let mut outcome = Ok(None);
        for slot in (free.slot..self.slots()).take(PASSED as usize) {
            match self.words.put_entry(self.address(&free.bank, slot), entry) {
                Ok(()) => return Ok(Some(slot)),
                Err(error) => outcome = Err(error),
            }
            self.mark(&free.bank, slot)?;
        }
        if self.slots().saturating_sub(free.slot) < PASSED {
            return Ok(None);
        }
        outcome
    }

    /// The first slot of a bank after a start that nothing was written to, however marginal: first the last one that
    /// was written to is made to read so in all boots, then the one after it, where power may have been cut.
    fn first_untouched(&mut self, bank: &Bank) -> Done<u32, F> {
        let mut slot = self.after_last_whole(bank)?;
        while slot < self.slots() && !self.is_blank(bank, slot)? {
            slot += 1;
        }
        if let Some(last) = slot.checked_sub(1) {
            self.mark(bank, last)?;
        }
        // Where one cannot be cleared, it is the next that shows later boots where to go on.
        while slot < self.slots() && !self.mark(bank, slot)? {
            slot += 1;
        }
        Ok(slot + 1)
    }

    /// The slot after the last entry that is whole. Those after it are of cuts, or cannot be erased.
    fn after_last_whole(&mut self, bank: &Bank) -> Seen<u32, F> {
        let (mut slot, mut entry) = (self.end(bank)?, Entry::blank());
        while let Some(last) = slot.checked_sub(1) {
            if self.fetch(bank, last, &mut entry)? {
                break;
            }
            slot = last;
        }
        Ok(slot)
    }

    /// Clears the first part of a slot that reads as erased and takes it: over a marginal word that is all that may be
    /// written. Returns whether there was one.
    #[inline(never)]
    fn mark(&mut self, bank: &Bank, slot: u32) -> Done<bool, F> {
        let start = self.address(bank, slot);
        for address in (start..start + ENTRY_BYTES).step_by(COPY as usize) {
            if self.is_part_blank(address)? && self.words.put(address, &Copy::mark()).is_ok() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Makes the other bank, with all that is still of use; gives its first free slot.
    fn turn_over(&mut self, from: &Bank) -> Done<Free, F> {
        let end = self.end(from)?;
        let with_previous = self.count_useful(from, end, true)? < self.slots();
        if !with_previous && self.count_useful(from, end, false)? >= self.slots() {
            return Err(StoreError::Full {
                entries: self.slots(),
            });
        }
        let address = self.other(from.address);
        self.erase(address)?;
        let (mut next, mut content) = (0, NO_CONTENT);
        for first in runs(end) {
            let useful = self.useful(from, first, with_previous)?;
            for slot in (first..end).filter(|slot| useful.has(slot - first)) {
                self.copy_entry(from, slot, address, &mut next, &mut content)?;
            }
        }
        self.commit(address, from.header.next(next, content), next)
    }

    #[inline(never)]
    fn count_useful(&mut self, from: &Bank, end: u32, with_previous: bool) -> Seen<u32, F> {
        let mut count = 0;
        for first in runs(end) {
            count += self.useful(from, first, with_previous)?.count();
        }
        Ok(count)
    }

    /// Copies an entry to the other bank, whose header follows; moves its next slot on.
    fn copy_entry(
        &mut self,
        from: &Bank,
        slot: u32,
        address: u32,
        next: &mut u32,
        content: &mut u32,
    ) -> Done<(), F> {
        let mut entry = Entry::blank();
        if !self.fetch(from, slot, &mut entry)? {
            return Err(StoreError::NotAsWritten);
        }
        let bank = Bank {
            address,
            header: from.header,
        };
        let taken = self.write_from(Free { bank, slot: *next }, &entry)?;
        let (taken, signature) = (taken.ok_or(StoreError::NotAsWritten)?, entry.signature());
        for passed in *next..taken {
            // A slot with a bit that is stuck reads as whole, as it is corrected.
            *content = with_entry(*content, self.signature(&bank, passed, &mut entry)?);
        }
        *content = with_entry(*content, signature);
        *next = taken + 1;
        Ok(())
    }

    /// Writes the header, after everything that it speaks for; gives the first free slot.
    fn commit(&mut self, address: u32, header: Header, slot: u32) -> Done<Free, F> {
        let copy = header.copy();
        let first = self.words.put(address, &copy);
        let second = self.words.put(address + COPY, &copy);
        first.or(second)?;
        let bank = Bank { address, header };
        Ok(Free { bank, slot })
    }

    /// The address of the other bank.
    fn other(&self, address: u32) -> u32 {
        let [first, second] = self.words.banks;
        if address == first { second } else { first }
    }

    /// Erases the bank at an address.
    #[inline(never)]
    fn erase(&mut self, address: u32) -> Seen<(), F> {
        let end = address + self.bytes();
        self.words.flash.erase(address, end)
    }

    /// Forgets everything.
    pub fn erase_both(&mut self) -> Seen<(), F> {
        (self.free, self.end) = (None, None);
        // The bank that is not in use goes first: what it holds must not come back if power is cut between the two.
        // Where none can be read, either may.
        let in_use = self.in_use().ok().flatten();
        let [first, _] = self.words.banks;
        let in_use = in_use.map_or(first, |bank| bank.address);
        self.erase(self.other(in_use))?;
        self.erase(in_use)
    }

    /// Reads a slot if its entry has this label; returns whether it has, and is whole.
    fn fetch_of(&mut self, bank: &Bank, slot: u32, label: Label, entry: &mut Entry) -> Seen<bool, F> {
        let mut peek = Copy::blank();
        let first = peek.0.get_mut(..HEAD.next_multiple_of(F::READ_SIZE));
        self.words
            .read(self.address(bank, slot), first.unwrap_or_default())?;
        let read = peek.0.first_chunk().map(Label::read);
        if !read.is_some_and(|read| read.resembles(&label)) {
            return Ok(false);
        }
        // The first read may have been wrong.
        Ok(self.fetch(bank, slot, entry)? && entry.label() == Some(label))
    }

    /// Reads a slot; returns whether its entry is whole, a single bit being corrected.
    #[inline(never)]
    pub fn fetch(&mut self, bank: &Bank, slot: u32, entry: &mut Entry) -> Seen<bool, F> {
        self.words.read(self.address(bank, slot), &mut entry.0)?;
        Ok(entry.correct())
    }

    /// Checks that nothing was written to a slot.
    #[inline(never)]
    fn is_blank(&mut self, bank: &Bank, slot: u32) -> Seen<bool, F> {
        let mut entry = Entry::blank();
        self.words.read(self.address(bank, slot), &mut entry.0)?;
        Ok(entry.is_blank())
    }

    /// Checks that nothing was written to a part of a slot.
    fn is_part_blank(&mut self, address: u32) -> Seen<bool, F> {
        let mut part = Copy::blank();
        self.words.read(address, &mut part.0)?;
        Ok(part == Copy::blank())
    }

    fn address(&self, bank: &Bank, slot: u32) -> u32 {
        bank.address + HEADER + slot * ENTRY_BYTES
    }
}

/// First slots of the runs in which the slots before an end are looked at.
fn runs(end: u32) -> impl Iterator<Item = u32> {
    (0..end).step_by(Slots::COUNT as usize)
}
