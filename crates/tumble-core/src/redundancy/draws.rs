//! Random numbers and readings for tests beside the code.

use nalgebra::Vector3;

use crate::redundancy::isolation::UnitReading;

/// Reading of a sound, calibrated unit in motion: specific force, m/s^2, and angular rate, rad/s.
pub fn sound_reading(f: Vector3<f64>, w: Vector3<f64>) -> UnitReading<f64> {
    UnitReading {
        reading: [f, w],
        scatter: [0.02, 0.0014],
        at_rest: None,
        votes: [true; 2],
        known: [true; 2],
        calibrated: [true; 2],
        matrix_shown: [true; 2],
        place: 0.0,
        residual: [1e-5, 1e-8],
        uncertainty: [0.0; 2],
        interval: 0.005,
    }
}

/// Numbers of a seed (Knuth's multiplier).
pub struct Draw(pub u64);

impl Draw {
    /// From zero to one.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Nearly normal, of a variance of one.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// Three normal ones, times a standard deviation.
    pub fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()) * sigma
    }
}
