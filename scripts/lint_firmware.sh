#!/bin/sh
# Checks format and style of the firmware, each part for where it runs.
set -eu

cd "$(dirname "$0")/.."
options="--quiet --locked --manifest-path firmware/Cargo.toml --target-dir target"
cargo fmt --all --check --manifest-path firmware/Cargo.toml
# Options are words apart.
# shellcheck disable=SC2086
cargo clippy $options --all-targets -- -D warnings
# shellcheck disable=SC2086
scripts/cargo_for_device.sh clippy $options --package platform --package footprint -- -D warnings
# What is of RISC-V alone, where its target and clippy can be had.
export TUMBLE_DEVICE_TARGET=riscv32imc-unknown-none-elf
if scripts/cargo_for_device.sh clippy --version >/dev/null 2>&1; then
    # shellcheck disable=SC2086
    scripts/cargo_for_device.sh clippy $options --package platform -- -D warnings
else
    echo "lint_firmware.sh: there is no Rust for $TUMBLE_DEVICE_TARGET; its part of the platform is not checked" >&2
fi
