#!/bin/sh
# Writes requirements.txt (to build and run) and requirements-test.txt (to test and lint as well), every file by its
# hash, for every Python from 3.10 on and every platform: pin_requirements.sh BIN [--upgrade]
# What is pinned stays as it is while pyproject.toml allows it, unless --upgrade asks for the newest versions.
set -eu

bin=$1
upgrade=${2:-}
"$bin/python" -m pip --disable-pip-version-check install --quiet uv

build=$(sed -n 's/^requires = \["\(.*\)"\]$/\1/p' pyproject.toml)

pin() {
    output=$1
    shift
    # No word where there is no --upgrade. With extras: pip takes a newer version, without a hash, for one that is not pinned.
    # shellcheck disable=SC2086
    # Only what pyproject.toml and the public index say may go in, whatever this machine is set to.
    echo "$build" | env -u UV_INDEX_URL -u UV_EXTRA_INDEX_URL -u UV_FIND_LINKS \
        "$bin/uv" pip compile pyproject.toml - "$@" --quiet $upgrade --universal --python-version 3.10 \
        --generate-hashes --no-strip-extras --no-emit-index-url --no-emit-find-links --no-annotate \
        --custom-compile-command "make requirements" --output-file "$output"
}

pin requirements.txt --extra live
pin requirements-test.txt --extra all --extra test --extra lint --constraint requirements.txt
