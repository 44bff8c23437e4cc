//! One record as it lies in flash: a fixed number of bytes with a checksum, so that no length has to be trusted to find
//! the next.

use tumble_core::redundancy::sensor::Sensor;

use crate::checksum::{CHECKSUM, correct_bit, is_signed, sign};
use crate::record::{DRIFT_ENCODED, MAGNETOMETER, MAX_ENCODED, is_sensor, sensor_code};

/// Bytes of an entry. A record of version 2 leaves 5 of them, for versions to come.
pub const ENTRY: usize = 192;

/// Bytes that may be written at once; a part of a slot of that size is cleared where it is not to be written any more.
pub const PART: usize = 32;

/// Byte of erased flash.
pub const ERASED: u8 = 0xFF;

/// Filler after a record of a drift or of a magnetometer. It is so short that parts of its entry would read as erased, and
/// be cleared after a cut.
const FILLED: u8 = 0;

/// Bytes before the record that identify it: kind, length, sensor, one that stays erased, identity.
pub const HEAD: usize = 12;

/// Most bytes of a record in an entry.
const ROOM: usize = ENTRY - HEAD - CHECKSUM;

const _: () = assert!(MAX_ENCODED <= ROOM && DRIFT_ENCODED <= ROOM);

/// Unit of a record, and the code of its sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    identity: u64,
    sensor: u8,
}

impl Key {
    /// Key of a sensor of an IMU.
    pub fn of(identity: u64, sensor: Sensor) -> Self {
        Self {
            identity,
            sensor: sensor_code(sensor),
        }
    }

    /// Key of a magnetometer.
    #[cfg(feature = "magnetometer")]
    pub fn of_magnetometer(identity: u64) -> Self {
        Self {
            identity,
            sensor: MAGNETOMETER,
        }
    }
}

/// Origin of a record of errors, or the mark of a temperature drift.
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
    /// Number of entries of a sensor that stay when a bank is left: one, and of those adopted the previous one where
    /// there is room for it.
    pub fn kept(self, with_previous: bool) -> u8 {
        1 + u8::from(with_previous && self == Kind::Adopted)
    }

    fn code(self) -> u8 {
        match self {
            Kind::Factory => b'F',
            Kind::Adopted => b'A',
            Kind::Drift => b'T',
        }
    }

    fn of(code: u8) -> Option<Self> {
        ALL.into_iter().find(|kind| kind.code() == code)
    }

    /// Checks whether a code differs from that of a kind by at most one bit.
    fn resembles(code: u8) -> bool {
        ALL.into_iter().any(|kind| (kind.code() ^ code).count_ones() <= 1)
    }
}

const ALL: [Kind; 3] = [Kind::Factory, Kind::Adopted, Kind::Drift];

/// Key and kind in the first bytes of an entry, whether or not they have a meaning.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Label {
    kind: u8,
    sensor: u8,
    identity: u64,
}

impl Label {
    /// Label of the entries of a sensor.
    pub fn of(kind: Kind, key: Key) -> Self {
        Self {
            kind: kind.code(),
            sensor: key.sensor,
            identity: key.identity,
        }
    }

    /// Reads the label from the first bytes of an entry.
    pub fn read(first: &[u8; HEAD]) -> Self {
        let [kind, _, sensor, _, identity @ ..] = *first;
        Self {
            kind,
            sensor,
            identity: u64::from_le_bytes(identity),
        }
    }

    /// Checks whether labels differ by at most one bit, which their entry's checksum may correct.
    pub fn resembles(&self, other: &Self) -> bool {
        let differ = (self.kind ^ other.kind).count_ones()
            + (self.sensor ^ other.sensor).count_ones()
            + (self.identity ^ other.identity).count_ones();
        differ <= 1
    }

    /// The kind, where kind and sensor have a meaning.
    pub fn kind(&self) -> Option<Kind> {
        Kind::of(self.kind).filter(|_| is_sensor(self.sensor))
    }
}

/// The bytes, aligned for drivers that move whole words.
#[derive(Clone, PartialEq, Eq)]
#[repr(align(4))]
pub struct Entry(pub [u8; ENTRY]);

impl Entry {
    /// Entry of erased flash.
    pub fn blank() -> Self {
        Self([ERASED; ENTRY])
    }

    /// One of a sensor, into which a record is to be put.
    pub fn of(kind: Kind, key: Key) -> Self {
        let mut entry = Self::blank();
        if kind == Kind::Drift || key.sensor == MAGNETOMETER {
            entry.room().fill(FILLED);
        }
        let label = Label::of(kind, key);
        if let Some([kind, _, sensor, _, identity @ ..]) = entry.0.first_chunk_mut::<HEAD>() {
            (*kind, *sensor) = (label.kind, label.sensor);
            *identity = label.identity.to_le_bytes();
        }
        entry
    }

    /// Label of this entry, if anything was written.
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

    /// Checks that nothing was written here.
    pub fn is_blank(&self) -> bool {
        self.0.as_chunks().0.iter().all(|word| *word == [ERASED; 4])
    }

    /// Checks whether a part of the slot was cleared.
    pub fn is_marked(&self) -> bool {
        self.0.as_chunks().0.contains(&[0; PART])
    }

    /// Checks that the entry is as it was written.
    pub fn is_whole(&self) -> bool {
        is_signed(&self.0)
    }

    /// Corrects a single bit; returns whether the entry is as it was written then. An entry that was begun only is none
    /// with a wrong bit: its last bytes read as erased.
    pub fn correct(&mut self) -> bool {
        if self.is_whole() {
            return true;
        }
        let [kind, ..] = self.0;
        if !Kind::resembles(kind) || self.signature() == [ERASED; CHECKSUM] {
            return false;
        }
        let mut corrected = self.clone();
        let is_corrected = correct_bit(&mut corrected.0) && is_signed(corrected.record());
        if is_corrected {
            self.0 = corrected.0;
        }
        is_corrected
    }

    /// The checksum at its end. Records of one length and sensor share it, since each ends with a checksum of its own.
    pub fn signature(&self) -> [u8; CHECKSUM] {
        self.0.last_chunk().copied().unwrap_or_default()
    }

    /// The checksum of the record.
    pub fn record_signature(&self) -> [u8; CHECKSUM] {
        self.record().last_chunk().copied().unwrap_or_default()
    }

    /// The bytes of the record.
    pub fn record(&self) -> &[u8] {
        let [_, length, ..] = self.0;
        self.0.get(HEAD..HEAD + usize::from(length)).unwrap_or_default()
    }
}
