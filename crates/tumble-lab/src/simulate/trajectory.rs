//! Motion that a unit can record: true specific force and angular rate at any time.

use nalgebra::Vector3;
use tumble_core::gravity::EARTH_RATE;

/// Readings of an ideal unit in the reference's place, in the case frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueMotion {
    /// Specific force at the turning centre, m/s^2.
    pub specific_force: Vector3<f64>,
    /// Angular rate, that of the Earth included, rad/s.
    pub angular_rate: Vector3<f64>,
    /// Angular rate of the table alone, rad/s.
    pub turn_rate: Vector3<f64>,
    /// Angular acceleration of the table, rad/s^2.
    pub turn_acceleration: Vector3<f64>,
}

/// A motion that a unit can record.
pub trait Trajectory {
    /// Truth at time `t`, s.
    fn truth(&self, t: f64) -> TrueMotion;

    /// End, s.
    fn duration(&self) -> f64;
}

/// Rate of the Earth at a latitude in rad, level frame, rad/s.
pub fn earth_rate(latitude: f64) -> Vector3<f64> {
    Vector3::new(0.0, libm::cos(latitude), libm::sin(latitude)) * EARTH_RATE
}
