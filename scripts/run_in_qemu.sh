#!/bin/sh
# Runs an image on an emulated microcontroller, a Cortex-M4F or that of TUMBLE_DEVICE_TARGET, which reads files relative
# to where this is started: run_in_qemu.sh IMAGE [OPTION OF QEMU...].
# It is stopped after TUMBLE_QEMU_SECONDS, 120 if that is not set.
set -eu

fail() {
    echo "run_in_qemu.sh: $1" >&2
    exit 2
}

target=${TUMBLE_DEVICE_TARGET:-thumbv7em-none-eabihf}
case $target in
thumbv7em-none-eabihf) emulator=qemu-system-arm machine="-M mps2-an386 -cpu cortex-m4" ;;
# A Cortex-M0, which has no instruction that a Cortex-M0+ lacks. The board has 16 KiB of memory; this one has more.
thumbv6m-none-eabi)
    emulator=qemu-system-arm
    machine="-M microbit -global nrf51-soc.flash-size=0x400000 -global nrf51-soc.sram-size=0x2000000"
    ;;
riscv32imc-unknown-none-elf) emulator=qemu-system-riscv32 machine="-M virt -bios none" ;;
*) fail "no machine is known for $target" ;;
esac

[ $# -ge 1 ] || fail "no image; say: run_in_qemu.sh IMAGE [OPTION OF QEMU...]"
[ -f "$1" ] || fail "$1: there is no such image; build it first"
for tool in timeout $emulator; do
    command -v "$tool" >/dev/null || fail "there is no $tool; scripts/install_test_tools.sh installs it on Debian"
done
image=$1
shift

# A mission takes two seconds; an image that hangs is none.
seconds=${TUMBLE_QEMU_SECONDS:-120}
status=0
# Options are words apart.
# shellcheck disable=SC2086
timeout "$seconds" $emulator $machine -nographic -monitor none -serial none \
    -semihosting-config enable=on,target=native "$@" -kernel "$image" </dev/null || status=$?
if [ "$status" -eq 124 ]; then
    echo "run_in_qemu.sh: $image was stopped after $seconds s; TUMBLE_QEMU_SECONDS=600 lets it run longer" >&2
fi
exit "$status"
