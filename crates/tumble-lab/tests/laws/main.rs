//! The laws of the host: whole recordings, clocks, health, and the turntable procedure on them.

#[allow(dead_code, unused_imports, unused_macros)]
#[path = "../../../tumble-core/tests/laws/common.rs"]
mod common;
#[allow(dead_code)]
#[path = "../../../tumble-core/tests/laws/spin_stream.rs"]
mod spin_stream;
#[allow(dead_code)]
#[path = "../../../tumble-core/tests/laws/stream.rs"]
mod stream;

mod acquisition;
mod align;
mod consistency;
mod correct;
mod health;
mod pairing;
mod rejection;
mod spin_grade;
mod trace;
mod turntable;
mod unit;
