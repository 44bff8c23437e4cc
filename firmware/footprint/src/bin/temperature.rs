//! Corrects samples with a turntable calibration at their temperature.
#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    footprint::use_temperature();
    loop {
        cortex_m::asm::wfi();
    }
}
