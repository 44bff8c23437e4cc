//! Records: whatever the bytes, they are refused, or are a record that has these bytes. A record that is damaged
//! without its checksum is refused.

use crc::{CRC_32_ISO_HDLC, Crc};
use nalgebra::Matrix3;
use tumble_core::redundancy::record::{Record, RecordPart};
use tumble_core::redundancy::sensor::SENSORS;
use tumble_core::redundancy::settings::FitModel;
use tumble_store::record::{
    DRIFT_ENCODED, EncodeError, MAGNETOMETER_ENCODED, MAGNETOMETER_VERSION, MAX_ENCODED, StoredRecord,
    VERSION, decode, decode_drift, decode_magnetometer, encode, encode_drift, encode_magnetometer, length,
};

use crate::campaign::RunOutcome;
use crate::draw::FuzzDraw;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Bytes before the fields, and of the checksum after them.
const HEAD: usize = 3;
const CHECKSUM: usize = 4;

/// Makes one run.
pub fn run(mut draw: FuzzDraw) -> RunOutcome {
    match draw.below(4) {
        0 => written(&mut draw),
        1 => damaged(&mut draw),
        2 => damaged_and_signed(&mut draw),
        _ => made_up(&mut draw),
    }
}

/// A record of any numbers is refused, or comes back as it was.
fn written(draw: &mut FuzzDraw) -> RunOutcome {
    let record = any_record(draw);
    let mut buffer = [0xA5; MAX_ENCODED];
    let bytes = match encode(&record, &mut buffer) {
        Ok(bytes) => bytes.to_vec(),
        Err(EncodeError::NotFinite(_)) => return expect(!is_sound(&record), "a sound record was refused"),
        Err(error) => return Err(format!("{error:?} with room enough")),
    };
    expect(is_sound(&record), "what is no record was written")?;
    let mut short = vec![0; draw.below(bytes.len())];
    expect(
        encode(&record, &mut short) == Err(EncodeError::NoRoom),
        "it was written where there is no room",
    )?;
    expect(decode(&bytes) == Ok(record), "it reads back as another")?;
    let double = record.record.in_numbers::<f64>(f64::from);
    let back = StoredRecord::of(&double, record.temperature.map(f64::from));
    expect(back == record, "double precision changes it")
}

/// Damage without a new checksum is found out.
fn damaged(draw: &mut FuzzDraw) -> RunOutcome {
    let mut bytes = any_bytes(draw);
    let mut sound = vec![bytes.clone()];
    for _ in 0..=draw.below(4) {
        damage(draw, &mut bytes, &mut sound);
    }
    match decode(&bytes) {
        Ok(_) => expect(sound.contains(&bytes), "damaged bytes are read"),
        Err(error) => expect(!sound.contains(&bytes), &format!("{error:?} without damage")),
    }
}

/// Bytes with a valid checksum are refused, or are the encoding of the record that they give.
fn damaged_and_signed(draw: &mut FuzzDraw) -> RunOutcome {
    let mut bytes = any_bytes(draw);
    for _ in 0..=draw.below(4) {
        damage(draw, &mut bytes, &mut Vec::new());
    }
    sign(&mut bytes);
    consistent(&bytes)
}

/// Bytes that never were a record, with and without its head and checksum.
fn made_up(draw: &mut FuzzDraw) -> RunOutcome {
    let mut bytes: Vec<u8> = (0..draw.below(2 * MAX_ENCODED)).map(|_| draw.byte()).collect();
    if draw.once_in(2) {
        bytes.resize(MAX_ENCODED - draw.below(2) * CHECKSUM, draw.byte());
    }
    if !draw.once_in(4) {
        bytes
            .iter_mut()
            .zip([
                b'T',
                b'R',
                1 + draw.below(usize::from(MAGNETOMETER_VERSION)) as u8,
            ])
            .for_each(|(byte, head)| *byte = head);
    }
    if !draw.once_in(4) {
        sign(&mut bytes);
    }
    consistent(&bytes)
}

fn consistent(bytes: &[u8]) -> RunOutcome {
    if let Ok(drift) = decode_drift(bytes) {
        expect(
            length(bytes) == Some(bytes.len()),
            "a drift has another length than it says",
        )?;
        let mut buffer = [0; DRIFT_ENCODED];
        let again = encode_drift(&drift, &mut buffer);
        return expect(
            again == Ok(bytes),
            "a drift is written as other bytes than it was read from",
        );
    }
    if let Ok(magnetometer) = decode_magnetometer(bytes) {
        expect(
            length(bytes) == Some(bytes.len()),
            "a magnetometer has another length than it says",
        )?;
        let mut buffer = [0; MAGNETOMETER_ENCODED];
        let again = encode_magnetometer(&magnetometer, &mut buffer);
        return expect(
            again == Ok(bytes),
            "a magnetometer is written as other bytes than it was read from",
        );
    }
    let Ok(record) = decode(bytes) else {
        return Ok(());
    };
    expect(is_sound(&record), "what is no record is read")?;
    expect(
        length(bytes) == Some(bytes.len()),
        "it has another length than it says",
    )?;
    let mut buffer = [0; MAX_ENCODED];
    match encode(&record, &mut buffer) {
        Ok(again) => expect(
            again == bytes || bytes.get(2) != Some(&VERSION),
            "it is written as other bytes than it was read from",
        ),
        Err(error) => Err(format!("{error:?} of a record that was read")),
    }
}

fn expect(holds: bool, otherwise: &str) -> RunOutcome {
    if holds { Ok(()) } else { Err(otherwise.to_owned()) }
}

/// Checks the requirements of `docs/record-format.md` on a writer.
fn is_sound(stored: &StoredRecord) -> bool {
    let record = &stored.record;
    let mut numbers = record.parts().into_iter().flatten();
    record.is_finite()
        && numbers.all(|number| !number.is_nan())
        && stored.temperature.is_none_or(f32::is_finite)
}

/// One kind of damage; rarely, it changes nothing, or leaves all of a sound record that came in between, which is added to
/// `sound`.
fn damage(draw: &mut FuzzDraw, bytes: &mut Vec<u8>, sound: &mut Vec<Vec<u8>>) {
    let length = bytes.len();
    match draw.below(8) {
        0 => bytes.truncate(draw.below(length + 1)),
        1 => bytes.extend((0..draw.below(40)).map(|i| (i * 37) as u8)),
        2 => {
            let other = any_bytes(draw);
            let from = MAX_ENCODED / 2 + draw.below(MAX_ENCODED / 2);
            bytes.truncate(from);
            bytes.extend(other.iter().skip(from));
            sound.push(other);
        }
        3 => {
            let number = draw.number().to_le_bytes();
            let place = draw.below(length + 1);
            overwrite(bytes, place, &number);
        }
        4 => {
            let place = draw.below(length + 1);
            bytes.insert(place, draw.byte());
        }
        5 if length > 0 => {
            bytes.remove(draw.below(length));
        }
        6 => {
            let (place, count) = (draw.below(length + 1), draw.below(20));
            let filling = vec![draw.pick(&[0x00, 0xFF, 0x54]); count];
            overwrite(bytes, place, &filling);
        }
        _ if length > 0 => {
            let place = draw.below(length);
            bytes[place] ^= 1 << draw.below(8);
        }
        _ => {}
    }
}

fn overwrite(bytes: &mut [u8], place: usize, with: &[u8]) {
    let from = bytes.iter_mut().skip(place);
    from.zip(with).for_each(|(byte, new)| *byte = *new);
}

/// Puts the checksum of what is before it at the end.
fn sign(bytes: &mut [u8]) {
    if bytes.len() >= HEAD + CHECKSUM
        && let Some((covered, checksum)) = bytes.split_last_chunk_mut::<CHECKSUM>()
    {
        *checksum = CRC.checksum(covered).to_le_bytes();
    }
}

/// The bytes of a sound record.
fn any_bytes(draw: &mut FuzzDraw) -> Vec<u8> {
    let mut record = plain_record(draw);
    let mut buffer = [0; MAX_ENCODED];
    let spoilt = spoil_record(draw, record);
    if is_sound(&spoilt) {
        record = spoilt;
    }
    encode(&record, &mut buffer).map_or_else(|_| Vec::new(), <[u8]>::to_vec)
}

fn any_record(draw: &mut FuzzDraw) -> StoredRecord {
    let record = plain_record(draw);
    if draw.once_in(2) {
        spoil_record(draw, record)
    } else {
        record
    }
}

/// Size of the numbers of a part; of a matrix, that of its difference from the identity.
fn usual_size(part: RecordPart) -> f32 {
    match part {
        RecordPart::Matrix => 0.05,
        RecordPart::Bias | RecordPart::ResidualBefore => 0.5,
        RecordPart::LeverArm => 0.2,
        RecordPart::MatrixSigma | RecordPart::BiasSigma | RecordPart::LeverArmSigma => 0.01,
        _ => 0.1,
    }
}

/// A record as a calibration leaves it.
pub fn plain_record(draw: &mut FuzzDraw) -> StoredRecord {
    let mut record = Record::unknown(draw.time(), draw.pick(&SENSORS));
    record.fit_model = draw.pick(&[
        FitModel::Offset,
        FitModel::Gain,
        FitModel::Affine,
        FitModel::AffineAndLeverArm,
    ]);
    record.directions = draw.byte();
    record.pairs = draw.bits() as u32;
    record.sequence = draw.bits() as u32;
    for (part, numbers) in RecordPart::ALL.into_iter().zip(record.parts_mut()) {
        numbers.fill_with(|| draw.usual(usual_size(part)));
        if part.may_be_infinite() {
            numbers.iter_mut().for_each(|number| *number = number.abs());
        }
    }
    record.model.matrix += Matrix3::identity();
    StoredRecord {
        record,
        temperature: draw.once_in(2).then(|| draw.usual(80.0)),
    }
}

/// The same with some of its numbers replaced by any.
pub fn spoil_record(draw: &mut FuzzDraw, stored: StoredRecord) -> StoredRecord {
    let StoredRecord {
        mut record,
        mut temperature,
    } = stored;
    match record
        .parts_mut()
        .into_iter()
        .nth(draw.below(RecordPart::COUNT + 1))
    {
        Some(part) => draw.spoil(part),
        None => draw.spoil(&mut temperature),
    }
    StoredRecord { record, temperature }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_record_is_read_wrongly_in_a_hundred_thousand_runs() {
        for seed in 0..100_000 {
            assert_eq!(run(FuzzDraw::new(seed)), Ok(()), "seed {seed}");
        }
    }
}
