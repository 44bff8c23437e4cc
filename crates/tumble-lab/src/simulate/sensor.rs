//! Readings of a triad of sensors for the truth.
//!
//! ```text
//! y = quantise(M u + b + G f + c (T - 25 degC) + white + flicker),   clamped to the range
//! ```
//!
//! `u` is the true specific force or angular rate in the case frame of the reference, `f` the true specific force,
//! `M = K L Q` as in [`tumble_core::model`]: scale, non-orthogonality, and the mounting `sensor_from_case`.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::Deserialize;
use tumble_core::model::{Decomposition, ErrorModel};

use crate::simulate::grade::TriadGrade;
use crate::simulate::stream::{RandomStream, normal_vector};

/// Temperature, degC, at which the bias of a triad is that of its truth.
pub const REFERENCE_TEMPERATURE: f64 = 25.0;

/// Choice between the errors of the grade and none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    /// Scale, non-orthogonality, alignment, temperature coefficient and g-sensitivity are drawn from the grade.
    Drawn,
    /// None of these; bias and noise stay.
    Perfect,
}

/// True errors of three accelerometers or three gyroscopes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriadErrors {
    /// `M` (without unit) and `b` (unit of the triad).
    pub model: ErrorModel<f64>,
    /// `G`: response of a gyroscope to specific force, rad/s per m/s^2.
    pub g_sensitivity: Matrix3<f64>,
    /// Change of the bias, unit / K.
    pub temperature_coefficient: Vector3<f64>,
    /// White noise `N`, unit / sqrt(Hz).
    pub noise_density: f64,
    /// Bias instability `B`, unit; 0 where it is off.
    pub bias_instability: f64,
    /// Step of the output, unit; 0 where it is off.
    pub quantisation: f64,
    /// Largest magnitude of the output, unit.
    pub range: f64,
}

impl TriadErrors {
    /// Draws a triad of a grade in a package turned by `package_from_case`.
    pub fn draw(
        grade: &TriadGrade,
        geometry: Geometry,
        package_from_case: &Rotation3<f64>,
        stream: &mut RandomStream,
    ) -> Self {
        let drawn = if geometry == Geometry::Drawn { 1.0 } else { 0.0 };
        let bias = normal_vector(stream) * grade.turn_on_bias;
        let scale = Vector3::repeat(1.0) + normal_vector(stream) * (drawn * grade.scale_error);
        let angles = normal_vector(stream) * (drawn * grade.non_orthogonality);
        let alignment = Rotation3::new(normal_vector(stream) * (drawn * grade.alignment));
        let temperature_coefficient = normal_vector(stream) * (drawn * grade.temperature_coefficient);
        let g_sensitivity =
            Matrix3::from_columns(&[(); 3].map(|()| normal_vector(stream) * (drawn * grade.g_sensitivity)));
        let parts = Decomposition {
            scale,
            non_orthogonality: sensing_axes(&angles),
            mounting: alignment * package_from_case,
        };
        Self {
            model: ErrorModel {
                matrix: parts.compose(),
                bias,
            },
            g_sensitivity,
            temperature_coefficient,
            noise_density: grade.noise_density,
            bias_instability: grade.bias_instability,
            quantisation: grade.quantisation,
            range: grade.range,
        }
    }

    /// Reading of the triad: `u` is the truth it senses, `f` the specific force, `warmth` in K above the reference
    /// temperature, `noise` in the unit of the triad.
    pub fn reading(
        &self,
        u: &Vector3<f64>,
        f: &Vector3<f64>,
        warmth: f64,
        noise: &Vector3<f64>,
    ) -> Vector3<f64> {
        let drift = self.temperature_coefficient * warmth;
        let analogue = self.model.measure(u) + self.g_sensitivity * f + drift + noise;
        analogue.map(|y| quantised(y, self.quantisation).clamp(-self.range, self.range))
    }
}

/// Nearest multiple of `step`; a step of 0 leaves the value alone.
pub fn quantised(value: f64, step: f64) -> f64 {
    if step > 0.0 {
        (value / step).round() * step
    } else {
        value
    }
}

/// `L`: unit sensing axes that deviate from 90 degrees by the angles xy, yz, zx, rad; Cholesky factor of their products.
fn sensing_axes(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (xy, yz, zx) = (libm::sin(angles.x), libm::sin(angles.y), libm::sin(angles.z));
    let l22 = (1.0 - xy * xy).sqrt();
    let l32 = (yz - zx * xy) / l22;
    let l33 = (1.0 - zx * zx - l32 * l32).sqrt();
    Matrix3::new(1.0, 0.0, 0.0, xy, l22, 0.0, zx, l32, l33)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::grade::SensorGrade;
    use crate::simulate::stream::{StreamPurpose, stream};
    use proptest::prelude::*;

    fn perfect() -> TriadErrors {
        let identity = Rotation3::identity();
        let mut random = stream(1, 0, StreamPurpose::Geometry);
        let mut triad = TriadErrors::draw(
            &SensorGrade::consumer().accelerometer,
            Geometry::Perfect,
            &identity,
            &mut random,
        );
        triad.model.bias = Vector3::zeros();
        triad
    }

    proptest! {
        #[test]
        fn non_orthogonality_angles_are_read_back_from_the_sensing_axes(
            xy in -0.1..0.1f64, yz in -0.1..0.1f64, zx in -0.1..0.1f64,
        ) {
            let angles = Vector3::new(xy, yz, zx);
            let model = ErrorModel { matrix: sensing_axes(&angles), bias: Vector3::zeros() };
            let read = model.decompose().unwrap().parameters(&model.bias).non_orthogonality;
            prop_assert!((read - angles).amax() < 1e-12);
        }

        #[test]
        fn a_drawn_triad_comes_apart_into_the_mounting_of_its_package(seed in any::<u64>(), x in -3.0..3.0f64) {
            let grade = TriadGrade { alignment: 0.0, ..SensorGrade::consumer().accelerometer };
            let package = Rotation3::new(Vector3::new(x, 0.3, -0.2));
            let triad = TriadErrors::draw(&grade, Geometry::Drawn, &package, &mut stream(seed, 1, StreamPurpose::Geometry));
            let parts = triad.model.decompose().unwrap();
            prop_assert!((parts.mounting.matrix() - package.matrix()).amax() < 1e-12);
            prop_assert!((parts.scale - Vector3::repeat(1.0)).amax() < 7.0 * grade.scale_error);
        }

        #[test]
        fn quantisation_moves_a_reading_by_half_a_step_at_most(value in -100.0..100.0f64) {
            let mut triad = perfect();
            triad.range = 1e3;
            let u = Vector3::repeat(value);
            let read = triad.reading(&u, &Vector3::zeros(), 0.0, &Vector3::zeros());
            prop_assert!((read.x - value).abs() <= triad.quantisation / 2.0 * (1.0 + 1e-9));
            let steps = read.x / triad.quantisation;
            prop_assert!((steps - steps.round()).abs() < 1e-6);
        }

        #[test]
        fn no_reading_leaves_the_range(value in -1e3..1e3f64) {
            let triad = perfect();
            let read = triad.reading(&Vector3::repeat(value), &Vector3::zeros(), 0.0, &Vector3::zeros());
            prop_assert!(read.amax() <= triad.range);
        }
    }

    #[test]
    fn bias_and_scale_scatter_as_their_grade_says() {
        let grade = SensorGrade::tactical().gyroscope;
        let count = 2000;
        let (mut bias, mut scale) = (0.0, 0.0);
        for seed in 0..count {
            let mut random = stream(seed, 1, StreamPurpose::Geometry);
            let triad = TriadErrors::draw(&grade, Geometry::Drawn, &Rotation3::identity(), &mut random);
            bias += triad.model.bias.norm_squared();
            let parts = triad.model.decompose().unwrap();
            scale += (parts.scale - Vector3::repeat(1.0)).norm_squared();
        }
        let numbers = 3.0 * count as f64;
        let bound = 4.0 * (2.0 / numbers).sqrt();
        assert!((bias / numbers / grade.turn_on_bias.powi(2) - 1.0).abs() < bound);
        assert!((scale / numbers / grade.scale_error.powi(2) - 1.0).abs() < bound);
    }

    #[test]
    fn warmth_and_force_move_a_gyroscope_by_their_coefficients() {
        let mut triad = perfect();
        triad.quantisation = 0.0;
        triad.temperature_coefficient = Vector3::new(1e-3, 2e-3, -1e-3);
        triad.g_sensitivity = Matrix3::new(1e-4, 2e-4, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 3e-4);
        let read = triad.reading(
            &Vector3::zeros(),
            &Vector3::new(0.0, 10.0, 0.0),
            5.0,
            &Vector3::zeros(),
        );
        assert!((read - Vector3::new(7e-3, 11e-3, -5e-3)).amax() < 1e-15);
    }
}
