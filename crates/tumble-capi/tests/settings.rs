//! Settings of C are those of the core.

use core::mem::MaybeUninit;

use tumble_capi::grade::Grade;
use tumble_capi::redundancy::{RedundancySettings, tumble_redundancy_defaults};
use tumble_capi::spin::{SpinSettings, tumble_spin_defaults, tumble_spin_defaults_for_grade};
use tumble_capi::status::Status;
use tumble_core::grade::Grade as CoreGrade;
use tumble_core::redundancy::settings::RedundancySettings as CoreRedundancySettings;
use tumble_core::spin::settings::SpinSettings as CoreSpinSettings;

#[test]
fn default_spin_settings_are_the_cores_and_convert_back() {
    let mut settings = MaybeUninit::<SpinSettings>::uninit();
    assert_eq!(
        // SAFETY: it points to settings that may be written.
        unsafe { tumble_spin_defaults(settings.as_mut_ptr()) },
        Status::TumbleOk
    );
    // SAFETY: the call before has filled it.
    let settings = unsafe { settings.assume_init() };
    assert_eq!(settings.in_core(), Ok(CoreSpinSettings::default()));
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
        let status =
            unsafe { tumble_spin_defaults_for_grade(settings.as_mut_ptr(), MaybeUninit::new(grade)) };
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
    let status = unsafe { tumble_redundancy_defaults(settings.as_mut_ptr()) };
    assert_eq!(status, Status::TumbleOk);
    // SAFETY: the call before has filled it.
    let settings = unsafe { settings.assume_init() };
    assert_eq!(settings.in_core(), Ok(CoreRedundancySettings::default()));
}
