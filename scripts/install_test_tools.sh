#!/bin/sh
# Installs what is missing of the programs that tests run, all of them or those named by their Debian packages: emulators,
# a C compiler for Cortex-M and its library, CMake, a memory checker, a C++ compiler, pkg-config, a JSON reader for tests in C,
# a browser that prints pages with a reader of what it printed, a font with Chinese letters, and Node for the page in a browser.
set -eu

has() {
    case $1 in
    qemu-system-misc) command -v qemu-system-riscv32 ;;
    gcc-arm-none-eabi) command -v arm-none-eabi-gcc ;;
    libnewlib-arm-none-eabi) echo '#include <stdlib.h>' | arm-none-eabi-gcc -E - ;;
    libcjson-dev) echo '#include <cjson/cJSON.h>' | "${CC:-cc}" -E - ;;
    g++) command -v g++ || command -v c++ ;;
    poppler-utils) command -v pdftotext ;;
    nodejs) command -v node ;;
    fonts-wqy-microhei) [ -e /usr/share/fonts/truetype/wqy/wqy-microhei.ttc ] ;;
    *) command -v "$1" ;;
    esac >/dev/null 2>&1
}

[ $# -gt 0 ] ||
    set -- qemu-system-arm qemu-system-misc gcc-arm-none-eabi libnewlib-arm-none-eabi cmake valgrind g++ libcjson-dev pkg-config \
        chromium poppler-utils fonts-wqy-microhei nodejs npm
missing=
for package in "$@"; do
    has "$package" || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

if [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
    echo "installing$missing"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update --quiet --quiet
    # Word by word: these are several packages.
    # shellcheck disable=SC2086
    apt-get install --yes --quiet --quiet --no-install-recommends $missing >/dev/null
else
    echo "make: programs that tests run are missing; install, or let root run $0 for:$missing (names of Debian's packages)" >&2
    exit 1
fi
