#!/bin/sh
# Runs the laws of the C interface, in C and C++, with the library itself under AddressSanitizer, and the programs under
# AddressSanitizer and UndefinedBehaviorSanitizer. It needs a nightly Rust with the component rust-src.
set -eu
cd "$(dirname "$0")/.."
toolchain=${TUMBLE_NIGHTLY:-nightly}
host=$(rustc -vV | sed -n 's/^host: //p')
capi=crates/tumble-capi
built="${CARGO_TARGET_DIR:-target}/sanitized"
mkdir -p "$built"

# Checks of overflow and of indices stay in, so that a panic is compiled and ends the program.
RUSTFLAGS="-Zsanitizer=address -Cdebug-assertions=on" CARGO_TARGET_DIR="$built" cargo "+$toolchain" rustc --locked --quiet \
    -Zbuild-std=core,compiler_builtins --target "$host" --package tumble-capi --crate-type staticlib --profile fuzz \
    --features freestanding --config 'profile.fuzz.panic="abort"'
printf '#include <stdlib.h>\nvoid tumble_panic_is_reachable(void);\nvoid tumble_panic_is_reachable(void) { abort(); }\n' >"$built/panic.c"
checks="-g -O1 -Wall -Wextra -Werror -fsanitize=address,undefined -fno-sanitize-recover=all -I $capi/include"
${CC:-gcc} -std=c99 $checks -c "$built/panic.c" -o "$built/panic.o"
${CC:-gcc} -std=c99 $checks $capi/tests/c/*.c "$built/panic.o" "$built/$host/fuzz/libtumble_capi.a" -lcjson -lm -o "$built/laws_c"
${CXX:-g++} -std=c++17 $checks $capi/tests/cpp/*.cpp "$built/panic.o" "$built/$host/fuzz/libtumble_capi.a" -lcjson -lm -o "$built/laws_cpp"
"$built/laws_c" vectors
"$built/laws_cpp" vectors
