//! Memory that a page and this library share.

use std::cell::RefCell;

/// Memory that a page and this library share.
#[derive(Default)]
pub struct PageMemory {
    /// Samples that the page gave.
    pub numbers: Vec<f64>,
    /// Request of the page.
    pub request: Vec<u8>,
    /// Answer to it.
    pub answer: Vec<u8>,
}

thread_local! {
    static MEMORY: RefCell<PageMemory> = RefCell::default();
}

/// Runs a function with the memory of this thread.
pub fn with_memory<T>(use_it: impl FnOnce(&mut PageMemory) -> T) -> T {
    MEMORY.with_borrow_mut(use_it)
}

impl PageMemory {
    /// Makes place for that many numbers.
    pub fn numbers(&mut self, count: usize) -> *mut f64 {
        self.numbers.resize(count, 0.0);
        self.numbers.as_mut_ptr()
    }

    /// Makes place for a request of that many bytes.
    pub fn request(&mut self, bytes: usize) -> *mut u8 {
        self.request.resize(bytes, 0);
        self.request.as_mut_ptr()
    }
}
