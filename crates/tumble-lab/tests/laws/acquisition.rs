//! A recording of any length becomes the rests and turns of one unit.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_core::real::seconds;
use tumble_core::segmenter::SegmenterSettings;
use tumble_lab::acquisition::channels::ChannelFaultKind;
use tumble_lab::acquisition::{Acquired, Acquisition, interval};

use super::common::{Draws, cases};
use super::stream::{Phase, Unit};
use super::unit::{Recording, six_faces};

fn recording(seed: u64) -> Recording {
    Recording::of(&six_faces(2.0), &Unit::noisy(0.02, 0.002), &mut Draws::new(seed))
}

fn same(a: &Acquired, b: &Acquired) -> Result<(), TestCaseError> {
    prop_assert_eq!(&a.rests, &b.rests);
    prop_assert_eq!(&a.turns, &b.turns);
    prop_assert_eq!(&a.noise, &b.noise);
    prop_assert_eq!(&a.rejected, &b.rejected);
    prop_assert_eq!(&a.faults, &b.faults);
    prop_assert_eq!(a.trace.points(), b.trace.points());
    prop_assert_eq!(
        (a.origin, a.samples, a.not_finite, a.temperature),
        (b.origin, b.samples, b.not_finite, b.temperature)
    );
    Ok(())
}

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn chunks_of_any_size_give_the_same(seed in any::<u64>(), sizes in prop::collection::vec(1..2000_usize, 1..20)) {
        let whole = recording(seed);
        let temperature: Vec<f64> = (0..whole.time.len()).map(|k| 20.0 + 1e-3 * k as f64).collect();
        let mut at_once = Acquisition::new(SegmenterSettings::default());
        at_once.push(&whole.time, &whole.force, &whole.rate, Some(&temperature));
        let mut in_chunks = Acquisition::new(SegmenterSettings::default());
        let mut start = 0;
        for size in sizes.iter().cycle() {
            let part = start..(start + size).min(whole.time.len());
            in_chunks.push(&whole.time[part.clone()], &whole.force[part.clone()], &whole.rate[part.clone()], Some(&temperature[part.clone()]));
            start = part.end;
            if start == whole.time.len() {
                break;
            }
        }
        same(&at_once.finish(), &in_chunks.finish())?;
    }

    #[test]
    fn samples_not_a_number_are_counted_and_change_nothing(seed in any::<u64>(), places in prop::collection::vec((any::<prop::sample::Index>(), 0..7_usize), 1..20)) {
        let good = recording(seed);
        let mut bad = good.clone();
        for (place, channel) in &places {
            let at = place.index(bad.time.len());
            bad.time.insert(at, bad.time[at]);
            bad.force.insert(at, bad.force[at]);
            bad.rate.insert(at, bad.rate[at]);
            let value = if at % 2 == 0 { f64::NAN } else { f64::INFINITY };
            match channel {
                0..3 => bad.force[at][*channel] = value,
                3..6 => bad.rate[at][channel - 3] = value,
                _ => bad.time[at] = f64::NAN,
            }
        }
        let (good, bad) = (good.acquire(), bad.acquire());
        prop_assert_eq!(bad.not_finite as usize, places.len());
        prop_assert_eq!(bad.samples, good.samples);
        prop_assert_eq!(&bad.rests, &good.rests);
        prop_assert_eq!(&bad.turns, &good.turns);
    }

    #[test]
    fn a_clock_that_counts_from_1970_gives_the_same_rests(seed in any::<u64>(), origin in 0.0..2e9_f64) {
        let here = recording(seed).acquire();
        let there = recording(seed).on_clock(origin, 0.0, 0).acquire();
        prop_assert_eq!(here.rests.len(), there.rests.len());
        prop_assert_eq!(there.origin, origin);
        for (a, b) in here.rests.iter().zip(&there.rests) {
            // Doubles of 2e9 s are a quarter of a microsecond apart.
            prop_assert!(a.start.abs_diff(b.start) <= 1 && a.end.abs_diff(b.end) <= 1);
            prop_assert!((a.specific_force() - b.specific_force()).amax() < 1e-12);
        }
    }
}

#[test]
fn turn_i_lies_between_rest_i_and_the_next() {
    let found = recording(1).acquire();
    assert_eq!((found.rests.len(), found.turns.len()), (7, 6));
    for (turn, rests) in found.turns.iter().zip(found.rests.windows(2)) {
        assert_eq!((turn.start, turn.end), (rests[0].end, rests[1].start));
        assert!(turn.complete);
        let moved = turn.start_from_end * rests[1].specific_force();
        assert!(moved.angle(&rests[0].specific_force()) < 2e-3);
    }
    let session = found.session();
    assert_eq!(session.start, seconds(found.rests[0].start));
    assert_eq!(session.end, seconds(found.rests[6].end));
    assert!(found.faults.is_empty() && found.rejected.is_empty());
}

#[test]
fn motion_before_the_first_and_after_the_last_rest_is_no_turn() {
    let mut schedule = vec![Phase::Turn(Vector3::y() * -0.8, 2.0)];
    schedule.extend(six_faces(2.0));
    schedule.push(Phase::Turn(Vector3::x(), 2.0));
    let found = Recording::of(&schedule, &Unit::noisy(0.02, 0.002), &mut Draws::new(2)).acquire();
    assert_eq!((found.rests.len(), found.turns.len()), (7, 6));
}

#[test]
fn all_between_two_rests_is_turns_and_rests_together() {
    let found = recording(3).acquire();
    let span = found.between(1, 4).expect("rests");
    assert_eq!((span.start, span.end), (found.rests[1].end, found.rests[4].start));
    let parts = [
        &found.turns[1],
        &found.rests[2],
        &found.turns[2],
        &found.rests[3],
        &found.turns[3],
    ];
    let angle: Vector3<f64> = parts.iter().map(|part| part.angle()).sum();
    assert!((span.angle() - angle).amax() < 1e-12);
    assert_eq!(found.between(2, 3), Some(found.turns[2]));
    assert_eq!(found.between(5, 7), None);
    let joined = found.joined(2, 4).expect("rests");
    let samples: u32 = found.rests[2..5].iter().map(|rest| rest.moments.samples()).sum();
    assert_eq!(joined.moments.samples(), samples);
    assert_eq!(
        (joined.start, joined.end),
        (found.rests[2].start, found.rests[4].end)
    );
    assert_eq!(found.joined(5, 7), None);
}

#[test]
fn one_file_a_pose_keeps_its_rests_apart_without_turns() {
    let whole = six_faces(3.0);
    let mut acquisition = Acquisition::new(SegmenterSettings::default());
    let mut draws = Draws::new(4);
    let mut schedule = Vec::new();
    for (k, part) in whole.chunks(2).enumerate() {
        // Each file has a clock of its own, begins in the rest, and ends in the middle of a turn.
        schedule.extend_from_slice(part);
        let all = Recording::of(&schedule, &Unit::noisy(0.02, 0.002), &mut draws);
        let from = all.time.len() - (part.iter().map(Phase::duration).sum::<f64>() * 200.0).round() as usize;
        acquisition.begin_part(&format!("{k}.csv"));
        all.on_clock(1e5, 0.0, from).push_to(&mut acquisition);
    }
    let found = acquisition.finish();
    assert_eq!(
        (found.rests.len(), found.parts.len(), found.turns.len()),
        (7, 7, 6)
    );
    assert!(found.turns.iter().all(|turn| !turn.complete));
    for (k, rest) in found.rests.iter().enumerate() {
        let when = interval(rest);
        assert_eq!(found.parts[k].name, format!("{k}.csv"));
        assert!(when.start >= found.parts[k].start);
        assert!(found.parts.get(k + 1).is_none_or(|next| when.end <= next.start));
        assert!((when.duration() - 3.0).abs() < 0.3);
    }
    for (turn, rests) in found.turns.iter().zip(found.rests.windows(2)) {
        assert!(turn.start <= rests[1].start && turn.end <= rests[1].start && turn.start >= rests[0].end);
    }
}

#[test]
fn a_turn_in_which_a_gyroscope_saturated_is_not_complete() {
    // Half turns go faster than quarter turns: only they reach 2.6 rad/s.
    let clip = |w: Vector3<f64>| w.map(|value| value.clamp(-2.6, 2.6));
    let whole = recording(5).acquire();
    let found = recording(5).change(|f| f, clip).acquire();
    assert_eq!(found.faults.len(), 1, "{:?}", found.faults);
    assert_eq!(
        (found.faults[0].channel, found.faults[0].kind),
        (5, ChannelFaultKind::SaturatedInMotion)
    );
    assert!((found.faults[0].value - 2.6).abs() < 1e-12);
    for (k, turn) in found.turns.iter().enumerate() {
        let fastest = whole.turns[k].angle().norm();
        assert_eq!(turn.complete, fastest < 2.0, "turn {k} through {fastest} rad");
    }
}

#[test]
fn temperature_has_extremes_and_a_mean_and_may_lack_values() {
    let recording = recording(6);
    let n = recording.time.len();
    let mut temperature = vec![f64::NAN; n];
    temperature[10] = 20.0;
    temperature[20] = 30.0;
    temperature[30] = 22.0;
    let mut acquisition = Acquisition::new(SegmenterSettings::default());
    acquisition.push(
        &recording.time,
        &recording.force,
        &recording.rate,
        Some(&temperature),
    );
    assert_eq!(acquisition.finish().temperature, Some([20.0, 24.0, 30.0]));
    assert_eq!(recording.acquire().temperature, None);
}

#[test]
fn a_time_that_goes_back_is_reported_once_and_skipped() {
    let mut recording = recording(7);
    let good = recording.acquire();
    recording.time[500] = recording.time[400];
    recording.time[600] = recording.time[599];
    let found = recording.acquire();
    assert_eq!(found.first_backwards, Some(recording.time[400]));
    assert_eq!(found.samples + 2, good.samples);
    assert_eq!(good.first_backwards, None);
}

#[test]
fn white_noise_is_told_from_the_rests() {
    let found = Recording::of(&six_faces(20.0), &Unit::noisy(0.02, 0.002), &mut Draws::new(8)).acquire();
    for (channel, noise) in found.noise.iter().enumerate() {
        let expected = if channel < 3 { 0.02_f64 } else { 0.002 } / 200.0_f64.sqrt();
        // Some 2700 blocks: N is good to two percent, and to ten at five sigma.
        assert!(
            (noise.white.sqrt() / expected - 1.0).abs() < 0.1,
            "{channel}: {noise:?}"
        );
    }
}

#[test]
fn a_recording_that_begins_without_a_time_counts_from_the_first() {
    let good = recording(9);
    let mut late = good.clone();
    late.time[..300].fill(f64::NAN);
    let found = late.acquire();
    assert_eq!((found.origin, found.not_finite), (good.time[300], 300));
    let mut acquisition = Acquisition::new(SegmenterSettings::default());
    acquisition.push(&[f64::NAN; 5], &[[0.0; 3]; 5], &[[0.0; 3]; 5], None);
    acquisition.begin_part("second.csv");
    good.push_to(&mut acquisition);
    let found = acquisition.finish();
    assert_eq!((found.rests.len(), found.not_finite), (7, 5));
}

#[test]
fn nothing_recorded_is_nothing_acquired() {
    let found = Acquisition::new(SegmenterSettings::default()).finish();
    assert!(found.rests.is_empty() && found.turns.is_empty() && found.faults.is_empty());
    assert_eq!(
        (found.samples, found.not_finite, found.first_backwards),
        (0, 0, None)
    );
    let found = Recording::default().acquire();
    assert!(found.rests.is_empty() && found.parts.is_empty());
}

#[test]
fn a_turn_in_which_an_accelerometer_saturated_is_complete() {
    let mut clipped = recording(5);
    let moving = |k: &usize| Vector3::from(clipped.rate[*k]).norm() > 0.5;
    let in_turns: Vec<_> = (0..clipped.time.len()).filter(moving).step_by(40).collect();
    for &k in &in_turns {
        clipped.force[k][1] = if k % 2 == 0 { 19.6 } else { -19.6 };
    }
    let found = clipped.acquire();
    assert!(found.turns.iter().all(|turn| turn.complete));
    let [fault] = &found.faults[..] else {
        panic!("{:?}", found.faults)
    };
    assert_eq!(
        (fault.channel, fault.kind),
        (1, ChannelFaultKind::SaturatedInMotion)
    );
    assert_eq!(fault.samples as usize, in_turns.len());
}
