//! Which rests of the target belong to which of the reference.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_lab::acquisition::Acquired;
use tumble_lab::turntable::pairing::pair;
use tumble_lab::turntable::{Clocks, PairingError};

use super::common::{Draws, cases, direction};
use super::stream::{Phase, Unit};
use super::unit::{Recording, on_the_grid, poor_model, six_faces};

fn reference(schedule: &[Phase], draws: &mut Draws) -> Acquired {
    Recording::of(schedule, &Unit::noisy(0.005, 0.0002), draws).acquire()
}

fn target(schedule: &[Phase], draws: &mut Draws) -> Recording {
    let (force, rate) = (poor_model(0.3), poor_model(0.05));
    let recording = Recording::of(schedule, &Unit::noisy(0.03, 0.003), draws);
    recording.change(|f| force.measure(&f), |w| rate.measure(&w))
}

/// Six faces with rests that are not all alike, so that no shift by one turn goes unseen.
fn schedule() -> Vec<Phase> {
    let mut schedule = six_faces(2.0);
    for (k, phase) in schedule.iter_mut().enumerate() {
        if let Phase::Rest(length) = phase {
            *length += 0.3 * (k % 5) as f64;
        }
    }
    on_the_grid(schedule)
}

proptest! {
    #![proptest_config(cases(16))]

    #[test]
    fn one_clock_pairs_every_rest_with_itself(seed in any::<u64>(), late in 0..120_usize) {
        let mut draws = Draws::new(seed);
        let seen = reference(&schedule(), &mut draws);
        let felt = target(&schedule(), &mut draws).on_clock(0.0, 0.0, late).acquire();
        for clocks in [Clocks::Shared, Clocks::Unknown] {
            let pairing = pair(&seen, &felt, clocks).expect("the same session");
            prop_assert!(pairing.shared && pairing.contradiction.is_none());
            let pairs: Vec<_> = pairing.pairs.iter().map(|pair| (pair.reference, pair.target)).collect();
            prop_assert_eq!(pairs, (0..7).map(|k| (k, (k, k))).collect::<Vec<_>>());
        }
    }

    #[test]
    fn clocks_apart_are_brought_together_by_the_turns(
        seed in any::<u64>(), offset in prop_oneof![-1e3..-5.0_f64, 5.0..1e3_f64], skew in -1e-4..1e-4_f64, late in 0..120_usize
    ) {
        let mut draws = Draws::new(seed);
        let seen = reference(&schedule(), &mut draws);
        let felt = target(&schedule(), &mut draws).on_clock(offset, skew, late).acquire();
        for clocks in [Clocks::Apart, Clocks::Unknown] {
            let pairing = pair(&seen, &felt, clocks).expect("the same turns");
            prop_assert!(!pairing.shared);
            prop_assert_eq!(pairing.pairs.len(), 7);
            // All times count from the first sample of each.
            let (at, sigma) = pairing.clock.offset_at(15.0 - seen.origin);
            let expected = offset + skew * 15.0 - felt.origin + seen.origin;
            prop_assert!((at - expected).abs() < 6.0 * sigma + 1e-5, "{} {} {}", at, expected, sigma);
            prop_assert!(sigma < 2e-3);
        }
    }

    #[test]
    fn shared_clocks_that_turns_contradict_are_reported(seed in any::<u64>(), offset in 0.2..0.9_f64) {
        let mut draws = Draws::new(seed);
        let seen = reference(&schedule(), &mut draws);
        let felt = target(&schedule(), &mut draws).on_clock(offset, 0.0, 0).acquire();
        let pairing = pair(&seen, &felt, Clocks::Shared).expect("rests still overlap");
        prop_assert!(pairing.shared);
        let (found, sigma) = pairing.contradiction.ok_or_else(|| TestCaseError::fail("no contradiction"))?;
        prop_assert!((found - offset).abs() < 6.0 * sigma + 1e-5, "{} {}", found, offset);
    }

    #[test]
    fn a_target_that_moved_while_the_reference_rested_is_found_out(
        axis in direction(), angle in 0.02..0.2_f64, seed in any::<u64>()
    ) {
        // Its own gravity must turn: the axis across the vertical at the third rest, which is -z.
        prop_assume!(axis.cross(&Vector3::z()).norm() > 0.7);
        let mut draws = Draws::new(seed);
        let calm = six_faces(4.0);
        let mut moved = calm.clone();
        // It slips from 1.5 s to 1.7 s into the third rest, and stays as it is: its own turns go on from there.
        moved.splice(4..5, [Phase::Rest(1.5), Phase::Turn(axis * angle, 0.2), Phase::Rest(2.3)]);
        let seen = reference(&calm, &mut draws);
        let felt = target(&moved, &mut draws).acquire();
        let time = calm[..4].iter().map(Phase::duration).sum::<f64>() + 1.6;
        match pair(&seen, &felt, Clocks::Shared) {
            Err(PairingError::MovedDuringRest { rest, time: found, angle: by }) => {
                prop_assert_eq!(rest, 2);
                prop_assert!((found - time).abs() < 0.1, "{} {}", found, time);
                let turned = 2.0 * ((angle / 2.0).sin() * axis.cross(&Vector3::z()).norm()).asin();
                prop_assert!((by.to_radians() / turned - 1.0).abs() < 0.15, "{} {}", by, turned.to_degrees());
            }
            other => return Err(TestCaseError::fail(format!("{other:?}"))),
        }
    }
}

#[test]
fn a_rest_of_the_target_that_broke_without_motion_is_joined() {
    let mut draws = Draws::new(41);
    let calm = six_faces(4.0);
    let mut broken = calm.clone();
    broken.splice(4..5, [Phase::Rest(1.8), Phase::Shake(2.0, 0.3), Phase::Rest(1.9)]);
    let seen = reference(&calm, &mut draws);
    let felt = target(&broken, &mut draws).acquire();
    assert_eq!(felt.rests.len(), 8);
    let pairing = pair(&seen, &felt, Clocks::Shared).expect("no motion");
    let pairs: Vec<_> = pairing.pairs.iter().map(|pair| pair.target).collect();
    assert_eq!(pairs, [(0, 0), (1, 1), (2, 3), (4, 4), (5, 5), (6, 6), (7, 7)]);
    let both = felt.rests[2].moments.samples() + felt.rests[3].moments.samples();
    assert_eq!(pairing.pairs[2].segment.moments.samples(), both);
}

#[test]
fn without_turns_overlapping_clocks_are_taken_for_one() {
    let mut draws = Draws::new(42);
    let rest = [Phase::Rest(5.0)];
    let seen = reference(&rest, &mut draws);
    let here = target(&rest, &mut draws).acquire();
    let later = target(&rest, &mut draws).on_clock(100.0, 0.0, 0).acquire();
    let pairing = pair(&seen, &here, Clocks::Unknown).expect("the same five seconds");
    assert!(pairing.shared && pairing.pairs.len() == 1);
    assert_eq!(
        pair(&seen, &here, Clocks::Apart).err(),
        Some(PairingError::NoCommonTime)
    );
    assert_eq!(
        pair(&seen, &later, Clocks::Unknown).err(),
        Some(PairingError::NoCommonTime)
    );
    assert_eq!(
        pair(&seen, &later, Clocks::Shared).err(),
        Some(PairingError::NoCommonTime)
    );
}

#[test]
fn a_session_of_other_turns_has_no_common_time() {
    let mut draws = Draws::new(43);
    let seen = reference(&six_faces(2.0), &mut draws);
    let mut other = vec![Phase::Rest(2.0)];
    for angle in [0.4, -0.4, 0.5, -0.45] {
        other.extend([Phase::Turn(Vector3::x() * angle, 1.0), Phase::Rest(2.0)]);
    }
    let felt = target(&other, &mut draws).on_clock(500.0, 0.0, 0).acquire();
    assert_eq!(
        pair(&seen, &felt, Clocks::Apart).err(),
        Some(PairingError::NoCommonTime)
    );
}
