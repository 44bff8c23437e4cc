#!/bin/sh
# Builds the platform for the device as target/firmware/platform, and the replay for the host as target/firmware/mission.
# With a feature of the platform named, builds it with that as target/firmware/platform-FEATURE, and nothing else.
set -eu

cd "$(dirname "$0")/.."
folder=target/firmware
feature=${1:-}

mkdir -p $folder
options="--quiet --locked --profile device --manifest-path firmware/Cargo.toml --target-dir target"
# Options are words apart.
# shellcheck disable=SC2086
scripts/cargo_for_cortex_m.sh build $options --package platform ${feature:+--features $feature}
cp target/thumbv7em-none-eabihf/device/platform "$folder/platform${feature:+-$feature}"
if [ -z "$feature" ]; then
    # shellcheck disable=SC2086
    cargo build $options --package host
    cp target/device/mission "$folder/mission"
fi
