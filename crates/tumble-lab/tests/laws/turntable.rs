//! The turntable procedure on whole recordings.

use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use tumble_core::gravity::STANDARD;
use tumble_core::model::ErrorModel;
use tumble_core::turntable::truth::TruthSource;
use tumble_lab::acquisition::Acquired;
use tumble_lab::turntable::{
    Clocks, GSensitivity, PairingError, Reference, ResidualLabel, Target, TriadCalibration, Triads,
    TurntableError, TurntableSettings, calibrate, fit_reference,
};

use super::common::{Draws, cases, rotation};
use super::stream::{Phase, Unit};
use super::unit::{Recording, on_the_grid, poor_model, six_faces};

const SETTINGS: TurntableSettings = TurntableSettings {
    gravity: STANDARD,
    gravity_sigma: 0.0,
    latitude: None,
    truth: TruthSource::Reference,
    clocks: Clocks::Shared,
    g_sensitivity: GSensitivity::Never,
};

const BOTH: Triads = Triads {
    accelerometer: true,
    gyroscope: true,
};

fn accelerometer(target: &Target) -> &TriadCalibration {
    target.accelerometer.as_ref().expect("asked for")
}

fn gyroscope(target: &Target) -> &TriadCalibration {
    target.gyroscope.as_ref().expect("asked for")
}

/// Six faces, quarter turns about every axis both ways.
fn schedule() -> Vec<Phase> {
    let mut schedule = six_faces(3.0);
    for turn in [
        -Vector3::x(),
        Vector3::y(),
        Vector3::z(),
        -Vector3::y(),
        -Vector3::z(),
    ] {
        schedule.extend([Phase::Turn(turn * 1.3, 1.5), Phase::Rest(3.0)]);
    }
    on_the_grid(schedule)
}

fn session(
    unit: &Unit,
    reference: &Unit,
    force: &ErrorModel<f64>,
    rate: &ErrorModel<f64>,
    seed: u64,
) -> (Acquired, Acquired) {
    let mut draws = Draws::new(seed);
    let seen = Recording::of(&schedule(), reference, &mut draws).acquire();
    let felt = Recording::of(&schedule(), unit, &mut draws);
    (
        seen,
        felt.change(|f| force.measure(&f), |w| rate.measure(&w)).acquire(),
    )
}

fn calibrated(
    seen: &Acquired,
    felt: &Acquired,
    settings: &TurntableSettings,
) -> Result<(Reference, Target), TurntableError> {
    let ups = vec![None; seen.rests.len()];
    let reference = fit_reference(seen, &ups, settings, true)?;
    let target = calibrate(seen, &reference, felt, &ups, settings, BOTH)?;
    Ok((reference, target))
}

/// Largest error in sigma, and in absolute terms.
fn misses(triad: &TriadCalibration, truth: &ErrorModel<f64>) -> (f64, f64) {
    let errors = (0..12).map(|i| {
        let error = if i < 9 {
            triad.model.matrix[(i / 3, i % 3)] - truth.matrix[(i / 3, i % 3)]
        } else {
            triad.model.bias[i - 9] - truth.bias[i - 9]
        };
        (error.abs() / triad.covariance[(i, i)].sqrt(), error.abs())
    });
    errors.fold((0.0, 0.0), |most, miss| {
        (f64::max(most.0, miss.0), f64::max(most.1, miss.1))
    })
}

/// Readings in steps, as a coarse converter or a log of few digits has them.
fn in_steps(step: f64) -> impl Fn(Vector3<f64>) -> Vector3<f64> {
    move |y| y.map(|y| step * (y / step).round())
}

proptest! {
    #![proptest_config(cases(8))]

    #[test]
    fn a_target_whose_steps_exceed_its_noise_is_within_its_sigmas(steps in 1.5..8.0_f64, seed in any::<u64>()) {
        let (force, rate) = (poor_model(0.3), poor_model(0.02));
        let (noise, still) = ((0.02, 0.002), Unit::perfect());
        let mut draws = Draws::new(seed);
        let seen = Recording::of(&schedule(), &Unit::noisy(0.003, 1e-4), &mut draws).acquire();
        let felt = Recording::of(&schedule(), &Unit { scatter: noise, ..still }, &mut draws)
            .change(|f| force.measure(&f), |w| rate.measure(&w))
            .change(in_steps(steps * noise.0), in_steps(steps * noise.1))
            .acquire();
        prop_assume!(felt.rests.len() == seen.rests.len());
        let (_, target) = calibrated(&seen, &felt, &SETTINGS).expect("a good session");
        for (triad, truth) in [(accelerometer(&target), &force), (gyroscope(&target), &rate)] {
            let (sigmas, _) = misses(triad, truth);
            prop_assert!(sigmas < 5.0, "{} sigmas: {:?}", sigmas, triad.model);
        }
        // Noise of 0.47 steps makes rounding average out.
        prop_assert!(steps < 2.2 || !felt.coarse_channels().is_empty());
    }

    #[test]
    fn a_gyroscope_with_a_dead_band_is_within_its_sigmas(band in 0.003..0.015_f64, seed in any::<u64>()) {
        let rate = poor_model(0.004);
        let mut draws = Draws::new(seed);
        let seen = Recording::of(&schedule(), &Unit::noisy(0.003, 1e-4), &mut draws).acquire();
        let deadened = |w: Vector3<f64>| w.map(|w| if w.abs() < band { 0.0 } else { w });
        let felt = Recording::of(&schedule(), &Unit::noisy(0.02, 0.001), &mut draws)
            .change(|f| f, |w| rate.measure(&w))
            .change(|f| f, deadened)
            .acquire();
        let found = calibrated(&seen, &felt, &SETTINGS);
        // A refusal states no number.
        prop_assume!(found.is_ok());
        let (_, target) = found.expect("assumed");
        let (sigmas, _) = misses(gyroscope(&target), &rate);
        prop_assert!(sigmas < 5.0, "{} sigmas: {:?}", sigmas, gyroscope(&target).model);
        prop_assert!(felt.coarse_channels().iter().all(|each| each.channel >= 3 && each.dead_band > 0.0));
    }

    #[test]
    fn a_target_in_a_fixture_that_flexes_is_within_its_sigmas(degrees in 0.01..0.1_f64, seed in any::<u64>()) {
        let (force, rate) = (poor_model(0.3), poor_model(0.02));
        let mut draws = Draws::new(seed);
        let give = Matrix3::from_fn(|_, _| degrees.to_radians() / STANDARD * draws.normal());
        let seen = Recording::of(&schedule(), &Unit::noisy(0.003, 1e-4), &mut draws).acquire();
        let felt = Recording::of(&schedule(), &Unit::noisy(0.0, 0.0), &mut draws).flexed(&give);
        let noisy = Recording::of(&schedule(), &Unit::noisy(0.02, 0.002), &mut draws);
        let plain = Recording::of(&schedule(), &Unit::perfect(), &mut draws);
        let felt = felt
            .change(|f| force.measure(&f), |w| rate.measure(&w))
            .plus(&noisy, &plain)
            .acquire();
        let (_, target) = calibrated(&seen, &felt, &SETTINGS).expect("a good session");
        for (triad, truth) in [(accelerometer(&target), &force), (gyroscope(&target), &rate)] {
            let (sigmas, _) = misses(triad, truth);
            prop_assert!(sigmas < 8.0, "{} sigmas: {:?}", sigmas, triad.model);
        }
    }

    #[test]
    fn residuals_of_noise_do_not_go_with_direction(seed in any::<u64>()) {
        let (force, rate) = (poor_model(0.3), poor_model(0.02));
        let (seen, felt) = session(&Unit::noisy(0.02, 0.002), &Unit::noisy(0.003, 1e-4), &force, &rate, seed);
        let (_, target) = calibrated(&seen, &felt, &SETTINGS).expect("a good session");
        prop_assert_eq!(accelerometer(&target).by_direction, 0.0);
    }
}

proptest! {
    #![proptest_config(cases(12))]

    #[test]
    fn a_target_mounted_in_any_way_is_calibrated_within_its_sigmas(mounting in rotation(), seed in any::<u64>()) {
        let turned = |bias: f64| {
            let model = poor_model(bias);
            ErrorModel { matrix: model.matrix * mounting.matrix(), ..model }
        };
        let (force, rate) = (turned(0.3), turned(0.02));
        let (seen, felt) = session(&Unit::noisy(0.02, 0.002), &Unit::noisy(0.003, 1e-4), &force, &rate, seed);
        let (_, target) = calibrated(&seen, &felt, &SETTINGS).expect("a good session");
        for (triad, truth, noise) in [(accelerometer(&target), &force, 0.02), (gyroscope(&target), &rate, 0.002)] {
            let (sigmas, most) = misses(triad, truth);
            prop_assert!(sigmas < 5.5, "{} sigma", sigmas);
            // A dozen rests of 600 samples each: a mean errs by a twenty-fourth of the scatter of a sample.
            prop_assert!(most < noise / 3.0, "{}", most);
            prop_assert_eq!(triad.observed, [true; 12]);
            prop_assert_eq!(triad.widened, 1.0);
            let freedom = f64::from(triad.degrees_of_freedom);
            prop_assert!((triad.chi_square - freedom).abs() < 6.0 * (2.0 * freedom).sqrt(), "{} {}", triad.chi_square, freedom);
        }
        let rests = gyroscope(&target).labels.iter().filter(|label| matches!(label, ResidualLabel::Rest(_))).count();
        prop_assert_eq!((rests, gyroscope(&target).labels.len()), (12, 23));
    }

    #[test]
    fn another_clock_costs_nothing(offset in -100.0..100.0_f64, skew in -1e-4..1e-4_f64, seed in any::<u64>()) {
        let (force, rate) = (poor_model(0.3), poor_model(0.02));
        let mut draws = Draws::new(seed);
        let seen = Recording::of(&schedule(), &Unit::noisy(0.003, 1e-4), &mut draws).acquire();
        let felt = Recording::of(&schedule(), &Unit::noisy(0.02, 0.002), &mut draws)
            .change(|f| force.measure(&f), |w| rate.measure(&w))
            .on_clock(offset, skew, 0)
            .acquire();
        let apart = TurntableSettings { clocks: Clocks::Apart, ..SETTINGS };
        let (_, target) = calibrated(&seen, &felt, &apart).expect("a good session");
        prop_assert!(misses(accelerometer(&target), &force).0 < 5.5);
        // A second of the target's clock is not one of the reference's: the gyroscope has the skew as scale error.
        let (_, most) = misses(gyroscope(&target), &rate);
        prop_assert!(most < 0.002 / 3.0 + 2e-4, "{}", most);
    }
}

#[test]
fn the_three_truths_agree_for_a_perfect_table() {
    let mounting = Rotation3::new(Vector3::new(0.01, -0.015, 0.02));
    let (force, rate) = (poor_model(0.3), poor_model(0.02));
    let mut draws = Draws::new(51);
    // Reference and target are turned on the table alike.
    let on_table = |unit: Unit| Unit { mounting, ..unit };
    let seen = Recording::of(&schedule(), &on_table(Unit::noisy(0.003, 1e-4)), &mut draws).acquire();
    let felt = Recording::of(&schedule(), &on_table(Unit::noisy(0.02, 0.002)), &mut draws)
        .change(|f| force.measure(&f), |w| rate.measure(&w))
        .acquire();
    let ups: Vec<_> = Recording::of(&schedule(), &Unit::perfect(), &mut draws)
        .acquire()
        .rests
        .iter()
        .map(|rest| Some(rest.specific_force().normalize()))
        .collect();
    let with = |truth: TruthSource| {
        let settings = TurntableSettings { truth, ..SETTINGS };
        let reference = fit_reference(&seen, &ups, &settings, true).expect("poses");
        let angle = reference.mounting.expect("poses are known").rotation * mounting.inverse();
        assert!(angle.angle() < 1e-4, "{}", angle.angle());
        let target = calibrate(&seen, &reference, &felt, &ups, &settings, BOTH).expect("a good session");
        misses(accelerometer(&target), &force)
    };
    for truth in [TruthSource::Reference, TruthSource::RotateTruth] {
        let (sigmas, most) = with(truth);
        assert!(sigmas < 5.0 && most < 0.006, "{truth:?}: {sigmas} sigma, {most}");
    }
    // The published compensation turns the bias of 0.3 m/s^2 with the reading, by 27 mrad: 5 to 8 mm/s^2.
    let (_, most) = with(TruthSource::RotateMeasurement);
    assert!((0.004..0.02).contains(&most), "{most}");
    // Without compensation M takes up the mounting.
    let (_, most) = with(TruthSource::Ideal);
    assert!((0.015..0.03).contains(&most), "{most}");
}

#[test]
fn without_turns_only_the_gyroscopes_bias_is_observed() {
    let (force, rate) = (poor_model(0.3), poor_model(0.02));
    let (seen, mut felt) = session(
        &Unit::noisy(0.02, 0.002),
        &Unit::noisy(0.003, 1e-4),
        &force,
        &rate,
        52,
    );
    felt.turns.iter_mut().for_each(|turn| turn.complete = false);
    let (_, target) = calibrated(&seen, &felt, &SETTINGS).expect("rests enough");
    let observed = gyroscope(&target).observed;
    assert_eq!(observed[..9], [false; 9]);
    assert_eq!(observed[9..], [true; 3]);
    assert!((gyroscope(&target).model.bias - rate.bias).amax() < 5e-4);
}

#[test]
fn too_few_rests_and_too_few_directions_are_told_apart() {
    let few = on_the_grid(vec![
        Phase::Rest(3.0),
        Phase::Turn(Vector3::x(), 1.0),
        Phase::Rest(3.0),
    ]);
    let flat: Vec<Phase> = (0..6)
        .flat_map(|_| [Phase::Rest(3.0), Phase::Turn(Vector3::z() * 1.3, 1.0)])
        .collect();
    let acquired = |schedule: &[Phase]| {
        Recording::of(schedule, &Unit::noisy(0.003, 1e-4), &mut Draws::new(53)).acquire()
    };
    let seen = acquired(&few);
    assert_eq!(
        fit_reference(&seen, &[None; 2], &SETTINGS, true).err(),
        Some(TurntableError::TooFewRests { found: 2, needed: 4 })
    );
    let seen = acquired(&flat);
    assert_eq!(
        fit_reference(&seen, &[None; 6], &SETTINGS, true).err(),
        Some(TurntableError::DirectionsTooAlike)
    );
}

#[test]
fn a_truth_that_needs_poses_says_so_where_there_are_none() {
    let (seen, felt) = session(
        &Unit::noisy(0.02, 0.002),
        &Unit::noisy(0.003, 1e-4),
        &poor_model(0.3),
        &poor_model(0.02),
        54,
    );
    let settings = TurntableSettings {
        truth: TruthSource::RotateTruth,
        ..SETTINGS
    };
    assert_eq!(
        calibrated(&seen, &felt, &settings).err(),
        Some(TurntableError::NeedsPoses)
    );
}

#[test]
fn left_handed_axes_are_reported_for_each_sensor() {
    let (good, mirrored) = (poor_model(0.02), {
        let mut model = poor_model(0.02);
        model.matrix.row_mut(1).neg_mut();
        model
    });
    let calm = (Unit::noisy(0.02, 0.002), Unit::noisy(0.003, 1e-4));
    let (seen, felt) = session(&calm.0, &calm.1, &mirrored, &good, 55);
    assert_eq!(
        calibrated(&seen, &felt, &SETTINGS).err(),
        Some(TurntableError::LeftHanded)
    );
    let (seen, felt) = session(&calm.0, &calm.1, &good, &mirrored, 56);
    assert_eq!(
        calibrated(&seen, &felt, &SETTINGS).err(),
        Some(TurntableError::LeftHandedGyroscope)
    );
}

#[test]
fn a_target_on_another_clock_than_stated_shows_its_offset() {
    let calm = (Unit::noisy(0.02, 0.002), Unit::noisy(0.003, 1e-4));
    let (seen, _) = session(&calm.0, &calm.1, &poor_model(0.3), &poor_model(0.02), 57);
    let mut draws = Draws::new(58);
    let later = Recording::of(&schedule(), &calm.0, &mut draws)
        .on_clock(1e4, 0.0, 0)
        .acquire();
    match calibrated(&seen, &later, &SETTINGS).err() {
        Some(TurntableError::Pairing(PairingError::ClocksApart { offset })) => {
            assert!((offset - 1e4).abs() < 1e-2, "{offset}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn one_triad_alone_is_calibrated_as_it_is_beside_the_other() {
    let (force, rate) = (poor_model(0.3), poor_model(0.02));
    let (seen, felt) = session(
        &Unit::noisy(0.02, 0.002),
        &Unit::noisy(0.003, 1e-4),
        &force,
        &rate,
        22,
    );
    let ups = vec![None; seen.rests.len()];
    let reference = fit_reference(&seen, &ups, &SETTINGS, true).expect("poses");
    let with = |triads| calibrate(&seen, &reference, &felt, &ups, &SETTINGS, triads).expect("a good session");
    let both = with(BOTH);
    let forces = with(Triads {
        gyroscope: false,
        ..BOTH
    });
    let rates = with(Triads {
        accelerometer: false,
        ..BOTH
    });
    assert!(forces.gyroscope.is_none() && rates.accelerometer.is_none());
    assert_eq!(accelerometer(&forces).model, accelerometer(&both).model);
    let ((alone, _), (beside, _)) = (misses(gyroscope(&rates), &rate), misses(gyroscope(&both), &rate));
    assert!((alone - beside).abs() < 0.1, "{alone} and {beside} sigma");
}
