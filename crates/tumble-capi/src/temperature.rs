//! Effect of temperature on a sensor, corrected in its readings and kept over a reset.

use core::mem::MaybeUninit;

use tumble_core::temperature::TemperatureDrift as CoreDrift;
use tumble_store::record::{DRIFT_ENCODED, DriftRecord as StoredDrift, decode_drift, encode_drift};

use crate::code::code;
use crate::model::vector;
use crate::pointer::{Place, look, read};
#[cfg(feature = "records")]
use crate::record::read_bytes;
use crate::record::{Sensor, encode_error};
use crate::status::{Status, StatusResult, status};

/// Bytes of an encoded drift.
pub const TUMBLE_DRIFT_BYTES: usize = 100;

const _: () = assert!(TUMBLE_DRIFT_BYTES == DRIFT_ENCODED);

/// Effect of temperature T on a sensor: `y = (1 + s) M u + b + d`, where d and s are polynomials in T minus the
/// reference. M and b hold at the reference; beyond the range the value at its edge is held.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct TemperatureDrift {
    /// Temperature at which nothing changes, degC.
    pub reference: f32,
    /// Lowest and highest temperature at which it was seen, degC.
    pub range: [f32; 2],
    /// d: a row of the three axes for the first, second and third power, m/s^2 or rad/s per K, K^2, K^3.
    pub bias: [[f32; 3]; 3],
    /// s: the same of the scale factors, 1/K, 1/K^2, 1/K^3.
    pub scale: [[f32; 3]; 3],
}

/// Temperature drift of one sensor of one unit, in its stored form.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct DriftRecord {
    /// Identity of the unit.
    pub identity: u64,
    /// Which sensor of it.
    pub sensor: MaybeUninit<Sensor>,
    /// In the axes and the unit of the sensor.
    pub drift: TemperatureDrift,
}

/// Takes off a reading what temperature did to it: `at_reference` is what the sensor would read at the reference, which
/// goes on to tumble_correction_apply(), to a spin or to a redundant set. `bias` is b of its calibration, m/s^2 or rad/s;
/// `temperature` is in degC, and counts as the reference where it is NaN. `reading` and `at_reference` may be the same.
///
/// Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NOT_FINITE if the reading, its bias or what the drift makes of them is not.
///
/// cbindgen:ptrs-as-arrays=[[bias; 3], [reading; 3], [at_reference; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_temperature_drift_remove(
    drift: *const TemperatureDrift,
    bias: *const f32,
    temperature: f32,
    reading: *const f32,
    at_reference: *mut f32,
) -> Status {
    let (bias, reading) = (bias.cast::<[f32; 3]>(), reading.cast::<[f32; 3]>());
    let at_reference = at_reference.cast::<[f32; 3]>();
    // SAFETY: the header requires it of all pointers.
    let (drift, bias, reading) = unsafe { (look(drift), read(bias), read(reading)) };
    // SAFETY: the same.
    let place = unsafe { Place::at(at_reference) };
    status((|| {
        let (drift, bias, reading, place) = (drift?.in_core(), bias?, reading?, place?);
        let found = drift.at_reference(&vector(&reading), &vector(&bias), temperature);
        if !found.iter().all(|y| y.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        place.write(found.into());
        Ok(())
    })())
}

/// Writes a drift at the start of the `size` bytes at `bytes`, ::TUMBLE_DRIFT_BYTES of them.
///
/// Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NO_ROOM; ::TUMBLE_ERROR_CODE of the sensor; ::TUMBLE_ERROR_NOT_FINITE of the
/// numbers, also where the range is none or the reference not within it.
#[cfg(feature = "records")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_drift_encode(
    record: *const DriftRecord,
    bytes: *mut u8,
    size: usize,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (record, place) = unsafe { (read(record), Place::at(bytes.cast::<[u8; DRIFT_ENCODED]>())) };
    status((|| {
        let (record, place) = (record?.in_store()?, place?);
        if size < DRIFT_ENCODED {
            return Err(Status::TumbleErrorNoRoom);
        }
        let mut buffer = [0; DRIFT_ENCODED];
        encode_drift(&record, &mut buffer).map_err(encode_error)?;
        place.write(buffer);
        Ok(())
    })())
}

/// Reads a drift from the `length` bytes that are it, neither more nor fewer.
///
/// Errors: as of tumble_record_decode(); ::TUMBLE_ERROR_NOT_A_RECORD if they are a record of another kind.
#[cfg(feature = "records")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_drift_decode(
    bytes: *const u8,
    length: usize,
    record: *mut DriftRecord,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    unsafe { read_bytes(bytes, length, record, decode_drift, DriftRecord::of) }
}

impl TemperatureDrift {
    fn in_core(&self) -> CoreDrift<f32> {
        CoreDrift {
            reference: self.reference,
            range: self.range,
            bias: self.bias.map(Into::into),
            scale: self.scale.map(Into::into),
        }
    }

    /// Converts the core's type.
    pub fn of(drift: &CoreDrift<f32>) -> Self {
        Self {
            reference: drift.reference,
            range: drift.range,
            bias: drift.bias.map(Into::into),
            scale: drift.scale.map(Into::into),
        }
    }
}

impl DriftRecord {
    /// Converts the store's type.
    fn of(record: &StoredDrift) -> Self {
        Self {
            identity: record.identity,
            sensor: MaybeUninit::new(Sensor::of(record.sensor)),
            drift: TemperatureDrift::of(&record.drift),
        }
    }

    /// Converts it to the store's type.
    pub fn in_store(&self) -> StatusResult<StoredDrift> {
        Ok(StoredDrift {
            identity: self.identity,
            sensor: code(self.sensor)?.in_core(),
            drift: self.drift.in_core(),
        })
    }
}
