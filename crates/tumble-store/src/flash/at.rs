//! The store as the monitor of a redundant set sees it.

use embedded_storage::nor_flash::NorFlash;
use tumble_core::real::Real;
use tumble_core::redundancy::record::{Record, Storage};
use tumble_core::redundancy::sensor::Sensor;

use crate::flash::entry::{Key, Kind};
use crate::flash::{RecordStore, StoreError, Which};
use crate::record::StoredRecord;

/// A store at a point in time, which saving needs and `Storage` does not pass: as everywhere, time comes with the call.
pub struct At<'s, F: NorFlash> {
    pub(super) store: &'s mut RecordStore<F>,
    pub(super) now: u64,
    pub(super) temperature: Option<f32>,
}

impl<T: Real, F: NorFlash> Storage<T> for At<'_, F> {
    type Error = StoreError<F::Error>;

    fn load(&mut self, identity: u64, sensor: Sensor) -> Result<Option<Record<T>>, Self::Error> {
        let found: Option<StoredRecord<T>> = self.store.read(Key::of(identity, sensor), None)?;
        Ok(found.map(|stored| stored.record))
    }

    fn load_factory(&mut self, identity: u64, sensor: Sensor) -> Result<Option<Record<T>>, Self::Error> {
        let key = Key::of(identity, sensor);
        let found: Option<StoredRecord<T>> = self.store.read(key, Some(Which::Factory))?;
        Ok(found.map(|stored| stored.record))
    }

    fn save(&mut self, record: &Record<T>) -> Result<(), Self::Error> {
        let stored = StoredRecord {
            record: *record,
            temperature: self.temperature,
        };
        self.store.keep(self.now, Kind::Adopted, &stored).map(|_| ())
    }
}
