//! The records of many units in NOR flash.
//!
//! Three records of each sensor of each unit stay: the factory's, the last adopted, and while there is room the one
//! before. The last adopted record is in force, else the factory's. A stored temperature drift of the sensor is kept
//! beside them.
//! Replacing is atomic: power may be cut at any byte of any write and anywhere in an erasure, whatever that leaves
//! behind, be it a word that reads otherwise in each boot or with an error, and the old or the new record reads back
//! whole. A record reported as stored reads back in all later boots, also after a bit of it has changed. Words that do
//! not take what is written are passed over.
//!
//! `docs/record-format.md` describes the layout in flash. Available maps do not meet this: sequential-storage 8.0 takes
//! an erasure to clear a page from its start, and where one was cut that left the start for last, records that had been
//! stored for long were lost; after two cuts it may lose a record it had reported as stored (its issue 136); and a
//! compiler cannot prove its panics away. Nothing here depends on what a cut erasure leaves.

mod at;
mod bank;
mod entry;
mod header;
mod kept;
mod limit;
#[cfg(feature = "magnetometer")]
mod magnetometer;
mod useful;
mod words;

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::temperature::TemperatureDrift;

pub use crate::flash::at::At;
use crate::flash::bank::{Bank, Banks};
use crate::flash::entry::{Entry, Key, Kind, Label};
use crate::flash::kept::Kept;
pub use crate::flash::limit::WriteLimit;
use crate::flash::limit::Writes;
use crate::record::{DecodeError, DriftRecord, EncodeError, StoredRecord, decode_drift, encode_drift};

/// Which of the records of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The last that was adopted.
    Last,
    /// The one adopted before.
    Previous,
    /// The one from the factory.
    Factory,
}

/// Outcome of a save.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Saved {
    /// It is in flash now.
    Written,
    /// It was in flash already; nothing was written.
    AlreadyThere,
}

/// Why a range of flash cannot hold records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutError {
    /// It does not begin at a page, or has not an even number of pages, at least two.
    NotWholePages,
    /// It is empty, or ends beyond the flash.
    OutOfBounds,
    /// Half of it has no room for the records of one sensor; 832 bytes are needed.
    TooSmall,
    /// The flash's word, for reading or writing, does not divide 32 bytes.
    WordsNotSupported,
}

/// Why a record was not read or not stored. Stored records are still there; after [`StoreError::Flash`] and
/// [`StoreError::NotAsWritten`] the new record may have taken its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError<E> {
    /// The flash could not do it.
    Flash(E),
    /// The flash reported success, but holds something else: it is worn, or was not erased.
    NotAsWritten,
    /// The record cannot be stored.
    Encode(EncodeError),
    /// The record is whole in flash but not to be read, by this version of the crate.
    Decode(DecodeError),
    /// Flash would wear out; the caller may try again later.
    TooSoon {
        /// Microseconds to wait.
        wait: u64,
    },
    /// All entries of a bank are of use, even without the previous records, which are dropped first: too many units for
    /// this range.
    Full {
        /// Entries of a bank.
        entries: u32,
    },
    /// There is no such record to roll back to.
    NothingStored(Which),
}

impl<E> From<E> for StoreError<E> {
    fn from(error: E) -> Self {
        Self::Flash(error)
    }
}

/// Kinds that can be in force, in order of precedence.
const IN_FORCE: [Kind; 2] = [Kind::Adopted, Kind::Factory];

/// Records in a range of flash: two halves, of which one is in use while the other is erased.
pub struct RecordStore<F: NorFlash> {
    banks: Banks<F>,
    limit: WriteLimit,
    writes: Writes,
}

impl<F: NorFlash> RecordStore<F> {
    /// Takes a range of flash, in its own addresses; nothing is read or written yet. Flash that never held records is
    /// erased, half of it, when the first is saved.
    ///
    /// # Errors
    /// [`LayoutError`].
    pub fn new(flash: F, range: Range<u32>, limit: WriteLimit) -> Result<Self, LayoutError> {
        let banks = Banks::new(flash, range.start, range.end)?;
        Ok(Self {
            banks,
            limit,
            writes: Writes::default(),
        })
    }

    /// Entries that there is room for. Three of each sensor of each unit stay, and its drift, if it has one; the fewer of the others there are, the
    /// more often flash is erased, so let there be twice as many.
    pub fn entries(&self) -> u32 {
        self.banks.slots()
    }

    /// The record that is in force: the last adopted, else the factory's.
    ///
    /// # Errors
    /// [`StoreError`], where there is one that cannot be read.
    pub fn in_force(
        &mut self,
        identity: u64,
        sensor: Sensor,
    ) -> Result<Option<StoredRecord>, StoreError<F::Error>> {
        self.read(Key::of(identity, sensor), None)
    }

    /// One of the records of a sensor.
    ///
    /// # Errors
    /// [`StoreError`], where there is one that cannot be read.
    pub fn load(
        &mut self,
        identity: u64,
        sensor: Sensor,
        which: Which,
    ) -> Result<Option<StoredRecord>, StoreError<F::Error>> {
        self.read(Key::of(identity, sensor), Some(which))
    }

    /// Puts a record in force; the one adopted before it stays as the previous one. Nothing is written if it is in
    /// force, unless it was the last to be written in an earlier boot: power may have been cut in it.
    ///
    /// # Errors
    /// [`StoreError`]; the old one is in force, unless the flash failed after the new one was whole.
    pub fn save(&mut self, now: u64, record: &StoredRecord) -> Result<Saved, StoreError<F::Error>> {
        self.keep(now, Kind::Adopted, record)
    }

    /// Keeps a record as the factory's; it is in force until another is saved.
    ///
    /// # Errors
    /// [`StoreError`], as of [`RecordStore::save`].
    pub fn save_factory(&mut self, now: u64, record: &StoredRecord) -> Result<Saved, StoreError<F::Error>> {
        self.keep(now, Kind::Factory, record)
    }

    /// Reads the temperature drift of a sensor, if one was stored; calibrations leave it as it is.
    ///
    /// # Errors
    /// [`StoreError`], where it cannot be read.
    pub fn drift(
        &mut self,
        identity: u64,
        sensor: Sensor,
    ) -> Result<Option<TemperatureDrift<f32>>, StoreError<F::Error>> {
        let key = Key::of(identity, sensor);
        let mut entry = Entry::blank();
        if self.find(key, &[Kind::Drift], &mut entry)?.is_none() {
            return Ok(None);
        }
        let record = decode_drift(entry.record()).map_err(StoreError::Decode)?;
        let named = (record.identity, record.sensor) == (identity, sensor);
        let drift = named.then_some(Some(record.drift));
        drift.ok_or(StoreError::Decode(DecodeError::Corrupt))
    }

    /// Keeps what temperature does to a sensor, in place of what was kept of that before.
    ///
    /// # Errors
    /// [`StoreError`], as of [`RecordStore::save`].
    pub fn save_drift(&mut self, now: u64, record: &DriftRecord) -> Result<Saved, StoreError<F::Error>> {
        let key = Key::of(record.identity, record.sensor);
        let mut entry = Entry::of(Kind::Drift, key);
        let length = encode_drift(record, entry.room())
            .map_err(StoreError::Encode)?
            .len();
        entry.end(length);
        self.store(now, key, &[Kind::Drift], &entry)
    }

    /// Puts the previous or the factory's record in force again, and gives it; what was in force becomes the previous
    /// one, so that rolling back to the previous one twice changes nothing.
    ///
    /// # Errors
    /// [`StoreError`], as of [`RecordStore::save`].
    pub fn roll_back(
        &mut self,
        now: u64,
        identity: u64,
        sensor: Sensor,
        to: Which,
    ) -> Result<StoredRecord, StoreError<F::Error>> {
        let found = self.load(identity, sensor, to)?;
        let record = found.ok_or(StoreError::NothingStored(to))?;
        self.save(now, &record)?;
        Ok(record)
    }

    /// The store at a point in time, for `Monitor::restore_from` and for saving what the monitor adopted; `temperature`
    /// of the units, degC, goes with what is saved.
    pub fn at(&mut self, now: u64, temperature: Option<f32>) -> At<'_, F> {
        At {
            store: self,
            now,
            temperature,
        }
    }

    /// Forgets all records.
    ///
    /// # Errors
    /// [`StoreError::Flash`].
    pub fn erase(&mut self) -> Result<(), StoreError<F::Error>> {
        Ok(self.banks.erase_both()?)
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.banks.into_flash()
    }

    /// Reads one of the records of a sensor, or the one in force.
    #[inline(never)]
    fn read<R: Kept>(&mut self, key: Key, which: Option<Which>) -> Result<Option<R>, StoreError<F::Error>> {
        let mut entry = Entry::blank();
        if !self.find_which(key, which, &mut entry)? {
            return Ok(None);
        }
        let found = R::decode(entry.record()).map_err(StoreError::Decode)?;
        if found.key() == key {
            Ok(Some(found))
        } else {
            Err(StoreError::Decode(DecodeError::Corrupt))
        }
    }

    /// Finds the entry of one of the records of a sensor, or of the one in force; returns whether there is one.
    #[inline(never)]
    fn find_which(&mut self, key: Key, which: Option<Which>, entry: &mut Entry) -> Result<bool, F::Error> {
        let kinds: &[Kind] = match which {
            None => &IN_FORCE,
            Some(Which::Last | Which::Previous) => &[Kind::Adopted],
            Some(Which::Factory) => &[Kind::Factory],
        };
        let Some((bank, slot)) = self.find(key, kinds, entry)? else {
            return Ok(false);
        };
        Ok(which != Some(Which::Previous) || self.find_previous(&bank, slot, key, entry)?)
    }

    /// Stores a record as of the factory, or as adopted.
    #[inline(never)]
    fn keep<R: Kept>(&mut self, now: u64, kind: Kind, record: &R) -> Result<Saved, StoreError<F::Error>> {
        let key = record.key();
        let mut entry = Entry::of(kind, key);
        let length = record.encode(entry.room()).map_err(StoreError::Encode)?;
        entry.end(length);
        let replaced: &[Kind] = if kind == Kind::Adopted { &IN_FORCE } else { &[kind] };
        self.store(now, key, replaced, &entry)
    }

    /// Writes an entry unless the one that it replaces, of the first of some kinds that there is, holds the same record for
    /// good.
    fn store(
        &mut self,
        now: u64,
        key: Key,
        replaced: &[Kind],
        entry: &Entry,
    ) -> Result<Saved, StoreError<F::Error>> {
        if self.holds(key, replaced, entry)? {
            return Ok(Saved::AlreadyThere);
        }
        let before = self.writes;
        let counted = self.writes.count(&self.limit, now);
        counted.map_err(|wait| StoreError::TooSoon { wait })?;
        let appended = self.banks.append(entry);
        if matches!(appended, Err(StoreError::Full { .. })) {
            // Flash was looked at only, which wears nothing.
            self.writes = before;
        }
        appended.map(|()| Saved::Written)
    }

    /// Checks whether the last entry of a sensor, of the first of these kinds that it has, holds for good the record of
    /// another.
    #[inline(never)]
    fn holds(&mut self, key: Key, kinds: &[Kind], entry: &Entry) -> Result<bool, F::Error> {
        let mut held = Entry::blank();
        match self.find(key, kinds, &mut held)? {
            Some((bank, slot)) if held.record() == entry.record() => self.banks.is_firm(&bank, slot),
            _ => Ok(false),
        }
    }

    /// Finds the last entry of a sensor, of the first of some kinds that it has: its bank and slot.
    fn find(&mut self, key: Key, kinds: &[Kind], entry: &mut Entry) -> Result<Option<(Bank, u32)>, F::Error> {
        let Some(bank) = self.banks.in_use()? else {
            return Ok(None);
        };
        for kind in kinds {
            let end = self.banks.end(&bank)?;
            if let Some(slot) = self.banks.last_before(&bank, end, Label::of(*kind, key), entry)? {
                return Ok(Some((bank, slot)));
            }
        }
        Ok(None)
    }

    /// Finds the record that was adopted before the last, which is in a slot.
    #[inline(never)]
    fn find_previous(
        &mut self,
        bank: &Bank,
        slot: u32,
        key: Key,
        entry: &mut Entry,
    ) -> Result<bool, F::Error> {
        let (last, mut end) = (entry.clone(), slot);
        let label = Label::of(Kind::Adopted, key);
        while let Some(slot) = self.banks.last_before(bank, end, label, entry)? {
            // The last was written twice, for it to be firm.
            if *entry != last {
                return Ok(true);
            }
            end = slot;
        }
        Ok(false)
    }
}
