//! The same targets, fed by libFuzzer, which sees what code an input reaches: `scripts/fuzz_guided.sh` builds and runs it.
//! `TUMBLE_FUZZ_TARGET` names the target, all arguments are libFuzzer's.
#![no_main]

use std::env;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use tumble_fuzz::draw::Draw;
use tumble_fuzz::target::Target;

fn target() -> &'static Target {
    static TARGET: OnceLock<Target> = OnceLock::new();
    TARGET.get_or_init(|| {
        let name = env::var("TUMBLE_FUZZ_TARGET").unwrap_or_default();
        Target::named(&name).expect("TUMBLE_FUZZ_TARGET names a target")
    })
}

fuzz_target!(|input: &[u8]| {
    if let Err(what) = target().run(Draw::of_input(input)) {
        panic!("{what}");
    }
});
