#!/bin/sh
# Runs cargo for a Cortex-M4F, or for the target in TUMBLE_DEVICE_TARGET:
# scripts/cargo_for_device.sh build --locked --package tumble-core ...
# The compiler is rustup's, which is asked for the target if it lacks it, or else the system's.
set -eu

target=${TUMBLE_DEVICE_TARGET:-thumbv7em-none-eabihf}
# The part of Rust's library that is built from its sources for the target, and Debian's linker for it.
case "$target" in
    wasm32-*) library=std,panic_abort linker=wasm-ld ;;
    *) library=core linker=ld.lld ;;
esac
export CARGO_BUILD_TARGET="$target"

has_core() {
    ls "$(rustc --print target-libdir --target "$target")"/libcore-*.rlib >/dev/null 2>&1
}

if ! has_core && command -v rustup >/dev/null; then
    rustup target add "$target" >&2 || echo "the target could not be added; trying the compiler of the system" >&2
fi

if has_core; then
    exec cargo "$@"
fi

# Debian ships the sources of core beside its compiler, from which the target can be built.
packages="rustc-web cargo-web rust-web-src lld"
has_sources() {
    [ -d /usr/lib/rustlib/src/rust/library/core ] && command -v "$linker" >/dev/null
}
if ! has_sources && [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
    apt-get update --quiet --quiet || true
    # Words apart; other distributions have no such packages, which is said below.
    # shellcheck disable=SC2086
    apt-get install --yes --quiet --quiet --no-install-recommends $packages || true
fi
if ! has_sources; then
    echo "make: no Rust for $target; with rustup run: rustup target add $target (on Debian root can install: $packages)" >&2
    exit 1
fi
# rustup brings a linker along, Debian does not.
if ! command -v rust-lld >/dev/null; then
    export "CARGO_TARGET_$(echo "$target" | tr a-z.- A-Z__)_LINKER=$linker"
fi
# -Zbuild-std is not stable yet, and this variable is how a stable compiler is told to allow it.
export RUSTC_BOOTSTRAP=1 CARGO_UNSTABLE_BUILD_STD=$library RUSTC=/usr/bin/rustc
exec /usr/bin/cargo "$@"
