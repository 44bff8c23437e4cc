#!/bin/sh
# Prints the share of lines and branches of the isolation of faults that tests of Rust reach, and the branches that none reaches.
# It needs a nightly Rust with the component llvm-tools: coverage of branches is not in a stable one.
set -eu
cd "$(dirname "$0")/.."
toolchain=${TUMBLE_NIGHTLY:-nightly}
judge=crates/tumble-core/src/redundancy/isolation
built="${CARGO_TARGET_DIR:-target}/coverage"
tools=$(echo "$(rustc "+$toolchain" --print sysroot)"/lib/rustlib/*/bin)

if ! [ -x "$tools/llvm-cov" ]; then
    echo "no llvm-cov: rustup toolchain install $toolchain --component llvm-tools" >&2
    exit 2
fi
rm -rf "$built/profiles"
mkdir -p "$built/profiles"
export CARGO_TARGET_DIR="$built" RUSTFLAGS="-Cinstrument-coverage -Zcoverage-options=branch"
export LLVM_PROFILE_FILE="$PWD/$built/profiles/%m.profraw"
tests="--package tumble-core --package tumble-lab --tests"
# Word by word: these are several arguments.
# shellcheck disable=SC2086
cargo "+$toolchain" test --locked --quiet $tests redundancy >"$built/tests.log"
"$tools/llvm-profdata" merge --sparse "$built"/profiles/*.profraw --output "$built/merged.profdata"
# shellcheck disable=SC2086
objects=$(cargo "+$toolchain" test --locked --no-run --message-format json $tests redundancy 2>/dev/null |
    sed -n 's/.*"executable":"\([^"]*\)".*/--object \1/p')
# shellcheck disable=SC2086
"$tools/llvm-cov" report --instr-profile "$built/merged.profdata" --show-branch-summary --show-functions=false \
    $objects "$judge"
