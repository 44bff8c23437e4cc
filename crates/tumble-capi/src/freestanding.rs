//! The panic handler of a static library, which is never reached.

use core::panic::PanicInfo;

unsafe extern "C" {
    /// Nobody defines it.
    safe fn tumble_panic_is_reachable() -> !;
}

#[panic_handler]
fn on_panic(_: &PanicInfo) -> ! {
    tumble_panic_is_reachable()
}
