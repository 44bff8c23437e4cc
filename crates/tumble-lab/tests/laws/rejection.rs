//! Apparent rests that the whole recording refutes.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_lab::acquisition::{Acquired, RestRejection, interval};

use super::common::{Draws, cases, direction};
use super::stream::{Phase, Unit};
use super::unit::{Recording, on_the_grid, six_faces};

fn acquired(schedule: Vec<Phase>, unit: &Unit, seed: u64) -> Acquired {
    Recording::of(&on_the_grid(schedule), unit, &mut Draws::new(seed)).acquire()
}

/// Six faces, then this, then two faces more.
fn in_the_middle(what: Vec<Phase>) -> Vec<Phase> {
    let mut schedule = six_faces(3.0);
    schedule.push(Phase::Turn(Vector3::x(), 1.0));
    schedule.extend(what);
    schedule.extend([
        Phase::Turn(-Vector3::x(), 1.0),
        Phase::Rest(3.0),
        Phase::Turn(Vector3::y(), 1.0),
        Phase::Rest(3.0),
    ]);
    schedule
}

/// Rests and turns still follow each other without a hole.
fn fits_together(found: &Acquired) -> Result<(), TestCaseError> {
    prop_assert_eq!(found.turns.len() + 1, found.rests.len());
    for (turn, rests) in found.turns.iter().zip(found.rests.windows(2)) {
        prop_assert_eq!((turn.start, turn.end), (rests[0].end, rests[1].start));
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases(16))]

    #[test]
    fn a_turn_too_slow_for_the_segmenter_is_refused_by_gravity(
        rate in 0.0026..0.0035_f64, axis in direction(), bias in -0.2..0.2_f64, seed in any::<u64>()
    ) {
        // A drift of six sigma is refused, and noise may hide four: even in the shortest rest, a second, gravity must drift
        // by more than ten sigma of a slope through 200 samples, 0.025 m/s^3. Faster turns the segmenter sees by itself.
        let schedule = in_the_middle(vec![Phase::Spin(axis * rate, 8.0)]);
        let unit = Unit { bias: (Vector3::zeros(), Vector3::repeat(bias)), ..Unit::noisy(0.01, 0.001) };
        let found = acquired(schedule, &unit, seed);
        let up = found.rests[6].specific_force();
        let up = nalgebra::UnitQuaternion::from_scaled_axis(-Vector3::x()) * up;
        prop_assume!(axis.cross(&up.normalize()).norm() * rate > 0.0026);
        fits_together(&found)?;
        prop_assert_eq!(found.rests.len(), 9);
        prop_assert!(found.rejected.iter().all(|(_, why)| *why == RestRejection::Drifting), "{:?}", found.rejected);
        prop_assert!(!found.rejected.is_empty());
    }

    #[test]
    fn a_slow_turn_about_the_vertical_is_refused_by_its_rate(
        rate in 0.02..0.3_f64, sign in prop::bool::ANY, bias in -0.2..0.2_f64, seed in any::<u64>()
    ) {
        let rate = if sign { rate } else { -rate };
        // Three faces with z up at the third, then a spin about z.
        let (x, z) = (Vector3::x(), Vector3::z());
        let schedule = vec![
            Phase::Rest(3.0), Phase::Turn(x, 1.0), Phase::Rest(3.0), Phase::Turn(-x, 1.0), Phase::Rest(3.0),
            Phase::Spin(z * rate, 6.0), Phase::Rest(3.0), Phase::Turn(x, 1.0), Phase::Rest(3.0),
        ];
        let unit = Unit { bias: (Vector3::zeros(), Vector3::repeat(bias)), ..Unit::noisy(0.01, 0.001) };
        let found = acquired(schedule, &unit, seed);
        fits_together(&found)?;
        prop_assert_eq!(found.rests.len(), 5, "{:?}", found.rests.iter().map(interval).collect::<Vec<_>>());
        prop_assert_eq!(found.rejected.iter().map(|(_, why)| *why).collect::<Vec<_>>(), vec![RestRejection::Turning]);
    }

    #[test]
    fn vibration_at_the_start_is_refused_once_quiet_was_seen(times_noise in 6.0..50.0_f64, seed in any::<u64>()) {
        let mut schedule = vec![Phase::Shake(times_noise * 0.01, 4.0), Phase::Turn(Vector3::x() * -0.5, 1.0)];
        schedule.extend(six_faces(3.0));
        let found = acquired(schedule, &Unit::noisy(0.01, 0.001), seed);
        fits_together(&found)?;
        prop_assert_eq!(found.rests.len(), 7, "{:?}", found.rejected);
        prop_assert!(found.rests.iter().all(|rest| interval(rest).start > 3.8));
        prop_assert!(found.rejected.iter().all(|(_, why)| *why == RestRejection::Vibrating));
    }

    #[test]
    fn nothing_of_a_good_recording_is_refused(scale in -2.0..0.5_f64, seed in any::<u64>(), bias in -0.3..0.3_f64) {
        let scale = 10_f64.powf(scale);
        let unit = Unit { bias: (Vector3::repeat(bias), Vector3::repeat(bias)), ..Unit::noisy(0.02 * scale, 0.002 * scale) };
        let found = acquired(six_faces(3.0), &unit, seed);
        fits_together(&found)?;
        prop_assert_eq!((found.rests.len(), found.rejected.len()), (7, 0), "{:?}", found.rejected);
    }
}

#[test]
fn a_refused_rest_becomes_part_of_its_turn_with_its_angle() {
    let slow = Vector3::y() * 0.003;
    let found = acquired(
        in_the_middle(vec![Phase::Spin(slow, 8.0)]),
        &Unit::noisy(0.01, 0.001),
        21,
    );
    assert!(!found.rejected.is_empty());
    // The turn after rest 6 goes out by x, slowly about y, and back.
    let turn = &found.turns[6];
    assert!((turn.angle() - slow * 8.0).amax() < 5e-3, "{:?}", turn.angle());
}
