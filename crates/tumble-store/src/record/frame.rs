//! Parts that all versions share: the magic bytes at their start, the identity, and the checksum at their end.

use tumble_core::redundancy::sensor::Sensor;

use crate::checksum::{CHECKSUM, is_signed, sign};
use crate::record::{DecodeError, Field};

/// Magic bytes of every record: Tumble Record.
const MAGIC: [u8; 2] = *b"TR";

/// Fewest bytes of a frame: [`MAGIC`], the version, and the checksum.
const SHORTEST: usize = MAGIC.len() + 1 + CHECKSUM;

/// Offset of the identity, in all versions until now.
const IDENTITY: usize = 3;
const SENSOR: usize = 11;

/// In the order of their codes.
const SENSORS: [Sensor; 2] = [Sensor::Accelerometer, Sensor::Gyroscope];

/// Code of a magnetometer: the next after those of an IMU.
pub const MAGNETOMETER: u8 = 2;

/// Bytes before what a version has of its own.
pub const HEAD: usize = 12;

/// Some bytes from an offset on.
pub fn field<const N: usize>(bytes: &[u8], offset: usize) -> Option<[u8; N]> {
    bytes.get(offset..)?.first_chunk().copied()
}

/// Overwrites some bytes from an offset on, if there are as many.
pub fn put<const N: usize>(bytes: &mut [u8], offset: usize, value: [u8; N]) {
    let rest = bytes.get_mut(offset..);
    if let Some(place) = rest.and_then(|rest| rest.first_chunk_mut()) {
        *place = value;
    }
}

/// Writes what all versions begin with.
pub fn begin(bytes: &mut [u8], version: u8, identity: u64, sensor: Sensor) {
    begin_with(bytes, version, identity, sensor_code(sensor));
}

/// Writes the same with the code of a sensor.
pub fn begin_with(bytes: &mut [u8], version: u8, identity: u64, sensor: u8) {
    let [t, r] = MAGIC;
    put(bytes, 0, [t, r, version]);
    put(bytes, IDENTITY, identity.to_le_bytes());
    put(bytes, SENSOR, [sensor]);
}

/// Ends a record of which all else is written.
pub fn end(bytes: &mut [u8]) {
    // Bytes too short for a checksum are no record without it.
    let _ = sign(bytes);
}

/// Version stated by bytes that begin like a record.
pub fn version_in(bytes: &[u8]) -> Option<u8> {
    let [t, r, version] = field(bytes, 0)?;
    ([t, r] == MAGIC).then_some(version)
}

/// The version of a record that is as it was written.
pub fn version_of(bytes: &[u8]) -> Result<u8, DecodeError> {
    if bytes.len() < SHORTEST {
        return Err(DecodeError::TooShort { found: bytes.len() });
    }
    let version = version_in(bytes).ok_or(DecodeError::NotARecord)?;
    is_signed(bytes).then_some(version).ok_or(DecodeError::Corrupt)
}

/// Which sensor of which unit a record is about.
pub fn subject(bytes: &[u8]) -> Result<(u64, Sensor), DecodeError> {
    let (identity, code) = subject_code(bytes)?;
    let sensor = sensor(code).ok_or(DecodeError::UnknownCode {
        field: Field::Sensor,
        found: code,
    })?;
    Ok((identity, sensor))
}

/// The same, with the code of the sensor.
pub fn subject_code(bytes: &[u8]) -> Result<(u64, u8), DecodeError> {
    let identity = field(bytes, IDENTITY).ok_or(DecodeError::Corrupt)?;
    let [code] = field(bytes, SENSOR).ok_or(DecodeError::Corrupt)?;
    Ok((u64::from_le_bytes(identity), code))
}

/// The code of a sensor.
pub fn sensor_code(sensor: Sensor) -> u8 {
    code(&SENSORS, sensor)
}

/// The sensor of a code.
fn sensor(code: u8) -> Option<Sensor> {
    SENSORS.get(usize::from(code)).copied()
}

/// Checks that a code has a meaning.
pub fn is_sensor(code: u8) -> bool {
    code <= MAGNETOMETER
}

/// The code of one of several, which is its place among them.
pub fn code<C: PartialEq>(all: &[C], one: C) -> u8 {
    let before = all.iter().take_while(|other| **other != one);
    before.fold(0, |code, _| code + 1)
}
