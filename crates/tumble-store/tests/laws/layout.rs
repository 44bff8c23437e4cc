//! Which ranges of flash hold records.

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use tumble_core::redundancy::sensor::Sensor;
use tumble_store::flash::{LayoutError, RecordStore};

use crate::common::history::{UNLIMITED, numbered};
use crate::common::simulated::{Fault, PAGE, Simulated};

#[test]
fn ranges_that_cannot_hold_records_are_refused() {
    let page = u32::try_from(PAGE).unwrap();
    let outcome = |start, end| RecordStore::new(Simulated::<4>::new(6), start..end, UNLIMITED).map(|_| ());
    assert_eq!(outcome(page, 3 * page), Ok(()));
    assert_eq!(outcome(2 * page, 6 * page), Ok(()));
    assert_eq!(outcome(0, page), Err(LayoutError::NotWholePages));
    assert_eq!(outcome(0, 3 * page), Err(LayoutError::NotWholePages));
    assert_eq!(outcome(8, 8 + 2 * page), Err(LayoutError::NotWholePages));
    assert_eq!(outcome(0, 8 * page), Err(LayoutError::OutOfBounds));
    assert_eq!(outcome(page, page), Err(LayoutError::OutOfBounds));
    let backwards = outcome(2 * page, page);
    assert_eq!(backwards, Err(LayoutError::OutOfBounds));
    let words = RecordStore::new(Simulated::<64>::new(6), 0..2 * page, UNLIMITED);
    assert_eq!(words.map(|_| ()), Err(LayoutError::WordsNotSupported));
}

/// Flash of short pages that is asked nothing.
struct ShortPages;

impl ErrorType for ShortPages {
    type Error = Fault;
}

impl ReadNorFlash for ShortPages {
    const READ_SIZE: usize = 1;

    fn read(&mut self, _: u32, _: &mut [u8]) -> Result<(), Fault> {
        Err(Fault::PowerCut)
    }

    fn capacity(&self) -> usize {
        4096
    }
}

impl NorFlash for ShortPages {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = 64;

    fn erase(&mut self, _: u32, _: u32) -> Result<(), Fault> {
        Err(Fault::PowerCut)
    }

    fn write(&mut self, _: u32, _: &[u8]) -> Result<(), Fault> {
        Err(Fault::PowerCut)
    }
}

#[test]
fn half_a_range_has_room_for_one_sensor_and_one_more_record() {
    let outcome = |bytes| RecordStore::new(ShortPages, 0..bytes, UNLIMITED).map(|store| store.entries());
    assert_eq!(outcome(2 * 832), Ok(4));
    assert_eq!(outcome(2 * (832 - 64)), Err(LayoutError::TooSmall));
}

#[test]
fn nothing_outside_the_range_is_touched() {
    let page = u32::try_from(PAGE).unwrap();
    let mut store = RecordStore::new(Simulated::<4>::new(6), 2 * page..4 * page, UNLIMITED).unwrap();
    for number in 0..100 {
        store.save(0, &numbered(1, Sensor::Gyroscope, number)).unwrap();
    }
    let flash = store.into_flash();
    let outside = [&flash.memory[..2 * PAGE], &flash.memory[4 * PAGE..]].concat();
    assert!(outside.iter().all(|byte| *byte == 0xFF));
    assert_eq!([&flash.erasures[..2], &flash.erasures[4..]].concat(), [0; 4]);
}
