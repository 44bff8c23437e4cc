//! Calibrates by spins.
#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    footprint::use_spin();
    loop {
        cortex_m::asm::wfi();
    }
}
