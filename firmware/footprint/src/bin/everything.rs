//! All parts together.
#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    footprint::use_apply();
    footprint::use_spin();
    footprint::use_redundancy();
    footprint::use_store();
    loop {
        cortex_m::asm::wfi();
    }
}
