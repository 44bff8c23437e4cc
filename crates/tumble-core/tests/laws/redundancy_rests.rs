//! Contribution of rests to a fit in motion, and the errors that they must not hide.

use tumble_core::real::Real;
use tumble_core::redundancy::fit::adoption::{AdoptionRefusal, RefusalReason};
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::RedundancySettings;

use crate::common::Draws;
use crate::redundancy_mission::{Flight, Mission, Part, Phase, assert_told, fly, platform, settings, units};

const SEED: u64 = 31;

fn with_rests<T: Real>(fit_rests: bool) -> RedundancySettings<T> {
    let mut settings = settings();
    settings.fit.fit_rests = fit_rests;
    settings
}

/// The accelerometer record of a secondary that is shaken in motion, and rests twice between.
fn shaken(seed: u64, fit_rests: bool) -> Record<f64> {
    let parts = [Part::exact(), Part::aged()];
    let turn = [(6.0, Phase::Free(1.0)), (3.0, Phase::Rest)];
    let phases = [&[(2.5, Phase::Rest)], &turn[..], &turn[..], &turn[..]].concat();
    let still = [2.5, 8.5, 11.5, 17.5, 20.5, 26.5, 29.5];
    let draws = core::cell::RefCell::new(Draws::new(seed ^ 0xface));
    let mission = Mission::new(seed, &parts)
        .phases(&phases)
        .spoilt(move |unit, time, sample| {
            let begun = still.iter().filter(|edge| time >= **edge).count();
            if unit == 1 && begun % 2 == 1 {
                sample.specific_force += draws.borrow_mut().normals::<3>() * 0.8;
            }
            true
        });
    let mut settings = with_rests(fit_rests);
    settings.collection.collect = 14_000_000;
    let flight = fly::<f64, 2>(&platform(settings, units(&parts)), &mission);
    let adopted = flight.adopted(1, Sensor::Accelerometer);
    assert_eq!(adopted.len(), 1, "{}", flight.story());
    adopted[0]
}

#[test]
fn rests_between_shaken_motions_make_the_bias_more_accurate() {
    let truth = Part::aged().errors[0];
    let off = |record: &Record<f64>| {
        // Only its readings at rest matter.
        let u = nalgebra::Vector3::z() * tumble_core::gravity::STANDARD;
        (record.model.measure(&u) - truth.measure(&u)).norm()
    };
    let (mut with, mut without) = (0.0, 0.0);
    for seed in SEED..SEED + 6 {
        let (rests, motion) = (shaken(seed, true), shaken(seed, false));
        with += off(&rests);
        without += off(&motion);
        for axis in 0..3 {
            let z = (rests.model.bias[axis] - truth.bias[axis]) / rests.bias_sigma[axis];
            assert!(z.abs() < 5.0, "seed {seed}, axis {axis}: {z}");
        }
    }
    println!("with rests {with}, without {without}");
    assert!(with < 0.5 * without, "{with} with rests, {without} without");
}

fn steps_with_the_first_motion<T: Real>() {
    let parts = [Part::exact(), Part::aged()];
    let mission = Mission::new(SEED, &parts).spoilt(|unit, time, sample| {
        if unit == 0 && time > 2.6 {
            sample.specific_force.y += 0.4;
        }
        true
    });
    let flight: Flight<T, 2> = fly(&platform(with_rests(true), units(&parts)), &mission);
    assert_told!(
        flight,
        1,
        EventKind::Refused {
            sensor: Sensor::Accelerometer,
            why: AdoptionRefusal::Exceeds(RefusalReason::DisagreesWithRest, _)
        }
    );
    assert!(
        flight.adopted(1, Sensor::Accelerometer).is_empty(),
        "{}",
        flight.story()
    );
}

#[test]
fn a_rest_in_the_fit_does_not_hide_a_later_step_of_the_primary() {
    steps_with_the_first_motion::<f32>();
    steps_with_the_first_motion::<f64>();
}
