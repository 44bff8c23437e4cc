#!/bin/sh
# Installs what is missing of the tools for devices: an emulator, a C compiler for Cortex-M, CMake, and a memory checker.
set -eu

missing=
# Each line: something the package brings, and the package.
while read -r tool package; do
    command -v "$tool" >/dev/null 2>&1 || [ -e "$tool" ] || missing="$missing $package"
done <<TOOLS
qemu-system-arm qemu-system-arm
arm-none-eabi-gcc gcc-arm-none-eabi
/usr/share/doc/libnewlib-arm-none-eabi libnewlib-arm-none-eabi
cmake cmake
valgrind valgrind
g++ g++
/usr/include/cjson/cJSON.h libcjson-dev
TOOLS
[ -n "$missing" ] || exit 0

if [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
    echo "installing$missing"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update --quiet --quiet
    # Word by word: these are several packages.
    # shellcheck disable=SC2086
    apt-get install --yes --quiet --quiet --no-install-recommends $missing >/dev/null
else
    echo "make: tools for devices are missing; install, or ask root to:$missing" >&2
    exit 1
fi
