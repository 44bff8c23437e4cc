#!/bin/sh
# Builds the platform for the device, with any features named, and the replay for the host, under target/firmware.
set -eu

cd "$(dirname "$0")/.."
manifest=firmware/Cargo.toml
folder=target/firmware
features=${1:+--features $1}
# Word by word: one option and its value.
# shellcheck disable=SC2086
scripts/cargo_for_cortex_m.sh build --quiet --locked --release --manifest-path $manifest --target-dir "$folder${1:+/$1}" \
    --package platform $features
[ -n "${1:-}" ] || cargo build --quiet --locked --release --manifest-path $manifest --target-dir $folder --package host
