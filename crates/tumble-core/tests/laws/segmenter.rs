//! A recording becomes rests and turns.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_core::gravity::STANDARD;
use tumble_core::real::Real;
use tumble_core::sample::Sample;
use tumble_core::segmenter::{FinishedSegment, Segment, Segmenter, SegmenterSettings};

use crate::common::{Draws, cases, direction, vector};
use crate::stream::{INTERVAL, Phase, Unit, of, rests, samples, segments, stretch, true_rests, turns};

/// Longest part that a rest may lack at either end: the table settling, a block held back, a block begun before.
const LOST: f64 = 0.25;

/// Rests of some seconds with turns between, which move gravity by a quarter of a radian at least.
fn schedule() -> impl Strategy<Value = Vec<Phase>> {
    let turn = (direction(), 0.5..3.0_f64, 0.5..2.0_f64);
    let visit = (1.6..4.0_f64, turn);
    (prop::collection::vec(visit, 2..6), 1.6..4.0_f64).prop_map(|(visits, last)| {
        let both = |(rest, (axis, angle, time)): (f64, (Vector3<f64>, f64, f64))| {
            [Phase::Rest(round(rest)), Phase::Turn(axis * angle, round(time))]
        };
        visits
            .into_iter()
            .flat_map(both)
            .chain([Phase::Rest(round(last))])
            .collect()
    })
}

/// To a whole number of samples.
fn round(seconds: f64) -> f64 {
    let step = INTERVAL as f64 * 1e-6;
    (seconds / step).round() * step
}

/// From tactical to poor: three decades of noise.
fn unit() -> impl Strategy<Value = Unit> {
    (-3.0..0.0_f64, vector(2.0), vector(0.3)).prop_map(|(decade, force, rate)| {
        let scale = 10_f64.powf(decade);
        Unit {
            bias: (force, rate),
            ..Unit::noisy(0.2 * scale, 0.02 * scale)
        }
    })
}

fn seconds<T: Real>(stretch: &Segment<T>) -> (f64, f64) {
    (stretch.start as f64 * 1e-6, stretch.end as f64 * 1e-6)
}

fn finds_the_rests<T: Real>(schedule: &[Phase], stream: &[Sample<f64>]) -> Result<(), TestCaseError> {
    let found = rests(&segments::<T>(stream));
    let expected = true_rests(schedule);
    let spans: Vec<_> = found.iter().map(seconds).collect();
    prop_assert_eq!(spans.len(), expected.len(), "{:?} {:?}", &spans, &expected);
    for ((start, end), (begin, finish)) in spans.iter().zip(&expected) {
        // The slow first and last of a turn may look like rest to a noisy unit.
        prop_assert!(
            *start > begin - LOST && *start < begin + LOST,
            "{:?} {:?}",
            &spans,
            &expected
        );
        prop_assert!(
            *end > finish - LOST && *end < finish + LOST,
            "{:?} {:?}",
            &spans,
            &expected
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn every_rest_is_found_over_three_decades_of_noise_at_any_bias(
        schedule in schedule(), up in direction(), unit in unit(), seed in any::<u64>()
    ) {
        prop_assume!(moves_gravity(&schedule, &up));
        let stream = samples(&schedule, &up, &unit, &mut Draws::new(seed));
        finds_the_rests::<f64>(&schedule, &stream)?;
        finds_the_rests::<f32>(&schedule, &stream)?;
    }

    #[test]
    fn a_constant_slow_turn_about_a_tilted_axis_is_no_rest(
        axis in direction(), rate in 0.01..0.2_f64, up in direction(), unit in unit(), seed in any::<u64>()
    ) {
        // Within the shortest rest, a second, the part of gravity across the axis must get out of the gate: drift and
        // six sigma of the mean over a block of ten samples, against a mean that lags by half a second. Slower turns
        // show in the slope over the whole rest, which is checked when the whole rest is known.
        let drift = 0.5 * rate * STANDARD * axis.cross(&up).norm();
        prop_assume!(drift > 1.5 * (0.02 + 2.0 * unit.scatter.0));
        let schedule = [Phase::Rest(3.0), Phase::Spin(axis * rate, 10.0)];
        let stream = samples(&schedule, &up, &unit, &mut Draws::new(seed));
        let found = rests(&segments::<f64>(&stream));
        prop_assert_eq!(found.len(), 1, "{:?}", found.iter().map(seconds).collect::<Vec<_>>());
        prop_assert!(seconds(&found[0]).1 < 3.0 + 3.0 * LOST);
    }

    #[test]
    fn a_turn_about_the_vertical_is_no_rest_after_one(rate in 0.02..0.2_f64, up in direction(), unit in unit(), seed in any::<u64>()) {
        // Gravity does not show the turn, but the rate is not that at rest.
        prop_assume!(rate > 8.0 * unit.scatter.1);
        let schedule = [Phase::Rest(3.0), Phase::Spin(up * rate, 5.0), Phase::Rest(2.0)];
        let stream = samples(&schedule, &up, &unit, &mut Draws::new(seed));
        let found = rests(&segments::<f64>(&stream));
        prop_assert!(seconds(&found[0]).1 <= 3.0 + LOST, "{:?}", found.iter().map(seconds).collect::<Vec<_>>());
    }

    #[test]
    fn vibration_is_no_rest(times_noise in 4.0..100.0_f64, up in direction(), unit in unit(), seed in any::<u64>()) {
        let schedule = [
            Phase::Rest(3.0), Phase::Shake(times_noise * unit.scatter.0.max(0.005), 4.0), Phase::Rest(3.0),
        ];
        let stream = samples(&schedule, &up, &unit, &mut Draws::new(seed));
        finds_the_rests::<f64>(&schedule, &stream)?;
        finds_the_rests::<f32>(&schedule, &stream)?;
    }

    #[test]
    fn a_recording_that_begins_in_motion_gives_the_next_rest_only(
        axis in direction(), rate in 0.2..2.0_f64, up in direction(), unit in unit(), seed in any::<u64>()
    ) {
        prop_assume!(axis.cross(&up).norm() > 0.5 && unit.scatter.0 < 0.05);
        let schedule = [Phase::Spin(axis * rate, 4.0), Phase::Rest(3.0)];
        let stream = samples(&schedule, &up, &unit, &mut Draws::new(seed));
        finds_the_rests::<f64>(&schedule, &stream)?;
    }

    #[test]
    fn a_gap_ends_a_rest_and_the_turn_with_it_is_not_complete(
        before in 1.5..3.0_f64, gap in 0.1..30.0_f64, after in 1.5..3.0_f64, up in direction(), seed in any::<u64>()
    ) {
        let schedule = [Phase::Rest(round(before)), Phase::Gap(round(gap)), Phase::Rest(round(after))];
        let stream = samples(&schedule, &up, &Unit::noisy(0.01, 0.001), &mut Draws::new(seed));
        finds_the_rests::<f64>(&schedule, &stream)?;
        let found = segments::<f64>(&stream);
        prop_assert!(rests(&found).iter().all(|rest| rest.complete));
        let complete: Vec<bool> = turns(&found).iter().map(|turn| turn.complete).collect();
        // A third may follow the last rest: samples too few for a block.
        prop_assert_eq!(&complete[..2], &[true, false]);
    }

    #[test]
    fn samples_that_are_late_doubled_or_not_numbers_change_nothing(
        schedule in schedule(), seed in any::<u64>(), spoilt in prop::collection::vec((any::<prop::sample::Index>(), 0..3_u8), 1..40)
    ) {
        let up = Vector3::z();
        let stream = samples(&schedule, &up, &Unit::noisy(0.01, 0.001), &mut Draws::new(seed));
        let mut broken: Vec<Vec<Sample<f64>>> = stream.iter().map(|sample| vec![*sample]).collect();
        for (place, kind) in &spoilt {
            let at = place.get(&broken)[0];
            let mut extra = at;
            match kind {
                0 => extra.specific_force.y = f64::NAN,
                1 => extra.time = at.time.saturating_sub(7 * INTERVAL),
                _ => extra.angular_rate *= 3.0,
            }
            // Not a number may come with any time, even one far ahead.
            if *kind == 0 {
                extra.time += 1_000_000_000;
            }
            broken[place.index(stream.len())].push(extra);
        }
        let broken: Vec<_> = broken.into_iter().flatten().collect();
        prop_assert_eq!(segments::<f64>(&broken), segments::<f64>(&stream));
    }

    #[test]
    fn segments_cover_the_recording_in_order_without_overlap(
        schedule in schedule(), tail in any::<bool>(), up in direction(), unit in unit(), seed in any::<u64>()
    ) {
        let mut schedule = schedule;
        if tail {
            schedule.push(Phase::Turn(Vector3::new(1.0, 1.0, 0.0), 1.0));
        }
        let stream = samples(&schedule, &up, &unit, &mut Draws::new(seed));
        let found = segments::<f64>(&stream);
        let parts: Vec<_> = found.iter().map(stretch).collect();
        prop_assert_eq!(parts[0].start, stream[0].time);
        prop_assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start));
        prop_assert_eq!(parts[parts.len() - 1].end, stream[stream.len() - 1].time + INTERVAL);
        let total: u32 = parts.iter().map(|part| part.moments.samples()).sum();
        prop_assert_eq!(total as usize, stream.len());
        let kinds: Vec<bool> = found.iter().map(|segment| matches!(segment, FinishedSegment::Rest(_))).collect();
        prop_assert!(kinds.windows(2).all(|pair| pair[0] != pair[1]), "{:?}", kinds);
    }

    #[test]
    fn the_segmenter_cuts_alike_in_single_and_double_precision(
        schedule in schedule(), up in direction(), unit in unit(), seed in any::<u64>()
    ) {
        let stream = samples(&schedule, &up, &unit, &mut Draws::new(seed));
        let (double, single) = (rests(&segments::<f64>(&stream)), rests(&segments::<f32>(&stream)));
        // A block exactly at a gate may fall to either side: one block more or less at an end.
        prop_assert_eq!(double.len(), single.len());
        for (a, b) in double.iter().zip(&single) {
            prop_assert!(a.start.abs_diff(b.start) <= 50_000 && a.end.abs_diff(b.end) <= 50_000);
            // The mean of a rest in f32: g in rounding, times the logarithm of the number of merges.
            let apart = (a.specific_force() - b.specific_force().cast::<f64>()).amax();
            prop_assert!(a.start != b.start || a.end != b.end || apart < 20.0 * 6e-8 * STANDARD, "{}", apart);
        }
    }
}

/// Tests whether each turn moves gravity enough to be distinguished from drift, and not all the way round.
fn moves_gravity(schedule: &[Phase], up: &Vector3<f64>) -> bool {
    let mut here = *up;
    schedule.iter().all(|phase| {
        let Phase::Turn(angle, _) = phase else { return true };
        let there = nalgebra::UnitQuaternion::from_scaled_axis(-angle) * here;
        let moved = there.angle(&here);
        here = there;
        moved > 0.25
    })
}

#[test]
fn nothing_in_gives_nothing_out() {
    let mut segmenter = Segmenter::<f64>::new(SegmenterSettings::default());
    assert_eq!(segmenter.finish(), None);
    assert!(!segmenter.has_block());
    assert_eq!(segmenter.floor(), None);
}

#[test]
fn a_rest_shorter_than_the_shortest_is_part_of_a_turn() {
    let schedule = [Phase::Rest(0.8), Phase::Turn(Vector3::x(), 1.0), Phase::Rest(3.0)];
    let stream = samples(
        &schedule,
        &Vector3::z(),
        &Unit::noisy(0.01, 0.001),
        &mut Draws::new(71),
    );
    let found = rests(&segments::<f64>(&stream));
    assert_eq!(found.len(), 1);
    assert!(found[0].start >= 1_700_000);
}

#[test]
fn a_block_is_given_once_and_only_when_one_closed() {
    let mut segmenter = Segmenter::<f64>::new(SegmenterSettings::default());
    let stream = samples(
        &[Phase::Rest(2.0)],
        &Vector3::z(),
        &Unit::noisy(0.01, 0.001),
        &mut Draws::new(72),
    );
    let mut end = 0;
    for sample in &stream {
        segmenter.push(sample);
        assert_eq!(
            segmenter.has_block(),
            segmenter
                .take_block()
                .copied()
                .inspect(|block| {
                    assert_eq!(block.start, end);
                    end = block.end;
                })
                .is_some()
        );
        assert!(!segmenter.has_block());
    }
    assert!(end > 1_900_000);
}

#[test]
fn a_perfect_sensor_without_noise_rests_and_turns_like_others() {
    let schedule = [
        Phase::Rest(2.0),
        Phase::Turn(Vector3::x() * 1.5, 1.0),
        Phase::Rest(2.0),
    ];
    let stream = samples(&schedule, &Vector3::z(), &Unit::perfect(), &mut Draws::new(73));
    assert_eq!(rests(&segments::<f64>(&stream)).len(), 2);
    let single: Vec<FinishedSegment<f32>> = segments(&stream);
    assert_eq!(rests(&single).len(), 2);
    assert_eq!(of::<f32>(&stream[0]).time, 0);
}
