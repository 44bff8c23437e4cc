//! The same targets, fed by libFuzzer, which sees what code an input reaches: `scripts/fuzz_guided.sh` builds and runs it.
//! `TUMBLE_FUZZ_TARGET` names the target, all arguments are libFuzzer's.
#![no_main]

use std::env;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use tumble_fuzz::draw::FuzzDraw;
use tumble_fuzz::target::FuzzTarget;

fn target() -> &'static FuzzTarget {
    static TARGET: OnceLock<FuzzTarget> = OnceLock::new();
    TARGET.get_or_init(|| {
        let name = env::var("TUMBLE_FUZZ_TARGET").unwrap_or_default();
        FuzzTarget::named(&name).expect("TUMBLE_FUZZ_TARGET names a target")
    })
}

fuzz_target!(|input: &[u8]| {
    if let Err(what) = target().run(FuzzDraw::of_input(input)) {
        panic!("{what}");
    }
});
