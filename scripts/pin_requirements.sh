#!/bin/sh
# Writes requirements/run.txt (to build and run), test.txt (to test and lint as well), and one list a group, every file by its
# hash, for every Python from 3.10 on and every platform: pin_requirements.sh BIN [--upgrade]
# What is pinned stays as it is while pyproject.toml allows it, unless --upgrade asks for the newest versions.
set -eu

bin=$1
upgrade=${2:-}
build=$(sed -n 's/^requires = \["\(.*\)"\]$/\1/p' pyproject.toml)

pin() {
    output=$1
    shift
    # Only the content of pyproject.toml and the public index may go in, whatever this machine is set to. No word where there
    # is no --upgrade. With extras: pip takes a newer version, without a hash, for one that is not pinned.
    # shellcheck disable=SC2086
    env -u UV_INDEX_URL -u UV_EXTRA_INDEX_URL -u UV_FIND_LINKS \
        "$bin/uv" pip compile "$@" --quiet $upgrade --universal --python-version 3.10 \
        --generate-hashes --no-strip-extras --no-emit-index-url --no-emit-find-links --no-annotate \
        --custom-compile-command "make requirements" --output-file "$output"
}

echo "$build" | pin requirements/run.txt pyproject.toml - --extra live
echo "$build" | pin requirements/test.txt pyproject.toml - --extra all --extra test --extra lint --constraint requirements/run.txt
for group in installer package audit; do
    pin requirements/$group.txt --group $group
done
pin requirements/mutants.txt --group mutants --constraint requirements/test.txt
