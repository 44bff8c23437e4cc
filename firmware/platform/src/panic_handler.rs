//! Panic handler that is never reached.
//!
//! The handler calls a function that nobody defines. An image from which the compiler could not prove all panics away
//! therefore does not link, and the linker names the function.

use core::panic::PanicInfo;

#[allow(unsafe_code)]
unsafe extern "C" {
    fn tumble_panic_is_reachable() -> !;
}

#[panic_handler]
#[allow(unsafe_code)]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: never called, as it would not have been linked.
    unsafe { tumble_panic_is_reachable() }
}
