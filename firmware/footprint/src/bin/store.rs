//! Keeps records in flash.
#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    footprint::use_store();
    loop {
        cortex_m::asm::wfi();
    }
}
