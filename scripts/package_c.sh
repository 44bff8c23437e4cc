#!/bin/sh
# Packs what firmware in C needs and no Rust: header, static libraries, files for pkg-config and CMake, licences.
# package_c.sh OUT [CARGO_FOLDER [TARGET...]] writes OUT/tumble-VERSION-c.tar.gz; libraries are built in CARGO_FOLDER
# (target), for this machine and for the devices named, or all.
set -eu

root=$(cd "$(dirname "$0")/.." && pwd)
mkdir -p "$1"
out=$(cd "$1" && pwd)
cargo_folder=${2:-$root/target}
if [ $# -gt 2 ]; then shift 2; else set -- thumbv7em-none-eabihf thumbv6m-none-eabi; fi
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' "$root/Cargo.toml")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
name=tumble-$version-c

install_for() {
    target=$1
    build=$work/$target
    shift
    cmake -S "$root/crates/tumble-capi" -B "$build" --no-warn-unused-cli -DTUMBLE_CARGO_FOLDER="$cargo_folder" \
        -DCMAKE_INSTALL_LIBDIR="lib/$target" "$@" >"$work/log"
    TUMBLE_DEVICE_TARGET=$target cmake --build "$build" >>"$work/log"
    cmake --install "$build" --prefix "$work/$name" >>"$work/log"
}

host=$(rustc -vV | sed -n 's/^host: //p')
install_for "$host"
for target; do
    install_for "$target" -DTUMBLE_RUST_TARGET="$target" -DTUMBLE_CARGO="$root/scripts/cargo_for_device.sh"
done
cp "$root/LICENSE-APACHE" "$root/LICENSE-MIT" "$work/$name"

# The same sources give the same bytes, whenever and by whomever they are packed.
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@${SOURCE_DATE_EPOCH:-0}" -C "$work" -c "$name" |
    gzip -n -9 >"$out/$name.tar.gz"
echo "$out/$name.tar.gz"
