//! Monitors three units.
#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    footprint::use_redundancy();
    loop {
        cortex_m::asm::wfi();
    }
}
