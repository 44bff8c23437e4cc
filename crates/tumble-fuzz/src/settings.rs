//! Settings of a redundant set, from the usual to the worst that a platform takes.

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::ErrorModel;
use tumble_core::redundancy::platform::{MountedUnit, Platform, PrimaryCalibration, Range};
use tumble_core::redundancy::sensor::Axes;
use tumble_core::redundancy::settings::thresholds::Threshold;
use tumble_core::redundancy::settings::{
    CollectionSettings, Data, EvaluationSettings, FitModel, Gate, RedundancySettings, Scope,
};

use crate::draw::FuzzDraw;
use crate::mission::UNITS;

const SECOND: u64 = 1_000_000;

/// Identity of unit 0; the others count on from it.
pub const FIRST_IDENTITY: u64 = 10;

/// With times so short that a mission of a few seconds has everything in it.
fn short() -> RedundancySettings<f32> {
    let defaults = RedundancySettings::default();
    RedundancySettings {
        window: 20_000,
        evaluation: EvaluationSettings {
            rest_settle: 100_000,
            rest_duration: 400_000,
            evaluate_every: Some(5 * SECOND),
            ..defaults.evaluation
        },
        collection: CollectionSettings {
            collect: 4 * SECOND,
            collect_timeout: 8 * SECOND,
            motion_timeout: 5 * SECOND,
            fewest_pairs: 40,
            ..defaults.collection
        },
        ..defaults
    }
}

fn units() -> [MountedUnit<f32>; UNITS] {
    let mut identity = FIRST_IDENTITY;
    [(); UNITS].map(|()| {
        identity += 1;
        MountedUnit {
            lever_arm: Some(Vector3::zeros()),
            ..MountedUnit::new(identity - 1)
        }
    })
}

/// A set that works.
pub fn usual(draw: &mut FuzzDraw) -> Platform<f32, UNITS> {
    let (mut settings, mut units) = (short(), units());
    choose(draw, &mut settings);
    if draw.once_in(2) {
        units[1].lever_arm = None;
    }
    if draw.once_in(4) {
        units[2].axes = Axes([true, true, true, false, false, true]);
    }
    Platform::new(settings, PrimaryCalibration::none(), units).expect("usual settings are sound")
}

/// The worst that can be made of a set, if it still is one.
pub fn worst(draw: &mut FuzzDraw, of: &Platform<f32, UNITS>) -> Platform<f32, UNITS> {
    let (mut settings, mut units) = (*of.settings(), *of.units());
    let mut calibration = *of.calibration();
    for _ in 0..=draw.below(3) {
        match draw.below(6) {
            0 => *draw.among(numbers(&mut settings)) = draw.number(),
            1 => *draw.among(times(&mut settings)) = draw.time(),
            2 => tiny(draw, &mut settings),
            3 => choose(draw, &mut settings),
            4 => spoil_unit(draw, &mut units),
            _ => calibration = any_calibration(draw).unwrap_or(calibration),
        }
    }
    Platform::new(settings, calibration, units).unwrap_or(*of)
}

/// Draws settings that are choices.
fn choose(draw: &mut FuzzDraw, settings: &mut RedundancySettings<f32>) {
    settings.evaluation.gate = draw.pick(&[Gate::SecondaryAlone, Gate::WholePrimary, Gate::SensorBySensor]);
    settings.evaluation.data = draw.pick(&[Data::Raw, Data::Compensated]);
    settings.evaluation.vector_check = draw.once_in(2);
    settings.evaluation.evaluate_after_start = !draw.once_in(4);
    settings.collection.scope = draw.pick(&[Scope::AllSensors, Scope::TriggeringSensor]);
    settings.fit.largest_fit_model = draw.pick(&[
        FitModel::Offset,
        FitModel::Gain,
        FitModel::Affine,
        FitModel::AffineAndLeverArm,
    ]);
    settings.fit.fit_rests = !draw.once_in(4);
    let thresholds = &mut settings.evaluation.thresholds;
    for (threshold, fixed) in [
        (&mut thresholds.secondary.accelerometer, 0.1),
        (&mut thresholds.secondary.gyroscope, 0.01),
    ] {
        *threshold = draw.pick(&[
            Threshold::Fixed(fixed),
            Threshold::Fixed(fixed),
            Threshold::VariableByMargin(fixed),
            Threshold::VariableByRatio(2.0),
        ]);
    }
    settings.selection.return_after = draw.once_in(2).then_some(SECOND);
    settings.selection.calibrated_only = draw.once_in(2);
}

/// So short that a calibration begins and ends within tens of samples.
fn tiny(draw: &mut FuzzDraw, settings: &mut RedundancySettings<f32>) {
    settings.window = draw.pick(&[1, 1000, 4000, 8000, 10_000]);
    settings.evaluation.rest_settle = 0;
    settings.evaluation.rest_duration = 3 * settings.window;
    settings.evaluation.evaluate_every = Some(8 * settings.window);
    settings.collection.collect = 12 * settings.window;
    settings.collection.collect_timeout = 30 * settings.window;
    settings.collection.motion_timeout = 20 * settings.window;
    settings.collection.fewest_pairs = draw.pick(&[1, 2, 8]);
    settings.evaluation.thresholds.rest_scatter.specific_force =
        draw.pick(&[0.1, 10.0, 1e18, f32::MAX / 4.0]);
    settings.evaluation.thresholds.rest_scatter.angular_rate = draw.pick(&[0.02, 10.0, 1e18, f32::MAX / 4.0]);
    settings.collection.motion.specific_force =
        settings.evaluation.thresholds.rest_scatter.specific_force * 1.1;
    settings.collection.motion.angular_rate = settings.evaluation.thresholds.rest_scatter.angular_rate * 1.1;
}

fn spoil_unit(draw: &mut FuzzDraw, units: &mut [MountedUnit<f32>; UNITS]) {
    let number = draw.below(UNITS);
    let unit = &mut units[number];
    match draw.below(6) {
        0 => unit.identity = draw.time(),
        1 => unit.axes = Axes([(); 6].map(|()| draw.once_in(2))),
        2 => {
            unit.range = Range {
                specific_force: draw.once_in(2).then(|| draw.number()),
                angular_rate: draw.once_in(2).then(|| draw.number()),
            }
        }
        3 => unit.time_offset = draw.time().cast_signed(),
        4 => unit.sensor_from_primary = draw.rotation(),
        _ => unit.lever_arm = draw.once_in(4).then(|| draw.vector()),
    }
}

fn any_calibration(draw: &mut FuzzDraw) -> Option<PrimaryCalibration<f32>> {
    let [accelerometer, gyroscope] = [(); 2].map(|()| {
        let mut model = ErrorModel {
            matrix: Matrix3::from_fn(|i, j| f32::from(u8::from(i == j)) + draw.usual(0.1)),
            bias: Vector3::from_fn(|_, _| draw.usual(1.0)),
        };
        if draw.once_in(2) {
            draw.spoil(&mut model.matrix);
            draw.spoil(&mut model.bias);
        }
        model
    });
    PrimaryCalibration::new(accelerometer, gyroscope)
}

/// Every number that can be set.
fn numbers(settings: &mut RedundancySettings<f32>) -> [&mut f32; 31] {
    let RedundancySettings {
        evaluation,
        collection,
        fit,
        adoption,
        health,
        ..
    } = settings;
    let thresholds = &mut evaluation.thresholds;
    let [of_secondary, of_secondary_rate, of_primary, of_primary_rate] = [
        &mut thresholds.secondary.accelerometer,
        &mut thresholds.secondary.gyroscope,
        &mut thresholds.primary.accelerometer,
        &mut thresholds.primary.gyroscope,
    ]
    .map(|threshold| match threshold {
        Threshold::Fixed(number)
        | Threshold::FactoryByMargin(number)
        | Threshold::VariableByMargin(number)
        | Threshold::VariableByRatio(number) => number,
    });
    [
        &mut thresholds.rest_scatter.specific_force,
        &mut thresholds.rest_scatter.angular_rate,
        of_secondary,
        of_secondary_rate,
        of_primary,
        of_primary_rate,
        &mut evaluation.gravity,
        &mut collection.motion.specific_force,
        &mut collection.motion.angular_rate,
        &mut fit.excitation.specific_force,
        &mut fit.excitation.angular_rate,
        &mut fit.excitation_lever_arm,
        &mut adoption.improvement,
        &mut adoption.bias.specific_force,
        &mut adoption.bias.angular_rate,
        &mut adoption.largest_scale_error,
        &mut adoption.largest_misalignment,
        &mut adoption.largest_lever_arm,
        &mut adoption.drift.specific_force,
        &mut adoption.drift.angular_rate,
        &mut adoption.residual.specific_force,
        &mut adoption.residual.angular_rate,
        &mut health.spike.specific_force,
        &mut health.spike.angular_rate,
        &mut health.tolerated.specific_force,
        &mut health.tolerated.angular_rate,
        &mut health.per_kelvin.specific_force,
        &mut health.per_kelvin.angular_rate,
        &mut health.noise_ratio,
        &mut health.rest.specific_force,
        &mut health.rest.angular_rate,
    ]
}

/// Every length of time that can be set.
fn times(settings: &mut RedundancySettings<f32>) -> [&mut u64; 11] {
    let RedundancySettings {
        window,
        evaluation,
        collection,
        health,
        selection,
        ..
    } = settings;
    [
        window,
        &mut evaluation.rest_settle,
        &mut evaluation.rest_duration,
        evaluation.evaluate_every.get_or_insert(0),
        &mut collection.motion_timeout,
        &mut collection.collect,
        &mut collection.collect_timeout,
        &mut health.late,
        &mut health.frozen,
        &mut health.saturated,
        &mut selection.hold,
    ]
}
