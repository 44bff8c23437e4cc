//! The fields of version 2, in the order of `docs/record-format.md`: those of version 1, and how far the primary was
//! followed. What is here never changes.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::record::version_1::{FIELDS, Fields, whole};
use crate::record::{DecodeError, StoredRecord};

/// Most bytes of the fields: a temperature is there.
pub const MAX_PAYLOAD: usize = FIELDS + 17;

/// As they are on the wire.
#[derive(Serialize, Deserialize)]
pub struct Payload {
    fields: Fields,
    followed: [f32; 3],
    temperature: Option<f32>,
}

/// Reads the fields.
pub fn read(fields: &[u8]) -> Result<StoredRecord, DecodeError> {
    let Payload {
        fields,
        followed,
        temperature,
    } = whole(fields)?;
    let record = fields.record(Vector3::from(followed))?;
    Ok(StoredRecord { record, temperature })
}

impl From<&StoredRecord> for Payload {
    fn from(stored: &StoredRecord) -> Self {
        Self {
            fields: Fields::from(&stored.record),
            followed: stored.record.followed.into(),
            temperature: stored.temperature,
        }
    }
}
