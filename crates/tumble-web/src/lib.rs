//! Tumble for a web page: a page writes samples and a request, and reads an answer.
//!
//! [`numbers`] and [`text`] give the places that the page writes to, [`run`] answers the request, and [`answer`] is the place of
//! the answer. Requests and answers are JSON; what is no number in an answer is null.

mod acquired;
mod figures;
mod memory;
mod multipose;
mod request;
mod stamps;

use memory::with_memory;

/// Place of that many numbers, which the next request reads: see `figures::Samples`.
#[unsafe(no_mangle)]
pub extern "C" fn numbers(count: usize) -> *mut f64 {
    with_memory(|memory| memory.numbers(count))
}

/// Place of a request of that many bytes of UTF-8.
#[unsafe(no_mangle)]
pub extern "C" fn text(bytes: usize) -> *mut u8 {
    with_memory(|memory| memory.request(bytes))
}

/// Answers the request; returns the number of bytes of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn run() -> usize {
    with_memory(|memory| {
        let answer = request::answer(&memory.request, &mut memory.numbers);
        memory.answer = answer.to_string().into_bytes();
        memory.answer.len()
    })
}

/// Place of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    with_memory(|memory| memory.answer.as_ptr())
}
