//! Grades of sensors: how good an inertial measurement unit of a class is, where nobody has measured it.
//!
//! A device that is given a grade takes from it the figures that it cannot measure. All other figures of the grades, to
//! simulate with, are in the lab, which takes its words and its bias instability from here.

use core::hint::black_box;

use crate::gravity;
use crate::noise::ALLAN_FLOOR;
use crate::real::{Real, real};

const DEGREE: f64 = core::f64::consts::PI / 180.0;
const HOUR: f64 = 3600.0;
const MICRO_G: f64 = 1e-6 * gravity::STANDARD;

crate::vocabulary! {
    /// Classes of inertial measurement units, best last.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Grade {
        /// A chip for phones and hobby drones, as InvenSense MPU-6050. Its sheet (PS-MPU-6000A-00 rev. 3.4) is silent on
        /// bias instability: the figures are those that simulators use for this family.
        Consumer = "consumer",
        /// A factory-calibrated module, as Analog Devices ADIS16470 and ADIS16475, whose sheets state both.
        Industrial = "industrial",
        /// A unit for guidance, as Analog Devices ADIS16495-1, whose sheet states both.
        Tactical = "tactical",
        /// Navigation class, as Honeywell HG9900 and QA-2000. The figures are of the class.
        Reference = "reference",
    }
}

/// Bias instability B of IEEE Std 952 of accelerometers, m/s^2, and of gyroscopes, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasInstability<T: Real> {
    /// Bias instability of the accelerometers, m/s^2.
    pub specific_force: T,
    /// Bias instability of the gyroscopes, rad/s.
    pub angular_rate: T,
}

/// Bias instability of accelerometers, m/s^2, and of gyroscopes, rad/s, whose Allan deviations are lowest at so many micro-g and
/// degrees an hour.
const fn by_floors(micro_g: f64, degrees_an_hour: f64) -> (f64, f64) {
    (
        micro_g * MICRO_G / ALLAN_FLOOR, // docs/theory/noise.md, eq. 5
        degrees_an_hour * DEGREE / HOUR / ALLAN_FLOOR,
    )
}

const CONSUMER: (f64, f64) = by_floors(36.0, 4.6);
const INDUSTRIAL: (f64, f64) = by_floors(13.0, 8.0);
const TACTICAL: (f64, f64) = by_floors(3.2, 0.8);
const REFERENCE: (f64, f64) = by_floors(1.0, 0.0035);

impl Grade {
    /// Bias instability of both sensors.
    pub fn bias_instability<T: Real>(self) -> BiasInstability<T> {
        // Constants are converted where they stand, and kept apart: merged behind the match, a device would convert
        // doubles as it runs.
        let pair = |(force, rate): (f64, f64)| (black_box(real(force)), black_box(real(rate)));
        let (specific_force, angular_rate) = match self {
            Self::Consumer => pair(CONSUMER),
            Self::Industrial => pair(INDUSTRIAL),
            Self::Tactical => pair(TACTICAL),
            Self::Reference => pair(REFERENCE),
        };
        BiasInstability {
            specific_force,
            angular_rate,
        }
    }
}
