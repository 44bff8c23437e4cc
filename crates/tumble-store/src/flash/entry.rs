//! One record as it lies in flash: a fixed number of bytes with a checksum, so that no length has to be trusted to find
//! the next.

use tumble_core::redundancy::sensor::Sensor;

use crate::checksum::{CHECKSUM, is_signed, sign};
use crate::record::{DRIFT_ENCODED, MAX_ENCODED, sensor, sensor_code};

/// Bytes of an entry. A record of version 2 leaves 5 of them, for versions to come.
pub const ENTRY: usize = 192;

/// What flash holds where nothing was written.
pub const ERASED: u8 = 0xFF;

/// What follows a drift, which is so short that parts of its entry would read as erased, and be cleared after a cut.
const FILLED: u8 = 0;

/// Bytes before the record, which say whose it is: kind, length, sensor, one that stays erased, identity.
pub const HEAD: usize = 12;

/// Most bytes of a record in an entry.
const ROOM: usize = ENTRY - HEAD - CHECKSUM;

const _: () = assert!(MAX_ENCODED <= ROOM && DRIFT_ENCODED <= ROOM);

/// Whose a record is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    pub identity: u64,
    pub sensor: Sensor,
}

/// Where a record comes from, or that it says what temperature does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// It was there when the unit was made.
    Factory,
    /// It was put in force later.
    Adopted,
    /// It is a drift.
    Drift,
}

impl Kind {
    /// How many of a sensor stay when a bank is left: of those adopted, the last and the one before.
    pub fn kept(self) -> u32 {
        match self {
            Kind::Factory | Kind::Drift => 1,
            Kind::Adopted => 2,
        }
    }

    fn code(self) -> u8 {
        match self {
            Kind::Factory => b'F',
            Kind::Adopted => b'A',
            Kind::Drift => b'T',
        }
    }

    fn of(code: u8) -> Option<Self> {
        [Kind::Factory, Kind::Adopted, Kind::Drift]
            .into_iter()
            .find(|kind| kind.code() == code)
    }
}

/// Whose an entry says it is by its first bytes, and of what kind, whether or not that has a meaning.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Label {
    kind: u8,
    sensor: u8,
    identity: u64,
}

impl Label {
    /// Of the entries of a sensor.
    pub fn of(kind: Kind, key: Key) -> Self {
        Self {
            kind: kind.code(),
            sensor: sensor_code(key.sensor),
            identity: key.identity,
        }
    }

    /// Of an entry that begins so.
    pub fn read(first: &[u8; HEAD]) -> Self {
        let [kind, _, sensor, _, identity @ ..] = *first;
        Self {
            kind,
            sensor,
            identity: u64::from_le_bytes(identity),
        }
    }

    /// The kind, where kind and sensor have a meaning.
    pub fn kind(&self) -> Option<Kind> {
        sensor(self.sensor).and_then(|_| Kind::of(self.kind))
    }
}

/// The bytes, aligned for drivers that move whole words.
#[derive(Clone, PartialEq, Eq)]
#[repr(align(4))]
pub struct Entry(pub [u8; ENTRY]);

impl Entry {
    /// What is read where nothing was written.
    pub fn blank() -> Self {
        Self([ERASED; ENTRY])
    }

    /// One of a sensor, into which a record is to be put.
    pub fn of(kind: Kind, key: Key) -> Self {
        let mut entry = Self::blank();
        if kind == Kind::Drift {
            entry.room().fill(FILLED);
        }
        let label = Label::of(kind, key);
        if let Some([kind, _, sensor, _, identity @ ..]) = entry.0.first_chunk_mut::<HEAD>() {
            (*kind, *sensor) = (label.kind, label.sensor);
            *identity = label.identity.to_le_bytes();
        }
        entry
    }

    /// Whose it says it is.
    pub fn label(&self) -> Option<Label> {
        self.0.first_chunk().map(Label::read)
    }

    /// Where the bytes of a record go.
    pub fn room(&mut self) -> &mut [u8] {
        self.0.get_mut(HEAD..HEAD + ROOM).unwrap_or_default()
    }

    /// Ends an entry whose record has so many bytes.
    pub fn end(&mut self, length: usize) {
        let [_, place, ..] = &mut self.0;
        *place = length as u8;
        sign(&mut self.0);
    }

    /// Whether nothing was written here.
    pub fn is_blank(&self) -> bool {
        self.0.as_chunks().0.iter().all(|word| *word == [ERASED; 4])
    }

    /// Whether it is as it was written.
    pub fn is_whole(&self) -> bool {
        is_signed(&self.0)
    }

    /// The checksum at its end, if it is as it was written.
    pub fn signature(&self) -> Option<[u8; CHECKSUM]> {
        self.0.last_chunk().filter(|_| self.is_whole()).copied()
    }

    /// The bytes of the record.
    pub fn record(&self) -> &[u8] {
        let [_, length, ..] = self.0;
        self.0.get(HEAD..HEAD + usize::from(length)).unwrap_or_default()
    }
}
