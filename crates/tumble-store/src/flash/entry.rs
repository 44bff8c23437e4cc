//! One record as it lies in flash: a fixed number of bytes with a checksum, so that no length has to be trusted to find
//! the next.

use tumble_core::redundancy::sensor::Sensor;

use crate::record::{DRIFT_ENCODED, MAX_ENCODED, checksum, sensor, sensor_code};

/// Bytes of an entry. A record of version 2 leaves 5 of them, for versions to come.
pub const ENTRY: usize = 192;

/// Bytes at its start that say whose it is, and what is read of it first: a multiple of what any flash reads at once.
pub const PEEK: usize = 32;

/// What flash holds where nothing was written.
pub const ERASED: u8 = 0xFF;

/// What follows a drift, which is so short that parts of its entry would read as erased, and be cleared after a cut.
const FILLED: u8 = 0;

/// Bytes before the record: kind, length, sensor, one that stays erased, identity.
const HEAD: usize = 12;

const CHECKSUM: usize = 4;

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

/// The bytes, aligned for drivers that move whole words.
#[derive(Clone, PartialEq, Eq)]
#[repr(align(4))]
pub struct Entry(pub [u8; ENTRY]);

impl Entry {
    /// What is read where nothing was written.
    pub fn blank() -> Self {
        Self([ERASED; ENTRY])
    }

    /// Puts the bytes of a record into an entry, if there is room.
    pub fn new(kind: Kind, key: Key, record: &[u8]) -> Option<Self> {
        let mut entry = Self::blank();
        let (covered, signature) = entry.0.split_last_chunk_mut::<CHECKSUM>()?;
        let (head, room) = covered.split_first_chunk_mut::<HEAD>()?;
        let [k, length, s, _, identity @ ..] = head;
        (*k, *length, *s) = (
            kind.code(),
            u8::try_from(record.len()).ok()?,
            sensor_code(key.sensor),
        );
        *identity = key.identity.to_le_bytes();
        if kind == Kind::Drift {
            room.fill(FILLED);
        }
        room.get_mut(..record.len())?.copy_from_slice(record);
        *signature = checksum(covered).to_le_bytes();
        Some(entry)
    }

    /// Whether nothing was written here.
    pub fn is_blank(&self) -> bool {
        self.0.iter().all(|byte| *byte == ERASED)
    }

    /// Whether it is as it was written.
    pub fn is_whole(&self) -> bool {
        self.signature().is_some()
    }

    /// The checksum at its end, if it is as it was written.
    pub fn signature(&self) -> Option<[u8; CHECKSUM]> {
        let (covered, signature) = self.0.split_last_chunk::<CHECKSUM>()?;
        (checksum(covered).to_le_bytes() == *signature).then_some(*signature)
    }

    /// The bytes of the record.
    pub fn record(&self) -> &[u8] {
        let [_, length, ..] = self.0;
        let record = self
            .0
            .get(HEAD..)
            .and_then(|room| room.get(..usize::from(length)));
        record.unwrap_or_default()
    }
}

/// Whose an entry says it is, by its first bytes.
pub fn label(peek: &[u8]) -> Option<(Kind, Key)> {
    let [k, _, s, _, identity @ ..] = peek.first_chunk::<HEAD>()?;
    let key = Key {
        identity: u64::from_le_bytes(*identity),
        sensor: sensor(*s).ok()?,
    };
    Some((Kind::of(*k)?, key))
}
