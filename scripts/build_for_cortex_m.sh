#!/bin/sh
# Proves that tumble-core and tumble-store build for a Cortex-M4F, where there is no operating system.
set -eu

cd "$(dirname "$0")/.."
exec scripts/cargo_for_cortex_m.sh build --locked --package tumble-core --package tumble-store
