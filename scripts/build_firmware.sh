#!/bin/sh
# Builds the platform for the device as target/firmware/platform, and the replay for the host as target/firmware/mission.
# With a feature of the platform named, builds it with that as target/firmware/platform-FEATURE, and nothing else.
set -eu

cd "$(dirname "$0")/.."
folder=target/firmware
feature=${1:-}

options="--quiet --locked --release --manifest-path firmware/Cargo.toml --target-dir $folder"
# Options are words apart.
# shellcheck disable=SC2086
scripts/cargo_for_cortex_m.sh build $options --package platform ${feature:+--features $feature}
cp "$folder/thumbv7em-none-eabihf/release/platform" "$folder/platform${feature:+-$feature}"
if [ -z "$feature" ]; then
    # shellcheck disable=SC2086
    cargo build $options --package host
    cp "$folder/release/mission" "$folder/mission"
fi
