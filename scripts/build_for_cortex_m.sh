#!/bin/sh
# Proves that tumble-core and tumble-store build for a Cortex-M4F: no operating system, no heap.
set -eu

target=thumbv7em-none-eabihf
cd "$(dirname "$0")/.."

has_core() {
    ls "$(rustc --print target-libdir --target "$target")"/libcore-*.rlib >/dev/null 2>&1
}

if ! has_core && command -v rustup >/dev/null; then
    rustup target add "$target" || echo "the target could not be added; trying the compiler of the system" >&2
fi

if has_core; then
    cargo build --locked --package tumble-core --package tumble-store --target "$target"
    exit
fi

# Debian ships the sources of core beside its compiler, from which the target can be built.
sources=/usr/lib/rustlib/src/rust/library/core
if [ ! -d "$sources" ] && [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
    apt-get update --quiet --quiet
    apt-get install --yes --quiet --quiet --no-install-recommends rustc-web cargo-web rust-web-src
fi
if [ ! -d "$sources" ]; then
    echo "make: no Rust for $target; run: rustup target add $target" >&2
    exit 1
fi
# -Zbuild-std is not stable yet, and this variable is how a stable compiler is told to allow it.
RUSTC_BOOTSTRAP=1 RUSTC=/usr/bin/rustc /usr/bin/cargo build --locked --package tumble-core --package tumble-store \
    --target "$target" -Zbuild-std=core --target-dir target/system-compiler
