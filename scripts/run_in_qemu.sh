#!/bin/sh
# Runs an image on an emulated Cortex-M4F, which reads files relative to where this is started:
# run_in_qemu.sh IMAGE [OPTION OF QEMU...]. It is stopped after TUMBLE_QEMU_SECONDS, 120 if that is not set.
set -eu

fail() {
    echo "run_in_qemu.sh: $1" >&2
    exit 2
}

[ $# -ge 1 ] || fail "no image; say: run_in_qemu.sh IMAGE [OPTION OF QEMU...]"
[ -f "$1" ] || fail "$1: there is no such image; build it first"
for tool in timeout qemu-system-arm; do
    command -v "$tool" >/dev/null || fail "there is no $tool; scripts/install_device_tools.sh installs it on Debian"
done
image=$1
shift

# A mission takes two seconds; an image that hangs is none.
seconds=${TUMBLE_QEMU_SECONDS:-120}
status=0
timeout "$seconds" qemu-system-arm -M mps2-an386 -cpu cortex-m4 -nographic -monitor none -serial none \
    -semihosting-config enable=on,target=native "$@" -kernel "$image" </dev/null || status=$?
if [ "$status" -eq 124 ]; then
    echo "run_in_qemu.sh: $image was stopped after $seconds s; TUMBLE_QEMU_SECONDS=600 lets it run longer" >&2
fi
exit "$status"
