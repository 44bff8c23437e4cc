//! The records of many units in NOR flash.
//!
//! Of each sensor of each unit three records stay: the factory's, the last that was adopted, and the one before. What
//! is in force is the last adopted, else the factory's. What temperature does to it is kept beside them, where it was
//! stored. Replacing is atomic: power may be cut at any byte of any write
//! and anywhere in an erasure, whatever that leaves behind, be it a word that reads otherwise in each boot, and the old or
//! the new record reads back whole. One that was said to be stored does so in all boots to come.
//!
//! How it lies in flash is in `docs/record-format.md`. Maps that are to be had did not do: sequential-storage 8.0
//! takes an erasure to clear a page from its start, and where one was cut that left the start for last, records that
//! had been stored for long were gone; after two cuts it may lose a record it said it had stored (its issue 136); and
//! a compiler cannot prove its panics away. Nothing here depends on what a cut erasure leaves.

mod at;
mod bank;
mod entry;
mod limit;

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::temperature::TemperatureDrift;

pub use crate::flash::at::At;
use crate::flash::bank::{Bank, Banks, Found};
use crate::flash::entry::{Entry, Key, Kind, label};
pub use crate::flash::limit::WriteLimit;
use crate::flash::limit::Writes;
use crate::record::{
    DRIFT_ENCODED, DecodeError, DriftRecord, EncodeError, MAX_ENCODED, StoredRecord, decode, decode_drift,
    encode, encode_drift,
};

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

/// What saving did.
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
    /// What the flash reads or writes at once does not divide 32 bytes.
    WordsNotSupported,
}

/// Why a record was not read or not stored. What was stored is still there; after [`StoreError::Flash`] and
/// [`StoreError::NotAsWritten`] the new record may have taken its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError<E> {
    /// The flash could not do it.
    Flash(E),
    /// The flash said it did it, but holds something else: it is worn, or was not erased.
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
    /// All entries of a bank are of use: too many units for this range.
    Full {
        /// Entries of a bank.
        entries: u32,
    },
    /// There is no such record to roll back to.
    NothingStored(Which),
}

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
        let found = self.found_in_force(Key { identity, sensor })?;
        found.map(|(_, found)| read(&found.entry)).transpose()
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
        let found = self.find(Key { identity, sensor }, which)?;
        found.map(|(_, found)| read(&found.entry)).transpose()
    }

    /// Puts a record in force; the one adopted before it stays as the previous one. Nothing is written if it is in
    /// force, unless it was the last to be written in an earlier boot: power may have been cut in it.
    ///
    /// # Errors
    /// [`StoreError`]; the old one is in force, unless the flash failed after the new one was whole.
    pub fn save(&mut self, now: u64, record: &StoredRecord) -> Result<Saved, StoreError<F::Error>> {
        let entry = written(Kind::Adopted, record)?;
        let in_force = self.found_in_force(key(record))?;
        self.store(now, &entry, in_force)
    }

    /// Keeps a record as the factory's; it is in force until another is saved.
    ///
    /// # Errors
    /// [`StoreError`], as of [`RecordStore::save`].
    pub fn save_factory(&mut self, now: u64, record: &StoredRecord) -> Result<Saved, StoreError<F::Error>> {
        let entry = written(Kind::Factory, record)?;
        let stored = self.find(key(record), Which::Factory)?;
        self.store(now, &entry, stored)
    }

    /// What temperature does to a sensor, if that was stored; calibrations leave it as it is.
    ///
    /// # Errors
    /// [`StoreError`], where it cannot be read.
    pub fn drift(
        &mut self,
        identity: u64,
        sensor: Sensor,
    ) -> Result<Option<TemperatureDrift<f32>>, StoreError<F::Error>> {
        let key = Key { identity, sensor };
        let Some((_, found)) = self.found_drift(key)? else {
            return Ok(None);
        };
        let record = decode_drift(found.entry.record()).map_err(StoreError::Decode)?;
        let named = (record.identity, record.sensor) == (identity, sensor);
        let drift = named.then_some(Some(record.drift));
        drift.ok_or(StoreError::Decode(DecodeError::Corrupt))
    }

    /// Keeps what temperature does to a sensor, in place of what was kept of that before.
    ///
    /// # Errors
    /// [`StoreError`], as of [`RecordStore::save`].
    pub fn save_drift(&mut self, now: u64, record: &DriftRecord) -> Result<Saved, StoreError<F::Error>> {
        let key = Key {
            identity: record.identity,
            sensor: record.sensor,
        };
        let mut buffer = [0; DRIFT_ENCODED];
        let bytes = encode_drift(record, &mut buffer).map_err(StoreError::Encode)?;
        let entry = Entry::new(Kind::Drift, key, bytes);
        let entry = entry.ok_or(StoreError::Encode(EncodeError::NoRoom))?;
        let stored = self.found_drift(key)?;
        self.store(now, &entry, stored)
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
        self.banks.erase_both()
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.banks.flash
    }

    /// Writes an entry unless the one that it replaces holds the same record for good.
    fn store(
        &mut self,
        now: u64,
        entry: &Entry,
        replaced: Option<(Bank, Found)>,
    ) -> Result<Saved, StoreError<F::Error>> {
        if let Some((bank, found)) = replaced
            && found.entry.record() == entry.record()
            && self.banks.is_firm(bank, &found)?
        {
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

    fn found_drift(&mut self, key: Key) -> Result<Option<(Bank, Found)>, StoreError<F::Error>> {
        let Some(bank) = self.banks.in_use()? else {
            return Ok(None);
        };
        let end = self.banks.slots();
        let found = self.banks.last_before(bank, end, key, Kind::Drift)?;
        Ok(found.map(|found| (bank, found)))
    }

    fn found_in_force(&mut self, key: Key) -> Result<Option<(Bank, Found)>, StoreError<F::Error>> {
        match self.find(key, Which::Last)? {
            None => self.find(key, Which::Factory),
            found => Ok(found),
        }
    }

    /// Finds one of the records of a sensor, and the bank it is in.
    fn find(&mut self, key: Key, which: Which) -> Result<Option<(Bank, Found)>, StoreError<F::Error>> {
        let Some(bank) = self.banks.in_use()? else {
            return Ok(None);
        };
        let end = self.banks.slots();
        let found = match which {
            Which::Last => self.banks.last_before(bank, end, key, Kind::Adopted)?,
            Which::Factory => self.banks.last_before(bank, end, key, Kind::Factory)?,
            Which::Previous => self.previous(bank, key)?,
        };
        Ok(found.map(|found| (bank, found)))
    }

    fn previous(&mut self, bank: Bank, key: Key) -> Result<Option<Found>, StoreError<F::Error>> {
        let end = self.banks.slots();
        let Some(last) = self.banks.last_before(bank, end, key, Kind::Adopted)? else {
            return Ok(None);
        };
        let mut end = last.slot;
        loop {
            match self.banks.last_before(bank, end, key, Kind::Adopted)? {
                // The last was written twice, for it to be firm.
                Some(found) if found.entry == last.entry => end = found.slot,
                found => return Ok(found),
            }
        }
    }
}

fn key(record: &StoredRecord) -> Key {
    let StoredRecord { record, .. } = record;
    Key {
        identity: record.identity,
        sensor: record.sensor,
    }
}

/// The entry of a record.
fn written<E>(kind: Kind, record: &StoredRecord) -> Result<Entry, StoreError<E>> {
    let mut buffer = [0; MAX_ENCODED];
    let bytes = encode(record, &mut buffer).map_err(StoreError::Encode)?;
    Entry::new(kind, key(record), bytes).ok_or(StoreError::Encode(EncodeError::NoRoom))
}

/// The record of an entry, which has to be of the sensor that the entry names.
fn read<E>(entry: &Entry) -> Result<StoredRecord, StoreError<E>> {
    let record = decode(entry.record()).map_err(StoreError::Decode)?;
    match label(&entry.0) {
        Some((_, named)) if named == key(&record) => Ok(record),
        _ => Err(StoreError::Decode(DecodeError::Corrupt)),
    }
}
