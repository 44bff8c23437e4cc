//! How to calibrate without equipment.

/// Directions that nine unknowns and one to check them need.
pub const FEWEST_DIRECTIONS: usize = 10;

/// How to calibrate without equipment.
#[derive(Clone, Copy, Debug)]
pub struct MultiposeSettings {
    /// Local gravity, m/s^2.
    pub gravity: f64,
    /// Latitude, rad, where the rotation of the Earth is to be taken off.
    pub latitude: Option<f64>,
    /// Whether to fit the gyroscope's sensitivity to specific force.
    pub g_sensitivity: bool,
    /// Whether there is a gyroscope.
    pub gyroscope: bool,
    /// Whether readings are counts whose scale nobody knows.
    pub raw: bool,
    /// Shortest rest, microseconds.
    pub shortest_rest: u64,
}
