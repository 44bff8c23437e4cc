//! Magnetometers in the store: the third sensor of a unit, with records of its own version.

use embedded_storage::nor_flash::NorFlash;

use crate::flash::entry::{Key, Kind};
use crate::flash::{RecordStore, Saved, StoreError, Which};
use crate::record::MagnetometerRecord;

impl<F: NorFlash> RecordStore<F> {
    /// The record of a magnetometer that is in force: the last adopted, else the factory's.
    ///
    /// # Errors
    /// [`StoreError`], where it cannot be read.
    pub fn magnetometer_in_force(
        &mut self,
        identity: u64,
    ) -> Result<Option<MagnetometerRecord>, StoreError<F::Error>> {
        self.read(Key::of_magnetometer(identity), None)
    }

    /// One of the records of a magnetometer.
    ///
    /// # Errors
    /// [`StoreError`], where it cannot be read.
    pub fn load_magnetometer(
        &mut self,
        identity: u64,
        which: Which,
    ) -> Result<Option<MagnetometerRecord>, StoreError<F::Error>> {
        self.read(Key::of_magnetometer(identity), Some(which))
    }

    /// Puts a record of a magnetometer in force, like [`RecordStore::save`] one of another sensor.
    ///
    /// # Errors
    /// [`StoreError`], as of [`RecordStore::save`].
    pub fn save_magnetometer(
        &mut self,
        now: u64,
        record: &MagnetometerRecord,
    ) -> Result<Saved, StoreError<F::Error>> {
        self.keep(now, Kind::Adopted, record)
    }

    /// Keeps a record of a magnetometer as the factory's; it is in force until another is saved.
    ///
    /// # Errors
    /// [`StoreError`], as of [`RecordStore::save`].
    pub fn save_factory_magnetometer(
        &mut self,
        now: u64,
        record: &MagnetometerRecord,
    ) -> Result<Saved, StoreError<F::Error>> {
        self.keep(now, Kind::Factory, record)
    }

    /// Puts the previous or the factory's record of a magnetometer in force again, like [`RecordStore::roll_back`].
    ///
    /// # Errors
    /// [`StoreError`], as of [`RecordStore::save`].
    pub fn roll_back_magnetometer(
        &mut self,
        now: u64,
        identity: u64,
        to: Which,
    ) -> Result<MagnetometerRecord, StoreError<F::Error>> {
        let found = self.load_magnetometer(identity, to)?;
        let record = found.ok_or(StoreError::NothingStored(to))?;
        self.save_magnetometer(now, &record)?;
        Ok(record)
    }
}
