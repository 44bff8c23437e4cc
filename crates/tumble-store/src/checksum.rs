//! CRC-32 as in Ethernet and zip files, which is at the end of all that is stored.

/// Bytes of a checksum.
pub const CHECKSUM: usize = 4;

/// The checksum of bytes whose own checksum follows them, little-endian, together with it: the same for all.
const OF_SIGNED: u32 = 0x2144_DF1C;

/// The polynomial, reflected.
const POLYNOMIAL: u32 = 0xEDB8_8320;

/// Remainders of four bits. A table of eight would halve the time, and with its 1 KiB outweigh the code that uses it.
const REMAINDERS: [u32; 16] = {
    let mut remainders = [0; 16];
    let mut bits = 0;
    while bits < 16 {
        let mut remainder = bits;
        let mut bit = 0;
        while bit < 4 {
            remainder = (remainder >> 1) ^ (POLYNOMIAL * (remainder & 1));
            bit += 1;
        }
        remainders[bits as usize] = remainder;
        bits += 1;
    }
    remainders
};

/// The checksum of bytes that follow those of which `before` is the checksum; 0 where they follow none.
#[inline(never)]
pub fn checksum(before: u32, bytes: &[u8]) -> u32 {
    let after = bytes.iter().fold(!before, |remainder, byte| {
        after_four_bits(after_four_bits(remainder ^ u32::from(*byte)))
    });
    !after
}

fn after_four_bits(remainder: u32) -> u32 {
    (remainder >> 4) ^ REMAINDERS[(remainder & 15) as usize]
}

/// Puts the checksum of what is before it at the end of bytes, if there is room for it.
pub(crate) fn sign(bytes: &mut [u8]) -> Option<()> {
    let (covered, signature) = bytes.split_last_chunk_mut::<CHECKSUM>()?;
    *signature = checksum(0, covered).to_le_bytes();
    Some(())
}

/// Checks that bytes end with the checksum of those before it.
pub(crate) fn is_signed(bytes: &[u8]) -> bool {
    checksum(0, bytes) == OF_SIGNED
}

/// Corrects the one bit that differs from what was signed, if one explains the difference. Up to 2,974 bits differ in at
/// least five from any others with a checksum (P. Koopman, 32-Bit Cyclic Redundancy Codes for Internet Applications,
/// 2002), so that two or three wrong bits are never taken for another one.
pub(crate) fn correct_bit(bytes: &mut [u8]) -> bool {
    let wanted = checksum(0, bytes) ^ OF_SIGNED;
    // Effect on the checksum of the last bit, from which that of each bit before it follows.
    let mut effect = POLYNOMIAL;
    for byte in bytes.iter_mut().rev() {
        for bit in (0..8).rev() {
            if effect == wanted {
                *byte ^= 1 << bit;
                return true;
            }
            effect = (effect >> 1) ^ (POLYNOMIAL * (effect & 1));
        }
    }
    false
}
