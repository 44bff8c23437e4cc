//! Makes the image unsound on purpose, to show that it would be noticed.

/// Does nothing unless a feature asks for it; `number` is one that the compiler does not know.
pub fn run(number: u32) {
    #[cfg(feature = "reach-a-panic")]
    panic(number);
    #[cfg(feature = "reach-the-heap")]
    heap::allocate(number);
    let _ = number;
}

#[cfg(feature = "reach-a-panic")]
#[allow(clippy::indexing_slicing)]
fn panic(number: u32) {
    let few = core::hint::black_box([1, 2, 3]);
    core::hint::black_box(few[number as usize]);
}

#[cfg(feature = "reach-the-heap")]
#[allow(unsafe_code)]
mod heap {
    extern crate alloc;

    use core::alloc::{GlobalAlloc, Layout};

    struct Nothing;

    // SAFETY: gives no memory at all, which is allowed.
    unsafe impl GlobalAlloc for Nothing {
        unsafe fn alloc(&self, _: Layout) -> *mut u8 {
            core::hint::black_box(core::ptr::null_mut())
        }

        unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
    }

    #[global_allocator]
    static HEAP: Nothing = Nothing;

    pub fn allocate(number: u32) {
        let layout = Layout::for_value(core::hint::black_box(&number));
        // SAFETY: four bytes are asked for, and nothing is done with them.
        core::hint::black_box(unsafe { alloc::alloc::alloc(layout) });
    }
}
