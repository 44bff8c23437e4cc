//! Local gravity and the rotation of the Earth.

use crate::real::{Real, real};

/// Standard gravity, m/s^2 (3rd CGPM, 1901).
pub const STANDARD: f64 = 9.806_65;

/// Rate of rotation of the Earth, rad/s (WGS 84, NIMA TR8350.2, table 3.1).
pub const EARTH_RATE: f64 = 7.292_115e-5;

/// WGS 84 normal gravity at a height above the ellipsoid, m/s^2.
///
/// Somigliana's closed formula with the second-order height term (NIMA TR8350.2, third edition, eq. 4-1 and 4-3).
/// Latitude in rad, height in m. The anomaly of the real Earth, up to about 0.003 m/s^2 in mountains, is not in it.
pub fn normal<T: Real>(latitude: T, height: T) -> T {
    const SEMI_MAJOR_AXIS: f64 = 6_378_137.0;
    const FLATTENING: f64 = 1.0 / 298.257_223_563;
    const FIRST_ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;
    const EQUATOR: f64 = 9.780_325_335_9;
    const SOMIGLIANA: f64 = 1.931_852_652_41e-3;
    const M: f64 = 3.449_786_506_84e-3;

    let (sine, _) = latitude.sine_cosine();
    let sine_squared = sine * sine;
    let on_ellipsoid = real::<T>(EQUATOR) * (T::one() + real::<T>(SOMIGLIANA) * sine_squared)
        / (T::one() - real::<T>(FIRST_ECCENTRICITY_SQUARED) * sine_squared).square_root();
    let h = height / real(SEMI_MAJOR_AXIS);
    let linear = real::<T>(1.0 + FLATTENING + M) - real::<T>(2.0 * FLATTENING) * sine_squared;
    on_ellipsoid * (T::one() - linear * h * real(2.0) + h * h * real(3.0))
}

/// Upward part of the Earth's rotation at a latitude in rad, rad/s.
pub fn vertical_earth_rate<T: Real>(latitude: T) -> T {
    real::<T>(EARTH_RATE) * latitude.sine_cosine().0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_gravity_agrees_with_published_values() {
        // NIMA TR8350.2, table 3.4.
        assert!((normal(0.0_f64, 0.0) - 9.780_325_335_9).abs() < 1e-10);
        assert!((normal(core::f64::consts::FRAC_PI_2, 0.0) - 9.832_184_937_8).abs() < 1e-9);
    }

    #[test]
    fn gravity_falls_by_the_free_air_gradient() {
        let gradient = (normal(0.785_f64, 100.0) - normal(0.785_f64, 0.0)) / 100.0;
        assert!((gradient + 3.086e-6).abs() < 2e-9, "{gradient}");
    }
}
