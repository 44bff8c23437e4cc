//! Settings of C are those of the core.

use core::mem::MaybeUninit;

use tumble_capi::redundancy::{RedundancySettings, tumble_redundancy_defaults};
use tumble_capi::spin::{SpinSettings, tumble_spin_defaults};
use tumble_capi::status::Status;
use tumble_core::redundancy::settings::RedundancySettings as CoreRedundancySettings;
use tumble_core::spin::settings::SpinSettings as CoreSpinSettings;

#[test]
fn defaults_for_a_spin_are_those_of_the_core_and_come_back_as_such() {
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
fn defaults_for_a_redundant_set_are_those_of_the_core_and_come_back_as_such() {
    let mut settings = MaybeUninit::<RedundancySettings>::uninit();
    // SAFETY: it points to settings that may be written.
    let status = unsafe { tumble_redundancy_defaults(settings.as_mut_ptr()) };
    assert_eq!(status, Status::TumbleOk);
    // SAFETY: the call before has filled it.
    let settings = unsafe { settings.assume_init() };
    assert_eq!(settings.in_core(), Ok(CoreRedundancySettings::default()));
}
