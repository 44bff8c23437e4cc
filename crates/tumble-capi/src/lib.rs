//! Tumble for firmware in C and C++. The header `include/tumble.h` is made of this crate.
//!
//! 1. [`status`]: how a call went; [`version`]: whether header and library belong together; `pointer` and `code` take what C hands over, and trust none of it;
//! 2. [`model`]: samples, the error model, readings corrected; [`temperature`]: what warmth did to them; [`magnetometer`]: the third triad;
//! 3. [`spin`]: a robot that stands still and turns on the spot;
//! 4. [`redundancy`]: a primary and its secondaries;
//! 5. [`record`], [`flash`] and [`store`]: what outlasts a reset.
//!
//! Nothing here computes: that is done in `tumble-core` and `tumble-store`. Features of these names leave parts out.
#![no_std]
// Shared items, of which some builds need only a part.
#![cfg_attr(
    not(all(
        feature = "spin",
        feature = "redundancy",
        feature = "calibration",
        feature = "aiding",
        feature = "settings_check",
        feature = "records",
        feature = "temperature",
        feature = "magnetometer"
    )),
    allow(dead_code, unused_imports)
)]

mod code;
#[cfg(feature = "records")]
pub mod flash;
#[cfg(feature = "freestanding")]
mod freestanding;
#[cfg(feature = "spin")]
pub mod grade;
#[cfg(feature = "magnetometer")]
pub mod magnetometer;
pub mod model;
mod pointer;
pub mod record;
#[cfg(feature = "redundancy")]
pub mod redundancy;
#[cfg(feature = "spin")]
pub mod spin;
pub mod status;
#[cfg(feature = "records")]
pub mod store;
#[cfg(feature = "temperature")]
pub mod temperature;
pub mod text;
pub mod version;
