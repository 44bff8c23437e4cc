#!/bin/sh
# Flies the platform's mission on an emulated Cortex-M4F, or the processor of TUMBLE_DEVICE_TARGET, tells its story, and
# compares it with the host's replay.
set -eu

cd "$(dirname "$0")/.."
folder=target/firmware/${TUMBLE_DEVICE_TARGET:-thumbv7em-none-eabihf}
scripts/build_firmware.sh
if ! scripts/run_in_qemu.sh "$folder/platform" >"$folder/said.txt"; then
    if [ -s "$folder/said.txt" ]; then
        tail -n 3 "$folder/said.txt" >&2
        echo "make: the device did not end its mission; all it said is in $folder/said.txt" >&2
    fi
    exit 1
fi
target/firmware/mission compare vectors "$folder/said.txt"
