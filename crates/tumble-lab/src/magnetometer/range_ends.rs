//! Ends of the range of a magnetometer, where its readings no longer follow the field
//! (docs/theory/magnetometer.md, section 6).

/// Times of the longest run of one reading anywhere else, beyond which a run at an extreme is the end of the range: rests and
/// turns are of lengths that differ by less. Twice of it misses ends that are touched briefly.
const LASTS: f64 = 3.0;

/// Times that a coarse sensor dwells at the top of an even turn, in the time that it takes through one step beside that:
/// `2 / (sqrt(2) - 1)` for a parabola that fills the top step.
const TOP_OF_TURN: f64 = 2.0 * (1.0 + core::f64::consts::SQRT_2);

/// Lowest and highest reading of each axis, uT, where the range ends there; `None` where it does not.
///
/// A sensor repeats its reading at the end of its range, and nowhere else so long: noise moves it elsewhere. A coarse one that
/// repeats readings at any rest shows no end by that.
pub fn range_ends(field: &[[f64; 3]]) -> [[Option<f64>; 2]; 3] {
    let axes = [0, 1, 2].map(|axis| AxisRuns::of(field, axis));
    let elsewhere = axes.iter().map(|runs| runs.elsewhere).fold(0.0, f64::max);
    let is_end = |at: EqualReadings| {
        at.samples > LASTS * elsewhere && at.samples > TOP_OF_TURN * (at.beside + 1.0) // eq. 12
    };
    let moves = |runs: &AxisRuns| runs.extremes[0] < runs.extremes[1];
    let all = || axes.iter().filter(|runs| moves(runs));
    let found: Vec<f64> = all()
        .flat_map(|runs| runs.extremes.into_iter().zip(runs.longest))
        .filter_map(|(value, longest)| is_end(longest).then_some(value.abs()))
        .collect();
    // Where one end is known, all ends of the sensor are.
    let known = |value: f64| found.iter().any(|end| end.total_cmp(&value.abs()).is_eq());
    [0, 1, 2].map(|axis| {
        let runs: &AxisRuns = &axes[axis];
        runs.extremes
            .map(|value| (moves(runs) && known(value)).then_some(value))
    })
}

/// Successive equal readings.
#[derive(Clone, Copy, Debug)]
struct EqualReadings {
    samples: f64,
    /// Samples of the longer one of the runs before and after it.
    beside: f64,
}

/// Longest runs of one reading on an axis.
struct AxisRuns {
    /// Lowest and highest reading, uT.
    extremes: [f64; 2],
    /// The longest run at each.
    longest: [EqualReadings; 2],
    /// Samples of the longest run at any other reading.
    elsewhere: f64,
}

impl AxisRuns {
    fn of(field: &[[f64; 3]], axis: usize) -> Self {
        let values = field.iter().map(|reading| reading[axis]);
        let extremes = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        });
        let none = EqualReadings {
            samples: 0.0,
            beside: 0.0,
        };
        let mut found = Self {
            extremes,
            longest: [none; 2],
            elsewhere: 0.0,
        };
        #[allow(clippy::cast_precision_loss)]
        let runs: Vec<(f64, f64)> = field
            .chunk_by(|one, next| one[axis].total_cmp(&next[axis]).is_eq())
            .map(|run| (run[0][axis], run.len() as f64))
            .collect();
        let samples = |place: Option<usize>| place.and_then(|k| runs.get(k)).map_or(0.0, |run| run.1);
        for (k, &(value, size)) in runs.iter().enumerate() {
            match extremes.iter().position(|end| end.total_cmp(&value).is_eq()) {
                Some(end) if size > found.longest[end].samples => {
                    let beside = samples(k.checked_sub(1)).max(samples(Some(k + 1)));
                    found.longest[end] = EqualReadings {
                        samples: size,
                        beside,
                    };
                }
                Some(_) => {}
                None => found.elsewhere = found.elsewhere.max(size),
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::range_ends;

    /// Readings in steps of a unit that turns about all axes, clipped beyond `end`.
    fn turned(step: f64, end: f64) -> Vec<[f64; 3]> {
        (0..6000_u32)
            .map(|k| {
                let t = f64::from(k) / 50.0;
                let field = [(0.9 * t).sin(), (1.1 * t + 1.0).cos(), (0.7 * t + 2.0).sin()];
                field.map(|u| ((50.0 * u / step).round() * step).clamp(-end, end))
            })
            .collect()
    }

    #[test]
    fn a_run_at_an_extreme_is_an_end() {
        let found = range_ends(&turned(0.15, 40.05));
        assert!(
            found
                .iter()
                .flatten()
                .all(|end| end.is_some_and(|end| end.abs() == 40.05))
        );
    }

    #[test]
    fn turns_of_coarse_and_fine_sensors_show_no_end() {
        for step in [1e-9, 0.01, 0.15, 0.6, 1.5] {
            let found = range_ends(&turned(step, f64::INFINITY));
            assert!(found.iter().flatten().all(Option::is_none), "step {step}");
        }
    }

    #[test]
    fn an_axis_that_never_moves_and_no_reading_show_no_end() {
        assert!(range_ends(&[[1.0; 3]; 50]).iter().flatten().all(Option::is_none));
        assert!(range_ends(&[]).iter().flatten().all(Option::is_none));
    }
}
