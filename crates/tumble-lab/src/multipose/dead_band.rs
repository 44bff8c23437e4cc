//! A dead band of a gyroscope: rates that it never reads between those at rest and those of turns
//! (docs/theory/multipose.md, section 13).

use nalgebra::Vector3;

use super::gyroscope::Turn;

/// Scatters at rest from the bias, beyond which a reading is not one at rest.
const BEYOND_REST: f64 = 6.0;

/// Such a limit by which a dead band is wider than the readings at rest.
const WIDE: f64 = 3.0;

/// Steps of a channel up to which a gap is the channel's own.
const COARSE: f64 = 4.0;

/// Chance of such a gap in readings of a gyroscope without a dead band.
const CHANCE: f64 = 1e-6;

/// An axis whose readings near its bias are those at rest, whatever turns it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnDeadBand {
    /// Place of the axis among x, y, z.
    pub axis: usize,
    /// rad/s from the bias.
    pub half_width: f64,
}

/// The widest dead band of readings at each rest, rad/s, and of turns; `None` where there is none.
pub(super) fn dead_band(at_rest: &[&[[f64; 3]]], turns: &[Turn]) -> Option<TurnDeadBand> {
    let (bias, noise) = moments(at_rest)?;
    let halves = turns.iter().flat_map(|turn| {
        let (first, second) = turn.samples.rate.split_at(turn.samples.rate.len().div_ceil(2));
        [first, second]
    });
    let halves: Vec<_> = halves.collect();
    let each = (0..3).map(|axis| {
        let of_half =
            |half: &&[Vector3<f64>]| half.iter().map(|rate| (rate[axis] - bias[axis]).abs()).collect();
        let rates: Vec<Vec<f64>> = halves.iter().map(of_half).collect();
        TurnDeadBand {
            axis,
            half_width: half_width(&rates, noise[axis]),
        }
    });
    // The first of bands that are equally wide.
    let widest = each.reduce(|widest, each| {
        if each.half_width > widest.half_width {
            each
        } else {
            widest
        }
    });
    widest.filter(|widest| widest.half_width > 0.0)
}

/// Mean and scatter of all readings at rest, rad/s; `None` without any.
fn moments(at_rest: &[&[[f64; 3]]]) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let rates = || at_rest.iter().copied().flatten().map(|rate| Vector3::from(*rate));
    // From the first reading, as a large bias leaves few digits for the scatter.
    let origin = rates().next()?;
    #[allow(clippy::cast_precision_loss)]
    let count = rates().count() as f64;
    let from_origin = || rates().map(|rate| rate - origin);
    let mean = from_origin().sum::<Vector3<f64>>() / count;
    let square = from_origin()
        .map(|rate| rate.component_mul(&rate))
        .sum::<Vector3<f64>>()
        / count;
    let variance = square - mean.component_mul(&mean);
    Some((origin + mean, variance.map(|variance| variance.max(0.0).sqrt())))
}

/// Half the band, rad/s, in which absolute rates of halves of turns never are; 0 without one.
///
/// A turn leaves zero and comes back to it, and passes each small rate as often as the next. So by chance one half in two
/// that are seen within an octave of rates is seen below it first.
fn half_width(halves: &[Vec<f64>], noise: f64) -> f64 {
    let limit = BEYOND_REST * noise;
    let beyond = |half: &[f64]| {
        half.iter()
            .copied()
            .filter(|rate| *rate > limit)
            .collect::<Vec<_>>()
    };
    let beyond: Vec<_> = halves.iter().map(|half| beyond(half)).collect();
    let Some(edge) = beyond.iter().flatten().copied().min_by(f64::total_cmp) else {
        return 0.0;
    };
    if edge <= WIDE * limit {
        return 0.0;
    }
    let is_near = |rate: &f64| *rate < 2.0 * edge;
    let passing = beyond.iter().filter(|half| half.iter().any(is_near)).count();
    let mut readings: Vec<_> = beyond.iter().flatten().copied().filter(is_near).collect();
    readings.sort_unstable_by(f64::total_cmp);
    readings.dedup();
    // Readings of a channel of few digits leave gaps everywhere.
    let gaps = readings.windows(2).map(|pair| pair[1] - pair[0]);
    let widest_gap = gaps.max_by(f64::total_cmp).unwrap_or(edge);
    #[allow(clippy::cast_precision_loss)]
    let by_chance = passing as f64 * libm::log(edge / (2.0 * edge - limit)); // eq. 47
    if edge > COARSE * widest_gap && by_chance < libm::log(CHANCE) {
        edge
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multipose::rotation_response::TurnSamples;

    const BIAS: [f64; 3] = [0.01, -0.02, 0.005];

    /// Twelve turns whose rates rise and fall, read about y as `read` has them, and a rest with noise.
    fn found(read: impl Fn(f64) -> f64) -> Option<TurnDeadBand> {
        let rate = |share: f64, peak: f64| {
            let rate = peak * (std::f64::consts::PI * share).sin();
            Vector3::from(BIAS) + Vector3::new(rate, read(rate), -rate)
        };
        let turns = (0..12).map(|k| {
            let peak = 1.0 + 0.037 * f64::from(k);
            Turn {
                before: 0,
                after: 1,
                samples: TurnSamples {
                    time: (0..=1000).map(|i| f64::from(i) * 1e-3).collect(),
                    rate: (0..=1000).map(|i| rate(f64::from(i) * 1e-3, peak)).collect(),
                    force: vec![Vector3::z(); 1001],
                },
                variance: 1e-6,
            }
        });
        let noise = |k: i32| BIAS.map(|bias| bias + if k % 2 == 0 { 1e-4 } else { -1e-4 });
        let rest: Vec<_> = (0..200).map(noise).collect();
        dead_band(&[&rest[..100], &rest[100..]], &turns.collect::<Vec<_>>())
    }

    #[test]
    fn a_band_that_no_turn_reads_is_found_with_its_axis() {
        let band = found(|rate| if rate.abs() < 0.05 { 0.0 } else { rate }).expect("a band");
        assert_eq!(band.axis, 1);
        assert!((band.half_width - 0.05).abs() < 0.005, "{band:?}");
    }

    #[test]
    fn readings_of_all_small_rates_have_no_band() {
        assert_eq!(found(|rate| rate), None);
    }

    #[test]
    fn a_channel_of_few_digits_has_no_band() {
        assert_eq!(found(|rate| (rate / 0.05).round() * 0.05), None);
    }

    #[test]
    fn no_rest_shows_no_band() {
        assert_eq!(dead_band(&[&[]], &[]), None);
    }
}
