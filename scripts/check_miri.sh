#!/bin/sh
# Interprets tests of the device's crates with Miri, which finds undefined behaviour, use of memory that was not initialised, and overflow.
# It needs a nightly Rust with the component miri. Random and long tests are left out: Miri takes some thousand times as long.
set -eu
cd "$(dirname "$0")/.."
toolchain=${TUMBLE_NIGHTLY:-nightly}

if ! cargo "+$toolchain" miri --version >/dev/null 2>&1; then
    echo "no Miri: rustup toolchain install $toolchain --component miri --component rust-src" >&2
    exit 2
fi
export MIRIFLAGS="-Zmiri-disable-isolation"
cargo "+$toolchain" miri test --locked --package tumble-store --test laws -- --test-threads 1 \
    --skip proptest --skip changed --skip bytes_of_any_kind --skip power_cut --skip marginal --skip ecc --skip damage --skip ten_thousand \
    --skip plain_model --skip wire_format --skip every_ --skip starts_again --skip never_panics --skip outlasts_turnovers \
    --skip bit_for_bit --skip all_is_forgotten --skip nothing_outside --skip too_little
cargo "+$toolchain" miri test --locked --package tumble-capi --test settings
