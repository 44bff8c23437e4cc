//! Sensor grades: how good a sensor of a class is, in SI units, modelled on public data sheets.
//!
//! A grade stands for its class, to simulate with, and does not replace the sheet of a part: figures are rounded, and
//! where a sheet is silent or gives plots only, they are what such parts usually show. Each grade names these figures.
//!
//! Three conventions turn data-sheet language into the figures kept here:
//!
//! * A noise spectral density is one-sided; `N` of IEEE Std 952 belongs to the two-sided spectrum and is smaller by
//!   the square root of two ([`from_spectral_density`]). An angle or velocity random walk is `N` already
//!   ([`per_root_hour`]).
//! * An in-run bias stability is the lowest point of the Allan deviation, which for flicker noise is `0.664 B`; it is
//!   that of the core's grade of this name, which devices take it from too.
//! * A tolerance without statistics is taken as three sigma ([`tolerance`]); a figure called typical, rms or 1 sigma is
//!   taken as it stands.

use serde::{Deserialize, Serialize};

use tumble_core::grade::{BiasInstability, Grade as CoreGrade};

/// Standard gravity, m/s^2, by which data sheets count.
const STANDARD_GRAVITY: f64 = tumble_core::gravity::STANDARD;
const DEGREE: f64 = core::f64::consts::PI / 180.0;
const MILLI_G: f64 = 1e-3 * STANDARD_GRAVITY;
const MICRO_G: f64 = 1e-6 * STANDARD_GRAVITY;
const HOUR: f64 = 3600.0;
const PPM: f64 = 1e-6;

/// Grade of three accelerometers or three gyroscopes. `unit` below is m/s^2 or rad/s.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TriadGrade {
    /// White noise `N` of IEEE Std 952, unit / sqrt(Hz): a sample at rate `r` scatters by `N sqrt(r)`.
    pub noise_density: f64,
    /// Bias instability `B` of IEEE Std 952, unit: the Allan deviation has its floor at `0.664 B`.
    pub bias_instability: f64,
    /// Bias found after power-on, unit, 1 sigma for each axis.
    pub turn_on_bias: f64,
    /// Deviation of the scale from 1, 1 sigma for each axis.
    pub scale_error: f64,
    /// Deviation of two sensing axes from 90 degrees, rad, 1 sigma for each pair.
    pub non_orthogonality: f64,
    /// Rotation of the triad inside its package, rad, 1 sigma about each axis.
    pub alignment: f64,
    /// Change of the bias with temperature, unit / K, 1 sigma for each axis.
    pub temperature_coefficient: f64,
    /// Smallest step of the output, unit; 0 for none.
    pub quantisation: f64,
    /// Largest magnitude of the output, unit.
    pub range: f64,
    /// Response of a gyroscope to specific force, rad/s per m/s^2, 1 sigma for each element; 0 for accelerometers.
    pub g_sensitivity: f64,
}

/// Grade of an inertial measurement unit.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SensorGrade {
    /// Specific force, m/s^2.
    pub accelerometer: TriadGrade,
    /// Angular rate, rad/s.
    pub gyroscope: TriadGrade,
    /// Smallest step of the temperature reading, K; 0 for none.
    pub temperature_step: f64,
}

impl SensorGrade {
    /// Looks a grade up by one of [`CoreGrade::NAMES`].
    pub fn named(name: &str) -> Option<Self> {
        CoreGrade::named(name).map(|grade| match grade {
            CoreGrade::Consumer => Self::consumer(),
            CoreGrade::Industrial => Self::industrial(),
            CoreGrade::Tactical => Self::tactical(),
            CoreGrade::Reference => Self::reference(),
        })
    }

    /// A chip for phones and hobby drones, after InvenSense MPU-6050 (PS-MPU-6000A-00 rev. 3.4), ranges 8 g and
    /// 500 deg/s.
    ///
    /// Cross-axis sensitivity (2 %) is shared between non-orthogonality and alignment in the package.
    pub fn consumer() -> Self {
        let instability: BiasInstability<f64> = CoreGrade::Consumer.bias_instability();
        Self {
            accelerometer: TriadGrade {
                noise_density: from_spectral_density(400.0 * MICRO_G),
                bias_instability: instability.specific_force,
                turn_on_bias: tolerance(50.0 * MILLI_G),
                scale_error: tolerance(0.03),
                non_orthogonality: tolerance(0.02),
                alignment: tolerance(0.02),
                temperature_coefficient: tolerance(35.0 * MILLI_G / 70.0),
                quantisation: STANDARD_GRAVITY / 4096.0,
                range: 8.0 * STANDARD_GRAVITY,
                g_sensitivity: 0.0,
            },
            gyroscope: TriadGrade {
                noise_density: from_spectral_density(0.005 * DEGREE),
                bias_instability: instability.angular_rate,
                turn_on_bias: tolerance(20.0 * DEGREE),
                scale_error: tolerance(0.03),
                non_orthogonality: tolerance(0.02),
                alignment: tolerance(0.02),
                temperature_coefficient: tolerance(20.0 * DEGREE / 125.0),
                quantisation: DEGREE / 65.5,
                range: 500.0 * DEGREE,
                g_sensitivity: 0.1 * DEGREE / STANDARD_GRAVITY,
            },
            temperature_step: 1.0 / 340.0,
        }
    }

    /// A factory-calibrated module, after Analog Devices ADIS16470 and ADIS16475: noise, instability, range, alignment.
    ///
    /// Scale errors, turn-on biases, temperature and g-sensitivity are typical of the class, not of a sheet.
    pub fn industrial() -> Self {
        let instability: BiasInstability<f64> = CoreGrade::Industrial.bias_instability();
        Self {
            accelerometer: TriadGrade {
                noise_density: from_spectral_density(100.0 * MICRO_G),
                bias_instability: instability.specific_force,
                turn_on_bias: 2.0 * MILLI_G,
                scale_error: 1e-3,
                non_orthogonality: 0.1 * DEGREE,
                alignment: 0.25 * DEGREE,
                temperature_coefficient: 2.0 * MILLI_G / 42.5,
                quantisation: 1.25 * MILLI_G / 65_536.0,
                range: 40.0 * STANDARD_GRAVITY,
                g_sensitivity: 0.0,
            },
            gyroscope: TriadGrade {
                noise_density: from_spectral_density(0.008 * DEGREE),
                bias_instability: instability.angular_rate,
                turn_on_bias: 0.2 * DEGREE,
                scale_error: 3e-3,
                non_orthogonality: 0.1 * DEGREE,
                alignment: 0.25 * DEGREE,
                temperature_coefficient: 0.2 * DEGREE / 42.5,
                quantisation: 0.1 * DEGREE / 65_536.0,
                range: 2000.0 * DEGREE,
                g_sensitivity: 0.015 * DEGREE / STANDARD_GRAVITY,
            },
            temperature_step: 0.1,
        }
    }

    /// A unit for guidance: noise, instability, alignment and range after Analog Devices ADIS16495-1; bias, scale,
    /// temperature and g-sensitivity after Sensonor STIM300.
    pub fn tactical() -> Self {
        let instability: BiasInstability<f64> = CoreGrade::Tactical.bias_instability();
        Self {
            accelerometer: TriadGrade {
                noise_density: per_root_hour(0.008),
                bias_instability: instability.specific_force,
                turn_on_bias: 0.75 * MILLI_G,
                scale_error: 300.0 * PPM,
                non_orthogonality: 0.05 * DEGREE,
                alignment: tolerance(0.25 * DEGREE),
                temperature_coefficient: 2.0 * MILLI_G / 62.5,
                quantisation: STANDARD_GRAVITY / 524_288.0,
                range: 8.0 * STANDARD_GRAVITY,
                g_sensitivity: 0.0,
            },
            gyroscope: TriadGrade {
                noise_density: per_root_hour(0.09 * DEGREE),
                bias_instability: instability.angular_rate,
                turn_on_bias: tolerance(250.0 * DEGREE / HOUR),
                scale_error: 500.0 * PPM,
                non_orthogonality: 0.05 * DEGREE,
                alignment: tolerance(0.25 * DEGREE),
                temperature_coefficient: 5.0 * DEGREE / HOUR / 62.5,
                quantisation: DEGREE / 16_384.0,
                range: 450.0 * DEGREE,
                g_sensitivity: 1.0 * DEGREE / HOUR / STANDARD_GRAVITY,
            },
            temperature_step: 1.0 / 256.0,
        }
    }

    /// The unit the others are held against: ring laser gyroscopes and servo accelerometers of navigation class
    /// (Honeywell HG9900, QA-2000), orthogonal to two arc seconds after its own calibration. All figures are of the class.
    ///
    /// The accelerometer scatters by 0.003 m/s^2 a sample at 200 Hz: the floor's tremor, not the sensor.
    pub fn reference() -> Self {
        let instability: BiasInstability<f64> = CoreGrade::Reference.bias_instability();
        Self {
            accelerometer: TriadGrade {
                noise_density: 0.003 / core::f64::consts::SQRT_2 / 10.0,
                bias_instability: instability.specific_force,
                turn_on_bias: 160.0 * MICRO_G,
                scale_error: 20.0 * PPM,
                non_orthogonality: 10e-6,
                alignment: 0.0,
                temperature_coefficient: 3.0 * MICRO_G,
                quantisation: 1.0 * MICRO_G,
                range: 25.0 * STANDARD_GRAVITY,
                g_sensitivity: 0.0,
            },
            gyroscope: TriadGrade {
                noise_density: per_root_hour(0.002 * DEGREE),
                bias_instability: instability.angular_rate,
                turn_on_bias: 0.0035 * DEGREE / HOUR,
                scale_error: 5.0 * PPM,
                non_orthogonality: 10e-6,
                alignment: 10e-6,
                temperature_coefficient: 1e-4 * DEGREE / HOUR,
                quantisation: 1e-8,
                range: 1000.0 * DEGREE,
                g_sensitivity: 0.0,
            },
            temperature_step: 0.01,
        }
    }
}

/// `N` from a one-sided noise spectral density in unit / sqrt(Hz).
pub fn from_spectral_density(density: f64) -> f64 {
    density / core::f64::consts::SQRT_2
}

/// `N` from a random walk in (unit s) / sqrt(h): an angle random walk in rad / sqrt(h), a velocity one in m/s / sqrt(h).
pub fn per_root_hour(random_walk: f64) -> f64 {
    random_walk / 60.0
}

/// One sigma from a tolerance that the sheet gives without statistics.
pub fn tolerance(limit: f64) -> f64 {
    limit / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_better_grade_errs_less_in_every_respect_but_noise() {
        let grades = [
            SensorGrade::consumer(),
            SensorGrade::industrial(),
            SensorGrade::tactical(),
            SensorGrade::reference(),
        ];
        let errors = [
            |triad: &TriadGrade| triad.turn_on_bias,
            |triad: &TriadGrade| triad.scale_error,
            |triad: &TriadGrade| triad.non_orthogonality,
            |triad: &TriadGrade| triad.alignment,
            |triad: &TriadGrade| triad.temperature_coefficient,
        ];
        for pair in grades.windows(2) {
            for triad in [|g: &SensorGrade| g.accelerometer, |g: &SensorGrade| g.gyroscope] {
                for error in errors {
                    assert!(error(&triad(&pair[1])) < error(&triad(&pair[0])));
                }
            }
        }
    }

    #[test]
    fn spectral_density_and_random_walk_of_one_data_sheet_agree() {
        // ADIS16470 states 0.008 deg/s/sqrt(Hz) and, for the same gyroscope, 0.34 deg/sqrt(h).
        let from_density = from_spectral_density(0.008);
        let from_random_walk = per_root_hour(0.34);
        assert!((from_density / from_random_walk - 1.0).abs() < 0.01);
    }

    #[test]
    fn the_reference_accelerometer_scatters_by_3_mm_s2_at_200_hz() {
        let sigma = SensorGrade::reference().accelerometer.noise_density * 200.0_f64.sqrt();
        assert!((sigma - 0.003).abs() < 1e-15);
    }

    #[test]
    fn an_unknown_name_is_no_grade() {
        assert_eq!(SensorGrade::named("navigation"), None);
    }
}
