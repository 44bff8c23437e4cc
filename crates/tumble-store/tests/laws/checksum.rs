//! The checksum is the CRC-32 that everybody knows.

use crc::{CRC_32_ISO_HDLC, Crc};
use proptest::prelude::*;
use tumble_store::checksum::checksum;

#[test]
fn nine_digits_have_the_checksum_of_the_document() {
    assert_eq!(checksum(0, b"123456789"), 0xCBF4_3926);
}

proptest! {
    #[test]
    fn bytes_in_two_pieces_have_the_checksum_that_a_library_says(
        first in proptest::collection::vec(any::<u8>(), 0..100),
        second in proptest::collection::vec(any::<u8>(), 0..100),
    ) {
        let wanted = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&[&first[..], &second].concat());
        prop_assert_eq!(checksum(checksum(0, &first), &second), wanted);
    }
}
