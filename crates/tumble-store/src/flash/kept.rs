//! Records that the store keeps as of the factory and as adopted.

use tumble_core::real::Real;

use crate::flash::entry::Key;
use crate::record::{DecodeError, EncodeError, StoredRecord, decode_in, encode_of};
#[cfg(feature = "magnetometer")]
use crate::record::{MagnetometerRecord, decode_magnetometer, encode_magnetometer_of};

/// Error of a sensor as its bytes in an entry.
pub trait Kept: Sized {
    /// Unit and sensor.
    fn key(&self) -> Key;

    /// Writes it at the start of a buffer; returns how many bytes it has.
    fn encode(&self, buffer: &mut [u8]) -> Result<usize, EncodeError>;

    /// Reads it from the bytes that are it.
    fn decode(bytes: &[u8]) -> Result<Self, DecodeError>;
}

impl<T: Real> Kept for StoredRecord<T> {
    fn key(&self) -> Key {
        Key::of(self.record.identity, self.record.sensor)
    }

    fn encode(&self, buffer: &mut [u8]) -> Result<usize, EncodeError> {
        encode_of(&self.record, self.temperature, buffer)
    }

    fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        decode_in(bytes)
    }
}

#[cfg(feature = "magnetometer")]
impl Kept for MagnetometerRecord {
    fn key(&self) -> Key {
        Key::of_magnetometer(self.identity)
    }

    fn encode(&self, buffer: &mut [u8]) -> Result<usize, EncodeError> {
        encode_magnetometer_of(self, buffer)
    }

    fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        decode_magnetometer(bytes)
    }
}
