//! Instructions of processors that Rust's core library does not offer.
#![no_std]

/// Square root, rounded to the nearest as IEEE 754 asks, and so the same bits on every machine; NaN of what is negative.
///
/// A Cortex-M with a floating-point unit has it in one instruction of 14 cycles, which `core` reaches on no stable compiler;
/// libm takes 200.
#[must_use]
#[inline]
pub fn square_root(square: f32) -> f32 {
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    {
        let mut bits = square.to_bits();
        // By way of a whole number: stable compilers give no register for floating point to a unit of single precision.
        // SAFETY: changes nothing but the register of the number, and one that it declares as changed.
        unsafe {
            core::arch::asm!(
                "vmov s0, {bits}",
                "vsqrt.f32 s0, s0",
                "vmov {bits}, s0",
                bits = inout(reg) bits,
                out("s0") _,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        f32::from_bits(bits)
    }
    #[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
    libm::sqrtf(square)
}

#[cfg(test)]
mod tests {
    use super::square_root;

    #[test]
    fn of_squares_it_is_what_was_squared() {
        for number in 0_u16..4096 {
            let root = f32::from(number);
            assert_eq!(square_root(root * root).to_bits(), root.to_bits());
        }
    }

    #[test]
    fn of_what_is_negative_there_is_none() {
        assert!(square_root(-1.0).is_nan());
        assert_eq!(square_root(-0.0).to_bits(), (-0.0_f32).to_bits());
    }
}
