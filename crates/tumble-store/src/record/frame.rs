//! What all versions share: how they begin, and the checksum at their end.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use serde::Serialize;

use crate::record::{DecodeError, EncodeError};

/// How every record begins: Tumble Record.
const MAGIC: [u8; 2] = *b"TR";

/// Bytes before the fields: [`MAGIC`] and the version.
const HEAD: usize = MAGIC.len() + 1;

/// Bytes after the fields.
const CHECKSUM: usize = 4;

/// Bytes around the fields.
pub const FRAME: usize = HEAD + CHECKSUM;

/// CRC-32 as in Ethernet and zip files; bit by bit, since a table of 1 KiB would outweigh the rest of this crate, and in
/// one place.
#[inline(never)]
pub fn checksum(bytes: &[u8]) -> u32 {
    const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
    CRC.checksum(bytes)
}

/// Frames the fields of a version.
pub fn write<'b>(
    version: u8,
    fields: &impl Serialize,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], EncodeError> {
    let room = buffer.get_mut(HEAD..).ok_or(EncodeError::NoRoom)?;
    let length = postcard::to_slice(fields, room)
        .map_err(|_| EncodeError::NoRoom)?
        .len();
    let (covered, rest) = buffer
        .split_at_mut_checked(HEAD + length)
        .ok_or(EncodeError::NoRoom)?;
    let head = covered.first_chunk_mut::<HEAD>().ok_or(EncodeError::NoRoom)?;
    let signature = rest.first_chunk_mut::<CHECKSUM>().ok_or(EncodeError::NoRoom)?;
    let [t, r] = MAGIC;
    *head = [t, r, version];
    *signature = checksum(covered).to_le_bytes();
    buffer.get(..length + FRAME).ok_or(EncodeError::NoRoom)
}

/// Takes the frame off: gives the version and the bytes of its fields.
pub fn open(bytes: &[u8]) -> Result<(u8, &[u8]), DecodeError> {
    let short = DecodeError::TooShort { found: bytes.len() };
    let (covered, signature) = bytes.split_last_chunk::<CHECKSUM>().ok_or(short)?;
    let ([t, r, version], fields) = covered.split_first_chunk::<HEAD>().ok_or(short)?;
    if [*t, *r] != MAGIC {
        return Err(DecodeError::NotARecord);
    }
    if checksum(covered) != u32::from_le_bytes(*signature) {
        return Err(DecodeError::Corrupt);
    }
    Ok((*version, fields))
}
