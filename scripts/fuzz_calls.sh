#!/bin/sh
# Calls the C interface in hostile ways: builds the library with all checks, the program of crates/tumble-fuzz/calls with
# sanitizers, and runs it. Arguments go to it, such as --runs 1000 or --seed 7.
set -eu
cd "$(dirname "$0")/.."
calls=crates/tumble-fuzz/calls
built="${CARGO_TARGET_DIR:-target}"

cargo rustc --locked --quiet --package tumble-capi --crate-type staticlib --profile fuzz --features freestanding \
    --config 'profile.fuzz.panic="abort"'
"${CC:-cc}" -std=c11 -O1 -g -Wall -Wextra -Werror -pedantic -fsanitize=address,undefined -fno-sanitize-recover=all \
    -I crates/tumble-capi/include "$calls"/*.c "$calls"/by_seed/main.c "$built/fuzz/libtumble_capi.a" -lm \
    -o "$built/fuzz/tumble-calls"
exec "$built/fuzz/tumble-calls" "$@"
