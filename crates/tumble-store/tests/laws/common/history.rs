//! A plain model of the store, and sequences of updates to compare the two by.

use std::collections::BTreeMap;
use std::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use tumble_core::redundancy::sensor::{SENSORS, Sensor};
use tumble_core::temperature::TemperatureDrift;
use tumble_store::flash::{RecordStore, StoreError, Which, WriteLimit};
use tumble_store::record::{DriftRecord, StoredRecord};

use crate::common::{drift, example};

/// A store over the flash given.
pub fn open<F: NorFlash>(flash: F) -> RecordStore<F> {
    let range = whole(&flash);
    RecordStore::new(flash, range, UNLIMITED).unwrap()
}

/// All of a flash.
pub fn whole<F: NorFlash>(flash: &F) -> Range<u32> {
    0..u32::try_from(flash.capacity()).unwrap()
}

/// No limit on writing.
pub const UNLIMITED: WriteLimit = WriteLimit {
    shortest_between: 0,
    at_once: 1,
};

/// One change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Update {
    Save(StoredRecord),
    SaveFactory(StoredRecord),
    SaveDrift(DriftRecord),
    RollBack(u64, Sensor, Which),
}

/// A record that differs from every other of another number.
pub fn numbered(identity: u64, sensor: Sensor, number: u32) -> StoredRecord {
    let mut stored = example();
    stored.record.identity = identity;
    stored.record.sensor = sensor;
    stored.record.sequence = number;
    stored.record.model.bias[0] = number as f32;
    stored.temperature = number.is_multiple_of(3).then_some(20.0);
    stored
}

/// A drift that differs from every other of another number.
pub fn numbered_drift(identity: u64, sensor: Sensor, number: u32) -> DriftRecord {
    let mut drift = drift();
    drift.bias[2].y = number as f32;
    DriftRecord {
        identity,
        sensor,
        drift,
    }
}

/// An update of one of several units, chosen at random.
pub fn drawn(random: &mut Pcg64Mcg, units: u64, number: u32) -> Update {
    let identity = random.random_range(1..=units);
    let sensor = SENSORS[random.random_range(0..2)];
    match random.random_range(0..20) {
        0 => Update::RollBack(identity, sensor, Which::Previous),
        1 => Update::RollBack(identity, sensor, Which::Factory),
        // Few have a record from the factory, so that not all entries are of use.
        2 if identity == 1 => Update::SaveFactory(numbered(identity, sensor, number)),
        3 if identity == 2 => Update::SaveDrift(numbered_drift(identity, sensor, number)),
        _ => Update::Save(numbered(identity, sensor, number)),
    }
}

/// Makes an update in a store.
pub fn make<F: NorFlash>(update: &Update, store: &mut RecordStore<F>) -> Result<(), StoreError<F::Error>> {
    match *update {
        Update::Save(record) => store.save(0, &record).map(|_| ()),
        Update::SaveFactory(record) => store.save_factory(0, &record).map(|_| ()),
        Update::SaveDrift(drift) => store.save_drift(0, &drift).map(|_| ()),
        Update::RollBack(identity, sensor, to) => match store.roll_back(0, identity, sensor, to) {
            Err(StoreError::NothingStored(_)) => Ok(()),
            outcome => outcome.map(|_| ()),
        },
    }
}

/// Records expected in the store for a sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kept {
    pub last: Option<StoredRecord>,
    pub previous: Option<StoredRecord>,
    pub factory: Option<StoredRecord>,
    pub drift: Option<TemperatureDrift<f32>>,
}

impl Kept {
    fn put_in_force(&mut self, record: StoredRecord) {
        if self.last.or(self.factory) != Some(record) {
            self.previous = self.last;
            self.last = Some(record);
        }
    }
}

/// Expected contents of the store.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model(pub BTreeMap<(u64, Sensor), Kept>);

impl Model {
    /// Makes an update in the model.
    pub fn make(&mut self, update: &Update) {
        let (identity, sensor) = match update {
            Update::Save(StoredRecord { record, .. }) | Update::SaveFactory(StoredRecord { record, .. }) => {
                (record.identity, record.sensor)
            }
            Update::SaveDrift(drift) => (drift.identity, drift.sensor),
            Update::RollBack(identity, sensor, _) => (*identity, *sensor),
        };
        let kept = self.0.entry((identity, sensor)).or_default();
        match update {
            Update::Save(record) => kept.put_in_force(*record),
            Update::SaveFactory(record) => kept.factory = Some(*record),
            Update::SaveDrift(drift) => kept.drift = Some(drift.drift),
            Update::RollBack(_, _, to) => {
                let record = if *to == Which::Factory {
                    kept.factory
                } else {
                    kept.previous
                };
                if let Some(record) = record {
                    kept.put_in_force(record);
                }
            }
        }
    }

    /// Reads the records of the same sensors from the store.
    pub fn read<F: NorFlash>(&self, store: &mut RecordStore<F>) -> Self {
        let kept = |(identity, sensor): (u64, Sensor)| {
            let mut load = |which| store.load(identity, sensor, which).expect("it can be read");
            Kept {
                last: load(Which::Last),
                previous: load(Which::Previous),
                factory: load(Which::Factory),
                drift: store.drift(identity, sensor).expect("it can be read"),
            }
        };
        Self(
            self.0
                .keys()
                .copied()
                .map(kept)
                .zip(self.0.keys())
                .map(|(kept, key)| (*key, kept))
                .collect(),
        )
    }
}
