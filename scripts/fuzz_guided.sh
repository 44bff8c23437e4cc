#!/bin/sh
# Feeds a target (record, monitor, spin or calls) for TUMBLE_SOAK_SECONDS, an hour if that is not set, with inputs that
# libFuzzer makes of those that reached code which none had reached before. These are kept in target/guided/corpus/TARGET, as few as
# reach all of it. Inputs that failed are in target/guided/found/TARGET: one that is given as second argument is run alone.
set -eu
cd "$(dirname "$0")/.."
target=${1:?one of record, monitor, spin, calls}
input=${2:-}
folder=target/guided
host=$(rustc -vV | sed -n 's/^host: //p')
built=$folder/$host/fuzz

# As cargo-fuzz has it: which branches an input takes, and what it is compared with.
coverage="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table
    -Cllvm-args=-sanitizer-coverage-trace-compares"
# Named, so that what builds crates is not watched too.
options="--locked --quiet --profile fuzz --target $host --target-dir $folder"

scripts/install_test_tools.sh g++
# Options are words apart.
# shellcheck disable=SC2086
RUSTFLAGS=$coverage cargo build $options --package tumble-fuzz --bin tumble-fuzz-guided --features guided
program=$built/tumble-fuzz-guided
if [ "$target" = calls ]; then
    # shellcheck disable=SC2086
    RUSTFLAGS=$coverage cargo rustc $options --package tumble-capi --crate-type staticlib --features freestanding \
        --config 'profile.fuzz.panic="abort"'
    calls=crates/tumble-fuzz/calls
    program=$built/tumble-calls-guided
    fuzzer=$(ls -t "$built"/build/libfuzzer-sys-*/out/libfuzzer.a | head -n 1)
    "${CC:-cc}" -std=c11 -O1 -g -Wall -Wextra -Werror -pedantic -fsanitize=address,undefined \
        -fno-sanitize-recover=all -I crates/tumble-capi/include "$calls"/*.c "$calls"/guided/main.c \
        "$built/libtumble_capi.a" "$fuzzer" -lstdc++ -lm -o "$program"
fi

corpus=$folder/corpus/$target
found=$folder/found/$target
mkdir -p "$corpus" "$found"
# What libFuzzer gives back would be kept by the quarter of a gigabyte, and what is fed takes no heap.
export TUMBLE_FUZZ_TARGET="$target" ASAN_OPTIONS=detect_leaks=0:quarantine_size_mb=16
if [ -n "$input" ]; then
    exec "$program" "$input"
fi
"$program" -max_total_time="${TUMBLE_SOAK_SECONDS:-3600}" -timeout=60 -max_len=1024 -len_control=0 \
    -artifact_prefix="$found/" "$corpus"
rm -rf "$corpus.fewest"
mkdir "$corpus.fewest"
"$program" -merge=1 "$corpus.fewest" "$corpus"
rm -rf "$corpus"
mv "$corpus.fewest" "$corpus"
