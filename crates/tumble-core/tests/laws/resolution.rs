//! Resolution of readings, and what rounding and dead bands leave on their means.

use proptest::prelude::*;
use tumble_core::resolution::{DeadBand, Resolution, variance_of_rounding};

use crate::common::{Draws, cases};

const SAMPLES: u32 = 4000;

/// Rounded to a step.
fn rounded(value: f64, step: f64) -> f64 {
    step * (value / step).round()
}

fn mean_and_scatter(readings: &[f64]) -> (f64, f64) {
    let count = readings.len() as f64;
    let mean = readings.iter().sum::<f64>() / count;
    let squares = readings.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
    (mean, squares / (count - 1.0))
}

fn step_of(readings: &[f64]) -> Option<f64> {
    let mut resolution = Resolution::<f64, 1>::new();
    for y in readings {
        resolution.push([*y]);
    }
    resolution.step()
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn rounded_readings_show_their_step_and_others_none(
        step in 1e-4..0.1_f64, sigmas in 0.2..2.0_f64, level in -1.0..1.0_f64, seed in any::<u64>()
    ) {
        let mut draws = Draws::new(seed);
        let plain: Vec<_> = (0..SAMPLES).map(|_| level + sigmas * step * draws.normal()).collect();
        let coarse: Vec<_> = plain.iter().map(|y| rounded(*y, step)).collect();
        prop_assert_eq!(step_of(&plain), None);
        if let Some(found) = step_of(&coarse) {
            prop_assert!((found - step).abs() < 1e-9 * step, "{} {}", found, step);
        } else {
            // Too little noise to leave a step: nothing repeats but one value, or hardly another.
            let changes = coarse.windows(2).filter(|pair| pair[0] != pair[1]).count();
            prop_assert!(changes < 32, "{} changes", changes);
        }
    }

    #[test]
    fn a_mean_of_rounded_readings_is_within_its_sigma(
        step in 1e-4..0.1_f64, sigmas in 0.02..3.0_f64, level in -1.0..1.0_f64, seed in any::<u64>()
    ) {
        let mut draws = Draws::new(seed);
        let readings: Vec<_> =
            (0..SAMPLES).map(|_| rounded(level + sigmas * step * draws.normal(), step)).collect();
        let (mean, scatter) = mean_and_scatter(&readings);
        let variance = variance_of_rounding(Some(step), scatter) + scatter / f64::from(SAMPLES);
        prop_assert!((mean - level).abs() < 5.0 * variance.sqrt(), "{} {} {}", mean, level, variance.sqrt());
    }

    #[test]
    fn noise_of_a_step_makes_rounding_average_out(step in 1e-4..0.1_f64, sigmas in 0.6..5.0_f64) {
        let scatter = step * step * (sigmas * sigmas + 1.0 / 12.0);
        prop_assert_eq!(variance_of_rounding(Some(step), scatter), 0.0);
        prop_assert_eq!(variance_of_rounding::<f64>(None, 0.0), 0.0);
    }

    #[test]
    fn a_bias_within_a_dead_band_is_within_its_sigma(
        width in 1e-4..0.1_f64, sigmas in 0.02..3.0_f64, share in -0.99..0.99_f64, seed in any::<u64>()
    ) {
        let mut draws = Draws::new(seed);
        let bias = share * width;
        let mut band = DeadBand::<f64, 1>::new();
        let mut readings = Vec::new();
        for _ in 0..SAMPLES {
            let felt = bias + sigmas * width * draws.normal();
            let read = if felt.abs() < width { 0.0 } else { felt };
            band.push([read]);
            readings.push(read);
        }
        // A turn shows where the band ends.
        band.push([1.0001 * width]);
        let (mean, scatter) = mean_and_scatter(&readings);
        let variance = band.variance([None], SAMPLES)[0] + scatter / f64::from(SAMPLES);
        prop_assert!((mean - bias).abs() < 5.0 * variance.sqrt(), "{} {} {}", mean, bias, variance.sqrt());
        prop_assert!((band.half_width([None])[0] - width).abs() < 1e-3 * width + 0.0);
    }

    #[test]
    fn readings_of_a_converter_have_no_dead_band(step in 1e-4..0.1_f64, level in -3.0..3.0_f64, seed in any::<u64>()) {
        let mut draws = Draws::new(seed);
        let mut band = DeadBand::<f64, 1>::new();
        for _ in 0..SAMPLES {
            band.push([rounded(step * (level + draws.normal()), step)]);
        }
        prop_assert_eq!(band.half_width([Some(step)]), [0.0]);
    }
}
