//! A plain model of the store, and sequences of updates to compare the two by.

use std::collections::BTreeMap;
use std::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use tumble_core::redundancy::sensor::{SENSORS, Sensor};
use tumble_core::temperature::TemperatureDrift;
use tumble_store::flash::{RecordStore, StoreError, Which, WriteLimit};
use tumble_store::record::{DriftRecord, MagnetometerRecord, StoredRecord};

use crate::common::{drift, example, magnetometer};

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

/// Three axes of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Triad {
    Of(Sensor),
    Magnetometer,
}

pub const TRIADS: [Triad; 3] = [Triad::Of(SENSORS[0]), Triad::Of(SENSORS[1]), Triad::Magnetometer];

/// A record of any triad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stored {
    Of(StoredRecord),
    Magnetometer(MagnetometerRecord),
}

impl Stored {
    /// Unit and triad.
    pub fn key(&self) -> (u64, Triad) {
        match self {
            Self::Of(stored) => (stored.record.identity, Triad::Of(stored.record.sensor)),
            Self::Magnetometer(record) => (record.identity, Triad::Magnetometer),
        }
    }
}

impl From<StoredRecord> for Stored {
    fn from(record: StoredRecord) -> Self {
        Self::Of(record)
    }
}

/// One change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Update {
    Save(Stored),
    SaveFactory(Stored),
    SaveDrift(DriftRecord),
    RollBack(u64, Triad, Which),
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

/// The same of a magnetometer.
pub fn numbered_magnetometer(identity: u64, number: u32) -> MagnetometerRecord {
    let mut record = magnetometer();
    record.identity = identity;
    record.magnetometer.model.bias.x = number as f32;
    record
}

/// The same of any triad.
pub fn numbered_of(identity: u64, triad: Triad, number: u32) -> Stored {
    match triad {
        Triad::Of(sensor) => Stored::Of(numbered(identity, sensor, number)),
        Triad::Magnetometer => Stored::Magnetometer(numbered_magnetometer(identity, number)),
    }
}

/// Reads one of the records of a triad.
pub fn load<F: NorFlash>(
    store: &mut RecordStore<F>,
    (identity, triad): (u64, Triad),
    which: Which,
) -> Result<Option<Stored>, StoreError<F::Error>> {
    Ok(match triad {
        Triad::Of(sensor) => store.load(identity, sensor, which)?.map(Stored::Of),
        Triad::Magnetometer => store
            .load_magnetometer(identity, which)?
            .map(Stored::Magnetometer),
    })
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
    // Few have a magnetometer, or a record from the factory, so that not all entries are of use.
    let triad = if identity == 1 && random.random_bool(0.3) {
        Triad::Magnetometer
    } else {
        Triad::Of(sensor)
    };
    match random.random_range(0..20) {
        0 => Update::RollBack(identity, triad, Which::Previous),
        1 => Update::RollBack(identity, triad, Which::Factory),
        2 if identity == 1 => Update::SaveFactory(numbered_of(identity, triad, number)),
        3 if identity == 2 => Update::SaveDrift(numbered_drift(identity, sensor, number)),
        _ => Update::Save(numbered_of(identity, triad, number)),
    }
}

/// Makes an update in a store.
pub fn make<F: NorFlash>(update: &Update, store: &mut RecordStore<F>) -> Result<(), StoreError<F::Error>> {
    match update {
        Update::Save(Stored::Of(record)) => store.save(0, record).map(|_| ()),
        Update::Save(Stored::Magnetometer(record)) => store.save_magnetometer(0, record).map(|_| ()),
        Update::SaveFactory(Stored::Of(record)) => store.save_factory(0, record).map(|_| ()),
        Update::SaveFactory(Stored::Magnetometer(record)) => {
            store.save_factory_magnetometer(0, record).map(|_| ())
        }
        Update::SaveDrift(drift) => store.save_drift(0, drift).map(|_| ()),
        Update::RollBack(identity, triad, to) => match roll_back(store, *identity, *triad, *to) {
            Err(StoreError::NothingStored(_)) => Ok(()),
            outcome => outcome,
        },
    }
}

fn roll_back<F: NorFlash>(
    store: &mut RecordStore<F>,
    identity: u64,
    triad: Triad,
    to: Which,
) -> Result<(), StoreError<F::Error>> {
    match triad {
        Triad::Of(sensor) => store.roll_back(0, identity, sensor, to).map(|_| ()),
        Triad::Magnetometer => store.roll_back_magnetometer(0, identity, to).map(|_| ()),
    }
}

/// Reads the drift of a sensor; a magnetometer has none.
pub fn drift_of<F: NorFlash>(
    store: &mut RecordStore<F>,
    (identity, triad): (u64, Triad),
) -> Result<Option<TemperatureDrift<f32>>, StoreError<F::Error>> {
    match triad {
        Triad::Of(sensor) => store.drift(identity, sensor),
        Triad::Magnetometer => Ok(None),
    }
}

/// Records expected in the store for a triad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kept {
    pub last: Option<Stored>,
    pub previous: Option<Stored>,
    pub factory: Option<Stored>,
    pub drift: Option<TemperatureDrift<f32>>,
}

impl Kept {
    fn put_in_force(&mut self, record: Stored) {
        if self.last.or(self.factory) != Some(record) {
            self.previous = self.last;
            self.last = Some(record);
        }
    }
}

/// Expected contents of the store.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model(pub BTreeMap<(u64, Triad), Kept>);

impl Model {
    /// Makes an update in the model.
    pub fn make(&mut self, update: &Update) {
        let key = match update {
            Update::Save(record) | Update::SaveFactory(record) => record.key(),
            Update::SaveDrift(drift) => (drift.identity, Triad::Of(drift.sensor)),
            Update::RollBack(identity, triad, _) => (*identity, *triad),
        };
        let kept = self.0.entry(key).or_default();
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

    /// Reads the records of the same triads from the store.
    pub fn read<F: NorFlash>(&self, store: &mut RecordStore<F>) -> Self {
        let kept = |key: (u64, Triad)| {
            let mut load = |which| load(store, key, which).expect("it can be read");
            Kept {
                last: load(Which::Last),
                previous: load(Which::Previous),
                factory: load(Which::Factory),
                drift: drift_of(store, key).expect("it can be read"),
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
