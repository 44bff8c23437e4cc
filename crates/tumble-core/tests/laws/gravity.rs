//! Local gravity and the rotation of the Earth.

use proptest::prelude::*;
use tumble_core::gravity::{EARTH_RATE, STANDARD, normal, vertical_earth_rate};

use crate::common::rounding;

proptest! {
    #[test]
    fn gravity_is_equal_north_and_south_and_grows_to_the_poles(latitude in 0.0..1.5_f64, height in -100.0..9000.0_f64) {
        prop_assert_eq!(normal(latitude, height), normal(-latitude, height));
        prop_assert!(normal(latitude + 0.05, height) > normal(latitude, height));
    }

    #[test]
    fn gravity_falls_with_height_as_with_the_square_of_the_distance(latitude in -1.5..1.5_f64, height in 0.0..9000.0_f64) {
        // The Earth taken for a sphere of its mean radius: good to the flattening, one in three hundred of the fall.
        let radius = 6_371_000.0;
        let expected = normal(latitude, 0.0) * (radius / (radius + height)).powi(2);
        let fall = normal(latitude, 0.0) - expected;
        prop_assert!((normal(latitude, height) - expected).abs() <= 0.01 * fall + 1e-12);
    }

    #[test]
    fn gravity_is_the_same_in_single_precision(latitude in -1.57..1.57_f64, height in -100.0..9000.0_f64) {
        let single = f64::from(normal(latitude as f32, height as f32));
        prop_assert!((single - normal(latitude, height)).abs() < rounding::<f32>(4.0) * STANDARD);
        let rate = f64::from(vertical_earth_rate(latitude as f32));
        prop_assert!((rate - vertical_earth_rate(latitude)).abs() < rounding::<f32>(4.0) * EARTH_RATE);
    }
}

#[test]
fn the_earth_turns_about_the_vertical_at_the_poles_only() {
    assert_eq!(vertical_earth_rate(0.0_f64), 0.0);
    assert!((vertical_earth_rate(core::f64::consts::FRAC_PI_2) - EARTH_RATE).abs() < 1e-20);
    assert!((vertical_earth_rate(-core::f64::consts::FRAC_PI_2) + EARTH_RATE).abs() < 1e-20);
}
