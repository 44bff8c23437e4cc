//! Procedures for a workstation: whole recordings, matching of clocks, simulation.
//!
//! [`acquisition`] turns a recording of any length into rests and turns, and watches its channels. [`turntable`] lays
//! targets beside their reference and calibrates them. [`mod@correct`] applies the result to arrays. [`spin`] does the
//! same for a robot that turned on the spot. [`align`](mod@align) finds how two units that move together sit beside
//! each other. [`mod@multipose`] calibrates a unit that was held in many orientations,
//! [`magnetometer`] the compass of one, both by [`constant_length`]. [`mod@noise`] measures that of a
//! sensor at rest, [`thermal`] its drift over temperature. [`distributions`] computes the probability of a misfit.
//! [`stamps`] fits even times to stamps that come late. [`simulate`] makes recordings whose truth is known.
//! [`setting_table`] lists all settings. [`verdict`] has the words that results are judged by.
//!
//! Without the feature `workstation` the crate holds what the page in a browser needs.
// Shared items, of which the page needs only a part.
#![cfg_attr(not(feature = "workstation"), allow(dead_code))]

pub mod acquisition;
#[cfg(feature = "workstation")]
pub mod align;
pub mod constant_length;
#[cfg(feature = "workstation")]
pub mod correct;
pub mod distributions;
#[cfg(feature = "workstation")]
pub mod magnetometer;
pub mod multipose;
#[cfg(feature = "workstation")]
pub mod noise;
#[cfg(feature = "workstation")]
pub mod redundancy;
mod sensor_range;
#[cfg(feature = "workstation")]
pub mod setting;
#[cfg(feature = "workstation")]
pub mod setting_table;
#[cfg(feature = "workstation")]
pub mod simulate;
#[cfg(feature = "workstation")]
pub mod spin;
pub mod stamps;
#[cfg(feature = "workstation")]
pub mod thermal;
pub mod turntable;
#[cfg(feature = "workstation")]
pub mod verdict;

#[cfg(test)]
extern crate self as tumble_lab;
#[cfg(test)]
#[path = "../tests/laws/main.rs"]
mod laws;
