#!/bin/sh
# Interprets tests of the device's crates with Miri, which finds undefined behaviour, use of memory that was not initialised, and overflow.
# It needs a nightly Rust with the component miri. Random and long tests are left out, since Miri takes some thousand times as long.
set -eu
cd "$(dirname "$0")/.."
toolchain=${TUMBLE_NIGHTLY:-nightly}

if ! cargo "+$toolchain" miri --version >/dev/null 2>&1; then
    echo "no Miri: rustup toolchain install $toolchain --component miri --component rust-src" >&2
    exit 2
fi
export MIRIFLAGS="-Zmiri-disable-isolation"
export PROPTEST_CASES=2
cargo "+$toolchain" miri test --locked --package tumble-store --test laws -- --test-threads 1 \
    layout older_versions the_example a_record_without what_is_whole flash::an_ flash::the_factory flash::rolling \
    flash::what_cannot flash::nothing_is_written flash::a_refused a_whole_record_under
cargo "+$toolchain" miri test --locked --package tumble-capi --test settings
