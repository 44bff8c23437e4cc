//! Settings that contradict each other, or themselves, are refused when a set is built, by name and with the reason.

use tumble_core::redundancy::platform::{MountedUnit, Platform, PlatformError, PrimaryCalibration};
use tumble_core::redundancy::settings::thresholds::Threshold;
use tumble_core::redundancy::settings::validate::{InvalidSetting, SettingError};
use tumble_core::redundancy::settings::{Data, RedundancySettings};

type Change = fn(&mut RedundancySettings<f64>);

fn refusal(change: Change) -> Option<PlatformError> {
    let mut settings = RedundancySettings::default();
    change(&mut settings);
    let units = [MountedUnit::new(1), MountedUnit::new(2)];
    Platform::new(settings, PrimaryCalibration::none(), units).err()
}

#[test]
fn settings_that_cannot_be_meant_are_refused_by_name_and_reason() {
    use SettingError::{
        AlwaysExceeded, MoreThanFit, NoLastError, NotAPartOfASecond, NotAShare, NotPositive, ShorterThan,
        SmallerThan,
    };
    let table: [(&str, SettingError, Change); 27] = [
        ("gravity", NotPositive, |s| s.evaluation.gravity = f64::NAN),
        ("window", NotPositive, |s| s.window = 0),
        ("rest_duration", NotPositive, |s| s.evaluation.rest_duration = 0),
        ("fewest_pairs", NotPositive, |s| s.collection.fewest_pairs = 0),
        ("rest_specific_force_scatter", NotPositive, |s| {
            s.evaluation.thresholds.rest_scatter.specific_force = 0.0
        }),
        ("largest_scale_error", NotPositive, |s| {
            s.adoption.largest_scale_error = -0.1
        }),
        ("improvement", NotAShare, |s| s.adoption.improvement = 1.0),
        ("improvement", NotAShare, |s| s.adoption.improvement = f64::NAN),
        ("secondary_accelerometer_threshold", AlwaysExceeded, |s| {
            s.evaluation.thresholds.secondary.accelerometer = Threshold::VariableByRatio(1.0);
        }),
        ("primary_gyroscope_threshold", AlwaysExceeded, |s| {
            s.evaluation.thresholds.primary.gyroscope = Threshold::Fixed(0.0);
        }),
        ("primary_accelerometer_threshold", NoLastError, |s| {
            s.evaluation.data = Data::Compensated;
            s.evaluation.thresholds.primary.accelerometer = Threshold::VariableByRatio(1.5);
        }),
        (
            "motion_specific_force",
            SmallerThan("rest_specific_force_scatter"),
            |s| {
                s.collection.motion.specific_force = 0.1;
            },
        ),
        ("noise_ratio", AlwaysExceeded, |s| s.health.noise_ratio = 1.0),
        ("tolerated_specific_force", NotPositive, |s| {
            s.health.tolerated.specific_force = f64::INFINITY
        }),
        ("tolerated_angular_rate", NotPositive, |s| {
            s.health.tolerated.angular_rate = -0.01
        }),
        (
            "largest_specific_force_bias",
            SmallerThan("tolerated_specific_force"),
            |s| s.health.tolerated.specific_force = 3.0,
        ),
        (
            "largest_specific_force_bias",
            SmallerThan("secondary_accelerometer_threshold"),
            |s| s.evaluation.thresholds.secondary.accelerometer = Threshold::FactoryByMargin(4.0),
        ),
        (
            "largest_angular_rate_bias",
            SmallerThan("secondary_gyroscope_threshold"),
            |s| s.evaluation.thresholds.secondary.gyroscope = Threshold::Fixed(1.0),
        ),
        (
            "tolerated_angular_rate",
            SmallerThan("secondary_gyroscope_threshold"),
            |s| s.evaluation.thresholds.secondary.gyroscope = Threshold::Fixed(0.9),
        ),
        ("window", NotAPartOfASecond, |s| s.window = 30_000),
        ("rest_duration", ShorterThan("window"), |s| {
            s.evaluation.rest_duration = s.window
        }),
        ("motion_timeout", NotPositive, |s| s.collection.motion_timeout = 0),
        ("motion_timeout", ShorterThan("window"), |s| {
            s.collection.motion_timeout = s.window
        }),
        ("collect_timeout", ShorterThan("collect"), |s| {
            s.collection.collect_timeout = s.collection.collect;
        }),
        ("evaluate_every", ShorterThan("rest_duration"), |s| {
            s.evaluation.evaluate_every = Some(1_000_000)
        }),
        ("fewest_pairs", MoreThanFit("collect"), |s| {
            s.collection.fewest_pairs = u32::MAX
        }),
        ("return_after", ShorterThan("hold"), |s| {
            s.selection.return_after = Some(20_000)
        }),
    ];
    for (setting, error, change) in table {
        let expected = PlatformError::Settings(InvalidSetting { setting, error });
        assert_eq!(refusal(change), Some(expected), "{setting}");
    }
    assert_eq!(refusal(|_| {}), None);
}

#[test]
fn times_longer_than_health_can_count_are_refused() {
    let refused = refusal(|settings| settings.health.frozen = u64::MAX);
    assert!(
        matches!(
            refused,
            Some(PlatformError::Settings(InvalidSetting {
                setting: "frozen",
                error: SettingError::TooLong(_)
            }))
        ),
        "{refused:?}"
    );
}

#[test]
fn a_threshold_that_only_a_refuted_unit_exceeds_is_refused() {
    let build = |unit: usize, threshold| {
        let mut units = [MountedUnit::new(1), MountedUnit::new(2)];
        units[unit].thresholds = [None, Some(Threshold::Fixed(threshold))];
        Platform::<f64, 2>::new(RedundancySettings::default(), PrimaryCalibration::none(), units).err()
    };
    assert_eq!(build(1, 1.0), Some(PlatformError::Threshold(1)));
    assert_eq!(build(1, 0.9), None);
    assert_eq!(build(0, 1.0), None);
}

#[test]
fn units_that_make_no_set_are_refused() {
    let build = |units| {
        Platform::<f64, 2>::new(RedundancySettings::default(), PrimaryCalibration::none(), units).err()
    };
    let units = [MountedUnit::new(1), MountedUnit::new(2)];
    let mut turned = units;
    turned[0].sensor_from_primary *= -1.0;
    let mut mirrored = units;
    mirrored[1].sensor_from_primary *= -1.0;
    let mut lost = units;
    lost[1].lever_arm = Some(nalgebra::Vector3::new(0.0, f64::INFINITY, 0.0));
    assert_eq!(build(turned), Some(PlatformError::Primary));
    assert_eq!(build(mirrored), Some(PlatformError::Mounting(1)));
    assert_eq!(build(lost), Some(PlatformError::Mounting(1)));
    assert_eq!(build([units[0]; 2]), Some(PlatformError::SameIdentity(1)));
    let alone = Platform::new(
        RedundancySettings::default(),
        PrimaryCalibration::none(),
        [MountedUnit::<f64>::new(1)],
    );
    assert_eq!(alone.err(), Some(PlatformError::TooFewUnits));
}
