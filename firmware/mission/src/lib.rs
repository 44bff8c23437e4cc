//! Mission of the movable platform, from its first start to the failure of its primary; a robot's spin; and the
//! correction of a sensor's temperature drift.
//!
//! The device and the host run this same code over the same vectors, and report the results number by number in the
//! bits of single precision: the two must not differ. Read in this order:
//!
//! 1. [`vectors`]: the sensors' readings, out of a JSON file.
//! 2. [`units`]: the redundant set that gives them, and [`nor`], the flash that outlasts a reset.
//! 3. [`flight`]: the first start, up to records in flash; the second, from records in flash.
//! 4. [`spin`]: a robot that turns on the spot; [`temperature`]: a sensor that gets warm.
//! 5. [`words`]: how events, records and results are written down.
//! 6. [`watch`]: who measures the stack meanwhile.
//!
//! Nothing here panics or needs a heap: what can go wrong is a [`MissionError`].
#![no_std]

pub mod flight;
pub mod nor;
pub mod spin;
pub mod temperature;
pub mod text;
pub mod units;
pub mod vectors;
pub mod work_meter;

use core::fmt::{self, Display, Formatter};

use embedded_storage::nor_flash::NorFlashErrorKind;
use tumble_core::redundancy::platform::PlatformError;
use tumble_store::flash::{LayoutError, StoreError};

/// Why the mission cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MissionError {
    /// A file of vectors has no such entry, or it is not what it should be.
    Vectors(&'static str),
    /// The set of units contradicts itself.
    Platform(PlatformError),
    /// The flash has no room for records.
    Layout(LayoutError),
    /// A record was not stored or not read.
    Store(StoreError<NorFlashErrorKind>),
    /// The report is discarded.
    Silenced,
}

impl Display for MissionError {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vectors(name) => {
                out.write_str("there is no \"")?;
                out.write_str(name)?;
                out.write_str(
                    "\" as it should be; restore the file, or write it anew with vectors/generate.py",
                )
            }
            Self::Platform(_) => out.write_str("the set of units contradicts itself; see mission::units"),
            Self::Layout(_) => out.write_str("no records fit into the flash; see mission::nor"),
            Self::Store(_) => out.write_str("a record was not stored or not read; see mission::nor"),
            Self::Silenced => out.write_str("nobody takes in what is said"),
        }
    }
}

impl From<fmt::Error> for MissionError {
    fn from(_: fmt::Error) -> Self {
        Self::Silenced
    }
}

impl From<LayoutError> for MissionError {
    fn from(why: LayoutError) -> Self {
        Self::Layout(why)
    }
}

impl From<StoreError<NorFlashErrorKind>> for MissionError {
    fn from(why: StoreError<NorFlashErrorKind>) -> Self {
        Self::Store(why)
    }
}

impl From<PlatformError> for MissionError {
    fn from(why: PlatformError) -> Self {
        Self::Platform(why)
    }
}
