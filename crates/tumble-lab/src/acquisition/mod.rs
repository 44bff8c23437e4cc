//! Step 1 on the host: a recording of any length becomes the rests and turns of one unit.
//!
//! [`recorder`] takes a recording in, chunk by chunk, and makes it [`acquired`]; `rejection` takes out what only looked
//! like a rest, [`plateaus`] finds constant rates in the [`motion`], which are then no rests, [`channels`] watches the
//! channels, [`trace`] keeps a picture. [`failed_reads()`] finds readings that a driver gave where it could read none,
//! [`standstills()`] those that repeat for a while, [`AlternationWatch`] those of several units that take turns.
//! Vibration of a rest is averaged out in `vibration`. [`consistency`] holds the gyroscope against the accelerometer.

use tumble_core::sample::CHANNELS;

pub mod acquired;
mod alternation;
pub mod channels;
pub mod consistency;
mod constant_rates;
mod failed_reads;
mod interval;
pub mod motion;
pub mod plateaus;
pub mod recorder;
mod rejection;
mod rest_ladders;
pub mod rounding;
pub mod soft_edge;
mod standstills;
pub mod trace;
mod vibration;

pub use acquired::{Acquired, Part, RestRejection, Restlessness, Tremor};
pub use alternation::AlternationWatch;
pub use constant_rates::without_turning;
pub use failed_reads::failed_reads;
pub use interval::interval;
pub(crate) use interval::microseconds;
pub use plateaus::{Plateau, PlateauKind, RateGate};
pub use recorder::Acquisition;
pub(crate) use rejection::leave_out_saturated;
pub use standstills::{FROZEN, Repetition, Standstill, Standstills, standstills};

/// Names of the channels, as users know them.
pub const CHANNEL_NAMES: [&str; CHANNELS] = [
    "accelerometer x",
    "accelerometer y",
    "accelerometer z",
    "gyroscope x",
    "gyroscope y",
    "gyroscope z",
];
