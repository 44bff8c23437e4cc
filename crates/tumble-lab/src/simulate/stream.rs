//! Independent random streams out of one seed.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_distr::{StandardNormal, UnitSphere};
use rand_pcg::Pcg64Dxsm;

/// Random number generator of one stream.
pub type RandomStream = Pcg64Dxsm;

/// Purposes for which streams are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum StreamPurpose {
    /// Mounting of the shared structure and errors of the table.
    Table = 1,
    /// Scale, non-orthogonality, mounting, bias and coefficients of a unit.
    Geometry = 2,
    /// Clock of a unit.
    Clock = 3,
    /// White noise of the accelerometer.
    AccelerometerWhite = 4,
    /// Bias instability of the accelerometer.
    AccelerometerFlicker = 5,
    /// White noise of the gyroscope.
    GyroscopeWhite = 6,
    /// Bias instability of the gyroscope.
    GyroscopeFlicker = 7,
    /// Slip of wheels and vibration of motors.
    Floor = 8,
    /// Ageing of a unit.
    Ageing = 9,
    /// Faults of a unit that scatter.
    Faults = 10,
    /// Way of a quadrotor or a vehicle.
    Ride = 11,
    /// Vibration of the structure.
    Vibration = 12,
    /// Noise of a channel that stands still.
    StillNoise = 13,
}

/// Stream of `unit` (0 is the reference) for `purpose`.
pub fn stream(seed: u64, unit: u64, purpose: StreamPurpose) -> RandomStream {
    let key = mix(seed.wrapping_add(mix(unit.wrapping_add(mix(purpose as u64)))));
    RandomStream::seed_from_u64(key)
}

/// Finaliser of SplitMix64: neighbouring seeds and units must not give neighbouring generator states.
///
/// Source: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
fn mix(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Three independent standard normal numbers.
pub fn normal_vector(stream: &mut RandomStream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| stream.sample(StandardNormal))
}

/// A direction, uniform over the sphere.
pub fn direction(stream: &mut RandomStream) -> Vector3<f64> {
    Vector3::from(stream.sample::<[f64; 3], _>(UnitSphere))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_of_two_units_and_of_two_purposes_are_uncorrelated() {
        let count = 20_000;
        let draw = |unit, purpose| {
            let mut stream = stream(7, unit, purpose);
            (0..count)
                .map(|_| stream.sample(StandardNormal))
                .collect::<Vec<f64>>()
        };
        let base = draw(1, StreamPurpose::AccelerometerWhite);
        for other in [
            draw(2, StreamPurpose::AccelerometerWhite),
            draw(1, StreamPurpose::GyroscopeWhite),
        ] {
            let correlation = base.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / f64::from(count);
            assert!(
                correlation.abs() < 4.0 / f64::from(count).sqrt(),
                "correlation {correlation}"
            );
        }
    }

    #[test]
    fn the_same_seed_unit_and_purpose_give_the_same_numbers() {
        let draw = |seed| normal_vector(&mut stream(seed, 3, StreamPurpose::Geometry));
        assert_eq!(draw(11), draw(11));
        assert_ne!(draw(11), draw(12));
    }

    #[test]
    fn directions_have_unit_length_and_no_preferred_side() {
        let mut stream = stream(5, 0, StreamPurpose::Table);
        let count = 10_000;
        let mut sum = Vector3::zeros();
        for _ in 0..count {
            let d = direction(&mut stream);
            assert!((d.norm() - 1.0).abs() < 1e-12);
            sum += d;
        }
        // Each component has variance 1/3.
        let bound = 4.0 * (1.0 / 3.0 / f64::from(count)).sqrt();
        assert!((sum / f64::from(count)).amax() < bound, "mean {sum}");
    }
}
