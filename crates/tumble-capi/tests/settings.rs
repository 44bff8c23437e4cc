//! Settings of C are those of the core.

use core::mem::MaybeUninit;

use tumble_capi::grade::Grade;
use tumble_capi::redundancy::{RedundancySettings, tumble_redundancy_defaults_of};
use tumble_capi::spin::{SpinSettings, tumble_spin_defaults_of};
use tumble_capi::status::Status;
use tumble_capi::version::TUMBLE_ABI;
use tumble_core::grade::Grade as CoreGrade;
use tumble_core::redundancy::settings::RedundancySettings as CoreRedundancySettings;
use tumble_core::spin::settings::SpinSettings as CoreSpinSettings;

#[test]
fn settings_of_another_size_or_layout_are_refused() {
    let mut settings = MaybeUninit::<RedundancySettings>::uninit();
    let size = size_of::<RedundancySettings>();
    for (size, version) in [(size - 8, TUMBLE_ABI), (size, TUMBLE_ABI + 1)] {
        // SAFETY: it points to settings that may be written.
        let status = unsafe { tumble_redundancy_defaults_of(settings.as_mut_ptr(), size, version) };
        assert_eq!(status, Status::TumbleErrorSize);
    }
    // SAFETY: it points to settings that may be written.
    let status = unsafe { tumble_redundancy_defaults_of(settings.as_mut_ptr(), size, TUMBLE_ABI) };
    assert_eq!(status, Status::TumbleOk);
    // SAFETY: the call before has filled it.
    let mut settings = unsafe { settings.assume_init() };
    settings.version += 1;
    assert_eq!(settings.in_core(), Err(Status::TumbleErrorSize));
}

#[test]
fn default_spin_settings_of_each_grade_are_the_cores() {
    let grades = [
        (Grade::Consumer, CoreGrade::Consumer),
        (Grade::Industrial, CoreGrade::Industrial),
        (Grade::Tactical, CoreGrade::Tactical),
        (Grade::Reference, CoreGrade::Reference),
    ];
    for (grade, of_core) in grades {
        let mut settings = MaybeUninit::<SpinSettings>::uninit();
        // SAFETY: it points to settings that may be written.
        let status = unsafe {
            tumble_spin_defaults_of(
                settings.as_mut_ptr(),
                size_of::<SpinSettings>(),
                TUMBLE_ABI,
                MaybeUninit::new(grade),
            )
        };
        assert_eq!(status, Status::TumbleOk);
        // SAFETY: the call before has filled it.
        let settings = unsafe { settings.assume_init() };
        assert_eq!(settings.in_core(), Ok(CoreSpinSettings::for_grade(of_core)));
        let instability = of_core.bias_instability::<f32>();
        assert_eq!(settings.angular_rate_instability, instability.angular_rate);
        assert_eq!(settings.specific_force_instability, instability.specific_force);
    }
    assert_eq!(
        CoreSpinSettings::<f32>::default(),
        CoreSpinSettings::for_grade(CoreGrade::Consumer)
    );
}

#[test]
fn default_redundancy_settings_are_the_cores_and_convert_back() {
    let mut settings = MaybeUninit::<RedundancySettings>::uninit();
    // SAFETY: it points to settings that may be written.
    let status = unsafe {
        tumble_redundancy_defaults_of(settings.as_mut_ptr(), size_of::<RedundancySettings>(), TUMBLE_ABI)
    };
    assert_eq!(status, Status::TumbleOk);
    // SAFETY: the call before has filled it.
    let settings = unsafe { settings.assume_init() };
    assert_eq!(settings.in_core(), Ok(CoreRedundancySettings::default()));
}
