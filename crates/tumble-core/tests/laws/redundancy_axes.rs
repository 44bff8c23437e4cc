//! Units of any set of single-axis sensors, the primary too: the errors that are observable, and the output.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tumble_core::model::ErrorModel;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::redundancy::sensor::{Axes, SENSORS, Sensor};
use tumble_core::redundancy::settings::FitModel;

use crate::common::{cases, cast};
use crate::redundancy_mission::{Flight, Mission, Part, Phase, assert_told, fly, platform, settings, units};

/// Any axes but none.
fn axes() -> impl Strategy<Value = Axes> {
    let any = prop::array::uniform6(prop::bool::weighted(0.7));
    any.prop_filter("a unit has an axis", |axes| axes.contains(&true))
        .prop_map(Axes)
}

/// A rotation that leads axes to axes.
fn turn() -> impl Strategy<Value = Matrix3<f64>> {
    (0..3_usize, 0..2_usize, any::<bool>(), any::<bool>()).prop_map(|(first, second, one, other)| {
        let sign = |negative: bool| if negative { -1.0 } else { 1.0 };
        let x = Vector3::ith(first, sign(one));
        let y = Vector3::ith((first + 1 + second) % 3, sign(other));
        Matrix3::from_rows(&[x.transpose(), y.transpose(), x.cross(&y).transpose()])
    })
}

/// A secondary with biases and scale errors, mounted turned.
fn turned(turn: &Matrix3<f64>) -> Part {
    let mut part = Part::aged();
    for model in &mut part.errors {
        let scales = Matrix3::from_diagonal(&model.matrix.diagonal());
        *model = ErrorModel {
            matrix: scales * turn,
            bias: model.bias,
        };
    }
    part.lever_arm = Vector3::zeros();
    part
}

fn flown<T: Real>(primary: Axes, secondary: Axes, turn: &Matrix3<f64>, seed: u64) -> Flight<T, 2> {
    let parts = [Part::exact(), turned(turn)];
    let mut set = units::<T, 2>(&parts);
    set[0].axes = primary;
    set[1].axes = secondary;
    set[1].sensor_from_primary = cast(turn);
    let mission = Mission::new(seed, &parts).spoilt(move |unit, _, sample| {
        // Whatever a driver writes where there is nothing to be read.
        let axes = [primary, secondary][unit];
        for (sensor, triad) in SENSORS
            .into_iter()
            .zip([&mut sample.specific_force, &mut sample.angular_rate])
        {
            *triad = axes.shown(sensor, triad);
        }
        true
    });
    fly(&platform(settings(), set), &mission)
}

/// Tests whether row `i` of a secondary is there, and the axis of the primary that it lies along.
fn is_shown(primary: &Axes, secondary: &Axes, turn: &Matrix3<f64>, sensor: Sensor, i: usize) -> bool {
    secondary.of(sensor)[i] && primary.of(sensor)[turn.row(i).transpose().iamax()]
}

fn shows_what_both_have<T: Real>(
    primary: Axes,
    secondary: Axes,
    turn: &Matrix3<f64>,
    seed: u64,
) -> Result<(), TestCaseError> {
    let flight = flown::<T>(primary, secondary, turn, seed);
    let truth = turned(turn).errors;
    for (sensor, truth) in SENSORS.into_iter().zip(truth) {
        let shown: Vec<bool> = (0..3)
            .map(|i| is_shown(&primary, &secondary, turn, sensor, i))
            .collect();
        let adopted = flight.adopted(1, sensor);
        prop_assert_eq!(
            adopted.len(),
            usize::from(shown.contains(&true)),
            "{}",
            flight.story()
        );
        let Some(record) = adopted.first() else { continue };
        // Waves at random may cancel, and show fewer directions than there are.
        let there = primary.of(sensor).iter().filter(|has| **has).count();
        prop_assume!(record.fit_model == FitModel::Gain || usize::from(record.directions) == there);
        for (i, shown) in shown.into_iter().enumerate() {
            let along = turn.row(i).transpose().iamax();
            let (bias, sigma) = (record.model.bias[i], record.bias_sigma[i]);
            let (scale, scale_sigma) = (record.model.matrix[(i, along)], record.matrix_sigma[(i, along)]);
            if shown {
                let within = |found: T, truth: f64, sigma: T, most: f64| {
                    (found - real(truth)).abs() <= sigma * real(5.0)
                        && (found - real(truth)).abs() < real(most)
                };
                prop_assert!(within(bias, truth.bias[i], sigma, 0.02), "{}", flight.story());
                let truth = truth.matrix[(i, along)];
                prop_assert!(within(scale, truth, scale_sigma, 0.02), "{}", flight.story());
            } else {
                prop_assert!(
                    !sigma.is_finite() && !scale_sigma.is_finite(),
                    "{}",
                    flight.story()
                );
                // The values before are kept.
                prop_assert!(bias == T::zero() && scale.abs() == T::one(), "{}", flight.story());
            }
            for other in (0..3).filter(|other| !primary.of(sensor)[*other]) {
                prop_assert!(!record.matrix_sigma[(i, other)].is_finite(), "{}", flight.story());
            }
        }
    }
    Ok(())
}

/// Takes the primary away for the last seconds.
fn failed_over<T: Real>(primary: Axes, secondary: Axes, turn: &Matrix3<f64>, seed: u64) -> Flight<T, 2> {
    let parts = [Part::exact(), turned(turn)];
    let mut set = units::<T, 2>(&parts);
    set[0].axes = primary;
    set[1].axes = secondary;
    set[1].sensor_from_primary = cast(turn);
    let phases = [(2.5, Phase::Rest), (12.0, Phase::Free(1.0)), (6.0, Phase::Rest)];
    let mission = Mission::new(seed, &parts)
        .phases(&phases)
        .spoilt(|unit, time, _| unit == 1 || time < 16.0);
    let mut settings = settings();
    settings.selection.calibrated_only = false;
    fly(&platform(settings, set), &mission)
}

proptest! {
    #![proptest_config(cases(16))]

    #[test]
    fn axes_that_both_have_are_found_within_sigma_and_others_not(
        primary in axes(), secondary in axes(), turn in turn(), seed in any::<u64>()
    ) {
        shows_what_both_have::<f64>(primary, secondary, &turn, seed)?;
        shows_what_both_have::<f32>(primary, secondary, &turn, seed)?;
    }

    #[test]
    fn an_output_has_no_number_where_its_source_has_no_axis(
        primary in axes(), secondary in axes(), turn in turn(), seed in any::<u64>()
    ) {
        let flight = failed_over::<f32>(primary, secondary, &turn, seed);
        let last = flight.outputs.last().expect("somebody speaks");
        prop_assert_eq!(last.source, 1, "{}", flight.story());
        let mut lacks = false;
        for output in &flight.outputs {
            for (sensor, triad) in SENSORS.into_iter().zip([&output.specific_force, &output.angular_rate]) {
                for (axis, value) in triad.iter().enumerate() {
                    let row = turn.column(axis).iamax();
                    let has = if output.source == 0 { primary.of(sensor)[axis] } else { secondary.of(sensor)[row] };
                    prop_assert_eq!(value.is_finite(), has, "{:?}", output);
                    prop_assert!(has || value.is_nan(), "{:?}", output);
                    lacks |= output.source == 1 && primary.of(sensor)[axis] && !has;
                }
            }
        }
        prop_assert!(!lacks || last.degraded, "{:?}", last);
    }
}

#[test]
fn a_primary_of_one_axis_calibrates_that_axis_of_a_whole_unit() {
    let primary = Axes([false, false, false, false, false, true]);
    let flight = flown::<f32>(primary, Axes::ALL, &Matrix3::identity(), 5);
    assert_told!(flight, 1, 0 x EventKind::Triggered { sensors: [true, _] });
    let adopted = flight.adopted(1, Sensor::Gyroscope);
    assert_eq!(adopted.len(), 1, "{}", flight.story());
    let [x, y, z] = adopted[0].bias_sigma.into();
    assert!(
        !x.is_finite() && !y.is_finite() && z < 0.001,
        "{}",
        flight.story()
    );
}
