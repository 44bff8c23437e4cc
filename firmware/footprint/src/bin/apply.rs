//! Corrects samples with a turntable calibration.
#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    footprint::use_apply();
    loop {
        cortex_m::asm::wfi();
    }
}
