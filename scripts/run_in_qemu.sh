#!/bin/sh
# Runs an image on an emulated Cortex-M4F, which reads files relative to where this is started: run_in_qemu.sh IMAGE
set -eu

# A mission takes two seconds; an image that hangs is none.
exec timeout "${TUMBLE_QEMU_SECONDS:-120}" qemu-system-arm -M mps2-an386 -cpu cortex-m4 -nographic -monitor none -serial none \
    -semihosting-config enable=on,target=native -kernel "$1" </dev/null
