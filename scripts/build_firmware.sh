#!/bin/sh
# Builds the platform for the device as target/firmware/TARGET/platform, and the replay for the host as
# target/firmware/mission. TARGET is TUMBLE_DEVICE_TARGET, or a Cortex-M4F.
# With a feature of the platform named, builds it with that as platform-FEATURE beside it, and no replay.
set -eu

cd "$(dirname "$0")/.."
target=${TUMBLE_DEVICE_TARGET:-thumbv7em-none-eabihf}
folder=target/firmware/$target
feature=${1:-}

mkdir -p "$folder"
options="--quiet --locked --manifest-path firmware/Cargo.toml --target-dir target"
# Options are words apart.
# shellcheck disable=SC2086
scripts/cargo_for_device.sh build $options --profile device --package platform ${feature:+--features $feature}
cp "target/$target/device/platform" "$folder/platform${feature:+-$feature}"
if [ -z "$feature" ]; then
    # Built in the profile of the mission's tests, which shares their parts.
    # shellcheck disable=SC2086
    cargo build $options --package host
    cp target/debug/mission target/firmware/mission
fi
